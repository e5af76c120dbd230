"""Pictures of fronts: each function draws into given axes, or makes its own, and returns them.

Angles are shown in the problem's own unit unless ``angle="rad"`` or ``"deg"`` is given.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from trajevo.base.arrays import Array, numbers
from trajevo.base.units import display, pretty
from trajevo.errors import InvalidInputError
from trajevo.front.front import Front, Solution
from trajevo.front.selection import normalised
from trajevo.front.thinning import told_share

#: Marks on a front: one solution, or label -> solution or objective values (n_obj,) in SI.
Marks = Solution | Mapping[str, Any] | None
_MARKERS = "*DPXos"
_SMALL_FRONT = 400


def front(front: Front, *, mark: Marks = None, angle: str | None = None, axes: Any = None) -> Any:
    """Every pair of objectives as a scatter plot.

    Args:
        front: at least one solution.
        mark: solutions or values to mark.
        angle: ``"rad"`` or ``"deg"``.
        axes: one Axes per pair, in the order (0, 1), (0, 2), (1, 2), ...

    Returns:
        Array of Axes.
    """
    F, labels, factors = _shown(front, angle)
    drawn = front.thinned()
    if F.shape[1] < 2:
        raise InvalidInputError("front: expected at least 2 objectives, the front has 1")
    pairs = list(combinations(range(F.shape[1]), 2))
    rows = -(-len(pairs) // 3)
    panels = _panels(axes, len(pairs), rows, (4.6 * min(len(pairs), 3), 4.2 * rows))
    dots: dict[str, Any] = {"s": _size(front), "color": "tab:blue", "alpha": 0.6, "linewidths": 0, "rasterized": True}
    for panel, (i, k) in zip(panels, pairs, strict=True):
        panel.scatter(F[drawn, i], F[drawn, k], **dots)
        for style, values in _marks(mark, factors):
            panel.plot(values[i], values[k], linestyle="none", **style)
        panel.set_xlabel(labels[i])
        panel.set_ylabel(labels[k])
        panel.grid(alpha=0.3)
    panels[0].set_title(told_share(drawn, front), fontsize="small", loc="left")
    if mark:
        panels[0].legend()
    return panels


def front_3d(front: Front, *, mark: Marks = None, angle: str | None = None, ax: Any = None) -> Any:
    """The first three objectives in 3D."""
    F, labels, factors = _shown(front, angle)
    if F.shape[1] < 3:
        raise InvalidInputError(f"front_3d: expected at least 3 objectives, the front has {F.shape[1]}")
    ax = ax or plt.figure(figsize=(7.5, 6.0)).add_subplot(projection="3d")
    drawn = front.thinned()
    ax.scatter(*F[drawn, :3].T, s=_size(front), c=F[drawn, 0], cmap="viridis", alpha=0.7, linewidths=0, rasterized=True)
    for style, values in _marks(mark, factors):
        ax.plot(*values[:3, None], linestyle="none", zorder=10, **style)
    ax.set(xlabel=labels[0], ylabel=labels[1], zlabel=labels[2])
    ax.set_box_aspect(None, zoom=0.85)
    ax.view_init(elev=22, azim=-125)
    ax.set_title(told_share(drawn, front), fontsize="small")
    if mark:
        ax.legend()
    return ax


def parallel_coordinates(front: Front, *, mark: Marks = None, angle: str | None = None, ax: Axes | None = None) -> Axes:
    """One line per solution across the normalised objectives; the ends of each axis carry its values."""
    F, labels, factors = _shown(front, angle)
    ax = ax or plt.subplots(figsize=(2.6 * F.shape[1], 4.4), layout="constrained")[1]
    positions = np.arange(F.shape[1])
    drawn = front.thinned()
    heights = normalised(F)[drawn]
    colours = plt.get_cmap("viridis")(heights[:, 0])
    lines = np.stack(np.broadcast_arrays(positions, heights), axis=2)
    faint = 0.25 if len(F) < _SMALL_FRONT else 0.06
    ax.add_collection(LineCollection(list(lines), colors=colours, alpha=faint, linewidths=0.8))
    low, width = F.min(axis=0), np.where(np.ptp(F, axis=0) > 0.0, np.ptp(F, axis=0), 1.0)
    for style, values in _marks(mark, factors):
        ax.plot(positions, (values - low) / width, linewidth=2.0, **style)
    for i in positions:
        ax.plot([i, i], [0.0, 1.0], color="black", linewidth=0.8)
        ax.annotate(f"{low[i]:.4g}", (i, 0.0), (0, -4), textcoords="offset points", ha="center", va="top")
        ax.annotate(f"{F[:, i].max():.4g}", (i, 1.0), (0, 4), textcoords="offset points", ha="center", va="bottom")
    ax.set_xticks(positions, labels)
    ax.tick_params(axis="x", pad=16, length=0)
    ax.set_xlabel(told_share(drawn, front), fontsize="small")
    ax.set(yticks=[], xlim=(-0.3, positions[-1] + 0.3), ylim=(-0.02, 1.1))
    ax.spines[:].set_visible(False)
    if mark:
        ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4, frameon=False)
    return ax


def hypervolume(front: Front, *, ax: Axes | None = None) -> Axes:
    """Hypervolume of all feasible points found so far, by generation."""
    ax = ax or plt.subplots(figsize=(6.4, 4.0), layout="constrained")[1]
    ax.plot(np.arange(1, len(front.history.hypervolume) + 1), front.history.hypervolume)
    ax.set(xlabel="generation", ylabel="hypervolume (share of the reference box)")
    ax.grid(alpha=0.3)
    return ax


def _shown(front: Front, angle: str | None) -> tuple[Array, list[str], Array]:
    """Objectives in display units, axis labels, factors from SI."""
    if not len(front):
        raise InvalidInputError(f"the front is empty and cannot be drawn: {front.blocking}")
    record = front.record
    units = [
        display(objective.unit, angle=angle or record.angle, length=record.length) for objective in record.objectives
    ]
    factors = np.array([factor for _, factor in units])
    labels = [
        f"{objective.name} [{pretty(unit)}]"
        for objective, (unit, _) in zip(front.record.objectives, units, strict=True)
    ]
    return front.F * factors, labels, factors


def _marks(mark: Marks, factors: Array) -> list[tuple[dict[str, Any], Array]]:
    """Style and display values of all marks."""
    if mark is None:
        return []
    named = {mark.rule: mark} if isinstance(mark, Solution) else mark
    if not isinstance(named, Mapping):
        raise InvalidInputError(f"mark: expected a Solution or a mapping of labels, got {type(mark).__name__}")
    colours = ["tab:red", "tab:orange", "tab:green", "tab:purple", "tab:brown", "tab:pink"]
    drawn = []
    for i, (label, marked) in enumerate(named.items()):
        own = marked.front.F[marked.index] if isinstance(marked, Solution) else marked
        values = numbers(own, name=f"mark {label!r}", shape=factors.shape)
        style = {"marker": _MARKERS[i % 6], "color": colours[i % 6], "markersize": 13 if i == 0 else 8, "label": label}
        drawn.append((style | {"markeredgecolor": "black"}, values * factors))
    return drawn


def _panels(axes: Any, count: int, rows: int, size: tuple[float, float]) -> Any:
    if axes is None:
        axes = plt.subplots(rows, -(-count // rows), figsize=size, layout="constrained", squeeze=False)[1]
    panels = np.atleast_1d(np.asarray(axes, dtype=object)).ravel()
    if len(panels) != count:
        raise InvalidInputError(f"axes: expected {count}, got {len(panels)}")
    return panels


def _size(front: Front) -> float:
    return 14.0 if len(front) < _SMALL_FRONT else 4.0
