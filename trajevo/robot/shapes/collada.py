"""The colour of a COLLADA mesh: the diffuse colour of its effects, if its faces have one in common."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

from trajevo.base.files import MOST_DATA, read_bytes
from trajevo.base.plain import parsed_xml
from trajevo.errors import InvalidInputError

#: Elements of triangles that name a material.
_FACES = ("triangles", "polylist", "polygons", "trifans", "tristrips")


def diffuse_colour(file: Path) -> tuple[float, float, float] | None:
    """Red, green and blue from 0 to 1 that all faces of a COLLADA file have in common.

    Args:
        file: the file.

    Returns:
        None where faces differ, a texture or nothing tells their colour, or the file cannot be read.
    """
    try:
        top = parsed_xml(read_bytes(file, most=MOST_DATA), file)
    except (OSError, InvalidInputError):
        return None
    space = top.tag.partition("}")[0] + "}" if top.tag.startswith("{") else ""
    effects = {
        effect.get("id"): effect.find(f".//{space}diffuse/{space}color") for effect in top.iter(f"{space}effect")
    }
    materials = {}
    for material in top.iter(f"{space}material"):
        effect = material.find(f"{space}instance_effect")
        materials[material.get("id")] = None if effect is None else effects.get(_named(effect, "url"))
    bound = {one.get("symbol"): materials.get(_named(one, "target")) for one in top.iter(f"{space}instance_material")}
    named = {faces.get("material") for kind in _FACES for faces in top.iter(f"{space}{kind}")}
    found = {_rgb(bound.get(name)) for name in named}
    return found.pop() if len(found) == 1 else None


def _named(element: ElementTree.Element, key: str) -> str:
    return element.get(key, "").removeprefix("#")


def _rgb(colour: ElementTree.Element | None) -> tuple[float, float, float] | None:
    try:
        red, green, blue, *_ = map(float, ("" if colour is None else colour.text or "").split())
    except ValueError:
        return None
    return (red, green, blue) if all(0.0 <= value <= 1.0 for value in (red, green, blue)) else None
