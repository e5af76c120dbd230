"""First populations: evenly drawn in log time, made feasible by stretching their times, or from an earlier front."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, final

import numpy as np
from pymoo.core.sampling import Sampling
from pymoo.operators.sampling.rnd import FloatRandomSampling

from trajevo.base.arrays import Array, frozen, numbers, one_blas_thread
from trajevo.base.sampling import latin_hypercube, sobol
from trajevo.errors import InvalidInputError, checked_name
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.formulation.search import STARTS, Search
from trajevo.front.covering import ReferenceBox, covering
from trajevo.front.front import Front
from trajevo.front.records import ProblemRecord, VariableRecord
from trajevo.solvers.evolutionary.algorithms import Chosen
from trajevo.solvers.evolutionary.stretching import Limits, Stretching, in_seconds
from trajevo.solvers.gradient.sqp import random_starts

#: Those whose individuals are stretched.
_STRETCHED = ("stretched", "fastest", "spread")

#: Greatest ratio between two times of an individual that is to be stretched. Every individual has one of its own, from
#: 1 up, evenly in its logarithm: even times suit most paths, and some paths need others.
_WIDEST = 16.0

#: How often a whole population is drawn until enough individuals keep the limits.
_TRIES = 12

#: Difference of two paths that is rounding [rad or m].
_ROUNDING = 1e-9


@final
@dataclass(frozen=True, eq=False)
class FirstPopulation:
    """Individuals to begin with.

    Attributes:
        X: decision vectors, shape (size, n_var), no two of them alike.
        evaluations: individuals that were evaluated to find them.
    """

    X: Array
    evaluations: int


def first_population(problem: TrajectoryProblem, size: int, *, starts: str, seed: int) -> FirstPopulation:
    """Individuals to begin an evolution with.

    Those that are stretched are drawn by a Sobol sequence: the times of each differ by a factor of up to 16, the other
    variables are uniform. Those that still break a limit, one of position for example, which no speed changes, are
    drawn again, up to 12 times the size; if that is not enough, those that break the limits least are taken.

    Args:
        problem: the problem.
        size: how many.
        starts: a key of :data:`trajevo.formulation.search.STARTS`.
        seed: of what is drawn.

    Raises:
        UnknownNameError: no such starts.
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


def begin_with(algorithm: Chosen, problem: TrajectoryProblem, search: Search, *, initial: Any) -> dict[str, Any]:
    """Give an algorithm that has not run its first population, and say what it is.

    Args:
        algorithm: with random starts and nothing given it keeps what it has.
        problem: what it will solve.
        search: its starts, seed and time limit count.
        initial: individuals that are given, shape (N, n_var), a front, or None.

    Raises:
        InvalidInputError: individuals that cannot be used, or an algorithm that does not draw its first population.
    """
    solver, starts = algorithm.solver, search.starts or algorithm.starts
    sampling = getattr(getattr(solver, "initialization", None), "sampling", None)
    if starts == "random" and initial is None:
        return {"starts": starts} if isinstance(sampling, FloatRandomSampling) else {}
    size, name = getattr(solver, "pop_size", None), type(solver).__name__
    if not isinstance(sampling, Sampling) or size is None:
        what = "starts" if initial is None else "initial"
        raise InvalidInputError(f"{what}: expected an algorithm that draws its first population, got {name}")
    with _under(problem, search.time_limit) as limited:
        given, evaluations = (np.empty((0, problem.n_var)), 0) if initial is None else _given(limited, initial, size)
        found = FirstPopulation(given[:0], 0)
        if len(given) < size:
            found = first_population(limited, size - len(given), starts=starts, seed=search.seed or 0)
    # On the algorithm's own initialization: operators may be shared between algorithms, and this one is not.
    solver.initialization.sampling = np.concatenate([given, found.X])
    said: dict[str, Any] = {"starts": starts} | ({} if initial is None else {"initial": len(given)})
    spent = evaluations + found.evaluations
    return said | ({"starts_evaluations": spent} if spent else {})


