"""Septic + improved quartic uniform B-spline + septic (Sun 2020, eqs. (9)-(24)), as printed and made smooth.

The points between the ends are joined by the spline of :mod:`trajevo.trajectory.interpolants.improved_quartic` in one
of its two forms, ``"printed"`` or ``"smooth"``. The first and the last segment are septic polynomials that start and
end at rest and take the spline's position, velocity, acceleration and jerk where they meet it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.errors import checked_name
from trajevo.trajectory.batch import TrajectoryBatch
from trajevo.trajectory.interpolants.hermite import hermite_segments
from trajevo.trajectory.interpolants.improved_quartic import OFFSETS, PIECES, control_rates, quartic_pieces
from trajevo.trajectory.interpolants.interpolant import (
    AtRest,
    SegmentTimes,
    breaks_of,
    check_durations,
    checked_bounds,
    checked_points,
    checked_rests,
)
from trajevo.trajectory.polynomial import PolynomialBatch

#: Fewest points: the printed form takes the septics' inner states from a spline segment, so there must be one.
LEAST_POINTS = {"printed": 4, "smooth": 3}


@final
@dataclass(frozen=True, eq=False)
class HybridQuartic(SegmentTimes):
    """The hybrid curve of Sun 2020 through via points.

    Attributes:
        points: at least 3 via points, 4 for ``"printed"``.
        form: ``"smooth"`` or ``"printed"``, see :mod:`trajevo.trajectory.interpolants.improved_quartic`.
        duration_bounds: least and greatest time of a segment [s].
        at_rest: joints at rest at inner points, pairs (point, joint) from 0; there the joint's four control points
            coincide, so that its acceleration and jerk are 0 too.

    Raises:
        UnknownNameError: no such form.
        InvalidInputError: too few points, or a joint at rest that does not exist.
    """

    price_of_rest: ClassVar[str | None] = "its acceleration and jerk are 0 there too"

    form: str = field(default="smooth", kw_only=True)
    at_rest: AtRest = field(default=(), kw_only=True)

    __repr__ = brief

    def __post_init__(self) -> None:
        checked_name("form of the hybrid quartic", self.form, OFFSETS)
        checked_points(self.points, LEAST_POINTS[self.form], f"the {self.form} hybrid quartic")
        object.__setattr__(self, "duration_bounds", checked_bounds(self.duration_bounds))
        object.__setattr__(self, "at_rest", checked_rests(self.at_rest, self.points))

    def __call__(self, x: Array) -> TrajectoryBatch:
        """Curves for segment times of shape (B, n_segments) [s]."""
        durations = check_durations(x, len(self.points) - 1)
        before, after = control_rates(self.points, durations, self.form, self.at_rest)
        inner = durations[:, 1:-1]
        spline = self._spline(after[:, :-1], before[:, 1:], inner)
        near_start = inner[:, :1] if inner.shape[1] else durations[:, :1]
        near_end = inner[:, -1:] if inner.shape[1] else durations[:, -1:]
        entry = self._state(self.points.positions[1], after[:, :1], near_start)
        leave = self._state(self.points.positions[-2], before[:, -1:], near_end)
        first = hermite_segments(self._rest(entry, 0), entry, durations[:, :1])
        last = hermite_segments(leave, self._rest(leave, -1), durations[:, -1:])
        pieces = np.repeat(inner / PIECES, PIECES, axis=1)
        breaks = breaks_of(np.concatenate([durations[:, :1], pieces, durations[:, -1:]], axis=1))
        return PolynomialBatch(breaks, np.concatenate([first, spline, last], axis=1))

    def _spline(self, start: Array, end: Array, durations: Array) -> Array:
        """The quartic pieces between the inner points as polynomials of degree 7, (B, 4 (K - 3), n_joints, 8)."""
        quartic = quartic_pieces(self.points.positions[1:-1], start, end, durations, self.form)
        padded = np.zeros((*quartic.shape[:-1], 8), dtype=quartic.dtype)
        padded[..., :5] = quartic
        return padded

    def _state(self, position: Array, rate: Array, duration: Array) -> Array:
        """Taylor coefficients of the spline at a point, (B, 1, n_joints, 4): eq. (18) and its derivatives."""
        near, far = OFFSETS[self.form]
        state = np.zeros((*rate.shape, 4), dtype=rate.dtype)
        state[..., 0] = position
        state[..., 1] = (near + far / 3.0) * PIECES * rate
        state[..., 3] = (far / 3.0 - near) * PIECES**3 * rate / duration[..., None] ** 2
        return state

    def _rest(self, like: Array, point: int) -> Array:
        """The state at rest at a point, in the shape of another state."""
        state = np.zeros_like(like)
        state[..., 0] = self.points.positions[point]
        return state
