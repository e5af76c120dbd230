"""Algorithms by name: which settings of a search each accepts, and how it is constructed."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import count, takewhile
from typing import Any, final

from pymoo.core.algorithm import Algorithm

from trajevo.base.arrays import Array
from trajevo.base.plugins import Registry
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.formulation.search import DEFAULT_STARTS, OF_ALGORITHM, USUAL, Search
from trajevo.solvers.evolutionary.choices import ChoiceCrossover, ChoiceMutation, choices_of
from trajevo.solvers.evolutionary.kinds import class_of


@final
@dataclass(frozen=True)
class EvolutionaryAlgorithm:
    """An algorithm that a search can choose by name.

    Attributes:
        name: its name in Python, in tasks and studies, and on the command line.
        make: problem, and settings by their names in :class:`~trajevo.formulation.search.Search` -> a pymoo algorithm
            that has not run. The settings are population, offsprings and the operators in ``takes``.
        help: short description.
        takes: settings of a search that the algorithm accepts.
        objectives: least number of objectives of a problem.
    """

    name: str
    make: Callable[[TrajectoryProblem, dict[str, Any]], Algorithm]
    help: str
    takes: tuple[str, ...] = ("population", "offsprings")
    objectives: int = 1

    __repr__ = brief


def _nsga2(problem: TrajectoryProblem, own: dict[str, Any]) -> Algorithm:
    # Imported, like every algorithm, when it is made: a list of their names needs none of them.
    from pymoo.operators.crossover.sbx import SBX
    from pymoo.operators.mutation.pm import PM

    crossover, mutation = (SBX, PM) if choices_of(problem) is None else (ChoiceCrossover, ChoiceMutation)
    return class_of("ArrayNSGA2")(
        pop_size=own["population"],
        n_offsprings=own["offsprings"],
        crossover=crossover(prob=own["crossover_probability"], eta=own["crossover_index"]),
        mutation=mutation(prob=1.0, prob_var=own["mutation_probability"], eta=own["mutation_index"]),
    )


def _operators(problem: TrajectoryProblem) -> dict[str, Any]:
    """Operators of an algorithm that are not pymoo's own, which know nothing of variables that choose."""
    return {} if choices_of(problem) is None else {"crossover": ChoiceCrossover(), "mutation": ChoiceMutation()}


def _of_size(kind: str, problem: TrajectoryProblem, own: dict[str, Any]) -> Algorithm:
    return class_of(kind)(pop_size=own["population"], n_offsprings=own["offsprings"], **_operators(problem))


def _along_directions(kind: str, problem: TrajectoryProblem, own: dict[str, Any]) -> Algorithm:
    """An algorithm that follows the reference directions of Das and Dennis, see :func:`reference_directions`."""
    directions = reference_directions(problem.n_obj, own["population"])
    sizes = {"pop_size": own["population"], "n_offsprings": own["offsprings"]}
    return class_of(kind)(**sizes, ref_dirs=directions, **_operators(problem))


def _moead(problem: TrajectoryProblem, own: dict[str, Any]) -> Algorithm:
    """MOEA/D, which has one individual for each reference direction and at most as many offspring."""
    directions = reference_directions(problem.n_obj, own["population"])
    most = min(own["offsprings"], len(directions))
    sizes = {"pop_size": len(directions), "n_offsprings": most}
    return class_of("ConstrainedMOEAD")(**sizes, ref_dirs=directions, **_operators(problem))


#: Algorithms by name.
ALGORITHMS: dict[str, EvolutionaryAlgorithm] = {
    algorithm.name: algorithm
    for algorithm in (
        EvolutionaryAlgorithm("nsga2", _nsga2, "NSGA-II, with the operators of the problem's paper", OF_ALGORITHM),
        EvolutionaryAlgorithm("age-moea2", partial(_of_size, "AGEMOEA2"), "AGE-MOEA-II, which needs numba"),
        EvolutionaryAlgorithm("moea/d", _moead, "MOEA/D with limits, along reference directions", objectives=2),
        EvolutionaryAlgorithm("nsga3", partial(_along_directions, "NSGA3"), "NSGA-III", objectives=2),
        EvolutionaryAlgorithm("rvea", partial(_along_directions, "RVEA"), "RVEA", objectives=2),
        EvolutionaryAlgorithm("sms-emoa", partial(_of_size, "SMSEMOA"), "SMS-EMOA, by hypervolume contributions"),
        EvolutionaryAlgorithm("spea2", partial(_of_size, "SPEA2"), "SPEA2"),
        EvolutionaryAlgorithm("u-nsga3", partial(_along_directions, "UNSGA3"), "U-NSGA-III", objectives=2),
    )
}

