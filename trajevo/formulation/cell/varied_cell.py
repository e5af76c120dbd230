"""What a problem is told of a cell that varies, checked, and the arrangement that follows from it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.plain import plain_data
from trajevo.base.shown.brief import brief
from trajevo.base.units import pretty
from trajevo.errors import InvalidInputError, TrajevoError, UnreachableError, checked_name
from trajevo.formulation.cell.arrangement import Arrangement
from trajevo.formulation.cell.base_box import COORDINATES, BaseBox
from trajevo.formulation.cell.moving_base import MovingBase, check_gravity, placed_targets
from trajevo.formulation.cell.tracking import PoseTargets, tracked
from trajevo.formulation.constraints.scene import Scene
from trajevo.path.inverse_kinematics import Pose, inverse_kinematics
from trajevo.path.levenberg_marquardt import JointRanges
from trajevo.path.point_files import read_points
from trajevo.path.via_points import ViaPoints
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
        points: settings of the poses of the tool that are visited.
        base: settings of the base.
        box: where the base may stand.
    """

    arrangement: Arrangement
    points: tuple[dict[str, Any], ...]
    base: dict[str, Any]
    box: BaseBox

    __repr__ = brief

    @property
    def nominal(self) -> ViaPoints:
        """The points at one arrangement that reaches all of them."""
        return ViaPoints(self.arrangement.nominal)


#: Why an argument cannot be used where the base moves.
_BESIDE = {
    "moving": "as points are poses that stay where they are",
    "segments": "as lines, arcs and upright axes are laid through points of one base",
    "cyclic": "as the seam is closed at points of one base; repeat the first pose at the end, where the motion rests",
    "pace": "as it goes along points of one base",
    "extra_points": "as free points lie between points of one base",
    "bspline": "as its control points lie between points of one base",
    "turns": "as points are poses, each reached by the posture nearest to the one before",
}


def varied_cell(
    base: Any, points: Any, robot: Robot, *, beside: Mapping[str, Any], parameters: Mapping[str, Any]
) -> VariedCell | None:
    """The cell of a problem, or None if nothing in it varies.

    Args:
        base: None, or a mapping with ``moving``, the ranges of the base, see :meth:`BaseBox.of`.
        points: poses of the tool, or a file of such.
        robot: the robot; its base is at the given place.
        beside: further arguments of the problem by name, which must not be given.
        parameters: values of the parameters of limits by name.

    Raises:
        UnknownNameError: another key.
        UnreachableError: no base in the box reaches all poses; the message names the nearest miss.
        InvalidInputError: points that are no poses, ranges that cannot be used, or a robot without a body.
    """
    if base is None:
        return None
    if not isinstance(base, Mapping) or not base:
        raise InvalidInputError(f"base: expected a mapping with moving, the ranges of the base, got {base!r}")
    for key in base:
        checked_name("key of base", key, ("moving",))
    box = BaseBox.of(base["moving"])
    robot.check_body("a moving base")
    check_gravity(np.array(robot.model.gravity.linear), box)
    _check_beside(beside)
    _check_limits(parameters, box)
    told, poses = poses_of(points, robot)
    origin = base_of(robot.description()).position
    home, q = _home(robot, poses, box, origin)
    moving = MovingBase(ToolKinematics.of(robot), poses, box, home, q[:, None], origin)
    return VariedCell(moving, told, {"moving": box.settings}, box)


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
    poses = []
    for k, one in enumerate(told):
        try:
            poses.append(Pose.of(one))
        except TrajevoError as error:
            raise InvalidInputError(f"points: point {k}: {error}") from error
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
    for base in bases[missed.max(axis=1) <= _REACHED][:_SOLVED]:
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


def _check_beside(given: Mapping[str, Any]) -> None:
    """Refuse arguments that mean joint positions, which differ from base to base, or fixed places in the cell.

    Args:
        given: values by the names of the arguments; what is empty is not given.

    Raises:
        InvalidInputError: one is given.
    """
    for name, value in given.items():
        if value is not None and value is not False and value != 0 and value != () and value != []:
            raise InvalidInputError(f"{name}: expected none where the base moves, {_BESIDE[name]}")


def _check_limits(parameters: Mapping[str, Any], box: BaseBox) -> None:
    """Refuse limits in the robot's frame that a moving base would move.

    Args:
        parameters: values of the parameters of limits by name.
        box: where the base may stand.

    Raises:
        InvalidInputError: one is given.
    """
    if parameters.get("overshoot") is not None:
        raise InvalidInputError(
            "overshoot: expected none where the base moves, as it is measured from the range of the points' joint "
            "positions, which differ from base to base"
        )
    scene = parameters.get("scene")
    moving = [] if scene is None else [one.name for one in Scene.of(scene).moving]
    if moving:
        raise InvalidInputError(
            f"scene: obstacle {moving[0]!r}: motion: expected obstacles that stand still where the base moves"
        )
    if parameters.get("tool_height") is not None and 2 in box.free:
        raise InvalidInputError(
            "tool_height: expected a base that does not move along z, as the height is measured in the base frame; "
            "keep the tool above a plane of the scene instead"
        )
