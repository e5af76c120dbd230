"""Trajectories of a whole population: piecewise polynomials with exact peaks, integrals and jumps."""

from __future__ import annotations

import operator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import SupportsIndex

import numpy as np

from trajevo import polynomials
from trajevo.arrays import Array, frozen, read_only
from trajevo.errors import InvalidInputError

#: Position, velocity, acceleration, jerk: the derivatives that limits speak of.
DERIVATIVES = ("position", "velocity", "acceleration", "jerk")


@dataclass(frozen=True, eq=False)
class Motion:
    """Samples of a batch of trajectories.

    Attributes:
        t: instants, shape (B, T) [s].
        q: positions, shape (B, T, n_joints) [rad or m].
        v: velocities [rad/s or m/s].
        a: accelerations [rad/s² or m/s²].
        j: jerks [rad/s³ or m/s³].
    """

    t: Array
    q: Array
    v: Array
    a: Array
    j: Array


@dataclass(frozen=True, eq=False)
class TrajectoryBatch:
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
                "TrajectoryBatch: expected breaks (B, S + 1) and coefficients (B, S, n_joints, degree + 1), "
                f"got {breaks.shape} and {coefficients.shape}"
            )
        if not (np.isfinite(breaks).all() and np.isfinite(coefficients).all()):
            raise InvalidInputError("TrajectoryBatch: breaks and coefficients must be finite numbers")
        rising = np.diff(breaks.real, axis=1) > 0.0
        if not rising.all():
            row = int(np.argwhere(~rising.all(axis=1))[0, 0])
            raise InvalidInputError(f"TrajectoryBatch: breaks of trajectory {row} must increase, got {breaks[row]}")
        if breaks.size and (breaks[:, 0] != 0.0).any():
            raise InvalidInputError("TrajectoryBatch: breaks must start at 0 s")
        object.__setattr__(self, "breaks", breaks)
        object.__setattr__(self, "coefficients", coefficients)

    def _numbers(self) -> tuple[Array, Array]:
        try:
            return read_only(self.breaks), read_only(self.coefficients)
        except (TypeError, ValueError) as error:
            raise InvalidInputError(f"TrajectoryBatch: expected arrays of numbers: {error}") from None

    def __len__(self) -> int:
        return len(self.breaks)

    def __getitem__(self, index: SupportsIndex | slice) -> TrajectoryBatch:
        """Batch of the chosen trajectories; one index gives a batch of one.

        Raises:
            IndexError: there is no such trajectory.
        """
        if not isinstance(index, slice):
            place = operator.index(index)
            if not -len(self) <= place < len(self):
                raise IndexError(f"trajectory {place} of a batch of {len(self)}")
            index = slice(place, place + 1 or None)
        return TrajectoryBatch(self.breaks[index], self.coefficients[index])

    @property
    def n_joints(self) -> int:
        """Number of joints."""
        return int(self.coefficients.shape[2])

    @property
    def degree(self) -> int:
        """Degree of the segments' polynomials."""
        return int(self.coefficients.shape[3]) - 1

    @property
    def duration(self) -> Array:
        """Total time of each trajectory, shape (B,) [s]."""
        return frozen(self.breaks[:, -1].copy())

    def evaluate(self, t: Array, derivative: int = 0) -> Array:
        """Value of a derivative at given instants; at a break the segment that begins there counts.

        Args:
            t: instants [s], shape (T,) for all trajectories or (B, T).
            derivative: 0 position, 1 velocity, 2 acceleration, 3 jerk, and so on.

        Returns:
            Shape (B, T, n_joints) [rad/s^derivative or m/s^derivative].

        Raises:
            InvalidInputError: an instant lies outside a trajectory.
        """
        given = np.asarray(t, dtype=np.float64)
        if given.ndim not in (1, 2) or (given.ndim == 2 and len(given) != len(self)):
            raise InvalidInputError(f"t: expected shape (T,) or ({len(self)}, T), got {given.shape}")
        instants = np.broadcast_to(given, (len(self), given.shape[-1]))
        order = _order(derivative)
        slack = 1e-9 * self.duration[:, None]
        if not ((instants >= -slack) & (instants <= self.duration[:, None] + slack)).all():
            raise InvalidInputError(
                f"t: expected instants from 0 to the duration (least {self.duration.min():g} s), "
                f"got {np.min(instants):g} to {np.max(instants):g} s"
            )
        segment = (instants[:, :, None] >= self.breaks[:, None, 1:-1]).sum(axis=2)
        start = np.take_along_axis(self.breaks, segment, axis=1)
        chosen = np.take_along_axis(self.coefficients, segment[:, :, None, None], axis=1)
        local = polynomials.derivative(np.moveaxis(chosen, -1, 0), order)
        return frozen(polynomials.values(local, (instants - start)[:, :, None]))

    def sample(self, count: int) -> Motion:
        """Motion at ``count`` instants, evenly spaced from start to end of each trajectory."""
        if not isinstance(count, int | np.integer) or count < 2:
            raise InvalidInputError(f"count: expected a whole number of at least 2 samples, got {count!r}")
        t = frozen(self.duration[:, None] * np.linspace(0.0, 1.0, count))
        return Motion(t, *(self.evaluate(t, order) for order in range(4)))

    def at_shares(self, u: Array, derivative: int) -> Array:
        """A derivative at the same shares of every segment, ends of segments counted in both.

        Args:
            u: shares from 0 to 1, shape (U,).
            derivative: 0 position, 1 velocity, and so on.

        Returns:
            Shape (B, S x U, n_joints) [rad/s^derivative or m/s^derivative].
        """
        order = _order(derivative)
        at = _powers(tuple(np.asarray(u, dtype=np.float64).tolist()), order, self.degree) @ self._unit_coefficients
        if order:
            at *= (self.segment_durations**-order)[:, :, None, None]
        return frozen(at.reshape(len(self), -1, self.n_joints))

    def extremes(self, derivative: int) -> tuple[Array, Array]:
        """Least and greatest value over the whole motion, at the polynomials' stationary points, not at samples.

        Args:
            derivative: 0 position, 1 velocity, 2 acceleration, 3 jerk.

        Returns:
            Two arrays of shape (B, n_joints) [rad/s^derivative or m/s^derivative].
        """
        lower, upper = self._extremes
        order = _order(derivative)
        if order >= len(lower):
            raise InvalidInputError(f"derivative: expected 0 to {len(lower) - 1}, got {derivative}")
        return lower[order], upper[order]

    def peak(self, derivative: int) -> Array:
        """Greatest absolute value over the whole motion, exact, shape (B, n_joints) [rad/s^d or m/s^d]."""
        lower, upper = self.extremes(derivative)
        return frozen(np.maximum(-lower, upper))

    def integral_of_square(self, derivative: int) -> Array:
        """∫ (d-th derivative)² dt over the whole motion, exact, shape (B, n_joints) [rad²/s^(2d-1)].

        Gauss-Legendre quadrature with as many nodes as make it exact for the squared polynomial.
        """
        order = _order(derivative)
        nodes, weights = np.polynomial.legendre.leggauss(max(self.degree - order, 0) + 1)
        powers = _powers(tuple((0.5 * (nodes + 1.0)).tolist()), order, self.degree)
        flat = np.swapaxes(self._unit_coefficients, 2, 3).reshape(-1, self.degree + 1)
        per_segment = (np.square(flat @ powers.T) @ (0.5 * weights)).reshape(*self.coefficients.shape[:3])
        factor = self.segment_durations ** (1 - 2 * order)
        return frozen((per_segment * factor[:, :, None]).sum(axis=1))

    def jump(self, derivative: int) -> Array:
        """Value after minus value before each inner break, shape (B, S - 1, n_joints) [rad/s^d or m/s^d]."""
        local = polynomials.derivative(np.moveaxis(self.coefficients, -1, 0), _order(derivative))
        before = polynomials.values(local, self.segment_durations[:, :, None])[:, :-1]
        return frozen(local[0][:, 1:] - before)

    @cached_property
    def segment_durations(self) -> Array:
        """Duration of each segment, shape (B, S) [s]."""
        return frozen(np.diff(self.breaks, axis=1))

    @cached_property
    def _unit_coefficients(self) -> Array:
        """Coefficients for segments stretched to the unit interval, shape (B, S, degree + 1, n_joints)."""
        powers = self.segment_durations[:, :, None] ** np.arange(self.degree + 1)
        return np.ascontiguousarray(np.swapaxes(self.coefficients, 2, 3)) * powers[..., None]

    @cached_property
    def _extremes(self) -> tuple[Array, Array]:
        unit = np.ascontiguousarray(np.moveaxis(self._unit_coefficients, 2, 0)).reshape(self.degree + 1, -1)
        shape = (len(DERIVATIVES), len(self), self.segment_durations.shape[1], self.n_joints)
        per_second = self.segment_durations[..., None] ** -np.arange(len(DERIVATIVES), dtype=np.float64).reshape(
            -1, 1, 1, 1
        )
        lower, upper = (bound.reshape(shape) * per_second for bound in polynomials.extremes(unit, len(DERIVATIVES)))
        return frozen(lower.min(axis=2)), frozen(upper.max(axis=2))


@lru_cache(maxsize=64)
def _powers(shares: tuple[float, ...], order: int, degree: int) -> Array:
    """Matrix that takes unit coefficients to a derivative's values at shares of a segment, (U, degree + 1)."""
    basis = np.eye(degree + 1)
    rows = [polynomials.values(polynomials.derivative(column, order), np.array(shares)) for column in basis]
    return frozen(np.stack(rows, axis=1))


def _order(derivative: int) -> int:
    """A derivative's order as a whole number from 0 on."""
    if not isinstance(derivative, int | np.integer) or isinstance(derivative, bool) or derivative < 0:
        raise InvalidInputError(f"derivative: expected a whole number from 0 on, got {derivative!r}")
    return int(derivative)
