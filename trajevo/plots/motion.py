"""Pictures of motions: joints over time within their limits, and the path of the tool."""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from trajevo.base.arrays import Array
from trajevo.base.units import display, per_time, pretty
from trajevo.dynamics.rollout import Rollout, rollout_of
from trajevo.front.front import Solution
from trajevo.plots.pareto import (
    _panels,
)
from trajevo.trajectory.batch import DERIVATIVES

#: Ends of a position range are not drawn if they are further from all curves than this many times the curves' extent.
_FAR_AWAY = 3.0

#: Widths of the panels of profiles, of a legend entry's line with gaps, and of a letter [inch].
_WIDTH, _HANDLE, _LETTER = 6.4, 0.6, 0.08

#: Half the least length of an axis of a picture in space [m], for a tool that stays where it is.
_LEAST_REACH = 1e-6


def profiles(
    motion: Solution | Rollout,
    *,
    angle: str | None = None,
    samples: int = 1000,
    via_times: Array | None = None,
    axes: Any = None,
) -> Any:
    """Position, velocity, acceleration and jerk of every joint within their limits.

    Args:
        motion: a solution of a front, or the first trajectory of a rollout.
        angle: ``"rad"`` or ``"deg"``; if None, the unit of a solution's problem, or ``"rad"`` for a rollout.
        samples: number of instants drawn.
        via_times: instants to mark on the position curves [s]; a solution has its own.
        axes: four Axes.

    Returns:
        Array of four Axes. Dashed lines are a joint's limits; grey is beyond the limits of all joints. If some joints
        are in metres and others in radians, every joint is shown as a share of its limits, with its range of positions
        from -1 to 1.
    """
    rollout, length = rollout_of(motion), "m"
    if isinstance(motion, Solution):
        problem = motion.front.problem
        angle, length = angle or problem.angle, problem.length
        via_times = problem.via_times(motion.x)[0] if via_times is None else via_times
    panels = _panels(axes, 4, 4, (7.2, 9.0))
    sampled, robot = rollout.trajectory[0].sample(samples), rollout.robot
    for order, (panel, values) in enumerate(zip(panels, (sampled.q, sampled.v, sampled.a, sampled.j), strict=True)):
        (lower, upper), offset, factor, label = _joint_axis(rollout, order, angle or "rad", length)
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
    # As many columns as fit side by side, since the layout would squeeze the panels below a wider legend.
    columns = int(_WIDTH / (_HANDLE + _LETTER * max(map(len, robot.joint_names))))
    panels[0].legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=min(max(columns, 1), 5), frameon=False)
    panels[-1].set_xlabel("time [s]")
    return panels


def _without_far_away(drawn: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """Ends of position ranges, infinite where drawing them would flatten all curves."""
    room = _FAR_AWAY * max(float(np.ptp(drawn)), 1e-9)
    return (
        np.where(low < drawn.min() - room, -np.inf, low),
        np.where(high > drawn.max() + room, np.inf, high),
    )


def _joint_axis(rollout: Rollout, order: int, angle: str, length: str) -> tuple[tuple[Array, Array], Array, Array, str]:
    """Limits of a derivative, and offset, factor and label that bring all joints onto one axis.

    Joints of one unit are shown in this unit; joints of different units as a share of each joint's limit.
    """
    limits, robot = rollout.limits, rollout.robot
    bounds = limits.bounds(DERIVATIVES[order])
    units = [display(per_time(unit, order), angle=angle, length=length) for unit in robot.joint_units]
    if len(set(units)) == 1:
        unit, factor = units[0]
        return bounds, np.zeros(robot.dof), np.full(robot.dof, factor), f"{DERIVATIVES[order]} [{pretty(unit)}]"
    finite = np.isfinite(bounds[0]) & np.isfinite(bounds[1])
    low, high = np.where(finite, bounds[0], -1.0), np.where(finite, bounds[1], 1.0)
    return bounds, 0.5 * (low + high), 2.0 / (high - low), f"{DERIVATIVES[order]} / limit"


def tool_path(motion: Solution | Rollout, *, samples: int = 400, ax: Any = None) -> Any:
    """Path of the tool frame's origin in 3D [m], by Pinocchio's forward kinematics."""
    rollout = rollout_of(motion)
    rollout.robot.check_body("a picture of the tool's path")
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
    """Give 3D axes labels and one scale, around positions of shape (K, 3) [m]."""
    ax.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
    centre = 0.5 * (positions.max(axis=0) + positions.min(axis=0))
    reach = max(0.55 * np.ptp(positions, axis=0).max(), _LEAST_REACH)
    ax.set(**{f"{name}lim": (c - reach, c + reach) for name, c in zip("xyz", centre, strict=True)})
    for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
        axis.set_major_locator(MaxNLocator(4))
        axis.labelpad = 8
    ax.set_box_aspect((1, 1, 1), zoom=0.85)
    ax.view_init(elev=20, azim=30)


def _shade_forbidden(panel: Axes, lower: Array, upper: Array) -> None:
    """Shade grey what is beyond the limits of all joints, without stretching the axis to far-away limits."""
    low, high = panel.get_ylim()
    if np.isfinite(upper).all():
        panel.axhspan(float(upper.max()), max(high, float(upper.max())), color="0.9", zorder=0)
    if np.isfinite(lower).all():
        panel.axhspan(min(low, float(lower.min())), float(lower.min()), color="0.9", zorder=0)
    panel.set_ylim(low, high)
