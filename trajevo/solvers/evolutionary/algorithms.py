"""Algorithms by name, for the command line and for tasks."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import count, takewhile
from typing import Any

from pymoo.algorithms.moo.nsga3 import NSGA3
from pymoo.algorithms.moo.rvea import RVEA
from pymoo.algorithms.moo.sms import SMSEMOA
from pymoo.algorithms.moo.spea2 import SPEA2
from pymoo.algorithms.moo.unsga3 import UNSGA3
from pymoo.core.algorithm import Algorithm
from pymoo.util.ref_dirs import get_reference_directions

from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError, checked_name
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.solvers.evolutionary.algorithm_state import age_moea2
from trajevo.solvers.evolutionary.first_population import DEFAULT_STARTS
from trajevo.solvers.evolutionary.moead import ConstrainedMOEAD


def _age_moea2(**sizes: int) -> Algorithm:
    """AGE-MOEA-II, which needs numba."""
    solver: Algorithm = age_moea2()(**sizes)
    return solver


#: Settings of a run that every algorithm has, by the names that :func:`trajevo.solvers.optimise.optimise` has for them.
OF_RUN = ("starts", "evaluations", "cpu_time", "polish", "polish_every")

#: Algorithms that follow reference directions.
_ALONG_DIRECTIONS: dict[str, Callable[..., Algorithm]] = {
    "moea/d": ConstrainedMOEAD,
    "nsga3": NSGA3,
    "rvea": RVEA,
    "u-nsga3": UNSGA3,
}

#: Algorithms besides NSGA-II that need nothing but a population size, and directions where they follow them.
ALGORITHMS: dict[str, Callable[..., Algorithm]] = {
    "age-moea2": _age_moea2,
    "sms-emoa": SMSEMOA,
    "spea2": SPEA2,
} | _ALONG_DIRECTIONS


def algorithm_settings(name: str, own: dict[str, Any], problem: TrajectoryProblem) -> dict[str, Any]:
    """Keyword arguments of :func:`trajevo.solvers.optimise.optimise` for an algorithm by name.

    NSGA-III, U-NSGA-III, RVEA and MOEA/D follow the reference directions of Das and Dennis, see
    :func:`reference_directions`; the population of MOEA/D is their number, and its offspring at most as many.

    Args:
        name: ``"nsga2"`` or a key of :data:`ALGORITHMS`.
        own: settings of NSGA-II by name; of the others population and offsprings alone; and :data:`OF_RUN`.
        problem: what is to be solved: its usual population counts where none is given, and its number of objectives
            where there are directions.

    Raises:
        UnknownNameError: no such algorithm.
        InvalidInputError: a setting that the algorithm does not have, or directions for a single objective or for more
            objectives than individuals.
    """
    of_run = {key: own[key] for key in OF_RUN if own.get(key) is not None}
    own = {key: value for key, value in own.items() if key not in OF_RUN}
    if name == "nsga2":
        return own | of_run
    checked_name("algorithm", name, ["nsga2", *ALGORITHMS])
    size = own.get("population") or problem.evolution.population
    for key, value in own.items():
        if value is not None and key not in ("population", "offsprings"):
            raise InvalidInputError(f"{key}: the algorithm {name!r} has no such setting")
    sizes: dict[str, Any] = {"pop_size": size, "n_offsprings": own.get("offsprings") or size}
    if name in _ALONG_DIRECTIONS:
        if problem.n_obj < 2:
            raise InvalidInputError(f"algorithm: {name!r} follows directions between objectives, the problem has one")
        sizes["ref_dirs"] = reference_directions(problem.n_obj, size)
        if name == "moea/d":
            count = len(sizes["ref_dirs"])
            sizes |= {"pop_size": count, "n_offsprings": min(own.get("offsprings") or count, count)}
    solver: Algorithm = ALGORITHMS[name](**sizes)
    return {"algorithm": solver, "starts": DEFAULT_STARTS} | of_run


def reference_directions(objectives: int, most: int) -> Array:
    """The directions of Das and Dennis with as many partitions of each axis as leave no more of them than allowed.

    p partitions give (p + m - 1)! / (p! (m - 1)!) directions between m objectives: with 100 individuals 100 for two
    objectives, 91 for three, 84 for four. The population may be larger than their number.

    Args:
        objectives: m, 2 or more.
        most: greatest number of directions, the population.

    Returns:
        Shape (directions, m), rows of sum 1.

    Raises:
        InvalidInputError: fewer than one direction for each objective.
    """
    partitions = list(takewhile(lambda p: math.comb(p + objectives - 1, objectives - 1) <= most, count(1)))
    if not partitions:
        raise InvalidInputError(f"population: expected at least {objectives}, one per objective, got {most}")
    directions: Array = get_reference_directions("das-dennis", objectives, n_partitions=partitions[-1])
    return directions
