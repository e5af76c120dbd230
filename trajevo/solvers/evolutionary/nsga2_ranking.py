"""Comparisons of NSGA-II: non-dominated fronts, crowding, tournaments and duplicates, equal to pymoo's to the bit."""

from __future__ import annotations

from collections.abc import Iterator

import moocore
import numpy as np

from trajevo.base.arrays import Array

#: Distance up to which pymoo treats two decision vectors as duplicates.
_SAME = 1e-16
#: Twice the greatest rounding difference between the projections of two equal vectors, over n_var³ times their greatest
#: entry.
_ROUNDING = 4.0 * np.finfo(np.float64).eps


def fronts(F: Array, most: int) -> Iterator[Array]:
    """Yield the indices of the non-dominated fronts of objectives (N, n_obj), best first, until there are ``most``."""
    if not len(F):
        return
    ranks, found = moocore.pareto_rank(F), 0
    for rank in range(ranks.max() + 1):
        front = np.flatnonzero(ranks == rank)
        yield front
        found += len(front)
        if found >= most:
            return


def crowding_distances(F: Array) -> Array:
    """Crowding distances of the objectives of a front, (N, n_obj) -> (N,)."""
    size, n_obj = F.shape
    if size <= 2:
        return np.full(size, np.inf)
    order = n_obj * F.argsort(axis=0, kind="stable") + np.arange(n_obj)
    ascending, gaps = F.take(order), np.full((size + 1, n_obj), np.inf)
    # Values that are not finite have no distance: pymoo uses 0 there, and for an objective that is the same for all.
    with np.errstate(invalid="ignore", divide="ignore"):
        np.subtract(ascending[1:], ascending[:-1], out=gaps[1:-1])
        extent = ascending[-1] - ascending[0]
        extent[extent == 0.0] = np.nan
        gaps /= extent
    gaps[np.isnan(gaps)] = 0.0
    distances = np.empty(F.shape)
    distances.reshape(-1)[order] = gaps[:-1] + gaps[1:]
    mean: Array = distances.sum(axis=1) / n_obj
    return mean


def copies(X: Array, *others: Array) -> Array:
    """Which decision vectors (N, n_var) are duplicates of an earlier one or of one in ``others``, shape (N,)."""
    size, every = len(X), np.concatenate([X, *others])
    rivals = _not_alone(every)
    suspects = rivals[rivals < size]
    copied = np.zeros(size, dtype=np.bool_)
    if len(suspects):
        near = _distances(every[suspects], every[rivals]) <= _SAME
        near &= (rivals < suspects[:, None]) | (rivals >= size)
        copied[suspects] = near.any(axis=1)
    return copied


def _distances(some: Array, others: Array) -> Array:
    """Distances between the rows of (N, n_var) and (M, n_var), shape (N, M): SciPy's cdist, without its import."""
    squares = np.zeros((len(some), len(others)))
    with np.errstate(invalid="ignore", over="ignore"):  # what is not finite has no distance
        for one, other in zip(some.T, others.T, strict=True):
            squares += (one[:, None] - other) ** 2
    return np.sqrt(squares)


def _not_alone(X: Array) -> Array:
    """Indices of the decision vectors (N, n_var) that may be equal to another one.

    The projections of equal vectors on any direction are equal too, up to rounding.
    """
    n_var = X.shape[1]
    along = X @ np.arange(n_var, 2.0 * n_var)
    order = along.argsort()
    ascending = along.take(order)
    close = ascending[1:] - ascending[:-1] <= _ROUNDING * n_var**3 * (1.0 + np.abs(X).max(initial=0.0))
    shared = np.zeros(len(X), dtype=np.bool_)
    shared[order[1:][close]] = shared[order[:-1][close]] = True
    (found,) = shared.nonzero()
    return found


def winners(pairs: Array, violation: Array, F: Array, crowding: Array, random: np.random.Generator) -> Array:
    """Winners of binary tournaments, decided by violation, then dominance, then crowding; ties are broken at random.

    Args:
        pairs: indices of the two individuals in each tournament, shape (N, 2).
        violation: violation of every individual, 0 for feasible ones, shape (individuals,).
        F: objectives of every individual, shape (individuals, n_obj).
        crowding: crowding distance of every individual, shape (individuals,).
        random: random generator.

    Returns:
        Indices, shape (N,).
    """
    contests = np.ascontiguousarray(pairs.T)
    one, other = contests
    mine, theirs = F.take(contests, axis=0)
    less, greater = (mine < theirs).any(axis=1), (mine > theirs).any(axis=1)
    mine, theirs = crowding.take(contests)
    neither = less == greater
    better, worse = np.where(neither, mine > theirs, less), np.where(neither, mine < theirs, greater)
    if (violation > 0.0).any():
        mine, theirs = violation.take(contests)
        broken = (mine > 0.0) | (theirs > 0.0)
        better, worse = np.where(broken, mine < theirs, better), np.where(broken, mine > theirs, worse)
    found: Array = np.where(better, one, other)
    (ties,) = (better == worse).nonzero()
    if len(ties):
        found[ties] = pairs[ties, random.integers(0, 2, size=len(ties))]
    return found
