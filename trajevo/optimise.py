"""Solve a trajectory problem: NSGA-II with its paper's settings unless told otherwise, a front out."""

from __future__ import annotations

import copy
import time
from dataclasses import asdict
from typing import Any

import numpy as np
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.algorithm import Algorithm
from pymoo.core.evaluator import Evaluator
from pymoo.operators.crossover.sbx import SBX
from pymoo.operators.mutation.pm import PM

from trajevo.archive import Archive
from trajevo.arrays import Array
from trajevo.errors import InvalidInputError
from trajevo.front import Front
from trajevo.problem import Evolution, TrajectoryProblem
from trajevo.progress import Generation, reporter
from trajevo.records import Blocking, History, ProblemRecord, Run, installed_versions
from trajevo.weighted import minimise_weighted

__all__ = ["minimise_weighted", "optimise"]


def optimise(
    problem: TrajectoryProblem,
    *,
    seed: int,
    generations: int | None = None,
    population: int | None = None,
    offsprings: int | None = None,
    crossover_probability: float | None = None,
    crossover_index: float | None = None,
    mutation_probability: float | None = None,
    mutation_index: float | None = None,
    algorithm: Algorithm | None = None,
    progress: bool = True,
) -> Front:
    """Run a multi-objective evolutionary algorithm and keep every feasible point that nothing dominates.

    The default is pymoo's NSGA-II with simulated binary crossover and polynomial mutation, its settings those of the
    problem's paper (``problem.evolution``). The mutation probability is that of each variable, as Deb defined it. The
    "pool size" of Sun 2020 has no counterpart in pymoo's NSGA-II but the number of offspring per generation: pass
    ``offsprings=75`` for it.

    An interrupt from the keyboard ends the run and returns what was found so far, marked as interrupted.

    Args:
        problem: what to solve.
        seed: seed of all randomness; the same seed gives the same front.
        generations: generations, the initial population counted as the first; the problem's if None, as the others.
        population: individuals.
        offsprings: new individuals per generation; as the population if None.
        crossover_probability: per pair of parents.
        crossover_index: distribution index of the crossover.
        mutation_probability: per variable.
        mutation_index: distribution index of the mutation.
        algorithm: any pymoo algorithm instead of NSGA-II; it is copied, and the settings above but generations stay
            None.
        progress: show generation, hypervolume, least violation and time left on standard error.

    Returns:
        The front. If nothing feasible was found it is empty and ``front.blocking`` says which constraint is in the way.

    Raises:
        InvalidInputError: a setting that cannot be used; the message names it.
    """
    if not isinstance(problem, TrajectoryProblem):
        raise InvalidInputError(f"problem: expected a TrajectoryProblem, got {type(problem).__name__}")
    seed = _whole("seed", seed, 0)
    count = _whole("generations", problem.evolution.generations if generations is None else generations, 1)
    own = {
        "population": population,
        "offsprings": offsprings,
        "crossover_probability": crossover_probability,
        "crossover_index": crossover_index,
        "mutation_probability": mutation_probability,
        "mutation_index": mutation_index,
    }
    if algorithm is None:
        solver, settings = _nsga2(problem.evolution, own)
    else:
        given = [name for name, value in own.items() if value is not None]
        if given:
            raise InvalidInputError(f"{given[0]}: set it on the algorithm that is passed, {type(algorithm).__name__}")
        if not isinstance(algorithm, Algorithm) or algorithm.is_initialized or algorithm.problem is not None:
            raise InvalidInputError(f"algorithm: expected a pymoo algorithm that has not run yet, got {algorithm!r}")
        solver = copy.deepcopy(algorithm)
        settings = _described(algorithm)
    return _run(problem, solver, settings | {"generations": count}, count, seed, progress)


def _nsga2(evolution: Evolution, own: dict[str, Any]) -> tuple[Algorithm, dict[str, Any]]:
    settings: dict[str, Any] = asdict(evolution) | {name: value for name, value in own.items() if value is not None}
    settings.setdefault("offsprings", settings["population"])
    for name, least in (("population", 4), ("offsprings", 1)):
        settings[name] = _whole(name, settings[name], least)
    for name in ("crossover_probability", "mutation_probability"):
        _between(name, settings[name], 0.0, 1.0)
    # Wider indices are refused by pymoo.
    for name in ("crossover_index", "mutation_index"):
        _between(name, settings[name], 1.0, 100.0)
    solver = NSGA2(
        pop_size=settings["population"],
        n_offsprings=settings["offsprings"],
        crossover=SBX(prob=settings["crossover_probability"], eta=settings["crossover_index"]),
        mutation=PM(prob=1.0, prob_var=settings["mutation_probability"], eta=settings["mutation_index"]),
    )
    return solver, settings


