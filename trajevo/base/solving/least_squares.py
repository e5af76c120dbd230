"""Non-negative least squares, without the import of SciPy."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trajevo.base.arrays import Array

#: Slope, and share of the cost by which it falls, from which on nothing is gained.
_RESTS = 1e-10


def non_negative(matrix: Array, wanted: Array, most: int) -> Array:
    """The x >= 0 that leaves least of matrix x - wanted, by bounded-variable least squares (Stark and Parker 1995).

    It is ``scipy.optimize.lsq_linear`` with ``method="bvls"``, step by step: the import takes longer than all searches
    of a small task.

    Args:
        matrix: shape (m, n).
        wanted: shape (m,).
        most: greatest number of variables that are set free.

    Returns:
        Shape (n,).
    """
    x: Array = np.linalg.lstsq(matrix, wanted, rcond=-1)[0]
    if (x >= 0.0).all():
        return x
    held = x <= 0.0
    x[held] = 0.0
    left = matrix.dot(x) - wanted
    # The least squares of those that are free; what becomes negative is held, until nothing does.
    while not held.all():
        (free,) = np.nonzero(~held)
        found = np.linalg.lstsq(matrix[:, free], wanted - matrix.dot(x * held), rcond=None)[0]
        below = found < 0.0
        x[free] = np.where(below, 0.0, found)
        held[free[below]] = True
        left = matrix.dot(x) - wanted
        if not below.any():
            break
    for _ in range(most):
        slope, cost = matrix.T.dot(left), 0.5 * np.dot(left, left)
        if np.max(np.where(held, -slope, np.abs(slope))) < _RESTS:
            break
        held[np.argmax(np.where(held, -slope, 0.0))] = False
        _settle(matrix, wanted, x, held)
        left = matrix.dot(x) - wanted
        if cost - 0.5 * np.dot(left, left) < _RESTS * cost:
            break
    return x


def _settle(matrix: Array, wanted: Array, x: Array, held: NDArray[np.bool_]) -> None:
    """Move the free variables, in place, to their least squares, holding each that would become negative on the way."""
    while True:
        (free,) = np.nonzero(~held)
        found = np.linalg.lstsq(matrix[:, free], wanted - matrix.dot(x * held), rcond=None)[0]
        (below,) = np.nonzero(found < 0.0)
        if not len(below):
            x[free] = found
            return
        now = x[free]
        shares = (0.0 - now[below]) / (found[below] - now[below])
        first = np.argmin(shares)
        x[free] = now * (1 - shares[first]) + shares[first] * found
        held[free[below[first]]] = True
