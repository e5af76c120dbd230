"""Geoms of MJCF: their masses where a body has no ``<inertial>``, and their collision geometry."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError
from trajevo.robot.mjcf.classes import Attributes, is_on, number_of, numbers_of
from trajevo.robot.mjcf.places import Angles, Place, direction, place_of, towards

#: Density of geoms that have none [kg/m³].
_WATER = 1000.0

#: Shapes with a volume: how many sizes each has.
_SIZES = {"sphere": 1, "capsule": 2, "cylinder": 2, "box": 3, "ellipsoid": 3}

#: Shapes without a volume that a robot could carry.
_FLAT = ("plane", "hfield")


@dataclass(frozen=True)
class Shape:
    """A geom with its default class.

    Attributes:
        kind: its type, such as ``"box"`` or ``"mesh"``.
        sizes: radius, half-lengths and so on as in MJCF, none for a mesh [m].
        place: its pose in the frame of the body.
        mass: its mass [kg]; None if it follows from a density, which is then ``density``.
        density: density [kg/m³].
        mesh: name of its mesh, ``""`` if it has none.
        collides: whether anything can touch it.
        where: file, body and geom, for messages.
    """

    kind: str
    sizes: tuple[float, ...]
    place: Place
    mass: float | None
    density: float
    mesh: str
    collides: bool
    where: str

    @property
    def weighs(self) -> bool:
        """Whether it has a mass."""
        return self.kind not in _FLAT and (self.density if self.mass is None else self.mass) != 0.0

    def body(self) -> tuple[float, Array, Array]:
        """Mass [kg], centre of mass (3,) [m] and inertia about it (3, 3) [kg·m²] in the frame of the body.

        Raises:
            InvalidInputError: they follow from a mesh.
        """
        if self.mesh or self.kind not in _SIZES:
            raise InvalidInputError(
                f"{self.where}: its mass follows from a {self.kind}, which is not read: give an <inertial>, as "
                "MuJoCo writes it when it saves the model (mj_saveLastXML)"
            )
        volume, per_mass = _VOLUMES[self.kind](*self.sizes)
        mass = self.density * volume if self.mass is None else self.mass
        rotation = self.place.rotation
        return mass, self.place.position, rotation @ np.diag(mass * np.array(per_mass)) @ rotation.T


def shape_of(given: Attributes, angles: Angles, outer: Place, where: str) -> Shape:
    """A geom.

    Args:
        given: its attributes with those of its class.
        angles: how the file writes angles.
        outer: pose of the ``<frame>`` around it in the body.
        where: file, body and geom, for messages.

    Raises:
        InvalidInputError: numbers that are none, an unknown type, or a shell.
    """
    kind = given.get("type", "mesh" if given.get("mesh") else "sphere")
    if kind not in (*_SIZES, *_FLAT, "mesh", "sdf"):
        raise InvalidInputError(f"{where}: type: expected one of {', '.join((*_SIZES, 'mesh', *_FLAT))}, got {kind!r}")
    if is_on(given, "shellinertia", where, auto=False):
        raise InvalidInputError(f"{where}: shellinertia: expected a solid, got a shell: give the body an <inertial>")
    sizes = numbers_of(given, "size", where, counts=(1, 2, 3)) or ()
    place = place_of(given, angles, where)
    ends = numbers_of(given, "fromto", where, counts=(6,))
    if ends is not None and kind in _SIZES and sizes:
        start, end = np.array(ends[:3]), np.array(ends[3:])
        half = 0.5 * float(np.linalg.norm(end - start))
        place = Place(towards(direction(start - end, f"{where}: fromto")), 0.5 * (start + end))
        sizes = (sizes[0], half) if _SIZES[kind] == 2 else (sizes[0], sizes[0], half)
    mesh = given.get("mesh", "")
    if kind in _SIZES and not mesh and (len(sizes) < _SIZES[kind] or min(sizes[: _SIZES[kind]]) <= 0.0):
        raise InvalidInputError(f"{where}: size: expected {_SIZES[kind]} positive numbers, got {given.get('size')!r}")
    mass = number_of(given, "mass", where, math.nan)
    return Shape(
        kind=kind,
        sizes=sizes[: _SIZES.get(kind, 0)],
        place=outer.then(place),
        mass=None if math.isnan(mass) else mass,
        density=number_of(given, "density", where, _WATER),
        mesh=mesh,
        collides=any(number_of(given, key, where, 1.0) != 0.0 for key in ("contype", "conaffinity")),
        where=where,
    )


def together(parts: list[tuple[float, Array, Array]]) -> tuple[float, Array, Array]:
    """Mass, centre of mass and inertia about it of several bodies in one frame."""
    mass = sum(part[0] for part in parts)
    if mass == 0.0:
        return 0.0, np.zeros(3), np.zeros((3, 3))
    com = sum((part[0] * part[1] for part in parts), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for each, place, own in parts:
        arm = place - com
        inertia += own + each * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return mass, com, inertia


_Volume = tuple[float, tuple[float, float, float]]


def _sphere(radius: float) -> _Volume:
    moment = 0.4 * radius**2
    return 4.0 / 3.0 * math.pi * radius**3, (moment, moment, moment)


def _box(x: float, y: float, z: float) -> _Volume:
    return 8.0 * x * y * z, ((y**2 + z**2) / 3.0, (x**2 + z**2) / 3.0, (x**2 + y**2) / 3.0)


def _ellipsoid(x: float, y: float, z: float) -> _Volume:
    moments = (y**2 + z**2) / 5.0, (x**2 + z**2) / 5.0, (x**2 + y**2) / 5.0
    return 4.0 / 3.0 * math.pi * x * y * z, moments


def _cylinder(radius: float, half: float) -> _Volume:
    across = radius**2 / 4.0 + half**2 / 3.0
    return 2.0 * math.pi * radius**2 * half, (across, across, radius**2 / 2.0)


def _capsule(radius: float, half: float) -> _Volume:
    """A cylinder and two half-balls, whose centres of mass are 3/8 of the radius from its ends."""
    ball, (turn, _, _) = _sphere(radius)
    rod, (rod_across, _, rod_along) = _cylinder(radius, half)
    share = ball / (ball + rod)
    across = share * (turn + half**2 + 0.75 * half * radius) + (1.0 - share) * rod_across
    return ball + rod, (across, across, share * turn + (1.0 - share) * rod_along)


_VOLUMES: dict[str, Callable[..., _Volume]] = {
    "sphere": _sphere,
    "box": _box,
    "ellipsoid": _ellipsoid,
    "cylinder": _cylinder,
    "capsule": _capsule,
}
