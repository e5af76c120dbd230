"""Obstacles of an MJCF file: geoms that stand still and are no part of a robot.

A body stands still if neither it nor a body around it has a joint. Such a body is the base of a robot, and no obstacle,
if a body directly in it has a joint. Geoms that nothing can touch (``contype`` and ``conaffinity`` 0) are pictures.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, final
from xml.etree import ElementTree

import numpy as np

from trajevo.base.plain import parsed_xml
from trajevo.errors import InvalidInputError
from trajevo.formulation.constraints.scenes.hulls import hull_points
from trajevo.formulation.constraints.scenes.obstacles import Obstacle, obstacle_of
from trajevo.robot.mjcf.classes import Classes
from trajevo.robot.mjcf.links import Links
from trajevo.robot.mjcf.places import HERE, Place, place_of
from trajevo.robot.mjcf.settings import check_parts, settings_of
from trajevo.robot.mjcf.shapes import Shape, shape_of
from trajevo.robot.shapes.meshes import mesh_points

_JOINTS = ("joint", "freejoint")


def mjcf_obstacles(content: bytes, file: Path) -> tuple[Obstacle, ...]:
    """The obstacles of an MJCF file.

    Args:
        content: its content.
        file: the file, for messages and for the paths of meshes.

    Raises:
        InvalidInputError: no MJCF, a shape that is not read, or a number that is none; the message names body and geom.
    """
    root = parsed_xml(content, file)
    if root.tag != "mujoco":
        raise InvalidInputError(f"{file}: expected a scene of MoveIt or <mujoco>, got <{root.tag}>")
    return _World(root, file).obstacles()


@final
class _World:
    def __init__(self, root: ElementTree.Element, file: Path) -> None:
        check_parts(root, file)
        self._root, self._file, self._settings = root, file, settings_of(root, file)
        self._classes = Classes(root, str(file))
        self._links = Links(root, self._classes, file, self._settings)
        self._names: set[str] = set()

    def obstacles(self) -> tuple[Obstacle, ...]:
        worlds = self._root.findall("worldbody")
        if not worlds:
            raise InvalidInputError(f"{self._file}: expected <worldbody>, got none")
        return tuple(solid for world in worlds for solid in self._inside(world, HERE, "", "world"))

    def _inside(
        self, element: ElementTree.Element, outer: Place, childclass: str, body: str, *, base: bool = False
    ) -> Iterator[Obstacle]:
        """The obstacles in the world, a body or a frame; ``base`` if these geoms are those of the base of a robot."""
        for child in element:
            within = child.get("childclass", childclass)
            where = f"{self._file}: <{child.tag}> {child.get('name', '')!r}"
            if child.tag == "geom" and not base:
                yield from self._geom(child, outer, childclass, body)
            elif child.tag == "body" and not _moves(child):
                place = outer.then(place_of(child.attrib, self._settings.angles, where))
                carries = any(map(_moves, _bodies(child)))
                yield from self._inside(child, place, within, child.get("name", ""), base=carries)
            elif child.tag == "frame":
                place = outer.then(place_of(child.attrib, self._settings.angles, where))
                yield from self._inside(child, place, within, body, base=base)

    def _geom(self, geom: ElementTree.Element, outer: Place, childclass: str, body: str) -> Iterator[Obstacle]:
        name = geom.get("name", "")
        where = f"{self._file}: body {body!r}: geom {name!r}"
        shape = shape_of(self._classes.of(geom, childclass), self._settings.angles, outer, where)
        if not shape.collides:
            return
        given, place = self._solid(shape)
        try:
            turned = {"name": self._new(name or body), "position": place.position, "rotation": place.rotation}
            yield obstacle_of(turned | given, 1)
        except InvalidInputError as error:
            raise InvalidInputError(f"{where}: {error}") from error

    def _solid(self, shape: Shape) -> tuple[dict[str, Any], Place]:
        """The sizes of a geom, and its place."""
        if shape.mesh:
            mesh = self._links.mesh_of(shape)
            points = mesh_points(mesh.file, 1.0) * mesh.scale
            return {"shape": "hull", "points": hull_points(points, f"{shape.where}: mesh")}, mesh.place
        sizes = np.array(shape.sizes)
        match shape.kind:
            case "plane":
                return {"shape": "plane"}, shape.place
            case "box" | "ellipsoid":  # the box around it is no further from anything
                return {"shape": "box", "size": 2.0 * sizes}, shape.place
            case "sphere":
                return {"shape": "sphere", "radius": shape.sizes[0]}, shape.place
            case "cylinder" | "capsule":
                return {"shape": shape.kind, "radius": shape.sizes[0], "length": 2.0 * shape.sizes[1]}, shape.place
        raise InvalidInputError(
            f"{shape.where}: type: expected a box, sphere, cylinder, capsule, ellipsoid, plane or mesh as obstacle, "
            f"got {shape.kind!r}"
        )

    def _new(self, name: str) -> str:
        """A name that no other obstacle of the file has."""
        new, number = name, 2
        while new in self._names:
            new, number = f"{name} ({number})", number + 1
        self._names.add(new)
        return new


def _bodies(element: ElementTree.Element) -> Iterator[ElementTree.Element]:
    """Bodies directly in an element, also in frames."""
    for child in element:
        if child.tag == "body":
            yield child
        elif child.tag == "frame":
            yield from _bodies(child)


def _moves(body: ElementTree.Element) -> bool:
    """Whether a body has a joint of its own."""
    return any(child.tag in _JOINTS or (child.tag == "frame" and _moves(child)) for child in body)
