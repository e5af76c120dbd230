"""Interpolants whose motions are linear in their points, as moving points and cells that vary need them.

For fixed times the motion through any points is then a sum of motions through indicators, which are 1 at one point and
0 at the others, so that one call of an interpolant gives the motions of a whole population through points of its own.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError
from trajevo.trajectory.batch import TrajectoryBatch
from trajevo.trajectory.interpolants import Interpolant, LinearBlends
from trajevo.trajectory.interpolants.interpolant import PassesNearby, breaks_at_points, piecewise_polynomials
from trajevo.trajectory.polynomial import PolynomialBatch

#: Difference at which motions count as equal, as a share of the greatest coefficient.
_EQUAL = 1e-9


@final
@dataclass(frozen=True, eq=False)
class LinearInPoints:
    """An interpolant through indicators.

    Attributes:
        inner: the interpolant.
        n_points: number of points.
        kind: its name.
        because: why it must be linear in its points, as sentences on bad input say it.

    Raises:
        InvalidInputError: an interpolant that does not pass its points where segments meet.
    """

    inner: Interpolant
    n_points: int
    kind: str
    because: str
    _starts: tuple[int, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        starts = breaks_at_points(self.inner)
        if starts is None and not isinstance(self.inner, LinearBlends):
            raise self._refused("passes its points where segments meet")
        object.__setattr__(self, "_starts", starts or ())

    def motions(self, x: Array) -> PolynomialBatch:
        """Motions of the indicators for decision vectors of the interpolant alone, shape (B, n_variables)."""
        return piecewise_polynomials(self.inner(x), self.kind)

    def points_of(self, trajectory: TrajectoryBatch) -> Array:
        """The points of motions through them, shape (B, K, n_joints) [rad or m].

        Lines with blends cut the corners; their points are where the lines would meet.
        """
        motion = piecewise_polynomials(trajectory, self.kind)
        if isinstance(self.inner, LinearBlends):
            return self.inner.corners(motion)
        points = motion.coefficients[..., 0][:, list(self._starts[:-1])]
        last = motion.segment_durations[:, -1, None, None] ** np.arange(motion.degree + 1)
        return np.concatenate([points, (motion.coefficients[:, -1] * last).sum(axis=-1)[:, None]], axis=1)

    def via_errors(self, trajectory: TrajectoryBatch) -> Array:
        """How far motions pass their points, (B, K, n_joints) [rad or m]; 0 if the interpolant meets them."""
        if isinstance(self.inner, PassesNearby):
            return self.inner.via_errors(trajectory)
        return np.zeros((len(trajectory), self.n_points, trajectory.n_joints))

    def check(self, found: TrajectoryBatch, total: Array) -> None:
        """Refuse an interpolant whose motions are not linear in its points.

        Args:
            found: motions through some points, by the interpolant itself.
            total: coefficients of the sums of indicators for these points.

        Raises:
            InvalidInputError: they differ.
        """
        own = piecewise_polynomials(found, self.kind).coefficients
        if own.shape != total.shape or np.abs(own - total).max() > _EQUAL * np.abs(total).max():
            raise self._refused("is linear in its points")

    def _refused(self, expected: str) -> InvalidInputError:
        return InvalidInputError(f"interpolant: expected one that {expected}, {self.because}, got {self.kind!r}")
