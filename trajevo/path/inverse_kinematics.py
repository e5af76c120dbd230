"""Joint positions for consecutive tool poses, each solution as near as possible to the previous one.

A pose is reached if the errors of the tool's position and of its orientation are both within a tolerance. All postures
of many poses are found by :mod:`trajevo.path.postures`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from trajevo.base.arrays import Array, frozen, numbers, read_only
from trajevo.base.shown.brief import brief
from trajevo.base.units import if_degrees
from trajevo.errors import InvalidInputError, TrajevoError, UnreachableError, checked_name
from trajevo.path.levenberg_marquardt import (
    ROUNDED,
    SETTLED,
    TOLERANCE,
    JointRanges,
    PostureSolver,
    check_search,
    missed,
    rotation_matrix,
)
from trajevo.path.rotations import of_quaternion, of_rpy, quaternion_of
from trajevo.robot.kinematics import ToolKinematics
from trajevo.robot.robot import Robot

#: The search goes on while a solution could be nearer by this share of the distance. The next box keeps this share of
#: the interval between the distance at which solutions are ruled out and that of the nearest one found.
_NEARER, _KEPT = 0.01, 0.85

#: A position that is not reached and is farther away than this may be in millimetres [m].
_FAR = 5.0

_TURN = 2.0 * np.pi


@dataclass(frozen=True, eq=False)
class Pose:
    """Wanted pose of the tool in the base frame.

    Attributes:
        position: position of the tool's origin, shape (3,) [m].
        rotation: rotation matrix, shape (3, 3), made orthogonal; None for any orientation.
        name: name for messages; may be empty.
        free: axis of the tool about which it may be turned, ``"x"``, ``"y"`` or ``"z"``; None for none.

    Raises:
        InvalidInputError: other shapes, not a rotation matrix, or a free axis without a rotation.
    """

    position: Array
    rotation: Array | None = None
    name: str = ""
    free: str | None = None

    __repr__ = brief

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", read_only(numbers(self.position, name="position", shape=(3,))))
        if self.rotation is not None:
            object.__setattr__(self, "rotation", rotation_matrix(self.rotation))
        if self.free is not None:
            checked_name("free axis of a pose", self.free, "xyz")
            if self.rotation is None:
                raise InvalidInputError(
                    "free: expected an orientation with it, rpy, quaternion or rotation_vector; else all are free"
                )

    @property
    def free_axis(self) -> Array | None:
        """The free axis in the tool's frame, shape (3,), or None."""
        return None if self.free is None else read_only(np.eye(3)["xyz".index(self.free)])

    @classmethod
    def of(cls, given: Pose | Mapping[str, Any]) -> Pose:
        """A pose from settings.

        Args:
            given: a pose, or a mapping with ``position`` (3,) [m], with an orientation or none for any, and with
                ``name`` if wanted. The orientation is ``rpy`` (3,) [rad], roll, pitch and yaw about fixed axes as in a
                URDF; ``quaternion`` (x, y, z, w); or ``rotation_vector`` (3,) [rad], the axis times the angle. With an
                orientation ``free`` may name an axis of the tool, ``"x"``, ``"y"`` or ``"z"``, about which it may turn.

        Raises:
            UnknownNameError: another key.
            InvalidInputError: no position, two orientations, values that are not finite numbers, angles beyond 2π, or a
                quaternion whose norm is not 1.
        """
        if isinstance(given, Pose):
            return given
        if not isinstance(given, Mapping):
            raise InvalidInputError(f"pose: expected a Pose or a mapping with 'position', got {type(given).__name__}")
        for key in given:
            checked_name("key of a pose", key, ("position", *_ORIENTATIONS, "name", "free"))
        if "position" not in given:
            raise InvalidInputError(f"pose: expected a 'position' (3) [m], got only {sorted(given)}")
        chosen = [key for key in _ORIENTATIONS if key in given]
        if len(chosen) > 1:
            raise InvalidInputError(f"pose: expected {chosen[0]!r} or {chosen[1]!r}, got both")
        rotation = _ORIENTATIONS[chosen[0]](given[chosen[0]]) if chosen else None
        return cls(given["position"], rotation, str(given.get("name", "")), given.get("free"))

    @property
    def settings(self) -> dict[str, Any]:
        """Plain data of which :meth:`of` makes the same pose, but for rounding of the rotation."""
        turned = {} if self.rotation is None else {"quaternion": quaternion_of(self.rotation).tolist()}
        named = {key: value for key, value in (("name", self.name), ("free", self.free)) if value}
        return {"position": self.position.tolist(), **turned, **named}


def _of_rpy(given: Any) -> Array:
    angles = numbers(given, name="rpy", shape=(3,))
    if np.abs(angles).max() > _TURN + ROUNDED:
        raise InvalidInputError(
            f"rpy: expected angles within ±2π rad, got {angles.tolist()}{if_degrees(float(np.abs(angles).max()))}"
        )
    return of_rpy(angles)


def _of_quaternion(given: Any) -> Array:
    quaternion = numbers(given, name="quaternion", shape=(4,))
    norm = float(np.linalg.norm(quaternion))
    if abs(norm - 1.0) > ROUNDED:
        raise InvalidInputError(
            f"quaternion: expected x, y, z, w of norm 1, got {quaternion.tolist()} of norm {norm:.4g}"
        )
    return of_quaternion(quaternion)


def _of_rotation_vector(given: Any) -> Array:
    from scipy.spatial.transform import Rotation  # imported where it computes, since that takes long

    vector = numbers(given, name="rotation_vector", shape=(3,))
    angle = float(np.linalg.norm(vector))
    if angle > _TURN + ROUNDED:
        raise InvalidInputError(
            f"rotation_vector: expected an axis times an angle of at most 2π rad, got {vector.tolist()} with an angle "
            f"of {angle:.4g} rad{if_degrees(angle)}"
        )
    matrix: Array = Rotation.from_rotvec(vector).as_matrix()
    return matrix


