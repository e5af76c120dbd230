"""pygmo on the plain statement: NSGA-II for fronts, self-adaptive differential evolution for a least value.

Both refuse constraints, so that what exceeds a limit is a penalty on every objective.
"""

from __future__ import annotations

from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.study.bench.adapters.adapter import BenchRival
from trajevo.study.bench.adapters.of_scipy import Remembered
from trajevo.study.bench.contest import Contest

#: Individuals, a multiple of four; generations before the population is asked again.
POPULATION, GENERATIONS = 100, 10

#: Penalty of every objective, scaled to its box: of any excess at all, and per share of a limit.
PENALTY = 10.0


@final
class Pygmo(BenchRival):
    """Algorithms of PaGMO; each of many generations, again and again from its own last population."""

    name = "pygmo"
    says = "NSGA-II, or sade for a least value, on the plain statement; it refuses constraints, so limits are penalties"
    module, distribution = "pygmo", "pygmo"
    plain = True

    def solve(self, contest: Contest) -> None:
        """See :meth:`BenchRival.solve`."""
        import pygmo

        values = Remembered(contest)

        class Penalised:
            def fitness(self, x: Array) -> Array:
                F, G = values(x)
                excess = float(np.maximum(G, 0.0).sum())
                penalised: Array = F + PENALTY * (excess + (excess > 0.0))
                return penalised

            def get_bounds(self) -> tuple[Array, Array]:
                return contest.lower, contest.upper

            def get_nobj(self) -> int:
                return contest.n_obj

            def __deepcopy__(self, memory: Any) -> Penalised:  # what is tried is noted in one place
                return self

        kind = pygmo.nsga2 if contest.n_obj > 1 else pygmo.sade
        population = pygmo.population(pygmo.problem(Penalised()), size=POPULATION, seed=contest.seed)
        for number in range(10**9):
            # Seeds of 32 bits, another one for every call.
            seed = (contest.seed * 1_000_003 + number) % 2**32
            population = pygmo.algorithm(kind(gen=GENERATIONS, seed=seed)).evolve(population)
