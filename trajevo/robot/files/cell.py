"""A robot in its cell: where its base stands, and which tool is mounted. Both become links of its URDF."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError, UnknownNameError, checked_name
from trajevo.robot.description import Description
from trajevo.robot.loading.chain import Pose6
from trajevo.robot.loading.dh import real_quantity, tensor_of
from trajevo.robot.urdf.file import end_of
from trajevo.robot.urdf.problems import checked_text

#: The link that stands for the cell, in whose frame points, poses, obstacles and gravity are given.
CELL = "cell"

_POSE = ("position", "rpy")
_TOOL = ("name", "parent", *_POSE, "mass", "com", "inertia")


def pose_of(given: Any, where: str) -> Pose6:
    """A pose from a mapping with ``position`` [m] and ``rpy`` [rad], numbers or text with a unit; 0 if left out.

    Raises:
        InvalidInputError: no mapping, or numbers that cannot be used.
        UnknownNameError: another key.
    """
    if not isinstance(given, Mapping):
        raise InvalidInputError(f"{where}: expected a mapping with position and rpy, got {given!r}")
    for key in given:
        checked_name(f"key of {where}", key, _POSE)
    return Pose6(
        *(_triple(given.get(key), unit, f"{where}.{key}") for key, unit in zip(_POSE, ["m", "rad"], strict=True))
    )


def placed(found: Description, base: Any, where: Path | str) -> Description:
    """A description whose first link stands in the cell.

    Args:
        found: the robot as its file has it.
        base: pose of the first link, see :func:`pose_of`; None leaves it as it is.
        where: the file, for messages.
    """
    if base is None:
        return found
    pose = pose_of(base, "base")
    robot = ElementTree.fromstring(found.text)
    carried = {end_of(joint, "child") for joint in robot.iterfind("joint")}
    links = [link.get("name", "") for link in robot.iterfind("link")]
    root = next(link for link in links if link not in carried)
    cell = CELL if CELL not in links else f"{CELL} of {root}"
    robot.insert(0, ElementTree.Element("link", name=cell))
    _fix(robot, f"to {root}", (cell, root), pose)
    return replace(found, text=checked_text(robot, where, look=True), as_written=False)


def base_of(description: ElementTree.Element) -> Pose6:
    """Where the first link of a robot stands in the cell, as :func:`placed` put it there; at its origin if it did not.

    Args:
        description: the top element of its URDF.
    """
    first = description.find("link")
    cell = "" if first is None else first.get("name", "")
    for joint in description.iterfind("joint"):
        root, origin = end_of(joint, "child"), joint.find("origin")
        own = cell in (CELL, f"{CELL} of {root}") and joint.get("name") == f"to {root}"
        if own and origin is not None and end_of(joint, "parent") == cell:
            place = (np.array([float(number) for number in origin.get(key, "0 0 0").split()]) for key in ("xyz", "rpy"))
            return Pose6(*place)
    return Pose6(np.zeros(3), np.zeros(3))


def mounted(found: Description, tools: Any, tool: str | None, where: Path | str) -> tuple[Description, str | None]:
    """A description with one of some tools, and the name of its tool frame.

    Args:
        found: the robot as its file has it.
        tools: mappings with ``name``, ``parent`` (a link), ``position`` [m] and ``rpy`` [rad] in it, ``mass`` [kg],
            ``com`` [m] and ``inertia`` about it (3, 3) or its diagonal (3,) [kg·m²], both in the tool's frame; all but
            name and parent are 0 if left out.
        tool: name of one of them, or of another frame; if None, the only one.
        where: the file, for messages.

    Raises:
        InvalidInputError: a tool that cannot be used, or several and none chosen.
        UnknownNameError: a parent that is no link, or another key.
    """
    if tools is None:
        return found, tool
    if not isinstance(tools, Sequence) or isinstance(tools, str):
        raise InvalidInputError(f"tools: expected a list of mappings, got {tools!r}")
    names = [_name_of(one, number) for number, one in enumerate(tools)]
    for name in names:
        if names.count(name) > 1:
            raise InvalidInputError(f"tools: expected a name for each, got {name!r} {names.count(name)} times")
    if tool is None and len(names) > 1:
        raise InvalidInputError(f"tool: expected one of the tools {', '.join(names)}, got none")
    chosen = names[0] if tool is None and names else tool
    robot = ElementTree.fromstring(found.text)
    links = [link.get("name", "") for link in robot.iterfind("link")]
    for name, one in zip(names, tools, strict=True):
        if name in links:
            raise InvalidInputError(f"tools: {name!r}: expected a name that no link of {where} has")
        if one.get("parent") not in links:
            raise UnknownNameError(f"link of {where} that carries the tool {name!r}", one.get("parent"), links)
        parts = _tool_of(one, f"tools: {name!r}")
        if name == chosen:
            _add(robot, name, one["parent"], *parts)
    if chosen not in names:
        return found, chosen
    return replace(found, text=checked_text(robot, where, look=True), as_written=False), chosen


def _name_of(one: Any, number: int) -> str:
    where = f"tools[{number}]"
    if not isinstance(one, Mapping):
        raise InvalidInputError(f"{where}: expected a mapping with {', '.join(_TOOL)}, got {one!r}")
    for key in one:
        checked_name(f"key of {where}", key, _TOOL)
    name = one.get("name")
    if not isinstance(name, str) or not name or not name.isprintable():
        raise InvalidInputError(f"{where}.name: expected printable characters on one line, got {name!r}")
    return name


def _tool_of(one: Mapping[str, Any], where: str) -> tuple[Pose6, float, Array, Array]:
    """Pose, mass, centre of mass and inertia of a tool."""
    pose = pose_of({key: one[key] for key in _POSE if key in one}, where)
    mass = real_quantity(one.get("mass", 0.0), "kg", f"{where}: mass")
    if mass < 0.0:
        raise InvalidInputError(f"{where}: mass: expected a number from 0 on [kg], got {mass:g}")
    com = _triple(one.get("com"), "m", f"{where}: com")
    inertia = np.zeros((3, 3)) if one.get("inertia") is None else tensor_of(one["inertia"], f"{where}: inertia")
    if mass == 0.0 and (com.any() or inertia.any()):
        raise InvalidInputError(f"{where}: expected a mass with its com and inertia, got none")
    return pose, mass, com, inertia


def _triple(given: Any, unit: str, where: str) -> Array:
    if given is None:
        return np.zeros(3)
    entries = given.tolist() if isinstance(given, np.ndarray) else given
    if not isinstance(entries, list | tuple) or len(entries) != 3:
        raise InvalidInputError(f"{where}: expected three numbers [{unit}], or texts with a unit, got {given!r}")
    return np.array([real_quantity(entry, unit, f"{where}[{k}]") for k, entry in enumerate(entries)])


def _add(
    robot: ElementTree.Element, name: str, parent: str, pose: Pose6, mass: float, com: Array, inertia: Array
) -> None:
    link = ElementTree.SubElement(robot, "link", name=name)
    if mass:
        inertial = ElementTree.SubElement(link, "inertial")
        ElementTree.SubElement(inertial, "origin", xyz=_joined(com))
        ElementTree.SubElement(inertial, "mass", value=repr(mass))
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = inertia.tolist()
        keys = {"ixx": xx, "ixy": xy, "ixz": xz, "iyy": yy, "iyz": yz, "izz": zz}
        ElementTree.SubElement(inertial, "inertia", {key: repr(value) for key, value in keys.items()})
    _fix(robot, f"to {name}", (parent, name), pose)


def _fix(robot: ElementTree.Element, name: str, ends: tuple[str, str], pose: Pose6) -> None:
    joint = ElementTree.SubElement(robot, "joint", name=name, type="fixed")
    for role, link in zip(("parent", "child"), ends, strict=True):
        ElementTree.SubElement(joint, role, link=link)
    ElementTree.SubElement(joint, "origin", xyz=_joined(pose.position), rpy=_joined(pose.rpy))


def _joined(values: Array) -> str:
    return " ".join(repr(float(value)) for value in values)
