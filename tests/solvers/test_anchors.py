"""Anchors that the lockstep leaves early end where SLSQP ends from other starts."""

import numpy as np

from tests.formulation.test_free_points import problem
from trajevo import minimise_weighted, optimise, polish
from trajevo.formulation.problem import Weights
from trajevo.solvers.gradient import anchors
from trajevo.solvers.gradient.scaling import Columns, Scaled

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
    start = front.X[front.F[:, 0].argmin()]
    end, count = anchors.ended(made.in_terms(), np.array([1.0, 0.0]), start, lambda number: number >= 5)
    assert count == 5
    assert end is not None
    assert made.evaluate(end[None], return_values_of=["F"]).ravel()[0] <= front.F[:, 0].min()
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
