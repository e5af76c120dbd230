"""The least of an objective that is a maximum, against SciPy on plain values of its terms."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from tests.helpers import small_problem
from trajevo import ViaPointProblem, optimise
from trajevo.errors import InvalidInputError
from trajevo.formulation.objectives import OBJECTIVES, Objective
from trajevo.solvers.gradient.minimax import in_terms_alone, least_of_terms
from trajevo.study.bench.suite import benchmark

POINTS = np.deg2rad([[0.0, 0.0, 0.0], [40.0, 60.0, -20.0], [10.0, 90.0, 35.0], [70.0, -10.0, 20.0]])
UNLIMITED = dict.fromkeys(("velocity", "acceleration", "jerk"), [np.inf] * 3)
PEAKS = [
    ("cubic", "peak_jerk", 3),
    ("cubic", "peak_acceleration", 2),
    ("quintic_spline", "peak_jerk", 3),
    ("quintic_spline", "peak_acceleration", 2),
]


def three_joints(interpolant, *objectives):
    return ViaPointProblem(
        robot={"name": "three", "joints": ["a", "b", "c"], "kind": "revolute", "limits": UNLIMITED},
        points=POINTS,
        interpolant=interpolant,
        objectives=list(objectives),
        duration_bounds=(0.2, 4.0),
        constraints=[],
        longest_time=6.0,
    )


def by_scipy(made, x, order):
    """The least peak by SLSQP: the least t that no sample of the derivative exceeds; differences of plain motions."""

    def room(z):
        found = made.decode(z[:-1]).at_shares(np.linspace(0.0, 1.0, 161), order)[0].ravel()
        return np.concatenate([z[-1] - found, z[-1] + found, [6.0 - made.decode(z[:-1]).duration[0]]])

    start = np.append(x, made.decode(x).peak(order).max())
    bounds = [*zip(made.xl, made.xu, strict=True), (0.0, None)]
    limits = {"type": "ineq", "fun": room}
    found = minimize(
        lambda z: z[-1], start, method="SLSQP", bounds=bounds, constraints=[limits], options={"ftol": 1e-10}
    )
    return found.x[-1]


def descent(made, x, stop=lambda gradients, evaluations: False):
    """Whether it converged, the least peak that was told within all limits, and the number of gradients."""
    told = []
    top = float(made.evaluate(x[None], return_values_of=["F"])[0, 0])
    end = least_of_terms(made, x, top, 1e-7, tell=told.append, stop=stop)
    F, G = made.evaluate(np.concatenate(told), return_values_of=["F", "G"])
    return end.converged, F[G.max(axis=1) <= 0.0].min(), end.gradients


@pytest.mark.parametrize(("interpolant", "objective", "order"), PEAKS)
def test_the_least_peak_is_that_of_scipy(interpolant, objective, order):
    made = three_joints(interpolant, objective)
    x = np.full(made.n_var, 5.0 / made.n_var)
    converged, least, gradients = descent(made, x)
    assert converged
    assert least == pytest.approx(by_scipy(made, x, order), rel=1e-4)
    assert gradients <= 25


def test_starts_all_over_the_bounds_come_to_the_least_known():
    named = benchmark("piazzi2000")
    made = named.problem()
    shares = np.random.default_rng(1).dirichlet(np.ones(made.n_var), 3)
    for x in 9.0 * (0.5 * shares + 0.5 / made.n_var):
        converged, least, _ = descent(made, x)
        assert converged
        assert least == pytest.approx(named.told.values[0][0], rel=1e-5)


def test_it_ends_when_it_is_told_to():
    made = three_joints("cubic", "peak_jerk")
    x = np.full(made.n_var, 5.0 / made.n_var)
    converged, least, gradients = descent(made, x, stop=lambda gradients, _: gradients >= 3)
    assert (converged, gradients) == (False, 3)
    assert least <= made.evaluate(x[None], return_values_of=["F"])[0, 0]


@pytest.mark.parametrize(("interpolant", "objective", "order"), PEAKS)
def test_the_greatest_of_the_terms_is_the_objective_and_their_slopes_are_differences(interpolant, objective, order):
    made = three_joints(interpolant, objective, "time")
    terms, X = made.in_terms(objectives=True), np.random.default_rng(2).uniform(0.3, 1.5, (7, made.n_var))
    F, dF = terms.evaluate_with_gradients(X)[:2]
    plain = made.evaluate(X, return_values_of=["F"])
    assert terms.n_obj == F.shape[1] > 2
    np.testing.assert_allclose(F[:, :-1].max(axis=1), plain[:, 0], rtol=1e-9)
    np.testing.assert_array_equal(F[:, -1], plain[:, 1])
    step = 1e-6 * np.eye(made.n_var)
    ahead, behind = (
        terms.evaluate((X[:, None] + side).reshape(-1, made.n_var), return_values_of=["F"]) for side in (step, -step)
    )
    rough = (ahead - behind).reshape(len(X), made.n_var, -1).swapaxes(1, 2) / 2e-6
    np.testing.assert_allclose(dF, rough, rtol=1e-4, atol=1e-4 * np.abs(dF).max())


def test_only_a_single_maximum_is_sought_by_its_terms():
    assert in_terms_alone(three_joints("cubic", "peak_jerk"))
    assert not in_terms_alone(three_joints("cubic", "peak_jerk", "time"))
    assert not in_terms_alone(three_joints("cubic", "time"))
    alone = small_problem(objectives=(replace(OBJECTIVES["peak_jerk"], unit="rad/s^3"),))
    assert in_terms_alone(alone)


def test_a_run_with_a_limit_of_cpu_time_holds_the_least_peak_after_its_first_generations():
    made = three_joints("cubic", "peak_jerk")
    given = {"seed": 3, "population": 20, "generations": 3, "progress": False}
    front = optimise(made, cpu_time=60.0, **given)
    assert front.run.settings["polished before"][0] == 2
    assert front.F[0, 0] == pytest.approx(by_scipy(made, front.X[0], 3), rel=1e-5)


@pytest.mark.parametrize(
    ("terms", "got"),
    [(lambda rollout: rollout.trajectory.duration, r"\(1,\)"), (lambda _: np.ones((2, 3)), r"\(2, 3\)")],
)
def test_terms_of_a_wrong_shape_are_refused(terms, got):
    made = small_problem(
        objectives=(Objective("worst", "1", "test", lambda rollout: rollout.trajectory.duration, terms=terms),)
    )
    with pytest.raises(InvalidInputError, match=rf"objective 'worst': terms: expected shape \(B, K\).*got {got}"):
        made.in_terms(objectives=True)
