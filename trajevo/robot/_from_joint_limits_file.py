"""MoveIt's ``joint_limits.yaml``, in and out."""

from __future__ import annotations

import math
from collections.abc import Collection
from pathlib import Path
from typing import Any

import yaml

from trajevo.errors import InvalidInputError, UnknownNameError, checked_name
from trajevo.joints import JointLimits

#: Our limit -> MoveIt's flag and keys.
_KEYS = {
    "position": ("has_position_limits", ("min_position", "max_position")),
    "velocity": ("has_velocity_limits", ("max_velocity",)),
    "acceleration": ("has_acceleration_limits", ("max_acceleration",)),
    "jerk": ("has_jerk_limits", ("max_jerk",)),
    "effort": ("has_effort_limits", ("max_effort",)),
}

#: MoveIt's factors, by which it multiplies the limits of every joint -> our limit.
_SCALES = {
    "default_velocity_scaling_factor": "velocity",
    "default_acceleration_scaling_factor": "acceleration",
}

_KNOWN = {key for flag, keys in _KEYS.values() for key in (flag, *keys)} | {"angle_wraparound"}


def read_joint_limits(
    file: str | Path, names: tuple[str, ...], locked: Collection[str] = ()
) -> dict[str, dict[str, Any]]:
    """Limits of a MoveIt file, as :func:`trajevo.robot.load_robot` takes them: limit -> joint -> value, SI.

    A limit whose ``has_...`` is false is infinite. It is not given if it is not mentioned, or if a number stands beside
    the false: MoveIt's setup assistant writes that where nobody filled one in. The default scaling factors count, as
    they do in MoveIt.

    Args:
        file: YAML with ``joint_limits``.
        names: joints of the robot.
        locked: joints that are held still; their entries are passed over.

    Raises:
        UnknownNameError: a joint that the robot does not have, or an unknown key.
        InvalidInputError: not such a file, a value that is missing or no number, or a factor for a joint whose limit
            stands elsewhere.
    """
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
            raise InvalidInputError(f"{file}: {key}: expected the {limit} limit of {elsewhere[0]!r} too, to be scaled")
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
