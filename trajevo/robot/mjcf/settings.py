"""What an MJCF file says of itself: its compiler, gravity, and parts that no robot can be made of."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError
from trajevo.robot.mjcf.classes import is_on, number_of, numbers_of
from trajevo.robot.mjcf.places import Angles

#: Elements that stand for others, or for what moves by itself -> what is to be given instead.
_REFUSED = {
    "include": "give the file that it names, or one that holds everything (MuJoCo's mj_saveLastXML)",
    "attach": "give a file that holds everything (MuJoCo's mj_saveLastXML)",
    "replicate": "give a file that holds everything (MuJoCo's mj_saveLastXML)",
    "composite": "which is no rigid body: give the file of the robot alone",
    "flexcomp": "which is no rigid body: give the file of the robot alone",
    "flex": "which is no rigid body: give the file of the robot alone",
}

#: Settings of the compiler that change masses or places, and the values that change none.
_NEUTRAL = {"boundmass": 0.0, "boundinertia": 0.0}


@dataclass(frozen=True)
class Settings:
    """How a file is to be read.

    Attributes:
        angles: how it writes angles.
        autolimits: whether a range is used where nothing says whether it is.
        inertia_from: ``"true"``, ``"false"`` or ``"auto"``: whether masses follow from geoms, or where they are not
            given.
        meshes: folder of meshes.
        strip: whether folders in their names do not count.
    """

    angles: Angles
    autolimits: bool
    inertia_from: str
    meshes: Path
    strip: bool


def check_parts(root: ElementTree.Element, file: Path) -> None:
    """Refuse parts that stand for others or move by themselves.

    Raises:
        InvalidInputError: the message names the part and the way out.
    """
    for element in root.iter():
        if element.tag in _REFUSED:
            what = element.get("file") or element.get("name") or ""
            raise InvalidInputError(f"{file}: <{element.tag}> {what!r}: {_REFUSED[element.tag]}")


def settings_of(root: ElementTree.Element, file: Path) -> Settings:
    """The settings of a file.

    Raises:
        InvalidInputError: values that cannot be used, or settings that change masses.
    """
    where = f"{file}: <compiler>"
    given: dict[str, str] = {}
    for element in root.iterfind("compiler"):
        given |= element.attrib
    angle = given.get("angle", "degree")
    if angle not in ("degree", "radian"):
        raise InvalidInputError(f"{where}: angle: expected degree or radian, got {angle!r}")
    sequence = given.get("eulerseq", "xyz")
    if len(sequence) != 3 or any(axis not in "xyzXYZ" for axis in sequence):
        raise InvalidInputError(f"{where}: eulerseq: expected three of x, y, z, X, Y, Z, got {sequence!r}")
    _check_masses(given, where)
    inertia_from = given.get("inertiafromgeom", "auto")
    if inertia_from not in ("true", "false", "auto"):
        raise InvalidInputError(f"{where}: inertiafromgeom: expected true, false or auto, got {inertia_from!r}")
    return Settings(
        angles=Angles(math.pi / 180.0 if angle == "degree" else 1.0, sequence),
        autolimits=is_on(given, "autolimits", where, auto=True),
        inertia_from=inertia_from,
        meshes=file.parent / given.get("meshdir", given.get("assetdir", "")),
        strip=is_on(given, "strippath", where, auto=False),
    )


def _check_masses(given: Mapping[str, str], where: str) -> None:
    for key, usual in _NEUTRAL.items():
        if number_of(given, key, where, usual) != usual:
            raise InvalidInputError(f"{where}: {key}: expected masses as they are written, got {given[key]!r}")
    if number_of(given, "settotalmass", where, -1.0) > 0.0 or is_on(given, "balanceinertia", where, auto=False):
        raise InvalidInputError(
            f"{where}: expected masses as they are written, got settotalmass or balanceinertia: give a file that holds "
            "everything (MuJoCo's mj_saveLastXML)"
        )
    if given.get("coordinate", "local") != "local":
        raise InvalidInputError(f"{where}: coordinate: expected local, got {given['coordinate']!r}")
    groups = numbers_of(given, "inertiagrouprange", where, counts=(2,))
    if groups is not None and groups != (0.0, 5.0):
        raise InvalidInputError(f"{where}: inertiagrouprange: expected all groups, got {given['inertiagrouprange']!r}")


def gravity_of(root: ElementTree.Element, file: Path) -> Array:
    """Gravity in the base frame, shape (3,) [m/s²].

    Raises:
        InvalidInputError: numbers that are none, or a fluid.
    """
    where = f"{file}: <option>"
    given: dict[str, str] = {}
    for element in root.iterfind("option"):
        given |= element.attrib
        for flag in element.iterfind("flag"):
            if flag.get("gravity") == "disable":
                return np.zeros(3)
    for key in ("density", "viscosity"):
        if number_of(given, key, where, 0.0) != 0.0:
            raise InvalidInputError(f"{where}: {key}: expected a robot in no fluid, got {given[key]!r}")
    return np.array(numbers_of(given, "gravity", where, counts=(3,)) or (0.0, 0.0, -9.81))
