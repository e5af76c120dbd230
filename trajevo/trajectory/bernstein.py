"""Guaranteed bounds of polynomials that are given by their values: the Bernstein form with adaptive subdivision.

A polynomial lies between the least and the greatest of its Bernstein coefficients. When its interval is cut, this gap
shrinks with the square of the width. Only pieces whose coefficients exceed the greatest value found are cut further.

Complex values are real ones with a complex step in a parameter: decisions use the real parts alone, and a result's
imaginary part is taken at the extreme, so that it is the exact derivative.
"""

from __future__ import annotations

from functools import cache
from math import comb, lcm
from typing import Any

import numpy as np

from trajevo.base.arrays import Array, frozen, row_products
from trajevo.errors import InvalidInputError

#: Pieces that a piece is cut into; a whole polynomial is first cut into halves.
_PIECES = 4
#: Most cuts in a row. A cut brings the coefficients 16 times nearer to the polynomial, so that no tolerance above
#: :func:`least_tolerance` needs this many.
_MOST_CUTS = 24
#: Least ratio of a tolerance to the rounding error, so that cutting ends.
_ABOVE_ROUNDING = 4.0
#: Longest step of Newton's method, as a share of the interval.
_LONGEST_STEP = 0.05


@cache
def gauss(count: int) -> tuple[Array, Array]:
    """Gauss-Legendre nodes on [0, 1] and weights of sum 1; exact for polynomials of degree 2 count - 1."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return frozen(0.5 * (nodes + 1.0)), frozen(0.5 * weights)


def least_tolerance(size: int) -> float:
    """Least tolerance to which bounds of polynomials of degree below ``size`` can be proven in floating point."""
    return max(1e-8, _ABOVE_ROUNDING * _first_cut(size)[1])


def greatest_magnitude(values: Array, tolerance: float) -> Array:
    """Upper bound of the magnitudes of each group of polynomials on [0, 1], rounding errors included.

    Args:
        values: of polynomials of degree below N at the nodes of ``gauss(N)``, shape (groups, M, N).
        tolerance: share by which the bound exceeds the greatest magnitude found, at least ``least_tolerance(N)``.

    Returns:
        Shape (groups,).

    Raises:
        InvalidInputError: the tolerance is too small to be proven.
    """
    size = values.shape[2]
    if tolerance < least_tolerance(size):
        raise _unprovable(tolerance, size)
    if not len(values):
        return np.zeros(0)
    flat = values.reshape(-1, size)
    best, owner, place = _searched(np.ascontiguousarray(flat.real), len(values), tolerance)
    rows = flat[owner]
    rows = rows * np.where(_at(rows, place).real < 0.0, -1.0, 1.0)[:, None]
    summit = _summits(rows, place, 2)
    bound: Array = (1.0 + tolerance) * (summit + np.maximum(best - summit.real, 0.0))
    return bound


def hull(values: Array) -> tuple[Array, Array]:
    """Bounds of polynomials on [0, 1] from the Bernstein coefficients of both halves, rounding errors included.

    Args:
        values: of polynomials of degree below N at the nodes of ``gauss(N)``, shape (..., N).

    Returns:
        Lower and upper bounds, each of shape (...).
    """
    pieces, slack = bernstein_halves(values)
    return pieces.min(axis=-1) - slack, pieces.max(axis=-1) + slack


def bernstein_halves(values: Array) -> tuple[Array, Array]:
    """Bernstein coefficients of both halves of polynomials on [0, 1], and bounds of their rounding errors.

    Args:
        values: of polynomials of degree below N at the nodes of ``gauss(N)``, shape (..., N).

    Returns:
        Shapes (..., 2 N) and (...).
    """
    cut, rounding = to_bernstein_halves(values.shape[-1])
    return values @ cut, rounding * np.abs(values).max(axis=-1)


def to_bernstein_halves(size: int) -> tuple[Array, float]:
    """Matrix (size, 2 size) from values to these coefficients, and their errors as a share of the greatest value."""
    return _first_cut(size)[:2]


@cache
def halving(size: int) -> Array:
    """Matrix from values at the Gauss nodes to those at the nodes of the left and the right half, (2 size, size)."""
    nodes, _ = gauss(size)
    return frozen(np.ascontiguousarray(_basis(np.concatenate([0.5 * nodes, 0.5 + 0.5 * nodes]), size)))


@cache
def to_chebyshev(size: int) -> Array:
    """Matrix from values at the Gauss nodes to Chebyshev coefficients on the interval, (size, size)."""
    legendre = _to_legendre(size).T
    angles = np.pi * (np.arange(size) + 0.5) / size
    at_chebyshev = np.polynomial.legendre.legvander(np.cos(angles), size - 1)
    cosines = np.cos(np.arange(size)[:, None] * angles) * (2.0 / size)
    cosines[0] *= 0.5
    return frozen(cosines @ at_chebyshev @ legendre)


def interpolation_error(size: int, ellipse: Array) -> Array:
    """Bound of the error of the polynomial through a function's values at ``gauss(size)``, per unit of its magnitude.

    The function must be analytic inside the Bernstein ellipse about the interval whose semi-axes have the sum
    ``ellipse`` > 1, and its magnitude must not exceed one there. The error of the best polynomial is at most
    2 ellipse^-degree / (ellipse - 1) (Trefethen, Approximation Theory and Approximation Practice, theorem 8.2), and
    interpolation multiplies it at most by one plus the nodes' Lebesgue constant.
    """
    error: Array = (1.0 + _first_cut(size)[2]) * 2.0 * ellipse ** (1.0 - size) / (ellipse - 1.0)
    return error


def local_greatest(values: Array, groups: Array) -> Array:
    """Greatest value of each group of polynomials, sought near the greatest node: smooth in parameters, not guaranteed.

    Args:
        values: of M polynomials of degree below N at the nodes of ``gauss(N)``, shape (M, N).
        groups: number of the group of every polynomial, counted from 0 without gaps, shape (M,).

    Returns:
        Shape (groups,).
    """
    candidates = row_products(values.real, _and_ends(values.shape[1]))
    _, owner = _greatest_items(groups, candidates.max(axis=1))
    places = np.concatenate([gauss(values.shape[1])[0], [0.0, 1.0]])
    return _summits(values[owner], places[candidates[owner].argmax(axis=1)], 5)


def _searched(real: Array, count: int, tolerance: float) -> tuple[Array, Array, Array]:
    """For each group its greatest magnitude within the tolerance, the polynomial that attains it, and the place."""
    size, magnitude = real.shape[1], np.abs(real)
    cut, rounding, lebesgue = _first_cut(size)
    highest = magnitude.max(axis=1)
    groups = np.repeat(np.arange(count), len(real) // count)
    owner = highest.reshape(count, -1).argmax(axis=1) + np.arange(count) * (len(real) // count)
    best, place = highest[owner], gauss(size)[0][magnitude[owner].argmax(axis=1)]
    slack = rounding * best
    source = np.flatnonzero(lebesgue * highest > best[groups])
    pieces, width = row_products(real[source], cut).reshape(-1, size), 0.5
    source, start = np.repeat(source, 2), np.tile([0.0, 0.5], len(source))
    for _ in range(_MOST_CUTS):
        ends, of = np.abs(pieces[:, [0, -1]]), groups[source]
        at_end = np.maximum(ends[:, 0], ends[:, 1])
        higher = np.flatnonzero(at_end > best[of])
        present, item = _greatest_items(of[higher], at_end[higher])
        item = higher[item]
        best[present], owner[present] = at_end[item], source[item]
        place[present] = start[item] + width * ends[item].argmax(axis=1)
        left = np.abs(pieces).max(axis=1) + slack[of] > best[of] * (1.0 + tolerance)
        if not left.any():
            return best, owner, place
        pieces, width = row_products(pieces[left], _cut_again(size)).reshape(-1, size), width / _PIECES
        source = np.repeat(source[left], _PIECES)
        start = np.repeat(start[left], _PIECES) + np.tile(width * np.arange(_PIECES), int(left.sum()))
    raise _unprovable(tolerance, size)


def _unprovable(tolerance: float, size: int) -> InvalidInputError:
    return InvalidInputError(f"tolerance: {tolerance:g} cannot be proven for polynomials of degree {size - 1}")


def _greatest_items(groups: Array, magnitude: Array) -> tuple[Array, Array]:
    """The groups that are present, in order, and the item of each with the greatest magnitude."""
    order = np.lexsort((magnitude, groups))
    last = np.flatnonzero(np.diff(groups[order], append=-1))
    return groups[order[last]], order[last]


def _summits(rows: Array, place: Array, steps: int) -> Array:
    """Value at the maximum to which Newton's method climbs from a place, or at the place if it does not climb.

    Complex rows with equal real parts, such as the derivatives of one motion, share one climb.
    """
    first, which = _alike(rows.real, place) if np.iscomplexobj(rows) else (slice(None), slice(None))
    size, at = rows.shape[1], _climbed(rows.real[first], place[first], steps)
    before, after = (_summed(rows, _basis(where, size)[which]) for where in (place[first], at))
    summits: Array = np.where(after.real > before.real, after, before)
    return summits


def _climbed(rows: Array, place: Array, steps: int) -> Array:
    """Where Newton's method gets from places (G,) on its way to maxima of real polynomials (G, size)."""
    slopes = row_products(rows, _slope(rows.shape[1]))
    bends = row_products(slopes, _slope(rows.shape[1]))
    at = place
    for _ in range(steps):
        basis = _basis(at, rows.shape[1])
        with np.errstate(divide="ignore", invalid="ignore"):
            step = -_summed(slopes, basis) / _summed(bends, basis)
        step = np.clip(np.where(np.isfinite(step), step, 0.0), -_LONGEST_STEP, _LONGEST_STEP)
        at = np.clip(at + step, 0.0, 1.0)
    return at


