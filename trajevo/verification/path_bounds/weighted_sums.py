"""Values that motions along a path can have at best: weighted sums of two objectives that none is below."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, numbers
from trajevo.base.shown.brief import brief
from trajevo.verification.front_bound import LowerSet

#: Share below which slopes, and values at the end of the box, are the same.
_SAME = 1e-9


@final
@dataclass(frozen=True, eq=False)
class WeightedSums(LowerSet):
    """No motion has a smaller T + weight X than these values, for K weights of an objective X beside the time T.

    Attributes:
        weights: rising from 0, (K,) [s per unit of X].
        values: least values of the weighted sums, proven, (K,) [s].
        time_at: which of both objectives is the time, 0 or 1.
    """

    weights: Array
    values: Array
    time_at: int

    __repr__ = brief

    def least_at(self, time: Any) -> Array:
        """What the other objective of motions of a time is at least, (M,) -> (M,) [SI]; inf below the least time."""
        given = numbers(time, name="time", shape=("n_times",))
        slopes, values = 1.0 / self.weights[1:], self.values[1:]
        least = ((values - given[:, None]) * slopes).max(axis=1, initial=0.0)
        return np.where(given < self.values[0], np.inf, least)

    def points(self, corner: Array, count: int) -> Array:
        """Lower points, by slices of durations."""
        times = np.linspace(min(self.values[0], corner[self.time_at]), corner[self.time_at], count + 1)
        found = np.column_stack([times[:-1], self.least_at(times[1:])])[:, self._order]
        return np.asarray(found[(found <= corner).all(axis=1)])

    def excludes(self, F: Array, corner: Array) -> Array:
        """Which values no motion can have."""
        return np.asarray((self._sums(F) < self.values).any(axis=1))

    def better(self, F: Array, corner: Array) -> Array:
        """By what share a motion can be better; negative if the bound were broken."""
        return np.asarray(1.0 - (self.values / self._sums(F)).max(axis=1))

    def envelope(self, corner: Array) -> Array:
        """Corners of the lower convex envelope by time, from where it enters the box to where it leaves it, (M, 2)."""
        longest, most = corner[[self.time_at, 1 - self.time_at]]
        lines = np.column_stack([self.values[1:], 1.0 / self.weights[1:]])  # X >= (value - time) / weight
        # Lines meet where times and values agree; a point counts if no line, and not the least time, lies above it.
        before, after = (lines[part] for part in np.triu_indices(len(lines), 1))
        with np.errstate(divide="ignore", invalid="ignore"):
            met = (before[:, 0] * before[:, 1] - after[:, 0] * after[:, 1]) / (before[:, 1] - after[:, 1])
        at_top = lines[:, 0] - most / lines[:, 1]
        at = np.unique(np.concatenate([met[np.isfinite(met)], at_top, lines[:, 0], [self.values[0], longest]]))
        at = at[(at >= self.values[0]) & (at <= longest)]
        height = ((lines[:, 0] - at[:, None]) * lines[:, 1]).max(axis=1, initial=0.0)
        inside = height <= most * (1.0 + _SAME)
        points = np.column_stack([at[inside], height[inside]])
        return points[_bent(points)]

    def area(self, corner: Array) -> float:
        """Share of the box from 0 that values above all sums can have."""
        points = self.envelope(corner)
        if len(points) < 2:
            return 0.0
        heights = corner[1 - self.time_at] - points[:, 1]
        return float((np.diff(points[:, 0]) * 0.5 * (heights[:-1] + heights[1:])).sum() / np.prod(corner))

    @property
    def _order(self) -> list[int]:
        return [0, 1] if self.time_at == 0 else [1, 0]

    def _sums(self, F: Array) -> Array:
        """The weighted sums of values (N, 2), (N, K)."""
        return np.asarray(F[:, self.time_at, None] + F[:, 1 - self.time_at, None] * self.weights)


def _bent(points: Array) -> Array:
    """Both ends of a line of points, and those where it bends, (M,)."""
    bent = np.ones(len(points), dtype=bool)
    if len(points) > 2:
        slopes = np.diff(points[:, 1]) / np.diff(points[:, 0])
        bent[1:-1] = np.abs(np.diff(slopes)) > _SAME * np.abs(slopes).max()
    return bent
