"""First populations: drawn evenly in log time, made feasible by stretching their times, or taken from a front."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, final

import numpy as np
from pymoo.core.sampling import Sampling
from pymoo.operators.sampling.rnd import FloatRandomSampling

from trajevo.base.arrays import Array, frozen, numbers, one_blas_thread
from trajevo.base.sampling import latin_hypercube, sobol
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError, checked_name
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.formulation.search import STARTS, Search
from trajevo.front.covering import ReferenceBox, covering
from trajevo.front.front import Front
from trajevo.front.records import ProblemRecord, VariableRecord
from trajevo.robot.payload import Payload
from trajevo.solvers.evolutionary.algorithms import Chosen
from trajevo.solvers.evolutionary.choices import choices_of
from trajevo.solvers.evolutionary.order_search import OrderSearch
from trajevo.solvers.evolutionary.stretching import Limits, Stretching, in_seconds
from trajevo.solvers.gradient.sqp import random_starts

#: Kinds of first population whose individuals are stretched.
_STRETCHED = ("stretched", "fastest", "spread")

#: Greatest ratio between two times of an individual before it is stretched. Every individual has its own limit of the
#: ratio, from 1 to this, drawn evenly in its logarithm: equal times suit most paths, but some need unequal ones.
_WIDEST = 16.0

#: How often a whole population is drawn at most, to find enough individuals that keep the limits.
_TRIES = 12

#: How near the plain motion the populations of a round of tries are: where it keeps the limits small departures do, and
#: where it leaves a joint's range only great ones help.
_NEAR = (1.0, None, 0.25, None, 0.0625, None)

#: Share of the individuals that are the best choices found, where variables choose, as fast as the limits allow.
_BEST = 0.1

#: Difference of two paths that counts as rounding [rad or m].
_ROUNDING = 1e-9


@final
@dataclass(frozen=True, eq=False)
class FirstPopulation:
    """The individuals with which an evolution begins.

    Attributes:
        X: decision vectors, shape (size, n_var), all different.
        evaluations: individuals that were evaluated to find them.
    """

    X: Array
    evaluations: int

    __repr__ = brief


def first_population(problem: TrajectoryProblem, size: int, *, starts: str, seed: int) -> FirstPopulation:
    """Individuals with which an evolution can begin.

    Individuals that are to be stretched are drawn from a Sobol sequence: the times of each differ by a factor of up to
    16, the other variables are uniform. After stretching, some may still break a limit that does not depend on speed,
    such as one of position. So whole populations are drawn until enough individuals are feasible, at most 12 times,
    nearer to the plain motion and farther from it in turn; then those that break the limits least are taken.

    Args:
        problem: the problem.
        size: number of individuals.
        starts: kind of first population, a key of :data:`trajevo.formulation.search.STARTS`.
        seed: seed of the draws.

    Raises:
        UnknownNameError: no such kind of first population.
        InvalidInputError: a size below 1 or a seed below 0.
    """
    checked_name("starts", starts, STARTS)
    for name, value, least in (("size", size, 1), ("seed", seed, 0)):
        if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
            raise InvalidInputError(f"{name}: expected a whole number of at least {least}, got {value!r}")
    if starts == "random":
        return FirstPopulation(frozen(random_starts(problem, seed, size)), 0)
    generator = np.random.default_rng(seed)
    if starts not in _STRETCHED:
        return FirstPopulation(frozen(_in_log_time(problem, _drawn(problem.n_var, size, starts, generator))), 0)
    with one_blas_thread():
        return _stretched_population(problem, size, starts, generator)


def begin_with(
    algorithm: Chosen,
    problem: TrajectoryProblem,
    search: Search,
    *,
    initial: Any,
    in_time: Callable[[], bool] | None = None,
) -> dict[str, Any]:
    """Set the first population of an algorithm that has not run.

    Args:
        algorithm: the algorithm; with random starts and without ``initial`` it keeps its own sampling.
        problem: what it will solve.
        search: its starts, seed and time limit are used.
        initial: individuals to begin with, shape (N, n_var), a front, or None.
        in_time: whether there is time to look for motions that are known to be good; None for no limit.

    Returns:
        Settings that describe the first population.

    Raises:
        InvalidInputError: individuals that cannot be used, or an algorithm that does not draw its first population.
    """
    solver, starts = algorithm.solver, search.starts or algorithm.starts
    sampling = getattr(getattr(solver, "initialization", None), "sampling", None)
    size: int | None = getattr(solver, "pop_size", None) if isinstance(sampling, Sampling) else None
    if initial is None and size is not None:
        known = problem.known_good(size, in_time=in_time)
        initial = known if len(known) else None
    if starts == "random" and initial is None:
        return {"starts": starts} if isinstance(sampling, FloatRandomSampling) else {}
    if size is None:
        what, name = "starts" if initial is None else "initial", type(solver).__name__
        raise InvalidInputError(f"{what}: expected an algorithm that draws its first population, got {name}")
    with _under(problem, search.time_limit) as limited:
        given, evaluations = (np.empty((0, problem.n_var)), 0) if initial is None else _given(limited, initial, size)
        found = FirstPopulation(given[:0], 0)
        if len(given) < size:
            found = first_population(limited, size - len(given), starts=starts, seed=search.seed or 0)
    # Set on the initialization, which belongs to this algorithm alone; operators may be shared between algorithms.
    solver.initialization.sampling = np.concatenate([given, found.X])
    said: dict[str, Any] = {"starts": starts} | ({} if initial is None else {"initial": len(given)})
    spent = evaluations + found.evaluations
    return said | ({"starts_evaluations": spent} if spent else {})


def warm_start(problem: TrajectoryProblem, front: Front, most: int) -> FirstPopulation:
    """Individuals of a problem, taken from a front of the same problem, possibly with another payload.

    Members that break a limit with the new payload are stretched if that makes them feasible. If the payload is a
    variable of the problem but not of the front, its value is the front's payload. If the front has too many members,
    those are taken that together dominate most of what the front dominates.

    Args:
        problem: the problem.
        front: a front of a problem with the same variables and the same motions.
        most: greatest number of individuals.

    Raises:
        InvalidInputError: an empty front, a front of another problem, or one whose payload the problem does not allow.
    """
    if not len(front):
        raise InvalidInputError("initial: expected a front with members, got an empty one")
    expansion = problem.expansion
    folds = expansion is not None and front.record.variables == ProblemRecord.of(expansion.problem).variables
    target = expansion.problem if expansion is not None and folds else problem
    rows = front.X
    if _without_payload(target) == front.record.variables:
        rows = np.column_stack([rows, np.full(len(rows), _mass_taken(target, front))])
    elif ProblemRecord.of(target).variables != front.record.variables:
        raise InvalidInputError("initial: expected a front of the same problem, got one with other variables")
    if not _same_path(target, rows[:1], front):
        raise InvalidInputError(
            "initial: expected a front of the same problem, got one whose decision vectors are other motions"
        )
    if len(rows) > most:
        rows = rows[covering(front.F, ReferenceBox.of(front.F, None).probes(front.F, 0), most)]
    if expansion is not None and folds:
        rows = expansion.fold(rows)
    limits = Limits(problem)
    with one_blas_thread():
        X = Stretching.of(limits).mended(rows)[0]
    return FirstPopulation(frozen(X), limits.evaluations)


def _given(problem: TrajectoryProblem, initial: Any, size: int) -> tuple[Array, int]:
    """The given individuals, shape (N, n_var), and how many evaluations they needed."""
    evaluations = 0
    if isinstance(initial, Front):
        found = warm_start(problem, initial, size)
        initial, evaluations = found.X, found.evaluations
    rows = numbers(initial, name="initial", shape=("N", problem.n_var))
    if len(rows) > size:
        raise InvalidInputError(f"initial: expected at most the population of {size} individuals, got {len(rows)}")
    if ((rows < problem.xl) | (rows > problem.xu)).any():
        raise InvalidInputError("initial: an individual lies outside the bounds of the decision variables")
    return rows, evaluations


def _stretched_population(
    problem: TrajectoryProblem, size: int, starts: str, generator: np.random.Generator
) -> FirstPopulation:
    limits = Limits(problem)
    stretching = Stretching.of(limits)
    X, worst = np.empty((0, problem.n_var)), np.empty(0)
    choices = choices_of(problem)
    search = None if choices is None else OrderSearch(problem, choices).run(generator)
    if search is not None:  # the best choices as fast as they can be, whatever is drawn
        X, G = stretching.mended(search.x[: max(1, round(_BEST * size))], quicker=True)
        worst = np.maximum(G, 0.0).max(axis=1, initial=0.0)
    for again in range(_TRIES):
        # Two more coordinates: how much the times of an individual differ, and how slow it is.
        unit = _drawn(problem.n_var + 2, size, starts, generator)
        slow = unit[:, -1]
        level = slow if starts == "stretched" else 0.5 + 0.0 * slow
        drawn = _of_ratios(problem, unit[:, :-2], unit[:, -2], level, near_plain=_NEAR[again % len(_NEAR)])
        if search is not None:
            drawn = search.begun(drawn, generator)
        found, G = stretching.mended(drawn, quicker=starts != "stretched")
        if starts == "spread":
            found, G = stretching.slowed(found, G, slow)
        # The worst broken limit; an individual whose evaluation failed counts as infinitely bad.
        X = np.concatenate([X, found])
        worst = np.concatenate([worst, np.maximum(G, 0.0).max(axis=1, initial=0.0)])
        kept = np.unique(X, axis=0, return_index=True)[1]
        order = np.sort(kept)[np.argsort(worst[np.sort(kept)], kind="stable")]
        X, worst = X[order], worst[order]
        if (worst <= 0.0).sum() >= size:
            break
    return FirstPopulation(frozen(X[:size].copy()), limits.evaluations)


def _drawn(dimensions: int, size: int, starts: str, generator: np.random.Generator) -> Array:
    """Points of the unit cube, shape (size, dimensions)."""
    drawn = (latin_hypercube if starts == "latin_hypercube" else sobol)(dimensions, size, generator)
    return np.asarray(drawn, dtype=np.float64)


def _in_log_time(problem: TrajectoryProblem, unit: Array) -> Array:
    """Decision vectors for points of the unit cube, uniform in the logarithms of times, shape (B, n_var)."""
    times = in_seconds(problem)
    low, high = (np.where(times, bound, 1.0) for bound in (problem.xl, problem.xu))
    inside = np.where(times, low * (high / low) ** unit, problem.xl + unit * (problem.xu - problem.xl))
    return np.asarray(np.clip(inside, problem.xl, problem.xu), dtype=np.float64)


def _of_ratios(
    problem: TrajectoryProblem, unit: Array, width: Array, level: Array, *, near_plain: float | None
) -> Array:
    """Decision vectors for points of the unit cube, with times near the level of each individual, shape (B, n_var).

    Level and width have shape (B,); the ratio between two times of an individual is at most 16 to the power of its
    width. Below one half, the narrower an individual, the nearer it is to the plain motion without departures: random
    departures in all of many variables make slow motions only. ``near_plain`` is the greatest share of the departures'
    bounds; if None, all individuals have any.
    """
    times = in_seconds(problem)
    middle = _in_log_time(problem, np.where(times, level[:, None], unit))
    if near_plain is not None:
        departs = np.array([variable.departs for variable in problem.variables])
        plain = 0.5 * (problem.xl + problem.xu)
        near = plain + near_plain * np.minimum(1.0, 2.0 * width)[:, None] * (middle - plain)
        middle = np.where(departs, near, middle)
    apart = np.where(times, _WIDEST ** (width[:, None] * (unit - 0.5)), 1.0)
    return np.asarray(np.clip(middle * apart, problem.xl, problem.xu), dtype=np.float64)


def _mass_taken(problem: TrajectoryProblem, front: Front) -> float:
    """The payload of a front [kg], checked against the payload range of a problem."""
    mass, (low, high) = Payload.of(front.record.payload, model=None).mass, problem.payload_range or (0.0, np.inf)
    if not low <= mass <= high:
        raise InvalidInputError(f"initial: expected a front with a payload of {low:g} to {high:g} kg, got {mass:g} kg")
    return mass


def _without_payload(problem: TrajectoryProblem) -> tuple[VariableRecord, ...]:
    """The variables of a problem except the payload; empty if the payload is not a variable."""
    return () if problem.payload_range is None else ProblemRecord.of(problem).variables[:-1]


def _same_path(problem: TrajectoryProblem, row: Array, front: Front) -> bool:
    """Whether a decision vector of a problem gives the path of a front's first member, regardless of speed."""
    shares = np.linspace(0.0, 1.0, 5)
    here, there = problem.decode(row).at_shares(shares, 0), front.problem.decode(front.X[:1]).at_shares(shares, 0)
    return here.shape == there.shape and bool(np.allclose(here, there, rtol=0.0, atol=_ROUNDING))


@contextmanager
def _under(problem: TrajectoryProblem, time_limit: float | None) -> Iterator[TrajectoryProblem]:
    """The problem, under a time limit if there is one."""
    if time_limit is None:
        yield problem
        return
    limited = problem.under_time_limit(time_limit)
    try:
        yield limited
    finally:
        if limited.time_limited is not None:
            limited.time_limited.close()
