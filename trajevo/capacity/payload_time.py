"""Payload against time by optimisation: the least time for each payload, and the greatest payload of all motions."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import final

import numpy as np

from trajevo.base.arrays import Array, frozen, numbers
from trajevo.base.shown.brief import brief
from trajevo.capacity.capacity import told_both
from trajevo.capacity.notebook import curve_html, told_html
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError, checked_name
from trajevo.formulation.constraints.certified import certified
from trajevo.formulation.constraints.constraint import Constraint
from trajevo.formulation.constraints.motion_limits import time_limit
from trajevo.formulation.payload_variable import PayloadVariable
from trajevo.formulation.problem import TrajectoryProblem, Weights
from trajevo.solvers.gradient.weighted_sum import minimise_weighted

#: Payloads of a curve, as shares of the largest one.
_SHARES = (0.0, 0.3, 0.5, 0.65, 0.8, 0.9, 0.95, 0.985)


@final
@dataclass(frozen=True, eq=False)
class PayloadCurve:
    """The least time of a motion for each payload.

    Attributes:
        payloads: masses, ascending, shape (N,) [kg].
        times: least duration, inf where no feasible motion was found, shape (N,) [s].
        X: decision vectors, shape (N, n_var); the last one tried where none is feasible.
        payload_model: how the payload acts.
        effort_margin: share of the effort limits that the problem keeps free.
        at_full_limits: the same against the robot's full limits; None if the problem has no margins.
    """

    payloads: Array
    times: Array
    X: Array
    payload_model: str
    effort_margin: float = 0.0
    at_full_limits: PayloadCurve | None = None

    __repr__ = brief

    def _repr_html_(self) -> str:
        headers = ("payload [kg]", "least duration [s]")
        return curve_html("Least duration for each payload", headers, (self.payloads, self.times))


def capacity_front(
    problem: TrajectoryProblem, payloads: Sequence[float], *, seed: int, starts: int = 4
) -> PayloadCurve:
    """Re-optimise for least time at each payload, by SLSQP from random starts and from the neighbour's solution.

    Limits are those that the problem keeps, less its margins; if it has margins, the curve without them is added.

    The least time does not decrease with the payload. So if a faster motion was found for a heavier payload and is
    feasible for a lighter one too, it is taken for the latter.

    Args:
        problem: a problem with the time [s] among its objectives.
        payloads: masses [kg]; shape and model are those of the problem's payload.
        seed: seed of the random starts.
        starts: random starts per payload.

    Raises:
        InvalidInputError: no payloads, or a problem without the time among its objectives or whose payload is already a
            variable.
    """
    if problem.payload_range is not None:
        raise InvalidInputError("problem: expected a payload that is given, its mass is a decision variable")
    masses = np.sort(numbers(payloads, name="payloads", shape=("N",)))
    if not len(masses):
        raise InvalidInputError("payloads: expected at least one mass [kg]")
    shape = problem.dynamics.payload
    loaded = [problem.with_payload(shape.with_mass(mass)) for mass in masses.tolist()]
    times, X = least_times(loaded, seed=seed, starts=starts)
    kept = _example(problem)
    curve = PayloadCurve(frozen(masses), times, X, shape.model, kept.effort_margin)
    if not kept.keeps_margins:
        return curve
    full = [without_margins(one) for one in loaded]
    best_times, best_X = (values.copy() for values in least_times(full, seed=seed, starts=starts))
    for i in np.flatnonzero(best_times > times):  # what keeps the margin keeps the full limits too
        warm = minimise_weighted(full[i], _time_alone(full[i]), seed=seed, initial=X[i][None])
        best_times[i], best_X[i] = min((times[i], X[i]), (warm.cost, warm.x), key=lambda found: found[0])
    return replace(curve, at_full_limits=PayloadCurve(frozen(masses), frozen(best_times), frozen(best_X), shape.model))


def _example(problem: TrajectoryProblem) -> Rollout:
    """A motion of a problem, which tells its margins."""
    return problem.rollout(0.5 * (problem.xl + problem.xu))


def without_margins(problem: TrajectoryProblem) -> TrajectoryProblem:
    """The same problem against the robot's full limits."""
    other = copy.copy(problem)
    other.constraints = tuple(_without_margin(constraint) for constraint in problem.constraints)
    return other


