"""Sequential quadratic programming (SQP) of many members of a front at once, each along its own direction.

Every member minimises the greatest difference between its scaled objectives and a reference (Pascoletti and Serafini's
scalarisation with equal rates; on logarithmic scales all objectives fall by the same factor) plus a small share of
their sum (augmented achievement scalarising), under the problem's limits. :class:`Model` is the quadratic program of
one step. :class:`Lockstep` takes the steps of all members together, so that gradients are evaluated in batches.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import final

import daqp
import numpy as np

from trajevo.base.arrays import Array
from trajevo.solvers.gradient.scaling import Scaled

#: Weight of the squares of t (the maximum) and s (the excess), which make the quadratic program strictly convex.
_PROXIMAL = 0.1

#: Excess over a linearised limit that counts as rounding.
_ROUNDING = 1e-9

#: DAQP's flag of a solution.
_SOLVED = 1


@final
@dataclass(frozen=True, eq=False)
class Step:
    """The solution of the quadratic program of one step.

    Attributes:
        d: change of the variables, shape (n,).
        terms: multipliers of the terms of the maximum, shape (k,); their sum is nearly 1.
        limits: multipliers of the limits, shape (m,).
    """

    d: Array
    terms: Array
    limits: Array


@final
@dataclass(frozen=True, eq=False)
class Model:
    """The quadratic program of one step: a minimax problem with linearised terms and limits.

    Attributes:
        curvature: approximate Hessian of the Lagrangian, positive definite, shape (n, n).
        slope: gradient of the function added to the maximum, shape (n,).
        terms: terms of the maximum minus the maximum, at most 0, shape (k,).
        term_slopes: gradients of the terms, shape (k, n).
        limits: values of the limits, at most 0 where kept, shape (m,).
        limit_slopes: gradients of the limits, shape (m, n).
        box: least and greatest change of every variable, shape (2, n).
        penalty: weight of the greatest excess over a limit.
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
        """Decrease of maximum, added function and penalty that a step (n,) promises if slopes are constant."""
        rise = (self.terms + self.term_slopes @ d).max() + self.slope @ d
        excess = max((self.limits + self.limit_slopes @ d).max(initial=0.0), 0.0)
        return float(self.penalty * (max(self.limits.max(initial=0.0), 0.0) - excess) - rise)

    def solve(self) -> Step | None:
        """Minimise t + slope·d + ½ d'Bd + penalty s under terms ≤ t, limits ≤ s, 0 ≤ s and box; None if that fails.

        The squares of t and s are added with a small weight. The dual active-set solver is DAQP (Arnström, Bemporad and
        Axehill, IEEE Transactions on Automatic Control 67, 2022).
        """
        size, count = len(self.slope), len(self.terms)
        square = _PROXIMAL * np.eye(size + 2)
        square[:size, :size] = self.curvature
        rows = np.zeros((count + len(self.limits), size + 2))
        rows[:count, :size], rows[:count, size] = self.term_slopes, -1.0
        rows[count:, :size], rows[count:, size + 1] = self.limit_slopes, -1.0
        least = np.concatenate([self.box[0], [-np.inf, 0.0], np.full(len(rows), -np.inf)])
        most = np.concatenate([self.box[1], [np.inf, np.inf], -self.terms, -self.limits])
        slope = np.concatenate([self.slope, [1.0, self.penalty]])
        z, _, flag, told = daqp.solve(square, slope, rows, most, least, primal_tol=_ROUNDING)
        if flag != _SOLVED or not np.isfinite(z).all():
            return None
        multipliers = told["lam"][size + 2 :]
        return Step(np.clip(z[:size], *self.box), multipliers[:count], multipliers[count:])


#: Share of the promised decrease that a step must achieve.
_SUFFICIENT = 1e-4

#: Factor by which a step that achieves less is shortened, and how many lengths are tried.
_SHORTER, _TRIES = 0.4, 6


#: Failed steps in a row that a member may have; after one more it is done.
_FAILURES = 3

