"""Find the few members of a front that dominate most of what it dominates, and pairs of neighbours."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from trajevo.base import jit
from trajevo.base.arrays import Array
from trajevo.base.sampling import sobol
from trajevo.base.solving.neighbours import nearest
from trajevo.front.hypervolume import hypervolume

#: Members up to which looking at all pairs takes less time than the import of a tree: by a compiled loop, and by numpy.
_FEW, _FEWER = 4096, 2048

#: Members of which numpy holds the distances from all others at a time.
_ROWS = 64

#: Sample points with which shares of a box are estimated, a power of two (Sobol).
_PROBES = 1024


@final
@dataclass(frozen=True, eq=False)
class ReferenceBox:
    """The box in objective space in which the hypervolume of a front is measured.

    Attributes:
        low: corner with the best values, shape (n_obj,).
        corner: reference point, worse than ``low`` in every objective, shape (n_obj,).
    """

    low: Array
    corner: Array

    @classmethod
    def of(cls, F: Array, reference_point: Array | None) -> ReferenceBox:
        """The box from 0 to the reference point.

        Without one, the box extends from the least values of the objectives to a tenth of their range beyond the
        greatest values.

        Args:
            F: objectives of a front, shape (N, n_obj).
            reference_point: shape (n_obj,), or None.
        """
        if reference_point is not None:
            return cls(np.zeros(F.shape[1]), reference_point)
        least, width = F.min(axis=0), np.ptp(F, axis=0)
        return cls(least, least + 1.1 * np.where(width > 0.0, width, 1.0))

    def hypervolume(self, F: Array) -> float:
        """Share of the box that objectives (N, n_obj) dominate."""
        return hypervolume(F - self.low, self.corner - self.low)

    def probes(self, F: Array, seed: int) -> Array:
        """Evenly spread points of the part of the box that the front can dominate, shape (1024, n_obj).

        If no member lies within the box, the points are spread over the box of the front itself.

        Args:
            F: objectives of a front, shape (N, n_obj).
            seed: seed of the Sobol sequence.
        """
        inside = (self.corner > F).all(axis=1)
        own = ReferenceBox.of(F, None) if not inside.any() else self
        low = np.maximum(F.min(axis=0), own.low)
        drawn = sobol(F.shape[1], _PROBES, np.random.default_rng(seed))
        probes: Array = low + drawn * (own.corner - low)
        return probes


def covering(F: Array, probes: Array, most: int) -> Array:
    """Choose members that together dominate most of the probes, greedily.

    Each member dominates the most probes that the members chosen before it do not dominate.

    Args:
        F: objectives, shape (N, n_obj).
        probes: points in objective space, shape (P, n_obj).
        most: greatest number of members; fewer suffice if they dominate all probes that any member does.

    Returns:
        Rows of F, shape (members,).
    """
    covered = np.ones((len(F), len(probes)), dtype=bool)
    for values, reached in zip(F.T, np.ascontiguousarray(probes.T), strict=True):
        covered &= values[:, None] <= reached
    # Sets of probes as bits of words, which are counted at once: a row holds eight probes of every member.
    sets = np.ascontiguousarray(np.packbits(covered, axis=1).T)
    left, gained, chosen = np.full(len(sets), 255, dtype=np.uint8), _sizes(sets), list[int]()
    while len(chosen) < min(most, len(F)):
        best = int(gained.argmax())
        if not gained[best]:
            break
        chosen.append(best)
        taken = left & sets[:, best]
        left &= ~taken
        some = np.flatnonzero(taken)
        gained -= _sizes(sets[some] & taken[some, None])
    return np.array(chosen, dtype=np.intp)


def _sizes(sets: Array) -> Array:
    """Numbers of bits that are set in each column of words (words, N), shape (N,)."""
    sizes: Array = np.bitwise_count(sets).sum(axis=0, dtype=np.int16).astype(np.int64)
    return sizes


def gaps(f: Array, most: int) -> Array:
    """The pairs of neighbours that are furthest apart, the widest pair first.

    Args:
        f: scaled objectives, shape (N, C).
        most: greatest number of pairs.

    Returns:
        Rows of f, shape (pairs, 2).
    """
    pairs = neighbours(f, f.shape[1])
    width = np.abs(f[pairs[:, 0]] - f[pairs[:, 1]]).max(axis=1)
    widest: Array = pairs[np.argsort(-width, kind="stable")[:most]]
    return widest


def neighbours(f: Array, count: int) -> Array:
    """Pairs of members where one is among the nearest of the other.

    The distance is the greatest difference in any column.

    Args:
        f: scaled objectives, shape (N, C).
        count: how many of the nearest members of each to pair with it.

    Returns:
        Rows (i, j) with i < j, each pair once, shape (pairs, 2).
    """
    found = _nearest(f, min(count, len(f) - 1) + 1)
    own = found == np.arange(len(f))[:, None]
    # Of several equal members, one may not be listed as its own nearest.
    own[~own.any(axis=1), -1] = True
    nearest, rows = found[~own].reshape(len(f), -1), np.arange(len(f))[:, None]
    pairs = np.sort(np.minimum(rows, nearest) * len(f) + np.maximum(rows, nearest), axis=None)
    pairs = pairs[np.diff(pairs, prepend=-1) > 0]  # without np.unique, which imports NumPy's masked arrays
    return np.stack(np.divmod(pairs, len(f)), axis=1)


def _nearest(f: Array, count: int) -> Array:
    """Numbers of the nearest members of each, itself among them, the nearest first, shape (N, count)."""
    if len(f) > (_FEW if jit.can_compile() else _FEWER):
        from scipy.spatial import cKDTree  # imported where it computes, since that takes long

        by_tree: Array = cKDTree(f).query(f, k=list(range(1, count + 1)), p=np.inf)[1]
        return by_tree
    found = np.empty((len(f), count), dtype=np.int64)
    if jit.can_compile():
        nearest(f, found, np.empty((len(f), count)))
        return found
    for begin in range(0, len(f), _ROWS):
        rows = found[begin : begin + _ROWS]
        apart = np.abs(f[begin : begin + _ROWS, None, 0] - f[:, 0])
        for column in f.T[1:]:
            np.maximum(apart, np.abs(column[begin : begin + _ROWS, None] - column), out=apart)
        for k in range(count):
            rows[:, k] = apart.argmin(axis=1)
            np.put_along_axis(apart, rows[:, k : k + 1], np.inf, axis=1)
    return found


def between(y: Array, pairs: Array, most: int) -> Array:
    """Points evenly spread between the members of each pair: the middle, or more where there are few pairs.

    Args:
        y: what belongs to each member, shape (N, n).
        pairs: pairs of members, shape (P, 2).
        most: greatest number of points if there are fewer pairs than this.

    Returns:
        Shape (points, n).
    """
    parts = 1 + max(1, most // len(pairs))
    shares = (np.arange(1, parts) / parts)[:, None, None]
    points: Array = (1.0 - shares) * y[pairs[:, 0]] + shares * y[pairs[:, 1]]
    return points.reshape(-1, y.shape[1])
