"""Few rows that stand for a large front: spread evenly over it, with its extremes."""

from __future__ import annotations

from collections.abc import Iterable, Sized

import numpy as np

from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError
from trajevo.front.selection import normalised

#: Greatest number of solutions that pictures and studies of a front show; more of them cover each other, and take long.
MOST_SHOWN = 3000

#: Greatest number of cells along an objective; finer ones would part points that are equal up to rounding.
_FINEST = 2**30


def thinned(F: Array, most: int, *, kept: Iterable[int] = ()) -> Array:
    """Rows that are spread evenly over a front: the first of every cell of a grid over the normalised objectives.

    The grid is as fine as the number of rows allows. Its cost grows with N log N.

    Args:
        F: objective values, shape (N, n_obj).
        most: greatest number of rows.
        kept: rows that must be among them, such as those of choices.

    Returns:
        Ascending rows, shape (R,): all of them if there are no more than ``most``, else at most ``most`` with the rows
        to keep, and the least and the greatest value of every objective.

    Raises:
        InvalidInputError: fewer rows than must be kept.
    """
    if len(F) <= most:
        return np.arange(len(F))
    must = np.array(sorted({*map(int, kept), *F.argmin(axis=0).tolist(), *F.argmax(axis=0).tolist()}), dtype=np.intp)
    if most <= len(must):
        raise InvalidInputError(f"most: expected more than the {len(must)} rows that are kept in any case, got {most}")
    f, few, many = normalised(F), 1, 2
    best = _first_of_cells(f, few)
    while many <= _FINEST and len(tried := _first_of_cells(f, many)) <= most - len(must):
        few, many, best = many, 2 * many, tried
    while many - few > 1:
        middle = (few + many) // 2
        tried = _first_of_cells(f, middle)
        if len(tried) <= most - len(must):
            few, best = middle, tried
        else:
            many = middle
    return np.array(sorted({*best.tolist(), *must.tolist()}), dtype=np.intp)


def _first_of_cells(f: Array, count: int) -> Array:
    """First row of every cell of a grid with ``count`` cells along each normalised objective."""
    numbers = np.zeros(len(f), dtype=np.int64)
    for column in np.minimum((f * count).astype(np.int64), count - 1).T:
        # Numbered again after every objective, so that their products never overflow.
        numbers = np.unique(numbers * count + column, return_inverse=True)[1]
    return np.unique(numbers, return_index=True)[1]


def told_share(rows: Array, front: Sized) -> str:
    """How many solutions of a front stand for it, in words; empty if all of them do."""
    return "" if len(rows) == len(front) else f"{len(rows):,} of {len(front):,} solutions, spread over the front"
