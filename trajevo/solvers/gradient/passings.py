"""The same motion through points at other instants: starts from which a search leaves its valley.

Where efforts bind, motions of least time through points that may move differ little, but there are many ways to place
the points along them: two points near a sharp turn, or one. From one way to another no step of a gradient leads, since
points keep their order. A point that is taken out and put in elsewhere on the same motion leads there, and leaves a
motion that breaks its limits by little.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.formulation.moving_points import MovingPoints
from trajevo.formulation.problem import TrajectoryProblem

#: Where a point is put in, as shares of the gap.
_WITHIN = (0.3, 0.7)


@final
@dataclass(frozen=True, eq=False)
class Passings:
    """When and where the points of motions are passed, as decision variables.

    Attributes:
        points: the interpolant, whose points may move.
        gaps: which variables are times in which gap between points, shape (n_points - 1, n_timing).
        moves: pairs: this inner point may be taken out and become the one with that number.
    """

    points: MovingPoints
    gaps: Array
    moves: tuple[tuple[int, int], ...]

    @classmethod
    def of(cls, problem: TrajectoryProblem) -> Passings | None:
        """Those of a problem; None if its times between points are no sums of variables, or no two points move."""
        points = problem.interpolant
        if not isinstance(points, MovingPoints) or points.curves:
            return None
        timing = len(points.variables) - sum(int(np.count_nonzero(box.half_width)) for box in points.boxes)
        if any(variable.unit != "s" for variable in points.variables[:timing]):
            return None
        rows = np.ones((timing + 1, len(points.variables)))
        rows[1:, :timing] += np.eye(timing)
        passed = np.diff(points.via_times(rows), axis=1)
        gaps = passed[1:] - passed[0]
        belongs = np.isclose(gaps, 1.0)
        if not (np.allclose(gaps, belongs) and (belongs.sum(axis=1) == 1).all() and belongs.any(axis=0).all()):
            return None
        free = np.isin(np.arange(len(points.points)), [box.point for box in points.boxes])
        inner = range(1, len(free) - 1)
        moves = [(k, to) for k in inner for to in inner if to != k and free[min(k, to) : max(k, to) + 1].all()]
        return cls(points, belongs.T, tuple(moves)) if moves else None

    def moved(self, x: Array, moves: Sequence[Sequence[int]], random: np.random.Generator) -> Array:
        """A motion with one point in another place, in every way that is asked for.

        Args:
            x: decision vector, shape (n_var,).
            moves: some of :attr:`moves`.
            random: chooses where in a gap the point is put.

        Returns:
            Shape (N, n_var); some may be beyond the bounds.
        """
        if not moves:
            return x[None][:0]
        own = x[: len(self.points.variables)]
        times, motion = self.points.via_times(own[None])[0], self.points(own[None])
        others = np.stack([self._times(times, point, to, random.uniform(*_WITHIN)) for point, to in moves])
        positions = motion.evaluate(np.clip(others.ravel(), 0.0, motion.duration[0]))[0]
        ratios = np.diff(others, axis=1) / np.diff(times)
        rows = np.repeat(x[None], len(others), axis=0)
        timing = self.gaps.shape[1]
        rows[:, :timing] *= (ratios[:, :, None] * self.gaps).sum(axis=1)
        rows[:, timing : len(own)] = self.points.offsets_at(positions.reshape(*others.shape, -1))
        return rows

    @staticmethod
    def _times(times: Array, point: int, to: int, share: float) -> Array:
        """When the points are passed (n_points,), after one has become another [s]."""
        left = np.delete(times, point)
        return np.insert(left, to, (1.0 - share) * left[to - 1] + share * left[to])