#: Ways to give an orientation, and the rotation matrix of each.
_ORIENTATIONS: dict[str, Callable[[Any], Array]] = {
    "rpy": _of_rpy,
    "quaternion": _of_quaternion,
    "rotation_vector": _of_rotation_vector,
}


def inverse_kinematics(
    robot: Robot,
    poses: Sequence[Pose | Mapping[str, Any]],
    *,
    start: Any = None,
    seed: int = 0,
    starts: int = 32,
    tolerance: float = TOLERANCE,
    first: int = 0,
) -> Array:
    """Joint positions that put the tool into poses, each the nearest found to the previous one.

    Every pose is tried from the previous point, from the middle of the joint ranges and from random starts, then again
    in ever smaller boxes around the previous point, until no solution is found that is nearer by at least 1 %. By this
    search a redundant arm, which has infinitely many solutions, moves along nearby ones. The distance of two solutions
    is the greatest difference of any joint, in which whole turns of a joint count.

    Args:
        robot: the robot with its tool and position limits.
        poses: K poses, or settings of :meth:`Pose.of`.
        start: joint positions that the first solution should be near, shape (n_joints,) [rad or m]; the middle of the
            joint ranges if None.
        seed: seed of the random starts.
        starts: number of random starts per pose, and in every box.
        tolerance: greatest error of position [m] and of orientation [rad].
        first: number of the first pose in messages.

    Returns:
        Shape (K, n_joints) [rad or m], inside the position limits.

    Raises:
        UnreachableError: no try reached a pose; the message names the pose and the error of the best try.
        InvalidInputError: no poses, or an argument that is not such a number.
    """
    if isinstance(poses, Mapping | str) or not isinstance(poses, Sequence) or not len(poses):
        raise InvalidInputError(f"poses: expected a sequence of at least 1 pose, got {poses!r}")
    check_search(starts, seed, tolerance)
    search = _Search(robot, np.random.default_rng(seed), starts, float(tolerance))
    before = search.ranges.middle if start is None else numbers(start, name="start", shape=(robot.dof,))
    found = []
    for i, given in enumerate(poses, start=first):
        try:
            pose = Pose.of(given)
        except TrajevoError as error:
            raise InvalidInputError(f"point {i}: {error}") from error
        before = search.nearest(pose, before, f"point {i}")
        found.append(before)
    return frozen(np.stack(found))


class _Search:
    """Search for the solutions of one robot."""

    def __init__(self, robot: Robot, generator: np.random.Generator, starts: int, tolerance: float) -> None:
        self.robot, self.generator, self.starts, self.tolerance = robot, generator, starts, tolerance
        self.kinematics = ToolKinematics.of(robot)
        self.ranges = JointRanges.of(robot, self.kinematics)

    def nearest(self, pose: Pose, before: Array, where: str) -> Array:
        """The solution nearest to the previous point, shape (n_joints,) [rad or m]."""
        tries, error = self._tried(pose, before, self.ranges)
        if error.min() > self.tolerance:
            raise UnreachableError(self._told(pose, tries, where))
        found, distance = self._nearest_of(tries[error <= self.tolerance], before)
        least = np.abs(before - np.clip(before, self.ranges.lower, self.ranges.upper)).max()
        while distance - least > max(_NEARER * distance, self.tolerance):
            within = least + _KEPT * (distance - least)
            tries, error = self._tried(pose, found, self.ranges.around(before, within))
            if error.min() <= SETTLED:
                found, distance = self._nearest_of(tries[error <= SETTLED], before)
            else:
                least = within
        return found

    def _tried(self, pose: Pose, first: Array, ranges: JointRanges) -> tuple[Array, Array]:
        """Results from joint positions, the middle of the ranges and random starts, and their distances to the pose."""
        starts = np.stack([first, ranges.middle, *ranges.random(self.generator, self.starts)])
        return PostureSolver(self.kinematics, ranges, pose.rotation, pose.free_axis)(
            np.tile(pose.position, (len(starts), 1)), starts
        )

    def _nearest_of(self, solutions: Array, before: Array) -> tuple[Array, float]:
        """The solution nearest to the previous point, with whole turns tried, and its distance."""
        near = self.ranges.unwound(solutions, before)
        distance = np.abs(near - before).max(axis=1)
        return near[distance.argmin()], float(distance.min())

    def _told(self, pose: Pose, tries: Array, where: str) -> str:
        """Message for a pose that no try reaches."""
        distance, angle = missed(*self.kinematics.pose(tries), pose.position, pose.rotation, pose.free_axis)
        best = int(np.argmin(distance + angle))
        label = f"{where} {pose.name!r}" if pose.name else where
        turned = "" if pose.rotation is None else f" and {np.degrees(angle[best]):.4g} deg"
        return (
            f"{label}: expected a pose that {self.robot.name!r} reaches inside its position limits, got "
            f"{pose.position.tolist()} m; the best of {len(tries)} tries misses it by "
            f"{1e3 * distance[best]:.4g} mm{turned}{self._if_millimetres(pose)}"
        )

    def _if_millimetres(self, pose: Pose) -> str:
        """What the message adds if the pose is reached once its position is taken for millimetres."""
        if np.linalg.norm(pose.position) < _FAR:
            return ""
        _, error = self._tried(replace(pose, position=1e-3 * pose.position), self.ranges.middle, self.ranges)
        if error.min() > self.tolerance:
            return ""
        return "; in mm it is reached: positions are in m, in files of points also in mm with [mm] in the header"
