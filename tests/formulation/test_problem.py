import dataclasses

import numpy as np
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.optimize import minimize

from tests.helpers import POINTS, failing_when_slow, nan_when_slow, small_problem
from tests.reference import TABLE_4_DURATIONS
from trajevo import TrajevoError, ViaPointProblem, load_problem
from trajevo.base import plugins
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.formulation import registry
from trajevo.formulation.constraints.joint_limits import kinematic_limits, position_limits
from trajevo.formulation.objectives import Objective, summed_rms_jerk, total_time
from trajevo.problems import PointingMechanism
from trajevo.robot.robot import load_robot
from trajevo.trajectory.interpolants import stop_and_go

X = np.array([[3.0, 4.0], [9.0, 9.0], [5.0, 5.0]])


def test_stock_pymoo_solves_it():
    result = minimize(PointingMechanism(), NSGA2(pop_size=40), ("n_gen", 30), seed=1)
    assert result.F.shape[1] == 3
    assert (result.G <= 0.0).all()
    assert result.F[:, 0].min() < 16.0


def test_constraints_are_shares_of_the_limits():
    solved = small_problem()
    batch, limits = solved.decode(X), solved.robot.limits
    G = solved.evaluate(X)[1]
    assert solved.constraint_names[2:4] == ("velocity of joint_1", "velocity of joint_2")
    np.testing.assert_allclose(G[:, 2:4], batch.peak(1) / limits.velocity - 1.0)
    np.testing.assert_allclose(G[:, 4:6], batch.peak(2) / limits.acceleration - 1.0)
    np.testing.assert_allclose(G[:, 6:8], batch.peak(3) / limits.jerk - 1.0)
    np.testing.assert_allclose(G[:, :2], batch.peak(0) / limits.upper - 1.0)


def test_position_excess_counts_from_the_nearer_end_of_a_lopsided_range():
    robot = load_robot("pointing_mechanism")
    lopsided = dataclasses.replace(robot.limits, lower=np.array([-0.1, -1.0]), upper=np.array([0.5, 1.0]))
    tight = dataclasses.replace(robot, limits=lopsided)
    excess = position_limits(tight).function(Rollout(Dynamics(tight), small_problem().decode(X)))
    np.testing.assert_allclose(excess[:, 0], (-0.1 + 0.2) / 0.3, rtol=1e-9)


def test_infinite_limits_have_no_column():
    robot = load_robot("pointing_mechanism")
    free = dataclasses.replace(
        robot.limits,
        jerk=np.array([np.inf, 1.0]),
        lower=np.array([-np.inf, -1.0]),
        upper=np.array([np.inf, 1.0]),
    )
    columns = [c.names for c in kinematic_limits(dataclasses.replace(robot, limits=free))]
    assert columns[0] == ("position of joint_2",)
    assert columns[3] == ("jerk of joint_2",)


def test_a_range_with_one_end_is_still_a_limit():
    robot = load_robot("pointing_mechanism")
    one_end = {1.0: ([-np.inf, -1.0], [0.15, 1.0]), -1.0: ([-0.15, -1.0], [np.inf, 1.0])}
    for sign, (lower, upper) in one_end.items():
        limits = dataclasses.replace(robot.limits, lower=np.array(lower), upper=np.array(upper))
        tight = dataclasses.replace(robot, limits=limits)
        constraint = position_limits(tight)
        assert constraint.names == ("position of joint_1", "position of joint_2")
        excess = constraint.function(Rollout(Dynamics(tight), small_problem().decode(X)))
        least, greatest = small_problem().decode(X).extremes(0)
        reached = greatest[:, 0] if sign > 0 else -least[:, 0]
        np.testing.assert_allclose(excess[:, 0], (reached - 0.15) / 0.15, rtol=1e-9)


