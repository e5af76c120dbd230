"""Which few members of a front cover most of what it dominates, and which are neighbours."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np
from scipy.spatial import cKDTree

from trajevo.base.arrays import Array
from trajevo.base.sampling import sobol
from trajevo.front.hypervolume import hypervolume

#: Points of the box by which shares of it are counted, a power of two (Sobol).
_PROBES = 1024


@final
@dataclass(frozen=True, eq=False)
class ReferenceBox:
    """The part of the objectives' space in which a front is measured.

    Attributes:
        low: near corner, shape (n_obj,).
        corner: far corner, beyond it in every objective.
    """

    low: Array
    corner: Array

    @classmethod
    def of(cls, F: Array, reference_point: Array | None) -> ReferenceBox:
        """From 0 to the reference point; without one from the least of the objectives to a tenth beyond the greatest.

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
        """Points of the part of the box that objectives (N, n_obj) reach into, evenly spread, (1024, n_obj).

        Where no member lies within the box, they are spread over the front's own.
        """
        inside = (self.corner > F).all(axis=1)
        own = ReferenceBox.of(F, None) if not inside.any() else self
        low = np.maximum(F.min(axis=0), own.low)
        drawn = sobol(F.shape[1], _PROBES, np.random.default_rng(seed))
        probes: Array = low + drawn * (own.corner - low)
        return probes


def covering(F: Array, probes: Array, most: int) -> Array:
    """Members, one after the other the one that dominates most of the probes that none before it does.

    Args:
        F: objectives, shape (N, n_obj).
        probes: shape (P, n_obj).
        most: how many at most; fewer where those chosen dominate all that any does.

    Returns:
        Rows of F, at most as many.
    """
    covered = np.ones((len(probes), len(F)), dtype=bool)
    for column in range(F.shape[1]):
        covered &= F[:, column] <= probes[:, column, None]
    left, gained, chosen = np.full(len(probes), True), covered.sum(axis=0), list[int]()
    while len(chosen) < min(most, len(F)):
        best = int(gained.argmax())
        if not gained[best]:
            break
        chosen.append(best)
        taken = np.flatnonzero(left & covered[:, best])
        left[taken] = False
        gained -= covered[taken].sum(axis=0)
    return np.array(chosen, dtype=np.intp)


def gaps(f: Array, most: int) -> Array:
    """The pairs of neighbours that are furthest apart, the widest first, shape (pairs, 2).

    Args:
        f: scaled objectives, shape (N, C).
        most: how many at most.
    """
    pairs = neighbours(f, f.shape[1])
    width = np.abs(f[pairs[:, 0]] - f[pairs[:, 1]]).max(axis=1)
    widest: Array = pairs[np.argsort(-width, kind="stable")[:most]]
    return widest


def neighbours(f: Array, count: int) -> Array:
    """Pairs of members of which one is among the nearest of the other, in the greatest difference of any column.

    Args:
        f: scaled objectives, shape (N, C).
        count: nearest of each.

    Returns:
        Rows (i, j) with i < j, each pair once, shape (pairs, 2).
    """
    found = cKDTree(f).query(f, k=list(range(1, min(count, len(f) - 1) + 2)), p=np.inf)[1]
    own = found == np.arange(len(f))[:, None]
    # Where several members are the same, a member need not be the nearest of itself.
    own[~own.any(axis=1), -1] = True
    nearest = found[~own].reshape(len(f), -1)
    rows = np.repeat(np.arange(len(f)), nearest.shape[1])
    return np.unique(np.sort(np.stack([rows, nearest.ravel()], axis=1), axis=1), axis=0)
