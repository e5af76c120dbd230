"""Names of postures as people who use robots say them: shoulder left, elbow up, wrist not flipped."""

from __future__ import annotations

from collections import Counter

import numpy as np

from trajevo.base.arrays import Array
from trajevo.robot.kinematics import ToolKinematics, crossed
from trajevo.robot.robot import Robot

#: Difference of a product of unit axes from 0 or 1 that counts as none.
_ALIKE = 1e-3


def posture_names(robot: Robot, kinematics: ToolKinematics, q: Array) -> tuple[str, ...]:
    """Names of the postures that reach one pose, all different.

    An arm of six axes, the second and third parallel and across the first, has a shoulder, an elbow and a wrist. Its
    shoulder is left where the wrist is in the direction (axis 2) x (axis 1), else right; its elbow is up where axis 3
    lies above the line from axis 2 to the wrist, and above is against gravity, or along axis 1 if that is horizontal;
    its wrist is flipped where (axis 4 x axis 6) has a negative share of axis 5. Other arms are named by the signs of
    the joints in which the postures differ.

    Args:
        robot: the robot.
        kinematics: of its tool.
        q: joint positions of the postures, shape (N, n_joints) [rad or m].

    Returns:
        N names.
    """
    names = _of_six_axes(robot, kinematics, q) if _has_shoulder(kinematics) else _of_signs(robot, q)
    count, seen, found = Counter(names), Counter[str](), []
    for name in names:
        seen[name] += 1
        number = f" ({seen[name]})" if count[name] > 1 else ""
        found.append(f"{name}{number}" if name else f"posture {seen[name]}")
    return tuple(found)


def _has_shoulder(kinematics: ToolKinematics) -> bool:
    if len(kinematics.chain) != 6 or kinematics.dof != 6 or not all(kinematics.turns):
        return False
    q = np.linspace(0.1, 0.6, 6)
    _, axes = kinematics.joint_lines(q)
    return bool(abs(axes[0] @ axes[1]) < _ALIKE and np.abs(crossed(axes[1], axes[2])).max() < _ALIKE)


def _of_six_axes(robot: Robot, kinematics: ToolKinematics, q: Array) -> list[str]:
    origins, axes = kinematics.joint_lines(q)
    first, second = axes[:, 0], axes[:, 1]
    gravity = np.asarray(robot.model.gravity.linear)
    falling = (first @ gravity)[:, None]
    upward = np.where(np.abs(falling) > _ALIKE * np.linalg.norm(gravity), -np.sign(falling), 1.0) * first
    forward = crossed(second, first)
    wrist = _meeting(origins[:, 4], axes[:, 4], origins[:, 5], axes[:, 5])
    left = ((wrist - origins[:, 0]) * forward).sum(axis=1) >= 0.0
    parallel = np.abs(crossed(axes[:, 3], axes[:, 2])).max() < _ALIKE
    end = (origins[:, 3] if parallel else wrist) - origins[:, 1]
    elbow = origins[:, 2] - origins[:, 1]
    flat = [(end * forward).sum(axis=1), (elbow * forward).sum(axis=1)]
    high = [(end * upward).sum(axis=1), (elbow * upward).sum(axis=1)]
    above = (flat[0] * high[1] - high[0] * flat[1]) * np.where(flat[0] >= 0.0, 1.0, -1.0) >= 0.0
    flipped = (crossed(axes[:, 3], axes[:, 5]) * axes[:, 4]).sum(axis=1) < 0.0
    shoulder = np.where(left, "shoulder left", "shoulder right").tolist()
    bent = np.where(above, "elbow up", "elbow down").tolist()
    wrists = np.where(flipped, "wrist flip", "wrist no flip").tolist()
    return [", ".join(parts) for parts in zip(shoulder, bent, wrists, strict=True)]


def _meeting(origin: Array, axis: Array, other: Array, along: Array) -> Array:
    """Point of lines (N, 3) that is nearest to other lines; the lines are not parallel."""
    cosine = (axis * along).sum(axis=1)
    away = other - origin
    far = ((away * axis).sum(axis=1) - cosine * (away * along).sum(axis=1)) / np.maximum(1.0 - cosine**2, 1e-12)
    return np.asarray(origin + far[:, None] * axis)


def _of_signs(robot: Robot, q: Array) -> list[str]:
    """Signs of the joints that are not the same in all postures; the number of each if there is none."""
    positive = q >= 0.0
    telling = np.flatnonzero(positive.any(axis=0) & ~positive.all(axis=0))
    if not len(telling):
        return [""] * len(q)
    return [", ".join(f"{robot.joint_names[j]} {'+' if row[j] else '-'}" for j in telling.tolist()) for row in positive]
