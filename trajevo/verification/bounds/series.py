"""Functions enclosed over thousands of boxes at once: a polynomial of the place in the box, and a bound of the rest.

These are Taylor models (Makino, K., Berz, M. (2003): Taylor models and other validated functional inclusion methods,
International Journal of Pure and Applied Mathematics 4, 379-456). Variables run from -1 to 1 over the box, so that no
coefficient changes a value by more than its own size. Terms that cancel at the middle of the box cancel in the
polynomial too, which intervals of derivatives cannot tell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import combinations_with_replacement
from math import factorial, prod
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief

#: Bound of the rounding of one operation with all its terms, as a share of the sum of their sizes.
_ROUNDING, _UNDERFLOW = 2.0**-44, 1e-290


@final
@dataclass(frozen=True, eq=False)
class Series:
    """Arrays of functions of n variables over B boxes.

    Attributes:
        terms: coefficients of the products :func:`monomials` of the n variables, each from -1 to 1, (M, B, ...).
        rest: how far the function can be from the polynomial anywhere in the box, (B, ...); not finite if unknown.
        n: number of variables.
        degree: greatest degree of a product.
    """

    terms: Array
    rest: Array
    n: int
    degree: int

    __repr__ = brief

    @classmethod
    def known(cls, values: Array, n: int, degree: int) -> Series:
        """Known values, shape (B, ...), that do not depend on the variables."""
        terms = np.zeros((len(monomials(n, degree)), *values.shape))
        terms[0] = values
        return cls(terms, np.zeros(values.shape), n, degree)

    @classmethod
    def exponential(cls, exponents: Array, low: Array, high: Array, degree: int) -> Series:
        """The exponential of a linear form of variables between the ends (B, n) of boxes; exponents (n,) are exact."""
        n, centre = low.shape[1], 0.5 * (low + high)
        reach = np.maximum(high - centre, centre - low) * (1.0 + 2.0**-50)
        middle = np.exp(centre @ exponents)
        steps = (reach * exponents).T
        terms = np.stack(
            [
                middle * prod((steps[k] ** power / factorial(power) for k, power in enumerate(row) if power), start=1.0)
                for row in monomials(n, degree)
            ]
        )
        size = np.abs(steps).sum(axis=0)
        beyond = size ** (degree + 1) / factorial(degree + 1) * np.exp(size)
        share = _ROUNDING * (1.0 + np.abs(centre) @ np.abs(exponents)) * np.exp(size)
        return cls(terms, middle * (beyond * (1.0 + 1e-9) + share) + _UNDERFLOW, n, degree)

    def _of(self, terms: Array, rest: Array) -> Series:
        return Series(terms, rest, self.n, self.degree)

    @property
    def middle(self) -> Array:
        """Coefficients; the first ones are values at the middle of boxes."""
        return self.terms

    @cached_property
    def sizes(self) -> Array:
        """Sums of the sizes of coefficients of each degree, (degree + 1, B, ...)."""
        return np.stack([np.abs(self.terms[rows]).sum(axis=0) for rows in _by_degree(self.n, self.degree)])

    @property
    def most(self) -> Array:
        """Bounds of the size anywhere in the box, (B, ...)."""
        return np.asarray((self.sizes.sum(axis=0) + self.rest) * (1.0 + _ROUNDING))

    @property
    def over_box(self) -> tuple[Array, Array]:
        """Middle and radius of the values in each box, (B, ...)."""
        return self.terms[0], (self.sizes[1:].sum(axis=0) + self.rest) * (1.0 + _ROUNDING) + _UNDERFLOW

    @property
    def low(self) -> Array:
        """Least values in each box, (B, ...)."""
        n, found = self.n, self.terms[0] - self.rest
        taken = {0}
        for k, (first, second) in enumerate(_squares(n)):
            slope, bend = np.abs(self.terms[1 + k]), self.terms[second]
            with np.errstate(divide="ignore", invalid="ignore"):
                where = np.where(bend > 0.0, np.minimum(1.0, 0.5 * slope / bend), 1.0)
            found = found - where * (slope - bend * where)
            taken |= {first, second}
        others = [row for row in range(len(self.terms)) if row not in taken]
        size = self.sizes.sum(axis=0)
        return np.asarray(found - np.abs(self.terms[others]).sum(axis=0) - _ROUNDING * size - _UNDERFLOW)

    @property
    def influence(self) -> Array:
        """Share of a positive value by which each variable changes it in its cell, about, (B, ..., n)."""
        found = []
        for k in range(self.n):
            rows = [at for at, row in enumerate(monomials(self.n, self.degree)) if row[k]]
            found.append((np.abs(self.terms[rows]).sum(axis=0) + self.rest) / np.abs(self.terms[0]))
        return np.stack(found, axis=-1)

    def __getitem__(self, index: Any) -> Series:
        own = index if isinstance(index, tuple) else (index,)
        return self._of(self.terms[(slice(None), slice(None), *own)], self.rest[(slice(None), *own)])

    def __neg__(self) -> Series:
        return self._of(-self.terms, self.rest)

    def __add__(self, other: Series) -> Series:
        size = self.sizes.sum(axis=0) + other.sizes.sum(axis=0)
        return self._of(self.terms + other.terms, _wider(self.rest + other.rest, size))

    def __sub__(self, other: Series) -> Series:
        return self + (-other)

    def __mul__(self, other: Series) -> Series:
        a, b = self.terms, other.terms
        terms = np.stack([sum(a[i] * b[j] for i, j in pairs) for pairs in _products(self.n, self.degree)])
        A, B = self.sizes, other.sizes
        whole = [one.sum(axis=0) for one in (A, B)]
        rest = whole[0] * other.rest + self.rest * (whole[1] + other.rest)
        for degree in range(1, self.degree + 1):  # products that are of too high a degree
            rest = rest + A[degree] * B[self.degree + 1 - degree :].sum(axis=0)
        return self._of(terms, _wider(rest, whole[0] * whole[1]))

    def times(self, factor: Array | float) -> Series:
        """Times known numbers, whose shape fits (B, ...)."""
        return self._of(
            self.terms * factor, _wider(self.rest * np.abs(factor), self.sizes.sum(axis=0) * np.abs(factor))
        )

    def to_power(self, exponent: float) -> Series:
        """Positive entries to a power; not known where an entry may be 0 or less."""
        middle = np.where(self.terms[0] > 0.0, self.terms[0], np.nan)
        one = self._of(self.terms / middle, self.rest / middle + _ROUNDING * self.sizes.sum(axis=0) / middle)
        terms = one.terms.copy()
        terms[0] = 0.0
        step = self._of(terms, one.rest)
        size = step.most
        size = np.where(size < 1.0, size, np.nan)
        factor, found = 1.0, Series.known(np.ones_like(middle), self.n, self.degree)
        power = found
        for k in range(1, self.degree + 1):
            factor *= (exponent - k + 1.0) / k
            power = power * step if k > 1 else step
            found = found + power.times(factor)
        factor *= (exponent - self.degree) / (self.degree + 1.0)
        steep = np.maximum(
            (1.0 - size) ** (exponent - self.degree - 1.0), (1.0 + size) ** (exponent - self.degree - 1.0)
        )
        beyond = abs(factor) * size ** (self.degree + 1) * steep * (1.0 + 1e-9)
        found = self._of(found.terms, found.rest + beyond)
        return found.times(middle**exponent)

    def through(self, matrix: Array) -> Series:
        """The last axis mapped by a known matrix (m, k): (..., k) -> (..., m)."""
        size = np.abs(matrix).T
        return self._of(self.terms @ matrix.T, _wider(self.rest @ size, self.sizes.sum(axis=0) @ size))

    def weighed(self, weights: Array) -> Series:
        """The last axis summed with weights of the same shape (B, ..., k)."""
        size = np.abs(weights)
        rest = _wider((self.rest * size).sum(axis=-1), (self.sizes.sum(axis=0) * size).sum(axis=-1))
        return self._of((self.terms * weights).sum(axis=-1), rest)

    def summed(self) -> Series:
        """The sum along the last axis."""
        rest = _wider(self.rest.sum(axis=-1), self.sizes.sum(axis=0).sum(axis=-1))
        return self._of(self.terms.sum(axis=-1), rest)

    def swapped(self) -> Series:
        """With the last two axes swapped."""
        return self._of(np.swapaxes(self.terms, -1, -2), np.swapaxes(self.rest, -1, -2))

    def shaped(self, *axes: int) -> Series:
        """With new axes of length 1 at these places, counted from the last one."""
        return self._of(np.expand_dims(self.terms, axes), np.expand_dims(self.rest, axes))

    def widened(self, by: Array) -> Series:
        """With a greater rest."""
        return self._of(self.terms, self.rest + by)

    def picked(self, rows: Array, best: Array) -> Series:
        """One entry of each box, by its place among all of them."""
        flat = self.terms.reshape(*self.terms.shape[:2], -1), self.rest.reshape(len(self.rest), -1)
        return self._of(flat[0][:, rows, best], flat[1][rows, best])

    @property
    def polynomial(self) -> Series:
        """The polynomial alone, another function that is near this one."""
        return self._of(self.terms, np.zeros_like(self.rest))

    @classmethod
    def stacked(cls, parts: Sequence[Series], axis: int) -> Series:
        """Entries of the same shape along a new axis, counted from the last."""
        terms, rests = [one.terms for one in parts], [one.rest for one in parts]
        return parts[0]._of(np.stack(terms, axis=axis), np.stack(rests, axis=axis))

    @classmethod
    def joined(cls, parts: Sequence[Series], axis: int) -> Series:
        """Entries one after the other along an axis, counted from the last."""
        terms, rests = [one.terms for one in parts], [one.rest for one in parts]
        return parts[0]._of(np.concatenate(terms, axis=axis), np.concatenate(rests, axis=axis))


def near_solution(matrix: Any, drive: Any) -> Any:
    """A polynomial near the solution of linear systems (B, m, m) for drives (B, m, k); nothing is proven of it.

    Both are :class:`Series`.
    """
    A, b = matrix.terms, drive.terms
    try:
        inverse = np.linalg.inv(A[0])
    except np.linalg.LinAlgError:  # of cells far out of all that is wanted
        inverse = np.full_like(A[0], np.nan)
    found = np.zeros_like(b)
    for at, pairs in enumerate(_products(matrix.n, matrix.degree)):
        load = b[at] - sum((A[i] @ found[j] for i, j in pairs if i > 0), start=np.zeros_like(b[0]))
        found[at] = inverse @ load
    return drive._of(found, np.zeros_like(drive.rest))


@cache
def monomials(n: int, degree: int) -> tuple[tuple[int, ...], ...]:
    """Powers of the n variables in each product, by degree."""
    found = []
    for size in range(degree + 1):
        for chosen in combinations_with_replacement(range(n), size):
            found.append(tuple(chosen.count(k) for k in range(n)))
    return tuple(found)


@cache
def _by_degree(n: int, degree: int) -> tuple[slice, ...]:
    """Which terms are of each degree."""
    sums = [sum(row) for row in monomials(n, degree)]
    return tuple(slice(sums.index(size), sums.index(size) + sums.count(size)) for size in range(degree + 1))


@cache
def _products(n: int, degree: int) -> tuple[tuple[tuple[int, int], ...], ...]:
    """For each term the pairs of terms whose product it is."""
    rows = monomials(n, degree)
    found: dict[tuple[int, ...], list[tuple[int, int]]] = {row: [] for row in rows}
    for i, one in enumerate(rows):
        for j, other in enumerate(rows):
            both = tuple(a + b for a, b in zip(one, other, strict=True))
            if both in found:
                found[both].append((i, j))
    return tuple(tuple(found[row]) for row in rows)


@cache
def _squares(n: int) -> tuple[tuple[int, int], ...]:
    """Where each variable and its square stand."""
    rows = monomials(n, 2)
    return tuple((1 + k, rows.index(tuple(2 if m == k else 0 for m in range(n)))) for k in range(n))


def _wider(rest: Array, size: Array) -> Array:
    return np.asarray(rest * (1.0 + _ROUNDING) + (_ROUNDING * size + _UNDERFLOW))
