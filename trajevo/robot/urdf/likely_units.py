"""Numbers of a URDF that look as if they were not in SI, as the format demands."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from xml.etree import ElementTree

from trajevo.base.units import likely_unit
from trajevo.robot.urdf.bodies import LinkRow
from trajevo.robot.urdf.file import urdf_number

#: An origin farther from that of the joint before, a radius of gyration, and a mass of all links, above which a URDF is
#: taken to be in mm, kg·mm² and g [m, m, kg].
_FAR, _WIDE, _HEAVY = 20.0, 5.0, 20_000.0


def unit_warnings(robot: ElementTree.Element, links: Iterable[LinkRow]) -> Iterator[str]:
    """Ranges, speeds, origins, masses and inertias that look as if they were in other units, one clause each.

    Args:
        robot: top element of a URDF.
        links: its links.
    """
    yield from _joint_warnings(robot)
    found = tuple(links)
    wide = [(link, math.sqrt(link.moments[2] / link.mass)) for link in found if link.mass > 0.0 < link.moments[2]]
    for link, radius in wide:
        if radius > _WIDE:
            yield (
                f"link {link.name!r}: an inertia of {link.moments[2]:g} kg·m² for {link.mass:g} kg, as of a body "
                f"{radius:.3g} m around, looks like kg·mm²"
            )
    total = sum(link.mass for link in found if link.mass > 0.0)
    if total > _HEAVY:
        yield f"links of {total:g} kg together look like g"


def _joint_warnings(robot: ElementTree.Element) -> Iterator[str]:
    ranges: list[str] = []
    speeds: list[str] = []
    origins: list[str] = []
    for joint in robot.iterfind("joint"):
        name, origin, limit = repr(joint.get("name")), joint.find("origin"), joint.find("limit")
        xyz = [urdf_number(part) or 0.0 for part in ("" if origin is None else origin.get("xyz", "")).split()]
        if math.hypot(*xyz) > _FAR:
            origins.append(f"{math.hypot(*xyz):g} m of {name}")
        if limit is None or joint.get("type") not in ("revolute", "prismatic", "continuous"):
            continue
        unit = "m" if joint.get("type") == "prismatic" else "rad"
        lower, upper, velocity = (urdf_number(limit.get(key)) or 0.0 for key in ("lower", "upper", "velocity"))
        if likely_unit(max(abs(lower), abs(upper)), unit) and joint.get("type") != "continuous":
            ranges.append(f"{lower:g} to {upper:g} {unit} of {name}")
        if likely_unit(velocity, f"{unit}/s"):
            speeds.append(f"{velocity:g} {unit}/s of {name}")
    if origins:
        yield f"distances between joints look like mm: {', '.join(origins)}"
    if ranges:
        yield f"ranges look like degrees or mm: {', '.join(ranges)}"
    if speeds:
        yield f"speeds look like deg/s, rpm or mm/s, or like placeholders: {', '.join(speeds)}"
