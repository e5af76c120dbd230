"""Roll, pitch and yaw about fixed axes, as in a URDF, and rotation matrices."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from trajevo.base.arrays import Array, numbers
from trajevo.errors import InvalidInputError

Triple = tuple[float, float, float]

#: Error of a rotation matrix that is believed, and cosine of a pitch that leaves only roll and yaw together defined.
_ORTHOGONAL, _UPRIGHT = 1e-6, 1e-9


def matrix_of(rpy: Sequence[float]) -> Array:
    """Rotation matrix of roll, pitch and yaw [rad], shape (3, 3)."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(rpy), np.cos(rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def rpy_of(rotation: Any, where: str) -> Triple:
    """Roll, pitch and yaw of a rotation matrix [rad].

    Raises:
        InvalidInputError: no rotation matrix; the message begins with ``where``.
    """
    matrix = numbers(rotation, name=where, shape=(3, 3))
    orthogonal = np.allclose(matrix @ matrix.T, np.eye(3), atol=_ORTHOGONAL)
    if not (orthogonal and np.linalg.det(matrix) > 0.0):
        raise InvalidInputError(f"{where}: expected a rotation matrix, got {matrix.tolist()}")
    level = math.hypot(matrix[0, 0], matrix[1, 0])
    pitch = math.atan2(-matrix[2, 0], level)
    if level < _UPRIGHT:  # x points up or down
        return math.atan2(-matrix[1, 2], matrix[1, 1]), pitch, 0.0
    return math.atan2(matrix[2, 1], matrix[2, 2]), pitch, math.atan2(matrix[1, 0], matrix[0, 0])
