"""Trajectories of a whole population: the interface that all kinds of trajectories share."""

from __future__ import annotations

import operator
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import Any, SupportsIndex

import numpy as np

from trajevo.base.arrays import Array, frozen, numbers
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError

#: Position, velocity, acceleration, jerk: the derivatives that can have limits.
DERIVATIVES = ("position", "velocity", "acceleration", "jerk")


@dataclass(frozen=True, eq=False)
class Motion:
    """Samples of a batch of trajectories.

    Attributes:
        t: instants, shape (B, T) [s].
        q: positions, shape (B, T, n_joints) [rad or m].
        v: velocities, the same shape [rad/s or m/s].
        a: accelerations, the same shape [rad/s² or m/s²].
        j: jerks, the same shape [rad/s³ or m/s³].
    """

    t: Array
    q: Array
    v: Array
    a: Array
    j: Array

    __repr__ = brief


class TrajectoryBatch(ABC):
    """B trajectories of n joints, each made of S smooth segments.

    Attributes:
        breaks: instants at which segments meet, shape (B, S + 1), from 0 [s].
    """

    breaks: Array

    @abstractmethod
    def __len__(self) -> int: ...

    @abstractmethod
    def __getitem__(self, index: SupportsIndex | slice) -> TrajectoryBatch:
        """Batch of the chosen trajectories; one index gives a batch of one.

        Raises:
            IndexError: there is no such trajectory.
        """

    @abstractmethod
    def real_rows(self, rows: Array) -> TrajectoryBatch:
        """Batch of the chosen trajectories, indices of shape (N,), without the imaginary parts of complex steps."""

    @property
    @abstractmethod
    def n_joints(self) -> int:
        """Number of joints."""

    @property
    @abstractmethod
    def degree(self) -> int:
        """Greatest degree of the segments' polynomials."""

    @abstractmethod
    def evaluate(self, t: Array, derivative: int = 0) -> Array:
        """Value of a derivative at given instants; at a break the segment that begins there counts.

        Args:
            t: instants [s], shape (T,) for all trajectories or (B, T); the imaginary parts of complex steps move the
                instants, so that the values have the derivatives of moving instants.
            derivative: 0 position, 1 velocity, 2 acceleration, 3 jerk.

        Returns:
            Shape (B, T, n_joints) [rad/s^derivative or m/s^derivative].

        Raises:
            InvalidInputError: an instant lies outside a trajectory.
        """

    @abstractmethod
    def at_shares(self, u: Array, derivative: int) -> Array:
        """A derivative at the same shares of every segment; where two segments meet, each gives its own value.

        Args:
            u: shares from 0 to 1, shape (U,).
            derivative: 0 position, 1 velocity, and so on.

        Returns:
            Shape (B, S x U, n_joints) [rad/s^derivative or m/s^derivative].

        Raises:
            InvalidInputError: complex shares: they are the same for all trajectories, so no complex step moves them.
        """

    @abstractmethod
    def extremes(self, derivative: int) -> tuple[Array, Array]:
        """Least and greatest value over the whole motion, not only at samples.

        Args:
            derivative: 0 position, 1 velocity, 2 acceleration, 3 jerk.

        Returns:
            Two arrays of shape (B, n_joints) [rad/s^derivative or m/s^derivative].
        """

    @abstractmethod
    def peak(self, derivative: int) -> Array:
        """Greatest absolute value over the whole motion, not only at samples, (B, n_joints) [rad/s^d or m/s^d]."""

    def segment_extremes(self, derivative: int) -> tuple[Array, Array]:
        """Least and greatest value in every part of the motion, two arrays (B, parts, n_joints) [rad/s^d or m/s^d].

        Parts are segments if their extremes are known separately, otherwise the whole motion is one part. Over all
        parts together the values are those of :meth:`extremes`.

        Args:
            derivative: 0 position, 1 velocity, 2 acceleration, 3 jerk.
        """
        lower, upper = self.extremes(derivative)
        return lower[:, None], upper[:, None]

    def segment_peaks(self, derivative: int) -> Array:
        """Greatest absolute value in every part, shape (B, parts, n_joints) [as of :meth:`segment_extremes`]."""
        return self.peak(derivative)[:, None]

    def peak_terms(self, derivative: int) -> Array:
        """Values without kinks near a greatest absolute value, whose greatest it is, shape (B, K) [as of extremes].

        Args:
            derivative: 0 position, 1 velocity, 2 acceleration, 3 jerk.
        """
        return self.segment_peaks(derivative).reshape(len(self), -1)

    @abstractmethod
    def integral_of_square(self, derivative: int) -> Array:
        """∫ (d-th derivative)² dt over the whole motion, exact, shape (B, n_joints) [rad²/s^(2d-1)]."""

    @abstractmethod
    def jump(self, derivative: int) -> Array:
        """Value after minus value before each inner break, shape (B, S - 1, n_joints) [rad/s^d or m/s^d]."""

    @abstractmethod
    def definition(self, index: int) -> dict[str, Any]:
        """Definition of one trajectory, as plain data that another program can evaluate."""

    @abstractmethod
    def slowed(self, factor: float) -> TrajectoryBatch:
        """The same paths in ``factor`` times the duration, q(t / factor); a factor below 1 makes them faster.

        Raises:
            InvalidInputError: a factor that is not positive and finite.
        """

    @property
    def duration(self) -> Array:
        """Total time of each trajectory, shape (B,) [s]."""
        return frozen(self.breaks[:, -1].copy())

    @cached_property
    def segment_durations(self) -> Array:
        """Duration of each segment, shape (B, S) [s]."""
        return frozen(np.diff(self.breaks, axis=1))

    def sample(self, count: int) -> Motion:
        """Motion at ``count`` instants, evenly spaced from start to end of each trajectory."""
        if not isinstance(count, int | np.integer) or count < 2:
            raise InvalidInputError(f"count: expected a whole number of at least 2 samples, got {count!r}")
        t = frozen(self.duration[:, None] * np.linspace(0.0, 1.0, count))
        return Motion(t, *(self.evaluate(t, order) for order in range(4)))

    def _instants(self, t: Array) -> Array:
        """Instants as an array (B, T), every one inside its trajectory [s]; complex steps are kept."""
        given = np.asarray(t, dtype=np.complex128 if np.iscomplexobj(t) else np.float64)
        if given.ndim not in (1, 2) or (given.ndim == 2 and len(given) != len(self)):
            raise InvalidInputError(f"t: expected shape (T,) or ({len(self)}, T), got {given.shape}")
        instants = np.broadcast_to(given, (len(self), given.shape[-1]))
        at, end = instants.real, self.duration.real[:, None]
        if not ((at >= -1e-9 * end) & (at <= end + 1e-9 * end)).all():
            raise InvalidInputError(
                f"t: expected instants from 0 to the duration (least {end.min():g} s), "
                f"got {np.min(at):g} to {np.max(at):g} s"
            )
        return instants