def _alike(rows: Array, place: Array) -> tuple[Array, Array]:
    """The first of all rows (G, size) with equal values and equal places, and for every row which first it equals."""
    weights = np.sqrt(np.arange(2.0, rows.shape[1] + 2.0))
    _, first, which = np.unique(row_products(rows, weights[:, None])[:, 0], return_index=True, return_inverse=True)
    if not ((rows[first][which] == rows).all() and (place[first][which] == place).all()):
        first = which = np.arange(len(rows))  # different rows have the same sum
    return first, which


def _at(rows: Array, place: Array) -> Array:
    """Values of polynomials, each at its own place, shape (G,)."""
    return _summed(rows, _basis(place, rows.shape[1]))


def _basis(place: Array, size: int) -> Array:
    """Weights with which the values at the nodes give those at places, (G, size)."""
    legendre = np.polynomial.legendre.legvander(2.0 * place - 1.0, size - 1)
    return row_products(legendre, _to_legendre(size).T)


def _summed(rows: Array, basis: Array) -> Array:
    value: Array = np.einsum("gk,gk->g", rows, basis)
    return value


@cache
def _to_legendre(size: int) -> Array:
    """Matrix from values at the Gauss nodes to Legendre coefficients, (size, size)."""
    nodes, weights = gauss(size)
    vander = np.polynomial.legendre.legvander(2.0 * nodes - 1.0, size - 1)
    return frozen(vander * weights[:, None] * (2.0 * np.arange(size) + 1.0))


