"""Kinematics of the PUMA 560 in closed form, and the points of Raji et al. 2022.

Standard Denavit-Hartenberg frames with the shoulder as the origin (d₁ = 0): q = (q₁, ..., q₆) [rad], p the tool's
origin [m], which is where the axes of the wrist meet, R its rotation. Joint limits are not checked here.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from trajevo.base.arrays import Array, numbers
from trajevo.errors import InvalidInputError, UnreachableError, checked_name

#: Denavit-Hartenberg table: d and a [m]; sine and cosine of α = (90, 0, -90, 90, -90, 0) deg, free of rounding.
D = (0.0, 0.0, 0.15005, 0.4318, 0.0, 0.0)
A = (0.0, 0.4318, 0.0203, 0.0, 0.0, 0.0)
SIN_ALPHA = (1.0, 0.0, -1.0, 1.0, -1.0, 0.0)
COS_ALPHA = (0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
A2, A3, D3, D4 = A[1], A[2], D[2], D[3]

#: Length from the elbow to the wrist [m].
FOREARM = float(np.hypot(A3, D4))

#: Words of a branch, in the order of the solutions: shoulder, elbow, wrist.
WORDS = {"shoulder": ("right", "left"), "elbow": ("up", "down"), "wrist": ("flip", "noflip")}

#: The eight branches in the order of :func:`all_inverse_kinematics`.
BRANCHES = tuple(itertools.product(*WORDS.values()))

#: The branch of Table 1 in the words of this module; the paper calls it left arm, elbow down, wrist flip.
TABLE_1_BRANCH = ("right", "down", "noflip")

#: Points to take, lift, drop and place [m]; the text prints z = -0.3 for the third, but its joint angles give +0.3.
TABLE_1_POSITIONS = ((-0.5, 0.5, -0.5), (-0.5, 0.5, 0.3), (0.5, -0.5, 0.3), (0.5, -0.5, -0.5))

#: Joint angles of Table 1 as printed [rad]; at all four points the axes of the tool are those of the base.
TABLE_1_JOINTS = (
    (2.57, -0.7873, -1.2022, -3.1416, -1.9895, 0.5716),
    (2.57, -0.1026, -0.5, -3.1416, -0.6026, 0.5716),
    (-0.5716, -0.1026, -0.5, -3.1416, -0.6026, -2.57),
    (-0.5716, -0.7873, -1.2022, -3.1416, -1.9895, -2.57),
)

#: Middle of the interval of 2π in which each angle is returned [rad]. These intervals contain the ranges of joints 1 to
#: 5, so if a solution is outside its range, no multiple of 2π brings it in.
TURN_MIDDLE = np.radians((0.0, 90.0, -90.0, -5.0, -7.0, 0.0))

#: Tolerance for rounding at the edge of the workspace.
_EDGE = 1e-12

#: sin(q₅) below which the axes of joints 4 and 6 count as one line.
_ALIGNED = 1e-12


def forward_kinematics(q: Any) -> Array:
    """Pose of the tool in the base frame: joint angles (K, 6) [rad] -> (K, 4, 4), lengths in m."""
    angles = numbers(q, name="q", shape=("K", 6))
    pose = np.broadcast_to(np.eye(4), (len(angles), 4, 4))
    for row, angle in enumerate(angles.T):
        pose = pose @ _row(row, angle)
    return pose


def inverse_kinematics(position: Any, rotation: Any, branch: Any = TABLE_1_BRANCH) -> Array:
    """Joint angles that put the tool at a position with a rotation, on one branch.

    Args:
        position: tool positions, shape (K, 3) [m].
        rotation: tool rotations, shape (K, 3, 3), or (3, 3) for one rotation at all positions.
        branch: three words. Shoulder: ``"right"`` or ``"left"``, the side on which the upper arm passes the axis of
            joint 1, looking from that axis to the wrist. Elbow: ``"up"`` or ``"down"``, above or below the line from
            shoulder to wrist. Wrist: ``"flip"`` for 0 < q₅ < π, ``"noflip"`` for -π < q₅ < 0. The Python Robotics
            Toolbox uses these words in the same sense; the paper and the MATLAB toolbox do not.

    Returns:
        Joint angles, shape (K, 6) [rad], each in the interval of 2π around :data:`TURN_MIDDLE`. Where sin q₅ = 0 only
        q₄ ± q₆ is determined; q₄ is then 0.

    Raises:
        UnreachableError: a position is outside the workspace; the message names the point and the reason.
        UnknownNameError: a word that is none of these.
        InvalidInputError: wrong shapes, numbers that are not finite, a matrix that is not a rotation, or a branch that
            is not three words.
    """
    index = _branch_index(branch)
    p, R = _poses(position, rotation)
    radial, stretch = _reach(p)
    _refuse(radial < -_EDGE, p, f"it is closer than {D3} m to the axis of joint 1")
    _refuse(stretch > 1.0 + _EDGE, p, f"the stretched arm ends {_from_origin(A2 + FOREARM):.6g} m from the origin")
    _refuse(stretch < -1.0 - _EDGE, p, f"the folded arm ends {_from_origin(A2 - FOREARM):.6g} m from the origin")
    return _solutions(p, R)[:, index]


def all_inverse_kinematics(position: Any, rotation: Any) -> Array:
    """Joint angles of all eight branches.

    Args:
        position: tool positions, shape (K, 3) [m].
        rotation: tool rotations, shape (K, 3, 3), or (3, 3) for one rotation at all positions.

    Returns:
        Joint angles, shape (K, 8, 6) [rad], in the order of :data:`BRANCHES` and the intervals of
        :func:`inverse_kinematics`; NaN where the point is outside the workspace. The two wrists coincide where
        sin q₅ = 0, the two elbows where the arm is stretched.

    Raises:
        InvalidInputError: wrong shapes, numbers that are not finite, or a matrix that is not a rotation.
    """
    return _solutions(*_poses(position, rotation))


def _row(row: int, angle: Array) -> Array:
    """Rz(q) Tz(d) Tx(a) Rx(α) of one row of the table, (K,) -> (K, 4, 4)."""
    c, s, zero, one = np.cos(angle), np.sin(angle), np.zeros_like(angle), np.ones_like(angle)
    ca, sa, d, a = COS_ALPHA[row], SIN_ALPHA[row], D[row], A[row]
    rows = [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [zero, sa * one, ca * one, d * one]]
    rows.append([zero, zero, zero, one])
    return np.stack([np.stack(entries, axis=-1) for entries in rows], axis=-2)


def _poses(position: Any, rotation: Any) -> tuple[Array, Array]:
    p = numbers(position, name="position", shape=("K", 3))
    R = numbers(_for_each(rotation, len(p)), name="rotation", shape=(len(p), 3, 3))
    off = np.abs(R @ np.swapaxes(R, 1, 2) - np.eye(3)).max(axis=(1, 2), initial=0.0)
    bad = (off > 1e-9) | (np.linalg.det(R) < 0.0)
    if bad.any():
        i = int(np.flatnonzero(bad)[0])
        raise InvalidInputError(f"rotation: expected rotation matrices, got {R[i].tolist()} at index {i}")
    return p, R


def _for_each(rotation: Any, count: int) -> Any:
    """One rotation repeated for every point; any other value unchanged, for the check that follows."""
    try:
        shared = np.shape(rotation) == (3, 3)
    except ValueError:  # rows of unequal lengths
        shared = False
    return np.broadcast_to(rotation, (count, 3, 3)) if shared else rotation


def _branch_index(branch: Any) -> int:
    if not isinstance(branch, list | tuple) or len(branch) != len(WORDS):
        raise InvalidInputError(f"branch: expected three words for {', '.join(WORDS)}, got {branch!r}")
    return BRANCHES.index(
        tuple(checked_name(part, word, WORDS[part]) for part, word in zip(WORDS, branch, strict=True))
    )


def _reach(p: Array) -> tuple[Array, Array]:
    """Squared reach in the arm's plane, r² = x² + y² - d₃² [m²], and the cosine of the bend at the elbow, (K,) each."""
    radial = p[:, 0] ** 2 + p[:, 1] ** 2 - D3**2
    return radial, (radial + p[:, 2] ** 2 - A2**2 - FOREARM**2) / (2.0 * A2 * FOREARM)


