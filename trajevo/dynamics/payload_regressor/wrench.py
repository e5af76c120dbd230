"""The wrench that moves a body is linear in its ten inertial parameters: the matrix between them.

With the acceleration of the tool's origin less gravity, a, and its angular velocity ω and acceleration α, all along the
tool's axes, force and moment about the tool's origin are (Siciliano, Robotics, 2009, section 7.3)

    f = m a + (α × + ω × ω ×) m c
    n = m c × a + I α + ω × I ω
"""

from __future__ import annotations

import numpy as np

from trajevo.base.arrays import Array
from trajevo.robot.kinematics import crossed
from trajevo.robot.payload import PARAMETERS

#: Entry (row, column) of the inertia of each parameter from the fifth on: xx, xy, yy, xz, yz, zz.
_ENTRIES = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))


def wrench_regressor(acceleration: Array, angular_velocity: Array, angular_acceleration: Array) -> Array:
    """Force and moment at the tool per unit of each of the ten parameters; complex arrays stay complex.

    Args:
        acceleration: of the tool's origin less gravity, along the tool's axes, shape (..., 3) [m/s²].
        angular_velocity: of the tool along its axes, the same shape [rad/s].
        angular_acceleration: the same [rad/s²].

    Returns:
        Shape (..., 6, 10), force before moment, parameters in the order of :data:`trajevo.robot.payload.PARAMETERS`:
        [N or N·m per kg, kg·m or kg·m²].
    """
    kind = np.result_type(acceleration, angular_velocity, angular_acceleration)
    found = np.zeros((*acceleration.shape[:-1], 6, len(PARAMETERS)), dtype=kind)
    found[..., :3, 0] = acceleration
    for axis, unit in enumerate(np.eye(3)):
        along = np.broadcast_to(unit, acceleration.shape)
        turning = crossed(angular_velocity, crossed(angular_velocity, along))
        found[..., :3, 1 + axis] = crossed(angular_acceleration, along) + turning
        found[..., 3:, 1 + axis] = crossed(along, acceleration)
    for k, (i, j) in enumerate(_ENTRIES, start=4):
        found[..., 3:, k] = _turned(i, j, angular_acceleration)
        found[..., 3:, k] += crossed(angular_velocity, _turned(i, j, angular_velocity))
    return found


def _turned(i: int, j: int, vectors: Array) -> Array:
    """Vectors (..., 3) times the symmetric tensor with ones at (i, j) and (j, i)."""
    turned = np.zeros_like(vectors)
    turned[..., i] = vectors[..., j]
    turned[..., j] = vectors[..., i]
    return turned
