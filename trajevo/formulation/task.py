"""Tasks: a robot, its points, objectives and limits in a file ``task.toml`` of some 15 lines."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from trajevo.base.own.code import looking_in
from trajevo.base.toml import Places
from trajevo.errors import InvalidInputError, TrajevoError
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.formulation.registry import load_problem
from trajevo.formulation.task_file import MovingSettings, PassingSettings, SegmentSettings, TaskSettings
from trajevo.formulation.via_points import LONGEST_TITLE, checked_title
from trajevo.path.via_points import joint_points
from trajevo.robot.locate import robot_path
from trajevo.robot.robot import Robot, robot_of

#: The registered problem that a task is solved as.
TASK_PROBLEM = "via-points"


def task_problem(settings: TaskSettings, where: Places) -> TrajectoryProblem:
    """The problem of a task.

    Args:
        settings: the keys of the task's file.
        where: their lines in the file; relative paths start from the folder of this file.

    Raises:
        InvalidInputError: a value that cannot be used; the message names file, line and key.
    """
    to_rad = math.pi / 180.0 if settings.angle == "deg" else 1.0
    folder = where.file.resolve().parent
    with where.at("name"):
        title = where.file.stem[:LONGEST_TITLE] if settings.name is None else checked_title(settings.name, name="name")
    with where.at("robot"):
        robot = _robot(settings, folder)
    with where.at("points"):
        points = _points(settings, folder, robot, to_rad)
        if settings.base is None and settings.order is None and settings.postures in (None, "nearest"):
            points = joint_points(points, robot, angle=settings.angle, turns=settings.turns)
    arguments = {
        "robot": robot,
        "points": points,
        "base": None if settings.base is None else settings.base.model_dump(exclude_none=True),
        "order": _order(settings),
        "postures": settings.postures,
        "turns": settings.turns,
        "duration_bounds": settings.duration_bounds,
        "interpolant": settings.interpolant,
        "extra_points": settings.extra_points,
        "pace": settings.pace,
        "bspline": settings.bspline,
        "moving": [_box(box, robot, to_rad) for box in settings.moving],
        "passing": [_passing(one, robot, to_rad) for one in settings.passing],
        "segments": [_segment(one, to_rad) for one in settings.segment],
        "cyclic": settings.cyclic,
        "objectives": settings.objectives,
        "constraints": _limits_kept(settings, robot),
        **_beside(settings.parameters, folder),
        "limits": settings.constraints.held,
        "payload": _beside(settings.carried, folder),
        "payload_range": settings.payload_range,
        "reference_point": settings.reference_point,
        "samples": settings.samples,
        "title": title,
    }
    try:
        with looking_in(folder):
            return load_problem(TASK_PROBLEM, **arguments)
    except TrajevoError as error:
        raise InvalidInputError(where.guess(error)) from error


def _limits_kept(settings: TaskSettings, robot: Robot) -> list[str]:
    """Names of the limits: those of the file, or all that the robot can have."""
    listed = settings.constraints.limits
    given = "limits" in settings.constraints.model_fields_set
    return listed if given or robot.has_body else [name for name in listed if name != "effort"]


def _beside(given: Any, folder: Path, *, names_file: bool = False) -> Any:
    """The same data with the files of meshes, scenes and motions relative to the task's folder."""
    if isinstance(given, list):
        return [_beside(entry, folder) for entry in given]
    if not isinstance(given, dict):
        return given
    named = names_file or given.get("shape") == "mesh"
    return {
        key: str(folder / value)
        if named and key == "file" and isinstance(value, str)
        else _beside(value, folder, names_file=key in ("scene", "motion"))
        for key, value in given.items()
    }


def _robot(settings: TaskSettings, folder: Path) -> Robot:
    given: dict[str, Any] = (
        {"name": settings.robot} if isinstance(settings.robot, str) else settings.robot.model_dump(exclude_none=True)
    )
    limits = settings.limits.model_dump(exclude_none=True)
    if limits:
        given["limits"] = limits
    if not {"dh", "joints", "kind"}.isdisjoint(given):
        return robot_of(given)
    name = Path(given["name"])
    if robot_path(name, folder=folder) or name.suffix or len(name.parts) > 1:
        given["name"] = folder / name
    if "packages" in given:
        listed = given["packages"]
        given["packages"] = [folder / each for each in ([listed] if isinstance(listed, str) else listed)]
    return robot_of(given)


def _order(settings: TaskSettings) -> Any:
    given = settings.order
    return given if given is None or isinstance(given, str) else given.model_dump(exclude_none=True)


def _points(settings: TaskSettings, folder: Path, robot: Robot, to_rad: float) -> Any:
    if isinstance(settings.points, str):
        return folder / settings.points
    points: list[Any] = []
    for point in settings.points:
        joints = point if isinstance(point, list) else point.joints
        if joints is not None:
            points.append(_in_radians(joints, robot, to_rad))
            continue
        pose: dict[str, Any] = {} if isinstance(point, list) else point.model_dump(exclude_none=True)
        for key in ("rpy", "rotation_vector"):
            if key in pose:
                pose[key] = [angle * to_rad for angle in pose[key]]
        points.append(pose)
    return points


def _box(box: MovingSettings, robot: Robot, to_rad: float) -> Mapping[str, Any]:
    if box.tool is not None:
        return {"point": box.point, "tool": list(box.tool)}
    widths = box.joints if isinstance(box.joints, list) else [box.joints or 0.0] * robot.dof
    return {"point": box.point, "joints": _in_radians(widths, robot, to_rad)}


def _passing(one: PassingSettings, robot: Robot, to_rad: float) -> Mapping[str, Any]:
    given = one.model_dump(exclude_none=True)
    return given | {key: _in_radians(given[key], robot, to_rad) for key in ("velocity", "acceleration") if key in given}


def _segment(one: SegmentSettings, to_rad: float) -> Mapping[str, Any]:
    given = one.model_dump(exclude_none=True, by_alias=True)
    angles = {key: to_rad * given[key] for key in ("turning", "upright") if isinstance(given.get(key), float | int)}
    return given | angles


def _in_radians(values: list[float], robot: Robot, to_rad: float) -> list[float]:
    """Angles of revolute joints in rad, lengths unchanged. A wrong number of values is refused where they are used."""
    if len(values) != robot.dof or to_rad == 1.0:
        return list(values)
    return [value * (to_rad if unit == "rad" else 1.0) for value, unit in zip(values, robot.joint_units, strict=True)]
