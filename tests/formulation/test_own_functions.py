"""Objectives and constraints of the user's: right derivatives, and failures that are told at once."""

import pickle
import warnings

import numpy as np
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.optimize import minimize

from tests.helpers import impossible, refused, small_problem
from trajevo import load_robot, optimise
from trajevo.dynamics.integrals.efforts import mechanical_energy
from trajevo.errors import GradientWarning, InvalidInputError
from trajevo.formulation.constraints.constraint import Constraint
from trajevo.formulation.constraints.joint_limits import kinematic_limits
from trajevo.formulation.gradients import own
from trajevo.formulation.objectives import Objective, summed_rms_jerk, times_duration, total_time
from trajevo.formulation.problem import Weights
from trajevo.problems import TimeJerkReparameterisation
from trajevo.solvers.gradient.normal_constraint import solve_nnc
from trajevo.solvers.gradient.weighted_sum import minimise_weighted

X = np.array([[3.0, 4.0], [2.0, 5.0]])
SHARES = np.linspace(0.0, 1.0, 21)
RUN = {"seed": 1, "generations": 2, "population": 8, "progress": False}


def speeds(rollout, derivative=1):
    trajectory = rollout.trajectory
    return trajectory.evaluate(trajectory.duration[:, None] * SHARES, derivative)


def peak_speed(rollout):
    return np.abs(rollout.v).max(axis=(1, 2))


def with_objective(function, **arguments):
    return small_problem(objectives=(Objective("peak", "1", "t", function),), **arguments)


def differences(problem, x, step=1e-6):
    ahead, behind = (
        np.stack([problem.evaluate(x + sign * step * e)[0] for e in np.eye(x.shape[1])], axis=2) for sign in (1, -1)
    )
    return (ahead - behind) / (2.0 * step)


EXACT = {
    "abs": peak_speed,
    "norm": lambda rollout: np.linalg.norm(rollout.v, axis=2).max(axis=1),
    "abs of power": lambda rollout: np.abs(rollout.power).sum(axis=(1, 2)),
    "instants that move": lambda rollout: (speeds(rollout) ** 2).sum(axis=(1, 2)),
    "abs at instants that move": lambda rollout: np.abs(speeds(rollout)).max(axis=(1, 2)),
    "acceleration at instants that move": lambda rollout: (speeds(rollout, 2) ** 2).mean(axis=(1, 2)),
    "samples": lambda rollout: np.abs(rollout.trajectory.sample(9).v).sum(axis=(1, 2)),
    "with trajevo's own": lambda rollout: mechanical_energy(rollout) + np.abs(rollout.trajectory.peak(1)).max(axis=1),
}
ROUGH = {
    "real": lambda rollout: rollout.v.real.max(axis=(1, 2)),
    "float": lambda rollout: np.array([float(row.max()) for row in rollout.v]),
    "astype": lambda rollout: summed_rms_jerk(rollout).astype(np.float64),
    "new array": lambda rollout: _copied(rollout.trajectory.duration),
    "raises on complex numbers": lambda rollout: np.quantile(np.abs(rollout.v), 0.9, axis=(1, 2)),
}


def _copied(values):
    copy = np.empty(len(values))
    copy[:] = values
    return copy


@pytest.mark.parametrize("function", EXACT.values(), ids=EXACT)
def test_derivatives_are_exact_without_a_warning(function):
    problem = with_objective(function)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        F, dF, _, _ = problem.evaluate_with_gradients(X)
        assert problem.gradients_by(X) == "complex step"
    rough = differences(problem, X)
    assert np.abs(rough).max() > 0.001
    np.testing.assert_allclose(dF, rough, rtol=1e-6, atol=1e-6 * np.abs(rough).max())
    np.testing.assert_allclose(F, problem.evaluate(X)[0], rtol=1e-12)


@pytest.mark.parametrize("function", ROUGH.values(), ids=ROUGH)
def test_derivatives_that_cannot_be_exact_are_told_once_and_right(function):
    problem = with_objective(function)
    with pytest.warns(GradientWarning, match="finite differences for objective 'peak'") as told:
        dF = problem.evaluate_with_gradients(X)[1]
    assert len(told) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error", GradientWarning)
        problem.evaluate_with_gradients(X)
        problem.in_terms().evaluate_with_gradients(X)
    assert problem.gradients_by(X) == "finite differences for objective 'peak'"
    rough = differences(problem, X, 1e-5)
    np.testing.assert_allclose(dF, rough, rtol=1e-5, atol=1e-6 * np.abs(rough).max())


def test_a_wrong_constraint_is_found_too_and_the_others_stay_exact():
    robot = load_robot("pointing_mechanism")
    quick = Constraint(("haste",), "t", lambda rollout: rollout.trajectory.duration.real[:, None] / 9.0 - 1.0)
    problem = small_problem(constraints=(*kinematic_limits(robot), quick))
    with pytest.warns(GradientWarning, match="constraint 'haste'"):
        dG = problem.evaluate_with_gradients(X)[3]
    np.testing.assert_allclose(dG[:, -1], 1.0 / 9.0, rtol=1e-8)
    np.testing.assert_array_equal(dG[:, :-1], small_problem().evaluate_with_gradients(X)[3])


