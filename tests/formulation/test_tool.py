"""What the tool does along a motion, against Pinocchio and against fine sampling."""

import pickle

import numpy as np
import pytest

from tests.helpers import refused
from tests.robot.test_kinematics import ROBOTS
from trajevo import TrajectoryProblem, ViaPoints, load_robot
from trajevo.dynamics.integrals.travel import tool_path_length
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.formulation.constraints.tool import keep_out_height, tool_speed_limit
from trajevo.formulation.objectives import Objective, total_time
from trajevo.trajectory.interpolants import QuinticSpline

DURATIONS = np.random.default_rng(0).uniform(0.8, 2.0, (4, 3))


@pytest.fixture(params=["ur5", "xarm7", "hybrid_manipulator"], scope="module")
def robot(request):
    return load_robot(request.param, **ROBOTS[request.param])


def points_of(robot):
    limits = robot.limits
    shares = np.random.default_rng(5).uniform(0.45, 0.55, (4, robot.dof))
    return ViaPoints(limits.lower + shares * (limits.upper - limits.lower))


def spline(robot):
    return QuinticSpline(points_of(robot), duration_bounds=(0.5, 4.0))


def rollout(robot, durations=DURATIONS, samples=12):
    return Rollout(Dynamics(robot, samples=samples), spline(robot)(durations))


def fine(robot, count):
    """Positions of the tool by Pinocchio on a fine grid, (B, count, 3), and the grid's steps (B,)."""
    trajectory = spline(robot)(DURATIONS)
    q = trajectory.sample(count).q
    positions = np.stack([robot.tool_poses(row)[0] for row in q])
    return positions, trajectory.duration / (count - 1)


@pytest.mark.thinned(2)
def test_path_length_and_speed_are_those_of_a_fine_polyline(robot):
    positions, step = fine(robot, 4001)
    chords = np.linalg.norm(np.diff(positions, axis=1), axis=2)
    coarse, dense = (
        np.abs(tool_path_length(rollout(robot, samples=n)) / chords.sum(axis=1) - 1.0).max() for n in (12, 60)
    )
    assert coarse < 1e-2  # the tool turns sharply, where the speed has kinks
    assert dense < 2e-4
    fastest = (chords / step[:, None]).max(axis=1)
    limit = tool_speed_limit(robot, 0.5)
    assert limit.names == ("tool speed",)
    excess = limit.function(rollout(robot, samples=60))
    np.testing.assert_allclose(excess[:, 0], fastest / 0.5 - 1.0, rtol=0.0, atol=5e-3 * (fastest / 0.5).max())


@pytest.mark.thinned(2)
def test_height_is_the_least_one_of_the_samples(robot):
    motion = rollout(robot)
    lowest = np.array([robot.tool_poses(row)[0][:, 2].min() for row in motion.q])
    limit = keep_out_height(robot, 0.2)
    assert limit.names == ("tool height",)
    np.testing.assert_allclose(limit.function(motion)[:, 0], (0.2 - lowest) / 0.1, rtol=0.0, atol=1e-11)
    dense = keep_out_height(robot, 0.2).function(rollout(robot, samples=60))[:, 0]
    np.testing.assert_allclose(dense, (0.2 - fine(robot, 2001)[0][..., 2].min(axis=1)) / 0.1, rtol=0.0, atol=0.02)


def test_slower_motions_have_the_same_path_and_less_speed(robot):
    once, slow = rollout(robot), rollout(robot, 2.0 * DURATIONS)
    np.testing.assert_allclose(tool_path_length(slow), tool_path_length(once), rtol=1e-12)
    limit = tool_speed_limit(robot, 1.0).function
    np.testing.assert_allclose(limit(slow) + 1.0, 0.5 * (limit(once) + 1.0), rtol=1e-12)


def test_complex_steps_are_the_derivatives(robot):
    functions = [
        tool_path_length,
        lambda motion: tool_speed_limit(robot, 1.0).function(motion)[:, 0],
        lambda motion: keep_out_height(robot, 0.1).function(motion)[:, 0],
    ]
    h = 1e-6
    for column in range(3):
        unit = np.eye(3)[column]
        for function in functions:
            ahead, behind = (function(rollout(robot, DURATIONS + sign * h * unit)) for sign in (1.0, -1.0))
            exact = function(rollout(robot, DURATIONS + 1e-20j * unit)).imag / 1e-20
            np.testing.assert_allclose(exact, (ahead - behind) / (2.0 * h), rtol=1e-5, atol=1e-7)


def test_a_problem_takes_them_and_can_be_pickled():
    robot = load_robot("ur5", **ROBOTS["ur5"])
    problem = TrajectoryProblem(
        dynamics=Dynamics(robot),
        interpolant=spline(robot),
        objectives=(
            Objective("time", "s", "test", total_time),
            Objective("length", "m", "test", tool_path_length),
        ),
        constraints=(tool_speed_limit(robot, 0.5), keep_out_height(robot, 0.1)),
    )
    there = pickle.loads(pickle.dumps(problem)).evaluate(DURATIONS, return_values_of=["F", "G"])
    for ours, theirs in zip(problem.evaluate(DURATIONS, return_values_of=["F", "G"]), there, strict=True):
        np.testing.assert_array_equal(ours, theirs)
        assert ours.shape == (4, 2)


@pytest.mark.parametrize("most", [0.0, -1.0, np.inf, np.nan, "fast", True])
def test_bad_speeds_are_refused(most):
    refused(lambda: tool_speed_limit(load_robot("puma560"), most), r"most: expected a positive number \[m/s\], got")


@pytest.mark.parametrize("least", [np.inf, np.nan, "low", None])
def test_bad_heights_are_refused(least):
    refused(lambda: keep_out_height(load_robot("puma560"), least), r"least: expected a finite number \[m\], got")
