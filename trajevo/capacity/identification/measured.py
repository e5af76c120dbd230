"""Efforts of joints from what was logged: as they are, or from the currents of the motors."""

from __future__ import annotations

import numpy as np

from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError
from trajevo.robot.robot import Robot
from trajevo.trajectory.joint_log import JointLog


def measured_efforts(log: JointLog, robot: Robot, v: Array, a: Array) -> Array:
    """Efforts of the joints at the instants of a log, NaN for joints of which nothing was measured.

    A current becomes the torque of its motor by the torque constant and the gear ratio of the joint's drive. What the
    gear loses goes by the drive's efficiencies, with the rotor's inertia on the motor's side.

    Args:
        log: the log.
        robot: the robot.
        v: joint velocities, shape (T, n_joints) [rad/s or m/s].
        a: joint accelerations, the same shape [rad/s² or m/s²].

    Returns:
        Shape (T, n_joints) [N·m or N].

    Raises:
        InvalidInputError: neither efforts nor currents, or the current of a joint whose drive does not tell the torque.
    """
    efforts = log.effort.copy()
    by_current = np.isnan(efforts).all(axis=0) & np.isfinite(log.current).all(axis=0)
    for k in np.flatnonzero(by_current):
        efforts[:, k] = _of_current(log.current[:, k], robot, int(k), v[:, k], a[:, k])
    if np.isnan(efforts).all():
        raise InvalidInputError(
            f"{log.source}: expected the effort or current of at least one joint, such as a column "
            f"'{robot.joint_names[0]} effort [N*m]' or '{robot.joint_names[0]} current [A]', got none"
        )
    return efforts


def _of_current(current: Array, robot: Robot, k: int, v: Array, a: Array) -> Array:
    name = robot.joint_names[k]
    drive = robot.drives.get(name)
    constant, ratio = (None, None) if drive is None else (drive.torque_constant, drive.gear_ratio)
    if drive is None or constant is None or ratio is None:
        raise InvalidInputError(
            f"drives: expected torque_constant and gear_ratio of {name!r}, whose current is logged, for its torque"
        )
    driving, driven = drive.efficiencies
    rotor = robot.friction.armature[k] * a
    through = constant * ratio * current - rotor
    if driving == driven == 1.0:
        plain: Array = rotor + through
        return plain
    if driven == 0.0:
        raise InvalidInputError(f"efficiency_driven: the gear of {name!r} locks itself, so its current tells no load")
    way = np.sign(through * v)
    passed: Array = rotor + through * np.where(way > 0.0, driving, np.where(way < 0.0, 1.0 / driven, 1.0))
    return passed
