"""Sequential quadratic programming on a trajectory problem: SLSQP on logarithmic scales."""

from __future__ import annotations

import copy
from collections.abc import Callable

import numpy as np

from trajevo.base.arrays import Array
from trajevo.formulation.problem import TrajectoryProblem

#: Margin by which limits are tightened, as a share, so that what SLSQP leaves of an excess does not break them.
MARGIN = 1e-8

#: Excess that SLSQP may leave, as a share of a limit; what is left is removed by a greater margin.
_LEFT = 1e-6

#: Least margins that are added in turn for an end that breaks limits, and the greatest excess for which this is tried.
_ROOM, _MOST_EXCESS = (1e-10, 1e-9, 1e-8, 1e-7), 1e-3

#: Greatest number of times that SLSQP is started. It stops early if its approximation of the curvature is wrong; when
#: it is started again from that point, it continues.
_RESTARTS = 6
#: Change of the cost or its logarithm between two starts that counts as none.
_SETTLED = 1e-7


class OutOfEvaluations(Exception):  # noqa: N818 - no error: another way is tried
    """A run of :class:`WeightedSum` was stopped, or has not ended within the points that it may evaluate."""


class WeightedSum:
    """Minimises a weighted sum of objectives under the problem's limits, and optionally within a half-space of them.

    Values and gradients of the last point are cached, since the solver asks for them one after another.

    Args:
        problem: what to solve.
        weights: weights of the objectives, shape (n_obj,).
        half_space: normal (n_obj,) and offset: normal · F may not exceed the offset.
        margin: margin by which every limit is tightened, as a share of it.
        excess: decision vector (n_var,) -> the greatest excess over a limit, by which ends are judged; that of the
            problem itself if None.
        most: greatest number of points at which a run evaluates; not limited if None.
        stop: called before every evaluation with the number of those before; the run ends if it returns True.

    Attributes:
        evaluations: number of points at which values and gradients were evaluated.
        best: the point within all limits with the least weighted sum that was looked at, None if there is none.
    """

    def __init__(
        self,
        problem: TrajectoryProblem,
        weights: Array,
        *,
        half_space: tuple[Array, float] | None = None,
        margin: float = MARGIN,
        excess: Callable[[Array], float] | None = None,
        most: int | None = None,
        stop: Callable[[int], bool] | None = None,
    ) -> None:
        self._stop = stop
        self._excess = excess or (lambda x: greatest_excess(problem, x))
        played = weights != 0.0 if half_space is None else np.full(len(weights), True)
        self.problem, self.weights, self.tame = with_objectives(problem, played), weights, True
        self._rates = weights[played]
        self.half_space, self.margin, self.evaluations = half_space, margin, 0
        self._most, self._left = most, most
        self._room = np.full(self.problem.n_ieq_constr, margin)
        self.logarithmic = problem.xl > 0.0
        self.bounds = np.stack([self._inside(problem.xl), self._inside(problem.xu)], axis=1)
        self.best: Array | None = None
        self._least = np.inf
        self._at: Array | None = None
        self._values: tuple[float, Array, Array, Array] = (0.0, np.empty(0), np.empty(0), np.empty(0))

    def run(self, start: Array, tolerance: float) -> Array:
        """The end of SLSQP from a start, with limits as tight as it takes to keep them exactly.

        If no motion keeps away from all limits, as with a via point on one of them, the search is repeated without a
        margin. An end that breaks limits slightly is sought again with more room at these limits.

        Raises:
            OutOfEvaluations: the run was stopped, or did not end within the points that are allowed.
        """
        self._left = self._most
        for margin in dict.fromkeys((self.margin, 0.0)):
            self._room = np.full(self.problem.n_ieq_constr, margin)
            x = self._ended(start, tolerance)
            for room in _ROOM:
                excess = self._excess(x)
                if not 0.0 < excess <= _MOST_EXCESS:
                    break
                G = self._look(self._inside(x))[2][: len(self._room)]
                self._room = self._room + np.where(-excess < G, max(2.0 * excess, room), 0.0)
                x = self._ended(x, tolerance)
            if self._excess(x) <= 0.0:
                break
        return x

    def _ended(self, start: Array, tolerance: float) -> Array:
        """The end of SLSQP on the logarithm of the cost, or on the cost itself if that end is infeasible."""
        y = self._inside(np.clip(start, self.problem.xl, self.problem.xu))
        for self.tame in (True, False):
            self._at = None
            end, feasible = self._settled(y, tolerance)
            if feasible:
                break
        return np.clip(self._outside(end), self.problem.xl, self.problem.xu)

    def _settled(self, y: Array, tolerance: float) -> tuple[Array, bool]:
        """Start SLSQP again from its own end until that changes nothing; returns the end and whether it is feasible."""
        last, worst, feasible = np.inf, np.inf, False
        for _ in range(_RESTARTS):
            y = np.clip(self._once(y, tolerance), self.bounds[:, 0], self.bounds[:, 1])
            value, _, G, dG = self._look(y)
            excess = float(G.max(initial=-np.inf))
            feasible = excess <= _LEFT
            if feasible and abs(last - value) <= _SETTLED:
                break
            # Give up if the last start has not reduced the excess, or no small step can.
            if not feasible and (excess >= worst or not dG[G > _LEFT].any()):
                break
            last, worst = (value, np.inf) if feasible else (np.inf, excess)
        return y, feasible

    def _once(self, y: Array, tolerance: float) -> Array:
        from scipy.optimize import minimize  # imported where it computes, since that takes long

        limits = {"type": "ineq", "fun": lambda y: -self._look(y)[2], "jac": lambda y: -self._look(y)[3]}
        limited = self.problem.n_ieq_constr or self.half_space is not None
        found = minimize(
            lambda y: self._look(y)[:2],
            y,
            jac=True,
            method="SLSQP",
            bounds=self.bounds,
            constraints=[limits] if limited else [],
            options={"maxiter": 500, "ftol": tolerance},
        )
        end: Array = found.x if np.isfinite(found.x).all() else y
        return end

    def _look(self, y: Array) -> tuple[float, Array, Array, Array]:
        if self._at is None or not np.array_equal(self._at, y):
            if self._left is not None:
                if not self._left:
                    raise OutOfEvaluations
                self._left -= 1
            if self._stop is not None and self._stop(self.evaluations):
                raise OutOfEvaluations
            x = self._outside(y)
            self.evaluations += 1
            F, dF, G, dG = (values[0] for values in self.problem.evaluate_with_gradients(x[None]))
            # A value that nothing moves, such as that of a via point on its limit, cannot keep away from the limit.
            G = G + np.where(dG.any(axis=1), self._room, 0.0)
            if self.half_space is not None:
                normal, offset = self.half_space
                G, dG = np.append(G, normal @ F - offset), np.vstack([dG, normal @ dF])
            stretch = np.where(self.logarithmic, x, 1.0)
            cost, slope = float(F @ self._rates), (self._rates @ dF) * stretch
            if G.max(initial=-np.inf) <= 0.0 and cost < self._least:
                self.best, self._least = x, cost
            # Costs of poor starts are many orders of magnitude above the optimum; their logarithm varies much less.
            value = (np.log(cost), slope / cost) if self.tame and cost > 0.0 else (cost, slope)
            self._values = float(value[0]), value[1], G, dG * stretch
            self._at = y.copy()
        return self._values

    def _inside(self, x: Array) -> Array:
        return np.where(self.logarithmic, np.log(np.where(self.logarithmic, x, 1.0)), x)

    def _outside(self, y: Array) -> Array:
        return np.where(self.logarithmic, np.exp(np.where(self.logarithmic, y, 0.0)), y)


def with_objectives(problem: TrajectoryProblem, played: Array) -> TrajectoryProblem:
    """The same problem with some of its objectives, (n_obj,): others need not be evaluated, and energies take long."""
    if played.all():
        return problem
    other = copy.copy(problem)
    other.objectives = tuple(each for each, wanted in zip(problem.objectives, played, strict=True) if wanted)
    other.n_obj = len(other.objectives)
    return other


def greatest_excess(problem: TrajectoryProblem, x: Array) -> float:
    """The greatest excess over a limit, as a share; a decision vector (n_var,) is feasible if it is at most 0."""
    return float(problem.evaluate(x[None], return_values_of=["F", "G"])[1].max(initial=-np.inf))


def random_starts(problem: TrajectoryProblem, seed: int, count: int) -> Array:
    """Decision vectors uniform between the bounds, shape (count, n_var)."""
    drawn = np.random.default_rng(seed).uniform(problem.xl, problem.xu, (count, problem.n_var))
    return np.asarray(drawn, dtype=np.float64)
