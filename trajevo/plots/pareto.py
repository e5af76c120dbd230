"""Pictures: each function draws into the axes it is given, or makes its own, and returns them.

Angles are shown in the problem's own unit unless ``angle="rad"`` or ``"deg"`` is passed.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from trajevo.arrays import Array, numbers
from trajevo.dynamics import Rollout, rollout_of
from trajevo.errors import InvalidInputError
from trajevo.front import Front, Solution
from trajevo.robot import Robot
from trajevo.selection import normalised
from trajevo.trajectory import DERIVATIVES
from trajevo.units import display, per_time, pretty

#: What is marked on a front: one solution, or label -> solution or objective values (n_obj,) in SI.
Marks = Solution | Mapping[str, Any] | None

_MARKERS = "*DPXos"
_SMALL_FRONT = 400

#: Ends of a range of positions further from all curves than this many times their extent are not drawn.
_FAR_AWAY = 3.0


def front(front: Front, *, mark: Marks = None, angle: str | None = None, axes: Any = None) -> Any:
    """Every pair of objectives as a scatter plot.

    Args:
        front: at least one solution.
        mark: what to mark.
        angle: ``"rad"`` or ``"deg"``.
        axes: one Axes per pair, in the order (0, 1), (0, 2), (1, 2), ...

    Returns:
        Array of Axes.
    """
    F, labels, factors = _shown(front, angle)
    if F.shape[1] < 2:
        raise InvalidInputError("front: expected at least 2 objectives, the front has 1")
    pairs = list(combinations(range(F.shape[1]), 2))
    rows = -(-len(pairs) // 3)
    panels = _panels(axes, len(pairs), rows, (4.6 * min(len(pairs), 3), 4.2 * rows))
    for panel, (i, k) in zip(panels, pairs, strict=True):
        panel.scatter(F[:, i], F[:, k], s=_size(front), color="tab:blue", alpha=0.6, linewidths=0, rasterized=True)
        for style, values in _marks(mark, factors):
            panel.plot(values[i], values[k], linestyle="none", **style)
        panel.set_xlabel(labels[i])
        panel.set_ylabel(labels[k])
        panel.grid(alpha=0.3)
    if mark:
        panels[0].legend()
    return panels


def front_3d(front: Front, *, mark: Marks = None, angle: str | None = None, ax: Any = None) -> Any:
    """Three objectives in space; of a front with more, the first three."""
    F, labels, factors = _shown(front, angle)
    if F.shape[1] < 3:
        raise InvalidInputError(f"front_3d: expected at least 3 objectives, the front has {F.shape[1]}")
    ax = ax or plt.figure(figsize=(7.5, 6.0)).add_subplot(projection="3d")
    ax.scatter(*F[:, :3].T, s=_size(front), c=F[:, 0], cmap="viridis", alpha=0.7, linewidths=0, rasterized=True)
    for style, values in _marks(mark, factors):
        ax.plot(*values[:3, None], linestyle="none", zorder=10, **style)
    ax.set(xlabel=labels[0], ylabel=labels[1], zlabel=labels[2])
    ax.set_box_aspect(None, zoom=0.85)
    ax.view_init(elev=22, azim=-125)
    if mark:
        ax.legend()
    return ax


def parallel_coordinates(front: Front, *, mark: Marks = None, angle: str | None = None, ax: Axes | None = None) -> Axes:
    """One line per solution across the normalised objectives; the ends of each axis carry its values."""
    F, labels, factors = _shown(front, angle)
    ax = ax or plt.subplots(figsize=(2.6 * F.shape[1], 4.4), layout="constrained")[1]
    positions = np.arange(F.shape[1])
    colours = plt.get_cmap("viridis")(normalised(F)[:, 0])
    for line, colour in zip(normalised(F), colours, strict=True):
        ax.plot(positions, line, color=colour, alpha=0.25 if len(F) < _SMALL_FRONT else 0.06, linewidth=0.8)
    low, width = F.min(axis=0), np.where(np.ptp(F, axis=0) > 0.0, np.ptp(F, axis=0), 1.0)
    for style, values in _marks(mark, factors):
        ax.plot(positions, (values - low) / width, linewidth=2.0, **style)
    for i in positions:
        ax.plot([i, i], [0.0, 1.0], color="black", linewidth=0.8)
        ax.annotate(f"{low[i]:.4g}", (i, 0.0), (0, -4), textcoords="offset points", ha="center", va="top")
        ax.annotate(f"{F[:, i].max():.4g}", (i, 1.0), (0, 4), textcoords="offset points", ha="center", va="bottom")
    ax.set_xticks(positions, labels)
    ax.tick_params(axis="x", pad=16, length=0)
    ax.set(yticks=[], xlim=(-0.3, positions[-1] + 0.3), ylim=(-0.02, 1.1))
    ax.spines[:].set_visible(False)
    if mark:
        ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4, frameon=False)
    return ax


def profiles(
    motion: Solution | Rollout,
    *,
    angle: str | None = None,
    samples: int = 1000,
    via_times: Array | None = None,
    axes: Any = None,
) -> Any:
    """Position, velocity, acceleration and jerk of every joint inside their limits.

    Args:
        motion: a solution of a front, or a rollout (of its batch, the first trajectory is drawn).
        angle: ``"rad"`` or ``"deg"``; a solution knows its problem's, a rollout's is ``"rad"``.
        samples: instants drawn.
        via_times: instants to mark on the position curves [s]; a solution knows its own.
        axes: four Axes.

    Returns:
        Array of four Axes. Dashed lines are a joint's limits; grey is beyond every joint's. Where metres and radians
        meet, every joint is shown as a share of its limits, its range of positions from -1 to 1.
    """
    rollout, length = rollout_of(motion), "m"
    if isinstance(motion, Solution):
        problem = motion.front.problem
        angle, length = angle or problem.angle, problem.length
        via_times = problem.via_times(motion.x)[0] if via_times is None else via_times
    panels = _panels(axes, 4, 4, (7.2, 9.0))
    sampled, robot = rollout.trajectory[0].sample(samples), rollout.robot
    for order, (panel, values) in enumerate(zip(panels, (sampled.q, sampled.v, sampled.a, sampled.j), strict=True)):
        (lower, upper), offset, factor, label = _joint_axis(robot, order, angle or "rad", length)
        drawn = (values[0] - offset) * factor
        low, high = (lower - offset) * factor, (upper - offset) * factor
        if order == 0:
            low, high = _without_far_away(drawn, low, high)
        for joint, name in enumerate(robot.joint_names):
            line = panel.plot(sampled.t[0], drawn[:, joint], label=name)[0]
            for bound in (low[joint], high[joint]):
                if np.isfinite(bound):
                    panel.axhline(bound, color=line.get_color(), linestyle="--", linewidth=0.8)
            if order == 0 and via_times is not None:
                via = rollout.trajectory[0].evaluate(np.asarray(via_times))[0, :, joint]
                at = (via - offset[joint]) * factor[joint]
                panel.plot(via_times, at, "o", color=line.get_color(), markersize=4)
        _shade_forbidden(panel, low, high)
        panel.set_ylabel(label)
        panel.grid(alpha=0.3)
    panels[0].legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=5, frameon=False)
    panels[-1].set_xlabel("time [s]")
    return panels


def _without_far_away(drawn: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """Ends of ranges of positions, infinite where drawing them would squash all curves."""
    room = _FAR_AWAY * max(float(np.ptp(drawn)), 1e-9)
    return (
        np.where(low < drawn.min() - room, -np.inf, low),
        np.where(high > drawn.max() + room, np.inf, high),
    )


def _joint_axis(robot: Robot, order: int, angle: str, length: str) -> tuple[tuple[Array, Array], Array, Array, str]:
    """Limits of a derivative, and offset, factor and label that bring all joints onto one axis.

    Joints of one unit are shown in it; metres and radians side by side are shown as a share of each joint's limit.
    """
    limits = robot.limits
    peak = (limits.upper, limits.velocity, limits.acceleration, limits.jerk)[order]
    bounds = (limits.lower, peak) if order == 0 else (-peak, peak)
    units = [display(per_time(unit, order), angle=angle, length=length) for unit in robot.joint_units]
    if len(set(units)) == 1:
        unit, factor = units[0]
        return bounds, np.zeros(robot.dof), np.full(robot.dof, factor), f"{DERIVATIVES[order]} [{pretty(unit)}]"
    finite = np.isfinite(bounds[0]) & np.isfinite(bounds[1])
    low, high = np.where(finite, bounds[0], -1.0), np.where(finite, bounds[1], 1.0)
    return bounds, 0.5 * (low + high), 2.0 / (high - low), f"{DERIVATIVES[order]} / limit"


def tool_path(motion: Solution | Rollout, *, samples: int = 400, ax: Any = None) -> Any:
    """Path of the tool frame's origin in space [m], by Pinocchio's forward kinematics."""
    rollout = rollout_of(motion)
    ax = ax or plt.figure(figsize=(6.6, 6.0)).add_subplot(projection="3d")
    positions, _ = rollout.robot.tool_poses(rollout.trajectory[0].sample(samples).q[0])
    ax.plot(*positions.T, color="tab:blue")
    ax.plot(*positions[0, :, None], "o", color="tab:green", label="start")
    ax.plot(*positions[-1, :, None], "s", color="tab:red", label="end")
    if isinstance(motion, Solution):
        times = motion.front.problem.via_times(motion.x)[0]
        via, _ = rollout.robot.tool_poses(rollout.trajectory[0].evaluate(times)[0])
        ax.plot(*via[1:-1].T, "o", color="tab:orange", linestyle="none", label="via points")
    equal_axes(ax, positions)
    ax.legend()
    return ax


def equal_axes(ax: Any, positions: Array) -> None:
    """Axes in space with labels and one scale, around positions of shape (K, 3) [m]."""
    ax.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
    centre, reach = 0.5 * (positions.max(axis=0) + positions.min(axis=0)), 0.55 * np.ptp(positions, axis=0).max()
    ax.set(**{f"{name}lim": (c - reach, c + reach) for name, c in zip("xyz", centre, strict=True)})
    for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
        axis.set_major_locator(MaxNLocator(4))
        axis.labelpad = 8
    ax.set_box_aspect((1, 1, 1), zoom=0.85)
    ax.view_init(elev=20, azim=30)


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
    """Style and display values of everything that is to be marked."""
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


def _shade_forbidden(panel: Axes, lower: Array, upper: Array) -> None:
    """Grey where no joint may go, without stretching the axis to far-away limits."""
    low, high = panel.get_ylim()
    if np.isfinite(upper).all():
        panel.axhspan(float(upper.max()), max(high, float(upper.max())), color="0.9", zorder=0)
    if np.isfinite(lower).all():
        panel.axhspan(min(low, float(lower.min())), float(lower.min()), color="0.9", zorder=0)
    panel.set_ylim(low, high)


def _size(front: Front) -> float:
    return 14.0 if len(front) < _SMALL_FRONT else 4.0