def _from_origin(length: float) -> float:
    """Distance of the wrist from the origin [m] where upper arm and forearm lie on one line of a given length."""
    return float(np.hypot(length, D3))


def _solutions(p: Array, R: Array) -> Array:
    """The eight branches of poses, (K, 3), (K, 3, 3) -> (K, 8, 6)."""
    radial, stretch = _reach(p)
    outside = (radial < -_EDGE) | (np.abs(stretch) > 1.0 + _EDGE)
    found = np.empty((len(p), 8, 6))
    for index, (shoulder, elbow, wrist) in enumerate(BRANCHES):
        side = 1.0 if shoulder == "right" else -1.0
        r = side * np.sqrt(np.maximum(radial, 0.0))
        bend = side if elbow == "down" else -side
        arm = _arm_angles(p, r, np.clip(stretch, -1.0, 1.0), bend)
        wrist_angles = _wrist_angles(_arm_rotation(arm), R, 1.0 if wrist == "flip" else -1.0)
        found[:, index] = np.stack([*arm, *wrist_angles], axis=-1)
    found[outside] = np.nan
    # The least angle at or above the lower end of each interval, whose two ends are the same angle.
    start = TURN_MIDDLE - np.pi
    return start + np.mod(found - start, 2.0 * np.pi)


def _arm_angles(p: Array, r: Array, stretch: Array, bend: float) -> tuple[Array, Array, Array]:
    """q₁, q₂, q₃ that carry the wrist to a point, (K,) each; r is signed, bend the sign of the angle at the elbow.

    In the arm's plane r = a₂c₂ + a₃c₂₃ - d₄s₂₃ and z = a₂s₂ + a₃s₂₃ + d₄c₂₃.
    """
    q1 = np.arctan2(p[:, 1], p[:, 0]) + np.arctan2(D3, r)
    inner = bend * np.arccos(stretch)
    q3 = inner - np.arctan2(D4, A3)
    c3, s3 = np.cos(q3), np.sin(q3)
    q2 = np.arctan2(p[:, 2], r) - np.arctan2(A3 * s3 + D4 * c3, A2 + A3 * c3 - D4 * s3)
    return q1, q2, q3


