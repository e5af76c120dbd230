"""Friction and armature of a robot's actuators from all sources: a caller, ``robot.toml``, and the robot's file."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError, checked_name
from trajevo.robot.joints import Friction
from trajevo.robot.limit_files import per_joint
from trajevo.robot.urdf.joints import Follower, JointFriction

#: What a caller may ask for by name: what the robot's file says, whatever ``robot.toml`` does, or none at all.
NAMED = ("file", "urdf", "none")

#: What a caller may give, with its units for joints that turn and that slide.
_UNITS = {
    "viscous": {"rad": "N*m*s/rad", "m": "N*s/m"},
    "coulomb": {"rad": "N*m", "m": "N"},
    "armature": {"rad": "kg*m^2", "m": "kg"},
}

#: What is told of friction that is used, and of friction that is not, by the format of the robot's file.
_TOLD = {
    "URDF": ("friction of <dynamics> used", "efforts leave out what <dynamics> of the URDF says"),
    "MJCF": ("friction and armature of the MJCF file used", "efforts leave out what the MJCF file says"),
}


class FoundFriction(NamedTuple):
    """The friction that is used, and what is told of that in the robot's file, one clause for each joint.

    Attributes:
        friction: friction and armature of the actuators.
        used: what the file says and ``friction`` holds.
        left_out: what it says and ``friction`` does not hold, as the caller or ``robot.toml`` has it otherwise.
    """

    friction: Friction
    used: tuple[str, ...]
    left_out: tuple[str, ...]


def friction_of(
    given: Any,
    dynamics: Mapping[str, JointFriction],
    followers: Sequence[Follower],
    names: tuple[str, ...],
    units: tuple[str, ...],
    declared: Mapping[str, Array] | None,
) -> FoundFriction:
    """The friction of actuators.

    A joint that follows another rubs on the actuator of that one: by virtual work, its damping and its armature with
    the square of the multiplier, its dry friction with the magnitude.

    Args:
        given: what the caller asks for, see :func:`~trajevo.robot.robot.load_robot`.
        dynamics: friction and armature of joints by the robot's file.
        followers: joints that follow others.
        names: names of the actuators.
        units: their units.
        declared: columns of :class:`~trajevo.robot.joints.Friction` by ``robot.toml``, NaN where it says nothing.

    Raises:
        UnknownNameError: another name, kind of friction or joint.
        InvalidInputError: numbers that cannot be used.
    """
    columns = {key: np.full(len(names), np.nan) for key in ("viscous", "coulomb", "coulomb_backward", "armature")}
    columns |= {} if declared is None else {key: np.array(column) for key, column in declared.items()}
    if isinstance(given, str):
        checked_name("friction", given, NAMED)
        for key in ("viscous", "coulomb", "coulomb_backward"):
            columns[key][:] = 0.0 if given == "none" else np.nan
    elif isinstance(given, Mapping):
        _take(columns, given, names, units)
    elif given is not None:
        raise InvalidInputError(f"friction: expected 'file', 'none' or a mapping of {', '.join(_UNITS)}, got {given!r}")
    ways = {name: (k, 1.0) for k, name in enumerate(names)}
    ways |= {each.name: (names.index(each.leader), each.multiplier) for each in followers if each.leader in names}
    return _filled(columns, dynamics, ways)


def _take(columns: dict[str, Array], given: Mapping[str, Any], names: tuple[str, ...], units: tuple[str, ...]) -> None:
    """Replace friction by what a caller gave."""
    for key, value in given.items():
        checked_name("kind of friction", key, _UNITS)
        column = per_joint(f"friction.{key}", value, names, [_UNITS[key][unit] for unit in units])[:, 0]
        for name in ("coulomb", "coulomb_backward") if key == "coulomb" else (key,):
            columns[name] = np.where(np.isnan(column), columns[name], column)


def _filled(
    columns: dict[str, Array], dynamics: Mapping[str, JointFriction], ways: Mapping[str, tuple[int, float]]
) -> FoundFriction:
    """Friction with what the robot's file says where nobody else says anything.

    Args:
        columns: of :class:`~trajevo.robot.joints.Friction`, NaN where nothing is said.
        dynamics: friction of joints by name.
        ways: the actuator that moves a joint, and by which multiplier.
    """
    added = {key: np.zeros_like(column) for key, column in columns.items()}
    used: dict[str, list[str]] = {}
    left: dict[str, list[str]] = {}
    for name, found in dynamics.items():
        said = set(_UNITS)  # by somebody else; of a joint that a transmission drives with others, nobody can say
        if name in ways:
            k, multiplier = ways[name]
            said = {key for key in _UNITS if not np.isnan(columns[key][k])}
            added["viscous"][k] += found.viscous * multiplier**2
            added["armature"][k] += found.armature * multiplier**2
            for key in ("coulomb", "coulomb_backward"):
                added[key][k] += found.coulomb * abs(multiplier)
        for told, keys in ((used, set(_UNITS) - said), (left, said)):
            parts = " and ".join(_parts(found, keys))
            if parts:
                told.setdefault(parts, []).append(repr(name))
    filled = {key: np.where(np.isnan(column), added[key], column) for key, column in columns.items()}
    clauses = (
        tuple(f"{parts} of {_joints(names, len(ways))}" for parts, names in told.items()) for told in (used, left)
    )
    return FoundFriction(Friction(**filled), *clauses)


def _joints(names: list[str], count: int) -> str:
    """Names of joints in words, of a robot of so many."""
    return "all joints" if len(names) == count > 2 else ", ".join(names)


def _parts(found: JointFriction, keys: Collection[str]) -> Iterator[str]:
    """What the file says of a joint in words, of some kinds of friction."""
    if found.coulomb and "coulomb" in keys:
        yield f"friction {found.coulomb:g} {'N' if found.slides else 'N·m'}"
    if found.viscous and "viscous" in keys:
        yield f"damping {found.viscous:g} {'N·s/m' if found.slides else 'N·m·s/rad'}"
    if found.armature and "armature" in keys:
        yield f"armature {found.armature:g} {'kg' if found.slides else 'kg·m²'}"


def friction_notes(kind: str, used: Sequence[str], left_out: Sequence[str]) -> tuple[str, ...]:
    """What is told of the clauses of :class:`FoundFriction`, of a robot from a file of some format."""
    told = zip(_TOLD.get(kind, _TOLD["URDF"]), (used, left_out), strict=True)
    return tuple(f"{what}: {', '.join(clauses)}" for what, clauses in told if clauses)
