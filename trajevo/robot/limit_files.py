"""Joint limits from all their sources.

The limits of ``robot.toml``, or else those of the URDF, are completed and replaced by those of the caller. A limit that
is still missing is an error: nothing is filled in silently.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.units import believed, per_time, quantity
from trajevo.errors import InvalidInputError, UnknownNameError, checked_name
from trajevo.robot.moveit_limits import read_joint_limits

QUANTITIES = ("position", "velocity", "acceleration", "jerk", "effort")


def declared_limits(
    model: Any,
    names: tuple[str, ...],
    units: tuple[str, ...],
    declared: Mapping[str, Array] | None,
    given: Mapping[str, Any],
    urdf: Path,
) -> dict[str, Array]:
    """Columns of JointLimits, SI: limits of ``robot.toml``, or else of the URDF, overridden by those of the caller."""
    columns = dict(declared) if declared is not None else _of_urdf(model)
    _replace(columns, given, names, units)
    for key in ("acceleration", "jerk"):
        missing = [name for k, name in enumerate(names) if key not in columns or np.isnan(columns[key][k])]
        if missing:
            raise InvalidInputError(
                f"{urdf}: no {key} limit for {', '.join(missing)}, which a URDF cannot hold: give it in robot.toml "
                f"({key} = {{ limit = 10.0, unit = ... }} of each joint), in task.toml ([limits] {key} = 10.0), or as "
                f'an argument (limits={{"{key}": 10.0}}); inf means no limit'
            )
    _check(columns, names, urdf)
    return columns


def limits_or_none(
    names: tuple[str, ...], units: tuple[str, ...], given: Mapping[str, Any], where: str
) -> dict[str, Array]:
    """Columns of JointLimits, SI, of a robot that no file gives limits: those of the caller, and else none."""
    columns = {key: np.full(len(names), np.inf) for key in ("upper", *QUANTITIES[1:])}
    columns["lower"] = -columns["upper"]
    _replace(columns, given, names, units)
    _check(columns, names, where)
    return columns


def _replace(
    columns: dict[str, Array], given: Mapping[str, Any], names: tuple[str, ...], units: tuple[str, ...]
) -> None:
    """Replace limits by those of the caller."""
    for key, value in given.items():
        checked_name("limit", key, QUANTITIES)
        if key == "position":
            pairs = per_joint(key, value, names, units, size=2)
            columns["lower"], columns["upper"] = (
                _merged(columns.get("lower"), pairs[:, 0]),
                _merged(columns.get("upper"), pairs[:, 1]),
            )
        else:
            columns[key] = _merged(columns.get(key), per_joint(key, value, names, units)[:, 0])


def given_limits(
    given: Any, names: tuple[str, ...], units: tuple[str, ...], locked: Collection[str]
) -> Mapping[str, Any]:
    """The limits that a caller gave, as a mapping: none, the mapping itself, or those of a MoveIt file.

    Raises:
        InvalidInputError: anything else, or as for :func:`~trajevo.robot.moveit_limits.read_joint_limits`.
    """
    if isinstance(given, str | Path):
        return read_joint_limits(given, names, units, locked)
    if not isinstance(given, Mapping | None):
        raise InvalidInputError(f"limits: expected a mapping from limits to values or a MoveIt file, got {given!r}")
    return {} if given is None else given


def _check(columns: Mapping[str, Array], names: tuple[str, ...], urdf: Path | str) -> None:
    """Refuse limits of zero, which mean "not known" in many URDFs, and empty ranges."""
    for key in QUANTITIES[1:]:
        for name, value in zip(names, columns[key].tolist(), strict=True):
            if not value > 0.0:
                raise InvalidInputError(
                    f"{urdf}: joint {name!r}: {key}: expected a positive limit, got {value:g}: give it in robot.toml, "
                    f'in task.toml ([limits] {key} = ...), or as an argument (limits={{"{key}": ...}}); '
                    "inf means no limit"
                )
    for name, lower, upper in zip(names, columns["lower"].tolist(), columns["upper"].tolist(), strict=True):
        if not lower < upper:
            raise InvalidInputError(
                f"{urdf}: joint {name!r}: position: lower must be below upper, got {lower:g} and {upper:g}"
            )


def _of_urdf(model: Any) -> dict[str, Array]:
    return {
        "lower": np.array(model.lowerPositionLimit),
        "upper": np.array(model.upperPositionLimit),
        "velocity": np.array(model.upperVelocityLimit),
        "effort": np.array(model.upperEffortLimit),
    }


def _merged(before: Array | None, after: Array) -> Array:
    return after if before is None else np.where(np.isnan(after), before, after)


def per_joint(key: str, value: Any, names: tuple[str, ...], units: tuple[str, ...], *, size: int = 1) -> Array:
    """Values of a limit for each joint as given by a caller, shape (n_joints, size) [SI], NaN where none was given.

    Raises:
        UnknownNameError: a joint that the robot does not have.
        InvalidInputError: another number of values, or one that is no number with a unit of the limit.
    """
    table = np.full((len(names), size), np.nan)
    if isinstance(value, Mapping):
        for joint in value:
            if joint not in names:
                raise UnknownNameError(f"joint in limits.{key}", joint, names)
        chosen = value
    else:
        rows = list(value) if isinstance(value, list | tuple | np.ndarray) else [value]
        if size == 2 and len(rows) == 2 and not isinstance(rows[0], list | tuple | np.ndarray):
            rows = [rows]
        if len(rows) == 1:
            rows = rows * len(names)
        if len(rows) != len(names):
            raise InvalidInputError(f"limits.{key}: expected 1 or {len(names)} values, got {len(rows)}")
        chosen = dict(zip(names, rows, strict=True))
    for joint, entry in chosen.items():
        k = names.index(joint)
        parts = list(entry) if isinstance(entry, list | tuple | np.ndarray) else [entry]
        if len(parts) != size:
            raise InvalidInputError(f"limits.{key}.{joint}: expected {size} numbers, got {entry!r}")
        table[k] = [_with_unit(f"limits.{key}.{joint}", part, _unit(key, units[k])) for part in parts]
    return table


def _unit(key: str, unit: str) -> str:
    if key == "effort":
        return "N" if unit == "m" else "N*m"
    return per_time(unit, ("position", "velocity", "acceleration", "jerk").index(key))


def _with_unit(name: str, value: Any, unit: str) -> float:
    if value in ("inf", "-inf"):  # JSON can write infinity only as text
        return float(value)
    if isinstance(value, str):
        return quantity(value, unit, name=name)
    if isinstance(value, bool) or not isinstance(value, int | float | np.number) or np.isnan(value):
        raise InvalidInputError(f"{name}: expected a number [{unit}] or inf, got {value!r}")
    return believed(float(value), unit, name=name)
