"""Load data as controllers ask for them: mass, centre of mass, principal moments and the angles of their axes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import permutations, product
from typing import final

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.base.shown.brief import brief
from trajevo.robot.payload import Payload


@final
@dataclass(frozen=True, eq=False)
class LoadData:
    """A load in the frame of the tool.

    Attributes:
        mass: mass [kg].
        com: centre of mass, shape (3,) [m].
        inertia: about the centre of mass along the axes of the frame, shape (3, 3) [kg·m²]; 0 for a point mass.
        principal: principal moments, shape (3,) [kg·m²].
        axes: principal axes as columns, a rotation near to the axes of the frame, shape (3, 3).
    """

    mass: float
    com: Array
    inertia: Array
    principal: Array
    axes: Array

    __repr__ = brief

    @classmethod
    def of(cls, payload: Payload) -> LoadData:
        """The data of a payload."""
        tensor = np.zeros((3, 3)) if payload.inertia is None else np.array(payload.inertia)
        principal, axes = _principal(tensor)
        return cls(payload.mass, frozen(np.array(payload.com)), frozen(tensor), frozen(principal), frozen(axes))

    @property
    def about_frame(self) -> Array:
        """Inertia about the origin of the frame along its axes, shape (3, 3) [kg·m²]."""
        com = self.com
        return frozen(self.inertia + self.mass * (com @ com * np.eye(3) - np.outer(com, com)))

    @property
    def angles(self) -> Array:
        """Angles A, B and C about Z, Y and X, each about the axis already turned, of the principal axes (3,) [rad]."""
        return frozen(abc_of(self.axes))

    @property
    def quaternion(self) -> Array:
        """Unit quaternion of the principal axes, w first, shape (4,)."""
        a, b, c = 0.5 * self.angles
        turns = [np.array([np.cos(a), 0, 0, np.sin(a)]), np.array([np.cos(b), 0, np.sin(b), 0])]
        whole = _product(_product(*turns), np.array([np.cos(c), np.sin(c), 0, 0]))
        return frozen(whole if whole[0] >= 0.0 else -whole)

    def for_controllers(self) -> Iterator[tuple[str, str, str]]:
        """Controller, fields as it names them, and what to mind."""
        # Adding 0 makes 0 of -0, which nobody types into a controller.
        mass, com, j = f"{self.mass:.4g}", 1e3 * self.com + 0.0, self.principal
        x, y, z = (f"{value:.4g}" for value in com)
        a, b, c = (f"{value:.4g}" for value in np.degrees(self.angles) + 0.0)
        moments = [f"{value:.4g}" for value in j]
        yield (
            "KUKA",
            f"M {mass} kg; X {x}, Y {y}, Z {z} mm; A {a}, B {b}, C {c}°; "
            f"JX {moments[0]}, JY {moments[1]}, JZ {moments[2]} kg·m²",
            "flange frame; principal axes by Z, Y, X, each about the axis already turned; origin at the centre of mass",
        )
        turn = ", ".join(f"{value:.5g}" for value in self.quaternion + 0.0)
        yield (
            "ABB",
            f"mass {mass} kg; cog [{x}, {y}, {z}] mm; aom [{turn}]; "
            f"ix {moments[0]}, iy {moments[1]}, iz {moments[2]} kg·m²",
            "loaddata: tool frame for a payload, wrist frame for the load of a tool; principal axes at the centre",
        )
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = self.inertia.tolist()
        metres = ", ".join(f"{value:.4g}" for value in self.com + 0.0)
        tensor = ", ".join(f"{value:.4g}" for value in np.array([xx, yy, zz, xy, xz, yz]) + 0.0)
        yield (
            "Universal Robots",
            f"mass {mass} kg; CoG [{metres}] m; inertia [{tensor}] kg·m²",
            "from the flange; Ixx, Iyy, Izz, Ixy, Ixz, Iyz about the centre of mass along the axes of the flange",
        )


def rotation_of(angles: Array) -> Array:
    """Rotation Rz(A) Ry(B) Rx(C) of angles A, B, C, shapes (3,) [rad] -> (3, 3)."""
    (ca, cb, cc), (sa, sb, sc) = np.cos(angles), np.sin(angles)
    z = np.array([[ca, -sa, 0.0], [sa, ca, 0.0], [0.0, 0.0, 1.0]])
    y = np.array([[cb, 0.0, sb], [0.0, 1.0, 0.0], [-sb, 0.0, cb]])
    x = np.array([[1.0, 0.0, 0.0], [0.0, cc, -sc], [0.0, sc, cc]])
    rotation: Array = z @ y @ x
    return rotation


def abc_of(rotation: Array) -> Array:
    """Angles A, B, C of a rotation, the inverse of :func:`rotation_of`, B from -90° to 90°; C is 0 where B is ±90°."""
    level = np.hypot(rotation[0, 0], rotation[1, 0])
    b = np.arctan2(-rotation[2, 0], level)
    if level < 1e-12:
        return np.array([np.arctan2(-rotation[0, 1], rotation[1, 1]), b, 0.0])
    return np.array([np.arctan2(rotation[1, 0], rotation[0, 0]), b, np.arctan2(rotation[2, 1], rotation[2, 2])])


def _principal(tensor: Array) -> tuple[Array, Array]:
    """Principal moments, and their axes in the order and with the signs that turn least from the frame's own."""
    if np.allclose(tensor, np.diag(np.diagonal(tensor)), rtol=0.0, atol=1e-12 * np.abs(tensor).max(initial=0.0)):
        return np.diagonal(tensor).copy(), np.eye(3)
    moments, axes = np.linalg.eigh(tensor)
    best = -np.inf
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            turned = axes[:, order] * signs
            if np.linalg.det(turned) > 0.0 and np.trace(turned) > best:
                best, found = np.trace(turned), (moments[list(order)], turned)
    return found


def _product(one: Array, other: Array) -> Array:
    """Product of quaternions, w first."""
    vector = one[0] * other[1:] + other[0] * one[1:] + np.cross(one[1:], other[1:])
    return np.append(one[0] * other[0] - one[1:] @ other[1:], vector)
