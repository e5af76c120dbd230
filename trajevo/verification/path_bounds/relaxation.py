"""The convex relaxation of time laws along a path, its multipliers, and the lower bound that these prove.

With z = ṡ the time over a piece of the path is ∫ ds / z. Joint accelerations q̈ = q' s̈ + q'' z² are linear in s̈ and
z², and their change along the path, dq̈/ds, is the jerk divided by z. The only relation that is not convex is between
the two 1 / z in "time" and "jerk"; Lagrange's function leaves it out where it takes the least over z at every place.
docs/explanation/path_bounds.md has the proof.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.verification.path_bounds.cells import PathCells
from trajevo.verification.path_bounds.pointwise import least
from trajevo.verification.path_bounds.rows import LimitRows

#: Share of the sum of all magnitudes by which a bound is lowered for rounding.
ROUNDING = 1e-10

#: Share by which multipliers of the jerk stay below what is allowed.
_INSIDE = 1e-12


@final
@dataclass(frozen=True, eq=False)
class Multipliers:
    """Multipliers at the K stations of a path; any will do, good ones prove much.

    Attributes:
        first: those of the jerk at the start of the path, shape (n_axes,).
        slopes: their slopes, piecewise linear, shape (K, n_axes).
        limits: those of the rows' limits, positive for the forward limit, shape (K, R).
        efforts: those of the efforts in the objective, shape (K, n_joints); no columns without such an objective.
        speeds: those of the squared velocities, not negative, shape (K, n_axes).
    """

    first: Array
    slopes: Array
    limits: Array
    efforts: Array
    speeds: Array

    __repr__ = brief

    def times(self, factor: float) -> Multipliers:
        """All of them times a factor."""
        return Multipliers(*(getattr(self, field.name) * factor for field in fields(self)))


@final
@dataclass(frozen=True, eq=False)
class Relaxation:
    """Lower bounds of ∫ (1 + jerk weight ‖jerk‖² + effort weight ‖effort‖²) dt along a path, in some unit of time.

    Attributes:
        cells: cells of the path.
        rows: what is limited: accelerations of the axes first, then efforts if these are limited or weighed.
        velocity: greatest velocities of the axes, inf for none, shape (n_axes,).
        jerk: greatest jerks of the axes, inf for none, shape (n_axes,).
        jerk_weight: weight of the squared jerk.
        effort_weight: weight of the squared effort.
    """

    cells: PathCells
    rows: LimitRows
    velocity: Array
    jerk: Array
    jerk_weight: float
    effort_weight: float

    __repr__ = brief

    @property
    def axes(self) -> int:
        """Number of axes."""
        return self.cells.path.n_axes

    @cached_property
    def squares(self) -> Array:
        """Squares of the axes' slopes at the nodes, shape (C, N, n_axes)."""
        squares: Array = self.cells.slopes[1] ** 2
        return squares

    @cached_property
    def fastest(self) -> Array:
        """Upper bounds of z on every cell by the velocity limits, shape (C,); inf where none bounds it."""
        with np.errstate(divide="ignore", invalid="ignore"):
            each = self.velocity / self.cells.least_slope
        fastest: Array = np.where(np.isnan(each), np.inf, each).min(axis=1)
        return fastest

    @property
    def jerk_counts(self) -> Array:
        """Whether the jerk of each axis is limited or weighed, shape (n_axes,)."""
        counts: Array = np.isfinite(self.jerk) | (self.jerk_weight > 0.0)
        return counts

    def jerk_price(self, multipliers: Array) -> Array:
        """The greatest of λ x - weight x² over jerks |x| within the limit, convex in λ, shape (..., n_axes)."""
        magnitude, limit = np.abs(multipliers), self.jerk
        if self.jerk_weight == 0.0:
            return np.where(np.isfinite(limit), magnitude * np.where(np.isfinite(limit), limit, 0.0), 0.0)
        best = np.minimum(magnitude / (2.0 * self.jerk_weight), limit)
        price: Array = best * (magnitude - self.jerk_weight * best)
        return price

    def proven(self, given: Multipliers) -> float:
        """The lower bound that multipliers prove, for all time laws, whatever the stations.

        Within a cell everything is a polynomial of the place. What a place contributes is concave in its terms, so that
        the mean of its values at Bernstein coefficients is below its mean over the cell (Jensen).
        """
        prices = self._prices(given)
        most = float(prices.sum(axis=-1).max())
        if most > 1.0 - _INSIDE:
            given = given.times((1.0 - 2.0 * _INSIDE) / most)
            prices = self._prices(given)
        inverse = np.maximum(1.0 - prices.sum(axis=-1), 0.0)
        weights = self._weights(given)
        linear, square = self._linear(given, weights), self.square(given)
        fastest = np.broadcast_to(self.fastest[:, None], square.shape)
        places = least(inverse, linear, square, fastest)[0]
        if not np.isfinite(places).all():
            return -np.inf
        share = self.cells.widths[:, None] / places.shape[1]
        held = np.einsum("knr,knr->kn", self.cells.linear(weights), self.rows.held)
        unsure = (_greatest(weights) * self.rows.errors[3]).sum(axis=1) @ self.cells.widths
        paid = self._paid(given)
        magnitudes = (share * np.abs(places)).sum() + float(self.cells.integral(np.abs(held))) + paid
        value = (share * places).sum() + float(self.cells.integral(held)) - unsure - paid
        return float(value - ROUNDING * magnitudes)

    def _prices(self, given: Multipliers) -> Array:
        """Prices of the jerk's multipliers at their Bernstein coefficients, (C, 2 N, n_axes)."""
        coefficients, slack = self.cells.bernstein(self._jerk_multipliers(given))
        return self.jerk_price(np.abs(coefficients) + slack[:, None])

    def _jerk_multipliers(self, given: Multipliers) -> Array:
        """The jerk's multipliers at the nodes, quadratic on every cell, (C, N, n_axes)."""
        width, share = self.cells.widths[:, None], self.cells.shares[:, None]
        before, after = given.slopes[:-1], given.slopes[1:]
        gains = 0.5 * width * (before + after)
        starts = given.first + np.concatenate([np.zeros((1, self.axes)), np.cumsum(gains, axis=0)])[:-1]
        within = width[:, None] * (share * before[:, None] + 0.5 * share**2 * (after - before)[:, None])
        found: Array = starts[:, None] + within
        return found

    def _weights(self, given: Multipliers) -> Array:
        """What every row is multiplied by, at the stations, (K, R)."""
        weights = given.limits.copy()
        weights[:, : self.axes] -= given.slopes
        if given.efforts.shape[1]:
            weights[:, self.axes :] += given.efforts
        return weights

    def _linear(self, given: Multipliers, weights: Array) -> Array:
        """Lower Bernstein coefficients of what multiplies z, (C, 2 N)."""
        values = np.einsum("knr,knr->kn", self.cells.linear(weights), self.rows.rate)
        found, slack = self.cells.bernstein(values)
        found = found - slack[:, None]
        if given.efforts.shape[1] and self.effort_weight > 0.0:
            each, loose = self.cells.bernstein(self.cells.linear(given.efforts))
            found = found - ((np.abs(each) + loose[:, None]) ** 2).sum(axis=2) / (4.0 * self.effort_weight)
        lower: Array = found - (_greatest(weights) * self.rows.errors[2]).sum(axis=1)[:, None]
        return lower

    def square(self, given: Multipliers) -> Array:
        """Lower Bernstein coefficients of what multiplies z² in both halves of every cell, shape (C, 2 N)."""
        weights = self._weights(given)
        rises = np.diff(weights, axis=0) / self.cells.widths[:, None]
        values = np.einsum("knr,knr->kn", self.cells.linear(weights), self.rows.half)
        values = values - 0.5 * np.einsum("kr,knr->kn", rises, self.rows.bend)
        values = values + np.einsum("kni,kni->kn", self.cells.linear(given.speeds), self.squares)
        found, slack = self.cells.bernstein(values)
        unsure = _greatest(weights) * self.rows.errors[1] + 0.5 * np.abs(rises) * self.rows.errors[0]
        lower: Array = found - (slack + unsure.sum(axis=1))[:, None]
        return lower

    def _paid(self, given: Multipliers) -> float:
        """What the limits cost: at least the integral of multipliers times limits."""
        ahead, behind = np.maximum(given.limits, 0.0), np.maximum(-given.limits, 0.0)
        costs = _product(ahead, self.rows.forward) + _product(behind, self.rows.backward)
        costs = costs + _product(given.speeds, self.velocity**2)
        return float(0.5 * ((costs[:-1] + costs[1:]) @ np.ones(1) * self.cells.widths).sum())


def _product(multipliers: Array, limits: Array) -> Array:
    """Sums of multipliers times limits, (K, R) -> (K, 1); nothing times no limit is nothing."""
    used = np.where(multipliers != 0.0, limits, 0.0)
    found: Array = (multipliers * used).sum(axis=1, keepdims=True)
    return found


def _greatest(at_stations: Array) -> Array:
    """Greatest magnitudes on every cell of piecewise linear functions, (K, R) -> (C, R)."""
    return np.maximum(np.abs(at_stations[:-1]), np.abs(at_stations[1:]))
