"""MOEA/D under limits: whoever breaks them by less goes first, then whoever is better along the direction."""

import moocore
import numpy as np
import pytest
from pymoo.algorithms.moo.moead import ParallelMOEAD
from pymoo.core.individual import Individual
from pymoo.core.population import Population
from pymoo.core.problem import Problem
from pymoo.optimize import minimize
from pymoo.problems import get_problem

from tests.helpers import refused
from trajevo.solvers.evolutionary.algorithms import reference_directions
from trajevo.solvers.evolutionary.moead import ConstrainedMOEAD

DIRECTIONS = reference_directions(2, 20)


def individual(F, G):
    one = Individual(F=np.array(F, dtype=float), G=np.array([G], dtype=float))
    one.evaluated.update("FGH")
    return one


def set_up(neighbours):
    solver = ConstrainedMOEAD(DIRECTIONS, n_neighbors=2)
    solver.setup(Problem(n_var=1, n_obj=2, n_ieq_constr=1, xl=0.0, xu=1.0), termination=("n_gen", 2), seed=1)
    others = [individual([9.0, 9.0], 5.0) for _ in range(len(DIRECTIONS) - 2)]
    pop = Population(individuals=[*others, *others[:2]])
    rows = solver.neighbors[3]
    pop[rows] = Population(individuals=neighbours)
    solver.pop, solver.ideal = pop, np.zeros(2)
    return solver, rows


@pytest.mark.parametrize(
    ("neighbours", "offspring", "replaced"),
    [
        ([([1.0, 1.0], 0.0), ([1.0, 1.0], 0.2)], ([5.0, 5.0], 0.1), [False, True]),
        ([([1.0, 1.0], 0.0), ([3.0, 3.0], -1.0)], ([2.0, 2.0], -0.5), [False, True]),
        ([([1.0, 1.0], 0.3), ([9.0, 9.0], 0.2)], ([0.1, 0.1], 0.4), [False, False]),
        ([([1.0, 1.0], 0.3), ([0.1, 0.1], 0.2)], ([7.0, 7.0], 0.0), [True, True]),
    ],
)
def test_limits_go_before_objectives(neighbours, offspring, replaced):
    solver, rows = set_up([individual(*one) for one in neighbours])
    new = individual(*offspring)
    solver._replace(3, new)
    assert [one is new for one in solver.pop[rows]] == replaced


def test_without_limits_it_finds_the_front_that_pymoos_finds():
    problem = get_problem("zdt1", n_var=6)
    own = minimize(problem, ConstrainedMOEAD(DIRECTIONS), ("n_gen", 120), seed=1)
    theirs = minimize(problem, ParallelMOEAD(DIRECTIONS), ("n_gen", 120), seed=1)
    volumes = [moocore.hypervolume(found.F, ref=[1.1, 1.1]) for found in (own, theirs)]
    # The whole of it under the curve 1 - sqrt(f): 1.21 - 1/3.
    assert 0.95 * (1.21 - 1.0 / 3.0) < volumes[0] < 1.21 - 1.0 / 3.0
    assert volumes[0] > 0.98 * volumes[1]


def test_units_of_objectives_play_no_part():
    class Scaled(Problem):
        def __init__(self, factor):
            self.factor, self.inner = factor, get_problem("zdt1", n_var=4)
            super().__init__(n_var=4, n_obj=2, xl=0.0, xu=1.0)

        def _evaluate(self, x, out, *args, **kwargs):
            out["F"] = self.inner.evaluate(x) * np.array([1.0, self.factor])

    plain, scaled = (
        minimize(Scaled(factor), ConstrainedMOEAD(DIRECTIONS), ("n_gen", 30), seed=1) for factor in (1, 4096)
    )
    np.testing.assert_array_equal(plain.X, scaled.X)


def test_other_sizes_are_refused():
    refused(lambda: ConstrainedMOEAD(DIRECTIONS, pop_size=7), "population: MOEA/D has one individual for each of 20")
    refused(lambda: ConstrainedMOEAD(DIRECTIONS, n_offsprings=21), "offsprings: expected at most the population, 20")
