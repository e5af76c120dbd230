"""Via points in joint space, made from arrays, tool poses or files of points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from trajevo.base.arrays import Array, numbers, read_only
from trajevo.base.shown.brief import brief
from trajevo.base.units import display, if_degrees
from trajevo.errors import InvalidInputError, TrajevoError, UnreachableError
from trajevo.path.inverse_kinematics import Pose, inverse_kinematics
from trajevo.path.point_files import read_points
from trajevo.path.whole_turns import check_way, the_shorter_way
from trajevo.robot.robot import Robot

#: Points closer than this in every joint are the same point [rad or m].
SAME_POINT = 1e-9


#: Distance from a joint's limit below which a point counts as on it, as a share of half the joint's range: limits and
#: points are often written with five or six digits.
ON_LIMIT = 1e-5


class OnLimit(NamedTuple):
    """A point on a joint's limit: both counted from 0, and whether it is the upper limit."""

    point: int
    joint: int
    upper: bool


@dataclass(frozen=True, eq=False)
class ViaPoints:
    """Points in joint space, visited in order.

    Attributes:
        positions: shape (n_points, n_joints) [rad or m].

    Raises:
        InvalidInputError: fewer than two points, numbers that are not finite, or a point that repeats the one before.
    """

    positions: Array

    __repr__ = brief

    def __post_init__(self) -> None:
        positions = numbers(self.positions, name="points", shape=("n_points", "n_joints"))
        if positions.shape[1] == 0:
            raise InvalidInputError("points: expected at least 1 joint, got points without coordinates")
        if len(positions) < 2:
            raise InvalidInputError(f"points: expected at least 2 points, got {len(positions)}")
        for i in range(1, len(positions)):
            if np.abs(positions[i] - positions[i - 1]).max() <= SAME_POINT:
                raise InvalidInputError(
                    f"points: point {i} repeats point {i - 1}, {positions[i].tolist()}; consecutive points must differ"
                )
        object.__setattr__(self, "positions", read_only(positions))

    def __len__(self) -> int:
        return len(self.positions)

    @property
    def n_joints(self) -> int:
        """Number of joints."""
        return int(self.positions.shape[1])

    @classmethod
    def for_robot(cls, robot: Robot, positions: Any, *, angle: str = "rad") -> ViaPoints:
        """Via points that lie within the ranges of a robot's joints.

        Args:
            robot: the robot whose position limits apply.
            positions: shape (n_points, n_joints) [rad or m].
            angle: unit of angles in error messages, ``"rad"`` or ``"deg"``.

        Raises:
            InvalidInputError: as for the class, another number of joints, or a point outside the range of a joint.
        """
        points = cls(positions)
        if points.n_joints != robot.dof:
            raise InvalidInputError(
                f"points: robot {robot.name!r} has {robot.dof} joints, got points of {points.n_joints} numbers"
            )
        check_within(robot, points.positions, range(len(points)), angle=angle)
        return points

    def on_limits(self, robot: Robot) -> tuple[OnLimit, ...]:
        """The points that lie on a limit of one of the robot's joints or nearer to it than 1e-5 of half the range."""
        q, limits = self.positions, robot.limits
        found = np.argwhere(limits.range_used(q) >= 1.0 - ON_LIMIT).tolist()
        return tuple(OnLimit(k, j, bool(limits.upper[j] - q[k, j] <= q[k, j] - limits.lower[j])) for k, j in found)