def _arm_rotation(arm: tuple[Array, Array, Array]) -> Array:
    """Rotation of frame 3, (K, 3, 3)."""
    first, second, third = (_row(row, angle)[:, :3, :3] for row, angle in enumerate(arm))
    return first @ second @ third


def _wrist_angles(arm: Array, R: Array, sign: float) -> tuple[Array, Array, Array]:
    """q₄, q₅, q₆, (K,) each, from Rz(q₄) Ry(-q₅) Rz(q₆) = R₀₃ᵀ R.

    q₅ and q₆ are computed after the rotation by q₄ has been removed. So they compensate for the error of q₄ near
    sin q₅ = 0, where q₄ is mostly rounding.
    """
    M = np.swapaxes(arm, 1, 2) @ R
    aligned = np.hypot(M[:, 0, 2], M[:, 1, 2]) < _ALIGNED
    q4 = np.where(aligned, 0.0, np.arctan2(-sign * M[:, 1, 2], -sign * M[:, 0, 2]))
    c, s = np.cos(q4), np.sin(q4)
    q5 = np.arctan2(-c * M[:, 0, 2] - s * M[:, 1, 2], M[:, 2, 2])
    q6 = np.arctan2(c * M[:, 1, 0] - s * M[:, 0, 0], c * M[:, 1, 1] - s * M[:, 0, 1])
    return q4, q5, q6


def _refuse(bad: Array, points: Array, why: str) -> None:
    if bad.any():
        i = int(np.flatnonzero(bad)[0])
        shown = ", ".join(f"{value:.6g}" for value in points[i])
        raise UnreachableError(f"point {i} ({shown}) m cannot be reached: {why}")
