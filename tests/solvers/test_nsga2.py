"""NSGA-II on arrays: pymoo's, individual by individual and to the bit, in everything that pymoo lets one do with it."""

import copy

import numpy as np
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.callback import Callback
from pymoo.core.evaluator import Evaluator
from pymoo.core.population import Population
from pymoo.core.problem import Problem
from pymoo.operators.crossover.dex import DEX
from pymoo.operators.crossover.sbx import SBX
from pymoo.operators.mutation.pm import PM
from pymoo.optimize import minimize
from pymoo.problems import get_problem
from pymoo.util.archive import MultiObjectiveArchive

from tests.helpers import mostly_long, refused, small_problem
from trajevo.problems import HybridManipulator, PickAndPlace, PointingMechanism, TimeJerkReparameterisation
from trajevo.solvers.evolutionary.nsga2 import ArrayNSGA2, Individuals


class Grid(Problem):
    """Equal crowding and violation, so that ties are drawn."""

    def __init__(self, **changes):
        super().__init__(**({"n_var": 2, "n_obj": 2, "n_ieq_constr": 1, "xl": 0.0, "xu": 1.0} | changes))

    def _evaluate(self, X, out, *args, **kwargs):
        level = np.round(3.0 * X)
        out["F"] = np.column_stack([level[:, 0], 3.0 - level[:, 0] + level[:, 1]])
        out["G"] = 1.0 - level[:, 1:]
        if self.n_eq_constr:
            out["H"] = level[:, :1] - 1.0 + 0.5e-4


class Failing(Problem):
    """Some individuals fail, and say so."""

    def __init__(self):
        super().__init__(n_var=3, n_obj=2, n_ieq_constr=2, xl=0.0, xu=1.0)

    def _evaluate(self, X, out, *args, **kwargs):
        out["F"] = np.column_stack([X[:, 0], 1.0 - X[:, 0] + X[:, 1]])
        out["G"] = np.column_stack([0.3 - X[:, 1], X[:, 2] - 0.6])
        failed = X[:, 2] > 0.8
        out["F"][failed] = out["G"][failed] = np.inf
        if failed.any():
            out["failure"] = np.where(failed, "x > 0.8", "").astype(object)


PROBLEMS = {
    **{name: lambda name=name: get_problem(name, n_var=8) for name in ("zdt1", "zdt2", "zdt3")},
    "dtlz2": lambda: get_problem("dtlz2", n_var=8, n_obj=4),
    "tnk": lambda: get_problem("tnk"),
    "c2dtlz2": lambda: get_problem("c2dtlz2", n_var=8, n_obj=3),
    "pointing": PointingMechanism,
    "hybrid": HybridManipulator,
    "pick-place": PickAndPlace,
    "reparam": TimeJerkReparameterisation,
    "grid": Grid,
    "equalities": lambda: Grid(n_eq_constr=1),
    "unconstrained failures": Failing,
}


def same(one: Population, other: Population) -> None:
    for name in ("X", "F", "G", "H", "CV"):
        np.testing.assert_array_equal(one.get(name), other.get(name))
    for mine, theirs in zip(one, other, strict=True):
        assert {key: value for key, value in mine.data.items() if value is not None} == theirs.data


def alike(problem: Problem, *, generations: int = 12, seed: int = 1, setup=lambda: {}, **settings) -> None:
    """Run both; individuals, what came of them and the state of the random numbers must be equal."""
    expected, found = (
        minimize(
            problem, kind(**copy.deepcopy(settings)), ("n_gen", generations), seed=seed, copy_algorithm=False, **setup()
        )
        for kind in (NSGA2, ArrayNSGA2)
    )
    same(expected.pop, found.pop)
    assert (expected.algorithm.off is None) == (found.algorithm.off is None)
    if expected.algorithm.off is not None:
        same(expected.algorithm.off, found.algorithm.off)
    same(expected.algorithm.opt, found.algorithm.opt)
    assert (expected.X is None) == (found.X is None)
    if expected.X is not None:
        np.testing.assert_array_equal(expected.X, found.X)
    one, other = expected.algorithm, found.algorithm
    assert one.random_state.bit_generator.state == other.random_state.bit_generator.state
    assert (one.evaluator.n_eval, one.n_iter) == (other.evaluator.n_eval, other.n_iter)


@pytest.mark.parametrize("name", mostly_long(PROBLEMS, *[*PROBLEMS][::3], "tnk", "equalities"))
@pytest.mark.parametrize("seed", mostly_long(range(3), 0))
def test_every_individual_is_pymoo_s(name, seed):
    alike(PROBLEMS[name](), seed=seed, pop_size=24)


@pytest.mark.long
@pytest.mark.parametrize("name", PROBLEMS)
def test_every_individual_is_pymoo_s_for_twenty_seeds_and_sizes(name):
    for seed in range(20):
        alike(PROBLEMS[name](), seed=seed, generations=60, pop_size=20 + 7 * seed)


