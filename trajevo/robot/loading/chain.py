"""Chains of joints as URDF text, so that a robot without a URDF goes the way of all others.

Every step of a chain, and of a Denavit-Hartenberg table, is Rz(θ) Tz(d) Tx(a) Rx(α), which an ``<origin>`` of a URDF
holds without rounding anything but the sine and cosine of θ: ``rpy`` is (α, 0, θ).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np

from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError
from trajevo.robot.urdf.problems import urdf_problems

#: Links of a chain before its first joint, at the end of its last step, and at the tool.
BASE, FLANGE, TOOL = "base", "flange", "tool"


class DhStep(NamedTuple):
    """Rz(theta) Tz(d) Tx(a) Rx(alpha) [rad, m]."""

    theta: float = 0.0
    d: float = 0.0
    a: float = 0.0
    alpha: float = 0.0

    @property
    def offset(self) -> Array:
        """Translation of the step, shape (3,) [m]."""
        return np.array([self.a * math.cos(self.theta), self.a * math.sin(self.theta), self.d])

    @property
    def rotation(self) -> Array:
        """Rotation of the step, shape (3, 3)."""
        c, s, u, w = math.cos(self.theta), math.sin(self.theta), math.cos(self.alpha), math.sin(self.alpha)
        return np.array([[c, -s * u, s * w], [s, c * u, -c * w], [0.0, w, u]])

    @property
    def rpy(self) -> tuple[float, float, float]:
        """The rotation about the fixed axes x, y and z, in this order [rad]."""
        return self.alpha, 0.0, self.theta


@dataclass(frozen=True, eq=False)
class Segment:
    """A joint about, or along, the z axis of its frame, and the body that it moves.

    Attributes:
        name: name of the joint.
        kind: ``"revolute"`` or ``"prismatic"``.
        before: from the frame of the joint before to that of this one, at its position 0.
        body: from the frame of this joint to that in which ``com`` and ``inertia`` are given.
        mass: mass of the body [kg].
        com: its centre of mass, shape (3,) [m].
        inertia: its inertia about the centre of mass, shape (3, 3) [kg·m²].
    """

    name: str
    kind: str
    before: DhStep
    body: DhStep
    mass: float
    com: Array
    inertia: Array


@dataclass(frozen=True, eq=False)
class Pose6:
    """Position [m] and rotation about the fixed axes x, y and z, in this order [rad], each of shape (3,)."""

    position: Array
    rpy: Array


def chain_urdf(name: str, segments: Sequence[Segment], end: DhStep, tool: Pose6) -> str:
    """A chain as URDF text.

    Args:
        name: name of the robot.
        segments: its joints from the base on.
        end: from the frame of the last joint to the flange.
        tool: pose of the tool at the flange.

    Raises:
        InvalidInputError: names that are not unique, or a mass or an inertia that no body has.
    """
    robot = ElementTree.Element("robot", name=name)
    ElementTree.SubElement(robot, "link", name=BASE)
    links = [BASE, *(f"link_{number}" for number in range(1, len(segments) + 1))]
    for segment, parent, link in zip(segments, links, links[1:], strict=False):
        _add_link(robot, link, segment)
        joint = _add_joint(robot, segment.name, segment.kind, (parent, link))
        _add_origin(joint, segment.before.offset, segment.before.rpy)
        ElementTree.SubElement(joint, "axis", xyz="0 0 1")
        # The format wants limits, all of them finite. Those of the robot are its JointLimits.
        ElementTree.SubElement(joint, "limit", lower="-1", upper="1", velocity="1", effort="1")
    for link, parent, offset, rpy in (
        (FLANGE, links[-1], end.offset, end.rpy),
        (TOOL, FLANGE, tool.position, tuple(tool.rpy)),
    ):
        ElementTree.SubElement(robot, "link", name=link)
        _add_origin(_add_joint(robot, f"to the {link}", "fixed", (parent, link)), offset, rpy)
    for problem in urdf_problems(robot, f"robot {name!r}"):
        raise InvalidInputError(problem)
    return ElementTree.tostring(robot, encoding="unicode")


def _add_link(robot: ElementTree.Element, name: str, segment: Segment) -> None:
    link = ElementTree.SubElement(robot, "link", name=name)
    if segment.mass == 0.0 and not segment.inertia.any():
        return
    inertial = ElementTree.SubElement(link, "inertial")
    _add_origin(inertial, segment.body.offset + segment.body.rotation @ segment.com, segment.body.rpy)
    ElementTree.SubElement(inertial, "mass", value=repr(float(segment.mass)))
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = segment.inertia.tolist()
    keys = {"ixx": xx, "ixy": xy, "ixz": xz, "iyy": yy, "iyz": yz, "izz": zz}
    ElementTree.SubElement(inertial, "inertia", {key: repr(value) for key, value in keys.items()})


def _add_joint(robot: ElementTree.Element, name: str, kind: str, ends: tuple[str, str]) -> ElementTree.Element:
    joint = ElementTree.SubElement(robot, "joint", name=name, type=kind)
    for role, link in zip(("parent", "child"), ends, strict=True):
        ElementTree.SubElement(joint, role, link=link)
    return joint


def _add_origin(parent: ElementTree.Element, offset: Array, rpy: Sequence[float]) -> None:
    xyz = " ".join(repr(float(x)) for x in offset)
    ElementTree.SubElement(parent, "origin", xyz=xyz, rpy=" ".join(repr(float(angle)) for angle in rpy))
