"""Links of a URDF, the rigid bodies that they form, and its tips."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np

from trajevo.robot.urdf.file import end_of, read_number


@dataclass(frozen=True)
class LinkRow:
    """One link, SI; NaN where the file gives no number.

    Attributes:
        name: name of the link.
        mass: mass, 0 without ``<inertial>`` [kg].
        moments: principal moments of inertia about the centre of mass, ascending [kg·m²].
    """

    name: str
    mass: float
    moments: tuple[float, float, float]


@dataclass(frozen=True)
class Body:
    """Links that are rigidly connected, and the joint that moves them, None for the base."""

    joint: str | None
    links: tuple[LinkRow, ...]


def link_rows(robot: ElementTree.Element) -> tuple[LinkRow, ...]:
    """The links of a URDF in its order."""
    return tuple(_row(link) for link in robot.iterfind("link"))


def bodies(robot: ElementTree.Element, lock: Collection[str]) -> tuple[Body, ...]:
    """Groups of links that fixed and locked joints connect, each with the joint that moves the group."""
    carriers: dict[str, ElementTree.Element] = {}
    for joint in robot.iterfind("joint"):
        carriers.setdefault(end_of(joint, "child"), joint)
    held: dict[str | None, list[LinkRow]] = {}
    tops: dict[str, str] = {}  # link -> the uppermost one of its body
    for link in link_rows(robot):
        at, passed = link.name, {link.name: None}
        while at not in tops and at in carriers and _holds_still(carriers[at], lock):
            at = end_of(carriers[at], "parent")
            if at in passed:  # a loop, which is reported as such
                break
            passed[at] = None
        top = tops.get(at, at)
        tops.update(dict.fromkeys(passed, top))
        mover = carriers[top].get("name", "") if top in carriers else None
        held.setdefault(mover, []).append(link)
    return tuple(Body(joint, tuple(links)) for joint, links in held.items())


def _holds_still(joint: ElementTree.Element, lock: Collection[str]) -> bool:
    return joint.get("type") == "fixed" or joint.get("name") in lock


def massless_bodies(found: tuple[Body, ...]) -> Iterator[tuple[str, list[str]]]:
    """Joints that move a body without mass, and the links of that body."""
    for body in found:
        if body.joint is not None and not any(link.mass for link in body.links):  # NaN is true: reported elsewhere
            yield body.joint, [link.name for link in body.links]


def tips(robot: ElementTree.Element) -> list[str]:
    """Links that carry no other link."""
    parents = {end_of(joint, "parent") for joint in robot.iterfind("joint")}
    return [link.get("name", "") for link in robot.iterfind("link") if link.get("name", "") not in parents]


def _row(link: ElementTree.Element) -> LinkRow:
    inertial = link.find("inertial")
    if inertial is None:
        return LinkRow(link.get("name", ""), 0.0, (0.0, 0.0, 0.0))
    mass = read_number(inertial.find("mass"), "value")
    ixx, ixy, ixz, iyy, iyz, izz = (
        read_number(inertial.find("inertia"), key) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    )
    tensor = np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
    moments = np.linalg.eigvalsh(tensor) if np.isfinite(tensor).all() else np.full(3, np.nan)
    return LinkRow(link.get("name", ""), mass, (float(moments[0]), float(moments[1]), float(moments[2])))