#: The same, with those of other packages.
NAMED_ALGORITHMS: Registry[EvolutionaryAlgorithm] = Registry(
    kind="algorithm",
    group="trajevo.algorithms",
    own=ALGORITHMS,
    expected="a trajevo.EvolutionaryAlgorithm",
    fits=lambda found: isinstance(found, EvolutionaryAlgorithm),
)


@final
@dataclass(frozen=True)
class Chosen:
    """An algorithm that is ready to run.

    Attributes:
        solver: pymoo algorithm that has not run.
        settings: its sizes and operators, as they are recorded with a front.
        starts: kind of first population unless the search names one.
    """

    solver: Algorithm
    settings: dict[str, Any]
    starts: str


def algorithm_for(search: Search, problem: TrajectoryProblem) -> Chosen:
    """The algorithm of a search: made by its name, or a copy of the algorithm that was passed.

    Args:
        search: settings of the search; those that are None are taken from ``problem.evolution``.
        problem: what is to be solved.

    Raises:
        UnknownNameError: no such algorithm.
        InvalidInputError: a setting that the algorithm does not have, or an algorithm with reference directions for a
            single objective or for more objectives than individuals.
    """
    own = search.of_algorithm
    if isinstance(search.algorithm, Algorithm):
        for name in own:
            raise InvalidInputError(
                f"{name}: set it on the algorithm that is passed, {type(search.algorithm).__name__}"
            )
        return Chosen(copy.deepcopy(search.algorithm), _described(search.algorithm), "random")
    named = NAMED_ALGORITHMS.find(search.algorithm)
    for name in own:
        if name not in named.takes:
            raise InvalidInputError(f"{name}: the algorithm {search.algorithm!r} has no such setting")
    if problem.n_obj < named.objectives:
        raise InvalidInputError(
            f"algorithm: {search.algorithm!r} uses reference directions between at least two objectives, got one"
        )
    usual = USUAL.updated(**problem.evolution.given).given
    settings = {key: value for key, value in usual.items() if key in ("generations", *named.takes)} | own
    settings.setdefault("offsprings", settings["population"])
    # All algorithms of a class share pymoo's default objects, such as the survival of SPEA2.
    solver = copy.deepcopy(named.make(problem, settings))
    return Chosen(solver, settings if search.algorithm == "nsga2" else _described(solver), DEFAULT_STARTS)


def reference_directions(objectives: int, most: int) -> Array:
    """The reference directions of Das and Dennis: as many as possible, but no more than allowed.

    p partitions of each axis give (p + m - 1)! / (p! (m - 1)!) directions between m objectives. A population of 100
    allows 100 directions for two objectives, 91 for three and 84 for four, so it may be larger than their number.

    Args:
        objectives: number of objectives m, 2 or more.
        most: greatest number of directions, the population.

    Returns:
        Shape (directions, m), rows of sum 1.

    Raises:
        InvalidInputError: fewer than one direction for each objective.
    """
    partitions = list(takewhile(lambda p: math.comb(p + objectives - 1, objectives - 1) <= most, count(1)))
    if not partitions:
        raise InvalidInputError(f"population: expected at least {objectives}, one per objective, got {most}")
    from pymoo.util.ref_dirs import get_reference_directions  # imported where it computes, since that takes long

    directions: Array = get_reference_directions("das-dennis", objectives, n_partitions=partitions[-1])
    return directions


def _described(algorithm: Algorithm) -> dict[str, Any]:
    """Settings that can be read from an algorithm: sizes, and class and parameters of its operators."""
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