def warm_start(problem: TrajectoryProblem, front: Front, most: int) -> FirstPopulation:
    """Members of a front of the same problem, or of the same with another payload, as individuals of a problem.

    Those that the payload takes beyond a limit are stretched where that mends it. Where the payload is a variable of
    the problem but not of the front, the front's payload becomes its value. A front of more members than asked for
    gives those that together dominate most of what it does.

    Args:
        problem: the problem.
        front: of one that has the same variables and the same motions.
        most: how many individuals at most.

    Raises:
        InvalidInputError: a front of another problem, an empty one, or one whose payload the problem does not take.
    """
    if not len(front):
        raise InvalidInputError("initial: expected a front with members, it is empty")
    expansion = problem.expansion
    folds = expansion is not None and front.record.variables == ProblemRecord.of(expansion.problem).variables
    target = expansion.problem if expansion is not None and folds else problem
    rows = front.X
    if _without_payload(target) == front.record.variables:
        rows = np.column_stack([rows, np.full(len(rows), _mass_taken(target, front))])
    elif ProblemRecord.of(target).variables != front.record.variables:
        raise InvalidInputError("initial: expected a front of the same problem, its variables are others")
    if not _same_path(target, rows[:1], front):
        raise InvalidInputError("initial: expected a front of the same problem, its decision vectors are other motions")
    if len(rows) > most:
        rows = rows[covering(front.F, ReferenceBox.of(front.F, None).probes(front.F, 0), most)]
    if expansion is not None and folds:
        rows = expansion.fold(rows)
    limits = Limits(problem)
    with one_blas_thread():
        X = Stretching.of(limits).mended(rows)[0]
    return FirstPopulation(frozen(X), limits.evaluations)


def _given(problem: TrajectoryProblem, initial: Any, size: int) -> tuple[Array, int]:
    """Individuals that are given, shape (N, n_var), and how many were evaluated for them."""
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
    for _ in range(_TRIES):
        # Two coordinates more: by how much times differ, and how slow an individual is.
        unit = _drawn(problem.n_var + 2, size, starts, generator)
        slow = unit[:, -1]
        drawn = _of_ratios(problem, unit[:, :-2], unit[:, -2], slow if starts == "stretched" else 0.5 + 0.0 * slow)
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
    """Decision vectors of points of the unit cube, times by their logarithms, shape (B, n_var)."""
    times = in_seconds(problem)
    low, high = (np.where(times, bound, 1.0) for bound in (problem.xl, problem.xu))
    inside = np.where(times, low * (high / low) ** unit, problem.xl + unit * (problem.xu - problem.xl))
    return np.asarray(np.clip(inside, problem.xl, problem.xu), dtype=np.float64)


def _of_ratios(problem: TrajectoryProblem, unit: Array, width: Array, level: Array) -> Array:
    """The same, the times of an individual around its level, no further apart than its width says, both (B,)."""
    times = in_seconds(problem)
    middle = _in_log_time(problem, np.where(times, level[:, None], unit))
    apart = np.where(times, _WIDEST ** (width[:, None] * (unit - 0.5)), 1.0)
    return np.asarray(np.clip(middle * apart, problem.xl, problem.xu), dtype=np.float64)


def _mass_taken(problem: TrajectoryProblem, front: Front) -> float:
    """The payload of a front [kg], where a problem's variable may take it."""
    mass, (low, high) = float(front.record.payload["mass"]), problem.payload_range or (0.0, np.inf)
    if not low <= mass <= high:
        raise InvalidInputError(f"initial: expected a front of a payload from {low:g} to {high:g} kg, got {mass:g} kg")
    return mass


def _without_payload(problem: TrajectoryProblem) -> tuple[VariableRecord, ...]:
    """The variables of a problem but for the payload; none where the payload is not one."""
    return () if problem.payload_range is None else ProblemRecord.of(problem).variables[:-1]


def _same_path(problem: TrajectoryProblem, row: Array, front: Front) -> bool:
    """Whether a decision vector is the same path here as the first of a front there, at whatever speed."""
    shares = np.linspace(0.0, 1.0, 5)
    here, there = problem.decode(row).at_shares(shares, 0), front.problem.decode(front.X[:1]).at_shares(shares, 0)
    return here.shape == there.shape and bool(np.allclose(here, there, rtol=0.0, atol=_ROUNDING))


@contextmanager
def _under(problem: TrajectoryProblem, time_limit: float | None) -> Iterator[TrajectoryProblem]:
    """The problem, under a time limit where there is one."""
    if time_limit is None:
        yield problem
        return
    limited = problem.under_time_limit(time_limit)
    try:
        yield limited
    finally:
        if limited.time_limited is not None:
            limited.time_limited.close()