def _without_margin(constraint: Constraint) -> Constraint:
    share = constraint.share
    if share is None or share == 1.0:
        return constraint
    at_samples = constraint.at_samples
    function, terms = at_samples.function, at_samples.terms
    full = replace(
        at_samples,
        function=partial(_excess_of_all, function=function, share=share),
        terms=None if terms is None else partial(_excess_of_all, function=terms, share=share),
        limit=None if at_samples.limit is None else tuple((np.atleast_1d(at_samples.limit) / share).tolist()),
        share=1.0,
    )
    return full if constraint.sampled is None else certified(full)


def _excess_of_all(rollout: Rollout, *, function: Callable[[Rollout], Array], share: float) -> Array:
    """Excess over a whole limit, from a function that gives that over a share of it."""
    excess: Array = (1.0 + function(rollout)) * share - 1.0
    return excess


def payloads_up_to(problem: TrajectoryProblem, greatest: float) -> tuple[list[float], str]:
    """Masses for a curve, denser where the time rises steeply.

    Args:
        problem: the problem of the curve.
        greatest: the largest payload that any motion carries [kg].

    Returns:
        The masses that the problem accepts [kg], and its error message for the first other mass; empty if it accepts
        all.
    """
    taken: list[float] = []
    for share in _SHARES:
        mass = float(f"{share * greatest:.4g}")
        try:
            problem.with_payload(problem.dynamics.payload.with_mass(mass))
        except InvalidInputError as error:
            return taken, str(error)
        taken.append(mass)
    return taken, ""


def least_times(problems: Sequence[TrajectoryProblem], *, seed: int, starts: int) -> tuple[Array, Array]:
    """The least times of ever harder problems, each warm-started from its neighbours.

    A motion that is feasible for a problem should be feasible for the easier ones before it, so that the least times do
    not decrease. If a faster motion was found for a harder problem and is feasible for an easier one too, the easier
    problem is solved again from there.

    Args:
        problems: N problems with the same variables and the time [s] among the objectives, from the easiest to the
            hardest.
        seed: seed of the random starts.
        starts: random starts for each problem.

    Returns:
        Times, inf where no feasible motion was found, shape (N,) [s], and decision vectors (N, n_var).

    Raises:
        InvalidInputError: a problem without the time among its objectives.
    """
    for problem in problems:
        if "time" not in problem.objective_names:
            raise InvalidInputError(f"problem: expected the time among the objectives, got {problem.objective_names}")
    times, X = np.full(len(problems), np.inf), np.empty((len(problems), problems[0].n_var))
    for i, problem in enumerate(problems):
        weights = _time_alone(problem)
        best = minimise_weighted(problem, weights, seed=seed + i, starts=starts)
        if i > 0 and np.isfinite(times[i - 1]):
            warm = minimise_weighted(problem, weights, seed=seed, initial=X[i - 1][None])
            best = min(best, warm, key=lambda optimum: optimum.cost)
        times[i], X[i] = best.cost, best.x
    for i in range(len(problems) - 2, -1, -1):
        G = problems[i].evaluate(X[i + 1][None], return_values_of=["F", "G"])[1]
        if times[i + 1] < times[i] and G.max(initial=-np.inf) <= 0.0:
            warm = minimise_weighted(problems[i], _time_alone(problems[i]), seed=seed, initial=X[i + 1][None])
            times[i], X[i] = min((times[i + 1], X[i + 1]), (warm.cost, warm.x), key=lambda found: found[0])
    return frozen(times), frozen(X)


def _time_alone(problem: TrajectoryProblem) -> Weights:
    return Weights(tuple(float(name == "time") for name in problem.objective_names))