@cache
def _and_ends(size: int) -> Array:
    """Matrix from values at the Gauss nodes to these values and those at 0 and 1, (size, size + 2)."""
    ends = _to_legendre(size) @ np.polynomial.legendre.legvander(np.array([-1.0, 1.0]), size - 1).T
    return frozen(np.concatenate([np.eye(size), ends], axis=1))


@cache
def _slope(size: int) -> Array:
    """Matrix from values at the Gauss nodes to the derivative's values there, (size, size)."""
    nodes, _ = gauss(size)
    derivatives = 2.0 * np.polynomial.legendre.legder(np.eye(size))
    vander = np.polynomial.legendre.legvander(2.0 * nodes - 1.0, max(size - 2, 0))
    return frozen(_to_legendre(size) @ derivatives.T @ vander[:, : len(derivatives)].T)


@cache
def _first_cut(size: int) -> tuple[Array, float, float]:
    """Matrix from values at the nodes to Bernstein coefficients of both halves, (size, 2 size), and two factors.

    The first factor bounds the rounding error of a coefficient, as a share of the greatest value. The second, the
    Lebesgue constant with a margin, bounds how many times a polynomial exceeds its greatest value at the nodes.

    The matrix goes by way of Legendre coefficients, with the second step in exact arithmetic: the direct way to the
    coefficients of the whole interval loses 7 digits at 25 nodes.
    """
    left = _legendre_to_left_bernstein(size)
    mirrored = left[:, ::-1] * (-1.0) ** np.arange(size)[:, None]
    cut = _to_legendre(size) @ np.concatenate([left, mirrored], axis=1)
    norm = (np.abs(_to_legendre(size)) @ np.abs(np.concatenate([left, mirrored], axis=1))).sum(axis=0).max()
    points = np.linspace(0.0, 1.0, 40 * size)
    basis = _to_legendre(size) @ np.polynomial.legendre.legvander(2.0 * points - 1.0, size - 1).T
    return frozen(cut), float(4.0 * size * np.finfo(float).eps * norm), float(1.05 * np.abs(basis).sum(axis=0).max())


def _legendre_to_left_bernstein(size: int) -> Array:
    """Bernstein coefficients on [0, 1/2] of the Legendre polynomials of [0, 1], one a row, (size, size)."""
    degree = size - 1
    shared = lcm(*(comb(degree, j) for j in range(size)))
    rows = []
    for k in range(size):
        whole = [  # numerators over the shared denominator
            shared
            // comb(degree, j)
            * sum(
                (-1) ** (k + i) * comb(k, i) ** 2 * comb(degree - k, j - i)
                for i in range(max(0, j - degree + k), min(j, k) + 1)
            )
            for j in range(size)
        ]
        rows.append([sum(comb(i, j) * whole[j] for j in range(i + 1)) / (shared << i) for i in range(size)])
    return np.array(rows, dtype=np.float64)


@cache
def _cut_again(size: int) -> Array:
    """Matrix from Bernstein coefficients to those of the quarters, (size, 4 size): de Casteljau's rule twice."""
    left = np.array([[comb(i, j) / 2.0**i for j in range(size)] for i in range(size)])
    halves: tuple[Any, Any] = left, left[::-1, ::-1]
    return frozen(np.concatenate([(second @ first).T for first in halves for second in halves], axis=1))
