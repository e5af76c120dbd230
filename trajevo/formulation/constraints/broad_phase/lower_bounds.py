"""Lower bounds of the distances of a robot's solids to obstacles and to each other, for many states at once.

Links, and obstacles that move, are replaced by the balls of their covers, other obstacles are taken as they are. Where
two solids may overlap, the depth is bounded by the one ball around each link. Bounds only decide which distances are
computed exactly.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.formulation.constraints.broad_phase import loops
from trajevo.formulation.constraints.broad_phase.bodies import Bodies, Placed, PlacedByLoops
from trajevo.formulation.constraints.scenes.obstacles import (
    Box,
    Capsule,
    Cornered,
    Cylinder,
    Obstacle,
    Plane,
    Sphere,
)


@final
class LowerBounds:
    """Lower bounds of the distances of pairs of solids.

    Args:
        bodies: G solids, those of the robot and obstacles that move.
        obstacles: the obstacles of its scene that stand still.
        ends: first and second solid of every pair, shape (n_pairs, 2); obstacles are numbered from G on.

    Attributes:
        for_loops: all of this as :func:`loops.bounds` takes it.
    """

    def __init__(self, bodies: Bodies, obstacles: Sequence[Obstacle], ends: Array) -> None:
        self._radii, (self._first, second) = bodies.radii.T, ends.T
        self._obstacle = second - len(bodies.radii)  # below 0 for pairs of these solids
        self._second = np.where(self._obstacle < 0, second, 0)
        kinds = [_KINDS.index(_kind(obstacle)) for obstacle in obstacles]
        rows = np.array([_numbers(obstacle) for obstacle in obstacles]).reshape(-1, _SIZE)
        self._numbers = rows.T
        self._kind = np.array([*kinds, -1])[self._obstacle.clip(-1)]
        self.for_loops = bodies.carriers, bodies.centres, bodies.radii, ends, np.array(kinds, np.int64), rows

    def everywhere(self, centres: Array) -> Array:
        """Bounds by the one ball around each solid, of all pairs in all states, shape (n_pairs, N) [m].

        Args:
            centres: its centres in N states, shape (G, 3, N) [m].
        """
        bounds, radii = np.empty((len(self._first), centres.shape[2])), self._radii[0, :, None]
        for number, numbers in enumerate(self._numbers.T):
            pairs = np.flatnonzero(self._obstacle == number)
            if not len(pairs):  # a load need not stay away from it
                continue
            first = self._first[pairs]
            bounds[pairs] = _distance(self._kind[pairs[0]], numbers, np.moveaxis(centres[first], 1, 0)) - radii[first]
        pairs = np.flatnonzero(self._obstacle < 0)
        first, second = self._first[pairs], self._second[pairs]
        bounds[pairs] = _length(np.moveaxis(centres[first] - centres[second], 1, 0)) - radii[first] - radii[second]
        return bounds - loops.SLACK

    def of(self, placed: Placed | PlacedByLoops, state: Array, pair: Array) -> Array:
        """Bounds of some pairs in some states, shape (K,) [m].

        Args:
            placed: the solids in N states.
            state: indices of states, shape (K,).
            pair: indices of pairs, shape (K,).
        """
        bounds, kind = np.empty(len(pair)), self._kind[pair]
        if isinstance(placed, PlacedByLoops):
            loops.bounds(placed.frames, *self.for_loops, state, pair, bounds)
            return bounds
        centres, (_, blocks, axes, balls, size) = placed.balls.ravel(), placed.balls.shape
        offsets = (np.arange(axes * balls) * size).reshape(axes, balls, 1)
        block, place = np.divmod(state, size)
        place += block * (axes * balls * size)
        one_solid = blocks * axes * balls * size
        for each in range(-1, len(_KINDS)):
            chosen = np.flatnonzero(kind == each)
            if not len(chosen):
                continue
            where, pairs = place[chosen], pair[chosen]
            first = self._first[pairs]
            at, radii = centres.take(first * one_solid + where + offsets), self._radii[:, first]
            if each < 0:
                second = self._second[pairs]
                other = centres.take(second * one_solid + where + offsets)
                whole = _length(at[:, 0] - other[:, 0]) - radii[0] - self._radii[0, second]
                apart = _length(at[:, 1:, None] - other[:, None, 1:]) - radii[1:, None] - self._radii[1:, second]
                parts = apart.min(axis=(0, 1))
            else:
                apart = _distance(each, self._numbers[:, self._obstacle[pairs]], at) - radii
                whole, parts = apart[0], apart[1:].min(axis=0)
            # A solid that overlaps may be deeper than each of its parts, but not than the ball around it.
            bounds[chosen] = np.where(parts > 0.0, np.maximum(whole, parts), whole)
        return bounds - loops.SLACK


#: Kinds of obstacles, by their place in this list, as in :mod:`trajevo.formulation.constraints.broad_phase.loops`.
_KINDS: list[type[Obstacle]] = [Box, Cylinder, Sphere]


#: Number of numbers that tell where an obstacle is.
_SIZE = 15

#: Half the width, and half the depth, of the box that stands for what is behind a plane [m]: in the reach of any robot
#: it is as far away, but for rounding far below the slack of bounds.
_WIDE, _DEEP = 1e6, 1e3


def _kind(obstacle: Obstacle) -> type[Obstacle]:
    """The kind of solid that contains an obstacle here."""
    match obstacle:
        case Cornered():
            return Sphere
        case Capsule():
            return Cylinder
        case Plane():
            return Box
    return type(obstacle)


def _numbers(obstacle: Obstacle) -> list[float]:
    """What tells where an obstacle is: its rotation by rows, minus its position in its own frame, and its sizes."""
    middle = np.zeros(3)
    match obstacle:
        case Box():
            sizes = [0.5 * size for size in obstacle.size]
        case Cylinder():
            sizes = [obstacle.radius, 0.5 * obstacle.length, 0.0]
        case Sphere():
            sizes = [obstacle.radius, 0.0, 0.0]
        case Capsule():
            sizes = [obstacle.radius, 0.5 * obstacle.length + obstacle.radius, 0.0]
        case Plane():
            middle, sizes = np.array([0.0, 0.0, -_DEEP]), [_WIDE, _WIDE, _DEEP]
        case Cornered():  # the ball around it
            middle = obstacle.middle
            sizes = [float(np.linalg.norm(obstacle.corners - middle, axis=1).max()), 0.0, 0.0]
    rotation = obstacle.rotation
    if isinstance(obstacle, Plane):  # any of its points, so that the nearest one to the base
        at = rotation[:, 2] * float(rotation[:, 2] @ obstacle.position)
        return [*rotation.ravel().tolist(), *(-rotation.T @ at - middle).tolist(), *sizes]
    return [*rotation.ravel().tolist(), *(-rotation.T @ obstacle.position - middle).tolist(), *sizes]


def _distance(kind: int, numbers: Array, points: Array) -> Array:
    """Signed distances of points (3, ...) to obstacles of one kind, negative inside, shape (...) [m]."""
    a, b, c = numbers[12:15]
    x, y, z = (
        numbers[i] * points[0] + numbers[3 + i] * points[1] + numbers[6 + i] * points[2] + numbers[9 + i]
        for i in range(3)
    )
    if _KINDS[kind] is Sphere:
        away: Array = np.sqrt(x * x + y * y + z * z) - a
        return away
    beyond = [np.abs(x) - a, np.abs(y) - b, np.abs(z) - c]
    if _KINDS[kind] is Cylinder:
        beyond = [np.sqrt(x * x + y * y) - a, np.abs(z) - b]
    inside = np.minimum(np.maximum.reduce(beyond), 0.0)
    outside = [np.square(np.maximum(each, 0.0)) for each in beyond]
    signed: Array = np.sqrt(sum(outside[1:], outside[0])) + inside
    return signed


def _length(vectors: Array) -> Array:
    """Lengths of vectors (3, ...)."""
    x, y, z = vectors
    length: Array = np.sqrt(x * x + y * y + z * z)
    return length
