"""4-3-4: a quartic away from the first point, cubics between inner points, a quartic to the last point.

The quartics have one coefficient more than a cubic, with which motions begin and end at rest without acceleration; the
velocities at the inner points follow from the continuity of the acceleration there. With four points it is the curve
that Raji 2022, section 2.6, names 4-3-4, whose 14 coefficients are given by 14 conditions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.trajectory.batch import TrajectoryBatch
from trajevo.trajectory.interpolants.interpolant import (
    SegmentTimes,
    breaks_of,
    check_durations,
    checked_bounds,
    checked_points,
)
from trajevo.trajectory.polynomial import PolynomialBatch


@final
@dataclass(frozen=True, eq=False)
class QuarticCubicQuartic(SegmentTimes):
    """The C2 spline 4-3-4 through via points; velocity and acceleration are 0 at both ends, the jerk is not.

    Attributes:
        points: at least 3 via points; through 3 it is two quartics.
        duration_bounds: least and greatest time of a segment [s].

    Raises:
        InvalidInputError: too few points, or bad bounds.
    """

    __repr__ = brief

    def __post_init__(self) -> None:
        checked_points(self.points, 3, "the curve of quartic, cubics and quartic")
        object.__setattr__(self, "duration_bounds", checked_bounds(self.duration_bounds))

    def __call__(self, x: Array) -> TrajectoryBatch:
        """Curves for segment times of shape (B, n_segments) [s]."""
        durations = check_durations(x, len(self.points) - 1)
        v = self._velocities(durations)
        # Segments in the share s of their time: q + w s + c₂ s² + c₃ s³ + c₄ s⁴.
        span, chord = durations[..., None], np.diff(self.points.positions, axis=0)
        start, end = v[:, :-1] * span, v[:, 1:] * span
        c = np.zeros((*start.shape, 5), dtype=v.dtype)
        c[..., 0], c[..., 1] = self.points.positions[:-1], start
        c[..., 2], c[..., 3] = 3.0 * chord - 2.0 * start - end, start + end - 2.0 * chord
        c[:, 0, :, 2] = 0.0
        c[:, 0, :, 3], c[:, 0, :, 4] = 4.0 * chord[0] - end[:, 0], end[:, 0] - 3.0 * chord[0]
        c[:, -1, :, 2] = 6.0 * chord[-1] - 3.0 * start[:, -1]
        c[:, -1, :, 3], c[:, -1, :, 4] = 3.0 * start[:, -1] - 8.0 * chord[-1], 3.0 * chord[-1] - start[:, -1]
        return PolynomialBatch(breaks_of(durations), c / span[..., None] ** np.arange(5))

    def _velocities(self, durations: Array) -> Array:
        """Velocities at all points with which the acceleration is continuous, (B, n_points, n_joints) [rad/s or m/s].

        At an inner point a cubic beside it gives the acceleration ∓6 d/h² ± (4 v + 2 v')/h, with d its chord, h its
        time and v' the velocity at its other end, a quartic ∓12 d/h² ± 6 v/h: a tridiagonal system, solved along the
        points.
        """
        inverse = 1.0 / durations
        quartic = np.arange(durations.shape[1]) % (durations.shape[1] - 1) == 0
        of_chord, of_velocity = np.where(quartic, 12.0, 6.0) * inverse**2, np.where(quartic, 6.0, 4.0) * inverse
        drive = of_chord[..., None] * np.diff(self.points.positions, axis=0)
        v = np.zeros((len(durations), *self.points.positions.shape), dtype=durations.dtype)
        pivots = [np.ones_like(inverse[:, :1])]  # the first point is at rest
        for i in range(1, durations.shape[1]):
            load, pivot = drive[:, i - 1] + drive[:, i], of_velocity[:, i - 1, None] + of_velocity[:, i, None]
            beside = 2.0 * inverse[:, i - 1, None] * float(i > 1)
            pivots.append(pivot - beside**2 / pivots[-1])
            v[:, i] = load - beside / pivots[-2] * v[:, i - 1]
        for i in range(durations.shape[1] - 1, 0, -1):
            beside = 2.0 * inverse[:, i, None] * float(i < durations.shape[1] - 1)
            v[:, i] = (v[:, i] - beside * v[:, i + 1]) / pivots[i]
        return v
