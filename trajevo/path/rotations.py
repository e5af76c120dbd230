"""Rotation matrices from the ways in which orientations are written: SciPy's, to the bit, but without its import.

SciPy goes by unit quaternions (x, y, z, w) and takes as long to import as all else that a task needs.
"""

from __future__ import annotations

import math

import numpy as np

from trajevo.base.arrays import Array

#: x, y, z, w.
_Quaternion = tuple[float, float, float, float]

#: Difference of R Rᵀ from the identity that counts as rounding.
_ORTHOGONAL = 1e-12


def of_rpy(angles: Array) -> Array:
    """The rotation matrix (3, 3) of roll, pitch and yaw (3,) about the fixed axes x, y and z [rad]."""
    roll, pitch, yaw = map(float, angles)
    first = (math.sin(roll / 2.0), 0.0, 0.0, math.cos(roll / 2.0))
    second = (0.0, math.sin(pitch / 2.0), 0.0, math.cos(pitch / 2.0))
    third = (0.0, 0.0, math.sin(yaw / 2.0), math.cos(yaw / 2.0))
    return _matrix(_product(third, _product(second, first)))


def of_quaternion(quaternion: Array) -> Array:
    """The rotation matrix (3, 3) of a quaternion x, y, z, w, shape (4,), of any norm but 0."""
    x, y, z, w = map(float, quaternion)
    return _matrix(_unit((x, y, z, w)))


def quaternion_of(matrix: Array) -> Array:
    """The quaternion x, y, z, w of norm 1 of a rotation matrix (3, 3), shape (4,)."""
    return np.array(_quaternion(matrix.tolist()))


def made_orthogonal(matrix: Array) -> Array:
    """The rotation matrix (3, 3) that is nearest to a matrix (3, 3) which is one but for rounding."""
    if not np.allclose(matrix @ matrix.T, np.eye(3), atol=_ORTHOGONAL):
        left, _, right = np.linalg.svd(matrix)
        matrix = left @ right
    return _matrix(_quaternion(matrix.tolist()))


def _product(p: _Quaternion, q: _Quaternion) -> _Quaternion:
    """The quaternion of turning by q and then by p."""
    return (
        p[3] * q[0] + q[3] * p[0] + (p[1] * q[2] - p[2] * q[1]),
        p[3] * q[1] + q[3] * p[1] + (p[2] * q[0] - p[0] * q[2]),
        p[3] * q[2] + q[3] * p[2] + (p[0] * q[1] - p[1] * q[0]),
        p[3] * q[3] - p[0] * q[0] - p[1] * q[1] - p[2] * q[2],
    )


def _unit(q: _Quaternion) -> _Quaternion:
    norm = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return q[0] / norm, q[1] / norm, q[2] / norm, q[3] / norm


def _matrix(quaternion: _Quaternion) -> Array:
    x, y, z, w = quaternion
    x2, y2, z2, w2 = x * x, y * y, z * z, w * w
    xy, zw, xz, yw, yz, xw = x * y, z * w, x * z, y * w, y * z, x * w
    return np.array(
        [
            [x2 - y2 - z2 + w2, 2.0 * (xy - zw), 2.0 * (xz + yw)],
            [2.0 * (xy + zw), -x2 + y2 - z2 + w2, 2.0 * (yz - xw)],
            [2.0 * (xz - yw), 2.0 * (yz + xw), -x2 - y2 + z2 + w2],
        ]
    )


def _quaternion(m: list[list[float]]) -> _Quaternion:
    """The unit quaternion of a rotation matrix, by the greatest of its entries (Markley 2008)."""
    diagonal = [m[0][0], m[1][1], m[2][2]]
    trace = diagonal[0] + diagonal[1] + diagonal[2]
    greatest = int(np.argmax([*diagonal, trace]))
    if greatest == 3:
        return _unit((m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1], 1.0 + trace))
    found, (i, j, k) = [0.0, 0.0, 0.0], ((greatest + step) % 3 for step in range(3))
    found[i] = 1.0 - trace + 2.0 * m[i][i]
    found[j] = m[j][i] + m[i][j]
    found[k] = m[k][i] + m[i][k]
    return _unit((found[0], found[1], found[2], m[k][j] - m[j][k]))
