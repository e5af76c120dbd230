"""Trajectories made of polynomial segments, with exact peaks, integrals and jumps."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any, SupportsIndex, final

import numpy as np

from trajevo.base import jit, polynomials
from trajevo.base.arrays import Array, frozen, read_only, scaled
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError
from trajevo.trajectory import polynomial_loops
from trajevo.trajectory.batch import (
    DERIVATIVES,
    TrajectoryBatch,
    checked_factor,
    checked_order,
    checked_shares,
    chosen_rows,
)

#: Number of derivatives that dynamics need together: position, velocity and acceleration.
_TOGETHER = 3


@final
@dataclass(frozen=True, eq=False)
class PolynomialBatch(TrajectoryBatch):
    """B trajectories of n joints, each made of S polynomial segments.

    Attributes:
        breaks: instants at which segments meet, shape (B, S + 1), from 0, increasing [s].
        coefficients: shape (B, S, n_joints, degree + 1), ascending powers of the time since the segment began
            [rad/s^k or m/s^k].

    Raises:
        InvalidInputError: shapes do not fit, entries are not finite, or breaks do not increase from 0.
    """

    breaks: Array
    coefficients: Array
    _last_sampled: Any = field(default=None, init=False, repr=False)

    __repr__ = brief

    def __post_init__(self) -> None:
        breaks, coefficients = self._numbers()
        fits = (
            breaks.ndim == 2
            and coefficients.ndim == 4
            and coefficients.shape[:2] == (breaks.shape[0], breaks.shape[1] - 1)
            and min(coefficients.shape[1:]) > 0
        )
        if not fits:
            raise InvalidInputError(
                "PolynomialBatch: expected breaks (B, S + 1) and coefficients (B, S, n_joints, degree + 1), "
                f"got {breaks.shape} and {coefficients.shape}"
            )
        if not (np.isfinite(breaks).all() and np.isfinite(coefficients).all()):
            raise InvalidInputError("PolynomialBatch: breaks and coefficients must be finite numbers")
        rising = np.diff(breaks.real, axis=1) > 0.0
        if not rising.all():
            row = int(np.argwhere(~rising.all(axis=1))[0, 0])
            raise InvalidInputError(f"PolynomialBatch: breaks of trajectory {row} must increase, got {breaks[row]}")
        if breaks.size and (breaks[:, 0] != 0.0).any():
            raise InvalidInputError("PolynomialBatch: breaks must start at 0 s")
        object.__setattr__(self, "breaks", breaks)
        object.__setattr__(self, "coefficients", coefficients)

    def _numbers(self) -> tuple[Array, Array]:
        try:
            return read_only(self.breaks), read_only(self.coefficients)
        except (TypeError, ValueError) as error:
            raise InvalidInputError(f"PolynomialBatch: expected arrays of numbers: {error}") from None

    def __len__(self) -> int:
        return len(self.breaks)

    def __getitem__(self, index: SupportsIndex | slice) -> PolynomialBatch:
        rows = chosen_rows(len(self), index)
        return PolynomialBatch(self.breaks[rows], self.coefficients[rows])

    def real_rows(self, rows: Array) -> PolynomialBatch:
        """The chosen trajectories without complex steps."""
        chosen = object.__new__(PolynomialBatch)  # rows of what has been checked
        object.__setattr__(chosen, "breaks", frozen(self.breaks[rows].real))
        object.__setattr__(chosen, "coefficients", frozen(self.coefficients[rows].real))
        return chosen

    def slowed(self, factor: float) -> PolynomialBatch:
        """The same paths in ``factor`` times the time: coefficient k is divided by ``factor`` to the k."""
        stretch = checked_factor(factor)
        powers = stretch ** np.arange(self.coefficients.shape[-1])
        return PolynomialBatch(self.breaks * stretch, self.coefficients / powers)

    def with_time(self) -> PolynomialBatch:
        """The same trajectories with one more column, the time itself [s]."""
        shape = (*self.coefficients.shape[:2], 1, max(self.coefficients.shape[3], 2))
        clock = np.zeros(shape, dtype=self._kind)
        clock[:, :, 0, 0], clock[:, :, 0, 1] = self.breaks[:, :-1], 1.0
        own = np.pad(self.coefficients, ((0, 0), (0, 0), (0, 0), (0, shape[3] - self.coefficients.shape[3])))
        return PolynomialBatch(self.breaks, np.concatenate([own, clock], axis=2))

    def after_constants(self, values: Array) -> PolynomialBatch:
        """The same trajectories after columns that do not change on the way, (B, k) [rad or m]."""
        shape = (*self.coefficients.shape[:2], values.shape[1], self.coefficients.shape[3])
        still = np.zeros(shape, dtype=np.result_type(self.coefficients, values))
        still[..., 0] = values[:, None]
        return PolynomialBatch(self.breaks, np.concatenate([still, self.coefficients], axis=2))

    @property
    def n_joints(self) -> int:
        """Number of joints."""
        return int(self.coefficients.shape[2])

    @property
    def degree(self) -> int:
        """Degree of the segments' polynomials."""
        return int(self.coefficients.shape[3]) - 1

    def evaluate(self, t: Array, derivative: int = 0) -> Array:
        """Values at instants; any derivative."""
        instants, order = self._instants(t), checked_order(derivative)
        segment = (instants.real[:, :, None] >= self.breaks.real[:, None, 1:-1]).sum(axis=2)
        row = np.arange(len(segment))[:, None]
        start, chosen = self.breaks[row, segment], self.coefficients[row, segment]
        local = polynomials.derivative(np.moveaxis(chosen, -1, 0), order)
        return frozen(polynomials.values(local, (instants - start)[:, :, None]))

    def at_shares(self, u: Array, derivative: int) -> Array:
        """Values at shares of every segment; any derivative."""
        order, shares = checked_order(derivative), tuple(checked_shares(u).tolist())
        if jit.can_compile() and order < len(DERIVATIVES):
            return self._sampled(shares, order)
        unit = self._unit_coefficients
        # Real and imaginary parts side by side: numpy would make a real matrix complex before it multiplies.
        parts = unit.view(np.float64) if np.iscomplexobj(unit) else unit
        at = (_powers(shares, order, self.degree) @ parts).view(unit.dtype)
        if order:
            at *= (self.segment_durations**-order)[:, :, None, None]
        return frozen(at.reshape(len(self), -1, self.n_joints))

    def extremes(self, derivative: int) -> tuple[Array, Array]:
        """Exact: the values at the polynomials' stationary points."""
        lower, upper = self._extremes
        order = _within(derivative, lower)
        return lower[order], upper[order]

    def segment_extremes(self, derivative: int) -> tuple[Array, Array]:
        """Exact extremes of every segment."""
        lower, upper = self._segment_extremes
        order = _within(derivative, lower)
        return lower[order], upper[order]

    def peak(self, derivative: int) -> Array:
        """Exact greatest absolute value."""
        lower, upper = self.extremes(derivative)
        return frozen(np.maximum(-lower, upper))

    def segment_peaks(self, derivative: int) -> Array:
        """Exact greatest absolute value in every segment."""
        lower, upper = self.segment_extremes(derivative)
        return frozen(np.maximum(-lower, upper))

    def peak_terms(self, derivative: int) -> Array:
        """Of straight lines those at both ends: a peak would pass from one to the other where both are equal."""
        if self.degree != derivative + 1:
            return super().peak_terms(derivative)
        ends = self.at_shares(np.array([0.0, 1.0]), derivative).reshape(len(self), -1)
        return frozen(scaled(ends, np.sign(ends.real)))

    def integral_of_square(self, derivative: int) -> Array:
        """By Gauss-Legendre quadrature with enough nodes to be exact for the squared polynomial."""
        order = checked_order(derivative)
        nodes, weights = _legendre(max(self.degree - order, 0) + 1)
        powers = _powers(nodes, order, self.degree)
        if jit.can_compile():
            integral = np.empty((len(self), self.n_joints), dtype=self._kind)
            polynomial_loops.square_integrals(*self._for_loops, order, powers, weights, integral)
            return frozen(integral)
        # Trajectory by trajectory, so that one trajectory's digits do not depend on how many there are.
        flat = np.swapaxes(self._unit_coefficients, 2, 3).reshape(len(self), -1, self.degree + 1)
        per_segment = (np.square(flat @ powers.T) @ weights).reshape(*self.coefficients.shape[:3])
        factor = self.segment_durations ** (1 - 2 * order)
        return frozen((per_segment * factor[:, :, None]).sum(axis=1))

    def jump(self, derivative: int) -> Array:
        """Value after minus value before each inner break; any derivative."""
        local = polynomials.derivative(np.moveaxis(self.coefficients, -1, 0), checked_order(derivative))
        before = polynomials.values(local, self.segment_durations[:, :, None])[:, :-1]
        return frozen(local[0][:, 1:] - before)

    def definition(self, index: int) -> dict[str, Any]:
        """The breaks and the coefficients."""
        return {
            "kind": "piecewise polynomial",
            "breaks [s]": self.breaks[index].tolist(),
            "coefficients (segment, joint, ascending power of the time since the segment began)": (
                self.coefficients[index].tolist()
            ),
        }

    @property
    def _kind(self) -> Any:
        """Common type of the numbers in coefficients and durations."""
        return np.result_type(self.coefficients, self.breaks)

    @property
    def _for_loops(self) -> tuple[Array, Array]:
        """Coefficients and durations of one type, as loops require."""
        kind = self._kind
        return np.ascontiguousarray(self.coefficients, dtype=kind), np.asarray(self.segment_durations, dtype=kind)

    def _sampled(self, shares: tuple[float, ...], order: int) -> Array:
        """Values of a derivative at shares of every segment.

        Callers that need positions at several instants need velocities and accelerations there: these are computed
        together.
        """
        if self._last_sampled is None or self._last_sampled[0] != shares:
            object.__setattr__(self, "_last_sampled", (shares, {}))
        known: dict[int, Array] = self._last_sampled[1]
        if order not in known:
            together = order == 0 and len(shares) > 2
            orders = range(_TOGETHER) if together else range(order, order + 1)
            instants = self.segment_durations.shape[1] * len(shares)
            at = np.empty((len(orders), *self.segment_durations.shape, len(shares) * self.n_joints), dtype=self._kind)
            loop = polynomial_loops.samples if self._kind == np.float64 else polynomial_loops.complex_samples
            loop(*self._for_loops, np.array(shares), orders.start, at)
            known.update(zip(orders, frozen(at.reshape(len(orders), len(self), instants, self.n_joints)), strict=True))
        return known[order]

    @cached_property
    def _unit_coefficients(self) -> Array:
        """Coefficients for segments stretched to the unit interval, shape (B, S, degree + 1, n_joints)."""
        powers = self.segment_durations[:, :, None] ** np.arange(self.degree + 1)
        return np.ascontiguousarray(np.swapaxes(self.coefficients, 2, 3)) * powers[..., None]

    @property
    def _extremes(self) -> tuple[Array, Array]:
        return self._all_extremes[2:]

    @property
    def _segment_extremes(self) -> tuple[Array, Array]:
        return self._all_extremes[:2]

    @cached_property
    def _all_extremes(self) -> tuple[Array, Array, Array, Array]:
        """Least and greatest values of all :data:`DERIVATIVES`, in every segment and over all segments."""
        shape = (len(DERIVATIVES), len(self), self.segment_durations.shape[1], self.n_joints)
        if jit.can_compile():
            bounds = [np.empty(shape[:k] + shape[k + 1 :], dtype=self._kind) for k in (4, 4, 2, 2)]
            loop = polynomial_loops.extremes if self._kind == np.float64 else polynomial_loops.complex_extremes
            loop(*self._for_loops, *bounds)
            lower, upper, lowest, highest = (frozen(bound) for bound in bounds)
            return lower, upper, lowest, highest
        unit = np.ascontiguousarray(np.moveaxis(self._unit_coefficients, 2, 0)).reshape(self.degree + 1, -1)
        per_second = self.segment_durations[..., None] ** -np.arange(len(DERIVATIVES), dtype=np.float64).reshape(
            -1, 1, 1, 1
        )
        lower, upper = (bound.reshape(shape) * per_second for bound in polynomials.extremes(unit, len(DERIVATIVES)))
        # numpy finds extremes along the first axis in memory many times faster.
        lowest, highest = (np.ascontiguousarray(np.moveaxis(bound, 2, 0)) for bound in (lower, upper))
        return frozen(lower), frozen(upper), frozen(lowest.min(axis=0)), frozen(highest.max(axis=0))


def _within(derivative: int, extremes: Array) -> int:
    """A derivative's order, checked to be one for which there are extremes."""
    order = checked_order(derivative)
    if order >= len(extremes):
        raise InvalidInputError(f"derivative: expected 0 to {len(extremes) - 1}, got {derivative}")
    return order


@lru_cache(maxsize=64)
def _powers(shares: tuple[float, ...], order: int, degree: int) -> Array:
    """Matrix from coefficients on the unit interval to a derivative's values at shares of it, (U, degree + 1)."""
    basis = np.eye(degree + 1)
    rows = [polynomials.values(polynomials.derivative(column, order), np.array(shares)) for column in basis]
    return frozen(np.stack(rows, axis=1))


@lru_cache(maxsize=64)
def _legendre(count: int) -> tuple[tuple[float, ...], Array]:
    """Gauss-Legendre nodes on [0, 1], and weights of sum 1."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return tuple((0.5 * (nodes + 1.0)).tolist()), frozen(0.5 * weights)
