"""Effort of the joints per unit of each of a payload's ten inertial parameters, for whole populations at once.

The wrench at the tool, which is linear in the parameters, bears on the joints by the transposed Jacobian. Unlike
:func:`trajevo.robot.payload.tool_regressor`, which asks Pinocchio state by state, one call takes arrays of any leading
shape, real or complex, and what it gives for a row does not depend on the other rows.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.payload_regressor.wrench import wrench_regressor
from trajevo.robot.kinematics import ToolKinematics, crossed
from trajevo.robot.robot import Robot


class _ToolMotion(NamedTuple):
    """Motion of the tool's origin along the tool's axes, and the Jacobian of the model's coordinates along them.

    Shapes (..., 3) [m/s², rad/s, rad/s²] and (..., 6, n_model), linear rows first; gravity is taken off.
    """

    acceleration: Array
    angular_velocity: Array
    angular_acceleration: Array
    jacobian: Array


def payload_regressor(robot: Robot, q: Array, v: Array, a: Array) -> Array:
    """Effort per unit of each of the ten parameters of a body that is fixed to the tool.

    Args:
        robot: the robot; its own masses do not matter.
        q: joint positions, shape (..., n_joints) [rad or m]; complex ones stay complex, as do the others.
        v: joint velocities, the same shape [rad/s or m/s].
        a: joint accelerations, the same shape [rad/s² or m/s²].

    Returns:
        Shape (..., n_joints, 10), parameters in the order of :data:`trajevo.robot.payload.PARAMETERS`
        [N·m or N per kg, kg·m or kg·m²].

    Raises:
        InvalidInputError: the robot is joints and limits alone.
    """
    kinematics = ToolKinematics.of(robot)
    kind = np.result_type(q, v, a)
    q, v, a = (np.asarray(x, dtype=kind) for x in (q, v, a))
    moved = _tool_motion(kinematics, robot, *robot.transmission.motion(q, v, a))
    wrench = wrench_regressor(moved.acceleration, moved.angular_velocity, moved.angular_acceleration)
    torque = np.zeros((*wrench.shape[:-2], robot.model.nv, wrench.shape[-1]), dtype=kind)
    for row in range(6):  # sums of products, not a matrix product, which would depend on the other rows
        torque += moved.jacobian[..., row, :, None] * wrench[..., row, None, :]
    effort = robot.transmission.effort(q, np.moveaxis(torque, -1, 0))
    found: Array = np.ascontiguousarray(np.moveaxis(effort, 0, -1))
    return found


def _tool_motion(kinematics: ToolKinematics, robot: Robot, q: Array, v: Array, a: Array) -> _ToolMotion:
    """Walk along the chain to the tool, in model coordinates, with all vectors along the axes of the link reached."""
    still = np.zeros((*q.shape[:-1], 3), dtype=q.dtype)
    velocity, turning, rate = still, still, still - robot.model.gravity.linear
    turning, acceleration, rate = still, still - np.asarray(robot.model.gravity.linear), still
    columns: list[tuple[int, Array, Array]] = []  # coordinate, linear and angular columns of the Jacobian
    del velocity
    for k, place in enumerate(kinematics.chain):
        offset = kinematics.translations[k]
        acceleration = acceleration + _carried(turning, rate, np.broadcast_to(offset, still.shape))
        columns = [(one, linear + crossed(angular, still + offset), angular) for one, linear, angular in columns]
        back = np.broadcast_to(kinematics.rotations[k].T, (*still.shape, 3)).astype(q.dtype)
        speed, gain = v[..., place, None], a[..., place, None]
        axis = still + kinematics.axes[k]
        if kinematics.turns[k]:
            back = _times(kinematics.turned_back(k, q[..., place]), kinematics.rotations[k].T)
        turning, rate, acceleration = (_apply(back, one) for one in (turning, rate, acceleration))
        columns = [(one, _apply(back, linear), _apply(back, angular)) for one, linear, angular in columns]
        if kinematics.turns[k]:
            rate = rate + axis * gain + crossed(turning, axis * speed)
            turning = turning + axis * speed
            columns.append((place, still, axis))
        else:
            moved = axis * q[..., place, None]
            acceleration = acceleration + _carried(turning, rate, moved) + axis * gain
            acceleration = acceleration + 2.0 * crossed(turning, axis * speed)
            columns = [(one, linear + crossed(angular, moved), angular) for one, linear, angular in columns]
            columns.append((place, axis, still))
    return _at_tool(kinematics, robot, still, (turning, rate, acceleration), columns)