class _Watch:
    """Collects what an algorithm evaluates and keeps the books, generation by generation."""

    def __init__(self, problem: TrajectoryProblem) -> None:
        self.archive = Archive(problem.n_var, problem.n_obj, problem.n_ieq_constr)
        self.reference_point = problem.reference_point
        self.evaluations: list[int] = []
        self.hypervolume: list[float] = []
        self.least_violation: list[float | None] = []
        self.front_size: list[int] = []

    def collect(self, X: Array, out: dict[str, Any]) -> None:
        """Callback of pymoo's problem: the arrays of every evaluation."""
        self.archive.add(np.atleast_2d(X), np.atleast_2d(out["F"]), np.atleast_2d(out["G"]))
        if self.archive.failures and not self.archive.first_failure:
            self.archive.first_failure = next((str(said) for said in np.atleast_1d(out["failure"]) if said), "")

    def close(self, number: int, evaluations: int) -> Generation:
        """Book a finished generation."""
        if self.reference_point is None and len(self.archive.F):
            self.reference_point = _box_corner(self.archive.F)
        volume = 0.0 if self.reference_point is None else self.archive.hypervolume(self.reference_point)
        violation = self.archive.least_violation
        self.evaluations.append(evaluations)
        self.hypervolume.append(volume)
        self.least_violation.append(violation if np.isfinite(violation) else None)
        self.front_size.append(len(self.archive.F))
        return Generation(number, volume, violation, len(self.archive.F))

    def history(self) -> History:
        """The books."""
        corner = self.reference_point
        return History(
            reference_point=None if corner is None else tuple(corner.tolist()),
            evaluations=tuple(self.evaluations),
            hypervolume=tuple(self.hypervolume),
            least_violation=tuple(self.least_violation),
            front_size=tuple(self.front_size),
        )


def _run(
    problem: TrajectoryProblem, solver: Algorithm, settings: dict[str, Any], generations: int, seed: int, progress: bool
) -> Front:
    watch, evaluator = _Watch(problem), Evaluator()
    watched = copy.copy(problem)
    watched.callback = watch.collect
    solver.setup(watched, termination=("n_gen", generations), seed=seed, evaluator=evaluator)
    began, interrupted = time.perf_counter(), False
    with reporter(generations, enabled=progress) as shown:
        try:
            while solver.has_next():
                solver.next()
                shown.update(watch.close(len(watch.evaluations) + 1, evaluator.n_eval))
        except KeyboardInterrupt:
            interrupted = True
            if evaluator.n_eval > (watch.evaluations or [0])[-1]:
                watch.close(len(watch.evaluations) + 1, evaluator.n_eval)
    archive = watch.archive
    return Front(
        X=archive.X,
        F=archive.F,
        G=archive.G,
        record=ProblemRecord.of(problem),
        run=Run(
            algorithm=type(solver).__name__,
            settings=settings,
            seed=seed,
            generations=len(watch.evaluations),
            evaluations=evaluator.n_eval,
            failures=archive.failures,
            first_failure=archive.first_failure,
            interrupted=interrupted,
            seconds=time.perf_counter() - began,
            versions=installed_versions(),
        ),
        history=watch.history(),
        blocking=None if len(archive.F) else _blocking(archive, problem.constraint_names),
        _problem=problem,
    )


def _blocking(archive: Archive, names: tuple[str, ...]) -> Blocking:
    if archive.nearest is None:
        return Blocking(x=(), violations={})
    x, g = archive.nearest
    worst_first = sorted(((float(by), name) for by, name in zip(g, names, strict=True) if by > 0.0), reverse=True)
    return Blocking(x=tuple(x.tolist()), violations={name: by for by, name in worst_first})


def _box_corner(F: Array) -> Array | None:
    """A reference point for a problem that names none: a tenth beyond the worst of the first feasible points.

    The box begins at 0, so there is none for an objective that is not positive.
    """
    worst: Array = F.max(axis=0)
    return 1.1 * worst if (worst > 0.0).all() else None


def _between(name: str, value: object, least: float, most: float) -> None:
    if not (isinstance(value, int | float) and least <= value <= most):
        raise InvalidInputError(f"{name}: expected a number from {least:g} to {most:g}, got {value!r}")


def _whole(name: str, value: object, least: int) -> int:
    if not isinstance(value, int | np.integer) or isinstance(value, bool) or value < least:
        raise InvalidInputError(f"{name}: expected a whole number of at least {least}, got {value!r}")
    return int(value)


def _described(algorithm: Algorithm) -> dict[str, Any]:
    """What can be told of an algorithm that was passed: sizes, and class and parameters of its operators."""
    settings: dict[str, Any] = {
        "population": getattr(algorithm, "pop_size", None),
        "offsprings": getattr(algorithm, "n_offsprings", None),
    }
    mating = getattr(algorithm, "mating", None)
    for role in ("crossover", "mutation"):
        operator = getattr(mating, role, None)
        if operator is not None:
            values = {name: getattr(value, "value", None) for name, value in vars(operator).items()}
            shown = ", ".join(f"{name}={value:g}" for name, value in values.items() if isinstance(value, int | float))
            settings[role] = f"{type(operator).__name__}({shown})"
    return settings