def max_payload_problem(
    problem: TrajectoryProblem,
    payload_range: tuple[float, float] | None = None,
    *,
    objectives: Sequence[str] | None = None,
) -> TrajectoryProblem:
    """The same problem with the payload's mass as its last variable and the unused payload as an objective.

    Args:
        problem: the problem; its payload gives shape and model.
        payload_range: least and greatest mass [kg]; if None, from 0 to the greatest mass that the robot can hold at
            rest at the first and the last point within the limits that the problem keeps. No motion that rests there
            can carry more.
        objectives: names of the problem's objectives to keep, such as ``["time", "energy"]``; all if None.

    Raises:
        UnknownNameError: an objective that the problem does not have.
        InvalidInputError: a range that is not 0 <= least < greatest, or no range although nothing limits the payload.
    """
    names = problem.objective_names if objectives is None else tuple(objectives)
    kept = [problem.objective_names.index(checked_name("objective", name, problem.objective_names)) for name in names]
    if payload_range is None:
        within = replace(problem.dynamics, robot=replace(problem.robot, limits=problem.kept_limits))
        payload_range = PayloadVariable.of(within, problem.interpolant).range
    variable = PayloadVariable.of(problem.dynamics, problem.interpolant, payload_range)
    corner = problem.reference_point
    return TrajectoryProblem(
        dynamics=variable.dynamics,
        interpolant=problem.interpolant,
        objectives=(*(problem.objectives[place] for place in kept), variable.objective),
        constraints=problem.constraints,
        payload_range=variable.range,
        reference_point=None if corner is None else (*corner[kept], variable.range[1] - variable.range[0]),
        angle=problem.angle,
        length=problem.length,
    )


@final
@dataclass(frozen=True, eq=False)
class LargestPayload:
    """The largest payload that was found for any motion of a problem.

    Attributes:
        mass: mass of the payload [kg].
        time: duration of the motion [s].
        at_rest: greatest mass that the robot can hold at rest at the first and the last point [kg]; no motion can carry
            more.
        x: decision vector of the motion, shape (n_var,).
        rollout: the robot on the motion, carrying the payload.
        at_full_limits: the same against the robot's full limits; None if the problem has no margins.
    """

    mass: float
    time: float
    at_rest: float
    x: Array
    rollout: Rollout
    at_full_limits: LargestPayload | None = None

    __repr__ = brief

    def _repr_html_(self) -> str:
        return told_html("Largest payload of any motion found", self)

    def __str__(self) -> str:
        told = f"{self.mass:.6f} kg in {self.time:.4f} s; held at rest at both ends: {self.at_rest:.6f} kg"
        if self.at_full_limits is None:
            return told
        return told_both(told, str(self.at_full_limits), self.rollout.effort_margin)


def largest_payload(
    problem: TrajectoryProblem, *, within: float | None = None, seed: int, starts: int = 4
) -> LargestPayload:
    """The largest payload that any motion through the points can carry, by SLSQP from random starts.

    Limits are those that the problem keeps, less its margins; if it has margins, the payload without them is added.

    Args:
        problem: the problem, which gives limits and the payload's shape and model; its objectives are not used.
        within: the longest time allowed [s]; limited by the problem alone if None.
        seed: seed of the random starts.
        starts: number of random starts.

    Raises:
        InvalidInputError: a time that is not positive, a payload that nothing limits, or no feasible motion found.
    """
    if within is not None and not float(numbers(within, name="within", shape=())) > 0.0:
        raise InvalidInputError(f"within: expected a positive time [s], got {within!r}")
    found = _largest(problem, within, seed=seed, starts=starts)
    if not found.rollout.keeps_margins:
        return found
    full = _largest(without_margins(problem), within, seed=seed, starts=starts)
    return replace(found, at_full_limits=full)


def _largest(problem: TrajectoryProblem, within: float | None, *, seed: int, starts: int) -> LargestPayload:
    loaded = max_payload_problem(problem, objectives=())
    if within is not None:
        limit = replace(time_limit(float(within)), names=("largest payload within",))
        loaded = TrajectoryProblem(
            dynamics=loaded.dynamics,
            interpolant=loaded.interpolant,
            objectives=loaded.objectives,
            constraints=(*loaded.constraints, limit),
            payload_range=loaded.payload_range,
        )
    best = minimise_weighted(loaded, Weights((1.0,)), seed=seed, starts=starts)
    if not np.isfinite(best.cost):
        name, excess = max(best.G.items(), key=lambda item: item[1])
        raise InvalidInputError(
            f"problem: expected a feasible motion, none found from {starts} starts; the last exceeds {name!r} by "
            f"{100.0 * excess:.3g} %"
        )
    mass, rollout = float(best.x[-1]), best.rollout
    payload = rollout.dynamics.payload.with_mass(mass)
    return LargestPayload(
        mass=mass,
        time=float(rollout.trajectory.duration[0]),
        at_rest=loaded.payload_range[1] if loaded.payload_range else np.inf,
        x=frozen(best.x[:-1].copy()),
        rollout=replace(rollout, dynamics=replace(rollout.dynamics, payload=payload), masses=None),
    )
