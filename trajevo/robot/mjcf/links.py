"""Links of a URDF with the masses and the collision geometry of bodies of MJCF."""

from __future__ import annotations

from pathlib import Path, PureWindowsPath
from typing import NamedTuple, final
from xml.etree import ElementTree

import numpy as np

from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError
from trajevo.robot.mjcf.classes import Attributes, Classes, number_of, numbers_of
from trajevo.robot.mjcf.places import Place, place_of
from trajevo.robot.mjcf.settings import Settings
from trajevo.robot.mjcf.shapes import Shape


class MeshOfGeom(NamedTuple):
    """A mesh of a geom.

    Attributes:
        file: where it is.
        scale: factors from its lengths to metres, shape (3,).
        place: where its own frame is in that of the body.
    """

    file: Path
    scale: Array
    place: Place


@final
class Links:
    """What fills the links of a robot.

    Args:
        root: top element of the MJCF file.
        classes: its default classes.
        file: the file.
        settings: how it is to be read.
    """

    def __init__(self, root: ElementTree.Element, classes: Classes, file: Path, settings: Settings) -> None:
        self._file, self._settings = file, settings
        self._meshes: dict[str, Attributes] = {}
        for mesh in root.iterfind("asset/mesh"):
            given = classes.of(mesh, "")
            self._meshes[given.get("name") or PureWindowsPath(given.get("file", "")).stem] = given
        self._unnamed = 0
        #: Sites: name, link, pose of the frame around it in the link, and attributes.
        self.sites: list[tuple[str, str, Place, Attributes]] = []

    def unnamed(self) -> str:
        """A name for a body that has none."""
        self._unnamed += 1
        return f"body {self._unnamed}"

    def add_inertial(self, link: ElementTree.Element, inertial: ElementTree.Element, where: str) -> None:
        """The mass of a body as ``<inertial>`` gives it.

        Raises:
            InvalidInputError: a mass or a tensor that is missing or cannot be read.
        """
        given, where = inertial.attrib, f"{where}: inertial"
        mass = number_of(given, "mass", where, np.nan)
        if np.isnan(mass):
            raise InvalidInputError(f"{where}: mass: expected a number [kg], got none")
        place = place_of(given, self._settings.angles, where)
        whole = numbers_of(given, "fullinertia", where, counts=(6,))
        own = numbers_of(given, "diaginertia", where, counts=(3,))
        if whole is not None:
            xx, yy, zz, xy, xz, yz = whole
            tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        elif own is not None:
            tensor = np.diag(own)
        else:
            raise InvalidInputError(f"{where}: expected diaginertia or fullinertia, got none")
        self.add_mass(link, mass, place.position, place.rotation @ tensor @ place.rotation.T)

    def add_mass(self, link: ElementTree.Element, mass: float, com: Array, inertia: Array) -> None:
        """The mass of a body, its centre of mass and inertia about it along the axes of the body."""
        if mass == 0.0 and not inertia.any():
            return
        inertial = ElementTree.SubElement(link, "inertial")
        ElementTree.SubElement(inertial, "origin", xyz=_joined(com))
        ElementTree.SubElement(inertial, "mass", value=repr(float(mass)))
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = inertia.tolist()
        keys = {"ixx": xx, "ixy": xy, "ixz": xz, "iyy": yy, "iyz": yz, "izz": zz}
        ElementTree.SubElement(inertial, "inertia", {key: repr(value) for key, value in keys.items()})

    def add_collisions(self, link: ElementTree.Element, shapes: list[Shape]) -> None:
        """Collision geometry of the geoms that something can touch."""
        for shape in shapes:
            if not shape.collides:
                continue
            if shape.mesh:
                self._add_mesh(link, shape)
            elif shape.kind == "box":
                self._add(link, shape.place, "box", size=_joined(2.0 * np.array(shape.sizes)))
            elif shape.kind == "ellipsoid":
                # The box around it: no closer to anything than the ellipsoid is.
                self._add(link, shape.place, "box", size=_joined(2.0 * np.array(shape.sizes)))
            elif shape.kind == "sphere":
                self._add(link, shape.place, "sphere", radius=repr(shape.sizes[0]))
            elif shape.kind in ("cylinder", "capsule"):
                radius, half = shape.sizes
                self._add(link, shape.place, "cylinder", radius=repr(radius), length=repr(2.0 * half))
                for end in (half, -half) if shape.kind == "capsule" else ():
                    self._add(link, shape.place.shifted(np.array([0.0, 0.0, end])), "sphere", radius=repr(radius))

    def mesh_of(self, shape: Shape) -> MeshOfGeom:
        """The mesh of a geom.

        Raises:
            InvalidInputError: there is none of this name.
        """
        given = self._meshes.get(shape.mesh)
        if given is None:
            raise InvalidInputError(f"{shape.where}: mesh {shape.mesh!r}: expected a mesh of <asset>, got none")
        name = given.get("file", shape.mesh)
        path = self._settings.meshes / (PureWindowsPath(name).name if self._settings.strip else name)
        scale = numbers_of(given, "scale", f"{self._file}: mesh {shape.mesh!r}", counts=(3,)) or (1.0, 1.0, 1.0)
        reference = {key.removeprefix("ref"): value for key, value in given.items() if key in ("refpos", "refquat")}
        drawn = place_of(reference, self._settings.angles, f"{self._file}: mesh {shape.mesh!r}")
        back = Place(drawn.rotation.T, -(drawn.rotation.T @ drawn.position))
        return MeshOfGeom(path, np.array(scale), shape.place.then(back))

    def _add_mesh(self, link: ElementTree.Element, shape: Shape) -> None:
        mesh = self.mesh_of(shape)
        self._add(link, mesh.place, "mesh", filename=str(mesh.file.absolute()), scale=_joined(mesh.scale))

    def _add(self, link: ElementTree.Element, place: Place, tag: str, **attributes: str) -> None:
        collision = ElementTree.SubElement(link, "collision")
        _add_origin(collision, place)
        ElementTree.SubElement(ElementTree.SubElement(collision, "geometry"), tag, attributes)


def add_joint(
    robot: ElementTree.Element, name: str, kind: str, ends: tuple[str, str], place: Place
) -> ElementTree.Element:
    """A joint of a URDF from a parent to a child link, at a pose in the parent."""
    joint = ElementTree.SubElement(robot, "joint", name=name, type=kind)
    for role, link in zip(("parent", "child"), ends, strict=True):
        ElementTree.SubElement(joint, role, link=link)
    _add_origin(joint, place)
    return joint


def _add_origin(parent: ElementTree.Element, place: Place) -> None:
    ElementTree.SubElement(parent, "origin", xyz=_joined(place.position), rpy=_joined(np.array(place.rpy)))


def _joined(values: Array) -> str:
    return " ".join(repr(float(x)) for x in values)
