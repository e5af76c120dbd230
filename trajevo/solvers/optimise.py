"""Solve a trajectory problem: NSGA-II with its paper's settings unless told otherwise, a front out."""

from __future__ import annotations

import copy
import math
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pymoo.core.algorithm import Algorithm
from pymoo.operators.crossover.sbx import SBX
from pymoo.operators.mutation.pm import PM

from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError
from trajevo.formulation.evaluation import checked_time_limit
from trajevo.formulation.problem import Evolution, TrajectoryProblem
from trajevo.formulation.task import task_problem
from trajevo.formulation.task_file import TaskSettings, read_task
from trajevo.front.front import Front
from trajevo.front.records import ProblemRecord, installed_versions
from trajevo.solvers.evolutionary.algorithm_state import specification
from trajevo.solvers.evolutionary.algorithms import algorithm_settings
from trajevo.solvers.evolutionary.first_population import DEFAULT_STARTS, begin_with
from trajevo.solvers.evolutionary.nsga2 import ArrayNSGA2
from trajevo.solvers.gradient.polish import check_polishable, checked_cpu_time
from trajevo.solvers.gradient.weighted_sum import minimise_weighted
from trajevo.solvers.run.folder import Manifest
from trajevo.solvers.run.runs import begin

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
    initial: Front | Array | None = None,
    starts: str | None = None,
    time_limit: float | None = None,
    evaluations: int | None = None,
    cpu_time: float | None = None,
    polish: bool | None = None,
    polish_every: int | None = None,
    out: str | Path | None = None,
    overwrite: bool = False,
    progress: bool = True,
) -> Front:
    """Run a multi-objective evolutionary algorithm and keep every feasible point that nothing dominates.

    The default is pymoo's NSGA-II with simulated binary crossover and polynomial mutation, its settings those of the
    problem's paper (``problem.evolution``). The mutation probability is that of each variable, as Deb defined it. The
    "pool size" of Sun 2020 has no counterpart in pymoo's NSGA-II but the number of offspring per generation: pass
    ``offsprings=75`` for it.

    An interrupt from the keyboard or SIGTERM ends the run after the generation it is at and returns what was found so
    far, marked as interrupted; a second one aborts. With ``out`` the run can be killed at any instant:
    :func:`trajevo.solvers.run.runs.resume` goes on from its latest checkpoint. Checkpoints take about 1 % of the time.

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
        initial: individuals to begin with, shape (N, n_var), or a front of the same problem, its payload excepted,
            whose points are taken, see :func:`trajevo.solvers.evolutionary.first_population.warm_start`.
        starts: what the rest of the first population is, a key of
            :data:`trajevo.solvers.evolutionary.first_population.STARTS`; if None ``"spread"``, and of an algorithm that
            is passed its own.
        time_limit: time that evaluating one individual may take [s]; one that takes longer counts as failed. The
            evaluation then goes on in a process of its own.
        evaluations: how many individuals the run may evaluate, a gradient counted as one for each variable; the
            evolution ends after the generation that reaches their number, or half of it where the front is polished.
        cpu_time: CPU time of this process that the run may take [s]; the evolution ends after the generation that
            passes it, or half of it where the front is polished, and not before the first. How far it gets depends on
            the machine.
        polish: refine the front by gradients at the end, see :func:`trajevo.solvers.gradient.polish.polish`; where that
            is possible if None. A run that was interrupted or found nothing is left as it is. In a folder the front as
            the evolution left it is kept too, in ``evolved.json``.
        polish_every: refine a few members after every so many generations as well, and put them among the individuals
            of the next one.
        out: folder to keep every evaluated individual, checkpoints and the front in.
        overwrite: replace the run that the folder holds; refused otherwise.
        progress: show generation, hypervolume, least violation and time left on standard error.

    Returns:
        The front; of a problem whose solutions are curves (``problem.expansion``) that of the points on their lower
        envelope. If nothing feasible was found it is empty and ``front.blocking`` says which constraint is in the way.

    Raises:
        InvalidInputError: a setting that cannot be used, or a folder that holds a run or cannot be written; the
            message names it.
    """
    if not isinstance(problem, TrajectoryProblem):
        raise InvalidInputError(f"problem: expected a TrajectoryProblem, got {type(problem).__name__}")
    seed = _whole("seed", seed, 0)
    limit = None if time_limit is None else checked_time_limit(time_limit)
    count = _whole("generations", problem.evolution.generations if generations is None else generations, 1)
    own = {
        "population": population,
        "offsprings": offsprings,
        "crossover_probability": crossover_probability,
        "crossover_index": crossover_index,
        "mutation_probability": mutation_probability,
        "mutation_index": mutation_index,
    }
    of_run = checked_run(
        problem,
        {
            "evaluations": evaluations,
            "cpu_time": cpu_time,
            "polish": polish,
            "polish_every": polish_every,
            "time_limit": limit,
        },
    )
    if algorithm is None:
        solver, settings = nsga2(problem.evolution, own)
    else:
        given = [name for name, value in own.items() if value is not None]
        if given:
            raise InvalidInputError(f"{given[0]}: set it on the algorithm that is passed, {type(algorithm).__name__}")
        if not isinstance(algorithm, Algorithm) or algorithm.is_initialized or algorithm.problem is not None:
            raise InvalidInputError(f"algorithm: expected a pymoo algorithm that has not run yet, got {algorithm!r}")
        solver = copy.deepcopy(algorithm)
        settings = _described(algorithm)
    if starts is None:
        starts = DEFAULT_STARTS if algorithm is None else "random"
    began = time.process_time()
    settings |= begin_with(solver, problem, starts=starts, initial=initial, seed=seed, time_limit=limit)
    count = int(min(count, _most_generations(of_run, solver)))
    settings |= {"generations": count} | {key: value for key, value in of_run.items() if value is not None}
    manifest = _manifest(problem, solver, settings, seed, limit)
    spent = time.process_time() - began
    return begin(problem, solver, manifest, out=out, overwrite=overwrite, progress=progress, cpu_spent=spent)


