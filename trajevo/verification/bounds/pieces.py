"""Segment times of boxes of ratios, and the pieces of motions over them.

The variables of a box are the logarithms of the ratios of neighbouring segment times, and the first one's time is 1.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol, cast, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.verification.bounds.enclosed import Enclosed, stacked
from trajevo.verification.bounds.series import Series


@final
@dataclass(frozen=True, eq=False)
class Times:
    """Segment times of B boxes, from the logarithms of the ratios of neighbouring ones.

    Attributes:
        low: least logarithms, shape (B, n_segments - 1).
        high: greatest logarithms, the same shape.
        points: whether the boxes are points, of which values alone are wanted, without slopes.
        degree: if given, functions of the times are :class:`Series` of this degree, which have the same operations.
    """

    low: Array
    high: Array
    points: bool = False
    degree: int | None = None

    __repr__ = brief

    @property
    def segments(self) -> int:
        """Number of segments."""
        return int(self.low.shape[1]) + 1

    def __len__(self) -> int:
        return len(self.low)

    @property
    def middles(self) -> Times:
        """The middles of the boxes, as points."""
        middle = 0.5 * (self.low + self.high)
        return Times(middle, middle, points=True)

    def product(self, powers: Mapping[int, float]) -> Enclosed:
        """The product of powers of segment times, (B,), by the number of the segment."""
        exponents = np.zeros(self.segments)
        for segment, power in powers.items():
            exponents[segment] += power
        own = np.cumsum(exponents[::-1])[::-1][1:]
        if self.degree is not None:
            return cast(Enclosed, Series.exponential(own, self.low, self.high, self.degree))
        if not self.points:
            return Enclosed.exponential(own, self.low, self.high)
        nothing = np.zeros((len(self), 0))
        found = Enclosed.exponential(own, self.low, self.high)
        return Enclosed(found.middle[:1], found.radius[:1], nothing)

    def known(self, values: Any) -> Enclosed:
        """The same known values in all boxes, of any shape (...)."""
        if self.degree is not None:
            full = np.broadcast_to(np.asarray(values, dtype=np.float64), (len(self), *np.shape(values)))
            return cast(Enclosed, Series.known(full, self.low.shape[1], self.degree))
        reach = np.zeros((len(self), 0 if self.points else self.segments - 1))
        if not self.points:
            reach = self.product({}).reach
        return Enclosed.known(
            np.broadcast_to(np.asarray(values, dtype=np.float64), (len(self), *np.shape(values))), reach
        )

    @cached_property
    def total(self) -> Enclosed:
        """The sum of all segment times, (B,)."""
        return stacked([self.product({k: 1.0}) for k in range(self.segments)]).summed()

    def share_of_others(self, segment: int) -> Enclosed:
        """The sum of all segment times divided by one of them, (B,)."""
        return stacked(
            [self.product({k: 1.0, segment: -1.0} if k != segment else {}) for k in range(self.segments)]
        ).summed()


@final
@dataclass(frozen=True, eq=False)
class Apart:
    """How far motions through the same points, at rest at both ends, can be from pieces that are near them.

    The difference e and its derivatives up to r - 1 are 0 at both ends, so that its derivatives 1 to r - 1 are, over
    one period T, continuous with the mean 0. By their Fourier series (Wirtinger) a root mean square is at most T / 2π
    times that of the next derivative, and a greatest value at most √(2 ζ(2m)) (T / 2π)ᵐ times the root mean square
    that is m derivatives above. Of degree r - 1 in each segment, the last one is at most r times as great there as
    its root mean square in that segment.

    Attributes:
        order: the derivative r of which the root mean square is bounded.
        rms: bounds of it, (B, n_joints), in a unit of time that is the duration.
    """

    order: int
    rms: Array

    def rms_of(self, derivative: int) -> Array:
        """Bounds of the root mean square of a derivative from 1 to r, (B, n_joints)."""
        return np.asarray(self.rms * (2.0 * np.pi) ** (derivative - self.order) * _ROUNDED)

    def greatest_of(self, derivative: int, shares: Array) -> Array:
        """Bounds of a derivative from 0 to r anywhere in segments whose shares are at least these (B, S), (B, S, J)."""
        if derivative == self.order:
            return np.asarray(self.order / np.sqrt(shares)[..., None] * self.rms[:, None] * _ROUNDED)
        steps = self.order - max(derivative, 1)
        factor = np.sqrt(2.0 * _ZETA[2 * steps]) / (2.0 * np.pi) ** steps * (0.5 if derivative == 0 else 1.0)
        return np.asarray(np.broadcast_to(factor * self.rms[:, None] * _ROUNDED, (*shares.shape, self.rms.shape[1])))


#: Riemann's ζ at even numbers, and more than a few roundings.
_ZETA, _ROUNDED = {2: np.pi**2 / 6.0, 4: np.pi**4 / 90.0, 6: np.pi**6 / 945.0}, 1.0 + 1e-12


@final
@dataclass(frozen=True, eq=False)
class ShapePieces:
    """Polynomial pieces of motions, each in its own unit of time.

    Attributes:
        coefficients: ascending powers of the share of the piece, shape (B, S, n_joints, degree + 1) [rad or m].
        rates: inverse durations of the pieces, shape (B, S), in the shape's unit of time.
        apart: how far motions of the interpolant can be from these pieces, if they are only near it.
        states: what the coefficients are made of, if they are (B, S, n_joints, k).
        hermite: the matrix that makes coefficients of states, (degree + 1, k); maps of both together lose less.
    """

    coefficients: Enclosed
    rates: Enclosed
    apart: Apart | None = None
    states: Enclosed | None = None
    hermite: Array | None = None

    def through(self, matrix: Array) -> Enclosed:
        """The coefficients mapped by a known matrix."""
        if self.states is None or self.hermite is None:
            return self.coefficients.through(matrix)
        return self.states.through(matrix @ self.hermite)

    def weighed(self, weights: Array) -> Enclosed:
        """The coefficients summed with weights."""
        if self.states is None or self.hermite is None:
            return self.coefficients.weighed(weights)
        return self.states.weighed(weights @ self.hermite)

    __repr__ = brief


class EnclosedShape(Protocol):
    """The pieces of an interpolant as a function of segment times."""

    @property
    def degree(self) -> int | None:
        """Degree of series of its coefficients; None for enclosures of second order."""
        ...

    @property
    def widest(self) -> float:
        """Greatest half width of a box, as a logarithm, of which enclosures tell anything."""
        ...

    def __call__(self, times: Times) -> ShapePieces:
        """The pieces over boxes of segment times."""
        ...
