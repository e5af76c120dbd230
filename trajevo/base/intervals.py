"""Quantities that are known only to lie in intervals, and the greatest value of a quadratic over a box."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np

from trajevo.base.arrays import Array, numbers
from trajevo.errors import InvalidInputError

#: Marks a coordinate that is free on a face of the box; 0 and 1 mark one at its lower or upper end.
_FREE = 2


def interval(given: Any, name: str, shape: tuple[int, ...] = (2,)) -> Array:
    """The checked ends of intervals that a caller passed.

    Args:
        given: least and greatest values.
        name: name of the argument, for the message.
        shape: the expected shape, with the ends along the first axis.

    Raises:
        InvalidInputError: another shape, numbers that are not finite, or a least value above the greatest.
    """
    ends = numbers(given, name=name, shape=shape)
    if (ends[0] > ends[1]).any():
        raise InvalidInputError(f"{name}: expected the least before the greatest, got {ends.tolist()}")
    return ends


def mass_interval(given: Any) -> tuple[float, float]:
    """Least and greatest mass [kg] that a caller passed as ``mass``.

    Raises:
        InvalidInputError: not two numbers, a negative number, or a least mass above the greatest.
    """
    low, high = interval(given, "mass").tolist()
    if low < 0.0:
        raise InvalidInputError(f"mass: expected masses from 0 on [kg], got {[low, high]}")
    return low, high


def greatest_quadratic(a: Array, b: Array, Q: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """Exact greatest value of a + b·u + uᵀ Q u over a box, and where it is attained.

    A coordinate whose slope keeps its sign all over the box is at one of its ends. If this holds for all coordinates,
    the vertex is known at once. Otherwise the greatest value lies at a vertex, or at a stationary point of an edge, a
    face or the inside whose free coordinates have negative curvature; all of these points are tried. The result of a
    row does not depend on the other rows, to the last bit.

    Args:
        a: shape (R,).
        b: shape (R, D).
        Q: symmetric, shape (R, D, D).
        low: least coordinates, shape (D,).
        high: greatest coordinates, shape (D,).

    Returns:
        Values (R,) and the points u (R, D). For complex forms the real parts determine the point, and the value there
        is complex: its imaginary part is the derivative of the greatest value, since the shift of the point does not
        change that value to first order.
    """
    real_b, real_Q = np.real(b), np.real(Q)
    middle, reach = 0.5 * (low + high), high - low
    slope = real_b + 2.0 * _product(real_Q, np.broadcast_to(middle, real_b.shape))
    turns = np.abs(slope) < _product(np.abs(real_Q), np.broadcast_to(reach, real_b.shape))
    where = np.where(slope > 0.0, high, low)
    rest = np.flatnonzero(turns.any(axis=1))
    if len(rest):
        curved = turns[rest] & (np.diagonal(real_Q[rest], axis1=1, axis2=2) < 0.0)
        where[rest] = _best_of_faces(real_b[rest], real_Q[rest], low, high, curved)
    return a + _without_constant(b, Q, where), where


def _best_of_faces(b: Array, Q: Array, low: Array, high: Array, curved: Array) -> Array:
    """Where the forms are greatest, shape (R, D); ``curved`` says which coordinates may be free there."""
    best, where = np.full(len(b), -np.inf), np.zeros(b.shape)
    for face in product((0, 1, _FREE), repeat=len(low)):
        free = np.flatnonzero(np.equal(face, _FREE))
        rows = np.flatnonzero(curved[:, free].all(axis=1))
        place = np.broadcast_to(np.where(np.equal(face, 1), high, low), (len(rows), len(low))).copy()
        if len(free) and len(rows):
            place[:, free] = 0.0
            slope = (b[rows] + 2.0 * _product(Q[rows], place))[:, free]
            inverse = np.linalg.pinv(2.0 * Q[rows][:, free][:, :, free], hermitian=True)
            place[:, free] = -_product(inverse, slope)
        value = _without_constant(b[rows], Q[rows], place)
        better = (value > best[rows]) & (place >= low).all(axis=1) & (place <= high).all(axis=1)
        best[rows[better]], where[rows[better]] = value[better], place[better]
    return where


def _without_constant(b: Array, Q: Array, place: Array) -> Array:
    slope = b + _product(Q, place)
    total = np.zeros(len(b), dtype=slope.dtype)
    for i in range(place.shape[1]):
        total = total + slope[:, i] * place[:, i]
    return total


def _product(matrices: Array, vectors: Array) -> Array:
    """Matrices (R, D, D) times vectors (R, D), always summed in the same order, whatever the number of rows."""
    total = np.zeros(vectors.shape, dtype=matrices.dtype)
    for j in range(vectors.shape[1]):
        total = total + matrices[:, :, j] * vectors[:, j, None]
    return total
