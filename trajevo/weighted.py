"""The gradient solver beside the evolutionary one: the least weighted sum of objectives from many starts."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from trajevo.arrays import Array, frozen, numbers
from trajevo.dynamics import Rollout
from trajevo.errors import InvalidInputError
from trajevo.problem import TrajectoryProblem
from trajevo.selection import Weights
from trajevo.trajectory import TrajectoryBatch

#: Excess, as a share of a limit, up to which a result of the solver counts as feasible.
FEASIBLE = 1e-6

#: SLSQP stops early where its model of the curvature goes wrong; a fresh start from there mends it.
_RESTARTS = 6
#: Change of the cost or its logarithm between two starts that counts as none.
_SETTLED = 1e-7


@dataclass(frozen=True, eq=False)
class WeightedOptimum:
    """The least weighted sum that a gradient solver found.

    Attributes:
        problem: the problem.
        x: decision vector, shape (n_var,).
        cost: its weighted sum; inf if no start ended at a feasible point.
        F: objective name -> value, SI.
        G: constraint name -> value, as a share of the limit.
        costs: weighted sum at the end of every start, inf where infeasible, shape (starts,).
        seconds: wall time [s].
    """

    problem: TrajectoryProblem
    x: Array
    cost: float
    F: dict[str, float]
    G: dict[str, float]
    costs: Array
    seconds: float

    @property
    def trajectory(self) -> TrajectoryBatch:
        """Its trajectory, a batch of one."""
        return self.problem.decode(self.x)

    @property
    def rollout(self) -> Rollout:
        """The robot on its trajectory."""
        return self.problem.rollout(self.x)


def minimise_weighted(
    problem: TrajectoryProblem,
    weights: Weights,
    *,
    seed: int,
    starts: int = 20,
    initial: Array | None = None,
    tolerance: float = 1e-9,
) -> WeightedOptimum:
    """Minimise Σ w F/ξ under the problem's limits by SLSQP, with exact gradients, from random starts.

    Decision variables with positive bounds, and positive costs, are taken on a logarithmic scale. Starts are uniform
    between the bounds.

    Args:
        problem: what to solve.
        weights: weights and, per objective, the scale it is divided by (1 where None).
        seed: seed of the random starts.
        starts: how many.
        initial: starts of the caller's own instead, shape (starts, n_var).
        tolerance: SLSQP's tolerance on the cost's logarithm.

    Returns:
        The best feasible end point, and the cost at the end of every start.

    Raises:
        InvalidInputError: weights of another number, a start outside the bounds, or no start at all.
    """
    share = numbers(weights.weights, name="weights", shape=(problem.n_obj,))
    scales = numbers(
        np.ones(problem.n_obj) if weights.scales is None else weights.scales, name="scales", shape=(problem.n_obj,)
    )
    if (share < 0.0).any() or not share.any():
        raise InvalidInputError(f"weights: expected non-negative numbers that are not all zero, got {share.tolist()}")
    if (scales <= 0.0).any():
        raise InvalidInputError(f"scales: expected positive numbers, got {scales.tolist()}")
    search = _Search(problem, share / scales)
    points = (
        search.random(seed, starts)
        if initial is None
        else numbers(initial, name="initial", shape=("starts", problem.n_var))
    )
    if not len(points):
        raise InvalidInputError("starts: expected at least 1")
    if ((points < problem.xl) | (points > problem.xu)).any():
        raise InvalidInputError("initial: a start lies outside the bounds of the decision variables")
    began = time.perf_counter()
    ends = np.array([search.run(point, tolerance) for point in points])
    F, G = problem.evaluate(ends, return_values_of=["F", "G"])
    costs = np.where(G.max(axis=1, initial=-np.inf) <= FEASIBLE, F @ search.weights, np.inf)
    best = int(np.argmin(costs))
    return WeightedOptimum(
        problem=problem,
        x=frozen(ends[best].copy()),
        cost=float(costs[best]),
        F=dict(zip(problem.objective_names, F[best].tolist(), strict=True)),
        G=dict(zip(problem.constraint_names, G[best].tolist(), strict=True)),
        costs=frozen(costs),
        seconds=time.perf_counter() - began,
    )


class _Search:
    """One problem on the solver's own scale; values and gradients of the last point are kept for its next question."""

    def __init__(self, problem: TrajectoryProblem, weights: Array) -> None:
        self.problem, self.weights, self.tame = problem, weights, True
        self.logarithmic = problem.xl > 0.0
        self.bounds = np.stack([self._inside(problem.xl), self._inside(problem.xu)], axis=1)
        self._at: Array | None = None
        self._values: tuple[float, Array, Array, Array] = (0.0, np.empty(0), np.empty(0), np.empty(0))

    def random(self, seed: int, count: int) -> Array:
        """Uniform between the bounds."""
        drawn = np.random.default_rng(seed).uniform(self.problem.xl, self.problem.xu, (count, self.problem.n_var))
        return np.asarray(drawn, dtype=np.float64)

    def run(self, start: Array, tolerance: float) -> Array:
        """Where SLSQP ends on the logarithm of the cost; on the cost itself where that end is infeasible."""
        y = self._inside(start)
        for self.tame in (True, False):
            self._at = None
            end, feasible = self._settled(y, tolerance)
            if feasible:
                break
        return np.clip(self._outside(end), self.problem.xl, self.problem.xu)

    def _settled(self, y: Array, tolerance: float) -> tuple[Array, bool]:
        """SLSQP, started again from its own end until that changes nothing; whether the end is feasible."""
        last, feasible = np.inf, False
        for _ in range(_RESTARTS):
            y = np.clip(self._once(y, tolerance), self.bounds[:, 0], self.bounds[:, 1])
            value, _, G, _ = self._look(y)
            feasible = bool(G.max(initial=-np.inf) <= FEASIBLE)
            if feasible and abs(last - value) <= _SETTLED:
                break
            last = value if feasible else np.inf
        return y, feasible

    def _once(self, y: Array, tolerance: float) -> Array:
        limits = {"type": "ineq", "fun": lambda y: -self._look(y)[2], "jac": lambda y: -self._look(y)[3]}
        found = minimize(
            lambda y: self._look(y)[:2],
            y,
            jac=True,
            method="SLSQP",
            bounds=self.bounds,
            constraints=[limits] if self.problem.n_ieq_constr else [],
            options={"maxiter": 500, "ftol": tolerance},
        )
        end: Array = found.x if np.isfinite(found.x).all() else y
        return end

    def _look(self, y: Array) -> tuple[float, Array, Array, Array]:
        if self._at is None or not np.array_equal(self._at, y):
            x = self._outside(y)
            F, dF, G, dG = (values[0] for values in self.problem.evaluate_with_gradients(x[None]))
            stretch = np.where(self.logarithmic, x, 1.0)
            cost, slope = float(F @ self.weights), (self.weights @ dF) * stretch
            # Costs of poor starts are many orders above the optimum; their logarithm is a far tamer function.
            value = (np.log(cost), slope / cost) if self.tame and cost > 0.0 else (cost, slope)
            self._values = float(value[0]), value[1], G, dG * stretch
            self._at = y.copy()
        return self._values

    def _inside(self, x: Array) -> Array:
        return np.where(self.logarithmic, np.log(np.where(self.logarithmic, x, 1.0)), x)

    def _outside(self, y: Array) -> Array:
        return np.where(self.logarithmic, np.exp(np.where(self.logarithmic, y, 0.0)), y)
