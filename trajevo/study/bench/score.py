"""Scores of a run: how much of the best known it has reached and when, and by how much its members break limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, final

import moocore
import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError
from trajevo.front.hypervolume import hypervolume
from trajevo.front.thinning import thinned
from trajevo.path.curve import GeometricPath
from trajevo.study.bench.along_path import PathProfile

if TYPE_CHECKING:
    from trajevo.study.bench.reference import Reference
    from trajevo.study.bench.suite import BenchmarkProblem

#: Shares of the best known whose times are told.
SHARES = (0.95, 0.99)

#: Entries of a history, at times that grow evenly in their logarithm.
ENTRIES = 60

#: First time of a history as a share of the budget.
_FIRST = 1e-3

#: Members of the last front that are kept, and those of them that are looked at between their samples.
MOST_KEPT, MOST_CHECKED = 100, 5

#: Instants at which the motion of a member is looked at.
INSTANTS = 50_000


@dataclass(frozen=True)
class Reached:
    """What a run had reached at a time.

    Attributes:
        cpu: CPU time [s].
        evaluations: rows evaluated so far.
        share: share of the best known hypervolume; of a least value, the best known one over it; of payloads, the mean
            share of the greatest ones.
        least: least value of every objective so far, shape (objectives,) [SI]; None before anything feasible.
    """

    cpu: float
    evaluations: int
    share: float
    least: tuple[float, ...] | None

    __repr__ = brief


@final
class Measure:
    """How much of the best known a set of objective values has reached.

    Args:
        reference: the best known set of the problem.
    """

    def __init__(self, reference: Reference) -> None:
        self.kind, self.count = reference.kind, len(reference.ideal)
        self._ideal = np.asarray(reference.ideal)
        self._corner = np.asarray(reference.reference_point) - self._ideal
        if self.kind == "capacity":
            self._masses = np.asarray(reference.variables[:, -1])
            self._most = float(reference.values[0, 0] + self._masses[0])
            self._motions = {
                row.tobytes(): k for k, row in enumerate(np.ascontiguousarray(reference.variables[:, :-1]))
            }
            return
        self._best = float(reference.values[:, 0].min()) if self.kind == "least" else self._volume(reference.values)

    def told(self, X: Array, F: Array) -> Array:
        """Values by which decision vectors (N, variables) with objectives (N, objectives) are measured.

        Where payloads of given motions are asked for, they have another column, the number of the motion: -1 for a
        motion that is not among them, which does not count.
        """
        if self.kind != "capacity":
            return F
        motions = [self._motions.get(row.tobytes(), -1) for row in np.ascontiguousarray(X[:, :-1])]
        return np.column_stack([F, np.array(motions, dtype=float)])

    def __call__(self, F: Array) -> float:
        """The share of values (N, ...) [SI] of :meth:`told`: 0 for none, more than 1 where the best known is beaten."""
        if not len(F):
            return 0.0
        if self.kind == "capacity":
            carried, counts = np.zeros(len(self._masses)), F[:, -1] >= 0.0
            np.maximum.at(carried, F[counts, -1].astype(np.intp), self._most - F[counts, 0])
            return float((carried / self._masses).mean())
        return self._best / float(F[:, 0].min()) if self.kind == "least" else self._volume(F) / self._best

    def front(self, F: Array) -> Array:
        """Ascending rows that count, shape (R,).

        They are the least value, those that no other dominates, or the greatest payload of each motion.
        """
        if self.kind == "capacity":
            order = np.lexsort([F[:, 0], F[:, -1]])
            first = np.unique(F[order, -1], return_index=True)[1]
            return np.sort(order[first][F[order[first], -1] >= 0.0])
        if self.kind == "least" or not len(F):
            return np.array([int(F[:, 0].argmin())] if len(F) else [], dtype=np.intp)
        return np.flatnonzero(moocore.is_nondominated(F))

    def _volume(self, F: Array) -> float:
        return hypervolume(F - self._ideal, self._corner)


@final
class Story:
    """The course of a run, from what was feasible of all that was tried.

    Args:
        measure: how much a set of values has reached.
        cpu: CPU times, ascending, shape (N,) [s].
        evaluations: rows evaluated by then, shape (N,).
        F: values of :meth:`Measure.told`, shape (N, ...) [SI].
        budget: CPU time of the run [s].
    """

    def __init__(self, measure: Measure, cpu: Array, evaluations: Array, F: Array, *, budget: float) -> None:
        self._measure, self._cpu, self._evaluations, self._F = measure, cpu, evaluations, F
        self._times = np.append(np.geomspace(_FIRST * budget, budget, ENTRIES), np.inf)
        self._ends = np.searchsorted(cpu, self._times, side="right")
        self._fronts = self._collected()

    @property
    def rows(self) -> Array:
        """Rows of F that the run ends with, shape (R,)."""
        return self._fronts[-1]

    @property
    def share(self) -> float:
        """Share of the best known at the end."""
        return self._measure(self._F[self.rows])

    def history(self) -> tuple[Reached, ...]:
        """What was reached at times that grow evenly in their logarithm; a time at which nothing is new is left out."""
        told = []
        for k, (end, rows) in enumerate(zip(self._ends, self._fronts, strict=True)):
            if end == (self._ends[k - 1] if k else 0):
                continue
            at = int(end) - 1
            least = tuple(self._F[:end, : self._measure.count].min(axis=0).tolist())
            told.append(Reached(float(self._cpu[at]), int(self._evaluations[at]), self._measure(self._F[rows]), least))
        return tuple(told)

    def time_to(self, share: float) -> float | None:
        """CPU time after which a share of the best known is reached [s]; None if it never is."""
        k = _first(len(self._fronts), lambda k: self._measure(self._F[self._fronts[k]]) >= share)
        if k is None:
            return None
        before, begin = (self._fronts[k - 1], int(self._ends[k - 1])) if k else (np.empty(0, dtype=np.intp), 0)
        new = int(self._ends[k]) - begin
        at = _first(new, lambda n: self._measure(self._F[np.union1d(before, np.arange(begin, begin + n + 1))]) >= share)
        return None if at is None else float(self._cpu[begin + at])

    def _collected(self) -> list[Array]:
        """Rows that count at every time of the history."""
        fronts, rows, begin = [], np.empty(0, dtype=np.intp), 0
        for end in self._ends:
            if end > begin:
                both = np.concatenate([rows, np.arange(begin, end)])
                rows, begin = both[self._measure.front(self._F[both])], end
            fronts.append(rows)
        return fronts


def _first(count: int, holds: Callable[[int], bool]) -> int | None:
    """The first of ``count`` numbers from 0 for which something holds that goes on to hold; None if it never does."""
    if not count or not holds(count - 1):
        return None
    low, high = -1, count - 1
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high


def kept_rows(F: Array, most: int) -> Array:
    """Rows that stand for a front: all of them, or at most so many, with the least of every objective."""
    if len(F) <= most:
        return np.arange(len(F))
    least = np.unique(F.argmin(axis=0))
    return thinned(F, most) if most > 2 * F.shape[1] else least


def violation_of(benchmark: BenchmarkProblem, X: Array, F: Array) -> tuple[float | None, int]:
    """The greatest excess over a limit of a few members at many instants, as the plain statement computes it.

    Along a path without a plain statement the path itself is sampled, at the speeds of the motion.

    Args:
        benchmark: the problem.
        X: decision vectors of the members, shape (N, variables).
        F: their objectives, shape (N, objectives).

    Returns:
        The greatest excess as a share of the limit, at most 0 if all are kept, None without members; and how many
        members were looked at.
    """
    rows, problem = kept_rows(F, MOST_CHECKED), benchmark.problem()
    try:
        statement = benchmark.statement(instants=INSTANTS)
        found = [float(statement.evaluate(x)[1].max(initial=-1.0)) for x in X[rows]]
    except InvalidInputError:  # there is no plain form
        path = getattr(problem, "path", None)
        if not isinstance(path, GeometricPath):
            return None, 0
        profiles = (PathProfile.of(problem.rollout(x[None]).trajectory) for x in X[rows])
        found = [profile.excess(problem.robot, path) for profile in profiles]
    return (max(found), len(rows)) if found else (None, 0)
