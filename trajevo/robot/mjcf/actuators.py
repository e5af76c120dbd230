"""Effort limits of joints by the actuators of MJCF."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple
from xml.etree import ElementTree

from trajevo.errors import InvalidInputError, known_names
from trajevo.robot.mjcf.classes import Attributes, Classes, is_on, number_of, numbers_of

#: Ends of a range of efforts, backward and forward.
_Ends = tuple[float, float]

_UNLIMITED: _Ends = (-math.inf, math.inf)


class Efforts(NamedTuple):
    """What actuators and joints say of efforts.

    Attributes:
        limits: greatest efforts of a joint backward and forward, both magnitudes [N·m or N], by name; NaN if nothing
            limits them.
        notes: what cannot be used as it is said, one clause each.
    """

    limits: dict[str, tuple[float, float]]
    notes: tuple[str, ...]


def efforts_of(
    root: ElementTree.Element, joints: dict[str, Attributes], classes: Classes, file: str, *, autolimits: bool
) -> Efforts:
    """Effort limits: of all actuators of a joint together, and no more than its ``actuatorfrcrange``.

    Args:
        root: top element of the file.
        joints: attributes of joints with those of their classes, by name.
        classes: default classes.
        file: the file, for messages.
        autolimits: whether a range is used where nothing says whether it is.

    Raises:
        InvalidInputError: an actuator of an unknown joint, or numbers that cannot be used.
    """
    driven: dict[str, list[_Ends]] = {}
    notes: list[str] = []
    for element in root.iterfind("actuator/*"):
        given, where = classes.of(element, ""), f"{file}: actuator {element.get('name', '')!r}"
        joint = given.get("joint", given.get("jointinparent"))
        if joint is None:
            notes.append(f"actuator {element.get('name', '')!r}, which drives no single joint, limits none")
        elif joint not in joints:
            raise InvalidInputError(f"{where}: joint {joint!r} is none of the file; {known_names(joint, joints)}")
        else:
            driven.setdefault(joint, []).append(_ends_of(element.tag, given, where, autolimits=autolimits))
    limits = {}
    for name, given in joints.items():
        where = f"{file}: joint {name!r}"
        total = [math.fsum(ends) for ends in zip(*driven[name], strict=True)] if name in driven else list(_UNLIMITED)
        own = _range(given, "actuatorfrcrange", "actuatorfrclimited", where, autolimits=autolimits)
        backward, forward = max(total[0], own[0]), min(total[1], own[1])
        least = min(-backward, forward)
        if least <= 0.0:
            raise InvalidInputError(f"{where}: expected efforts in both directions, got {backward:g} to {forward:g}")
        if math.isclose(-backward, forward, rel_tol=1e-9):
            backward, forward = -least, least
        limits[name] = (math.nan, math.nan) if math.isinf(least) else (-backward, forward)
    return Efforts(limits, tuple(notes))


def _ends_of(tag: str, given: Attributes, where: str, *, autolimits: bool) -> _Ends:
    """Least and greatest effort of an actuator at its joint."""
    ranges = [_range(given, "forcerange", "forcelimited", where, autolimits=autolimits)]
    gain = _gain(tag, given, where)
    if gain is not None:
        controls = _range(given, "ctrlrange", "ctrllimited", where, autolimits=autolimits)
        ranges.append(_scaled(controls, gain))
    least, greatest = max(each[0] for each in ranges), min(each[1] for each in ranges)
    gears = numbers_of(given, "gear", where, counts=range(1, 7))
    return _scaled((least, greatest), 1.0 if gears is None else gears[0])


def _gain(tag: str, given: Attributes, where: str) -> float | None:
    """Effort per control of an actuator whose effort is its control; None of others, such as servos."""
    if tag == "motor":
        return 1.0
    plain = given.get("gaintype", "fixed") == "fixed" and given.get("biastype", "none") == "none"
    if tag != "general" or not plain:
        return None
    found = numbers_of(given, "gainprm", where, counts=range(1, 11))
    return 1.0 if found is None else found[0]


def _scaled(ends: _Ends, factor: float) -> _Ends:
    if factor == 0.0:
        return 0.0, 0.0
    one, other = (end * factor for end in ends)
    return min(one, other), max(one, other)


def _range(given: Attributes, key: str, switch: str, where: str, *, autolimits: bool) -> _Ends:
    found = numbers_of(given, key, where, counts=(2,))
    if not is_on(given, switch, where, auto=autolimits and found is not None):
        return _UNLIMITED
    if found is None or not found[0] < found[1]:
        raise InvalidInputError(f"{where}: {key}: expected a lower and an upper end, got {given.get(key)!r}")
    return found[0], found[1]


def passive_of(given: Attributes, where: str) -> Iterator[tuple[str, float]]:
    """Stiffness, damping, dry friction and armature of a joint, by key, those that are given.

    Raises:
        InvalidInputError: numbers that cannot be used, or a damping or a spring that is no straight line.
    """
    for key in ("stiffness", "damping"):
        values = numbers_of(given, key, where, counts=(1, 2, 3)) or (0.0,)
        if any(values[1:]):
            raise InvalidInputError(f"{where}: {key}: expected one number, got the polynomial {given[key]!r}")
        yield key, values[0]
    for key in ("frictionloss", "armature"):
        yield key, number_of(given, key, where, 0.0)
