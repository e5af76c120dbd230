"""One polynomial through all points: with four of them the septic of Raji 2022, eq. (14)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from trajevo.base import polynomials
from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError
from trajevo.trajectory.interpolants.interpolant import (
    SegmentTimes,
    breaks_of,
    check_durations,
    checked_bounds,
    checked_points,
)
from trajevo.trajectory.polynomial import PolynomialBatch

#: Greatest number of points for which rounding and overshoot leave the polynomial useful.
MOST_POINTS = 8


@final
@dataclass(frozen=True, eq=False)
class SinglePolynomial(SegmentTimes):
    """The polynomial of degree K + 3 through K points, at rest without acceleration at both ends.

    It is smooth everywhere inside, but its jerk jumps at both ends, and it overshoots far between the points.

    Attributes:
        points: 2 to 8 via points; 4 give the septic polynomial.
        duration_bounds: least and greatest time between two points [s].
    """

    __repr__ = brief

    def __post_init__(self) -> None:
        checked_points(self.points, 2, "the single polynomial")
        if len(self.points) > MOST_POINTS:
            raise InvalidInputError(
                f"points: the single polynomial takes at most {MOST_POINTS} points, got {len(self.points)}"
            )
        object.__setattr__(self, "duration_bounds", checked_bounds(self.duration_bounds))

    def __call__(self, x: Array) -> PolynomialBatch:
        """Polynomials for times of shape (B, K - 1) [s], cut at the points."""
        breaks = breaks_of(check_durations(x, len(self.points) - 1))
        total = breaks[:, -1]
        unit = breaks / total[:, None]
        whole = np.moveaxis(self._unit_coefficients(unit), -1, 0)
        pieces = polynomials.shifted(whole[:, :, None], unit[:, :-1, None])
        powers = total[:, None, None] ** np.arange(float(len(whole)))[:, None, None, None]
        return PolynomialBatch(breaks, np.moveaxis(pieces / powers, 0, -1))

    def _unit_coefficients(self, unit: Array) -> Array:
        """Coefficients in powers of t / T, shape (B, n_joints, K + 4).

        The state at the start gives the coefficients of the powers below 3. The others are solved for in t / T, with
        every row divided by (t / T)³: the system as printed, in seconds, has a condition number of 9e6.
        """
        positions = self.points.positions
        count = len(positions) + 1
        powers = np.arange(3.0, 3.0 + count)
        matrix = np.empty((len(unit), count, count), dtype=unit.dtype)
        matrix[:, :-2] = unit[:, 1:, None] ** (powers - 3.0)
        matrix[:, -2], matrix[:, -1] = powers, powers * (powers - 1.0)
        chords = np.zeros((len(unit), count, self.points.n_joints), dtype=unit.dtype)
        chords[:, :-2] = (positions[1:] - positions[0]) / unit[:, 1:, None] ** 3
        solved = np.linalg.solve(matrix, chords)
        start = np.zeros((len(unit), 3, self.points.n_joints), dtype=unit.dtype)
        start[:, 0] = positions[0]
        return np.swapaxes(np.concatenate([start, solved], axis=1), 1, 2)
