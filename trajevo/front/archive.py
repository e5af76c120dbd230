"""All feasible points of a run that nothing dominates, and the nearest miss while there is none."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import moocore
import numpy as np

from trajevo.base import jit
from trajevo.base.arrays import Array
from trajevo.base.jit import fast

#: Points that a new one is compared with at a time, the latest first: most that are dominated are so by one of those.
_BLOCK = 256


@fast
def _join(old: Array, new: Array, kept: Array, taken: Array) -> None:
    """Which of points that do not dominate each other stay when others come, and which of those join them.

    Of equal points the first counts.

    Args:
        old: shape (n_obj, N), so that neighbours in memory are compared side by side.
        new: shape (M, n_obj).
        kept: what is written, shape (N,).
        taken: the same, shape (M,).
    """
    n_obj, size = old.shape
    holds = np.empty(size, dtype=np.bool_)
    for i in range(len(new)):
        taken[i] = True
        end = size
        while end > 0 and taken[i]:
            # Not in a function of its own: that this is not negative is what lets the loops below be vectorised.
            begin = max(0, end - _BLOCK)
            holds[: end - begin] = True
            for k in range(n_obj):
                value = new[i, k]
                for j in range(end - begin):
                    holds[j] &= old[k, begin + j] <= value
            beaten = False
            for j in range(end - begin):
                beaten |= holds[j]
            taken[i] = not beaten
            end = begin
        for j in range(i):
            if taken[i] and taken[j] and _covers(new[j], new[i]):
                taken[i] = False
            elif taken[i] and taken[j] and _covers(new[i], new[j]):
                taken[j] = False
    kept[:] = True
    for i in range(len(new)):
        if taken[i]:
            holds[:] = True
            for k in range(n_obj):
                value = new[i, k]
                for j in range(size):
                    holds[j] &= value <= old[k, j]
            for j in range(size):
                kept[j] &= not holds[j]


@fast
def _covers(one: Array, other: Array) -> bool:
    """Whether a point is nowhere worse."""
    for k in range(len(one)):  # noqa: SIM110 - a generator is not as fast
        if one[k] > other[k]:
            return False
    return True


#: Failed individuals of a run that are listed; all are counted.
MOST_LISTED = 100

#: Objectives and points from which on moocore takes longer than comparing new points with the others.
_SLOW_FROM = (4, 500)

#: Points taken in latest that new ones are compared with first: most of what is dominated is dominated by one of them.
_LATEST = 200

#: Pairs of points that are compared at a time, so that what comes of them stays in the processor's cache.
_PAIRS = 2**16


class Archive:
    """Grows with every evaluated population; only non-dominated feasible points stay.

    Attributes:
        F: objective values, shape (N, n_obj).
        least_violation: least Σ max(G, 0) of any individual so far; 0 once one is feasible, inf before any number.
        nearest: decision vector and constraint values of that individual, or None.
        failures: individuals whose evaluation gave no numbers.
        failed: decision vector and message of the first of them, at most :data:`MOST_LISTED`.
    """

    def __init__(self, n_var: int, n_obj: int, n_constr: int) -> None:
        self.F = np.empty((0, n_obj))
        self._rest = _Shelf(n_var, n_constr)
        self.least_violation = float("inf")
        self.nearest: tuple[Array, Array] | None = None
        self.failures = 0
        self.failed: list[tuple[Array, str]] = []

    @property
    def X(self) -> Array:
        """Decision vectors, shape (N, n_var)."""
        return self._rest.rows(0)

    @property
    def G(self) -> Array:
        """Constraint values, shape (N, n_constr)."""
        return self._rest.rows(1)

    def add(self, X: Array, F: Array, G: Array, said: Sequence[str] | None = None) -> tuple[Array, Array] | None:
        """Take in an evaluated population, shapes (B, n_var), (B, n_obj), (B, n_constr), and what failed ones said.

        Returns:
            A mask of the points that stay, and the objectives of those that join them; None where nothing changes.
        """
        violation = np.maximum(G, 0.0).sum(axis=1)
        if not np.isfinite(F).all():
            failed = np.flatnonzero(~np.isfinite(F).all(axis=1))
            violation[failed] = np.inf
            self.failures += len(failed)
            for i in failed[: MOST_LISTED - len(self.failed)]:
                self.failed.append((X[i].copy(), "" if said is None else str(said[i])))
        if self.least_violation > 0.0 and len(X) and violation.min() < self.least_violation:
            best = int(violation.argmin())
            self.least_violation = float(violation[best])
            self.nearest = X[best].copy(), G[best].copy()
        (feasible,) = (violation == 0.0).nonzero()
        if not len(feasible):
            return None
        kept, taken = _non_dominated(self.F, F[feasible])
        if not len(taken):
            return None
        chosen = feasible[taken]
        new = F[chosen]
        self.F = np.concatenate([self.F[kept], new])
        self._rest.change(kept, X[chosen], G[chosen])
        return kept, new


class _Shelf:
    """Rows of arrays, of which some go and others come: the rest stays where it is, until half of the room is used up.

    An archive of a thousand points changes with every population by a few of them.
    """

    def __init__(self, *widths: int) -> None:
        self._arrays = [np.empty((0, width)) for width in widths]
        self._where, self._end = np.empty(0, dtype=np.intp), 0

    def rows(self, which: int) -> Array:
        """The rows of one of the arrays."""
        return self._arrays[which].take(self._where, axis=0)

    def change(self, kept: Array, *new: Array) -> None:
        """Drop rows but those of a mask, put new ones behind them."""
        self._where = self._where[kept]
        count = len(new[0])
        if self._end + count > len(self._arrays[0]):
            self._make_room(count)
        for array, rows in zip(self._arrays, new, strict=True):
            array[self._end : self._end + count] = rows
        self._where = np.concatenate([self._where, np.arange(self._end, self._end + count)])
        self._end += count

    def _make_room(self, count: int) -> None:
        size = len(self._where)
        for i, array in enumerate(self._arrays):
            self._arrays[i] = np.empty((2 * (size + count), array.shape[1]))
            self._arrays[i][:size] = array[self._where]
        self._where, self._end = np.arange(size), size


def _non_dominated(old: Array, new: Array) -> tuple[Array, Array]:
    """What stays of points that do not dominate each other, as a mask, and indices of the new ones that join them.

    The same as :func:`moocore.is_nondominated` of all together, of equal points the first. Where that takes long, new
    ones are compared with the others instead: a third of the time, for few are left to be compared with all.
    """
    if jit.can_compile():
        keep, take = np.empty(len(old), dtype=np.bool_), np.empty(len(new), dtype=np.bool_)
        _join(np.ascontiguousarray(old.T), new, keep, take)
        return keep, np.flatnonzero(take)
    if old.shape[1] < _SLOW_FROM[0] or len(old) < _SLOW_FROM[1]:
        left_over = moocore.is_nondominated(np.concatenate([old, new]))
        return left_over[: len(old)], np.flatnonzero(left_over[len(old) :])
    points, rivals = np.ascontiguousarray(new.T), np.ascontiguousarray(old.T)
    left, kept = np.arange(len(new)), np.ones(len(old), dtype=np.bool_)
    for some in (rivals[:, -_LATEST:], rivals[:, :-_LATEST]):
        beaten = [pairs.any(axis=1) for pairs in _compared(np.greater_equal, points.take(left, axis=1), some)]
        left = left[~np.concatenate(beaten)] if beaten else left
    if len(left):
        left = left[moocore.is_nondominated(new[left])]
    for pairs in _compared(np.less_equal, points.take(left, axis=1), rivals):
        kept &= ~pairs.any(axis=0)
    return kept, left


def _compared(compare: np.ufunc, points: Array, rivals: Array) -> Iterator[Array]:
    """Whether a comparison holds in every objective, for a few points with all rivals at a time: (few, rivals).

    Args:
        compare: of an objective of a point with that of a rival.
        points: shape (n_obj, N).
        rivals: shape (n_obj, R).
    """
    few = max(1, _PAIRS // max(1, rivals.shape[1]))
    for first in range(0, points.shape[1], few):
        some = points[:, first : first + few, None]
        holds = compare(some[0], rivals[0])
        one = np.empty_like(holds)
        for point, rival in zip(some[1:], rivals[1:], strict=True):
            holds &= compare(point, rival, out=one)
        yield holds
