"""Who can do a task at all, told before a search, and what stops the others."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

import numpy as np

from trajevo.base.shown.brief import brief
from trajevo.base.toml import Places, validated
from trajevo.errors import InvalidInputError, MissingLimitError, TrajevoError, UnreachableError
from trajevo.formulation.feasibility.check import check
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.formulation.task import given_points, task_problem
from trajevo.formulation.task_file import task_model
from trajevo.path.inverse_kinematics import Pose
from trajevo.path.levenberg_marquardt import TOLERANCE, JointRanges, PostureSolver, missed
from trajevo.path.point_files import read_points
from trajevo.robot.kinematics import ToolKinematics
from trajevo.robot.robot import Robot, robot_of
from trajevo.study.robots.asked import RobotTask
from trajevo.study.robots.catalogue import Candidate

#: Random starts of the search for the posture that comes nearest to a pose, and their seed.
_STARTS, _SEED = 64, 0


@final
@dataclass(frozen=True)
class Miss:
    """How near a tool comes to a pose that it does not reach.

    Attributes:
        point: number of the point, from 0.
        distance: distance of the tool from the position [m].
        angle: angle of the tool from the orientation [rad]; 0 if any is right.
    """

    point: int
    distance: float
    angle: float

    __repr__ = brief

    def __str__(self) -> str:
        turned = f" and {math.degrees(self.angle):.3g} deg" if self.angle > TOLERANCE else ""
        return f"point {self.point} by {1e3 * self.distance:.3g} mm{turned}"


@final
@dataclass(frozen=True, eq=False)
class Ability:
    """What is known of one robot before a search.

    Attributes:
        candidate: the robot.
        problem: the task for this robot; None if it cannot be made.
        stopped_by: what stops it in a word or two, such as ``"reach"`` or ``"effort"``; empty if nothing does.
        reason: the same in a sentence; empty if nothing does.
        misses: the points that it does not reach, if reach stops it.
    """

    candidate: Candidate
    problem: TrajectoryProblem | None
    stopped_by: str = ""
    reason: str = ""
    misses: tuple[Miss, ...] = ()

    __repr__ = brief


def abilities(asked: RobotTask) -> tuple[Ability, ...]:
    """What is known of every robot before a search, in milliseconds each.

    Args:
        asked: the task and its robots.

    Raises:
        UnknownNameError: no such robot or tool.
        InvalidInputError: a robot that cannot be loaded or lacks limits, a value of the task that no robot can use, or
            objectives in units that differ from robot to robot.
    """
    robots = [_loaded(candidate, asked) for candidate in asked.candidates]
    found, refused = [], []
    for candidate, robot in zip(asked.candidates, robots, strict=True):
        try:
            found.append(_able(candidate, problem_for(candidate, asked)))
        except UnreachableError as error:
            found.append(_unreached(candidate, robot, asked, error))
        except InvalidInputError as error:
            if isinstance(error.__cause__, UnreachableError):
                found.append(_unreached(candidate, robot, asked, error.__cause__))
                continue
            refused.append(error)
            found.append(Ability(candidate, None, "not planned", str(error)))
    if refused and not any(one.problem for one in found):
        raise refused[0]
    _check_units([one for one in found if one.problem is not None])
    return tuple(found)


def problem_for(candidate: Candidate, asked: RobotTask) -> TrajectoryProblem:
    """The task as a problem of one robot.

    Args:
        candidate: the robot.
        asked: the task.

    Raises:
        InvalidInputError: as for :func:`~trajevo.formulation.task.task_problem`.
    """
    places = Places(asked.folder / "task.toml", {})
    content = dict(asked.content) | {"robot": dict(candidate.robot)}
    content.setdefault("name", asked.title)
    try:
        return task_problem(validated(task_model(), content, places), places)
    except TrajevoError as error:
        said = str(error).removeprefix(places.prefix(()))
        raise InvalidInputError(f"{candidate.name}: {said}") from _cause(error)


def _cause(error: BaseException) -> BaseException:
    """The unreachable point among the causes of an error, or the error itself."""
    inner: BaseException | None = error
    while inner is not None and not isinstance(inner, UnreachableError):
        inner = inner.__cause__
    return error if inner is None else inner


def _loaded(candidate: Candidate, asked: RobotTask) -> Robot:
    """The robot with the limits of the task and its own."""
    shared = asked.content.get("limits", {})
    limits = {**shared, **candidate.robot.get("limits", {})}
    given = {key: value for key, value in candidate.robot.items() if key != "limits"}
    try:
        return robot_of(given | ({"limits": limits} if limits else {}))
    except MissingLimitError as error:
        quantities = list(error.missing)
        keys = ", ".join(f"{key} = ..." for key in quantities)
        raise InvalidInputError(
            f"robots: {candidate.name}: its files have no {' and no '.join(quantities)} limits: give them as limits = "
            f"{{ {keys} }} of this robot, or for all robots in [limits]; inf means no limit"
        ) from error
    except TrajevoError as error:
        raise InvalidInputError(f"robots: {candidate.name}: {error}") from error


def _able(candidate: Candidate, problem: TrajectoryProblem) -> Ability:
    impossible = check(problem).impossible
    if not impossible:
        return Ability(candidate, problem)
    return Ability(candidate, problem, impossible[0].kind, "; ".join(map(str, impossible)))


def _unreached(candidate: Candidate, robot: Robot, asked: RobotTask, error: BaseException) -> Ability:
    moves = "base" in asked.content  # from the given place alone a miss tells little
    misses = () if moves else tuple(one for one in nearest_misses(robot, _poses(robot, asked)) if _is_missed(one))
    if not misses:  # also a line or an arc between points that it reaches, or a posture that it leaves
        return Ability(candidate, None, "reach", str(error).removeprefix(f"{candidate.name}: "))
    return Ability(candidate, None, "reach", f"misses {', '.join(map(str, misses))}", misses)


def _is_missed(one: Miss) -> bool:
    return max(one.distance, one.angle) > TOLERANCE


def _poses(robot: Robot, asked: RobotTask) -> Sequence[Pose | Mapping[str, Any]]:
    """The poses of a task's points."""
    content = dict(asked.content) | {"robot": "any"}
    settings = validated(task_model(), content, Places(asked.folder / "task.toml", {}))
    points = given_points(settings, asked.folder, robot, math.pi / 180.0 if settings.angle == "deg" else 1.0)
    if isinstance(points, str | Path):
        points, _ = read_points(points, robot)
    return list(points)


