"""Links of a URDF that may be broken: masses, what hangs together rigidly, tips."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np

from trajevo.robot_check import urdf_number


@dataclass(frozen=True)
class LinkRow:
    """One link, SI; NaN where the file gives no number.

    Attributes:
        name: name of the link.
        mass: 0 without ``<inertial>`` [kg].
        moments: principal moments of inertia about the centre of mass, rising [kg·m²].
    """

    name: str
    mass: float
    moments: tuple[float, float, float]


@dataclass(frozen=True)
class Body:
    """Links that hang together rigidly, and the joint that moves them; None for the base."""

    joint: str | None
    links: tuple[LinkRow, ...]


def link_rows(robot: ElementTree.Element) -> tuple[LinkRow, ...]:
    """The links of a URDF in its order."""
    return tuple(_row(link) for link in robot.iterfind("link"))


def bodies(robot: ElementTree.Element, lock: Collection[str]) -> tuple[Body, ...]:
    """Links that fixed and locked joints hold together; each moved by the joint that carries it."""
    carriers: dict[str, ElementTree.Element] = {}
    for joint in robot.iterfind("joint"):
        carriers.setdefault(_end(joint, "child"), joint)
    held: dict[str | None, list[LinkRow]] = {}
    for link in link_rows(robot):
        at, seen = link.name, {link.name}
        while at in carriers and (carriers[at].get("type") == "fixed" or carriers[at].get("name") in lock):
            at = _end(carriers[at], "parent")
            if at in seen:  # a loop, which is told as one
                break
            seen.add(at)
        mover = carriers[at].get("name", "") if at in carriers else None
        held.setdefault(mover, []).append(link)
    return tuple(Body(joint, tuple(links)) for joint, links in held.items())


def massless_bodies(found: tuple[Body, ...]) -> Iterator[tuple[str, list[str]]]:
    """Joints that move a body without mass, and the links of that body."""
    for body in found:
        if body.joint is not None and not any(link.mass for link in body.links):  # NaN is true: told elsewhere
            yield body.joint, [link.name for link in body.links]


def tips(robot: ElementTree.Element) -> list[str]:
    """Links that carry no other."""
    parents = {_end(joint, "parent") for joint in robot.iterfind("joint")}
    return [link.get("name", "") for link in robot.iterfind("link") if link.get("name", "") not in parents]


def _row(link: ElementTree.Element) -> LinkRow:
    inertial = link.find("inertial")
    if inertial is None:
        return LinkRow(link.get("name", ""), 0.0, (0.0, 0.0, 0.0))
    mass = _read(inertial.find("mass"), "value")
    ixx, ixy, ixz, iyy, iyz, izz = (
        _read(inertial.find("inertia"), key) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    )
    tensor = np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
    moments = np.linalg.eigvalsh(tensor) if np.isfinite(tensor).all() else np.full(3, np.nan)
    return LinkRow(link.get("name", ""), mass, (float(moments[0]), float(moments[1]), float(moments[2])))


def _read(element: ElementTree.Element | None, key: str) -> float:
    value = None if element is None else urdf_number(element.get(key))
    return float("nan") if value is None else value


def _end(joint: ElementTree.Element, role: str) -> str:
    element = joint.find(role)
    return "" if element is None else element.get("link", "")
