"""Points the shorter way round: whole turns of a joint put a robot into the same posture."""

from __future__ import annotations

import numpy as np

from trajevo.base.arrays import Array
from trajevo.errors import checked_name
from trajevo.robot.robot import Robot

#: How joint positions are taken: as they are written, or shifted by whole turns to the nearest ones.
WAYS = ("as_written", "shortest")

_TURN = 2.0 * np.pi

#: Difference from a whole number of turns that is rounding.
_ROUNDING = 1e-9


def check_way(turns: str) -> str:
    """The way round that a caller asks for.

    Raises:
        UnknownNameError: none of :data:`WAYS`.
    """
    return checked_name("turns", turns, WAYS)


def turning_joints(robot: Robot) -> Array:
    """Joints a whole turn of which puts every link of the robot where it was, a mask of shape (n_joints,)."""
    still = np.zeros((1 + robot.dof, robot.dof))
    turned = still.copy()
    turned[1:] = _TURN * np.eye(robot.dof)
    here, *there = robot.transmission.motion(turned, still, still)[0]
    moved = (np.array(there) - here) / _TURN
    whole = np.abs(moved - np.rint(moved)) < _ROUNDING
    back: Array = np.where(robot.joint_axes[1], whole, moved == 0.0).all(axis=1)
    return back


def the_shorter_way(robot: Robot, positions: Array) -> Array:
    """Points in which every joint that turns is at most half a turn from the point before, if its range allows it.

    Args:
        robot: the robot; where no number of turns leads into a joint's range, its position stays as it is.
        positions: shape (n_points, n_joints) [rad or m]; the first point stays as it is.

    Returns:
        The same postures, the same shape.
    """
    lower, upper, found = robot.limits.lower, robot.limits.upper, np.array(positions)
    turning = turning_joints(robot)
    for k in range(1, len(found)):
        least, most = np.ceil((lower - found[k]) / _TURN), np.floor((upper - found[k]) / _TURN)
        turns = np.clip(np.rint((found[k - 1] - found[k]) / _TURN), least, most)
        found[k] += np.where(turning & (least <= most), _TURN * turns, 0.0)
    return found
