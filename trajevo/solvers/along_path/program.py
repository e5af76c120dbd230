"""Convex programs over the control points of u(t) and the time, by a primal-dual interior-point method.

Limits at instants touch a few neighbouring control points each, so that the matrix of Newton's steps is banded but for
the row and column of the time; a step costs time in proportion to the number of instants. The method is Mehrotra's
predictor and corrector (Nocedal and Wright, Numerical Optimization, algorithms 14.3 and 16.4).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.solvers.along_path.instants import HELD, Instants

#: Greatest number of steps, the gap at which they end, and the greatest residual then.
_STEPS, _GAP, _RESIDUAL = 40, 1e-6, 1e-6

#: Share of the way to the boundary that a step goes, and the least slack to begin with.
_SHORT, _SLACK = 0.995, 1e-2

#: Share by which the diagonal is raised, so that rounding leaves it positive.
_RAISED = 1e-13


@final
@dataclass(frozen=True, eq=False)
class Linearised:
    """PathLimits near given states and a given time T: -below <= slopes · (change of the states) <= above.

    Both sides move with the time. All of them are shares of a limit.

    Attributes:
        slopes: derivatives with respect to u and its derivatives in unit time, shape (K, R, 4).
        above: what is left to the limit above, shape (K, R).
        below: what is left to the limit below, shape (K, R).
        slower_above: by how much more ``above`` is per unit of ln T, shape (K, R).
        slower_below: by how much more ``below`` is per unit of ln T, shape (K, R).
    """

    slopes: Array
    above: Array
    below: Array
    slower_above: Array
    slower_below: Array

    @classmethod
    def joined(cls, parts: Sequence[Linearised]) -> Linearised:
        """All limits of several kinds at the same instants."""
        names = ("slopes", "above", "below", "slower_above", "slower_below")
        return cls(*(np.concatenate([getattr(part, name) for part in parts], axis=1) for name in names))

    def nearer(self, least: float) -> Linearised:
        """Only the limits of which a share is used somewhere that is at least so much."""
        kept = np.minimum(self.above, self.below).min(axis=0) <= 1.0 - least
        names = ("slopes", "above", "below", "slower_above", "slower_below")
        return Linearised(*(getattr(self, name)[:, kept] for name in names))


@final
@dataclass(frozen=True, eq=False)
class Quadratic:
    """What is minimised of the moves x of the control points: gradient · x + x · curvature x / 2.

    Attributes:
        gradient: shape (count,).
        curvature: lower diagonals, shape (order, count).
    """

    gradient: Array
    curvature: Array


@final
class Program:
    """Change control points and ln T within linearised limits.

    Args:
        instants: where the limits are.
        limits: the limits.
        steps: differences of neighbouring control points, none of which may become negative, shape (count - 1,).
        reach: greatest change of a control point.
        cost: what is minimised at a constant time; None to minimise ln T.
    """

    def __init__(
        self, instants: Instants, limits: Linearised, steps: Array, reach: float, cost: Quadratic | None = None
    ) -> None:
        self._at, self._limits, self._cost = instants, limits, cost
        self._free = instants.free
        self._moved = slice(HELD - 1, instants.count - HELD)  # the steps that free control points change
        self._size, self._rows = instants.count - 2 * HELD, limits.above.size
        box = np.full(self._size, reach)
        self._room = np.concatenate([limits.above.ravel(), limits.below.ravel(), box, box, steps[self._moved]])
        self._ends = np.cumsum([0, self._rows, self._rows, self._size, self._size])
        self._timed = cost is None

    def solve(self) -> tuple[Array, float]:
        """The change of all control points (count,), and of ln T."""
        from scipy.linalg import LinAlgError  # imported where it computes, since that takes long

        x, time, slack = np.zeros(self._size), 0.0, np.maximum(self._room, _SLACK)
        dual = self._first_dual(slack)
        for _ in range(_STEPS):
            slope, of_time = self._transposed(dual)
            slope, of_time = slope + self._gradient(x), of_time + 1.0
            short = self._product(x, time) + slack - self._room
            gap = float(slack @ dual)
            if gap < _GAP and np.abs(short).max() < _RESIDUAL:
                break
            try:
                newton = self._factored(dual / slack)
            except LinAlgError:  # at the limit of what rounding allows
                break
            residuals = slope, of_time, short
            aim = self._direction(newton, residuals, slack, dual, slack * dual)
            reached = [_longest(v, d) for v, d in ((slack, aim[2]), (dual, aim[3]))]
            if not self._timed:
                reached = [min(reached)] * 2
            left = float((slack + reached[0] * aim[2]) @ (dual + reached[1] * aim[3]))
            centre = (left / gap) ** 3 * gap / len(slack)
            move = self._direction(newton, residuals, slack, dual, slack * dual + aim[2] * aim[3] - centre)
            go = [min(1.0, _SHORT * _longest(v, d)) for v, d in ((slack, move[2]), (dual, move[3]))]
            if not self._timed:
                go = [min(go)] * 2
            x, time, slack, dual = (
                x + go[0] * move[0],
                time + go[0] * move[1],
                slack + go[0] * move[2],
                dual + go[1] * move[3],
            )
        whole = np.zeros(self._at.count)
        whole[self._free] = x
        return whole, time

    def _first_dual(self, slack: Array) -> Array:
        """Multipliers to begin with: those that balance the time, or of the size of the cost."""
        if self._timed:
            pull = float(self._limits.slower_above.sum() + self._limits.slower_below.sum())
            return np.full(len(slack), 1.0 / pull)
        return 1.0 / (slack * len(slack))

    def _gradient(self, x: Array) -> Array:
        if self._cost is None:
            return np.zeros(self._size)
        slope: Array = self._cost.gradient[self._free] + _banded_product(self._curvature, x)
        return slope

    @cached_property
    def _curvature(self) -> Array:
        return np.zeros((1, self._size)) if self._cost is None else self._cost.curvature[:, self._free]

    def _product(self, x: Array, time: float) -> Array:
        """Left sides of all limits."""
        limits, whole = self._limits, np.zeros(self._at.count)
        whole[self._free] = x
        change = np.matmul(limits.slopes, self._at.states(whole)[:, :, None])[:, :, 0]
        above, below = change - limits.slower_above * time, -change - limits.slower_below * time
        return np.concatenate([above.ravel(), below.ravel(), x, -x, -np.diff(whole)[self._moved]])

    def _parts(self, values: Array) -> tuple[Array, Array, Array, Array, Array]:
        """Values of all limits, by kind: above and below (K, R), the reach up and down, and the steps."""
        above, below, up, down, steps = np.split(values, self._ends[1:])
        shape = self._limits.above.shape
        return above.reshape(shape), below.reshape(shape), up, down, steps

    def _transposed(self, dual: Array) -> tuple[Array, float]:
        """Sums of the limits' slopes times multipliers: for the control points, and for the time."""
        above, below, up, down, steps = self._parts(dual)
        whole = self._at.spread(np.matmul((above - below)[:, None, :], self._limits.slopes)[:, 0])
        whole[self._moved] += steps
        whole[HELD : self._moved.stop + 1] -= steps
        of_time = -float((above * self._limits.slower_above).sum() + (below * self._limits.slower_below).sum())
        return whole[self._free] + up - down, of_time

    def _factored(self, weights: Array) -> tuple[Array, Array, Array, float, Array]:
        """The banded factor of the sum of weighted squares of all limits, and its border for the time."""
        from scipy.linalg import cho_solve_banded, cholesky_banded

        above, below, up, down, steps = self._parts(weights)
        slopes = self._limits.slopes
        weighted = np.swapaxes(slopes, 1, 2) * (above + below)[:, None, :]
        band = self._at.gram(np.matmul(weighted, slopes))
        first = np.arange(self._moved.start, self._moved.stop)
        band[0, first] += steps
        band[0, first + 1] += steps
        band[1, first] -= steps
        inner = band[:, self._free].copy()
        inner[0] += up + down
        inner[: len(self._curvature)] += self._curvature
        inner[0] *= 1.0 + _RAISED
        factor = cholesky_banded(inner, lower=True, check_finite=False)
        if not self._timed:
            return factor, np.zeros(self._size), np.zeros(self._size), 1.0, weights
        by_time = below * self._limits.slower_below - above * self._limits.slower_above
        border = self._at.spread(np.matmul(by_time[:, None, :], slopes)[:, 0])[self._free]
        corner = float((above * self._limits.slower_above**2 + below * self._limits.slower_below**2).sum())
        solved = cho_solve_banded((factor, True), border, check_finite=False)
        return factor, border, solved, corner - float(border @ solved), weights

    def _direction(
        self,
        newton: tuple[Array, Array, Array, float, Array],
        residuals: tuple[Array, float, Array],
        slack: Array,
        dual: Array,
        aim: Array,
    ) -> tuple[Array, float, Array, Array]:
        """Newton's direction to products of slacks and multipliers that are less by ``aim``."""
        from scipy.linalg import cho_solve_banded

        factor, border, solved, corner, weights = newton
        slope, of_time, short = residuals
        lifted = (dual * short - aim) / slack
        own, own_time = self._transposed(lifted)
        x = cho_solve_banded((factor, True), -slope - own, check_finite=False)
        time = (-of_time - own_time - float(border @ x)) / corner if self._timed else 0.0
        x = x - solved * time
        product = self._product(x, time)
        return x, time, -short - product, lifted + weights * product


def _longest(values: Array, direction: Array) -> float:
    """Greatest share of a direction, at most 1, along which no value becomes negative."""
    return min(1.0, 1.0 / max(1e-300, float((-direction / values).max())))


def _banded_product(band: Array, x: Array) -> Array:
    """A symmetric matrix, given by its lower diagonals, times a vector."""
    product: Array = band[0] * x
    for below in range(1, len(band)):
        side = band[below, :-below]
        product[below:] += side * x[:-below]
        product[:-below] += side * x[below:]
    return product
