"""Weighted sums under limits that are proven between samples, by exchange: solve at samples, tighten, solve again.

The proven excess of an effort or of the tool's speed has kinks wherever its peak moves to another instant, at which a
gradient solver takes hundreds of small steps. At samples it takes tens. What the proof then finds above a limit is
mended by a slightly slower motion on the same path. Where that costs too much, or no slower motion keeps the limit, the
excess is taken off the limit at the samples, and the search goes on from where it ended.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.rollout import Rollout
from trajevo.formulation.constraints.constraint import Constraint
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.solvers.gradient.sqp import OutOfEvaluations, WeightedSum, greatest_excess, with_objectives

#: How often limits are tightened until the proof succeeds, and how often the room is halved again towards the last
#: one at which it did not.
_TIGHTENED, _HALVED = 10, 8

#: Share of the excess, and of a limit at least, that is taken off.
_MORE, _LEAST = 1.1, 1e-6

#: Samples of a segment while limits are exchanged, as a multiple of the problem's own.
_FINER = 4

#: Change of the cost, as a share, that ends the halving.
_SETTLED = 1e-6

#: Rise of the cost, as a share, that slowing down may bring: limits that are tightened could gain no more.
_NEARLY = 1e-4

#: Least share by which a motion is slowed down, how often that is doubled, and how finely the last doubling is divided.
_STEP, _DOUBLINGS, _BETWEEN = 1e-5, 16, 8


def proves(problem: TrajectoryProblem) -> bool:
    """Whether some limits of a problem are proven between samples."""
    return any(constraint.sampled is not None for constraint in problem.constraints)


def at_samples(problem: TrajectoryProblem) -> TrajectoryProblem:
    """The same problem with all limits that are proven between samples kept at the samples alone."""
    if not proves(problem):
        return problem
    other = copy.copy(problem)
    other.constraints = tuple(constraint.at_samples for constraint in problem.constraints)
    return other


def exchanged(
    problem: TrajectoryProblem,
    weights: Array,
    start: Array,
    tolerance: float,
    *,
    stop: Callable[[int], bool] | None = None,
) -> Array | None:
    """The end of the search from a start.

    Args:
        problem: a problem with limits that are proven between samples.
        weights: weights of the objectives, shape (n_obj,).
        start: decision vector, shape (n_var,).
        tolerance: SLSQP's tolerance on the cost's logarithm [1].
        stop: called before every evaluation of a gradient; the search ends if it returns True.

    Returns:
        A decision vector (n_var,) that keeps every limit by the problem's own test; None if none is found in this way.

    Raises:
        OutOfEvaluations: the search was stopped before it found one.
    """
    problem, weights = _finer(with_objectives(problem, weights != 0.0)), weights[weights != 0.0]
    best = _Best(problem, weights)
    best.look(start)
    try:
        _exchange(best, start, tolerance, stop)
    except OutOfEvaluations:
        if best.x is None:
            raise
    return best.x


def slower(problem: TrajectoryProblem, x: Array) -> Array | None:
    """A motion, or the same slowed down as little as it takes to keep every limit, if that is a third at most.

    Args:
        problem: a problem, whose own test decides.
        x: decision vector, shape (n_var,).

    Returns:
        A decision vector (n_var,) whose times are longer by one factor, as far as bounds allow; None if none keeps the
        limits, as where the robot cannot hold itself.
    """
    if greatest_excess(problem, x) <= 0.0:
        return x
    times = stretching_times(problem)
    if not times.any():
        return None
    shares, before = _STEP * 2.0 ** np.arange(_DOUBLINGS), 0.0
    found = None
    for _ in range(2):
        X = np.minimum(np.where(times, x * (1.0 + shares[:, None]), x), problem.xu)
        good = np.flatnonzero((problem.evaluate(X, return_values_of=["F", "G"])[1] <= 0.0).all(axis=1))
        if not len(good):
            break
        first = int(good[0])
        found, before, share = X[first], shares[first - 1] if first else before, shares[first]
        shares = np.linspace(before, share, _BETWEEN + 1)[1:-1]
    return found


def stretching_times(problem: TrajectoryProblem) -> Array:
    """Which variables are times with positive bounds, shape (n_var,)."""
    return np.array([variable.unit == "s" and variable.lower > 0.0 for variable in problem.variables])


@final
class _Best:
    """The cheapest decision vector so far that keeps every limit, as it was found or slowed down.

    Args:
        problem: the problem, with the objectives that play a part.
        weights: their weights, shape (n_obj,).

    Attributes:
        problem: the problem.
        weights: the weights.
        x: the decision vector, shape (n_var,), or None.
        cost: its cost.
    """

    def __init__(self, problem: TrajectoryProblem, weights: Array) -> None:
        self.problem, self.weights = problem, weights
        self.x: Array | None = None
        self.cost = np.inf

    def look(self, x: Array) -> float:
        """Look at a decision vector (n_var,); returns its cost as it is."""
        own, kept = self._cost(x), slower(self.problem, x)
        if kept is not None:
            cost = own if kept is x else self._cost(kept)
            if cost < self.cost:
                self.x, self.cost = kept, cost
        return own

    def _cost(self, x: Array) -> float:
        return float(self.problem.evaluate(x[None], return_values_of=["F", "G"])[0][0] @ self.weights)


def _exchange(best: _Best, start: Array, tolerance: float, stop: Callable[[int], bool] | None) -> None:
    """Solve at samples and tighten limits until the proof holds, nearly without cost; keep the best on the way."""
    problem, weights = best.problem, best.weights
    few, rooms, x = np.zeros(len(problem.constraints)), np.zeros(len(problem.constraints)), start
    for _ in range(_TIGHTENED):
        x, kept = _ended(_tightened(problem, rooms), weights, x, tolerance, stop)
        cost, excess = best.look(x), _by_constraint(problem, x)
        if not kept or best.cost - cost <= _NEARLY * abs(cost):
            return
        if (excess <= 0.0).all():
            break
        few, rooms = rooms, rooms + np.where(excess > 0.0, np.maximum(_MORE * excess, _LEAST), 0.0)
    else:
        return
    # The excess of what is not decided may be a coarse bound, so that more was taken off than the proof needs.
    for _ in range(_HALVED if rooms.any() else 0):
        middle, before = 0.5 * (few + rooms), best.cost
        x, kept = _ended(_tightened(problem, middle), weights, x, tolerance, stop)
        if not kept or greatest_excess(problem, x) > 0.0:
            few = middle
            continue
        rooms = middle
        best.look(x)
        if before - best.cost <= _SETTLED * abs(before):
            break


def _finer(problem: TrajectoryProblem) -> TrajectoryProblem:
    """The same problem with more samples, so that little has to be taken off what is not near them."""
    other = copy.copy(problem)
    other.dynamics = replace(problem.dynamics, samples=_FINER * problem.dynamics.samples)
    return other


def _ended(
    tightened: TrajectoryProblem,
    weights: Array,
    start: Array,
    tolerance: float,
    stop: Callable[[int], bool] | None,
) -> tuple[Array, bool]:
    """The end of SLSQP from a start, and whether it keeps the limits at the samples."""
    search = WeightedSum(tightened.in_terms(), weights, excess=partial(greatest_excess, tightened), stop=stop)
    x = search.run(start, tolerance)
    return x, greatest_excess(tightened, x) <= 0.0


def _by_constraint(problem: TrajectoryProblem, x: Array) -> Array:
    """The greatest excess of every constraint, as a share of its limit, shape (n_constraints,)."""
    G = problem.evaluate(x[None], return_values_of=["F", "G"])[1][0]
    ends = np.cumsum([len(constraint.names) for constraint in problem.constraints])
    return np.array([column.max(initial=-np.inf) for column in np.split(G, ends[:-1])])


def _tightened(problem: TrajectoryProblem, rooms: Array) -> TrajectoryProblem:
    """The same problem with its limits at the samples, less a share of each, shape (n_constraints,)."""
    other = copy.copy(problem)
    pairs = zip(problem.constraints, rooms.tolist(), strict=True)
    other.constraints = tuple(_less(constraint.at_samples, room) for constraint, room in pairs)
    return other


def _less(constraint: Constraint, room: float) -> Constraint:
    if not room:
        return constraint
    terms = None if constraint.terms is None else partial(_raised, function=constraint.terms, by=room)
    return replace(constraint, function=partial(_raised, function=constraint.function, by=room), terms=terms)


def _raised(rollout: Rollout, *, function: Callable[[Rollout], Array], by: float) -> Array:
    raised: Array = function(rollout) + by
    return raised
