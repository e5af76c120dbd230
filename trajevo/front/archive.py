"""The archive of a run: non-dominated feasible points, failed individuals, and the least infeasible individual.

New points are compared with the archive by a compiled function if numba is installed, else by moocore or NumPy.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import moocore
import numpy as np

from trajevo.base import jit
from trajevo.base.arrays import Array, frozen, give_back_heap
from trajevo.base.jit import fast

#: Old points that a new one is compared with at a time, the latest first: they dominate most of what is dominated.
_BLOCK = 256


@fast("f8[2], f8[2] -> b1[1], b1[1]")
def _join(old: Array, new: Array, kept: Array, taken: Array) -> None:
    """Find which old points stay when new points arrive, and which new points join them.

    The old points do not dominate each other. Of equal points only the first is kept.

    Args:
        old: objectives of the old points, shape (n_obj, N), so that inner loops run over neighbours in memory.
        new: objectives of the new points, shape (M, n_obj).
        kept: output: which old points stay, shape (N,).
        taken: output: which new points join them, shape (M,).
    """
    n_obj, size = old.shape
    holds = np.empty(size, dtype=np.bool_)
    for i in range(len(new)):
        taken[i] = True
        end = size
        while end > 0 and taken[i]:
            # Not moved into a function: the loops below are vectorised only if the compiler sees that begin >= 0.
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
    """Whether one point is no worse than another in every objective."""
    for k in range(len(one)):  # noqa: SIM110 - a generator is not as fast
        if one[k] > other[k]:
            return False
    return True


#: Greatest number of failed individuals that are listed; all of them are counted.
MOST_LISTED = 100

#: Numbers of objectives and old points from which moocore is slower than comparing the new points with the old ones.
_SLOW_FROM = (4, 500)

#: Latest old points, with which new points are compared first: they dominate most of what is dominated.
_LATEST = 200

#: Pairs of points that are compared at a time, so that the results stay in the processor's cache.
_PAIRS = 2**16


class Archive:
    """The non-dominated feasible points among all individuals evaluated so far.

    Attributes:
        F: objective values, shape (N, n_obj).
        least_violation: least Σ max(G, 0) of any individual so far: 0 once one is feasible, inf before the first
            successful evaluation.
        nearest: decision vector and constraint values of the individual with the least violation, or None.
        failures: number of individuals whose evaluation failed.
        failed: decision vector and error message of the first failures, at most :data:`MOST_LISTED`.
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

    def ordered(self, *, last: bool = False) -> tuple[Array, Array, Array]:
        """Decision vectors, objectives and constraint values in the order of the objectives, read-only.

        Args:
            last: hand over the archive's own memory, so that there is no second copy of the points; afterwards the
                archive is empty.
        """
        order = np.lexsort(self.F.T[::-1]) if len(self.F) else np.arange(0)
        F = frozen(self.F[order])
        if last:
            self.F = self.F[:0].copy()
            X, G = self._rest.emptied(order)
        else:
            X, G = (self._rest.rows(which, order) for which in range(2))
        return frozen(X), F, frozen(G)

    def add(self, X: Array, F: Array, G: Array, said: Sequence[str] | None = None) -> tuple[Array, Array] | None:
        """Add an evaluated population.

        Args:
            X: decision vectors, shape (B, n_var).
            F: objective values, shape (B, n_obj), not finite where the evaluation failed.
            G: constraint values, shape (B, n_constr).
            said: error message of every individual, or None.

        Returns:
            A mask of the old points that stay, and the objectives of the new points; None if nothing changes.
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


#: Growth of the memory of an archive that is full, and rows that are moved at a time.
_GROWTH, _MOVED = 1.1, 4096
#: Points from which an archive that grows gives holes in the heap back, which takes a few milliseconds.
_MANY = 10_000


class _Shelf:
    """Arrays whose rows are removed and added without moving the others; they are compacted when their memory is full.

    An archive of a thousand points changes by only a few points with every population.
    """

    def __init__(self, *widths: int) -> None:
        self._arrays = [np.empty((0, width)) for width in widths]
        self._where, self._end = np.empty(0, dtype=np.intp), 0

    def rows(self, which: int, order: Array | None = None) -> Array:
        """The rows of one of the arrays, all as they were added or some by their places."""
        return self._arrays[which].take(self._where if order is None else self._where[order], axis=0)

    def emptied(self, order: Array) -> list[Array]:
        """All rows of the arrays by their places, in their own memory; nothing remains."""
        arrays, where = self._arrays, self._where[order]
        self._arrays = [array[:0].copy() for array in arrays]
        self._where, self._end = where[:0], 0
        for array in arrays:
            for column in array.T:
                column[: len(where)] = column[where]
            array.resize((len(where), array.shape[1]), refcheck=False)
        return arrays

    def change(self, kept: Array, *new: Array) -> None:
        """Keep the rows of a mask and append new rows."""
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
        for array in self._arrays:
            # In place, as a second copy of a hundred thousand points would be half of a run's memory. Rows move towards
            # the beginning, and later ones stay behind them.
            for begin in range(0, size, _MOVED):
                rows = self._where[begin : begin + _MOVED]
                array[begin : begin + len(rows)] = array[rows]
            array.resize((int(_GROWTH * (size + count)), array.shape[1]), refcheck=False)
        self._where, self._end = np.arange(size), size
        if size > _MANY:
            give_back_heap()


def _non_dominated(old: Array, new: Array) -> tuple[Array, Array]:
    """Mask of the old points that stay, and indices of the new points that join them.

    The old points do not dominate each other. The result is that of :func:`moocore.is_nondominated` for all points
    together, with the first of equal points kept. Where moocore is slow, new points are compared with the old ones
    instead, first with the latest: that takes a third of the time, since few points remain for the other comparisons.
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
    """Whether a comparison holds in every objective, for a few points and all rivals at a time.

    Args:
        compare: compares an objective of a point with that of a rival.
        points: shape (n_obj, N).
        rivals: shape (n_obj, R).

    Yields:
        The next few points compared with all rivals, shape (few, R).
    """
    few = max(1, _PAIRS // max(1, rivals.shape[1]))
    for first in range(0, points.shape[1], few):
        some = points[:, first : first + few, None]
        holds = compare(some[0], rivals[0])
        one = np.empty_like(holds)
        for point, rival in zip(some[1:], rivals[1:], strict=True):
            holds &= compare(point, rival, out=one)
        yield holds
