"""The septic polynomial between two states."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, numbers, read_only
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError
from trajevo.trajectory.batch import TrajectoryBatch
from trajevo.trajectory.interpolants.hermite import hermite_segments
from trajevo.trajectory.interpolants.interpolant import (
    Interpolant,
    Variable,
    breaks_of,
    check_durations,
    checked_bounds,
    duration_variables,
)
from trajevo.trajectory.polynomial import PolynomialBatch


@final
@dataclass(frozen=True, eq=False)
class State:
    """Position, velocity, acceleration and jerk of every joint at one instant.

    Attributes:
        position: shape (n_joints,) [rad or m].
        velocity: shape (n_joints,) [rad/s or m/s]; zero if not given, as the next two.
        acceleration: shape (n_joints,) [rad/s² or m/s²].
        jerk: shape (n_joints,) [rad/s³ or m/s³].
    """

    position: Array
    velocity: Array | None = None
    acceleration: Array | None = None
    jerk: Array | None = None

    __repr__ = brief

    def __post_init__(self) -> None:
        position = numbers(self.position, name="position", shape=("n_joints",))
        for attribute in fields(self):
            given: Any = getattr(self, attribute.name)
            values = np.zeros_like(position) if given is None else given
            checked = numbers(values, name=attribute.name, shape=position.shape)
            object.__setattr__(self, attribute.name, read_only(checked))

    @property
    def taylor(self) -> Array:
        """Taylor coefficients q⁽ᵏ⁾/k!, shape (n_joints, 4) [rad or m, per sᵏ]."""
        rows = [np.asarray(getattr(self, attribute.name), dtype=np.float64) for attribute in fields(self)]
        coefficients: Array = np.stack(rows, axis=-1) / np.array([1.0, 1.0, 2.0, 6.0])
        return coefficients


@final
@dataclass(frozen=True, eq=False)
class SepticPolynomial(Interpolant):
    """The polynomial of degree 7 between two states, with a free duration (Sun 2020, eqs. (9)-(14)).

    Attributes:
        start: state at time 0.
        end: state at the end.
        duration_bounds: least and greatest duration [s].
    """

    start: State
    end: State
    duration_bounds: tuple[float, float] = field(kw_only=True)

    __repr__ = brief

    def __post_init__(self) -> None:
        object.__setattr__(self, "duration_bounds", checked_bounds(self.duration_bounds))
        if self.start.position.shape != self.end.position.shape:
            raise InvalidInputError(
                f"end: expected {len(self.start.position)} joints as in start, got {len(self.end.position)}"
            )

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The duration."""
        return duration_variables(1, self.duration_bounds)

    def __call__(self, x: Array) -> TrajectoryBatch:
        """Polynomials for durations of shape (B, 1) [s]."""
        durations = check_durations(x, 1)
        shape = (len(durations), 1, *self.start.taylor.shape)
        start, end = np.broadcast_to(self.start.taylor, shape), np.broadcast_to(self.end.taylor, shape)
        return PolynomialBatch(breaks_of(durations), hermite_segments(start, end, durations))

    def via_times(self, x: Array) -> Array:
        """Start and end, (B, 1) -> (B, 2) [s]."""
        return breaks_of(check_durations(x, 1))
