"""Checks of a URDF before Pinocchio reads it: Pinocchio drops an inertia that it cannot read and says nothing."""

from __future__ import annotations

import re
from collections.abc import Collection
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from trajevo.arrays import Array
from trajevo.errors import InvalidInputError

#: The numbers that Pinocchio's URDF parser reads; Python's float() takes more: nan, inf, 1_0, trailing spaces.
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)

#: Share by which tensors of thin plates may break the triangle inequality: files print rounded numbers.
_ROUNDING = 1e-6

_TENSOR = (("ixx", "ixy", "ixz"), ("ixy", "iyy", "iyz"), ("ixz", "iyz", "izz"))


def checked_urdf(file: Path, locked: Collection[str] = ()) -> str:
    """Read a URDF and refuse what no machine can be: masses and inertias that no body has, joints without an axis.

    A link with no ``<inertial>``, or with mass and inertia zero, is a massless carrier, one with mass and no inertia a
    point mass; both are allowed.

    Args:
        file: the URDF.
        locked: joints that will be held still; they may mimic others.

    Returns:
        The file as XML text: exactly what was checked, for Pinocchio.

    Raises:
        InvalidInputError: not XML, a number that cannot be read, a mass that is negative or not finite, an inertia that
            is not positive definite or breaks the triangle inequality, an axis that is zero, a ``<mimic>``, or no
            movable joint; the message names file, link or joint, and value.
    """
    if not file.is_file():
        raise InvalidInputError(f"{file}: no such URDF file")
    try:
        robot = ElementTree.parse(file).getroot()
    except (OSError, LookupError, ValueError, ElementTree.ParseError) as error:
        raise InvalidInputError(f"{file}: cannot be read as XML: {error}") from error
    for link in robot.iterfind("link"):
        inertial = link.find("inertial")
        if inertial is not None:
            _check_inertial(inertial, f"{file}: link {link.get('name')!r}")
    joints = robot.findall("joint")
    for joint in joints:
        _check_joint(joint, f"{file}: joint {joint.get('name')!r}", joint.get("name") in locked)
    if all(joint.get("type") == "fixed" for joint in joints):
        raise InvalidInputError(f"{file}: expected at least one movable joint, got {len(joints)} fixed ones")
    return ElementTree.tostring(robot, encoding="unicode")


def _check_inertial(inertial: ElementTree.Element, where: str) -> None:
    mass = _number(_child(inertial, "mass", where), "value", f"{where}: mass")
    if mass < 0.0:
        raise InvalidInputError(f"{where}: mass: expected a number from 0 on [kg], got {mass}")
    _check_origin(inertial, f"{where}: inertial")
    element = _child(inertial, "inertia", where)
    tensor = np.array([[_number(element, key, f"{where}: inertia") for key in row] for row in _TENSOR])
    if mass > 0.0 and tensor.any():
        _check_tensor(tensor, f"{where}: inertia")
    elif not mass > 0.0 and tensor.any():
        raise InvalidInputError(f"{where}: inertia: expected zeros for a link of mass 0, got {tensor.tolist()} [kg·m²]")


def _check_tensor(tensor: Array, where: str) -> None:
    """A tensor about the centre of mass; the moments do not depend on the frame it is given in."""
    moments = np.linalg.eigvalsh(tensor)
    if not moments[0] > 0.0:
        raise InvalidInputError(
            f"{where}: expected a positive definite tensor, got principal moments {moments.tolist()} [kg·m²]"
        )
    if moments[2] > (moments[0] + moments[1]) * (1.0 + _ROUNDING):
        raise InvalidInputError(
            f"{where}: expected no principal moment above the sum of the others (triangle inequality), "
            f"got {moments.tolist()} [kg·m²]"
        )


def _check_joint(joint: ElementTree.Element, where: str, locked: bool) -> None:
    _check_origin(joint, where)
    mimic = joint.find("mimic")
    if mimic is not None and not locked:
        raise InvalidInputError(
            f"{where}: expected an independent joint, got <mimic> of {mimic.get('joint')!r}; lock it"
        )
    axis = joint.find("axis")
    # Without <axis> the URDF format means the x axis.
    if axis is None or joint.get("type") == "fixed":
        return
    direction = _vector(axis, "xyz", f"{where}: axis")
    if not np.linalg.norm(direction) > 0.0:
        raise InvalidInputError(f"{where}: axis: expected a direction, got the zero vector {axis.get('xyz')!r}")


def _check_origin(parent: ElementTree.Element, where: str) -> None:
    origin = parent.find("origin")
    for key in ("xyz", "rpy"):
        if origin is not None and key in origin.attrib:
            _vector(origin, key, f"{where}: origin")


def _child(parent: ElementTree.Element, tag: str, where: str) -> ElementTree.Element:
    child = parent.find(tag)
    if child is None:
        raise InvalidInputError(f"{where}: <{parent.tag}> has no <{tag}>")
    return child


def _number(element: ElementTree.Element, key: str, where: str) -> float:
    text = element.get(key)
    if text is None or not (_NUMBER.fullmatch(text) and np.isfinite(float(text))):
        raise InvalidInputError(f"{where}: expected a finite number as {key}, got {text!r}")
    return float(text)


def _vector(element: ElementTree.Element, key: str, where: str) -> Array:
    text = element.get(key)
    parts = (text or "").split()
    values = np.array([float(part) for part in parts if _NUMBER.fullmatch(part)])
    if not (len(parts) == len(values) == 3 and np.isfinite(values).all()):
        raise InvalidInputError(f"{where}: expected three finite numbers as {key}, got {text!r}")
    return values