@pytest.mark.parametrize("bad", [failing_when_slow, nan_when_slow])
def test_a_failing_individual_does_not_touch_the_others(bad):
    sound = small_problem(objectives=(Objective("time", "s", "test", total_time),))
    broken = small_problem(objectives=(Objective("time", "s", "test", bad),))
    F, G = broken.evaluate(X)
    assert np.isinf(F[1]).all()
    assert np.isinf(G[1]).all()
    np.testing.assert_array_equal(F[[0, 2]], sound.evaluate(X)[0][[0, 2]])
    np.testing.assert_array_equal(G[[0, 2]], sound.evaluate(X)[1][[0, 2]])
    said = broken.evaluate(X, return_as_dictionary=True)["failure"]
    assert said[0] == said[2] == ""
    assert said[1] in ("KeyError: 'too slow for this table'", "an objective or a constraint is not a finite number")


def test_registered_problems_are_made_by_name():
    assert isinstance(load_problem("pointing", interpolant="quintic"), PointingMechanism)
    with pytest.raises(TrajevoError, match="unknown problem 'nope'; known: .*pointing"):
        load_problem("nope")
    with pytest.raises(TrajevoError, match="takes no 'payload'; it takes: interpolant, points, duration_bounds"):
        load_problem("pointing", payload=3.0)


def test_something_registered_that_is_no_problem_is_refused(monkeypatch):
    from importlib.metadata import EntryPoint

    point = EntryPoint("wrong", "math:sqrt", registry.ENTRY_POINT_GROUP)
    monkeypatch.setattr(plugins, "entry_points", lambda group: [point])
    with pytest.raises(TrajevoError, match="'wrong': math:sqrt is not a TrajectoryProblem"):
        load_problem("wrong")


def test_bad_definitions_are_refused():
    twice = (Objective("time", "s", "a", total_time), Objective("time", "s", "b", total_time))
    with pytest.raises(TrajevoError, match=r"objectives: names must differ, got \['time', 'time'\]"):
        small_problem(objectives=twice)
    with pytest.raises(TrajevoError, match=r"reference_point: expected shape \(2\)"):
        small_problem(reference_point=(1.0, 2.0, 3.0))
    robot = load_robot("pointing_mechanism")
    with pytest.raises(TrajevoError, match="names must differ"):
        small_problem(constraints=(*kinematic_limits(robot), *kinematic_limits(robot)))
    with pytest.raises(TypeError):
        PointingMechanism(interpolent="smooth")


def test_a_rollout_needs_as_many_joints_as_the_robot():
    robot = load_robot("pointing_mechanism")
    three = stop_and_go(POINTS, robot.limits, profile="septic")
    assert Rollout(Dynamics(robot), three).trajectory is three
    wrong = type(three)(three.breaks, np.concatenate([three.coefficients] * 2, axis=2))
    with pytest.raises(TrajevoError, match="has 2 joints, got a trajectory of 4"):
        Rollout(Dynamics(robot), wrong)


def test_objectives_are_equation_25():
    rollout = PointingMechanism().rollout(TABLE_4_DURATIONS)
    motion = rollout.trajectory.sample(200001)
    mean_square = np.trapezoid(motion.j**2, motion.t[0], axis=1) / motion.t[0, -1]
    assert summed_rms_jerk(rollout)[0] == pytest.approx(np.sqrt(mean_square).sum(), rel=1e-8)


def test_rollouts_of_a_problem_carry_the_limits_that_it_keeps():
    robot = load_robot("ur5", tool="tool0", limits={"acceleration": 10.0, "jerk": 100.0})
    points = [[0.0, -1.5, 1.5, -1.5, -1.5, 0.0], [0.5, -1.2, 1.4, -1.7, -1.5, 0.2], [0.9, -1.4, 1.5, -1.6, -1.5, 0.0]]
    given = {"duration_bounds": (0.3, 4.0), "objectives": ["time"]}
    whole = ViaPointProblem(robot=robot, points=points, constraints=["velocity", "effort"], **given)
    with_margin = ViaPointProblem(
        robot=robot, points=points, constraints=["velocity", "effort"], effort_margin=0.2, **given
    )
    x = 0.5 * (whole.xl + whole.xu)
    assert whole.rollout(x).limits is robot.limits
    kept = with_margin.rollout(x).limits
    np.testing.assert_allclose(kept.effort, 0.8 * robot.limits.effort, rtol=1e-15)
    np.testing.assert_array_equal(kept.velocity, robot.limits.velocity)