def chosen_rows(count: int, index: SupportsIndex | slice) -> slice:
    """The rows of a batch that an index selects, as a slice.

    Raises:
        IndexError: there is no such trajectory.
    """
    if isinstance(index, slice):
        return index
    place = operator.index(index)
    if not -count <= place < count:
        raise IndexError(f"trajectory {place} of a batch of {count}")
    return slice(place, place + 1 or None)


def checked_shares(u: Array) -> Array:
    """Shares of segments as real numbers."""
    if np.iscomplexobj(u):
        raise InvalidInputError("u: expected real shares of a segment, got complex ones")
    return np.asarray(u, dtype=np.float64)


def checked_factor(factor: float) -> float:
    """A factor of time, checked to be a positive finite number."""
    checked = float(numbers(factor, name="factor", shape=()))
    if not checked > 0.0:
        raise InvalidInputError(f"factor: expected a positive number, got {factor!r}")
    return checked


def checked_order(derivative: int) -> int:
    """A derivative's order, checked to be a whole number and not negative."""
    if type(derivative) is int and derivative >= 0:  # nearly always, and thousands of times in a run
        return derivative
    if not isinstance(derivative, int | np.integer) or isinstance(derivative, bool) or derivative < 0:
        raise InvalidInputError(f"derivative: expected a whole number from 0 on, got {derivative!r}")
    return int(derivative)
