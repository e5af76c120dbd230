"""Minimise a weighted sum of objectives by gradients, from many starts."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from trajevo.base.arrays import Array, frozen, numbers, one_blas_thread
from trajevo.base.shown.brief import brief
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.formulation.problem import TrajectoryProblem, Weights
from trajevo.solvers.gradient.exchange import at_samples, exchanged, proves
from trajevo.solvers.gradient.sqp import OutOfEvaluations, WeightedSum, greatest_excess, random_starts
from trajevo.trajectory.batch import TrajectoryBatch

#: Points that SLSQP evaluates under limits that are proven between samples, before they are exchanged.
_MOST = 60


@dataclass(frozen=True, eq=False)
class WeightedOptimum:
    """The least weighted sum that a gradient solver found.

    Attributes:
        problem: the problem.
        x: decision vector, shape (n_var,).
        cost: its weighted sum [1]; inf if no start ended at a feasible point.
        F: objective name -> value, SI.
        G: constraint name -> excess as a share of the limit, at most 0 if the cost is finite.
        costs: weighted sum at the end of every start [1], inf where infeasible, shape (starts,).
        seconds: wall time [s].
    """

    problem: TrajectoryProblem
    x: Array
    cost: float
    F: dict[str, float]
    G: dict[str, float]
    costs: Array
    seconds: float

    __repr__ = brief

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

    Decision variables with positive bounds have a logarithmic scale, and so has a positive cost. Random starts are
    uniform between the bounds. Limits that are proven between samples are kept by exchange, see
    :mod:`trajevo.solvers.gradient.exchange`.

    Args:
        problem: what to solve.
        weights: weights w and scales ξ of the objectives; all scales are 1 if they are None.
        seed: seed of the random starts.
        starts: number of random starts.
        initial: decision vectors to start from instead of random ones, shape (starts, n_var).
        tolerance: SLSQP's tolerance on the cost's logarithm [1].

    Returns:
        The best feasible end point, and the cost at the end of every start.

    Raises:
        InvalidInputError: a wrong number of weights or scales, a negative weight, weights that are all zero, a scale
            that is not positive, a start outside the bounds, or no start at all.
    """
    share = numbers(weights.weights, name="weights", shape=(problem.n_obj,))
    scales = numbers(
        np.ones(problem.n_obj) if weights.scales is None else weights.scales, name="scales", shape=(problem.n_obj,)
    )
    if (share < 0.0).any() or not share.any():
        raise InvalidInputError(f"weights: expected non-negative numbers that are not all zero, got {share.tolist()}")
    if (scales <= 0.0).any():
        raise InvalidInputError(f"scales: expected positive numbers, got {scales.tolist()}")
    most = _MOST if proves(problem) else None
    search = WeightedSum(problem.in_terms(), share / scales, excess=lambda x: greatest_excess(problem, x), most=most)
    points = (
        random_starts(problem, seed, starts)
        if initial is None
        else numbers(initial, name="initial", shape=("starts", problem.n_var))
    )
    if not len(points):
        raise InvalidInputError("starts: expected at least 1")
    if ((points < problem.xl) | (points > problem.xu)).any():
        raise InvalidInputError("initial: a start lies outside the bounds of the decision variables")
    import scipy.linalg  # noqa: F401 - its threads are only limited once it is loaded

    began = time.perf_counter()
    with one_blas_thread():
        ends = np.array([_end(problem, search, point, tolerance) for point in points])
    F, G = problem.evaluate(ends, return_values_of=["F", "G"])
    costs = np.where(G.max(axis=1, initial=-np.inf) <= 0.0, F @ search.weights, np.inf)
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


def _end(problem: TrajectoryProblem, search: WeightedSum, start: Array, tolerance: float) -> Array:
    """The end of the search from a start.

    Under limits that are proven between samples, those at the samples are kept first, since peaks between them have
    kinks. Where the proof does not hold there, a few steps may mend it; else limits are exchanged.
    """
    if not proves(problem):
        return search.run(start, tolerance)
    sampled = at_samples(problem)
    first = WeightedSum(sampled.in_terms(), search.weights, excess=lambda x: greatest_excess(sampled, x))
    near = first.run(start, tolerance)
    if greatest_excess(problem, near) <= 0.0:
        return near
    try:
        end = search.run(near, tolerance)
        if greatest_excess(problem, end) <= 0.0:
            return end
    except OutOfEvaluations:
        pass
    found = exchanged(problem, search.weights, near, tolerance)
    return near if found is None else found
