"""Evolution over the order of visits and postures: operators against pymoo's, searches against enumeration."""

import itertools

import numpy as np
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.operators.crossover.ox import ox
from pymoo.operators.mutation.inversion import inversion_mutation
from pymoo.optimize import minimize

from tests.formulation.test_visits import on_table
from trajevo import Search, optimise, read_run, resume
from trajevo.solvers.evolutionary.algorithms import algorithm_for
from trajevo.solvers.evolutionary.choices import ChoiceCrossover, ChoiceMutation, choices_of, inverted, ordered
from trajevo.solvers.evolutionary.first_population import first_population
from trajevo.solvers.evolutionary.order_search import OrderSearch


@pytest.fixture(scope="module")
def table():
    return on_table(order={"free": [1, 2, 3, 4], "after": {4: [2]}}, objectives=["time", "jerk"])


@pytest.fixture(scope="module")
def free():
    return on_table(objectives=["time", "jerk"])


class Drawn:
    """A generator that gives the same places as those told."""

    def __init__(self, start, end):
        self.left = [start, end - start]

    def integers(self, *args, size=None, **kwargs):
        return np.full(size, self.left.pop(0))


@pytest.mark.parametrize("part", list(itertools.combinations(range(4), 2)))
def test_order_crossover_is_that_of_pymoo(free, part):
    visits, random = choices_of(free).visits, np.random.default_rng(3)
    parents = np.array([[[0, *(1 + random.permutation(4)), 5] for _ in range(6)] for _ in range(2)])
    keys = ordered(visits, parents, Drawn(*part))
    children = visits.free.decoded(keys)[:, 1:5].reshape(2, 6, 4)
    for k in range(6):
        first, second = parents[:, k, 1:5]
        np.testing.assert_array_equal(children[0, k], ox(first, second, seq=part))
        np.testing.assert_array_equal(children[1, k], ox(second, first, seq=part))


def test_inversion_is_that_of_pymoo(free):
    visits = choices_of(free).visits
    orders = np.array([[0, 3, 1, 4, 2, 5]])
    keys = inverted(visits, orders, 1.0, np.random.default_rng(5))
    found = visits.free.decoded(keys)[0, 1:5]
    every = [inversion_mutation(orders[0, 1:5].copy(), part) for part in itertools.combinations(range(4), 2)]
    assert any((found == each).all() for each in every)


def test_children_keep_bounds_precedence_and_plain_numbers(table):
    random, choices = np.random.default_rng(0), choices_of(table)
    X = random.uniform(table.xl, table.xu, (80, table.n_var))
    children = ChoiceCrossover()._do(table, X.reshape(2, 40, -1), random_state=random).reshape(80, -1)
    for found in (children, ChoiceMutation()._do(table, X, random_state=random)):
        assert ((found >= table.xl) & (found <= table.xu)).all()
        columns = found[:, choices.columns]
        assert choices.visits.free.keeps(choices.visits.orders(columns)).all()
        np.testing.assert_array_equal(columns, choices.visits.plain(columns))


def test_a_leg_inherits_its_share_of_the_time_from_rest_to_rest(table):
    """Of equal times as multiples of their legs, children have the same multiples in any order."""
    random, choices = np.random.default_rng(1), choices_of(table)
    X = random.uniform(table.xl, table.xu, (40, table.n_var))
    times = choices.interpolant.leg_of >= 0
    X[:, times] = 1.3 * choices.legs(X)[:, times]
    children = ChoiceCrossover()._do(table, X.reshape(2, 20, -1), random_state=random).reshape(40, -1)
    np.testing.assert_allclose(children[:, times], 1.3 * choices.legs(children)[:, times], rtol=1e-9)


def test_the_best_order_of_motions_is_that_of_enumeration(free):
    choices = choices_of(free)
    every = np.array([[0, *way, 5] for way in itertools.permutations(range(1, 5))])
    search = OrderSearch(free, choices)
    _, seconds = search.quickest(search._of_orders(every), 25)
    for seed in range(3):
        found = OrderSearch(free, choices).run(np.random.default_rng(seed))
        np.testing.assert_allclose(found.seconds[0], seconds.min(), rtol=1e-9)
        of_speed = [not name.startswith("position") for name in free.constraint_names]
        kept = free.evaluate(found.x, return_values_of=["F", "G"])[1][:, of_speed]
        assert kept.max() <= 1e-12


@pytest.mark.parametrize("starts", ["spread", "fastest", "sobol"])
def test_first_populations_have_many_orders_and_the_best_one(table, starts):
    X = first_population(table, 40, starts=starts, seed=1).X
    orders = choices_of(table).visits.orders(X[:, choices_of(table).columns])
    assert len(np.unique(orders, axis=0)) >= 5
    assert choices_of(table).visits.free.keeps(orders).all()
    if starts != "sobol":
        F, G = table.evaluate(X, return_values_of=["F", "G"])
        best = OrderSearch(table, choices_of(table)).run(np.random.default_rng(1))
        np.testing.assert_allclose(F[(G <= 0.0).all(axis=1), 0].min(), best.seconds[0], rtol=1e-6)


def test_seeds_agree_on_the_fastest_motion(table):
    fronts = [optimise(table, seed=seed, population=24, generations=12, progress=False) for seed in (0, 1)]
    ends = [front.F[:, 0].min() for front in fronts]
    np.testing.assert_allclose(ends, min(ends), rtol=1e-4)
    for front in fronts:
        best = front.pick(int(front.F[:, 0].argmin()))
        assert best.order[0] == 0
        assert best.order.index(2) < best.order.index(4)
        assert best.postures == ("",) * 6
        assert {"order", "postures"} < set(front.to_dataframe().columns)


@pytest.mark.parametrize("algorithm", ["spea2", "nsga3", "moea/d"])
def test_other_algorithms_have_the_same_operators(table, algorithm):
    chosen = algorithm_for(Search(algorithm=algorithm, population=12), table).solver
    assert isinstance(chosen.mating.crossover, ChoiceCrossover)
    assert isinstance(chosen.mating.mutation, ChoiceMutation)
    front = optimise(table, algorithm=algorithm, population=12, generations=3, seed=0, polish=False, progress=False)
    assert front.run.generations == 3


def test_pymoo_alone_solves_it(table):
    found = minimize(table, NSGA2(pop_size=24), ("n_gen", 15), seed=1)
    assert found.F is not None
    assert len(found.F)


def test_an_interrupted_run_goes_on_as_if_it_had_not_been(table, tmp_path):
    arguments = {"seed": 3, "population": 12, "polish": False, "progress": False}
    whole = optimise(table, generations=6, **arguments)
    optimise(table, generations=3, out=tmp_path / "run", **arguments)
    going = resume(tmp_path / "run", generations=6, progress=False)
    np.testing.assert_array_equal(going.F, whole.F)
    np.testing.assert_array_equal(going.X, whole.X)
    assert read_run(tmp_path / "run").knee().order == whole.knee().order
