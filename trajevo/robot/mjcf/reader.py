"""The robot of an MJCF file as a URDF.

MJCF nests bodies, whose joints move them one after the other about points of the body. Here every joint gets a link at
its point, and the body's own frame is fixed to the last of them. Positions count as MuJoCo's do: at its reference
(``ref``) a joint is as the file draws it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path
from typing import final
from xml.etree import ElementTree

import numpy as np

from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError
from trajevo.robot.description import Description
from trajevo.robot.mjcf.actuators import efforts_of, passive_of
from trajevo.robot.mjcf.classes import Attributes, Classes, is_on, number_of, numbers_of
from trajevo.robot.mjcf.couplings import check_loops, check_tendons, mimics_of
from trajevo.robot.mjcf.links import Links, add_joint
from trajevo.robot.mjcf.places import HERE, Place, about, direction, place_of
from trajevo.robot.mjcf.settings import Settings, check_parts, gravity_of, settings_of
from trajevo.robot.mjcf.shapes import Shape, shape_of, together

#: Link that stands still, MuJoCo's name for it.
WORLD = "world"

#: What can lie in a body or a frame and is no part of the robot.
_IGNORED = ("camera", "light", "inertial", "joint", "geom", "site", "freejoint")
_TYPES = {"hinge": "revolute", "slide": "prismatic"}


def read_mjcf(root: ElementTree.Element, file: Path, lock: Collection[str]) -> Description:
    """The description of the robot of an MJCF file.

    Args:
        root: top element of the file.
        file: the file, for messages and for the paths of meshes.
        lock: joints that will be locked.

    Raises:
        InvalidInputError: what the file says cannot be planned for, such as a free joint, or cannot be read.
    """
    return _Reader(root, file, lock).description()


@final
class _Reader:
    def __init__(self, root: ElementTree.Element, file: Path, lock: Collection[str]) -> None:
        check_parts(root, file)
        self._root, self._file, self._lock = root, file, lock
        self._settings: Settings = settings_of(root, file)
        self._classes = Classes(root, str(file))
        self._links = Links(root, self._classes, file, self._settings)
        self._robot = ElementTree.Element("robot", name=root.get("model", file.stem))
        self._joints: dict[str, Attributes] = {}
        self._limits: dict[str, dict[str, float]] = {}
        self._armature: dict[str, float] = {}
        self._references: dict[str, float] = {}
        self._movers: dict[str, str] = {WORLD: ""}  # body -> the joint that is not locked and carries it, "" for none
        self._between: list[str] = []
        self._notes: list[str] = []

    def description(self) -> Description:
        worlds = self._root.findall("worldbody")
        if not worlds:
            raise InvalidInputError(f"{self._file}: expected <worldbody> with the bodies of a robot, got none")
        ElementTree.SubElement(self._robot, "link", name=WORLD)
        if any(True for world in worlds for _ in _parts(world, "geom", HERE, "", self._settings)):
            self._notes.append("geoms of <worldbody> are no part of the robot: [scene] file takes them as obstacles")
        for world in worlds:
            self._inside(world, WORLD, HERE, "")
        self._add_sites()
        if not self._joints:
            raise InvalidInputError(f"{self._file}: expected at least one joint of a body, got none")
        efforts = efforts_of(
            self._root, self._joints, self._classes, str(self._file), autolimits=self._settings.autolimits
        )
        for name, (backward, forward) in efforts.limits.items():
            self._limits[name]["effort"] = forward
            if backward < forward or backward > forward:  # both NaN where nothing limits them
                self._limits[name]["effort_backward"] = backward
        self._couple()
        for name in [name for name in self._lock if name in self._limits]:
            self._armature.pop(name, None)
        return Description(
            text=ElementTree.tostring(self._robot, encoding="unicode"),
            kind="MJCF",
            as_written=False,
            limits=self._limits,
            armature=self._armature,
            gravity=gravity_of(self._root, self._file),
            between=frozenset(self._between),
            notes=(*self._notes, *efforts.notes),
        )

    def _couple(self) -> None:
        elements = {joint.get("name", ""): joint for joint in self._robot.iterfind("joint")}
        for name, leader, multiplier, offset in mimics_of(self._root, self._references, self._file, self._lock):
            ElementTree.SubElement(
                elements[name], "mimic", joint=leader, multiplier=repr(multiplier), offset=repr(offset)
            )
        check_loops(self._root, self._movers, self._file)
        check_tendons(self._root, self._classes, self._file, self._lock)

    def _inside(self, element: ElementTree.Element, link: str, outer: Place, childclass: str) -> None:
        """The bodies and sites in a body or a frame."""
        for child in element:
            within = child.get("childclass", childclass)
            where = f"{self._file}: <{child.tag}> {child.get('name', '')!r}"
            if child.tag == "body":
                self._body(child, link, outer, within)
            elif child.tag == "frame":
                place = outer.then(place_of(child.attrib, self._settings.angles, where))
                self._inside(child, link, place, within)
            elif child.tag not in _IGNORED:
                raise InvalidInputError(f"{where}: expected bodies and frames that stand in the file, got it")
            elif child.tag == "site" and child.get("name"):
                given = self._classes.of(child, childclass)
                self._links.sites.append((child.get("name", ""), link, outer, given))

    def _body(self, body: ElementTree.Element, parent: str, outer: Place, childclass: str) -> None:
        name = body.get("name") or self._links.unnamed()
        where = f"{self._file}: body {name!r}"
        place = outer.then(place_of(body.attrib, self._settings.angles, where))
        if number_of(body.attrib, "gravcomp", where, 0.0) != 0.0:
            self._notes.append(f"gravcomp of body {name!r}: efforts hold the whole weight")
        joints = list(_parts(body, "joint", HERE, childclass, self._settings))
        if any(True for _ in _parts(body, "freejoint", HERE, "", self._settings)):
            raise InvalidInputError(
                f"{where}: stands on a free joint, which cannot be planned for: delete <freejoint> to fix it there, or "
                "give the file of the robot alone"
            )
        self._movers[name] = self._movers[parent]
        at, link = place, parent
        passed = np.zeros(3)
        for number, (joint, frame, of_class) in enumerate(joints, start=1):
            given = self._classes.of(joint, of_class)
            pos, axis = self._axis(given, frame, f"{self._file}: joint {joint.get('name', '')!r}")
            last = number == len(joints)
            beyond = name if last and not pos.any() else f"{name} at joint {number}"
            called = joint.get("name") or (f"{name} joint" if len(joints) == 1 else f"{name} joint {number}")
            self._joint(called, given, (link, beyond), at.shifted(pos - passed), axis)
            self._between += [] if last else [beyond]
            self._movers[name] = self._movers[name] if called in self._lock else called
            at, link, passed = HERE, beyond, pos
        if link != name:
            ElementTree.SubElement(self._robot, "link", name=name)
            add_joint(self._robot, f"to {name}", "fixed", (link, name), at.shifted(-passed))
        self._fill(body, name, childclass, moves=bool(self._movers[name]) or bool(joints))
        self._inside(body, name, HERE, childclass)

    def _axis(self, given: Attributes, frame: Place, where: str) -> tuple[Array, Array]:
        """Point and unit axis of a joint in the frame of its body."""
        pos = np.array(numbers_of(given, "pos", where, counts=(3,)) or (0.0, 0.0, 0.0))
        axis = np.array(numbers_of(given, "axis", where, counts=(3,)) or (0.0, 0.0, 1.0))
        return frame.position + frame.rotation @ pos, frame.rotation @ direction(axis, f"{where}: axis")

    def _joint(self, name: str, given: Attributes, ends: tuple[str, str], place: Place, axis: Array) -> None:
        where = f"{self._file}: joint {name!r}"
        kind = given.get("type", "hinge")
        if kind not in _TYPES:
            raise InvalidInputError(f"{where}: type: expected hinge or slide, got {kind!r}, which is not planned for")
        if name in self._joints:
            raise InvalidInputError(f"{where}: expected a unique name, got several joints with that name")
        turns = kind == "hinge"
        per_unit = self._settings.angles.to_rad if turns else 1.0
        reference = number_of(given, "ref", where, 0.0) * per_unit
        ends_of = numbers_of(given, "range", where, counts=(2,))
        if is_on(given, "limited", where, auto=self._settings.autolimits and ends_of is not None):
            lower, upper = (end * per_unit for end in ends_of or (0.0, 0.0))
        else:
            lower, upper = -np.inf, np.inf
        passive = dict(passive_of(given, where))
        if passive["stiffness"] != 0.0 and name not in self._lock:
            raise InvalidInputError(f"{where}: stiffness: expected no spring at a joint, got {passive['stiffness']}")
        self._joints[name] = given
        self._references[name] = reference
        self._limits[name] = {"lower": lower, "upper": upper, "velocity": np.nan}
        self._armature[name] = passive["armature"]
        if reference:
            back = Place(about(axis, -reference), np.zeros(3)) if turns else Place(np.eye(3), -reference * axis)
            place = place.then(back)
        ElementTree.SubElement(self._robot, "link", name=ends[1])
        endless = turns and not np.isfinite([lower, upper]).any()
        joint = add_joint(self._robot, name, "continuous" if endless else _TYPES[kind], ends, place)
        ElementTree.SubElement(joint, "axis", xyz=" ".join(repr(float(x)) for x in axis))
        # The text holds finite numbers alone; those of the description take their place.
        low, high = (lower, upper) if np.isfinite([lower, upper]).all() else (-1.0, 1.0)
        said = {"velocity": "1", "effort": "1"} | ({} if endless else {"lower": repr(low), "upper": repr(high)})
        ElementTree.SubElement(joint, "limit", said)
        if passive["damping"] or passive["frictionloss"]:
            keys = {"damping": passive["damping"], "friction": passive["frictionloss"]}
            ElementTree.SubElement(joint, "dynamics", {key: repr(value) for key, value in keys.items()})

    def _fill(self, body: ElementTree.Element, name: str, childclass: str, *, moves: bool) -> None:
        """Mass and collision geometry of a body."""
        where = f"{self._file}: body {name!r}"
        shapes: list[Shape] = []
        for geom, frame, of_class in _parts(body, "geom", HERE, childclass, self._settings):
            given = self._classes.of(geom, of_class)
            shapes.append(shape_of(given, self._settings.angles, frame, f"{where}: geom {geom.get('name', '')!r}"))
        link = next(each for each in self._robot.iterfind("link") if each.get("name") == name)
        inertial = body.find("inertial")
        if inertial is not None and self._settings.inertia_from != "true":
            self._links.add_inertial(link, inertial, where)
        elif moves and self._settings.inertia_from != "false":
            weighing = [shape.body() for shape in shapes if shape.weighs]
            self._links.add_mass(link, *together(weighing))
        self._links.add_collisions(link, shapes)

    def _add_sites(self) -> None:
        """Sites as links without mass, so that a tool can be one; a name that a body has is that of the body."""
        taken = {link.get("name") for link in self._robot.iterfind("link")}
        for name, link, outer, given in self._links.sites:
            if name not in taken:
                place = place_of(given, self._settings.angles, f"{self._file}: site {name!r}")
                ElementTree.SubElement(self._robot, "link", name=name)
                add_joint(self._robot, f"to {name}", "fixed", (link, name), outer.then(place))
                taken.add(name)


def _parts(
    body: ElementTree.Element, tag: str, outer: Place, childclass: str, settings: Settings
) -> Iterator[tuple[ElementTree.Element, Place, str]]:
    """Elements of a body, also those in frames: each with the pose of its frame in the body, and its class."""
    for child in body:
        if child.tag == tag:
            yield child, outer, childclass
        elif child.tag == "frame":
            place = outer.then(place_of(child.attrib, settings.angles, "<frame>"))
            yield from _parts(child, tag, place, child.get("childclass", childclass), settings)
