"""What the links of a URDF look like: kept where it can be read, as Pinocchio's parser prints the mistakes in it."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from xml.etree import ElementTree

from trajevo.robot.urdf.file import urdf_number

#: Attributes of shapes, with the counts of their numbers.
_SHAPES: Mapping[str, Mapping[str, int]] = {
    "box": {"size": 3},
    "sphere": {"radius": 1},
    "cylinder": {"radius": 1, "length": 1},
}

#: Elements that tell what a link looks like.
LOOKS = ("visual", "material")


def files_of(name: str, packages: Sequence[Path]) -> Iterator[Path]:
    """Files that a name of a mesh in a URDF may stand for, of those that exist."""
    scheme, mark, rest = name.partition("://")
    places: Iterable[Path] = [folder / rest for folder in packages] if scheme == "package" else [Path(rest)]
    for place in places if mark else [Path(name)]:
        if os.path.exists(place):
            yield place


def keep_look(robot: ElementTree.Element) -> None:
    """Leave the ``<visual>`` elements of a URDF that can be read, with their colours as numbers."""
    named = {one.get("name"): _colour(one) for one in robot.iterfind("material")}
    for link in robot.iterfind("link"):
        for visual in link.findall("visual"):
            material = visual.find("material")
            colour = None if material is None else _colour(material) or named.get(material.get("name"))
            kept = _kept(visual, colour)
            if kept is not None:
                link.insert(list(link).index(visual), kept)
            link.remove(visual)
    for material in robot.findall("material"):
        robot.remove(material)


def leave_found(robot: ElementTree.Element, packages: Sequence[Path]) -> None:
    """Remove the ``<visual>`` elements of a URDF whose meshes are not to be found.

    Args:
        robot: its top element, which is changed.
        packages: folders in which ``package://`` paths are looked up.
    """
    for link in robot.iterfind("link"):
        for visual in link.findall("visual"):
            names = [mesh.get("filename", "") for mesh in visual.iterfind("geometry/mesh")]
            if any(next(files_of(name, packages), None) is None for name in names):
                link.remove(visual)


def without_look(robot: ElementTree.Element) -> None:
    """Remove what only tells what links look like."""
    for parent in (robot, *robot.iterfind("link")):
        for child in [child for child in parent if child.tag in LOOKS]:
            parent.remove(child)


def _kept(visual: ElementTree.Element, colour: str | None) -> ElementTree.Element | None:
    """A ``<visual>`` with nothing but what is drawn; None if it cannot be."""
    origin, geometry = visual.find("origin"), visual.find("geometry")
    shapes = [] if geometry is None else list(geometry)
    if len(shapes) != 1:
        return None
    shape = shapes[0]
    given = _sizes(shape) if shape.tag in _SHAPES else _mesh(shape) if shape.tag == "mesh" else None
    place = {} if origin is None else {key: origin.get(key, "0 0 0") for key in ("xyz", "rpy")}
    if given is None or any(_numbers(text, 3) is None for text in place.values()):
        return None
    made = ElementTree.Element("visual")
    if place:
        ElementTree.SubElement(made, "origin", place)
    ElementTree.SubElement(ElementTree.SubElement(made, "geometry"), shape.tag, given)
    if colour is not None:
        material = ElementTree.SubElement(made, "material", name=f"rgba {colour}")
        ElementTree.SubElement(material, "color", rgba=colour)
    return made


def _sizes(shape: ElementTree.Element) -> dict[str, str] | None:
    given = {key: shape.get(key, "") for key in _SHAPES[shape.tag]}
    for key, count in _SHAPES[shape.tag].items():
        values = _numbers(given[key], count)
        if values is None or min(values) <= 0.0:
            return None
    return given


def _mesh(shape: ElementTree.Element) -> dict[str, str] | None:
    name, scale = shape.get("filename", ""), shape.get("scale", "1 1 1")
    values = _numbers(scale, 3)
    return None if not name or values is None or 0.0 in values else {"filename": name, "scale": scale}


def _colour(material: ElementTree.Element) -> str | None:
    """Red, green, blue and opacity as a URDF writes them."""
    colour = material.find("color")
    text = "" if colour is None else colour.get("rgba", "")
    values = _numbers(text, 4)
    return text if values is not None and min(values) >= 0.0 and max(values) <= 1.0 else None


def _numbers(text: str, count: int) -> list[float] | None:
    values = [urdf_number(part) for part in text.split()]
    return None if len(values) != count or None in values else [value for value in values if value is not None]
