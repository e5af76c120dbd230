"""The gradient solver: the reference's optima from random starts, least times, and what it refuses."""

from pathlib import Path

import numpy as np
import pytest

from tests.guo2016 import GUO2016, TABLE_7
from tests.helpers import impossible, small_problem
from trajevo import load_robot, optimise
from trajevo.errors import InvalidInputError
from trajevo.formulation.problem import Weights
from trajevo.problems import HybridManipulator, ViaPointProblem
from trajevo.solvers.gradient.normal_constraint import solve_nnc
from trajevo.solvers.gradient.weighted_sum import minimise_weighted

DATA = Path(__file__).parents[1] / "data"
OPTIMA = GUO2016["optimum_cost"]
every_convention = pytest.mark.parametrize("convention", OPTIMA)
LEAST_TIME = Weights((1.0, 0.0, 0.0, 0.0))


def assert_every_start_reaches_the_optimum(convention, starts, seed):
    problem = HybridManipulator(convention=convention)
    best = minimise_weighted(problem, problem.paper_weights, seed=seed, starts=starts)
    assert best.costs.shape == (starts,)
    np.testing.assert_allclose(best.costs, OPTIMA[convention], rtol=0.0, atol=2e-6)
    assert best.cost == best.costs.min()


@pytest.mark.thinned(2)
@every_convention
def test_optimum_from_three_random_starts(convention):
    assert_every_start_reaches_the_optimum(convention, starts=3, seed=1)


@pytest.mark.long
@every_convention
def test_optimum_from_each_of_twenty_random_starts(convention):
    assert_every_start_reaches_the_optimum(convention, starts=20, seed=0)


def test_least_time_from_two_starts():
    best = minimise_weighted(HybridManipulator(samples=3), LEAST_TIME, seed=1, starts=2)
    assert best.cost == pytest.approx(GUO2016["least_time"]["rigid"], rel=5e-3)


@pytest.mark.long
@pytest.mark.parametrize("model", ["rigid", "weight_only"])
def test_least_time_within_a_thousandth(model):
    best = minimise_weighted(HybridManipulator(payload_model=model, samples=12), LEAST_TIME, seed=1, starts=8)
    assert best.cost == pytest.approx(GUO2016["least_time"][model], rel=1e-3)


def test_result_is_consistent():
    problem = HybridManipulator(convention="printed")
    best = minimise_weighted(problem, problem.paper_weights, seed=3, starts=1)
    F, G = problem.evaluate(best.x[None])[:2]
    assert list(best.F) == list(problem.objective_names)
    assert list(best.G) == list(problem.constraint_names)
    np.testing.assert_array_equal(list(best.F.values()), F[0])
    np.testing.assert_array_equal(list(best.G.values()), G[0])
    assert max(best.G.values()) <= 0.0
    assert best.cost == pytest.approx(
        F[0] @ (np.array(problem.paper_weights.weights) / problem.paper_weights.scales), rel=1e-12
    )
    assert (best.x >= problem.xl).all()
    assert (best.x <= problem.xu).all()
    assert best.trajectory.duration[0] == pytest.approx(best.F["time"])
    assert best.rollout.robot is problem.robot
    assert best.seconds > 0.0
    assert not best.x.flags.writeable


def test_the_same_seed_gives_the_same_result():
    problem = HybridManipulator(convention="printed", samples=2)
    one, two = (minimise_weighted(problem, problem.paper_weights, seed=5, starts=2) for _ in range(2))
    np.testing.assert_array_equal(one.x, two.x)
    np.testing.assert_array_equal(one.costs, two.costs)


def test_starts_of_the_callers_own():
    problem = HybridManipulator(convention="printed")
    best = minimise_weighted(problem, problem.paper_weights, seed=0, initial=TABLE_7[None])
    assert best.costs.shape == (1,)
    assert best.cost == pytest.approx(OPTIMA["printed"], abs=2e-6)


def test_the_cost_alone_has_the_same_optimum():
    best = minimise_weighted(
        HybridManipulator(convention="printed", objectives="cost"), Weights((1.0,)), seed=2, starts=1
    )
    assert best.cost == pytest.approx(OPTIMA["printed"], abs=2e-6)


