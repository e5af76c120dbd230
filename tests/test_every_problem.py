"""What holds for every registered problem."""

import copy
import json
import pickle

import numpy as np
import pytest

from tests.helpers import any_problem, assert_exact_gradients
from trajevo import TrajectoryProblem, load_problem
from trajevo.formulation.registry import list_problems


@pytest.fixture(params=list_problems())
def problem(request) -> TrajectoryProblem:
    return any_problem(request.param)


@pytest.fixture
def x(problem) -> np.ndarray:
    return np.random.default_rng(0).uniform(problem.xl, problem.xu, (20, problem.n_var))


def test_shapes_and_names_fit(problem, x):
    F, G = problem.evaluate(x)
    assert F.shape == (20, problem.n_obj) == (20, len(problem.objective_names))
    assert G.shape == (20, problem.n_ieq_constr) == (20, len(problem.constraint_names))
    assert np.isfinite(F).all()
    assert np.isfinite(G).all()
    assert problem.reference_point is None or len(problem.reference_point) == problem.n_obj


def test_input_is_not_touched(problem, x):
    before = x.copy()
    problem.evaluate(x)
    np.testing.assert_array_equal(x, before)


def test_settings_are_plain_data_that_make_an_equal_problem(problem, x):
    assert problem.registered_name in list_problems()
    again = load_problem(problem.registered_name, **json.loads(json.dumps(problem.settings)))
    np.testing.assert_array_equal(again.evaluate(x)[0], problem.evaluate(x)[0])
    assert again.settings == problem.settings


def test_limits_in_terms_are_the_same_limits(problem, x):
    """Whatever is feasible in terms is feasible, and the other way round; and gradient solvers can take the terms."""
    terms = problem.in_terms()
    assert terms.n_ieq_constr >= problem.n_ieq_constr
    np.testing.assert_array_equal(terms.evaluate(x)[0], problem.evaluate(x)[0])
    G, in_terms = problem.evaluate(x)[1], terms.evaluate(x)[1]
    if problem.n_ieq_constr:
        np.testing.assert_allclose(in_terms.max(axis=1), G.max(axis=1), rtol=1e-12)
    assert_exact_gradients(terms, x[:3])


def test_via_points_are_passed(problem, x):
    via = problem.interpolant.points.positions
    reached = problem.decode(x).evaluate(problem.interpolant.via_times(x))
    np.testing.assert_allclose(reached, np.broadcast_to(via, reached.shape), atol=1e-10)


def test_copies_evaluate_alike(problem, x):
    np.testing.assert_array_equal(copy.deepcopy(problem).evaluate(x)[0], problem.evaluate(x)[0])


def test_pickles_evaluate_alike(problem, x):
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(problem)).evaluate(x)[0], problem.evaluate(x)[0])
