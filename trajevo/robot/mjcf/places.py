"""Poses in MJCF: a position, and an orientation in one of five notations."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError
from trajevo.robot.mjcf.classes import Attributes, numbers_of

_NOTATIONS = {"quat": 4, "axisangle": 4, "euler": 3, "xyaxes": 6, "zaxis": 3}

#: Length below which a direction is none.
_SHORT = 1e-10


@dataclass(frozen=True)
class Angles:
    """How a file writes angles.

    Attributes:
        to_rad: radians per unit of the file.
        sequence: axes of three angles of Euler, in lower case those that move along.
    """

    to_rad: float
    sequence: str


class Place(NamedTuple):
    """A pose in the frame around it.

    Attributes:
        rotation: shape (3, 3).
        position: shape (3,) [m].
    """

    rotation: Array
    position: Array

    def then(self, inner: Place) -> Place:
        """A pose in this one, in the frame around this one."""
        return Place(self.rotation @ inner.rotation, self.position + self.rotation @ inner.position)

    def shifted(self, offset: Array) -> Place:
        """The pose moved by an offset in its own frame [m]."""
        return Place(self.rotation, self.position + self.rotation @ offset)

    @property
    def rpy(self) -> tuple[float, float, float]:
        """The rotation about the fixed axes x, y and z [rad]; x takes up what a pitch of 90° leaves open."""
        r = self.rotation
        yaw = math.atan2(r[1, 0], r[0, 0])
        c, s = math.cos(yaw), math.sin(yaw)
        pitch = math.atan2(-r[2, 0], c * r[0, 0] + s * r[1, 0])
        return math.atan2(s * r[0, 2] - c * r[1, 2], c * r[1, 1] - s * r[0, 1]), pitch, yaw


HERE = Place(np.eye(3), np.zeros(3))


def place_of(given: Attributes, angles: Angles, where: str) -> Place:
    """The pose of an element by its attributes ``pos`` and one of ``quat``, ``axisangle``, ``euler``, ...

    Raises:
        InvalidInputError: several orientations, or numbers that are none.
    """
    position = numbers_of(given, "pos", where, counts=(3,))
    return Place(_rotation(given, angles, where), np.zeros(3) if position is None else np.array(position))


def about(axis: Array, angle: float) -> Array:
    """Rotation about a unit axis, shape (3, 3)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turned: Array = np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * (cross @ cross)
    return turned


def direction(vector: Array, where: str) -> Array:
    """A vector scaled to length 1.

    Raises:
        InvalidInputError: it has none.
    """
    length = float(np.linalg.norm(vector))
    if not _SHORT < length < math.inf:
        raise InvalidInputError(f"{where}: expected a direction, got {vector.tolist()}")
    return vector / length


def towards(z: Array) -> Array:
    """The smallest rotation that turns the z axis to a unit vector, shape (3, 3)."""
    axis = np.array([-z[1], z[0], 0.0])
    length = float(np.linalg.norm(axis))
    if length < _SHORT:
        return np.diag([1.0, 1.0, 1.0] if z[2] > 0.0 else [1.0, -1.0, -1.0])
    return about(axis / length, math.atan2(length, z[2]))


def _rotation(given: Attributes, angles: Angles, where: str) -> Array:
    notations = [key for key in _NOTATIONS if key in given]
    if not notations:
        return np.eye(3)
    if len(notations) > 1:
        raise InvalidInputError(f"{where}: expected one orientation, got {' and '.join(notations)}")
    key = notations[0]
    values = np.array(numbers_of(given, key, where, counts=(_NOTATIONS[key],)))
    where = f"{where}: {key}"
    if key == "quat":
        w, x, y, z = direction(values, where)
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        turned: Array = np.eye(3) + 2.0 * w * cross + 2.0 * (cross @ cross)
        return turned
    if key == "axisangle":
        return about(direction(values[:3], where), float(values[3]) * angles.to_rad)
    if key == "euler":
        return _euler(values * angles.to_rad, angles.sequence)
    if key == "zaxis":
        return towards(direction(values, where))
    x = direction(values[:3], where)
    y = direction(values[3:] - x * (x @ values[3:]), where)
    return np.column_stack([x, y, np.cross(x, y)])


def _euler(values: Array, sequence: str) -> Array:
    rotation = np.eye(3)
    for axis, angle in zip(sequence, values, strict=True):
        turned = about(np.eye(3)["xyz".index(axis.lower())], float(angle))
        rotation = rotation @ turned if axis.islower() else turned @ rotation
    return rotation
