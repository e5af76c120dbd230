"""Files of points: positions of a robot's joints, or poses of its tool."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError
from trajevo.path.tables import Table, read_table
from trajevo.robot.robot import Robot

_TIME = {"t": "s"}
_POSITION = {"x": "m", "y": "m", "z": "m"}

#: Columns of an orientation, each with its SI unit, by the key of a pose.
_ORIENTATIONS = {
    "rpy": {"roll": "rad", "pitch": "rad", "yaw": "rad"},
    "quaternion": {"qx": "1", "qy": "1", "qz": "1", "qw": "1"},
    "rotation_vector": {"rx": "rad", "ry": "rad", "rz": "rad"},
}


def read_points(file: str | Path, robot: Robot) -> tuple[Array | list[dict[str, Any]], str]:
    """Points of a robot from a table, see :mod:`trajevo.path.tables`.

    Args:
        file: its columns, each with its unit and in any order, are all joints of the robot by name, or ``x, y, z`` of
            the tool. Beside these may be its orientation: ``roll, pitch, yaw`` about fixed axes, ``qx, qy, qz, qw``
            (without unit), or the rotation vector ``rx, ry, rz`` (axis times angle). Capitals do not matter there.
        robot: the robot.

    Returns:
        Joint positions, shape (n_points, n_joints) [rad or m], or settings of poses; and the unit of angles of the
        file.

    Raises:
        InvalidInputError: the file cannot be read, or has other columns; the message names the column.
    """
    joints = joint_columns(robot)
    table = read_table(file, example=", ".join(f"{name} [{unit}]" for name, unit in joints.items()))
    angle = "deg" if any(column.unit == "deg" for column in table.columns) else "rad"
    return (_poses(table) if _holds_poses(table, robot) else table.si(joints)), angle


def read_timed_poses(file: str | Path) -> list[dict[str, Any]]:
    """Poses over time from a table, see :mod:`trajevo.path.tables`.

    Args:
        file: its columns, each with its unit and in any order, are ``t``, ``x``, ``y``, ``z``, and those of an
            orientation as for :func:`read_points`, or none.

    Returns:
        For every row ``t`` [s], ``position`` [m] and the orientation by the key of a pose.

    Raises:
        InvalidInputError: the file cannot be read, or has other columns; the message names the column.
    """
    return _poses(read_table(file, example="t [s], x [m], y [m], z [m], yaw [deg]"), _TIME)


def _poses(table: Table, before: Mapping[str, str] | None = None) -> list[dict[str, Any]]:
    """Settings of poses.

    Args:
        table: the table.
        before: further columns, and their SI units, that become keys of the settings.
    """
    more = before or {}
    known = (*more, *_POSITION, *(name for columns in _ORIENTATIONS.values() for name in columns))
    table = table.renamed({name: name.casefold() for name in table.names if name.casefold() in known})
    given = [key for key, columns in _ORIENTATIONS.items() if set(columns) & set(table.names)]
    if len(given) > 1:
        one, other = (", ".join(_ORIENTATIONS[key]) for key in given[:2])
        raise InvalidInputError(f"{table.file}: line {table.line}: expected one orientation, got {one} and {other}")
    columns = {**more, **_POSITION, **(_ORIENTATIONS[given[0]] if given else {})}
    if not set(table.names) <= set(columns):  # all columns that a table of poses may have are told
        columns |= {name: unit for one in _ORIENTATIONS.values() for name, unit in one.items()}
    found = []
    for row in table.si(columns).tolist():
        pose = dict(zip(more, row, strict=False)) | {"position": row[len(more) : len(more) + 3]}
        found.append(pose | ({given[0]: row[len(more) + 3 :]} if given else {}))
    return found


def joint_columns(robot: Robot) -> dict[str, str]:
    """Columns of a robot's joints: their names and SI units."""
    return dict(zip(robot.joint_names, robot.joint_units, strict=True))


def _holds_poses(table: Table, robot: Robot) -> bool:
    """Whether a table's columns are those of poses; a robot's joints may have the same names."""
    names = {name.casefold() for name in table.names}
    if set(table.names) & set(robot.joint_names):
        return set(_POSITION) <= names and not set(_POSITION) <= set(robot.joint_names)
    return bool(names & set(_POSITION))
