"""Rows of the table: whole runs of NSGA-II."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Iterator

import numpy as np
from cases import FAST, PLAIN, Asked, Case, Line
from compare import Action
from elementwise import Elementwise, Free
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.problem import Problem
from pymoo.operators.crossover.sbx import SBX
from pymoo.operators.mutation.pm import PM
from pymoo.optimize import minimize
from subjects import SUBJECTS, ours

from trajevo import TrajectoryProblem, optimise
from trajevo.base.arrays import Array
from trajevo.formulation.search import Search
from trajevo.problems import HybridManipulator
from trajevo.solvers.evolutionary.nsga2 import ArrayNSGA2

#: Of the two problems that ratios are asked of; the others run for as many generations as their evaluation one by one
#: can be waited for.
WHOLE, SHORT = HybridManipulator.evolution, 20

ONE_BY_ONE, FREE, ARRAYS = "pymoo, one by one", "pymoo, evaluation free", "trajevo's NSGA-II, evaluation free"
PYGMO = "pygmo, our evaluation through bfe, limits as penalties"


def lines() -> Iterator[Line]:
    """Every registered problem, from random starts, without polish."""
    for title, (make, one_by_one) in SUBJECTS.items():
        problem = make()
        whole = "13 knots" in title
        own = WHOLE if whole else problem.evolution.updated(generations=SHORT)
        ways: dict[str, Action] = {}
        if one_by_one is not None:
            ways[ONE_BY_ONE] = by_pymoo(Elementwise(problem, one_by_one(problem)), own)
        ways |= {FREE: by_pymoo(Free(problem), own), ARRAYS: by_pymoo(Free(problem), own, ArrayNSGA2)}
        missing: tuple[str, ...] = ()
        if whole and importlib.util.find_spec("pygmo") is not None:
            ways[PYGMO] = by_pygmo(problem, own)
        elif whole:
            missing = ("pygmo",)
        ways |= ours(make, lambda problem, own=own: run(problem, own))
        asked = (Asked(ONE_BY_ONE, PLAIN, 15.0), Asked(ONE_BY_ONE, FAST, 40.0), Asked(FREE, FAST, 2.0))
        size = f"{own.population} x {own.generations}"
        title = f"NSGA-II {size}, {title}"
        yield from Case(title=title, ways=ways, rounds=3, asked=asked if whole else (), missing=missing).lines()


def run(problem: TrajectoryProblem, own: Search) -> object:
    """Ours."""
    return optimise(problem, own, seed=1, starts="random", polish=False, progress=False)


def by_pymoo(problem: Problem, own: Search, kind: Callable[..., NSGA2] = NSGA2) -> Action:
    """pymoo's `minimize` with the same operators."""
    crossover = SBX(prob=own.crossover_probability, eta=own.crossover_index)
    mutation = PM(prob=1.0, prob_var=own.mutation_probability, eta=own.mutation_index)
    solver = kind(pop_size=own.population, crossover=crossover, mutation=mutation)
    return lambda: minimize(problem, solver, ("n_gen", own.generations), seed=1)


class Penalised:
    """A problem for pygmo, whose NSGA-II knows no constraints: what exceeds them is added to every objective."""

    def __init__(self, problem: TrajectoryProblem) -> None:
        self.problem = problem

    def __deepcopy__(self, memo: dict[int, object]) -> Penalised:
        return self  # pygmo copies its problem every generation, which would take longer than its evaluation

    def get_nobj(self) -> int:
        """How many objectives."""
        return int(self.problem.n_obj)

    def get_bounds(self) -> tuple[Array, Array]:
        """Least and greatest of the variables."""
        return self.problem.xl, self.problem.xu

    def fitness(self, x: Array) -> Array:
        """Values of one candidate."""
        return self.batch_fitness(x)

    def batch_fitness(self, x: Array) -> Array:
        """Values of candidates one after another in a flat array."""
        F, G = self.problem.evaluate(x.reshape(-1, self.problem.n_var), return_values_of=["F", "G"])
        exceeded = 1e6 * np.maximum(G, 0.0).sum(axis=1, keepdims=True)
        values: Array = (F + exceeded).ravel()
        return values


def by_pygmo(problem: TrajectoryProblem, own: Search) -> Action:
    """pygmo's NSGA-II with the same settings; its first population is one generation."""
    import pygmo

    described = pygmo.problem(Penalised(problem))

    def solve() -> object:
        algorithm = pygmo.nsga2(
            gen=own.generations - 1,
            cr=own.crossover_probability,
            eta_c=own.crossover_index,
            m=own.mutation_probability,
            eta_m=own.mutation_index,
            seed=1,
        )
        algorithm.set_bfe(pygmo.bfe(pygmo.member_bfe()))
        first = pygmo.population(described, size=own.population, seed=1, b=pygmo.bfe(pygmo.member_bfe()))
        return pygmo.algorithm(algorithm).evolve(first)

    return solve
