"""Joint positions for poses of the tool, by bounded least squares from many starts, each point near the one before.

A pose is met when the tool's origin and its angle to the wanted orientation are both within a tolerance. Many poses at
once, from many starts each: :mod:`trajevo.path.postures`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, final

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from trajevo.base.arrays import Array, frozen, numbers, read_only
from trajevo.errors import InvalidInputError, UnreachableError, checked_name
from trajevo.robot.kinematics import ToolKinematics
from trajevo.robot.robot import Robot

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


@dataclass(frozen=True, eq=False)
class Pose:
    """Where the tool shall be in the base frame.

    Attributes:
        position: of the tool's origin, shape (3,) [m].
        rotation: rotation matrix, shape (3, 3), made orthogonal; None if any orientation will do.
        name: for messages; may be empty.

    Raises:
        InvalidInputError: other shapes, or no rotation matrix.
    """

    position: Array
    rotation: Array | None = None
    name: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", read_only(numbers(self.position, name="position", shape=(3,))))
        if self.rotation is not None:
            object.__setattr__(self, "rotation", rotation_matrix(self.rotation))

    @classmethod
    def of(cls, given: Pose | Mapping[str, Any]) -> Pose:
        """A pose from settings.

        Args:
            given: a pose, or ``position`` (3,) [m] with ``rpy``, roll, pitch and yaw about fixed axes as in a URDF
                (3,) [rad], or ``quaternion`` (x, y, z, w), or neither for any orientation; ``name`` may be added.

        Raises:
            UnknownNameError: another key.
            InvalidInputError: no position, two orientations, or numbers that are none.
        """
        if isinstance(given, Pose):
            return given
        if not isinstance(given, Mapping):
            raise InvalidInputError(f"pose: expected a Pose or a mapping with 'position', got {type(given).__name__}")
        for key in given:
            checked_name("key of a pose", key, ("position", "rpy", "quaternion", "name"))
        if "position" not in given:
            raise InvalidInputError(f"pose: expected a 'position' (3) [m], got only {sorted(given)}")
        if "rpy" in given and "quaternion" in given:
            raise InvalidInputError("pose: expected 'rpy' or 'quaternion', got both")
        rotation = None
        if "rpy" in given:
            rotation = Rotation.from_euler("xyz", numbers(given["rpy"], name="rpy", shape=(3,))).as_matrix()
        elif "quaternion" in given:
            quaternion = numbers(given["quaternion"], name="quaternion", shape=(4,))
            if abs(np.linalg.norm(quaternion) - 1.0) > ROUNDED:
                raise InvalidInputError(f"quaternion: expected x, y, z, w of norm 1, got {quaternion.tolist()}")
            rotation = Rotation.from_quat(quaternion).as_matrix()
        return cls(given["position"], rotation, str(given.get("name", "")))


def inverse_kinematics(
    robot: Robot,
    poses: Sequence[Pose | Mapping[str, Any]],
    *,
    start: Any = None,
    seed: int = 0,
    starts: int = 20,
    tolerance: float = TOLERANCE,
    first: int = 0,
) -> Array:
    """Joint positions that put the tool into poses, each the nearest found to the one before.

    Every pose is tried from the point before, from the middle of the joint ranges and from random starts. "Nearest"
    is by the greatest difference of any joint; where a joint may turn more than once, whole turns count. A redundant
    arm has endless solutions, of which those that the starts lead to are compared.

    Args:
        robot: the robot whose tool and position limits count.
        poses: K poses, or settings of :meth:`Pose.of`.
        start: joint positions that the first point shall be near, shape (n_joints,) [rad or m]; the middle of the
            joint ranges if None.
        seed: of the random starts.
        starts: number of random starts per pose.
        tolerance: greatest error of position [m] and of orientation [rad].
        first: number of the first pose in messages.

    Returns:
        Shape (K, n_joints) [rad or m], inside the position limits.

    Raises:
        UnreachableError: no try met a pose; the message names the pose and what the best try misses.
        InvalidInputError: no poses, or another argument is no such number.
    """
    if isinstance(poses, Mapping | str) or not isinstance(poses, Sequence) or not len(poses):
        raise InvalidInputError(f"poses: expected a sequence of at least 1 pose, got {poses!r}")
    check_search(starts, seed, tolerance)
    search = _Search(robot, np.random.default_rng(seed), starts, float(tolerance))
    before = search.ranges.middle if start is None else numbers(start, name="start", shape=(robot.dof,))
    found = []
    for i, given in enumerate(poses, start=first):
        before = search.nearest(Pose.of(given), before, f"point {i}")
        found.append(before)
    return frozen(np.stack(found))


class _Search:
    """The tries for one robot."""

    def __init__(self, robot: Robot, generator: np.random.Generator, starts: int, tolerance: float) -> None:
        self.robot, self.generator, self.starts, self.tolerance = robot, generator, starts, tolerance
        self.kinematics = ToolKinematics.of(robot)
        self.ranges = JointRanges.of(robot, self.kinematics)

    def nearest(self, pose: Pose, before: Array, where: str) -> Array:
        """The solution nearest to the point before."""
        random = self.ranges.random(self.generator, self.starts)
        tries = np.stack([self._solve(pose, q) for q in (before, self.ranges.middle, *random)])
        distance, angle = missed(*self.kinematics.pose(tries), pose.position, pose.rotation)
        worst = np.maximum(distance, angle)
        if worst.min() > self.tolerance:
            best = int(np.argmin(distance + angle))
            label = f"{where} {pose.name!r}" if pose.name else where
            turned = "" if pose.rotation is None else f" and {np.degrees(angle[best]):.4g} deg"
            raise UnreachableError(
                f"{label}: expected a pose that {self.robot.name!r} reaches inside its position limits, got "
                f"{pose.position.tolist()} m; the best of {len(tries)} tries misses it by "
                f"{1e3 * distance[best]:.4g} mm{turned}"
            )
        near = self.ranges.unwound(tries[worst <= self.tolerance], before)
        chosen: Array = near[np.argmin(np.abs(near - before).max(axis=1))]
        return chosen

    def _solve(self, pose: Pose, start: Array) -> Array:
        inside = np.clip(start, self.ranges.lower, self.ranges.upper)
        found = least_squares(
            self._error,
            inside,
            self._error_jacobian,
            bounds=(self.ranges.lower, self.ranges.upper),
            args=(pose,),
            xtol=1e-14,
            ftol=1e-14,
            gtol=1e-14,
            max_nfev=100,
        )
        solution: Array = found.x
        return solution

    def _error(self, q: Array, pose: Pose) -> Array:
        position, rotation = self.kinematics.pose(q)
        if pose.rotation is None:
            return np.asarray(position - pose.position)
        return np.concatenate([position - pose.position, (rotation - pose.rotation).T.ravel() / np.sqrt(2.0)])

    def _error_jacobian(self, q: Array, pose: Pose) -> Array:
        _, rotation, jacobian = self.kinematics.pose_and_jacobian(q)
        if pose.rotation is None:
            return jacobian[:3]
        turning = np.cross(jacobian[3:].T[:, None], rotation.T).reshape(self.robot.dof, 9)
        return np.concatenate([jacobian[:3], turning.T / np.sqrt(2.0)])
