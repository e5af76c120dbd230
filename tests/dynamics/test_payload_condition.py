"""The objective payload_condition: batches, derivatives, what it means for errors, and a search that uses it."""

import numpy as np
import pytest
from scipy.stats import spearmanr

from trajevo import Payload, ViaPointProblem, load_robot, optimise
from trajevo.dynamics.payload_regressor.excitation import COMMON, NOT_SHOWN, gram, payload_condition, row_scales
from trajevo.dynamics.payload_regressor.regressor import payload_regressor

ROBOT = load_robot("ur5", limits={"acceleration": 20.0, "jerk": 1e3}, tool="tool0")


def problem(objectives=("time", "payload_condition"), seed=0, robot=ROBOT):
    points = np.random.default_rng(seed).uniform(-1.5, 1.5, (5, robot.dof))
    return ViaPointProblem(
        robot=robot,
        points=points,
        objectives=list(objectives),
        constraints=["velocity", "acceleration"],
        payload=Payload(2.0),
    )


def drawn(given, count, seed=1):
    return np.random.default_rng(seed).uniform(given.xl, given.xu, (count, len(given.xl)))


def worst_errors(rollout):
    """Greatest standard deviation of a parameter of a common payload, for noise that is a share of the limits, (B,)."""
    regressor = payload_regressor(rollout.robot, rollout.q, rollout.v, rollout.a) / row_scales(rollout.robot)[:, None]
    products = gram(regressor * COMMON, rollout.quadrature)
    return np.sqrt(np.diagonal(np.linalg.inv(products), axis1=1, axis2=2)).max(axis=1)


def test_rows_do_not_depend_on_others():
    given = problem()
    X = drawn(given, 9)
    whole = payload_condition(given.rollout(X))
    assert (whole > 1.0).all()
    assert (whole < NOT_SHOWN).all()
    for k in (0, 4, 8):
        assert payload_condition(given.rollout(X[k : k + 1]))[0] == whole[k]
    np.testing.assert_array_equal(payload_condition(given.rollout(X[::-1])), whole[::-1])


def test_it_is_the_condition_number_of_the_stacked_regressor():
    rollout = problem().rollout(drawn(problem(), 3))
    rows = payload_regressor(ROBOT, rollout.q, rollout.v, rollout.a) * (COMMON / ROBOT.limits.effort[:, None])
    rows = rows * np.sqrt(rollout.quadrature)[:, :, None, None]
    expected = [np.linalg.cond(one.reshape(-1, 10)) for one in rows]
    np.testing.assert_allclose(payload_condition(rollout), expected, rtol=1e-9)


def test_derivatives_by_complex_step_are_those_of_differences():
    given = problem()
    x = drawn(given, 1)
    way = np.random.default_rng(2).normal(size=x.shape) * (given.xu - given.xl)
    h, step = 1e-6, 1e-30
    high, low = (payload_condition(given.rollout(x + sign * h * way))[0] for sign in (1.0, -1.0))
    slope = payload_condition(given.rollout(x + 1j * step * way))[0].imag / step
    assert slope == pytest.approx((high - low) / (2.0 * h), rel=1e-4)


def test_a_lower_number_means_smaller_errors():
    given = problem()
    rollout = given.rollout(drawn(given, 150))
    assert spearmanr(payload_condition(rollout), worst_errors(rollout))[0] > 0.9


def test_a_motion_that_is_found_identifies_better_than_those_drawn_that_keep_the_limits():
    given = problem()
    front = optimise(given, population=40, generations=25, polish=False, seed=1)
    drawn_too = drawn(given, 400)
    kept = drawn_too[(given.evaluate(drawn_too, return_values_of=["G"]) <= 0.0).all(axis=1)]
    before, after = given.rollout(kept), front.least("payload_condition").rollout
    assert len(kept) > 100
    assert worst_errors(after)[0] < 0.5 * np.median(worst_errors(before))
    assert worst_errors(after)[0] < np.quantile(worst_errors(before), 0.02)
    assert payload_condition(after)[0] < payload_condition(before).min()


def test_an_arm_that_cannot_show_all_says_so():
    locked = dict.fromkeys(ROBOT.joint_names[2:], 0.3)
    two = load_robot("ur5", limits={"acceleration": 20.0, "jerk": 1e3}, tool="tool0", lock=locked)
    given = problem(robot=two)
    np.testing.assert_array_equal(payload_condition(given.rollout(drawn(given, 3))), NOT_SHOWN)
