"""Drives of joints as files and callers give them, and the robot's own from both."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from trajevo.base.units import quantity
from trajevo.errors import InvalidInputError, UnknownNameError, checked_name
from trajevo.robot.drive import DRIVE_UNITS, Drive
from trajevo.robot.joints import Friction

#: Unit of the speed of a joint, and of its effort, by the unit of its position.
_LINE = {"rad": ("rad/s", "N*m"), "m": ("m/s", "N")}


def drive_values(given: Any, unit: str, where: Callable[..., str]) -> dict[str, Any]:
    """What is told of the drive of one joint, in SI.

    Args:
        given: mapping from attributes of :class:`~trajevo.robot.drive.Drive` to numbers in SI or text with a unit.
        unit: unit of the joint's positions, ``"rad"`` or ``"m"``.
        where: beginning of a message about the drive, or about the attribute that is its argument.

    Raises:
        InvalidInputError: no mapping, or text that is no number with such a unit.
        UnknownNameError: another name.
    """
    if not isinstance(given, Mapping):
        raise InvalidInputError(f"{where()}: expected a mapping from {', '.join(Drive.names())}, got {given!r}")
    found: dict[str, Any] = {}
    for name, value in given.items():
        checked_name(f"key of {where()}", name, Drive.names())
        if value is None:
            continue
        if name == "torque_speed":
            found[name] = [_point(point, unit, where(name)) for point in value] if _listed(value) else value
        elif name in DRIVE_UNITS:
            found[name] = _si(value, DRIVE_UNITS[name][unit == "m"], where(name))
        else:
            found[name] = value
    return found


def robot_drives(
    given: Any,
    declared: Mapping[str, Mapping[str, Any]],
    names: tuple[str, ...],
    units: tuple[str, ...],
    locked: Collection[str] = (),
) -> dict[str, Drive]:
    """The drives of a robot by joint, in the order of its joints.

    Args:
        given: what a caller gave, a mapping from joints to what completes or replaces that of the file, or None.
        declared: the same of ``robot.toml``, in SI.
        names: names of the robot's joints.
        units: units of their positions.
        locked: joints that are held still; what is told of them counts for nothing.

    Raises:
        InvalidInputError: anything else, or a drive that there cannot be.
        UnknownNameError: another joint, or another name of an attribute.
    """
    if not isinstance(given, Mapping | None):
        raise InvalidInputError(f"drives: expected a mapping from joints to their drives, got {given!r}")
    told = {name: dict(values) for name, values in declared.items()}
    for joint, values in (given or {}).items():
        if joint in locked:
            continue
        if joint not in names:
            raise UnknownNameError("joint in drives", joint, names)
        found = drive_values(_as_told(values), units[names.index(joint)], partial(_argument, joint))
        told[joint] = told.get(joint, {}) | found
    return {joint: _drive(joint, told[joint]) for joint in names if joint in told}


def with_rotors(friction: Friction, drives: Mapping[str, Drive], names: tuple[str, ...]) -> Friction:
    """Friction whose armature holds the rotors of drives, which must not be declared twice.

    Raises:
        InvalidInputError: a joint has an armature already.
    """
    armature = friction.armature.copy()
    for joint, drive in drives.items():
        if not drive.rotor_inertia or drive.gear_ratio is None:
            continue
        k = names.index(joint)
        if armature[k] > 0.0:
            raise InvalidInputError(
                f"drives.{joint}.rotor_inertia: expected it once, but the joint has an armature of {armature[k]:g} "
                "already: leave one of them out"
            )
        armature[k] = drive.rotor_inertia * drive.gear_ratio**2
    return replace(friction, armature=armature)


def plain_drives(given: Any) -> Any:
    """Drives that a caller gave as plain data."""
    if not isinstance(given, Mapping):
        return given
    return {joint: _as_told(one) for joint, one in given.items()}


def _as_told(given: Any) -> Any:
    """What a drive says as a mapping, and anything else as it is."""
    if not isinstance(given, Drive):
        return given
    values = {name: getattr(given, name) for name in Drive.names()}
    return {name: value for name, value in values.items() if value is not None and value is not False and value != ""}


def _argument(*place: str) -> str:
    return ".".join(("drives", *place))


def _drive(joint: str, values: Mapping[str, Any]) -> Drive:
    try:
        return Drive(**values)
    except InvalidInputError as error:
        raise InvalidInputError(f"drives.{joint}.{error}") from error


def _listed(value: Any) -> bool:
    return isinstance(value, list | tuple | np.ndarray)


def _point(point: Any, unit: str, name: str) -> Any:
    if not _listed(point) or len(point) != 2:
        return point
    return [_si(x, si, name) for x, si in zip(point, _LINE[unit], strict=True)]


def _si(value: Any, unit: str, name: str) -> Any:
    return quantity(value, unit, name=name) if isinstance(value, str) else value