def nearest_misses(robot: Robot, poses: Sequence[Pose | Mapping[str, Any]]) -> tuple[Miss, ...]:
    """How near a robot's tool comes to each of some poses, each alone.

    Args:
        robot: the robot with its tool and position limits.
        poses: poses, or settings of :meth:`~trajevo.Pose.of`.

    Returns:
        One for each pose, the best of many starts by the sum of the errors of position [m] and orientation [rad].
    """
    kinematics = ToolKinematics.of(robot)
    ranges = JointRanges.of(robot, kinematics)
    starts = np.stack([ranges.middle, *ranges.random(np.random.default_rng(_SEED), _STARTS)])
    found = []
    for k, given in enumerate(poses):
        pose = Pose.of(given)
        solver = PostureSolver(kinematics, ranges, pose.rotation, pose.free_axis)
        q, _ = solver(np.tile(pose.position, (len(starts), 1)), starts)
        distance, angle = missed(*kinematics.pose(q), pose.position, pose.rotation, pose.free_axis)
        best = int(np.argmin(distance + angle))
        found.append(Miss(k, float(distance[best]), float(angle[best])))
    return tuple(found)


def _check_units(able: Sequence[Ability]) -> None:
    """Refuse objectives whose units differ from robot to robot, as jerks of joints that turn or slide."""
    problems = [(one.candidate.name, one.problem) for one in able if one.problem is not None]
    for name, problem in problems[1:]:
        first_name, first = problems[0]
        for mine, other in zip(problem.objectives, first.objectives, strict=True):
            if mine.unit != other.unit:
                raise InvalidInputError(
                    f"objectives: {mine.name} is in {other.unit} for {first_name} and in {mine.unit} for {name}, which "
                    "cannot be compared; expected objectives of one unit, such as time or energy"
                )
