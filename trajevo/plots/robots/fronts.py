"""The fronts of several robots at one task over one another, with what no robot beats."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from matplotlib.colors import to_rgb

from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError, checked_name
from trajevo.front.thinning import thinned
from trajevo.plots.paper import Width, colour, inches, key, label, panel
from trajevo.plots.pareto import clear_space

#: Markers of robots beside their colours, for print without colours.
_MARKERS = "osD^vPX"

#: Share of white in the colour of what is beaten.
_PALE = 0.65

#: Greatest number of motions of one robot that are drawn.
_MOST = 400


class _Robot(Protocol):
    @property
    def name(self) -> str: ...
    @property
    def F(self) -> Array: ...
    @property
    def best(self) -> Array: ...


class _Choice(Protocol):
    @property
    def robots(self) -> Sequence[_Robot]: ...
    @property
    def objective_names(self) -> tuple[str, ...]: ...
    def shown(self, column: int) -> tuple[str, str, float]: ...


def robot_fronts(
    choice: _Choice, *, objectives: Sequence[str] | None = None, ax: Any = None, width: Width = "column"
) -> Any:
    """The fronts of all robots in one picture: filled what no motion of any robot beats, pale what is beaten.

    What is beaten in all objectives may not look so in a picture of two of them, and the other way round.

    Args:
        choice: what :func:`trajevo.choose_robot` found.
        objectives: names of two objectives, or of three for a picture in space; all if there are two or three, else the
            first three.
        ax: axes, in space for three objectives; new ones if None.
        width: ``"column"``, ``"page"`` or millimetres.

    Returns:
        The axes.

    Raises:
        UnknownNameError: no such objective.
        InvalidInputError: another number of objectives, or no robot that can do the task.
    """
    if not hasattr(choice, "robots"):
        raise InvalidInputError(
            "choice: expected robots that were compared, as trajevo.choose_robot gives them, got "
            f"{type(choice).__name__}"
        )
    names = list(choice.objective_names[:3] if objectives is None else objectives)
    if len(names) not in (2, 3) or len(set(names)) != len(names):
        raise InvalidInputError(
            f"objectives: expected two or three of {', '.join(choice.objective_names)}, got {names}"
        )
    columns = [choice.objective_names.index(checked_name("objective", one, choice.objective_names)) for one in names]
    drawn = [(k, one) for k, one in enumerate(choice.robots) if len(one.F)]
    if not drawn:
        raise InvalidInputError("choice: no robot has a motion to draw")
    shown = [choice.shown(column) for column in columns]
    factors = np.array([factor for _, _, factor in shown])
    space = len(columns) == 3
    height = 0.72 * 25.4 * inches(width) if space else 50.0
    with panel(ax, width=width, height=height, space=space) as ax:
        for k, one in drawn:
            _draw(ax, one, one.F[:, columns] * factors, k)
        for axis, (name, unit, _) in zip("xyz", shown, strict=False):
            ax.set(**{f"{axis}label": label(name.replace("_", " "), unit)})
        if space:
            ax.set_box_aspect(None, zoom=0.88)
            ax.view_init(elev=20, azim=-125)
            clear_space(ax)
            ax.zaxis.set_tick_params(pad=3.0)  # a price has more digits than a time
            ax.zaxis.labelpad = 6.0
        key(ax)
    return ax


def _draw(ax: Any, one: _Robot, values: Array, number: int) -> None:
    """The motions of one robot, shape (N, 2 or 3) in the units that are shown."""
    for best in (False, True):
        rows = np.flatnonzero(one.best == best)
        if not len(rows):
            continue
        few = rows[thinned(values[rows], _MOST, kept=[])]
        looks: dict[str, Any] = {"marker": _MARKERS[number % len(_MARKERS)], "linestyle": "none", "rasterized": True}
        shade = colour(number) if best else _pale(colour(number))
        looks |= {"markersize": 4.5 if len(few) < 20 else 2.2, "color": shade, "markeredgewidth": 0.0}
        told = one.name if best else f"{one.name}, never the best" if not one.best.any() else f"{one.name}, beaten"
        ax.plot(*values[few].T, label=told, zorder=3 if best else 2, **looks)


def _pale(shade: str) -> tuple[float, float, float]:
    """A colour on its way to white."""
    red, green, blue = (_PALE + (1.0 - _PALE) * part for part in to_rgb(shade))
    return red, green, blue
