"""What a problem is told of a cell that varies, checked, and the arrangement that follows from it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, numbers
from trajevo.base.plain import plain_data
from trajevo.base.shown.brief import brief
from trajevo.base.units import pretty
from trajevo.errors import InvalidInputError, TrajevoError, UnreachableError, checked_name
from trajevo.formulation.cell.arrangement import Arrangement
from trajevo.formulation.cell.base_box import COORDINATES, BaseBox
from trajevo.formulation.cell.beside import check_beside, check_limits
from trajevo.formulation.cell.moving_base import MovingBase, placed_targets
from trajevo.formulation.cell.tracking import PoseTargets, tracked
from trajevo.formulation.cell.visits import POSTURES, StillCell, Visits, still_branches
from trajevo.path.choices.branches import MOST_STATES, Branches, branches_of, reached
from trajevo.path.choices.orders import FreeOrder
from trajevo.path.choices.travel_times import TravelTimes
from trajevo.path.inverse_kinematics import Pose, inverse_kinematics
from trajevo.path.levenberg_marquardt import JointRanges
from trajevo.path.point_files import read_points
from trajevo.path.via_points import SAME_POINT, ViaPoints, check_within
from trajevo.robot.files.cell import base_of
from trajevo.robot.kinematics import ToolKinematics
from trajevo.robot.robot import Robot

#: Greatest number of bases that are searched for one that reaches all points, random starts for each of its poses, and
#: those of them at which postures within the joints' ranges are sought.
_BASES, _STARTS, _SOLVED = 150, 8, 12

#: Error up to which a pose is reached in that search [m and rad].
_REACHED = 1e-6


@final
@dataclass(frozen=True, eq=False)
class VariedCell:
    """A cell that varies.

    Attributes:
        arrangement: columns of decision vectors -> points.
        points: settings of the points that are visited: poses of the tool or joint positions.
        settings: arguments of the problem that say what varies.
        box: where the base may stand; None if it stays.
        order: which points may be visited in any order; None if their order is given.
    """

    arrangement: Arrangement
    points: tuple[Any, ...]
    settings: dict[str, Any]
    box: BaseBox | None = None
    order: FreeOrder | None = None

    __repr__ = brief

    @property
    def nominal(self) -> ViaPoints:
        """The points at one arrangement that reaches all of them."""
        return ViaPoints(self.arrangement.nominal)


def varied_cell(
    base: Any,
    points: Any,
    robot: Robot,
    *,
    order: Any = None,
    postures: str | None = None,
    beside: Mapping[str, Any],
    parameters: Mapping[str, Any],
) -> VariedCell | None:
    """The cell of a problem, or None if nothing in it varies.

    Args:
        base: None, or a mapping with ``moving``, the ranges of the base, see :meth:`BaseBox.of`.
        points: the points, poses of the tool where the base moves, or a file of such.
        robot: the robot; its base is at the given place.
        order: which points may be visited in any order, see :meth:`FreeOrder.of`; None if they are in order.
        postures: how postures are chosen, one of :data:`~trajevo.formulation.cell.visits.POSTURES`; if None, each
            nearest to the one before, or the best of all for each order.
        beside: further arguments of the problem by name, most of which must not be given; ``turns`` is true if joint
            positions may be reached by whole turns.
        parameters: values of the parameters of limits by name.

    Raises:
        UnknownNameError: another key.
        UnreachableError: a pose that the tool cannot take, or no base in the box reaches all poses; the message names
            the nearest miss.
        InvalidInputError: points that are no poses, ranges that cannot be used, or a robot without a body.
    """
    way = (
        checked_name("postures", postures, POSTURES) if postures is not None else "nearest" if order is None else "best"
    )
    if base is None and order is None and way == "nearest":
        return None
    box = None if base is None else _box(base, robot)
    check_beside(beside, box)
    check_limits(parameters, box)
    told, given = points_of(points, robot) if box is None else poses_of(points, robot)
    free = FreeOrder.of(order, len(given))
    said: dict[str, Any] = {}
    home, origin = np.zeros(len(COORDINATES)), np.zeros(3)
    if box is None:
        nearest = reached(robot, given)
    else:
        origin = base_of(robot.description()).position
        home, nearest = _home(robot, given, box, origin)
        said["base"] = {"moving": box.settings}
    if free is None and way == "nearest":
        inner = _inner(robot, given, box, home, nearest[:, None], origin)
        return VariedCell(inner, told, said, box)
    said |= {} if free is None else {"order": free.settings}
    said |= {} if postures is None else {"postures": postures}
    seen = given if box is None else _seen(given, home, origin)
    branches = choice_of_states(robot, seen, nearest, way=way, turns=bool(beside["turns"]), ordered=free is None)
    inner = _inner(robot, given, box, home, still_branches(branches), origin)
    visits = Visits(inner, branches, TravelTimes.of(robot), free, way == "all")
    _check_apart(visits.nominal, visits.tour.order)
    return VariedCell(visits, told, said, box, free)


def _box(base: Any, robot: Robot) -> BaseBox:
    if not isinstance(base, Mapping) or not base:
        raise InvalidInputError(f"base: expected a mapping with moving, the ranges of the base, got {base!r}")
    for key in base:
        checked_name("key of base", key, ("moving",))
    box = BaseBox.of(base["moving"])
    robot.check_body("a moving base")
    return box


def _inner(
    robot: Robot, given: Sequence[Any], box: BaseBox | None, home: Array, solutions: Array, origin: Array
) -> Arrangement:
    """Where each branch of each point lies: always at the same joint positions, or followed as the base moves."""
    if box is None:
        nowhere = np.full((len(solutions), 3), np.nan)
        return StillCell(solutions, robot.tool_poses(solutions[:, 0])[0] if robot.has_body else nowhere)
    return MovingBase(ToolKinematics.of(robot), given, box, home, solutions, origin)


def choice_of_states(
    robot: Robot, points: Sequence[Any], nearest: Array, *, way: str, turns: bool, ordered: bool
) -> tuple[Branches, ...]:
    """The states among which each point is reached; one for each if postures are nearest."""
    if way == "nearest":
        return tuple(branches_of(robot, list(nearest), nearest, turns=turns))
    most = MOST_STATES if ordered else MOST_STATES // 2
    return branches_of(robot, points, nearest, most=most, turns=turns)


def _check_apart(positions: Array, order: Array) -> None:
    """Refuse two points at one place that follow one another."""
    for k in range(1, len(positions)):
        if np.abs(positions[k] - positions[k - 1]).max() <= SAME_POINT:
            raise InvalidInputError(
                f"points: points {order[k - 1]} and {order[k]} are the same, and the best order visits them one after "
                "the other; expected different ones"
            )


def points_of(points: Any, robot: Robot) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
    """Points that are visited, as settings, and as poses or joint positions.

    Raises:
        InvalidInputError: fewer than two, or a point that is neither; the message names it.
    """
    if isinstance(points, ViaPoints):
        points = points.positions
    angle = "rad"
    if isinstance(points, str | Path):
        points, angle = read_points(points, robot)
    if points is None or not isinstance(points, Sequence | np.ndarray) or len(points) < 2:
        raise InvalidInputError(f"points: expected at least 2 points, got {points!r}")
    told: list[Any] = []
    found: list[Any] = []
    for k, point in enumerate(points):
        if isinstance(point, Pose | Mapping):
            told.append(point.settings if isinstance(point, Pose) else plain_data(f"points: point {k}", point))
            found.append(_pose(k, told[-1]))
        else:
            row = numbers(point, name=f"points: point {k}", shape=(robot.dof,))
            told.append(row.tolist())
            found.append(row)
    rows = np.array([row for row in found if not isinstance(row, Pose)]).reshape(-1, robot.dof)
    check_within(robot, rows, [k for k, row in enumerate(found) if not isinstance(row, Pose)], angle=angle)
    return tuple(told), tuple(found)


def _pose(k: int, told: Mapping[str, Any]) -> Pose:
    try:
        return Pose.of(told)
    except TrajevoError as error:
        raise InvalidInputError(f"points: point {k}: {error}") from error


def poses_of(points: Any, robot: Robot) -> tuple[tuple[dict[str, Any], ...], tuple[Pose, ...]]:
    """Poses of the tool that are visited, as settings and as poses.

    Raises:
        InvalidInputError: fewer than two, or a point that is no pose; the message names it.
    """
    if isinstance(points, str | Path):
        points = read_points(points, robot)[0]
    if points is None or not isinstance(points, Sequence | np.ndarray) or len(points) < 2:
        raise InvalidInputError(f"points: expected at least 2 poses of the tool, as the base moves, got {points!r}")
    told = []
    for k, point in enumerate(points):
        if not isinstance(point, Pose | Mapping):
            raise InvalidInputError(
                f"points: point {k}: expected a pose of the tool, as the base moves, got joint positions, which put "
                "the tool somewhere else from every base"
            )
        told.append(point.settings if isinstance(point, Pose) else plain_data(f"points: point {k}", point))
    poses = [_pose(k, one) for k, one in enumerate(told)]
    for k in range(1, len(poses)):
        if told[k] == told[k - 1]:
            raise InvalidInputError(f"points: point {k} repeats point {k - 1}; consecutive points must differ")
    return tuple(told), tuple(poses)


def _home(robot: Robot, poses: Sequence[Pose], box: BaseBox, origin: Array) -> tuple[Array, Array]:
    """A base that reaches all poses, as near as possible to the given place, and their joint positions from there."""
    try:
        return box.nearest, inverse_kinematics(robot, _seen(poses, box.nearest, origin))
    except UnreachableError as error:
        first = error
    bases, missed = _tried(robot, poses, box, origin)
    reached = bases[missed.max(axis=1) <= _REACHED]
    # From the nearest to the farthest: the nearest alone may all need joints beyond their ranges.
    spread = np.unique(np.linspace(0.0, len(reached) - 1.0, min(_SOLVED, len(reached))).round().astype(np.intp))
    for base in reached[spread]:
        try:
            return base, inverse_kinematics(robot, _seen(poses, base, origin))
        except UnreachableError:
            continue
    best = int(missed.max(axis=1).argmin())
    worst = int(missed[best].argmax())
    if missed[best, worst] <= _REACHED:
        raise UnreachableError(
            f"base.moving: expected a base from which {robot.name!r} reaches all points inside its position limits, "
            f"got none; from the given place {first}"
        )
    raise UnreachableError(
        f"base.moving: expected a base from which {robot.name!r} reaches all points, got none among {len(bases)} in "
        f"the box; the nearest misses point {worst} by {1e3 * missed[best, worst]:.4g} mm, at {_told(bases[best], box)}"
    )


def _seen(poses: Sequence[Pose], base: Array, origin: Array) -> list[Pose]:
    """The poses as the robot sees them from a base; the same if it does not move."""
    if not base.any():
        return list(poses)
    targets = placed_targets(PoseTargets.of(poses), np.tile(base, (len(poses), 1)), origin)
    return [
        Pose(position, None if pose.rotation is None else rotation, pose.name, pose.free)
        for pose, position, rotation in zip(poses, targets.position, targets.rotation, strict=True)
    ]


def _tried(robot: Robot, poses: Sequence[Pose], box: BaseBox, origin: Array) -> tuple[Array, Array]:
    """Bases in the box, the nearest to the given place first, and how far each misses every pose, (N, K) [m, rad]."""
    kinematics, K = ToolKinematics.of(robot), len(poses)
    starts = JointRanges.of(robot, kinematics).random(np.random.default_rng(0), _STARTS)
    counts = max(2, int(_BASES ** (1.0 / len(box.free))))
    axes = [np.linspace(box.lower[k], box.upper[k], counts if k in box.free else 1) for k in range(len(COORDINATES))]
    bases = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(COORDINATES))
    bases = bases[np.argsort(np.square(bases).sum(axis=1), kind="stable")]
    N = len(bases)
    own = PoseTargets.of(poses).chosen(np.tile(np.arange(K).repeat(_STARTS), N))
    targets = placed_targets(own, bases.repeat(K * _STARTS, axis=0), origin)
    missed = tracked(kinematics, np.tile(starts, (N * K, 1)), targets)[1]
    return bases, missed.max(axis=1).reshape(N, K, _STARTS).min(axis=2)


def _told(base: Array, box: BaseBox) -> str:
    names = list(COORDINATES.items())
    return ", ".join(f"{names[k][0]} {base[k]:.4g} {pretty(names[k][1])}" for k in box.free)
