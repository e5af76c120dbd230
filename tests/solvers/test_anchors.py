"""Anchors that the lockstep leaves early end where SLSQP ends from other starts."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import minimize

from tests.formulation.test_free_points import problem
from tests.helpers import small_problem
from trajevo import ViaPointProblem, certify, load_robot, minimise_weighted, optimise, polish
from trajevo.formulation.problem import Weights
from trajevo.solvers.gradient import anchors
from trajevo.solvers.gradient.anchors import AnchorSearch
from trajevo.solvers.gradient.optimality import residual
from trajevo.solvers.gradient.restoration import restored
from trajevo.solvers.gradient.scaling import Columns, Scaled

DATA = Path(__file__).parents[1] / "data"
SOLVED = {"seed": 1, "population": 60, "generations": 30, "polish": False, "progress": False}


def test_the_least_time_is_that_of_other_starts():
    made = problem(duration_bounds=(0.02, 3.0))
    front = optimise(made, **SOLVED)
    drawn = np.random.default_rng(0).uniform(0.4, 0.6, (2, made.n_var)) * (made.xu - made.xl) + made.xl
    drawn[:, :4] = [0.1, 0.6, 0.6, 0.1]
    other = minimise_weighted(made, Weights((1.0, 0.0)), seed=1, initial=drawn)
    assert polish(front).front.F[:, 0].min() <= 1.001 * other.cost


def test_a_budget_ends_it_with_the_best_so_far():
    made = problem(interpolant="quintic_spline", extra_points=1)
    front = optimise(made, **SOLVED)
    order = front.F[:, 0].argsort()
    search = AnchorSearch(made, np.array([1.0, 0.0]), 1, lambda gradients, _: gradients >= 5)
    found = search.run(front.X[order[0]], front.X[order], explore=False)
    assert found.gradients == 5
    assert found.x is not None
    assert made.evaluate(found.x[None], return_values_of=["F"]).ravel()[0] <= front.F[:, 0].min()
    budget = front.run.evaluations // 2
    assert polish(front, evaluations=budget).front.run.evaluations < front.run.evaluations + 2 * budget


def test_slower_copies_keep_the_path():
    made = problem(interpolant="quintic_spline")
    columns = Columns.of(np.array([[1.0, 2.0], [2.0, 1.0]]), np.eye(2), np.array([3.0, 3.0]))
    scaled, x = Scaled(made, columns, 0.0), 0.5 * (made.xl + made.xu)
    x[:2] = [0.5, 0.7]
    rows = scaled.outside(anchors.slowed(scaled, made, x))
    np.testing.assert_allclose(rows[:, :2], x[:2] * 1.045 ** np.arange(17)[:, None])
    np.testing.assert_allclose(rows[:, 2:], np.tile(x[2:], (17, 1)))
    shares = np.linspace(0.0, 1.0, 5)
    paths = made.decode(rows).at_shares(shares, 0)
    np.testing.assert_allclose(paths, np.broadcast_to(paths[0], paths.shape), atol=1e-9)


def rods(count, limits="sampled", **more):
    """Two rods in a plane across gravity, through points of which the inner ones may move, with 1 N·m at each joint."""
    given = {
        "robot": load_robot(DATA / "rods.urdf", limits={"acceleration": np.inf, "jerk": np.inf}),
        "points": np.column_stack([np.linspace(0.0, 0.522, count), np.full(count, 0.5)]),
        "interpolant": "cubic",
        "duration_bounds": (0.02, 4.0),
        "moving": [{"point": k, "joints": [1.0, 1.5]} for k in range(1, count - 1)],
        "objectives": ["time", "energy"],
        "constraints": ["effort"],
        "limits": limits,
        "payload": 1.0,
        "samples": 8,
    }
    return ViaPointProblem(**given | more)


def least_time_by_scipy(made, starts):
    """The least time of SLSQP from random starts, in SciPy's own words; durations as logarithms."""
    timed = np.array([variable.unit == "s" for variable in made.variables])
    inside = [np.where(timed, np.log(np.where(timed, end, 1.0)), end) for end in (made.xl, made.xu)]

    def outside(y):
        return np.where(timed, np.exp(np.where(timed, y, 0.0)), y)

    terms = made.in_terms()

    @cache
    def evaluated(y):
        return terms.evaluate_with_gradients(outside(np.array(y))[None])[2:]

    def limits(y):
        return evaluated(tuple(y.tolist()))

    def slopes(y):
        return limits(y)[1][0] * np.where(timed, outside(y), 1.0)

    best = np.inf
    for start in np.random.default_rng(0).uniform(*inside, (starts, made.n_var)):
        end = minimize(
            lambda y: np.log(np.exp(y[timed]).sum()),
            start,
            jac=lambda y: np.where(timed, outside(y), 0.0) / np.exp(y[timed]).sum(),
            method="SLSQP",
            bounds=np.stack(inside, axis=1),
            constraints=[{"type": "ineq", "fun": lambda y: -limits(y)[0][0], "jac": lambda y: -slopes(y)}],
            options={"maxiter": 300, "ftol": 1e-8},
        ).x
        x = np.clip(outside(end), made.xl, made.xu)
        F, G = made.evaluate(x[None], return_values_of=["F", "G"])
        best = min(best, F[0, 0]) if G.max() <= 1e-6 else best
    return best


