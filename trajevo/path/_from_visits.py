"""What must be visited, as users give it: joint positions, tool poses, a CSV file of either."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from trajevo.arrays import Array, numbers
from trajevo.errors import InvalidInputError
from trajevo.inverse_kinematics import Pose, inverse_kinematics
from trajevo.path import ViaPoints, read_columns, read_header
from trajevo.robot import Robot

_POSITION = {"x": "m", "y": "m", "z": "m"}
_ORIENTATION = {"roll": "rad", "pitch": "rad", "yaw": "rad"}


def joint_points(points: Any, robot: Robot) -> ViaPoints:
    """Via points of a robot from whatever a user may give.

    Args:
        points: via points, an array (K, n_joints) [rad or m], a list of joint positions, of poses
            (:class:`~trajevo.inverse_kinematics.Pose` or their mappings) or of both, or a CSV file: a column with its
            unit for each joint, or ``x [m], y [m], z [m]`` and, if the orientation counts, ``roll, pitch, yaw``.
        robot: the robot; poses become the joint positions nearest to the point before, so that the path stays short.

    Raises:
        UnreachableError: a pose that the tool cannot take.
        InvalidInputError: no points, points of another make, or outside the ranges of the joints.
    """
    if points is None:
        raise InvalidInputError(f"points: robot {robot.name!r} needs points to pass, shape (n_points, {robot.dof})")
    if isinstance(points, ViaPoints):
        return ViaPoints.for_robot(robot, points.positions)
    if isinstance(points, str | Path):
        points = _from_file(points, robot)
    if isinstance(points, list | tuple) and any(isinstance(point, Pose | Mapping) for point in points):
        points = _solved(points, robot)
    return ViaPoints.for_robot(robot, points)


def _from_file(file: str | Path, robot: Robot) -> Any:
    names = read_header(file)
    if not set(_POSITION) <= set(names) or set(_POSITION) <= set(robot.joint_names):
        return read_columns(file, dict(zip(robot.joint_names, robot.joint_units, strict=True)))
    if not set(_ORIENTATION) & set(names):
        return [{"position": row.tolist()} for row in read_columns(file, _POSITION)]
    table = read_columns(file, _POSITION | _ORIENTATION)
    return [{"position": row[:3].tolist(), "rpy": row[3:].tolist()} for row in table]


def _solved(points: Any, robot: Robot) -> Array:
    """Joint positions of a mixed list; every pose is solved from the point before it."""
    rows: list[Array] = []
    for k, point in enumerate(points):
        if isinstance(point, Pose | Mapping):
            start = rows[-1] if rows else None
            rows.append(inverse_kinematics(robot, [point], start=start, first=k)[0])
        else:
            rows.append(numbers(point, name=f"points: point {k}", shape=(robot.dof,)))
    return np.array(rows)
