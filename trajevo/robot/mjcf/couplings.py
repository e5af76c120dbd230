"""What couples joints in MJCF: equalities and tendons."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from xml.etree import ElementTree

from trajevo.errors import InvalidInputError, known_names
from trajevo.robot.mjcf.classes import Classes, numbers_of

#: What makes a tendon more than a way for an actuator.
_ACTING = ("stiffness", "damping", "frictionloss", "armature", "range")


def mimics_of(
    root: ElementTree.Element, references: Mapping[str, float], file: Path, lock: Collection[str]
) -> Iterator[tuple[str, str, float, float]]:
    """Joints that an equality makes follow another: names of follower and leader, multiplier and offset.

    Args:
        root: top element of the file.
        references: positions of joints at which the file draws them [rad or m], by name.
        file: the file, for messages.
        lock: joints that will be locked.

    Raises:
        InvalidInputError: unknown joints, or an equality that is no straight line or holds a joint still.
    """
    for element in root.iterfind("equality/joint"):
        if element.get("active", "true") == "false":
            continue
        name, leader = element.get("joint1", ""), element.get("joint2")
        where = f"{file}: <equality> of joint {name!r}"
        for joint in (name, leader):
            if joint is not None and joint not in references:
                raise InvalidInputError(f"{where}: no joint {joint!r}; {known_names(joint, references)}")
        found = numbers_of(element.attrib, "polycoef", where, counts=range(1, 12)) or (0.0, 1.0)
        a0, a1, *rest = (*found, 0.0)
        if name in lock:
            continue
        if leader is None:
            raise InvalidInputError(f"{where} holds it still at {references[name] + a0:g}: lock it there (lock=)")
        if any(rest):
            raise InvalidInputError(f"{where}: polycoef: expected a straight line, got {element.get('polycoef')!r}")
        yield name, leader, a1, references[name] + a0 - a1 * references[leader]


def check_loops(root: ElementTree.Element, movers: Mapping[str, str], file: Path) -> None:
    """Refuse equalities that close loops of bodies which are not held still against each other.

    Args:
        root: top element of the file.
        movers: the joint that carries a body, of those that are not locked, by the body's name.
        file: the file, for messages.

    Raises:
        InvalidInputError: the message names the equality.
    """
    for element in (each for each in root.iterfind("equality/*") if each.tag != "joint"):
        if element.get("active", "true") == "false":
            continue
        ends = [element.get("body1", ""), element.get("body2", "world")]
        held = element.tag in ("connect", "weld") and all(end in movers for end in ends)
        if held and movers[ends[0]] == movers[ends[1]]:
            continue
        what = " and ".join(map(repr, ends if element.get("body1") else [element.get("name", "")]))
        raise InvalidInputError(
            f"{file}: <equality>: <{element.tag}> of {what} closes a loop, which cannot be planned for: lock its "
            "joints, or give a file without it"
        )


def check_tendons(root: ElementTree.Element, classes: Classes, file: Path, lock: Collection[str]) -> None:
    """Refuse tendons that pull by themselves or limit joints, unless all their joints are locked.

    Raises:
        InvalidInputError: the message names the tendon.
    """
    for tendon in root.iterfind("tendon/*"):
        given = {**classes.of(tendon, ""), **tendon.attrib}
        acting = [key for key in _ACTING if any(part.strip("0.-+") for part in given.get(key, "").split())]
        joints = [joint.get("joint", "") for joint in tendon.iterfind("joint")]
        if acting and not (joints and all(joint in lock for joint in joints)):
            raise InvalidInputError(
                f"{file}: tendon {tendon.get('name', '')!r}: {acting[0]}: expected a tendon that actuators alone "
                f"pull, got {given[acting[0]]!r}: lock its joints, or give a file without it"
            )
