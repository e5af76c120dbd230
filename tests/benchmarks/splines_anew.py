"""Splines, peaks and torques written anew for ``bench_casadi.py``: a second opinion on trajevo's own formulation.

Nothing of trajevo is used. The functions need sums, products and ``sin``, ``cos``, ``fmin`` and ``fmax`` of the module
``xp``, so that they take numbers, arrays of a batch with ``numpy``, and symbols with ``casadi``. A decision vector is a
list of its elements. Cubic splines are told by the jerks of their pieces, where trajevo solves for the accelerations at
the knots; two links by Lagrange's equations, where trajevo goes from link to link.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

#: Keeps the instant of the greatest velocity finite where an acceleration is constant [rad²/s⁴].
_TINY = 1e-30


@dataclass(frozen=True)
class Piece:
    """A cubic of every joint.

    Attributes:
        h: its duration [s].
        start: position, velocity, acceleration and jerk of every joint where it begins [rad, s].
    """

    h: Any
    start: tuple[tuple[Any, Any, Any, Any], ...]

    def at(self, s: Any) -> list[tuple[Any, Any, Any]]:
        """Position, velocity and acceleration of every joint at a time after the beginning."""
        return [
            (q + s * (v + s * (a / 2.0 + s * j / 6.0)), v + s * (a + s * j / 2.0), a + s * j)
            for q, v, a, j in self.start
        ]


def solved(matrix: list[list[Any]], rights: list[list[Any]]) -> list[list[Any]]:
    """Solutions of linear equations without pivots: matrices of splines through points in order need none.

    Args:
        matrix: rows of N elements.
        rights: a list of N elements for every right-hand side.
    """
    rows, sides, count = [list(row) for row in matrix], [list(side) for side in rights], len(matrix)
    for k in range(count):
        for i in range(k + 1, count):
            factor = rows[i][k] / rows[k][k]
            for c in range(k + 1, count):
                rows[i][c] = rows[i][c] - factor * rows[k][c]
            for side in sides:
                side[i] = side[i] - factor * side[k]
    for side in sides:
        for k in reversed(range(count)):
            for c in range(k + 1, count):
                side[k] = side[k] - rows[k][c] * side[c]
            side[k] = side[k] / rows[k][k]
    return sides


def cubic(points: list[list[Any]], h: list[Any]) -> list[Piece]:
    """The C2 cubic spline at rest at both ends, also in its accelerations, with a virtual knot next to each end.

    The jerks of the pieces are what the points, the last velocity and the last acceleration ask for.

    Args:
        points: K points, each a list of joints [rad].
        h: K + 1 durations [s].
    """
    count = len(h)
    ends = [sum(h[: k + 1]) for k in range(count)]
    begins = [0.0, *ends[:-1]]
    matrix = []
    for knot in [*range(1, count - 2), count - 1]:  # the points after the first
        t = ends[knot]
        row = [((t - begins[i]) ** 3 - ((t - ends[i]) ** 3 if i < knot else 0.0)) / 6.0 for i in range(knot + 1)]
        matrix.append(row + [0.0] * (count - knot - 1))
    t = ends[-1]
    matrix.append([((t - begins[i]) ** 2 - (t - ends[i]) ** 2) / 2.0 for i in range(count - 1)] + [h[-1] ** 2 / 2.0])
    matrix.append(list(h))
    joints = range(len(points[0]))
    jerks = solved(matrix, [[point[j] - points[0][j] for point in points[1:]] + [0.0, 0.0] for j in joints])
    state, pieces = [(points[0][j], 0.0, 0.0) for j in joints], []
    for k in range(count):
        pieces.append(Piece(h[k], tuple((*state[j], jerks[j][k]) for j in joints)))
        state = pieces[-1].at(h[k])
    return pieces


def cubic_with_free_points(points: list[list[Any]], x: list[Any], count: int) -> list[Piece]:
    """The same spline through ``count`` free points more in every gap, told by distances from that without them.

    Args:
        points: K points, each a list of joints [rad].
        x: K + 1 durations [s]; when free points are passed, as shares of their gap less the virtual interval; where,
            joint by joint [rad].
        count: number of free points in a gap.
    """
    gaps, joints = len(points) - 1, len(points[0])
    h, shares, aside = x[: gaps + 2], x[gaps + 2 : gaps + 2 + gaps * count], x[gaps + 2 + gaps * count :]
    rough = cubic(points, h)
    through, parts = [points[0]], [h[0]]
    for gap in range(gaps):
        own, piece = shares[gap * count : (gap + 1) * count], rough[gap + 1]
        for k, share in enumerate(own):
            there = piece.at(share * piece.h)
            through.append([there[j][0] + aside[j * gaps * count + gap * count + k] for j in range(joints)])
        limits = [0.0, *own, 1.0]
        parts += [(limits[k + 1] - limits[k]) * piece.h for k in range(count + 1)]
        through.append(points[gap + 1])
    return cubic(through, [*parts, h[-1]])


def hermite(points: list[list[Any]], h: list[Any], travel: list[list[Any]]) -> list[Piece]:
    """The C1 cubic spline whose inner velocities are those of the C2 spline at rest at both ends, plus an offset.

    Args:
        points: K points, each a list of joints [rad].
        h: K - 1 durations [s].
        travel: of every joint and inner point, the offset times the mean of the two durations next to it [rad].
    """
    inner, joints, pieces = range(1, len(points) - 1), range(len(points[0])), []
    matrix = [[0.0] * len(inner) for _ in inner]
    sides = [[0.0] * len(inner) for _ in joints]
    for row, k in enumerate(inner):
        matrix[row][row] = 2.0 * (h[k - 1] + h[k])
        if row:
            matrix[row][row - 1] = h[k]
        if row + 1 < len(inner):
            matrix[row][row + 1] = h[k - 1]
        for j in joints:
            before, after = points[k][j] - points[k - 1][j], points[k + 1][j] - points[k][j]
            sides[j][row] = 3.0 * (h[k] * before / h[k - 1] + h[k - 1] * after / h[k])
    velocities = [
        [0.0, *(v + 2.0 * travel[j][i] / (h[i] + h[i + 1]) for i, v in enumerate(side)), 0.0]
        for j, side in enumerate(solved(matrix, sides))
    ]
    for k, step in enumerate(h):
        start = []
        for j in joints:
            v, w, mean = velocities[j][k], velocities[j][k + 1], (points[k + 1][j] - points[k][j]) / step
            jerk = (6.0 * (v + w) - 12.0 * mean) / step**2
            start.append((points[k][j], v, (6.0 * mean - 4.0 * v - 2.0 * w) / step, jerk))
        pieces.append(Piece(step, tuple(start)))
    return pieces


def shares_of_derivatives(
    pieces: list[Piece], velocity: list[float], acceleration: list[float], jerk: list[float], xp: Any
) -> list[list[Any]]:
    """Shares of limits, with signs, whose greatest magnitudes are those of every instant.

    A velocity is greatest where a piece begins or its acceleration is 0, an acceleration where a piece begins.

    Returns:
        Lists of shares of velocities, of accelerations and of jerks; each joint by joint of every piece.
    """
    of_velocity, of_acceleration, of_jerk = [], [], []
    for piece in pieces:
        for j, (_, v, a, jolt) in enumerate(piece.start):
            s = xp.fmin(xp.fmax(-a * jolt / (jolt * jolt + _TINY), 0.0), piece.h)
            of_velocity.append((v + s * (a + s * jolt / 2.0)) / velocity[j])
            of_acceleration.append((a + piece.h * jolt) / acceleration[j])
            of_jerk.append(jolt / jerk[j])
    return [of_velocity, of_acceleration, of_jerk]


@dataclass(frozen=True)
class TwoLinks:
    """Two links in a plane across gravity, with a point mass at the tip.

    Attributes:
        masses: of the links [kg].
        centres: distance of each centre of mass from its joint [m].
        inertias: about the centres of mass, across the plane [kg·m²].
        lengths: of the links [m].
        limits: greatest torques [N·m].
        payload: mass at the tip [kg].
    """

    masses: tuple[float, float]
    centres: tuple[float, float]
    inertias: tuple[float, float]
    lengths: tuple[float, float]
    limits: tuple[float, float]
    payload: float

    @classmethod
    def of(cls, urdf: Path, payload: float) -> TwoLinks:
        """The numbers of a URDF whose links lie along x and turn about z."""
        tree = ElementTree.parse(urdf).getroot()
        links = [link.find("inertial") for link in tree.iter("link") if link.find("inertial") is not None]
        joints = list(tree.iter("joint"))

        def of_links(tag: str, key: str) -> Any:
            return tuple(float(str(link.find(tag).get(key)).split()[0]) for link in links)

        return cls(
            of_links("mass", "value"),
            of_links("origin", "xyz"),
            of_links("inertia", "izz"),
            tuple(float(joint.find("origin").get("xyz").split()[0]) for joint in joints[1:]),
            tuple(float(joint.find("limit").get("effort")) for joint in joints[:2]),
            payload,
        )

    def torques(self, state: list[tuple[Any, Any, Any]], xp: Any) -> tuple[Any, Any]:
        """Torques for position, velocity and acceleration of both joints, by Lagrange's equations [N·m]."""
        (_, v1, a1), (q2, v2, a2) = state
        (m1, m2), (c1, c2), (i1, i2) = self.masses, self.centres, self.inertias
        (l1, l2), p = self.lengths, self.payload
        both = (m2 * c2 + p * l2) * l1
        outer = i2 + m2 * c2**2 + p * l2**2
        crossed = outer + both * xp.cos(q2)
        whole = i1 + m1 * c1**2 + (m2 + p) * l1**2 + crossed + both * xp.cos(q2)
        swing = both * xp.sin(q2)
        return (
            whole * a1 + crossed * a2 - swing * (2.0 * v1 * v2 + v2 * v2),
            crossed * a1 + outer * a2 + swing * v1 * v1,
        )

    def shares(self, pieces: list[Piece], samples: int, xp: Any) -> list[Any]:
        """Shares of the limits of torque, with signs, at the Gauss-Lobatto instants of every piece."""
        instants = lobatto_instants(samples)
        return [
            torque / limit
            for piece in pieces
            for u in instants
            for torque, limit in zip(self.torques(piece.at(u * piece.h), xp), self.limits, strict=True)
        ]


def lobatto_instants(count: int) -> list[float]:
    """Gauss-Lobatto nodes between 0 and 1, both ends included."""
    inner = np.polynomial.Legendre.basis(count - 1).deriv().roots()
    return [0.0, *(0.5 + 0.5 * np.sort(np.real(inner))).tolist(), 1.0]