def nsga2(evolution: Evolution, own: dict[str, Any]) -> tuple[Algorithm, dict[str, Any]]:
    """NSGA-II and its settings.

    Args:
        evolution: settings of the problem's paper.
        own: settings that go before them, by the names that :func:`optimise` has for them.

    Raises:
        InvalidInputError: a setting that cannot be used; the message names it.
    """
    settings: dict[str, Any] = asdict(evolution) | {name: value for name, value in own.items() if value is not None}
    settings.setdefault("offsprings", settings["population"])
    for name, least in (("population", 4), ("offsprings", 1)):
        settings[name] = _whole(name, settings[name], least)
    for name in ("crossover_probability", "mutation_probability"):
        _between(name, settings[name], 0.0, 1.0)
    # Wider indices are refused by pymoo.
    for name in ("crossover_index", "mutation_index"):
        _between(name, settings[name], 1.0, 100.0)
    solver = ArrayNSGA2(
        pop_size=settings["population"],
        n_offsprings=settings["offsprings"],
        crossover=SBX(prob=settings["crossover_probability"], eta=settings["crossover_index"]),
        mutation=PM(prob=1.0, prob_var=settings["mutation_probability"], eta=settings["mutation_index"]),
    )
    return solver, settings


def checked_run(problem: TrajectoryProblem, given: dict[str, Any]) -> dict[str, Any]:
    """Settings of a run beside those of its algorithm.

    Args:
        problem: what is solved.
        given: ``evaluations``, ``cpu_time``, ``polish``, ``polish_every`` and ``time_limit``, as :func:`optimise` is
            given them.

    Returns:
        The same but for the time limit; whether the front is polished where that was left open.

    Raises:
        InvalidInputError: one that cannot be used, or the problem cannot be polished and is to be.
    """
    budget, every, polish = given["cpu_time"], given["polish_every"], given["polish"]
    if polish is not None and not isinstance(polish, bool):
        raise InvalidInputError(f"polish: expected True, False or None, got {polish!r}")
    most = given["evaluations"]
    settings = {
        "evaluations": None if most is None else _whole("evaluations", most, 1),
        "cpu_time": None if budget is None else checked_cpu_time(budget),
        "polish": False,
        "polish_every": None if every is None else _whole("polish_every", every, 1),
    }
    if polish is False and every is None:
        return settings
    try:
        if given["time_limit"] is not None:
            raise InvalidInputError("polish: gradients are not evaluated in a process of their own, as time_limit asks")
        check_polishable(problem if problem.expansion is None else problem.expansion.problem)
    except InvalidInputError:
        if polish or every is not None:
            raise
        return settings
    return settings | {"polish": polish is not False}


