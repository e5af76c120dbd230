"""Objectives and limits by name: each against plain numerical integration, and those of other packages."""

from importlib.metadata import EntryPoint

import numpy as np
import pytest

from tests.helpers import refused
from trajevo import load_robot
from trajevo.base import plugins
from trajevo.formulation.constraints.joint_limits import effort_limits
from trajevo.formulation.objectives import NAMED_OBJECTIVES, OBJECTIVES, Objective, total_time
from trajevo.problems import ViaPointProblem
from trajevo.problems.puma_kinematics import TABLE_1_JOINTS

#: Of a robot without drives and a payload that is given.
NAMES = [
    name
    for name, objective in OBJECTIVES.items()
    if not {"payload variable", "drives"} & set(objective.needs)
    and name not in ("rms_torque_share", "winding_rise", "peak_power")
]


@pytest.fixture(scope="module")
def problem():
    return ViaPointProblem(
        points=TABLE_1_JOINTS,
        robot="puma560",
        objectives=NAMES,
        constraints=("effort",),
        payload=2.0,
        samples=12,
        limits="sampled",
    )


@pytest.fixture(scope="module")
def x(problem):
    return np.random.default_rng(3).uniform(1.0, 3.0, (3, problem.n_var))


@pytest.fixture(scope="module")
def dense(problem, x):
    """Instants (B, T) inside the segments, velocity and effort there, and the step."""
    trajectory = problem.decode(x)
    t = (np.arange(40_000) + 0.5) / 40_000 * trajectory.duration[:, None]
    q, v, a = (trajectory.evaluate(t, order) for order in range(3))
    return t, v, problem.rollout(x).effort_in(q, v, a), trajectory.duration / 40_000


def column(problem, x, name):
    return problem.evaluate(x)[0][:, NAMES.index(name)]


def test_square_effort_is_its_integral(problem, x, dense):
    _, _, effort, step = dense
    expected = (effort**2).sum(axis=(1, 2)) * step
    np.testing.assert_allclose(column(problem, x, "square_effort"), expected, rtol=1e-4)


def test_energy_and_square_power_are_their_integrals(problem, x, dense):
    _, v, effort, step = dense
    np.testing.assert_allclose(column(problem, x, "energy"), np.abs(effort * v).sum(axis=(1, 2)) * step, rtol=1e-4)
    power = ((effort * v) ** 2).sum(axis=(1, 2)) * step
    np.testing.assert_allclose(column(problem, x, "square_power"), power, rtol=1e-4)


def test_joint_travel_is_the_integral_of_speed(problem, x, dense):
    _, v, _, step = dense
    np.testing.assert_allclose(column(problem, x, "joint_travel"), np.abs(v).sum(axis=(1, 2)) * step, rtol=1e-6)


def test_square_effort_rate_is_the_integral_of_the_effort_s_slope_without_friction():
    """On the UR5, whose efforts are smooth: no dry friction."""
    robot = load_robot("ur5", tool="tool0", limits={"acceleration": 10.0, "jerk": 100.0})
    points = np.array(
        [[0.0, -1.5, 1.5, -1.5, -1.5, 0.0], [0.5, -1.0, 1.2, -1.7, -1.2, 0.3], [1.0, -1.4, 1.4, -1.4, -1.5, 0]]
    )
    problem = ViaPointProblem(robot=robot, points=points, objectives=("square_effort_rate",), samples=14)
    x = np.array([[1.2, 1.7]])
    trajectory = problem.decode(x)
    t = np.linspace(0.0, trajectory.duration[0], 40_001)[None]
    effort = problem.dynamics.effort(*(trajectory.evaluate(t, order) for order in range(3)))
    slope = np.gradient(effort[0], t[0], axis=0)
    expected = (slope**2).sum() * (t[0, 1] - t[0, 0])
    assert problem.evaluate(x)[0][0, 0] == pytest.approx(expected, rel=1e-3)


