"""Where joint positions for poses of the tool are searched, and how far a tool is from a pose.

The error of orientation is that of the chord 2 sin(θ/2) = |R - R*|/√2, which is smooth up to θ = π, unlike that of the
rotation vector.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, final

import numpy as np
from scipy.spatial.transform import Rotation

from trajevo.arrays import Array, numbers, read_only
from trajevo.errors import InvalidInputError
from trajevo.kinematics import ToolKinematics
from trajevo.robot import Robot

#: Greatest error of position [m] and of orientation [rad] of a pose that counts as met.
TOLERANCE = 1e-6

#: How far a rotation matrix or a quaternion may be from unit length.
ROUNDED = 1e-3

_TURN = 2.0 * np.pi


@final
@dataclass(frozen=True, eq=False)
class JointRanges:
    """Position limits of a robot as a search sees them; made by :meth:`of`.

    Attributes:
        lower: position limits, shape (n_joints,) [rad or m].
        upper: shape (n_joints,).
        low: ends of the box that starts are drawn from, shape (n_joints,): a turn (or a metre of that number) where a
            range has no end.
        high: shape (n_joints,).
        turning: joints that a whole turn brings back to the same pose of the tool, shape (n_joints,).
    """

    lower: Array
    upper: Array
    low: Array
    high: Array
    turning: Array

    @classmethod
    def of(cls, robot: Robot, kinematics: ToolKinematics) -> JointRanges:
        """The ranges of a robot, whose tool's kinematics tell which joints turn."""
        lower, upper = robot.limits.lower, robot.limits.upper
        low = np.where(np.isfinite(lower), lower, np.where(np.isfinite(upper), upper - _TURN, -np.pi))
        high = np.where(np.isfinite(upper), upper, low + _TURN)
        middle = 0.5 * (low + high)
        turned = kinematics.pose(middle + _TURN * np.eye(robot.dof))
        apart = [
            np.abs(there - here).reshape(robot.dof, -1).max(axis=1)
            for there, here in zip(turned, kinematics.pose(middle), strict=True)
        ]
        turning: Array = np.maximum(*apart) < 1e-9
        turning.setflags(write=False)
        return cls(read_only(lower), read_only(upper), read_only(low), read_only(high), turning)

    @property
    def middle(self) -> Array:
        """Middle of the box, shape (n_joints,) [rad or m]."""
        middle: Array = 0.5 * (self.low + self.high)
        return middle

    def random(self, generator: np.random.Generator, count: int) -> Array:
        """Joint positions spread evenly over the box, shape (count, n_joints) [rad or m]."""
        return generator.uniform(self.low, self.high, (count, len(self.low)))

    def unwound(self, q: Array, near: Array) -> Array:
        """Joint positions shifted by the whole turns that bring every joint nearest to others, inside the limits.

        Args:
            q: shape (..., n_joints) [rad or m], inside the limits.
            near: shape (n_joints,).
        """
        turns = np.where(self.turning, np.rint((near - q) / _TURN), 0.0)
        least, most = np.ceil((self.lower - q) / _TURN), np.floor((self.upper - q) / _TURN)
        shifted = q + _TURN * np.clip(turns, np.minimum(least, 0.0), np.maximum(most, 0.0))
        unwound: Array = np.clip(shifted, self.lower, self.upper)  # rounding can put a joint just beyond its end
        return unwound


def missed(position: Array, rotation: Array, wanted: Array, wanted_rotation: Array | None) -> tuple[Array, Array]:
    """How far tools are from where they shall be.

    Args:
        position: of the tools, shape (N, 3) [m].
        rotation: rotation matrices, shape (N, 3, 3).
        wanted: positions, shape (3,) or (N, 3) [m].
        wanted_rotation: rotation matrices, shape (3, 3) or (N, 3, 3); None if any orientation will do.

    Returns:
        Errors of position [m] and of orientation [rad], shape (N,) each.
    """
    distance: Array = np.linalg.norm(position - wanted, axis=-1)
    if wanted_rotation is None:
        return distance, np.zeros_like(distance)
    half = np.linalg.norm((rotation - wanted_rotation).reshape(-1, 9), axis=1) / np.sqrt(8.0)
    return distance, 2.0 * np.arcsin(np.minimum(half, 1.0))


def rotation_matrix(values: Any, name: str = "rotation") -> Array:
    """A rotation matrix, made orthogonal, as people type rounded numbers.

    Args:
        values: shape (3, 3).
        name: name of the argument, for the message.

    Raises:
        InvalidInputError: another shape, or no rotation matrix.
    """
    given = numbers(values, name=name, shape=(3, 3))
    if np.abs(given @ given.T - np.eye(3)).max() > ROUNDED or np.linalg.det(given) < 0.0:
        raise InvalidInputError(f"{name}: expected a rotation matrix, got {given.tolist()}")
    return read_only(Rotation.from_matrix(given).as_matrix())


def check_search(starts: int, seed: int, tolerance: float) -> None:
    """Refuse numbers that cannot steer a search.

    Raises:
        InvalidInputError: starts or seed that are no whole numbers from 0 on, or a tolerance that is not positive.
    """
    for name, value in (("starts", starts), ("seed", seed)):
        if not isinstance(value, int | np.integer) or isinstance(value, bool) or value < 0:
            raise InvalidInputError(f"{name}: expected a whole number from 0 on, got {value!r}")
    if not (isinstance(tolerance, int | float) and 0.0 < tolerance < np.inf):
        raise InvalidInputError(f"tolerance: expected a positive number [m and rad], got {tolerance!r}")
