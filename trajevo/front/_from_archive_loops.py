"""Comparisons of points, as loops: what numba, the optional extra ``fast``, compiles.

With numba installed they take the place of the archive's comparisons by numpy and moocore, with the same outcome.
"""

from __future__ import annotations

import numpy as np

from trajevo.arrays import Array
from trajevo.compiled import fast

#: Points that a new one is compared with at a time, the latest first: most that are dominated are so by one of those.
_BLOCK = 256


@fast
def non_dominated(old: Array, new: Array, kept: Array, taken: Array) -> None:
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
