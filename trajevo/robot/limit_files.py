"""Joint limits from all their sources, and MoveIt's ``joint_limits.yaml``, which is read and written here.

The limits of ``robot.toml``, or else those of the URDF, are completed and replaced by those of the caller. A limit that
is still missing is an error: nothing is filled in silently.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.units import believed, per_time, quantity
from trajevo.errors import InvalidInputError, UnknownNameError, checked_name
from trajevo.robot.joints import JointLimits

#: Limit of trajevo -> MoveIt's flag and keys.
_KEYS = {
    "position": ("has_position_limits", ("min_position", "max_position")),
    "velocity": ("has_velocity_limits", ("max_velocity",)),
    "acceleration": ("has_acceleration_limits", ("max_acceleration",)),
    "jerk": ("has_jerk_limits", ("max_jerk",)),
    "effort": ("has_effort_limits", ("max_effort",)),
}

#: MoveIt's scaling factors -> the limit that each one multiplies, for all joints.
_SCALES = {
    "default_velocity_scaling_factor": "velocity",
    "default_acceleration_scaling_factor": "acceleration",
}


_KNOWN = {key for flag, keys in _KEYS.values() for key in (flag, *keys)} | {"angle_wraparound"}


def read_joint_limits(
    file: str | Path, names: tuple[str, ...], locked: Collection[str] = ()
) -> dict[str, dict[str, Any]]:
    """Limits of a MoveIt file, as :func:`trajevo.robot.robot.load_robot` takes them: limit -> joint -> value, SI.

    A limit whose ``has_...`` is false is infinite. A limit counts as not given if the file does not mention it, or if
    ``has_...`` is false beside a number, which MoveIt's setup assistant writes for limits that nobody has filled in.
    The default scaling factors are applied, as in MoveIt.

    Args:
        file: YAML with ``joint_limits``.
        names: joints of the robot.
        locked: locked joints; their entries are ignored.

    Raises:
        UnknownNameError: a joint that the robot does not have, or an unknown key.
        InvalidInputError: the file is not of this kind, a value is missing or not a number, or a factor applies to a
            joint whose limit is not in the file.
    """
    import yaml  # imported where it reads and writes, since that takes long

    try:
        content = yaml.safe_load(Path(file).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        why = " ".join(str(getattr(error, "strerror", None) or error).split())
        raise InvalidInputError(f"{file}: cannot be read as YAML: {why}") from error
    if not isinstance(content, dict) or not isinstance(content.get("joint_limits"), dict):
        raise InvalidInputError(f"{file}: expected a mapping 'joint_limits' from joints to limits, got {content!r}")
    scales = {"position": 1.0, "velocity": 1.0, "acceleration": 1.0, "jerk": 1.0, "effort": 1.0}
    for key, value in content.items():
        if key != "joint_limits":
            checked_name(f"key in {file}", key, ["joint_limits", *_SCALES])
            scales[_SCALES[key]] = _number(value, f"{file}: {key}", least=0.0)
    found: dict[str, dict[str, Any]] = {}
    for joint, entry in content["joint_limits"].items():
        if joint in locked:
            continue
        if joint not in names:
            raise UnknownNameError(f"joint in {file}", joint, names)
        for limit, value in _of_joint(entry, f"{file}: {joint}").items():
            scale = scales[limit]
            found.setdefault(limit, {})[joint] = value if limit == "position" else value[0] * scale
    for key, limit in _SCALES.items():
        elsewhere = [name for name in names if name not in found.get(limit, {})]
        if scales[limit] != 1.0 and elsewhere:
            raise InvalidInputError(f"{file}: {key}: expected the {limit} limit of {elsewhere[0]!r} too, to scale it")
    return found


def _of_joint(entry: Any, where: str) -> dict[str, tuple[float, ...]]:
    if not isinstance(entry, dict):
        raise InvalidInputError(f"{where}: expected a mapping of limits, got {entry!r}")
    for key in entry:
        checked_name(f"key in {where}", key, _KNOWN)
    found = {}
    for limit, (flag, keys) in _KEYS.items():
        given = [key for key in keys if key in entry]
        has = entry.get(flag, bool(given))
        if not isinstance(has, bool):
            raise InvalidInputError(f"{where}: {flag}: expected true or false, got {has!r}")
        if has and len(given) < len(keys):
            missing = next(key for key in keys if key not in entry)
            raise InvalidInputError(f"{where}: {flag} is true, but {missing} is missing")
        if has:
            found[limit] = tuple(_number(entry[key], f"{where}: {key}") for key in keys)
        elif flag in entry and not given:
            found[limit] = (-math.inf, math.inf) if limit == "position" else (math.inf,)
    return found


def write_joint_limits(limits: JointLimits, names: tuple[str, ...]) -> str:
    """Limits as a MoveIt file; an infinite one is written as ``has_...: false``. MoveIt ignores jerk and effort."""
    import yaml  # imported where it reads and writes, since that takes long

    joints: dict[str, dict[str, Any]] = {}
    for k, name in enumerate(names):
        joint = joints.setdefault(name, {})
        for limit, (flag, keys) in _KEYS.items():
            columns = (limits.lower, limits.upper) if limit == "position" else (getattr(limits, limit),)
            values = [float(column[k]) for column in columns]
            joint[flag] = all(map(math.isfinite, values))
            if joint[flag]:
                joint |= dict(zip(keys, values, strict=True))
    text: str = yaml.safe_dump({"joint_limits": joints}, sort_keys=False)
    return text


def _number(value: Any, where: str, least: float = -math.inf) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value) or value <= least:
        kind = "a finite number" if least == -math.inf else f"a finite number above {least:g}"
        raise InvalidInputError(f"{where}: expected {kind}, got {value!r}")
    return float(value)


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
    for key, value in given.items():
        checked_name("limit", key, QUANTITIES)
        if key == "position":
            pairs = _per_joint(key, value, names, units, size=2)
            columns["lower"], columns["upper"] = (
                _merged(columns.get("lower"), pairs[:, 0]),
                _merged(columns.get("upper"), pairs[:, 1]),
            )
        else:
            columns[key] = _merged(columns.get(key), _per_joint(key, value, names, units)[:, 0])
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


def given_limits(given: Any, names: tuple[str, ...], locked: Collection[str]) -> Mapping[str, Any]:
    """The limits that a caller gave, as a mapping: none, the mapping itself, or those of a MoveIt file.

    Raises:
        InvalidInputError: anything else, or as for :func:`read_joint_limits`.
    """
    if isinstance(given, str | Path):
        return read_joint_limits(given, names, locked)
    if not isinstance(given, Mapping | None):
        raise InvalidInputError(f"limits: expected a mapping from limits to values or a MoveIt file, got {given!r}")
    return {} if given is None else given


def _check(columns: Mapping[str, Array], names: tuple[str, ...], urdf: Path) -> None:
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


def _per_joint(key: str, value: Any, names: tuple[str, ...], units: tuple[str, ...], *, size: int = 1) -> Array:
    """Shape (n_joints, size), NaN where nothing was given."""
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
