"""The quadratic program of one step of a minimax problem under limits, by SciPy's non-negative least squares."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np
from scipy.optimize import nnls

from trajevo.arrays import Array

#: Weight of the squares of what the greatest value and the excess change by: without them the program is not strict.
_PROXIMAL = 0.1
#: Values of limits above which they are in the first program; those that its solution breaks are added.
_NEAR = -0.3
#: Excess of a linear limit that is rounding.
_ROUNDING = 1e-9


@final
@dataclass(frozen=True, eq=False)
class Step:
    """A solution.

    Attributes:
        d: change of the variables, shape (n,).
        terms: multipliers of the terms of the maximum, shape (k,), of sum 1 nearly.
        limits: multipliers of the limits, shape (m,).
    """

    d: Array
    terms: Array
    limits: Array


@final
@dataclass(frozen=True, eq=False)
class Model:
    """A minimax problem near a point: curvature and slopes of its terms and limits.

    Attributes:
        curvature: of the Lagrangian, positive definite, shape (n, n).
        slope: of what is added to the maximum, shape (n,).
        terms: of the maximum, less the maximum, shape (k,), at most 0.
        term_slopes: shape (k, n).
        limits: at most 0 where kept, shape (m,).
        limit_slopes: shape (m, n).
        box: least and greatest change of every variable, shape (2, n).
        penalty: of the greatest excess over a limit.
    """

    curvature: Array
    slope: Array
    terms: Array
    term_slopes: Array
    limits: Array
    limit_slopes: Array
    box: Array
    penalty: float

    def decrease(self, d: Array) -> float:
        """By how much a step lowers maximum, addend and penalty, their slopes taken as constant."""
        rise = (self.terms + self.term_slopes @ d).max() + self.slope @ d
        excess = max((self.limits + self.limit_slopes @ d).max(initial=0.0), 0.0)
        return float(self.penalty * (max(self.limits.max(initial=0.0), 0.0) - excess) - rise)

    def solve(self) -> Step | None:
        """Minimise t + slope·d + ½ d'Bd + penalty s under terms ≤ t, limits ≤ s, 0 ≤ s and box; None where it fails.

        The squares of t and s are added with a small weight. In coordinates in which the whole square is that of a
        length it is the least distance problem of Lawson and Hanson, whose dual is a non-negative least squares.
        """
        size = len(self.slope)
        try:
            root = np.linalg.inv(np.linalg.cholesky(self._square(size)))
        except np.linalg.LinAlgError:
            return None
        shift = root @ np.concatenate([self.slope, [1.0, self.penalty]])
        chosen = np.flatnonzero(self.limits > _NEAR)
        while True:
            rows, bounds = self._rows(chosen)
            found = _least_distance(-rows @ root.T, -(bounds + rows @ (root.T @ shift)))
            if found is None:
                return None
            w, multipliers = found
            z = root.T @ (w - shift)
            beyond = self.limits + self.limit_slopes @ z[:size] - z[-1]
            beyond[chosen] = 0.0
            broken = np.flatnonzero(beyond > _ROUNDING)
            if not len(broken):
                break
            chosen = np.concatenate([chosen, broken])
        limits, count = np.zeros(len(self.limits)), len(self.terms)
        limits[chosen] = multipliers[count : count + len(chosen)]
        return Step(np.clip(z[:size], *self.box), multipliers[:count], limits)

    def _square(self, size: int) -> Array:
        square = _PROXIMAL * np.eye(size + 2)
        square[:size, :size] = self.curvature
        return square

    def _rows(self, chosen: Array) -> tuple[Array, Array]:
        """Matrix and bounds of rows (d, t, s) ≤ bound: terms, chosen limits, the excess itself, the box."""
        size, count, kept = len(self.slope), len(self.terms), len(chosen)
        rows = np.zeros((count + kept + 1 + 2 * size, size + 2))
        rows[:count, :size], rows[:count, size] = self.term_slopes, -1.0
        rows[count : count + kept, :size] = self.limit_slopes[chosen]
        rows[count : count + kept + 1, size + 1] = -1.0
        rows[-2 * size : -size, :size], rows[-size:, :size] = np.eye(size), -np.eye(size)
        return rows, np.concatenate([-self.terms, -self.limits[chosen], [0.0], self.box[1], -self.box[0]])


def _least_distance(rows: Array, bounds: Array) -> tuple[Array, Array] | None:
    """The shortest w with rows w ≥ bounds, and its multipliers; None where there is none."""
    system = np.vstack([rows.T, bounds])
    scale = np.linalg.norm(system, axis=0)
    scale[scale == 0.0] = 1.0
    target = np.zeros(len(system))
    target[-1] = 1.0
    try:
        dual = nnls(system / scale, target)[0] / scale
    except RuntimeError:
        return None
    rest = system @ dual - target
    if not rest[-1] < -np.finfo(np.float64).tiny:
        return None
    return -rest[:-1] / rest[-1], -dual / rest[-1]
