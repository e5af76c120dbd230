"""Effort of the joints per unit of each of a payload's ten inertial parameters, for whole populations at once.

The wrench at the tool, which is linear in the parameters, bears on the joints by the transposed Jacobian. Unlike
:func:`trajevo.robot.payload.tool_regressor`, which asks Pinocchio state by state, one call takes arrays of any leading
shape, real or complex, and what it gives for a row does not depend on the other rows.
"""

from __future__ import annotations

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.payload_regressor.wrench import wrench_regressor
from trajevo.robot.kinematics import ToolKinematics
from trajevo.robot.robot import Robot


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
        InvalidInputError: the robot is joints and limits alone, or has another number of joints.
    """
    moved = ToolKinematics.of(robot).motion(q, v, a)
    gravity = (np.swapaxes(moved.rotation, -1, -2) @ robot.model.gravity.linear[:, None])[..., 0]
    wrench = wrench_regressor(moved.acceleration - gravity, moved.angular_velocity, moved.angular_acceleration)
    effort = np.zeros((*moved.jacobian.shape[:-2], robot.dof, wrench.shape[-1]), dtype=wrench.dtype)
    for row in range(6):  # sums of products, not one matrix product, whose last digits may depend on other rows
        effort += moved.jacobian[..., row, :, None] * wrench[..., row, None, :]
    return effort
