"""Solve a trajectory problem: NSGA-II with the settings of Sun 2020 unless told otherwise, a front out."""

from __future__ import annotations

import copy
import time
from typing import Any

import numpy as np
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.algorithm import Algorithm
from pymoo.core.evaluator import Evaluator
from pymoo.core.population import Population
from pymoo.operators.crossover.sbx import SBX
from pymoo.operators.mutation.pm import PM

from trajevo.archive import Archive
from trajevo.arrays import Array
from trajevo.errors import InvalidInputError
from trajevo.front import Front
from trajevo.problem import TrajectoryProblem
from trajevo.progress import Generation, reporter
from trajevo.records import Blocking, History, ProblemRecord, Run, installed_versions

#: Table 3 of Sun 2020.
POPULATION, CROSSOVER_PROBABILITY, MUTATION_PROBABILITY = 150, 0.85, 0.15
#: Not in the paper: the distribution indices that Deb proposed and pymoo uses.
CROSSOVER_INDEX, MUTATION_INDEX = 15.0, 20.0
#: Not in the paper.
GENERATIONS = 200


def optimise(
    problem: TrajectoryProblem,
    *,
    seed: int,
    generations: int = GENERATIONS,
    population: int | None = None,
    offsprings: int | None = None,
    crossover_probability: float | None = None,
    mutation_probability: float | None = None,
    algorithm: Algorithm | None = None,
    progress: bool = True,
) -> Front:
    """Run a multi-objective evolutionary algorithm and keep every feasible point that nothing dominates.

    The default is pymoo's NSGA-II with Table 3 of Sun 2020: population 150, SBX crossover with probability 0.85 per
    pair and index 15, polynomial mutation with probability 0.15 per individual (each variable of a mutated individual
    with pymoo's 1/n_var) and index 20. The paper's "pool size 75" has no counterpart in pymoo's NSGA-II but the number
    of offspring per generation: pass ``offsprings=75`` for it; the default is as many as the population.

    An interrupt from the keyboard ends the run and returns what was found so far, marked as interrupted.

    Args:
        problem: what to solve.
        seed: seed of all randomness; the same seed gives the same front.
        generations: generations, the initial population counted as the first.
        population: individuals; 150 if None.
        offsprings: new individuals per generation; as the population if None.
        crossover_probability: per pair of parents; 0.85 if None.
        mutation_probability: per individual; 0.15 if None.
        algorithm: any pymoo algorithm instead of NSGA-II; it is copied, and the four settings above stay None.
        progress: show generation, hypervolume, least violation and time left on standard error.

    Returns:
        The front. If nothing feasible was found it is empty and ``front.blocking`` says which constraint is in the way.

    Raises:
        InvalidInputError: a setting that cannot be used; the message names it.
    """
    if not isinstance(problem, TrajectoryProblem):
        raise InvalidInputError(f"problem: expected a TrajectoryProblem, got {type(problem).__name__}")
    _whole("seed", seed, 0)
    _whole("generations", generations, 1)
    own = {
        "population": population,
        "offsprings": offsprings,
        "crossover_probability": crossover_probability,
        "mutation_probability": mutation_probability,
    }
    if algorithm is None:
        solver, settings = _nsga2(own)
    else:
        given = [name for name, value in own.items() if value is not None]
        if given:
            raise InvalidInputError(f"{given[0]}: set it on the algorithm that is passed, {type(algorithm).__name__}")
        solver = copy.deepcopy(algorithm)
        settings = {
            "population": getattr(algorithm, "pop_size", None),
            "offsprings": getattr(algorithm, "n_offsprings", None),
        }
    return _run(problem, solver, settings | {"generations": generations}, generations, seed, progress)


def _nsga2(own: dict[str, Any]) -> tuple[Algorithm, dict[str, Any]]:
    settings: dict[str, Any] = {
        "population": POPULATION,
        "crossover_probability": CROSSOVER_PROBABILITY,
        "mutation_probability": MUTATION_PROBABILITY,
    } | {name: value for name, value in own.items() if value is not None}
    settings.setdefault("offsprings", settings["population"])
    _whole("population", settings["population"], 4)
    _whole("offsprings", settings["offsprings"], 1)
    for name in ("crossover_probability", "mutation_probability"):
        if not (isinstance(settings[name], int | float) and 0.0 <= settings[name] <= 1.0):
            raise InvalidInputError(f"{name}: expected a number from 0 to 1, got {settings[name]!r}")
    solver = NSGA2(
        pop_size=settings["population"],
        n_offsprings=settings["offsprings"],
        crossover=SBX(prob=settings["crossover_probability"], eta=CROSSOVER_INDEX),
        mutation=PM(prob=settings["mutation_probability"], eta=MUTATION_INDEX),
    )
    return solver, settings | {"crossover_index": CROSSOVER_INDEX, "mutation_index": MUTATION_INDEX}


class _Watch:
    """Collects what an algorithm evaluates and keeps the books, generation by generation."""

    def __init__(self, problem: TrajectoryProblem) -> None:
        self.archive = Archive(problem.n_var, problem.n_obj, problem.n_ieq_constr)
        self.reference_point = problem.reference_point
        self.evaluations: list[int] = []
        self.hypervolume: list[float] = []
        self.least_violation: list[float | None] = []
        self.front_size: list[int] = []

    def collect(self, population: Population) -> None:
        """Callback of pymoo's evaluator."""
        X, F, G = population.get("X", "F", "G")
        self.archive.add(X, F, G)
        if self.archive.failures and not self.archive.first_failure:
            said = [individual.get("failure") for individual in population]
            self.archive.first_failure = next((message for message in said if message), "")

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
    evaluator.callback = watch.collect
    solver.setup(problem, termination=("n_gen", generations), seed=seed, evaluator=evaluator)
    began, interrupted = time.perf_counter(), False
    with reporter(generations, enabled=progress) as shown:
        try:
            while solver.has_next():
                solver.next()
                shown.update(watch.close(len(watch.evaluations) + 1, evaluator.n_eval))
        except KeyboardInterrupt:
            interrupted = True
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


def _box_corner(F: Array) -> Array:
    """A reference point for a problem that names none: a tenth beyond the worst of the first feasible points."""
    corner: Array = F.max(axis=0) + 0.1 * np.abs(F).max(axis=0)
    return corner


def _whole(name: str, value: object, least: int) -> None:
    if not isinstance(value, int | np.integer) or isinstance(value, bool) or value < least:
        raise InvalidInputError(f"{name}: expected a whole number of at least {least}, got {value!r}")