FEW = {"population": 40, "generations": 15, "progress": False}


@pytest.mark.parametrize(
    ("seeds", "starts"), [((1,), 3), pytest.param(range(1, 11), 20, marks=pytest.mark.long)], ids=["one", "ten"]
)
def test_where_points_move_under_effort_limits_the_least_time_is_the_same_from_every_seed(seeds, starts):
    made = rods(5)
    least = min(least_time_by_scipy(rods(5, objectives=["time"]), starts), 3.17587)
    for seed in seeds:
        front = optimise(made, seed=seed, **FEW)
        told, found = front.run.settings["polish"]["anchors"][0], front.F[:, 0].min()
        assert found <= 1.001 * least
        assert told["objective"] == "time"
        # A later round may find the same optimum with other roundings.
        assert found <= told["value"] <= (1.0 + 1e-9) * found
        assert told["residual"] < 1e-3
        assert 1 <= told["agreeing"] <= told["starts"] > 20


@pytest.mark.long
def test_of_eight_points_most_seeds_end_in_the_best_valleys_and_the_others_say_so():
    """The second best valley lies 0.47 % above the best, the third 0.53 %; one seed of ten ends in none of them."""
    least = min(least_time_by_scipy(rods(8, objectives=["time"]), 20), 3.08193)
    near, settled = [], []
    for seed in range(1, 11):
        front = optimise(rods(8), seed=seed, **FEW)
        near.append(front.F[:, 0].min() <= 1.006 * least)
        settled.append(front.run.settings["polish"]["anchors"][0]["residual"] < 1e-2)
    assert sum(near) >= 8
    assert all(here or not there for here, there in zip(near, settled, strict=True))


@pytest.mark.parametrize("seed", [1, *(pytest.param(k, marks=pytest.mark.long) for k in range(2, 11))])
def test_under_proven_limits_it_is_as_near_and_certified(seed):
    front = optimise(rods(5, limits="certified"), seed=seed, **FEW)
    assert 3.1758 < front.F[:, 0].min() <= 1.001 * 3.1770
    assert certify(front.pick("0")).proven


def test_gradients_find_what_is_feasible_where_the_evolution_does_not():
    made = rods(5, duration_bounds=(0.02, 1.0))
    settings = {"seed": 3, "generations": 2, "population": 6, "starts": "random", "progress": False}
    plain = optimise(made, polish=False, **settings)
    assert len(plain) == 0
    found = restored(plain)
    assert found.blocking is None
    assert (made.evaluate(found.X, return_values_of=["G"]) <= 0.0).all()
    again = optimise(made, **settings)
    assert again.run.settings["restored"]["members"] == len(found) > 0
    assert again.run.evaluations == again.history.evaluations[-1] > found.run.evaluations > plain.run.evaluations
    full = optimise(made, polish=False, **settings | {"generations": 30, "population": 40, "starts": "spread"})
    assert restored(full) is full  # nothing is sought where something is there


def test_the_residual_is_that_of_the_first_order_conditions():
    made = small_problem()
    best = minimise_weighted(made, Weights((1.0, 0.0)), seed=1, starts=3)
    columns = Columns.of(np.array([[1.0, 2.0], [2.0, 1.0]]), np.eye(2), np.array([3.0, 3.0]))
    scaled = Scaled(made.in_terms(), columns, 0.0)
    assert residual(scaled, scaled.inside(best.x[None])[0], 0) < 1e-4
    inner = scaled.inside((0.5 * (made.xl + made.xu))[None])
    slope = scaled.slopes(inner)[1][0, 0]
    assert residual(scaled, inner[0], 0) == pytest.approx(np.linalg.norm(slope), rel=1e-9)