@pytest.mark.parametrize(
    "settings",
    [
        {"n_offsprings": 7},
        {"n_offsprings": 50},
        {"crossover": SBX(prob=0.6, eta=3, prob_var=0.9), "mutation": PM(prob=0.5, eta=7, prob_var=0.3)},
        {"sampling": np.random.default_rng(5).uniform(0.0, 1.0, (24, 8))},
        {"sampling": np.random.default_rng(5).uniform(0.0, 1.0, (6, 8))},
        {"sampling": np.full((24, 8), 0.5)},
        {"sampling": Population.new(X=np.random.default_rng(5).uniform(0.0, 1.0, (24, 8)))},
    ],
)
def test_settings_are_taken_as_pymoo_takes_them(settings):
    alike(get_problem("zdt1", n_var=8), **({"pop_size": 24} | settings))


def test_a_run_that_can_make_no_new_individuals_ends():
    point = Problem(n_var=2, n_obj=2, xl=np.ones(2), xu=np.ones(2))
    point._evaluate = lambda X, out, *args, **kwargs: out.update(F=X)
    alike(point, pop_size=10)


class Tampering(Callback):
    """Changes individuals of the population between generations, as a local search would."""

    def update(self, algorithm):
        for one in algorithm.pop[:3]:
            one.X = np.clip(one.X + 0.01, 0.0, 1.0)


@pytest.mark.parametrize(
    "setup",
    [
        lambda: {"callback": Tampering()},
        lambda: {"save_history": True},
        lambda: {"archive": MultiObjectiveArchive()},
        lambda: {"evaluator": Evaluator(callback=lambda population: None)},
        lambda: {"evaluator": type("Own", (Evaluator,), {})()},
    ],
    ids=["callback", "history", "archive", "evaluator's callback", "evaluator"],
)
def test_what_pymoo_hangs_on_an_algorithm_works(setup):
    alike(get_problem("tnk"), setup=setup, pop_size=24)


def test_histories_and_archives_hold_what_pymoo_s_hold():
    problem = get_problem("tnk")
    results = [
        minimize(problem, kind(pop_size=20), ("n_gen", 8), seed=3, save_history=True, archive=MultiObjectiveArchive())
        for kind in (NSGA2, ArrayNSGA2)
    ]
    for expected, found in zip(*(result.history for result in results), strict=True):
        same(expected.pop, found.pop)
        same(expected.off, found.off)
        same(expected.opt, found.opt)
    np.testing.assert_array_equal(*(np.sort(result.archive.get("F"), axis=0) for result in results))


def test_ask_and_tell_give_what_next_gives():
    problem = small_problem()
    asked, run = (copy.deepcopy(ArrayNSGA2(pop_size=16)) for _ in range(2))
    for algorithm in (asked, run):
        algorithm.setup(problem, termination=("n_gen", 10), seed=4)
    while run.has_next():
        infills = asked.ask()
        assert set(infills.get("n_gen")) == {run.n_iter or 1}
        asked.evaluator.eval(problem, infills)
        asked.tell(infills=infills)
        run.next()
        same(asked.pop, run.pop)
    assert not asked.has_next()


def test_no_individual_is_made_where_nobody_asks(monkeypatch):
    monkeypatch.setattr(Individuals, "population", lambda self: pytest.fail("individuals were made"))
    monkeypatch.setattr(Individuals, "of_population", lambda *args: pytest.fail("individuals were read"))
    problem = small_problem()
    for sampling in (None, np.random.default_rng(0).uniform(problem.xl, problem.xu, (12, problem.n_var))):
        algorithm = ArrayNSGA2(pop_size=16, sampling=sampling)
        algorithm.setup(problem, termination=("n_gen", 10), seed=4)
        while algorithm.has_next():
            algorithm.next()
        assert algorithm.evaluator.n_eval == 16 * 9 + (16 if sampling is None else 12)


def test_copies_in_a_first_population_are_left_out_as_by_pymoo():
    problem = small_problem()
    X = np.random.default_rng(0).uniform(problem.xl, problem.xu, (12, problem.n_var))[[*range(12), 3, 5, 3]]
    first = [kind(pop_size=12, sampling=X) for kind in (NSGA2, ArrayNSGA2)]
    for algorithm in first:
        algorithm.setup(problem, termination=("n_gen", 1), seed=4)
        algorithm.next()
    expected, found = (algorithm.pop.get("X") for algorithm in first)
    np.testing.assert_array_equal(found, expected)
    assert len(found) == 12
    asked = ArrayNSGA2(pop_size=12, sampling=Population.new(X=X))
    asked.setup(problem, termination=("n_gen", 1), seed=4)
    np.testing.assert_array_equal(asked.ask().get("X"), X[:12])


def test_other_operators_are_refused():
    refused(lambda: ArrayNSGA2(crossover=DEX()), "crossover: expected two parents and two children, got 3 and 1")


@pytest.mark.parametrize("name", ["selection", "survival", "repair", "eliminate_duplicates", "mating"])
def test_parts_that_are_written_anew_are_refused(name):
    refused(lambda: ArrayNSGA2(**{name: False}), f"{name}: expected none, ArrayNSGA2 has its own; pass it to pymoo's")
