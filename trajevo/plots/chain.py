"""An arm along a motion: its chain at some instants, in one picture."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from trajevo.base.arrays import Array
from trajevo.dynamics.rollout import Rollout, rollout_of
from trajevo.errors import InvalidInputError
from trajevo.front.front import Solution
from trajevo.plots.motion import equal_axes
from trajevo.plots.paper import Width, inches, panel, scale_beside, sequence
from trajevo.plots.scenery import BaseInCell, Surface, scenery
from trajevo.robot.robot import Robot

_BLUE, _SOLID, _GROUND = 0x1F77B4, 0xB0A090, 0xD9DDE1

#: Width of what is drawn of a plane, in extents of the whole motion.
_WIDE = 1.6


def stick_figure(motion: Solution | Rollout, *, count: int = 6, ax: Any = None, width: Width = "column") -> Any:
    """The chain from the base over the joints' origins to the tool at some instants, and the tool's path, in 3D [m].

    Obstacles of a solution are drawn too, and what is attached to links where it is at the end.

    Args:
        motion: a solution of a front, or the first trajectory of a rollout.
        count: number of instants drawn, evenly spaced from first to last; the colour is the time.
        ax: 3D axes.
        width: ``"column"``, ``"page"`` or millimetres.

    Returns:
        The axes.

    Raises:
        InvalidInputError: not a motion, a count that is not a positive whole number, or 2D axes.
    """
    rollout = rollout_of(motion)
    rollout.robot.check_body("a picture of the arm")
    if not isinstance(count, int | np.integer) or isinstance(count, bool) or count < 1:
        raise InvalidInputError(f"count: expected a positive whole number, got {count!r}")
    trajectory, robot = rollout.trajectory[0], rollout.robot
    standing = BaseInCell.of(rollout)
    path = standing(robot.tool_poses(trajectory.sample(400).q[0])[0])
    times = np.linspace(0.0, float(trajectory.duration[0]), count)
    chains = standing(chains_of(robot, trajectory.evaluate(times)[0]))
    with panel(ax, width=width, height=0.75 * 25.4 * inches(width), space=True) as space:
        colours = ScalarMappable(Normalize(0.0, float(trajectory.duration[0])), sequence())
        for chain, time in zip(chains, times, strict=True):
            space.plot(*chain.T, "o-", color=colours.to_rgba(time), linewidth=1.8, markersize=3)
        space.plot(*path.T, "-", color="black", linewidth=0.7)
        around = _surroundings(space, motion, rollout, chains, standing)
        shown = np.concatenate([path, chains.reshape(-1, 3), *around])
        equal_axes(space, shown)
        stand_upright(space, robot)
        scale_beside(space, colours, "time [s]")
    return space


def chains_of(robot: Robot, q: Array) -> Array:
    """Base, origins of the joints and tool at each configuration, shape (T, n_joints + 2, 3) [m]."""
    origins, _ = robot.joint_poses(q)
    return np.concatenate([np.zeros_like(origins[:, :1]), origins], axis=1)


def stand_upright(ax: Any, robot: Robot) -> None:
    """Show the arm upright: the axis nearest to gravity is vertical, the view turned over if the axis points down."""
    gravity = np.asarray(robot.model.gravity.linear)
    vertical = int(np.abs(gravity).argmax()) if gravity.any() else 2
    if gravity[vertical] > 0.0:  # turn the view, since an inverted axis would show a mirrored arm
        ax.view_init(elev=-20, azim=-60, roll=180, vertical_axis="xyz"[vertical])
    else:
        ax.view_init(elev=20, azim=-60, vertical_axis="xyz"[vertical])


def _surroundings(ax: Any, motion: Any, rollout: Rollout, chains: Array, standing: BaseInCell) -> list[Array]:
    """Draw the scene at the end of the motion; points that are to be seen, (K, 3) [m] each."""
    corners = chains.reshape(-1, 3)
    low, high = corners.min(axis=0), corners.max(axis=0)
    spare, end = float(np.ptp(corners, axis=0).max()), rollout.trajectory[0].evaluate(rollout.trajectory.duration)[0]
    positions, rotations = rollout.robot.joint_poses(end)
    seen = []
    for surface in _surfaces(motion, chains):
        drawn = surface.triangles
        if surface.motion is not None:
            (rotation,), (position,) = surface.motion.poses(rollout.trajectory[0].duration)
            drawn = drawn @ rotation.T + position
        if surface.joint:
            drawn = drawn @ rotations[0, surface.joint - 1].T + positions[0, surface.joint - 1]
        if surface.joint is not None:
            drawn = standing(drawn)
        colour = f"#{_GROUND if surface.endless else _BLUE if surface.attached else _SOLID:06x}"
        ax.add_collection3d(Poly3DCollection(drawn, facecolor=colour, alpha=0.15 if surface.endless else 0.35))
        if not surface.endless:
            seen.append(np.clip(drawn.reshape(-1, 3), low - spare, high + spare))
    return seen


def _surfaces(motion: Any, chains: Array) -> list[Surface]:
    corners = chains.reshape(-1, 3)
    low, high = corners.min(axis=0), corners.max(axis=0)
    return scenery(motion, 0.5 * (low + high), _WIDE * float(np.linalg.norm(high - low)))
