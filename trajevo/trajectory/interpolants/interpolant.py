"""The interface of all interpolants, and functions shared by those with free segment times."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np

from trajevo.base.arrays import Array, numbers
from trajevo.errors import InvalidInputError
from trajevo.path.via_points import ViaPoints
from trajevo.trajectory.batch import TrajectoryBatch


@dataclass(frozen=True)
class Variable:
    """A decision variable: its name, SI unit and bounds."""

    name: str
    unit: str
    lower: float
    upper: float

    def __post_init__(self) -> None:
        if not (np.isfinite([self.lower, self.upper]).all() and self.lower < self.upper):
            raise InvalidInputError(
                f"variable {self.name!r}: expected finite bounds lower < upper, got {self.lower} and {self.upper}"
            )


class Interpolant(ABC):
    """A map from decision vectors to trajectories, for a whole population at once."""

    @property
    @abstractmethod
    def variables(self) -> tuple[Variable, ...]:
        """The decision variables, in the order of the columns of ``x``."""

    @abstractmethod
    def __call__(self, x: Array) -> TrajectoryBatch:
        """Decode decision vectors.

        Args:
            x: shape (B, n_variables), units as in :attr:`variables`.

        Returns:
            B trajectories.

        Raises:
            InvalidInputError: another shape, or a segment time that is not a positive number.
        """

    @abstractmethod
    def via_times(self, x: Array) -> Array:
        """Instants at which the via points are passed, (B, n_variables) -> (B, n_points) [s]."""


@runtime_checkable
class PassesNearby(Protocol):
    """An interpolant whose motions pass inner points nearby, or may do so; any other one meets all its points."""

    def via_errors(self, trajectory: TrajectoryBatch) -> Array:
        """How far motions of this interpolant pass every joint of every point, (B, n_points, n_joints) [rad or m]."""


def checked_bounds(bounds: Any) -> tuple[float, float]:
    """Bounds of a duration as 0 < lower < upper [s]."""
    lower, upper = numbers(bounds, name="duration_bounds", shape=(2,)).tolist()
    if not 0.0 < lower < upper:
        raise InvalidInputError(f"duration_bounds: expected 0 < lower < upper [s], got {lower} and {upper}")
    return lower, upper


def checked_points(points: Any, least: int, what: str) -> None:
    """Refuse anything but via points, and fewer points than an interpolant needs."""
    if not isinstance(points, ViaPoints):
        raise InvalidInputError(f"points: {what} needs ViaPoints, got {type(points).__name__}")
    if len(points) < least:
        raise InvalidInputError(f"points: {what} needs at least {least} points, got {len(points)}")


def duration_variables(count: int, bounds: tuple[float, float], symbol: str = "dt") -> tuple[Variable, ...]:
    """One free time per segment, the first named ``dt_1`` [s]."""
    return tuple(Variable(f"{symbol}_{i + 1}", "s", *bounds) for i in range(count))


def decision_vectors(x: Any, count: int, what: str = "decision vectors") -> Array:
    """Rows of numbers as an array (B, count); complex ones stay complex."""
    try:
        rows = np.asarray(x, dtype=np.complex128 if np.iscomplexobj(x) else np.float64)
    except (TypeError, ValueError):
        raise InvalidInputError(f"x: expected {what} of shape (B, {count}), got {x!r}") from None
    if rows.ndim != 2 or rows.shape[1] != count:
        raise InvalidInputError(f"x: expected {what} of shape (B, {count}), got {rows.shape}")
    return rows


def check_durations(x: Any, count: int) -> Array:
    """Segment times as an array (B, n_segments), every one positive and finite [s]; complex ones stay complex."""
    durations = decision_vectors(x, count, "segment times")
    good = np.isfinite(durations) & (durations.real > 0.0)
    if not good.all():
        row, segment = (int(i) for i in np.argwhere(~good)[0])
        raise InvalidInputError(
            f"x: expected positive segment times [s], got {durations[row, segment]} for segment {segment} of row {row}"
        )
    return durations


def breaks_of(durations: Array) -> Array:
    """Instants of the breaks, (B, S) durations -> (B, S + 1), from 0 [s]."""
    return np.concatenate([np.zeros((len(durations), 1)), np.cumsum(durations, axis=1)], axis=1)
