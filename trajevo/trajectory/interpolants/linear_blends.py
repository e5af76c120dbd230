"""Straight lines between the points, with quintic blends that cut the corners: inner points are passed nearby."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError
from trajevo.path.via_points import ViaPoints
from trajevo.trajectory.batch import TrajectoryBatch
from trajevo.trajectory.interpolants.hermite import hermite_segments
from trajevo.trajectory.interpolants.interpolant import (
    Interpolant,
    Variable,
    breaks_of,
    checked_bounds,
    checked_points,
    decision_vectors,
    duration_variables,
)
from trajevo.trajectory.polynomial import PolynomialBatch

#: Least and greatest time of a blend, as a share of the time of the shorter line next to it.
BLEND_BOUNDS = (0.01, 0.99)


@final
@dataclass(frozen=True, eq=False)
class LinearBlends(Interpolant):
    """Lines of constant velocity, joined by quintic polynomials; rest at both end points, inner points are missed.

    The blend at every point is centred on it and takes a share of the time of the shorter line next to it. At each end
    the motion takes half a blend longer than the lines.

    Attributes:
        points: at least 2 via points.
        duration_bounds: least and greatest time of a line [s].
    """

    points: ViaPoints
    duration_bounds: tuple[float, float] = field(kw_only=True)

    __repr__ = brief

    def __post_init__(self) -> None:
        checked_points(self.points, 2, "lines with blends")
        object.__setattr__(self, "duration_bounds", checked_bounds(self.duration_bounds))

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The times of the lines, and the share of them that blends take."""
        times = duration_variables(len(self.points) - 1, self.duration_bounds)
        return (*times, Variable("blend", "1", *BLEND_BOUNDS))

    def __call__(self, x: Array) -> PolynomialBatch:
        """Motions for decision vectors of shape (B, K)."""
        lines, half = self._timing(x)
        positions = self.points.positions
        slope = np.diff(positions, axis=0) / lines[..., None]
        still = np.zeros_like(slope[:, :1])
        before, after = np.concatenate([still, slope], axis=1), np.concatenate([slope, still], axis=1)
        states = np.zeros((len(lines), len(positions), 2, self.points.n_joints, 3), dtype=lines.dtype)
        states[:, :, 0, :, 0] = positions - before * half[..., None]
        states[:, :, 1, :, 0] = positions + after * half[..., None]
        states[:, :, 0, :, 1], states[:, :, 1, :, 1] = before, after
        corners = states.reshape(len(lines), 2 * len(positions), self.points.n_joints, 3)
        durations = np.empty((len(lines), 2 * len(positions) - 1), dtype=lines.dtype)
        durations[:, ::2] = 2.0 * half
        durations[:, 1::2] = lines - half[:, :-1] - half[:, 1:]
        return PolynomialBatch(breaks_of(durations), hermite_segments(corners[:, :-1], corners[:, 1:], durations))

    def via_times(self, x: Array) -> Array:
        """Instants at which the points are met or passed nearby, (B, K) -> (B, K) [s]."""
        lines, half = self._timing(x)
        times = half[:, :1] + breaks_of(lines)
        times[:, 0], times[:, -1] = 0.0, times[:, -1] + half[:, -1]
        return times

    def corners(self, trajectory: TrajectoryBatch) -> Array:
        """Where the lines of motions of this interpolant would meet, their via points, (B, K, n_joints) [rad or m]."""
        blends = slice(0, None, 2)
        start, velocity = (trajectory.at_shares(np.zeros(1), order)[:, blends] for order in (0, 1))
        return np.asarray(start + 0.5 * velocity * trajectory.segment_durations[:, blends, None])

    def via_errors(self, trajectory: TrajectoryBatch) -> Array:
        """How far motions pass their points, in the middle of every blend, (B, K, n_joints) [rad or m]."""
        middle = trajectory.at_shares(np.array([0.5]), 0)[:, ::2]
        apart = middle - self.corners(trajectory)
        apart[:, [0, -1]] = 0.0
        return np.asarray(apart * np.sign(apart.real))

    def _timing(self, x: Array) -> tuple[Array, Array]:
        """Times of the lines (B, K - 1), and half of every blend's time (B, K) [s]."""
        rows = decision_vectors(x, len(self.points))
        lines, share = rows[:, :-1], rows[:, -1:]
        good = np.isfinite(rows) & (rows.real > 0.0)
        good[:, -1] &= rows[:, -1].real < 1.0
        if not good.all():
            row, column = (int(i) for i in np.argwhere(~good)[0])
            name = self.variables[column].name
            raise InvalidInputError(
                f"x: expected positive times [s] and a blend below 1, got {rows[row, column]} for {name} in row {row}"
            )
        shorter = np.minimum(lines[:, :-1], lines[:, 1:])
        return lines, 0.5 * share * np.concatenate([lines[:, :1], shorter, lines[:, -1:]], axis=1)
