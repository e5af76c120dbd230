"""Pictures of motions: joints over time within their limits, and the path of the tool."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from trajevo.base.arrays import Array
from trajevo.base.units import display, per_time, pretty
from trajevo.dynamics.rollout import Rollout, rollout_of
from trajevo.front.front import Solution
from trajevo.plots.paper import BEYOND, LIMIT, NOTE, TWO_BESIDE, Width, colour, curve, inches, key, panel, panels
from trajevo.plots.pareto import clear_space
from trajevo.plots.scenery import BaseInCell
from trajevo.trajectory.batch import DERIVATIVES

#: A limit further from all curves than this share of their extent would leave them less than half of a panel.
NEAR = 0.5

#: Room between curves or limits and the edge of a panel, in extents of what is shown.
_MARGIN = 0.06

#: Height of a panel [mm].
PANEL = 32.0

#: Half the least length of an axis of a picture in space [m], for a tool that stays where it is.
_LEAST_REACH = 1e-6


def profiles(
    motion: Solution | Rollout,
    *,
    angle: str | None = None,
    samples: int = 500,
    via_times: Array | None = None,
    axes: Any = None,
    width: Width = "page",
) -> Any:
    """Position, velocity, acceleration and jerk of every joint within their limits.

    Args:
        motion: a solution of a front, or the first trajectory of a rollout.
        angle: ``"rad"`` or ``"deg"``; if None, the unit of a solution's problem, or ``"rad"`` for a rollout.
        samples: number of instants drawn.
        via_times: instants to mark on the position curves, shape (K,) [s]; a solution has its own.
        axes: four Axes.
        width: ``"column"``, ``"page"`` or millimetres.

    Returns:
        Array of four Axes. Dashed lines are the limits that the problem keeps, in the joint's colour where they are its
        own; grey is beyond those of all joints. Limits that would leave the curves less than half of a panel are told
        above it instead. If some joints are in metres and others in radians, every joint is shown as a share of its
        limits, with its range of positions from -1 to 1.
    """
    rollout, length = rollout_of(motion), "m"
    if isinstance(motion, Solution):
        problem = motion.front.problem
        angle, length = angle or problem.angle, problem.length
        via_times = problem.via_times(motion.x)[0] if via_times is None else via_times
    sampled, robot = rollout.trajectory[0].sample(samples), rollout.robot
    columns = 2 if inches(width) > TWO_BESIDE else 1
    with panels(axes, 4, width=width, columns=columns, height=PANEL, share=True) as made:
        for order, (ax, values) in enumerate(zip(made, (sampled.q, sampled.v, sampled.a, sampled.j), strict=True)):
            (lower, upper), offset, factor, name, unit = _joint_axis(rollout, order, angle or "rad", length)
            drawn = (values[0] - offset) * factor
            for joint, title in enumerate(robot.joint_names):
                ax.plot(sampled.t[0], drawn[:, joint], label=title, **curve(joint))
            if order == 0 and via_times is not None:
                via = (rollout.trajectory[0].evaluate(np.asarray(via_times))[0] - offset) * factor
                for joint in range(robot.dof):
                    ax.plot(via_times, via[:, joint], "o", color=colour(joint), markersize=2.5)
            draw_limits(ax, drawn, (lower - offset) * factor, (upper - offset) * factor, unit)
            ax.set_ylabel(name)
        for ax in made[-columns:]:
            ax.set_xlabel("time [s]")
        key(made[0])
    return made


def draw_limits(
    ax: Axes, drawn: Array, low: Array, high: Array, unit: str, *, coloured: bool = True, near: float = NEAR
) -> None:
    """Limits of curves where they are near; the others are told above the panel. Sets the range that is shown.

    Args:
        ax: axes.
        drawn: the curves, shape (T, n).
        low: lower limits, infinite where there is none, shape (n,).
        high: upper limits.
        unit: unit of all of them, as it is printed.
        coloured: whether a limit of a single curve has the colour of that curve.
        near: greatest distance of a limit that is drawn from all curves, in their extent.
    """
    least, most = float(drawn.min()), float(drawn.max())
    extent = max(most - least, 1e-9)
    near_low = np.isfinite(low) & (low >= least - near * extent)
    near_high = np.isfinite(high) & (high <= most + near * extent)
    for bounds, shown in ((low, near_low), (high, near_high)):
        for bound in np.unique(bounds[shown]):
            (own,) = np.nonzero(bounds == bound)
            tint = colour(int(own[0])) if coloured and len(own) == 1 < len(low) else LIMIT
            ax.axhline(bound, color=tint, linestyle=(0, (3, 2)), linewidth=0.7, gid="limit")
    bottom, top = min([least, *low[near_low]]), max([most, *high[near_high]])
    room = _MARGIN * max(top - bottom, 1e-9)
    bottom, top = bottom - room, top + room
    if near_high.all():
        ax.axhspan(float(high.max()), max(top, float(high.max())), color=BEYOND, zorder=0, linewidth=0)
    if near_low.all():
        ax.axhspan(min(bottom, float(low.min())), float(low.min()), color=BEYOND, zorder=0, linewidth=0)
    ax.set_ylim(bottom, top)
    note = _told(low[np.isfinite(low) & ~near_low], high[np.isfinite(high) & ~near_high], unit)
    if note:
        ax.set_title(note, loc="right", color=NOTE, gid="limits outside")


def _told(low: Array, high: Array, unit: str) -> str:
    """Limits that are not drawn, in words; the nearest ones if they differ."""
    if not len(low) and not len(high):
        return ""
    values = len(np.unique(low)), len(np.unique(high))
    nearest = "nearest limits" if max(values) > 1 else "limits" if all(values) else "limit"
    below, above = (_digits(low.max()) if len(low) else ""), (_digits(high.min()) if len(high) else "")
    both = f"±{above}" if below == f"−{above}" else ", ".join(filter(None, (below, above)))
    return f"{nearest} outside: {both}{' ' if unit else ''}{unit}"


def _digits(value: float) -> str:
    """A number of four digits, without a power of ten up to a million."""
    short = f"{value:.4g}"
    shown = np.format_float_positional(float(short), trim="-") if abs(value) < 1e6 else short
    return shown.replace("-", "−")


def _joint_axis(
    rollout: Rollout, order: int, angle: str, length: str
) -> tuple[tuple[Array, Array], Array, Array, str, str]:
    """Limits of a derivative, and offset, factor, label and unit that bring all joints onto one axis.

    Joints of one unit are shown in this unit; joints of different units as a share of each joint's limit.
    """
    limits, robot = rollout.limits, rollout.robot
    bounds = limits.bounds(DERIVATIVES[order])
    units = [display(per_time(unit, order), angle=angle, length=length) for unit in robot.joint_units]
    if len(set(units)) == 1:
        unit, factor = pretty(units[0][0]), units[0][1]
        return bounds, np.zeros(robot.dof), np.full(robot.dof, factor), f"{DERIVATIVES[order]} [{unit}]", unit
    finite = np.isfinite(bounds[0]) & np.isfinite(bounds[1])
    low, high = np.where(finite, bounds[0], -1.0), np.where(finite, bounds[1], 1.0)
    return bounds, 0.5 * (low + high), 2.0 / (high - low), f"{DERIVATIVES[order]} / limit", ""


def tool_path(motion: Solution | Rollout, *, samples: int = 400, ax: Any = None, width: Width = "column") -> Any:
    """Path of the tool frame's origin in 3D [m], by Pinocchio's forward kinematics.

    Args:
        motion: a solution of a front, or the first trajectory of a rollout.
        samples: number of instants drawn.
        ax: axes in space.
        width: ``"column"``, ``"page"`` or millimetres.
    """
    rollout = rollout_of(motion)
    rollout.robot.check_body("a picture of the tool's path")
    standing = BaseInCell.of(rollout)
    positions = standing(rollout.robot.tool_poses(rollout.trajectory[0].sample(samples).q[0])[0])
    with panel(ax, width=width, height=0.72 * 25.4 * inches(width), space=True) as space:
        space.plot(*positions.T, **curve(0))
        space.plot(*positions[0, :, None], "o", color=colour(5), linestyle="none", label="start")
        space.plot(*positions[-1, :, None], "s", color=colour(1), linestyle="none", label="end")
        if isinstance(motion, Solution):
            times = motion.front.problem.via_times(motion.x)[0]
            via = standing(rollout.robot.tool_poses(rollout.trajectory[0].evaluate(times)[0])[0])
            looks: dict[str, Any] = {"linestyle": "none", "label": "via points"}
            space.plot(*via[1:-1].T, "D", color=colour(3), markersize=3.5, **looks)
        equal_axes(space, positions)
        key(space)
    return space


def equal_axes(ax: Any, positions: Array) -> None:
    """Give 3D axes labels and one scale, around positions of shape (K, 3) [m]."""
    ax.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
    centre = 0.5 * (positions.max(axis=0) + positions.min(axis=0))
    reach = max(0.55 * np.ptp(positions, axis=0).max(), _LEAST_REACH)
    ax.set(**{f"{name}lim": (c - reach, c + reach) for name, c in zip("xyz", centre, strict=True)})
    clear_space(ax)
    ax.set_box_aspect((1, 1, 1), zoom=0.84)
    ax.view_init(elev=20, azim=30)