def check_within(robot: Robot, positions: Array, numbers_of: Sequence[int], *, angle: str = "rad") -> None:
    """Refuse points outside the ranges of a robot's joints.

    Args:
        robot: the robot.
        positions: joint positions, shape (N, n_joints) [rad or m].
        numbers_of: number of each point, for the message.
        angle: unit of angles in the message, ``"rad"`` or ``"deg"``.

    Raises:
        InvalidInputError: a point outside the range of a joint.
    """
    outside = np.argwhere((positions < robot.limits.lower) | (positions > robot.limits.upper))
    if len(outside):
        i, joint = (int(k) for k in outside[0])
        unit, factor = display(robot.joint_units[joint], angle=angle)
        low, value, high = (factor * bound[joint] for bound in (robot.limits.lower, positions[i], robot.limits.upper))
        raise InvalidInputError(
            f"points: point {numbers_of[i]} puts {robot.joint_names[joint]!r} at {value:.6g} {unit}, "
            f"outside its range {low:.6g} to {high:.6g} {unit}"
            f"{_likely_unit(value, low, high, unit)}"
        )


def _likely_unit(value: float, low: float, high: float, unit: str) -> str:
    """What a message about a position outside a joint's range adds: the unit in which it would be inside."""
    if unit == "rad" and low <= np.radians(value) <= high:
        return if_degrees(value)
    if unit == "m" and low <= 1e-3 * value <= high and abs(value) >= 1.0:
        return ", which looks like mm: lengths are in m, in files of points also in mm with [mm] in the header"
    return ""


def joint_points(points: Any, robot: Robot, *, angle: str = "rad", turns: str = "as_written") -> ViaPoints:
    """Via points of a robot, from any form in which a user may give them.

    Args:
        points: via points, an array (K, n_joints) [rad or m], a list of joint positions, of poses
            (:class:`~trajevo.path.inverse_kinematics.Pose` or their mappings) or of both, or a file of either, see
            :func:`~trajevo.path.point_files.read_points`.
        robot: the robot; poses become the joint positions nearest to the point before, so that the path stays short.
        angle: unit of angles in error messages, ``"rad"`` or ``"deg"``; for a file, that of its columns.
        turns: ``"as_written"``, or ``"shortest"`` for joint positions shifted by whole turns to the nearest ones to the
            point before, see :func:`~trajevo.path.whole_turns.the_shorter_way`.

    Raises:
        UnknownNameError: another way round.
        UnreachableError: a pose that the tool cannot take.
        InvalidInputError: no points, points in another form, or points outside the ranges of the joints.
    """
    check_way(turns)
    if points is None:
        raise InvalidInputError(f"points: robot {robot.name!r} needs via points, shape (n_points, {robot.dof})")
    if isinstance(points, ViaPoints):
        points = points.positions
    if isinstance(points, str | Path):
        file = points
        points, angle = read_points(file, robot)
        try:
            return joint_points(points, robot, angle=angle, turns=turns)
        except UnreachableError as error:
            raise UnreachableError(f"{file}: {error}") from error
        except TrajevoError as error:
            raise InvalidInputError(f"{file}: {str(error).removeprefix('points: ')}") from error
    _check_counts(points, robot)
    if isinstance(points, list | tuple) and any(isinstance(point, Pose | Mapping) for point in points):
        points = _solved(points, robot)
    if turns == "shortest":
        points = the_shorter_way(robot, numbers(points, name="points", shape=("n_points", robot.dof)))
    return ViaPoints.for_robot(robot, points, angle=angle)


def _check_counts(points: Any, robot: Robot) -> None:
    """Refuse a list in which a point has another number of joints, by its number."""
    for k, point in enumerate(points if isinstance(points, list | tuple) else ()):
        if isinstance(point, list | tuple | np.ndarray) and len(point) != robot.dof:
            raise InvalidInputError(
                f"points: point {k}: expected {robot.dof} numbers, one for each of {', '.join(robot.joint_names)}, "
                f"got {len(point)}"
            )


def _solved(points: Any, robot: Robot) -> Array:
    """Joint positions of a mixed list; inverse kinematics of each pose starts at the point before it."""
    rows: list[Array] = []
    for k, point in enumerate(points):
        if isinstance(point, Pose | Mapping):
            start = rows[-1] if rows else None
            rows.append(inverse_kinematics(robot, [point], start=start, first=k)[0])
        else:
            rows.append(numbers(point, name=f"points: point {k}", shape=(robot.dof,)))
    return np.array(rows)
