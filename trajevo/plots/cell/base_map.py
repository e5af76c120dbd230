"""The map of the least of an objective over the places of a robot's base."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.ticker import MaxNLocator

from trajevo.base.arrays import Array
from trajevo.base.units import display, pretty
from trajevo.errors import InvalidInputError
from trajevo.formulation.cell.base_box import COORDINATES
from trajevo.formulation.cell.varied_points import VariedPoints
from trajevo.plots.paper import Width, key, panel, scale_beside, sequence
from trajevo.solvers.base_map import BaseMap

#: Error up to which a point is reached [m and rad].
_REACHED = 1e-6

#: Room around the points of the tool [m].
_AROUND = 0.05


def base_map(found: BaseMap, *, ax: Axes | None = None, width: Width = "column") -> Axes:
    """Map of the least of an objective over the places of a robot's base, as seen from above where these are x and y.

    Places from which a point is not reached are grey and hatched, those from which no motion keeps all limits are grey.
    A cross is the given place, a star the best one; on x and y the points of the tool are numbered dots.

    Args:
        found: the least values.
        ax: axes.
        width: ``"column"``, ``"page"`` or millimetres.

    Raises:
        InvalidInputError: what is given is no map.
    """
    if not isinstance(found, BaseMap):
        raise InvalidInputError(f"found: expected a map, as trajevo.base_map gives it, got {type(found).__name__}")
    places = [_shown(found, k) for k in range(2)]
    sides = [_edges(values) for values, _, _ in places]
    plain: dict[str, Any] = {"facecolor": "0.85", "linewidth": 0.0}
    hatched: dict[str, Any] = {"facecolor": "0.94", "edgecolor": "0.75", "hatch": "////", "linewidth": 0.0}
    with panel(ax, width=width, height=62.0) as ax:
        ax.add_patch(Rectangle((sides[0][0], sides[1][0]), *(float(np.ptp(one)) for one in sides), **plain))
        for row, column in np.argwhere(found.missed > _REACHED):
            corner = sides[0][column], sides[1][row]
            size = sides[0][column + 1] - corner[0], sides[1][row + 1] - corner[1]
            ax.add_patch(Rectangle(corner, *size, **hatched, zorder=1.5))
        handles: list[Any] = [Patch(label="a point is not reached", **hatched)]
        if (np.isnan(found.least) & (found.missed <= _REACHED)).any():
            handles.append(Patch(label="no motion keeps all limits", **plain))
        _values(found, places, ax)
        handles += _marks(found, places, ax)
        ax.set(xlabel=places[0][1], ylabel=places[1][1])
        points = _points(found)
        seen = [np.hstack([one, at - _AROUND, at + _AROUND]) for one, at in zip(sides, points.T, strict=True)]
        ax.set(**{f"{axis}lim": (one.min(), one.max()) for axis, one in zip("xy", seen, strict=True)})
        ax.margins(0.0)
        if set(found.axes) == {"x", "y"}:
            ax.set_aspect("equal")
        key(ax, handles)
    return ax


def _shown(found: BaseMap, which: int) -> tuple[Array, str, float]:
    """Places along an axis as they are shown, its label, and where the given place is on it."""
    axis, moved = found.axes[which], (found.columns, found.rows)[which]
    interpolant = found.problem.interpolant
    origin = interpolant.base_origin if isinstance(interpolant, VariedPoints) else None
    unit, factor = display(COORDINATES[axis], angle="deg")
    start = 0.0 if axis not in "xyz" or origin is None else float(origin["xyz".index(axis)])
    label = f"turn of the base [{unit}]" if axis == "yaw" else f"{axis} of the base [{unit}]"
    return factor * (start + moved), label, factor * start


def _edges(values: Array) -> Array:
    """Edges of cells around places, (N,) -> (N + 1,)."""
    half = 0.5 * (values[1] - values[0])
    return np.append(values - half, values[-1] + half)


def _values(found: BaseMap, places: list[tuple[Array, str, float]], ax: Axes) -> None:
    unit, factor = display(found.unit, angle=found.problem.angle, length=found.problem.length)
    values = np.ma.masked_invalid(factor * found.least)
    if not values.count():
        return
    columns, rows = places[0][0], places[1][0]
    image = ax.pcolormesh(columns, rows, values, cmap=sequence(), shading="nearest", zorder=2, rasterized=True)
    levels = MaxNLocator(7).tick_values(float(values.min()), float(values.max()))
    if np.ptp(values.compressed()) > 1e-6 * float(np.abs(values).max()):
        ax.contour(columns, rows, values, levels, colors="white", linewidths=0.5, zorder=2.5)
    scale_beside(ax, image, f"least {found.objective} [{pretty(unit)}]")


def _marks(found: BaseMap, places: list[tuple[Array, str, float]], ax: Axes) -> list[Any]:
    """Given and best place, and points of the tool; the entries of the legend."""
    given = ax.plot(places[0][2], places[1][2], "x", color="black", markersize=6, zorder=4, label="given place")
    handles: list[Line2D] = list(given)
    if np.isfinite(found.least).any():
        row, column = np.unravel_index(int(np.nanargmin(found.least)), found.least.shape)
        best = places[0][0][column], places[1][0][row]
        style: dict[str, Any] = {"color": "white", "markeredgecolor": "black", "markersize": 9}
        handles += ax.plot(*best, "*", zorder=4, label="best place", **style)
    points = _points(found)
    if len(points):
        handles += ax.plot(*points.T, "o", color="black", markersize=3.5, zorder=4, label="points", clip_on=False)
    for k, place in enumerate(points):
        ax.annotate(str(k), place, textcoords="offset points", xytext=(4, 3), zorder=4)
    return handles


def _points(found: BaseMap) -> Array:
    """The points of the tool on the plane of the map, (K, 2) [m]; none unless it is seen from above."""
    interpolant = found.problem.interpolant
    if set(found.axes) != {"x", "y"} or not isinstance(interpolant, VariedPoints):
        return np.empty((0, 2))
    at: Array = interpolant.arrangement.positions[:, ["xyz".index(axis) for axis in found.axes]]
    return at
