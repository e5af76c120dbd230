"""Velocities and accelerations from logged positions: splines by least squares, as smooth as the log asks for.

A quintic spline with even knots is fitted to every joint; generalised cross-validation (Craven and Wahba 1978) chooses
how many. Its derivatives are smooth and have no lag, and instants need not be evenly spaced.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError

_DEGREE = 5

#: Fewest samples between two knots, and how much each number of pieces exceeds the one before it.
_PER_PIECE, _LADDER = 4, 1.3


class Smoothed(NamedTuple):
    """A motion that was logged at T instants, as splines; made by :func:`smoothed`.

    Attributes:
        time: instants, shape (T,) [s].
        q: positions, shape (T, n_joints) [rad or m].
        v: velocities, the same shape [rad/s or m/s].
        a: accelerations, the same shape [rad/s² or m/s²].
        noise: standard deviation of what is left of the positions, shape (n_joints,) [rad or m].
        knots: knots of the spline of every joint.
        inner: whether a spline has knots on both sides of an instant, so that its derivatives are good, shape (T,).
    """

    time: Array
    q: Array
    v: Array
    a: Array
    noise: Array
    knots: tuple[Array, ...]
    inner: Array

    def error_drawn(self, generator: np.random.Generator) -> tuple[Array, Array, Array]:
        """What noise as large as that of the log leaves in positions, velocities and accelerations, drawn anew."""
        drawn = generator.normal(size=self.q.shape) * self.noise
        splines = [_fitted(self.time, drawn[:, k], knots) for k, knots in enumerate(self.knots)]
        q, v, a = (np.stack([spline(self.time, order) for spline in splines], axis=1) for order in range(3))
        return q, v, a


def smoothed(time: Array, position: Array) -> Smoothed:
    """Splines through logged positions.

    Args:
        time: ascending instants, shape (T,) [s].
        position: shape (T, n_joints) [rad or m].
    """
    found = [_chosen(time, column) for column in position.T]
    splines, noise, knots = zip(*found, strict=True)
    q, v, a = (np.stack([spline(time, order) for spline in splines], axis=1) for order in range(3))
    moved = np.ptp(position, axis=0)
    widest = next(one for one, far in zip(knots, moved, strict=True) if far == moved.max())
    inner = (time >= widest[_DEGREE + 1]) & (time <= widest[-_DEGREE - 2])
    return Smoothed(time, q, v, a, np.array(noise), knots, inner)


def _chosen(time: Array, values: Array) -> tuple[Any, float, Array]:
    """The spline of one joint by cross-validation, the standard deviation of what is left, and its knots."""
    count, least = len(time), np.inf
    best: tuple[Any, float, Array] | None = None
    for pieces in _pieces(count):
        knots = _knots(time, pieces)
        spline = _fitted(time, values, knots)
        free = count - (pieces + _DEGREE)
        left = float(((values - spline(time)) ** 2).sum())
        score = left / free**2
        if best is None or score < least:
            least, best = score, (spline, float(np.sqrt(left / free)), knots)
    if best is None:
        raise InvalidInputError(f"log: expected more instants than {count}")
    return best


def _pieces(count: int) -> list[int]:
    """Numbers of pieces that are tried for a log of so many instants."""
    most = max((count - _DEGREE) // _PER_PIECE, 1)
    tried, pieces = [], 1.0
    while pieces < most:
        tried.append(int(pieces))
        pieces = max(pieces * _LADDER, pieces + 1.0)
    return [*tried, most]


def _knots(time: Array, pieces: int) -> Array:
    """Knots between which as many samples lie everywhere."""
    inner = np.interp(np.linspace(0.0, len(time) - 1.0, pieces + 1)[1:-1], np.arange(len(time)), time)
    ends = np.full(_DEGREE + 1, time[0]), np.full(_DEGREE + 1, time[-1])
    return np.concatenate([ends[0], inner, ends[1]])


def _fitted(time: Array, values: Array, knots: Array) -> Any:
    from scipy.interpolate import make_lsq_spline  # takes 0.2 s to import

    return make_lsq_spline(time, values, knots, k=_DEGREE)