def _most_generations(of_run: dict[str, Any], solver: Algorithm) -> float:
    """Generations that the individuals which may be evaluated suffice for; some algorithms plan with their number."""
    size = getattr(solver, "n_offsprings", None)
    if of_run["evaluations"] is None or not size:
        return math.inf
    for_evolution = (0.5 if of_run["polish"] else 1.0) * float(of_run["evaluations"])
    return max(1, math.ceil(for_evolution / int(size)))


def _manifest(
    problem: TrajectoryProblem, solver: Algorithm, settings: dict[str, Any], seed: int, time_limit: float | None
) -> Manifest:
    """How the run is begun; the algorithm as data where it can be resumed, else why it cannot."""
    described, why = None, ""
    try:
        described = specification(solver)
    except InvalidInputError as error:
        why = str(error)
    return Manifest(
        problem=ProblemRecord.of(problem),
        algorithm=described,
        not_resumable=why,
        algorithm_name="NSGA2" if isinstance(solver, ArrayNSGA2) else type(solver).__name__,
        settings=settings,
        seed=seed,
        generations=settings["generations"],
        time_limit=time_limit,
        evaluations=settings.get("evaluations"),
        cpu_time=settings.get("cpu_time"),
        polish=settings["polish"],
        polish_every=settings.get("polish_every"),
        versions=installed_versions(),
    )


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


@dataclass(frozen=True, eq=False)
class Task:
    """A task that was read: the problem it sets and how it is to be solved.

    Attributes:
        file: where it was read from.
        settings: its keys.
        problem: the problem, the same that its class makes of the same things.
    """

    file: Path
    settings: TaskSettings
    problem: TrajectoryProblem

    def solve(
        self,
        *,
        seed: int | None = None,
        generations: int | None = None,
        population: int | None = None,
        starts: str | None = None,
        time_limit: float | None = None,
        evaluations: int | None = None,
        cpu_time: float | None = None,
        polish: bool | None = None,
        polish_every: int | None = None,
        out: str | Path | None = None,
        overwrite: bool = False,
        progress: bool = True,
    ) -> Front:
        """Solve it with the task's algorithm; what is given here goes before what the file says.

        Args:
            seed: as for :func:`trajevo.solvers.optimise.optimise`, and so are the others.
            generations: generations.
            population: individuals.
            starts: what the first population is.
            time_limit: time that evaluating one individual may take [s].
            evaluations: individuals that the run may evaluate.
            cpu_time: CPU time that the run may take [s].
            polish: refine the front by gradients at the end.
            polish_every: generations after which some members are refined each time.
            out: folder to keep the run in.
            overwrite: replace the run that the folder holds.
            progress: show the progress on standard error.
        """
        own = self.settings.algorithm.model_dump(exclude_none=True)
        name, length = own.pop("name"), own.pop("generations", None)
        given = {
            "starts": starts,
            "population": population,
            "evaluations": evaluations,
            "cpu_time": cpu_time,
            "polish": polish,
            "polish_every": polish_every,
        }
        own |= {key: value for key, value in given.items() if value is not None}
        return optimise(
            self.problem,
            seed=self.settings.seed if seed is None else seed,
            generations=length if generations is None else generations,
            time_limit=time_limit,
            out=out,
            overwrite=overwrite,
            progress=progress,
            **algorithm_settings(name, own, self.problem),
        )


def load_task(file: str | Path) -> Task:
    """Read a task.

    Args:
        file: TOML, see :class:`TaskSettings`; relative paths in it count from its folder.

    Raises:
        InvalidInputError: it cannot be read, or a key is missing, unknown or has a value that cannot be used; the
            message names file, line and key.
    """
    path = Path(file)
    settings, where = read_task(path)
    return Task(path, settings, task_problem(settings, where))