def test_the_least_peak_speed_is_found():
    """The slowest motion has the least speeds; with a derivative of 0 the solver would not leave its start."""
    best = minimise_weighted(with_objective(peak_speed), Weights((1.0,)), seed=1, starts=3)
    dense = np.stack(np.meshgrid(*[np.linspace(1.0, 10.0, 91)] * 2), axis=-1).reshape(-1, 2)
    F, G = with_objective(peak_speed).evaluate(dense)[:2]
    assert best.cost <= F[G.max(axis=1) <= 0.0].min() * (1.0 + 1e-6)


def test_functions_inside_of_own_ones_are_looked_at():
    assert own(times_duration(total_time, 2))
    assert not own(times_duration(peak_speed, 1))
    assert not own(peak_speed)


def boom(rollout):
    raise ValueError("the table is empty")


WRONG = {
    "scalar": (lambda rollout: 3.0, r"objective 'peak': expected shape \(B,\) .*, got \(\)"),
    "column": (lambda rollout: rollout.trajectory.duration[:, None], r"objective 'peak': .*, got \(\d+, 1\)"),
    "matrix": (lambda rollout: rollout.v.max(axis=1), r"objective 'peak': .*, got \(\d+, 2\)"),
    "nothing": (lambda rollout: None, "objective 'peak': expected numbers .* got NoneType"),
    "complex": (lambda rollout: 1j * rollout.trajectory.duration, "objective 'peak': expected real numbers"),
    "error": (boom, r"objective 'peak': fails for every individual.*ValueError: the table is empty \(line \d+ of .*py"),
}
SOLVERS = {
    "evaluate": lambda problem: problem.evaluate(X),
    "evaluate one": lambda problem: problem.evaluate(X[:1]),
    "gradients": lambda problem: problem.evaluate_with_gradients(X),
    "optimise": lambda problem: optimise(problem, **RUN),
    "minimise_weighted": lambda problem: minimise_weighted(problem, Weights((1.0, 0.0)), seed=1, starts=1),
    "solve_nnc": lambda problem: solve_nnc(problem, points=3),
    "pymoo": lambda problem: minimize(problem, NSGA2(pop_size=8), ("n_gen", 2), seed=1),
}


@pytest.mark.parametrize("solve", SOLVERS.values(), ids=SOLVERS)
@pytest.mark.parametrize(("function", "says"), WRONG.values(), ids=WRONG)
def test_what_is_wrong_for_every_individual_is_refused_at_once(function, says, solve):
    objectives = (Objective("peak", "1", "t", function), Objective("time", "s", "t", total_time))
    refused(lambda: solve(small_problem(objectives=objectives)), says)


@pytest.mark.parametrize(("function", "says"), [WRONG["column"], WRONG["error"]], ids=["column", "error"])
def test_it_is_refused_from_another_process_too(function, says):
    refused(lambda: optimise(with_objective(function), time_limit=30.0, polish=False, **RUN), says)


def test_constraints_have_a_column_for_each_name():
    for function, got in ((total_time, r"\(\d+,\)"), (lambda rollout: rollout.v.max(axis=1), r"\(\d+, 2\)")):
        problem = small_problem(constraints=(Constraint(("haste",), "t", function),))
        refused(lambda: problem.evaluate(X), rf"constraint 'haste': expected shape \(B, 1\) .*, got {got}")  # noqa: B023


def test_single_individuals_may_still_fail():
    def picky(rollout):
        if (rollout.trajectory.duration > 7.0).any():
            raise ValueError("too slow")
        return total_time(rollout)

    problem = with_objective(picky, constraints=())
    F, _ = problem.evaluate(np.array([[3.0, 5.0], [3.0, 3.0]]), return_values_of=["F", "G"])
    np.testing.assert_array_equal(F[:, 0], [np.inf, 6.0])
    lone = with_objective(picky, constraints=())
    assert lone.evaluate(np.array([[1.5, 9.9]]), return_values_of=["F", "G"])[0][0, 0] == np.inf


def test_failures_travel_between_processes():
    with pytest.raises(InvalidInputError) as caught:
        with_objective(boom).evaluate(X)
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


def test_motions_along_a_path_take_complex_instants():
    problem = TimeJerkReparameterisation()
    x = problem.xl + np.random.default_rng(3).uniform(0.3, 0.7, (1, problem.n_var)) * (problem.xu - problem.xl)

    def moving(rows, order):
        trajectory = problem.decode(rows)
        return trajectory.evaluate(trajectory.duration[:, None] * SHARES[1:-1] ** 2, order)

    def fixed(rows, order):
        return problem.decode(rows).evaluate(0.5 * float(problem.decode(x).duration[0]) * SHARES[1:-1], order)

    for function in (moving, fixed):
        for order in (0, 1, 2):
            slope = function(x + 1e-20j, order).imag / 1e-20
            rough = (function(x + 1e-6, order) - function(x - 1e-6, order)) / 2e-6
            np.testing.assert_allclose(slope, rough, atol=1e-5 * np.abs(rough).max())


def test_complex_shares_are_refused():
    trajectory = small_problem().decode(X)
    refused(lambda: trajectory.at_shares(np.array([0.5 + 1e-20j]), 0), "u: expected real shares")


def test_a_limit_that_nothing_keeps_stays_told():
    robot = load_robot("pointing_mechanism")
    best = minimise_weighted(
        with_objective(total_time, constraints=(impossible(robot, 0.1),)), Weights((1.0,)), seed=1, starts=1
    )
    assert best.cost == np.inf