def test_effort_ratio_is_the_greatest_share_of_a_limit(problem, x, dense):
    _, _, effort, _ = dense
    expected = (np.abs(effort) / problem.robot.limits.effort).max(axis=(1, 2))
    np.testing.assert_allclose(column(problem, x, "effort_ratio"), expected, rtol=1e-4)
    rollout = problem.rollout(x)
    sampled = (np.abs(rollout.effort) / problem.robot.limits.effort).max(axis=(1, 2))
    assert (column(problem, x, "effort_ratio") >= sampled * (1.0 - 1e-5)).all()
    np.testing.assert_allclose(problem.evaluate(x)[1].max(axis=1) + 1.0, sampled, rtol=1e-13)


def test_slower_is_longer_and_gentler(problem, x):
    fast, slow = (dict(zip(NAMES, problem.evaluate(x * s)[0].T, strict=True)) for s in (1.0, 2.0))
    np.testing.assert_allclose(slow["time"], 2.0 * fast["time"])
    np.testing.assert_allclose(slow["joint_travel"], fast["joint_travel"], rtol=1e-12)
    np.testing.assert_allclose(slow["tool_path"], fast["tool_path"], rtol=1e-9)
    np.testing.assert_allclose(slow["jerk"], fast["jerk"] / 8.0, rtol=1e-12)


def test_a_margin_tightens_the_effort_limits(problem, x):
    with_margin = ViaPointProblem(
        points=TABLE_1_JOINTS, constraints=("effort",), payload=2.0, samples=12, effort_margin=0.2, limits="sampled"
    )
    np.testing.assert_allclose(with_margin.evaluate(x)[1] + 1.0, (problem.evaluate(x)[1] + 1.0) / 0.8, rtol=1e-12)


@pytest.mark.parametrize("margin", [1.0, -0.1, "much", True, float("nan")])
def test_margins_that_are_no_share_are_refused(margin):
    refused(lambda: effort_limits(load_robot("puma560"), margin=margin), "effort_margin: expected a share from 0")


def test_a_margin_without_effort_limits_is_refused():
    refused(
        lambda: ViaPointProblem(points=TABLE_1_JOINTS, effort_margin=0.1),
        "effort_margin: expected 'effort' among the constraints",
    )


def test_names_that_are_unknown_or_no_list_are_refused():
    refused(
        lambda: ViaPointProblem(points=TABLE_1_JOINTS, objectives=("speed",)),
        "unknown objective 'speed'; known: .*effort_ratio",
    )
    refused(
        lambda: ViaPointProblem(points=TABLE_1_JOINTS, objectives="time"),
        "objectives: expected a list of names, got 'time'",
    )
    refused(
        lambda: ViaPointProblem(points=TABLE_1_JOINTS, constraints=("torque",)),
        "unknown constraint 'torque'; known: acceleration",
    )
    refused(
        lambda: ViaPointProblem(points=TABLE_1_JOINTS, constraints="effort"), "constraints: expected a list of names"
    )


def test_effort_ratio_needs_effort_limits():
    refused(
        lambda: ViaPointProblem(
            robot="pointing_mechanism", points=[[0, 0], [0.1, 0.1], [0, 0.2]], objectives=("effort_ratio",)
        ),
        "effort_ratio needs effort limits, robot 'pointing_mechanism' has none",
    )


LATENESS = Objective("lateness", "s", "test", total_time)
NO_OBJECTIVE = total_time


def test_other_packages_register_objectives(monkeypatch, x):
    points = {
        name: EntryPoint(name, f"tests.formulation.test_by_name:{value}", NAMED_OBJECTIVES.group)
        for name, value in (("lateness", "LATENESS"), ("broken", "NO_OBJECTIVE"), ("lost", "NOWHERE"))
    }
    monkeypatch.setattr(plugins, "entry_points", lambda group: tuple(points.values()))
    mine = ViaPointProblem(points=TABLE_1_JOINTS, objectives=("lateness", "time"))
    F = mine.evaluate(x)[0]
    np.testing.assert_array_equal(F[:, 0], F[:, 1])
    refused(
        lambda: ViaPointProblem(points=TABLE_1_JOINTS, objectives=("broken",)),
        "'broken': .*is not a trajevo.Objective",
    )
    refused(lambda: ViaPointProblem(points=TABLE_1_JOINTS, objectives=("lost",)), "'lost': .*cannot be imported")
