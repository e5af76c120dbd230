"""Pictures of fronts: each function draws into given axes, or makes its own, and returns them.

Angles are shown in the problem's own unit unless ``angle="rad"`` or ``"deg"`` is given.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.font_manager import FontProperties
from matplotlib.ticker import MaxNLocator

from trajevo.base.arrays import Array, numbers
from trajevo.base.units import display
from trajevo.errors import InvalidInputError
from trajevo.front.front import Front, Solution
from trajevo.front.selection import normalised
from trajevo.front.thinning import told_share
from trajevo.plots.layout import Rows, width_of
from trajevo.plots.limits.gap import band
from trajevo.plots.paper import NOTE, TWO_BESIDE, Width, colour, curve, inches, key, label, panel, panels, sequence
from trajevo.verification.front_bound import FrontBound

#: Marks on a front: one solution, or label -> solution or objective values (n_obj,) in SI.
Marks = Solution | Mapping[str, Any] | None
_MARKERS = "*DPXos"
_SMALL_FRONT = 400

#: Room above and below parallel axes for the values at their ends [pt].
_ENDS = 11.0


def front(
    front: Front,
    *,
    mark: Marks = None,
    bound: FrontBound | None = None,
    angle: str | None = None,
    axes: Any = None,
    width: Width | None = None,
) -> Any:
    """Every pair of objectives as a scatter plot.

    Args:
        front: at least one solution.
        mark: solutions or values to mark.
        bound: of :func:`trajevo.bound_front`: a band from what no motion can be better than to the best of the front.
        angle: ``"rad"`` or ``"deg"``.
        axes: one Axes per pair, in the order (0, 1), (0, 2), (1, 2), ...
        width: ``"column"``, ``"page"`` or millimetres; if None, a column for one pair and a page for more.

    Returns:
        Array of Axes.
    """
    F, labels, factors = _shown(front, angle)
    drawn = front.thinned()
    if F.shape[1] < 2:
        raise InvalidInputError("front: expected at least 2 objectives, the front has 1")
    pairs = list(combinations(range(F.shape[1]), 2))
    chosen: Width = width if width is not None else "page" if len(pairs) > 1 else "column"
    columns = min(len(pairs), 3) if inches(chosen) > TWO_BESIDE else 1 if len(pairs) <= 3 else 2
    dots: dict[str, Any] = {"s": _size(front), "color": colour(0), "alpha": 0.6, "linewidths": 0, "rasterized": True}
    with panels(axes, len(pairs), width=chosen, columns=columns, height=44.0 if columns < 2 else 38.0) as made:
        for ax, (i, k) in zip(made, pairs, strict=True):
            if bound is not None:
                band(ax, bound.points() * factors, F, (i, k))
            ax.scatter(F[drawn, i], F[drawn, k], **dots)
            for looks, values in _marks(mark, factors):
                ax.plot(values[i], values[k], linestyle="none", **looks)
            ax.set(xlabel=labels[i], ylabel=labels[k])
        made[0].set_title(told_share(drawn, front), loc="left", color=NOTE)
        if mark or bound is not None:
            key(made[0])
    return made


def front_3d(
    front: Front, *, mark: Marks = None, angle: str | None = None, ax: Any = None, width: Width = "column"
) -> Any:
    """The first three objectives in 3D.

    Args:
        front: at least one solution.
        mark: solutions or values to mark.
        angle: ``"rad"`` or ``"deg"``.
        ax: axes in space.
        width: ``"column"``, ``"page"`` or millimetres.
    """
    F, labels, factors = _shown(front, angle)
    if F.shape[1] < 3:
        raise InvalidInputError(f"front_3d: expected at least 3 objectives, the front has {F.shape[1]}")
    drawn = front.thinned()
    dots: dict[str, Any] = {"s": _size(front), "cmap": sequence(), "alpha": 0.8, "linewidths": 0, "rasterized": True}
    with panel(ax, width=width, height=0.68 * 25.4 * inches(width), space=True) as space:
        space.scatter(*F[drawn, :3].T, c=F[drawn, 0], **dots)
        for looks, values in _marks(mark, factors):
            space.plot(*values[:3, None], linestyle="none", zorder=10, **looks)
        space.set(xlabel=labels[0], ylabel=labels[1], zlabel=labels[2])
        space.set_box_aspect(None, zoom=0.9)
        space.view_init(elev=22, azim=-125)
        space.set_title(told_share(drawn, front), loc="left", color=NOTE)
        clear_space(space)
        if mark:
            key(space)
    return space


def clear_space(ax: Any) -> None:
    """Few ticks for axes in space, and labels that do not run into them."""
    for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
        axis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
        axis.set_tick_params(pad=-1.0)
        axis.labelpad = 0.0
        axis.pane.set(facecolor="none", edgecolor="0.8")
        axis._axinfo["grid"].update(linewidth=0.4, color="0.85")
    ax.zaxis.labelpad = -2.0
    ax.zaxis.set_rotate_label(False)
    ax.zaxis.label.set_rotation(90)


def parallel_coordinates(
    front: Front,
    *,
    mark: Marks = None,
    angle: str | None = None,
    ax: Axes | None = None,
    width: Width = "column",
) -> Axes:
    """One line per solution across the normalised objectives; the ends of each axis carry its values.

    Args:
        front: at least one solution.
        mark: solutions or values to mark.
        angle: ``"rad"`` or ``"deg"``.
        ax: axes.
        width: ``"column"``, ``"page"`` or millimetres.
    """
    F, labels, factors = _shown(front, angle)
    positions = np.arange(F.shape[1])
    drawn = front.thinned()
    heights = normalised(F)[drawn]
    lines = np.stack(np.broadcast_arrays(positions, heights), axis=2)
    faint = 0.25 if len(F) < _SMALL_FRONT else 0.06
    looks: dict[str, Any] = {"alpha": faint, "linewidths": 0.6, "rasterized": len(drawn) > _SMALL_FRONT}
    low, extent = F.min(axis=0), np.where(np.ptp(F, axis=0) > 0.0, np.ptp(F, axis=0), 1.0)
    with panel(ax, width=width, height=42.0) as ax:
        ax.add_collection(LineCollection(list(lines), colors=mpl.colormaps["viridis"](heights[:, 0]), **looks))
        for style, values in _marks(mark, factors):
            ax.plot(positions, (values - low) / extent, linestyle="-", linewidth=1.5, **style)
        for i in positions:
            ax.plot([i, i], [0.0, 1.0], "-", color="black", linewidth=0.6)
            ends: dict[str, Any] = {"textcoords": "offset points", "ha": "center"}
            ax.annotate(f"{low[i]:.4g}", (i, 0.0), (0, -3), va="top", **ends)
            ax.annotate(f"{F[:, i].max():.4g}", (i, 1.0), (0, 3), va="bottom", **ends)
        ax.set_xticks(positions, _beside(labels, 72.0 * inches(width) / (len(labels) - 0.4)))
        ax.tick_params(axis="x", pad=_ENDS + 2.0, length=0)
        ax.set_xlabel(told_share(drawn, front), color=NOTE)
        ax.set(yticks=[], xlim=(-0.3, positions[-1] + 0.3), ylim=(-0.02, 1.02))
        ax.spines[:].set_visible(False)
        engine = ax.figure.get_layout_engine()
        if isinstance(engine, Rows):
            engine.extra[ax] = (0.0, 0.0, 0.0, _ENDS)
        if mark:
            key(ax)
    return ax


def _beside(labels: list[str], room: float) -> list[str]:
    """Labels side by side, with units below; every second one lower if they are wider than their room [pt]."""
    texts, font = [text.replace(" [", "\n[") for text in labels], FontProperties(size=8.0)
    if max(width_of(text, font) for text in texts) > room - 8.0:
        texts = [("\n\n" if k % 2 else "") + text for k, text in enumerate(texts)]
    return texts


def hypervolume(front: Front, *, ax: Axes | None = None, width: Width = "column") -> Axes:
    """Hypervolume of all feasible points found so far, by generation."""
    with panel(ax, width=width, height=42.0) as ax:
        volumes = front.history.hypervolume
        ax.plot(np.arange(1, len(volumes) + 1), volumes, **curve(0))
        ax.set(xlabel="generation", ylabel="hypervolume / reference box")
    return ax


def _shown(front: Front, angle: str | None) -> tuple[Array, list[str], Array]:
    """Objectives in display units, axis labels, factors from SI."""
    if not len(front):
        raise InvalidInputError(f"the front is empty and cannot be drawn: {front.blocking}")
    labels, factors = quantities(front, angle)
    return front.F * factors, labels, factors


def quantities(front: Front, angle: str | None = None) -> tuple[list[str], Array]:
    """Labels of the objectives of a front, and factors from SI to their units."""
    record = front.record
    units = [display(one.unit, angle=angle or record.angle, length=record.length) for one in record.objectives]
    labels = [label(one.name.replace("_", " "), unit) for one, (unit, _) in zip(record.objectives, units, strict=True)]
    return labels, np.array([factor for _, factor in units])


def _marks(mark: Marks, factors: Array) -> list[tuple[dict[str, Any], Array]]:
    """Style and display values of all marks."""
    if mark is None:
        return []
    named = {mark.rule: mark} if isinstance(mark, Solution) else mark
    if not isinstance(named, Mapping):
        raise InvalidInputError(f"mark: expected a Solution or a mapping of labels, got {type(mark).__name__}")
    drawn = []
    for i, (name, marked) in enumerate(named.items()):
        own = marked.front.F[marked.index] if isinstance(marked, Solution) else marked
        values = numbers(own, name=f"mark {name!r}", shape=factors.shape)
        looks = {"marker": _MARKERS[i % 6], "color": colour(i + 1), "markersize": 8 if i == 0 else 5, "label": name}
        drawn.append((looks | {"markeredgecolor": "black", "markeredgewidth": 0.6}, values * factors))
    return drawn


def _size(front: Front) -> float:
    return 7.0 if len(front) < _SMALL_FRONT else 2.5