#: Growth of the trust region after a full step, and its least and greatest size.
_GROWTH, _LEAST, _MOST = 2.0, 1e-4, 1.0


#: First penalty of an excess over a limit, in units of the scaled objectives, and its growth.
_PENALTY, _HARDER = 10.0, 3.0

#: The same first penalty of bold steps, how many merits before they are compared with, the least size of their trust
#: region, that after a failure, and its shrinking where a step was shortened more than twice.
_BOLD_PENALTY, _MEMORY, _BOLD_LEAST, _AFRESH, _SHRINKING = 3.0, 10, 1e-3, 0.1, 0.5


#: Least share of the curvature along a step that remains after an update (Powell's damping).
_DAMPING = 0.2

#: Excess over a limit below which a member that has converged is done.
_FEASIBLE = 1e-6


@final
class Lockstep:
    """SQP of M members that take their steps together.

    Args:
        scaled: the problem in scaled variables, with C scaled columns of objectives.
        y: starting points in scaled variables, shape (M, n).
        reference: reference values of the columns, shape (M, C); infinite if a column is not part of the maximum.
        augmentation: share of every column that is added to the maximum, shape (M, C).
        curvature: initial approximation of the Lagrangian's Hessian, shape (M, n, n), or None.
        radius: greatest change of a scaled variable in the first step.
        restarts: how often a member that has converged discards its curvature and continues, since a wrong curvature
            makes it stop early; shape (M,) or one number for all.
        bold: whether steps may raise the merit for a while, limits may be broken at a lower price, the trust region
            does not shrink with every step that is shortened, and a failure uses up a restart instead of ending a
            member. Members from afar, under limits that bind everywhere, then come to an end where they would
            creep along a limit and fail; near an optimum they take more steps.
        memory: how many merits before a bold step is compared with; 1 if none may raise the merit.
        stiffest: greatest curvature of directions that no step has gone along yet. A first step along a stiff direction
            would make all others as stiff, and many steps be too short.

    Attributes:
        y: current points, shape (M, n).
        safe: last point of each member within all limits, or its starting point, shape (M, n).
        curvature: current approximation of the Lagrangian's Hessian, shape (M, n, n).
        converged: which members have ended where their models promise no decrease, shape (M,).
    """

    def __init__(
        self,
        scaled: Scaled,
        y: Array,
        *,
        reference: Array,
        augmentation: Array,
        curvature: Array | None = None,
        radius: float = 0.5,
        restarts: Array | int = 0,
        bold: bool = False,
        memory: int = _MEMORY,
        stiffest: float = np.inf,
    ) -> None:
        self._scaled, self._reference, self._augmentation = scaled, reference, augmentation
        self.y = np.clip(y, *scaled.bounds)
        self.safe = self.y.copy()
        count, size = self.y.shape
        self._unscaled = np.full(count, curvature is None)
        self.curvature = np.repeat(np.eye(size)[None], count, axis=0) if curvature is None else curvature.copy()
        self._penalty, self._radius = np.full(count, _BOLD_PENALTY if bold else _PENALTY), np.full(count, radius)
        self._memory, self._stiffest = memory, stiffest
        self._bold, self._passed = bold, [list[tuple[float, float]]() for _ in range(count)]
        self._restarts, self._failures = np.full(count, restarts), np.zeros(count, dtype=np.int64)
        self._f, self._df, self._g, self._dg = scaled.slopes(self.y)
        good = [np.isfinite(values.reshape(count, -1)).all(axis=1) for values in (self._f, self._df, self._g, self._dg)]
        self._live = np.logical_and.reduce(good)
        self.converged = np.zeros(count, dtype=bool)

    def run(self, steps: Array, tolerance: Array, stop: Callable[[], bool]) -> None:
        """Take steps until every member is done or ``stop`` returns True.

        Args:
            steps: greatest number of steps of each member, shape (M,).
            tolerance: a member is done when its model promises less decrease than this, shape (M,).
            stop: called before every step.
        """
        for number in range(steps.max(initial=0)):
            self._live &= steps > number
            if stop():
                break
            solved = {int(i): self._step(int(i), tolerance[i]) for i in np.flatnonzero(self._live)}
            going = {i: found for i, found in solved.items() if found is not None}
            self._live[[i for i in solved if i not in going]] = False
            if not going:
                break
            found = list(going.values())
            self._advance(np.array(list(going)), [step for step, _ in found], np.array([gain for _, gain in found]))

    def _step(self, i: int, tolerance: float) -> tuple[Step, float] | None:
        """The next step of a member and the decrease that it promises; None if the member is done."""
        model = self._model(i)
        step = model.solve()
        at_rest = step is None or (model.decrease(step.d) < tolerance and self._g[i].max(initial=0.0) < _FEASIBLE)
        if at_rest and self._restarts[i]:
            self._restarts[i] -= 1
            self._forget(i)
            return self._step(i, tolerance)
        if at_rest or step is None:
            self.converged[i] = step is not None
            return None
        if 2.0 * step.limits.sum() > self._penalty[i]:
            self._penalty[i] *= _HARDER
        rates = self._augmentation[i].copy()
        rates[np.isfinite(self._reference[i])] += step.terms
        return Step(step.d, rates, step.limits), model.decrease(step.d)

    def _model(self, i: int) -> Model:
        """The quadratic program of a member at its current point."""
        played = np.isfinite(self._reference[i])
        terms = self._f[i, played] - self._reference[i, played]
        reach = self._scaled.bounds - self.y[i]
        return Model(
            curvature=self.curvature[i],
            slope=self._augmentation[i] @ self._df[i],
            terms=terms - terms.max(),
            term_slopes=self._df[i, played],
            limits=self._g[i],
            limit_slopes=self._dg[i],
            box=np.clip(reach, -self._radius[i], self._radius[i]),
            penalty=float(self._penalty[i]),
        )

    def _advance(self, going: Array, steps: list[Step], promised: Array) -> None:
        """Shorten steps until they achieve enough of what they promise, and take them; count the failed ones."""
        d = np.stack([step.d for step in steps])
        share, todo = np.ones(len(going)), np.arange(len(going))
        before = self._worst(going) if self._bold else self._merit(going, self._f[going], self._g[going])
        for _ in range(_TRIES):
            rows = going[todo]
            after = self._merit(rows, *self._scaled.values(self.y[rows] + share[todo, None] * d[todo]))
            todo = todo[~(after <= before[todo] - _SUFFICIENT * share[todo] * promised[todo])]
            if not len(todo):
                break
            share[todo] *= _SHORTER
        if self._bold:
            self._resize(going, d, share, todo)
        else:
            self._resize_and_count(going, d, share, todo)
        moved = np.delete(np.arange(len(going)), todo)
        if len(moved):
            self._move(going[moved], share[moved, None] * d[moved], [steps[k] for k in moved])

    def _resize_and_count(self, going: Array, d: Array, share: Array, failed: Array) -> None:
        """New trust regions, as large as the steps taken allow; members that have failed too often are done."""
        smallest = self._radius[going] == _LEAST
        size = np.where(share == 1.0, self._radius[going], np.abs(share[:, None] * d).max(axis=1))
        self._radius[going] = np.clip(_GROWTH * size, _LEAST, _MOST)
        vain = np.isin(np.arange(len(going)), failed)
        # With the smallest radius the same step would fail again and again.
        self._failures[going] = np.where(vain, self._failures[going] + 1 + _FAILURES * smallest, 0)
        self._live[going[self._failures[going] > _FAILURES]] = False

    def _resize(self, going: Array, d: Array, share: Array, failed: Array) -> None:
        """New trust regions of bold steps; members that have failed begin afresh, or are done."""
        reached = np.abs(d).max(axis=1) > 0.99 * self._radius[going]
        shortened = np.where(share >= _SHORTER**2, 1.0, _SHRINKING)
        factor = np.where(share == 1.0, np.where(reached, _GROWTH, 1.0), shortened)
        self._radius[going] = np.clip(factor * self._radius[going], _BOLD_LEAST, _MOST)
        for i in going[failed]:
            self._live[i] = self._restarts[i] > 0
            self._restarts[i] -= 1
            self._forget(i)
            self._passed[i], self._radius[i] = [], _AFRESH

    def _worst(self, going: Array) -> Array:
        """The greatest merit of the last points of every member, at its penalty of today."""
        value = self._values(going, self._f[going])
        excess = np.maximum(self._g[going].max(axis=1, initial=0.0), 0.0)
        for k, i in enumerate(going):
            self._passed[i] = [*self._passed[i], (float(value[k]), float(excess[k]))][-self._memory :]
        return np.array([max(v + self._penalty[i] * e for v, e in self._passed[i]) for i in going])

    def _move(self, rows: Array, taken: Array, steps: list[Step]) -> None:
        y = np.clip(self.y[rows] + taken, *self._scaled.bounds)
        new = self._scaled.slopes(y)
        for k, i in enumerate(rows):
            if not all(np.isfinite(values[k]).all() for values in new):
                self._live[i] = False
                continue
            step, taken_now = steps[k], y[k] - self.y[i]
            binding = np.flatnonzero(step.limits)
            bent = step.terms @ (new[1][k] - self._df[i])
            bent = bent + step.limits[binding] @ (new[3][k][binding] - self._dg[i][binding])
            self._bend(i, taken_now, bent)
            self.y[i] = y[k]
            self._f[i], self._df[i], self._g[i], self._dg[i] = (values[k] for values in new)
            if self._g[i].max(initial=-np.inf) <= 0.0:
                self.safe[i] = y[k]

    def _forget(self, i: int) -> None:
        self.curvature[i] = np.eye(self.y.shape[1])
        self._unscaled[i] = True

    def _bend(self, i: int, step: Array, bent: Array) -> None:
        """Damped BFGS update of a member's curvature, from a step (n,) and the change of the gradient (n,)."""
        square = step @ step
        if not square > 0.0:
            return
        if self._unscaled[i]:
            self._unscaled[i] = False
            if bent @ step > 1e-3 * square:
                self.curvature[i] *= min((bent @ step) / square, self._stiffest)
        ahead = self.curvature[i] @ step
        along = step @ ahead
        if step @ bent < _DAMPING * along:
            share = (1.0 - _DAMPING) * along / (along - step @ bent)
            bent = share * bent + (1.0 - share) * ahead
        self.curvature[i] += np.outer(bent, bent) / (step @ bent) - np.outer(ahead, ahead) / along

    @property
    def merit(self) -> Array:
        """What every member minimises at its current point, with the same penalty of an excess for all, shape (M,)."""
        return self.merit_at(_PENALTY)

    def merit_at(self, price: float) -> Array:
        """The same with another penalty of an excess."""
        excess = np.maximum(self._g.max(axis=1, initial=0.0), 0.0)
        merit: Array = self._values(np.arange(len(self.y)), self._f) + price * excess
        return np.where(np.isfinite(merit), merit, np.inf)

    def _merit(self, rows: Array, f: Array, g: Array) -> Array:
        merit: Array = self._values(rows, f) + self._penalty[rows] * np.maximum(g.max(axis=1, initial=0.0), 0.0)
        return merit

    def _values(self, rows: Array, f: Array) -> Array:
        """The greatest difference from the reference and the share of the sum, shape (rows,)."""
        reference, augmentation = self._reference[rows], self._augmentation[rows]
        played = np.isfinite(reference)
        top = np.where(played, f - np.where(played, reference, 0.0), -np.inf).max(axis=1)
        values: Array = top + np.where(augmentation > 0.0, augmentation * f, 0.0).sum(axis=1)
        return values
