"""Functions enclosed over thousands of boxes at once: value and slopes at the middle, second derivatives in the box.

Every number is an interval, a middle and a radius, and every operation widens the radius by more than its own rounding
can be. By Taylor's theorem a function lies, all over its box, between what its value and slopes at the middle and the
interval of its second derivatives allow; what is lost falls with the square of the width.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.verification.bounds.series import Series

#: Bound of the rounding of one operation, eight times that of the processor, and what underflow may lose.
ROUNDING, _UNDERFLOW = 2.0**-50, 1e-290

#: Bound of the error of a power or a root as a share of it, sixteen times the last bit.
_POWER = 2.0**-48

#: Middles and radii.
Ball = tuple[Array, Array]


@final
@dataclass(frozen=True, eq=False)
class Enclosed:
    """Arrays of functions of n variables over B boxes.

    Attributes:
        middle: middles of intervals, shape (1 + n + n (n + 1) / 2, B, ...): of the value and of the n slopes at the
            middle of the box, then of the second derivatives along :func:`pairs` of variables anywhere in the box.
        radius: radii, the same shape; not finite where nothing is known.
        reach: half widths of the boxes, shape (B, n); n is 0 where values at points alone are wanted.
    """

    middle: Array
    radius: Array
    reach: Array

    __repr__ = brief

    @classmethod
    def known(cls, values: Array, reach: Array) -> Enclosed:
        """Known values, shape (B, ...), that do not depend on the variables."""
        n = reach.shape[1]
        middle = np.zeros((1 + n + n * (n + 1) // 2, *values.shape))
        middle[0] = values
        return cls(middle, np.zeros_like(middle), reach)

    @classmethod
    def exponential(cls, exponents: Array, low: Array, high: Array) -> Enclosed:
        """The exponential of a linear form of the variables between the ends of boxes, which are (B, n).

        Args:
            exponents: of the n variables, exactly; shape (n,).
            low: least values of the variables.
            high: greatest values; where they are the least ones, values at points alone are wanted, without slopes.
        """
        n, centre = low.shape[1], 0.5 * (low + high)
        reach = np.maximum(high - centre, centre - low) * (1.0 + ROUNDING)
        middle = np.exp(centre @ exponents)
        # The rounding of the form, as a share of its exponential, is at most that of the sum of its terms.
        share = _POWER + (n + 4) * ROUNDING * (np.abs(centre) @ np.abs(exponents))
        factors = [1.0, *exponents.tolist(), *(exponents[k] * exponents[m] for k, m in pairs(n))]
        values = np.array(factors)[:, None] * middle
        wide = np.expm1(reach @ np.abs(exponents)) + share
        shares = np.where(np.arange(len(factors)) <= n, 0.0, 1.0)[:, None] * wide + share
        return cls(values, _wider(np.abs(values) * shares * (1.0 + _POWER), values), reach)

    @property
    def n(self) -> int:
        """Number of variables."""
        return int(self.reach.shape[1])

    @cached_property
    def over_box(self) -> Ball:
        """Middle and radius of the values in each box, shape (B, ...)."""
        return self.middle[0], self._spread(self._bound(self.middle[1:], self.radius[1:]), self.radius[0])

    @cached_property
    def slopes_over_box(self) -> Ball:
        """Middle and radius of the slopes in each box, shape (n, B, ...)."""
        n, size = self.n, self._bound(self.middle[1 + self.n :], self.radius[1 + self.n :])
        radius = self.radius[1 : 1 + n].copy()
        for (k, m), second in zip(pairs(n), size, strict=True):
            radius[k] += second * self._reach(m, second)
            if k != m:
                radius[m] += second * self._reach(k, second)
        middle = self.middle[1 : 1 + n]
        return middle, _wider(radius, middle)

    @property
    def low(self) -> Array:
        """Least values in each box, shape (B, ...)."""
        n, centre = self.n, self.middle[0] - self.radius[0]
        slope = self._bound(self.middle[1 : 1 + n], self.radius[1 : 1 + n])
        lost = np.zeros_like(centre)
        for (k, m), middle, radius in zip(pairs(n), self.middle[1 + n :], self.radius[1 + n :], strict=True):
            reach = self._reach(k, middle)
            if k != m:
                lost += (np.abs(middle) + radius) * (reach * self._reach(m, middle))
            else:
                lost += _fall(slope[k], middle - radius, reach)
        return np.asarray(centre - lost * (1.0 + 2.0**-44) - ROUNDING * np.abs(self.middle[0]) - _UNDERFLOW)

    def __getitem__(self, index: Any) -> Enclosed:
        """Entries of all boxes, by an index that follows the axis of the boxes."""
        where = (slice(None), slice(None), *(index if isinstance(index, tuple) else (index,)))
        return Enclosed(self.middle[where], self.radius[where], self.reach)

    def __neg__(self) -> Enclosed:
        return Enclosed(-self.middle, self.radius, self.reach)

    def __add__(self, other: Enclosed) -> Enclosed:
        middle = self.middle + other.middle
        return Enclosed(middle, _wider(self.radius + other.radius, middle), self.reach)

    def __sub__(self, other: Enclosed) -> Enclosed:
        return self + (-other)

    def __mul__(self, other: Enclosed) -> Enclosed:
        n = self.n
        one, two = (self.middle[0], self.radius[0]), (other.middle[0], other.radius[0])
        value = _product(*one, *two)
        parts = [(value[0][None], value[1][None])]
        if n:
            left, right = ((x.middle[1 : 1 + n], x.radius[1 : 1 + n]) for x in (self, other))
            parts.append(_sum(_product(*one, *right), _product(*left, *two)))
            bend, other_bend = ((x.middle[1 + n :], x.radius[1 + n :]) for x in (self, other))
            outer = _sum(_product(*self.over_box, *other_bend), _product(*bend, *other.over_box))
            parts.append(_sum(outer, _crossed(self.slopes_over_box, other.slopes_over_box, 1.0)))
        return self._of(parts)

    def times(self, factor: Array | float) -> Enclosed:
        """Times known numbers, whose shape fits (B, ...)."""
        middle, size = self.middle * factor, np.abs(factor)
        return Enclosed(middle, _wider(self.radius * size, middle), self.reach)

    def to_power(self, exponent: float) -> Enclosed:
        """Positive entries to a power; not known where an entry may be 0 or less."""
        n = self.n
        centre = _power(self.middle[0], self.radius[0], exponent)
        steep = _power(self.middle[0], self.radius[0], exponent - 1.0, exponent)
        parts = [(centre[0][None], centre[1][None])]
        if n:
            parts.append(_product(*steep, self.middle[1 : 1 + n], self.radius[1 : 1 + n]))
            slope = _power(*self.over_box, exponent - 1.0, exponent)
            bend = _power(*self.over_box, exponent - 2.0, exponent * (exponent - 1.0))
            own = _product(*slope, self.middle[1 + n :], self.radius[1 + n :])
            crossed = _crossed(self.slopes_over_box, self.slopes_over_box, 0.5)
            parts.append(_sum(own, _product(*bend, *crossed)))
        return self._of(parts)

    def through(self, matrix: Array) -> Enclosed:
        """The last axis mapped by a known matrix (m, k), accurate to a few roundings: (..., k) -> (..., m)."""
        sized, rounding = np.abs(matrix).T, (matrix.shape[1] + 4) * ROUNDING
        middle = self.middle @ matrix.T
        radius = (self.radius + rounding * np.abs(self.middle)) @ sized
        return Enclosed(middle, _wider(radius, middle), self.reach)

    def weighed(self, weights: Array) -> Enclosed:
        """The last axis summed with weights of the same shape (B, ..., k), accurate to a few roundings."""
        rounding = (weights.shape[-1] + 4) * ROUNDING
        middle = (self.middle * weights).sum(axis=-1)
        radius = ((self.radius + rounding * np.abs(self.middle)) * np.abs(weights)).sum(axis=-1)
        return Enclosed(middle, _wider(radius, middle), self.reach)

    def summed(self) -> Enclosed:
        """The sum along the last axis."""
        rounding = self.middle.shape[-1] * ROUNDING
        radius = (self.radius + rounding * np.abs(self.middle)).sum(axis=-1)
        middle = self.middle.sum(axis=-1)
        return Enclosed(middle, _wider(radius, middle), self.reach)

    def shaped(self, *axes: int) -> Enclosed:
        """With new axes of length 1 at these places, counted from the last one."""
        return Enclosed(np.expand_dims(self.middle, axes), np.expand_dims(self.radius, axes), self.reach)

    @property
    def influence(self) -> Array:
        """Share of a positive value by which each variable changes it in its cell, shape (B, ..., n)."""
        middle, radius = self.slopes_over_box
        shares = [
            (np.abs(middle[k]) + radius[k]) * self._reach(k, radius[k]) / np.abs(self.middle[0]) for k in range(self.n)
        ]
        return np.stack(shares, axis=-1)

    def swapped(self) -> Enclosed:
        """With the last two axes swapped."""
        return Enclosed(np.swapaxes(self.middle, -1, -2), np.swapaxes(self.radius, -1, -2), self.reach)

    def picked(self, rows: Array, best: Array) -> Enclosed:
        """One entry of each box, by its place among all of them."""
        middle, radius = (part.reshape(len(part), len(rows), -1)[:, rows, best] for part in (self.middle, self.radius))
        return Enclosed(middle, radius, self.reach)

    @classmethod
    def stacked(cls, parts: Sequence[Enclosed], axis: int) -> Enclosed:
        """Entries of the same shape along a new axis, counted from the last."""
        middles, radii = ([getattr(part, name) for part in parts] for name in ("middle", "radius"))
        return cls(np.stack(middles, axis=axis), np.stack(radii, axis=axis), parts[0].reach)

    @classmethod
    def joined(cls, parts: Sequence[Enclosed], axis: int) -> Enclosed:
        """Entries one after the other along an axis, counted from the last."""
        middles, radii = ([getattr(part, name) for part in parts] for name in ("middle", "radius"))
        return cls(np.concatenate(middles, axis=axis), np.concatenate(radii, axis=axis), parts[0].reach)

    def _of(self, parts: Sequence[Ball]) -> Enclosed:
        """Value, slopes and second derivatives put together."""
        return Enclosed(np.concatenate([p[0] for p in parts]), np.concatenate([p[1] for p in parts]), self.reach)

    def _reach(self, k: int, like: Array) -> Array:
        return self.reach[:, k].reshape(-1, *[1] * (like.ndim - 1))

    @staticmethod
    def _bound(middle: Array, radius: Array) -> Array:
        return np.abs(middle) + radius

    def _spread(self, size: Array, own: Array) -> Array:
        """How far values lie from the middle at most, from bounds of slopes and second derivatives."""
        n = self.n
        radius = own.copy()
        for k in range(n):
            radius += size[k] * self._reach(k, size[k])
        for (k, m), second in zip(pairs(n), size[n:], strict=True):
            share = 0.5 if k == m else 1.0
            radius += share * second * (self._reach(k, second) * self._reach(m, second))
        return _wider(radius, self.middle[0])


#: Either kind of enclosed functions, whose operations have the same names.
Function = TypeVar("Function", Enclosed, Series)


def pairs(n: int) -> Iterator[tuple[int, int]]:
    """Pairs of n variables along which second derivatives are stored, in their order."""
    return ((k, m) for k in range(n) for m in range(k, n))


def stacked(parts: Sequence[Function], axis: int = -1) -> Function:
    """Entries of the same shape along a new axis, counted from the last."""
    return type(parts[0]).stacked(parts, axis)


def joined(parts: Sequence[Function], axis: int) -> Function:
    """Entries one after the other along an axis, counted from the last."""
    return type(parts[0]).joined(parts, axis)


def _crossed(a: Ball, b: Ball, factor: float) -> Ball:
    """a_k b_m + a_m b_k for all pairs of variables, times a factor."""
    n = len(a[0])
    found = [
        _sum(_product(a[0][k], a[1][k], b[0][m], b[1][m]), _product(a[0][m], a[1][m], b[0][k], b[1][k]))
        for k, m in pairs(n)
    ]
    middle, radius = np.stack([f[0] for f in found]), np.stack([f[1] for f in found])
    return factor * middle, factor * radius


def _fall(slope: Array, bend: Array, reach: Array) -> Array:
    """How far a slope s and second derivatives from ``bend`` on let a value fall: max |s| d - bend d² / 2."""
    with np.errstate(divide="ignore", invalid="ignore"):
        where = np.where(bend > 0.0, np.minimum(reach, slope / bend), reach)
    return np.asarray(where * (slope - 0.5 * bend * where))


def _product(a: Array, wide: Array, b: Array, unsure: Array) -> Ball:
    middle = a * b
    return middle, _wider(np.abs(a) * unsure + wide * (np.abs(b) + unsure), middle)


def _sum(a: Ball, b: Ball) -> Ball:
    middle = a[0] + b[0]
    return middle, _wider(a[1] + b[1], middle)


def _wider(radius: Array, middle: Array) -> Array:
    """A radius and the rounding of the operations that made it and its middle."""
    return radius * (1.0 + ROUNDING) + (ROUNDING * np.abs(middle) + _UNDERFLOW)


def _power(middle: Array, radius: Array, exponent: float, factor: float = 1.0) -> Ball:
    """A factor times the powers of intervals; not known where one reaches 0."""
    low, high = middle - radius * (1.0 + ROUNDING), middle + radius * (1.0 + ROUNDING)
    safe = low > 0.0
    ends = np.where(safe, low, np.nan) ** exponent, np.where(safe, high, np.nan) ** exponent
    between, half = 0.5 * (ends[0] + ends[1]), 0.5 * np.abs(ends[1] - ends[0])
    return factor * between, abs(factor) * (half + _POWER * np.abs(between)) * (1.0 + _POWER) + _UNDERFLOW