def test_without_constraints():
    problem = small_problem(constraints=())
    best = minimise_weighted(problem, Weights((1.0, 0.0)), seed=1, starts=2)
    assert best.cost == pytest.approx(2.0, abs=1e-6)  # both segments at their lower bound
    assert best.G == {}


def test_least_time_of_the_small_problem_is_on_a_limit():
    problem = small_problem()
    best = minimise_weighted(problem, Weights((1.0, 0.0)), seed=1, starts=3)
    at_bound = np.isclose(best.x, problem.xl, rtol=1e-6).all()
    assert at_bound or max(best.G.values()) == pytest.approx(0.0, abs=1e-5)


@pytest.mark.parametrize("weights", [(1.0, 0.0), (0.0, 1.0), pytest.param((1.0, 1.0), marks=pytest.mark.long)])
def test_where_nothing_is_feasible_the_cost_is_infinite(weights):
    problem = small_problem(constraints=(impossible(load_robot("pointing_mechanism"), 0.5),))
    best = minimise_weighted(problem, Weights(weights), seed=1, starts=1)
    assert best.cost == np.inf
    assert np.isinf(best.costs).all()
    assert best.x.shape == (2,)
    assert best.G == {"patience": 0.5}


def rods() -> ViaPointProblem:
    """Two rods of 1 m and 1 kg in a plane without gravity, with 1 N·m per joint and a payload of 1 kg."""
    robot = load_robot(DATA / "rods.urdf", limits={"acceleration": np.inf, "jerk": np.inf})
    return ViaPointProblem(
        robot=robot,
        points=np.column_stack([np.linspace(0.0, 0.522, 5), np.full(5, 0.5)]),
        interpolant="cubic",
        duration_bounds=(0.02, 4.0),
        moving=[{"point": k, "joints": [1.0, 1.5]} for k in (1, 2, 3)],
        objectives=["time", "energy"],
        constraints=["effort"],
        limits="sampled",
        payload=1.0,
        samples=8,
    )


@pytest.mark.parametrize(("seed", "starts"), [(5, 2), pytest.param(1, 5, marks=pytest.mark.long)])
def test_an_optimum_on_a_limit_is_feasible_and_kept_by_a_search_that_begins_with_it(seed, starts):
    problem = rods()
    best = minimise_weighted(problem, Weights((1.0, 0.0)), seed=seed, starts=starts)
    assert best.cost == pytest.approx(3.17587, rel=1e-5)
    assert best.cost == best.F["time"]
    assert problem.evaluate(best.x[None])[1].max() <= 0.0
    front = optimise(problem, seed=1, initial=best.x[None], generations=5, population=20, progress=False, polish=False)
    assert front.F[:, 0].min() <= best.cost
    assert front.G.max() <= 0.0


def test_points_of_normal_constraints_are_feasible_by_the_problems_own_test():
    front = solve_nnc(small_problem(), points=9)
    assert front.run.settings["failed"] == 0
    assert len(front) == 9
    assert front.problem.evaluate(front.X)[1].max() <= 0.0


@pytest.mark.parametrize(
    ("weights", "arguments", "message"),
    [
        (Weights((1.0, 1.0)), {}, "weights"),
        (Weights((1.0, 1.0, 1.0, float("nan"))), {}, "weights"),
        (LEAST_TIME, {"starts": 0}, "starts"),
        (LEAST_TIME, {"initial": np.empty((0, 12))}, "starts"),
        (LEAST_TIME, {"initial": np.ones((1, 11))}, "initial"),
        (LEAST_TIME, {"initial": np.full((1, 12), 2.0)}, "initial.*bounds"),
        (LEAST_TIME, {"initial": np.full((1, 12), np.nan)}, "initial"),
        (Weights((1.0, 1.0, 1.0, 1.0), scales=(1.0, 1.0)), {}, "scales"),
        (Weights((1.0, 1.0, 1.0, 1.0), scales=(1.0, 0.0, 1.0, 1.0)), {}, "scales"),
        (Weights((1.0, -1.0, 1.0, 1.0)), {}, "weights"),
        (Weights((0.0, 0.0, 0.0, 0.0)), {}, "weights"),
    ],
)
def test_bad_arguments_are_refused(weights, arguments, message):
    with pytest.raises(InvalidInputError, match=message):
        minimise_weighted(HybridManipulator(samples=2), weights, seed=1, **({"starts": 1} | arguments))
