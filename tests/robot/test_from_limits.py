"""Robots of joints and limits alone: published problems that state no body, and everything that a body would be for."""

import json
import pickle

import numpy as np
import pytest
from click.testing import Result
from typer.testing import CliRunner

from trajevo import (
    Front,
    Payload,
    Robot,
    ViaPointProblem,
    animate,
    certify,
    export,
    load_task,
    minimise_weighted,
    optimise,
    payload_capacity,
    verify,
)
from trajevo.cli.main import app
from trajevo.errors import InvalidInputError, TrajevoError
from trajevo.formulation.problem import Weights
from trajevo.robot.robot import robot_of

INF = float("inf")

TASK = """
robot = { name = "two", joints = ["turn", "slide"], kind = ["revolute", "prismatic"] }
points = [[0.0, 0.0], [1.0, 0.5], [0.3, 0.2], [1.5, 1.0]]
duration_bounds = [0.1, 6.0]
interpolant = "cubic"
objectives = ["time", "jerk"]

[limits]
velocity = ["100 deg/s", 1.0]
acceleration = 2.0
jerk = { turn = 8.0, slide = inf }

[constraints]
limits = ["velocity", "acceleration", "jerk"]

[algorithm]
generations = 4
population = 12
"""


def degrees(*values):
    return [f"{value} deg" for value in values]


def rates(order, *values):
    return [f"{value} deg/s{'' if order == 1 else f'^{order}'}" for value in values]


def least_time(robot, points, starts):
    problem = ViaPointProblem(
        robot=robot,
        points=np.radians(points).T,
        duration_bounds=(0.05, 6.0),
        interpolant="cubic",
        constraints=("velocity", "acceleration", "jerk"),
    )
    return minimise_weighted(problem, Weights((1.0, 0.0)), seed=1, starts=starts)


def test_the_joints_of_lin_chang_and_luh():
    """Lin, Chang, Luh: Formulation and optimization of cubic polynomial joint trajectories, IEEE TAC 28 (1983)."""
    robot = Robot.from_limits(
        velocity=rates(1, 100, 95, 100, 150, 130, 110),
        acceleration=rates(2, 45, 40, 75, 70, 90, 80),
        jerk=rates(3, 60, 60, 55, 70, 75, 70),
    )
    one, two, three = [10, 60, 75, 130, 110, 100, -10, -50], [15, 25, 30, -45, -55, -70, -10, 10], [45, 180, 200, 120]
    four, five, six = [5, 20, 60, 110, 20, 60, -100, -30], [10, 30, -40, -60, 10, 50, -40, 10], [6, 40, 80, 70]
    points = [one, two, [*three, 15, -10, 100, 50], four, five, [*six, -10, 10, 30, 20]]
    found = least_time(robot, points, starts=4)
    assert round(found.F["time"], 4) == 17.8360
    assert max(found.G.values()) <= 1e-6


def test_the_joints_of_gasparetto_and_zanotto():
    """Gasparetto, Zanotto: A new method for smooth trajectory planning of robot manipulators, MMT 42 (2007)."""
    robot = Robot.from_limits(
        velocity=rates(1, 100, 95, 100, 150, 130, 110),
        acceleration=rates(2, 60, 60, 75, 70, 90, 80),
        jerk=rates(3, 60, 66, 85, 70, 75, 70),
    )
    one, two, three = [-10, 60, 20, 55], [20, 50, 120, 35], [15, 100, -10, 30]
    four, five, six = [150, 100, 40, 10], [30, 110, 90, 70], [120, 60, 100, 25]
    found = least_time(robot, [one, two, three, four, five, six], starts=4)
    assert round(found.F["time"], 4) == 8.5310
    assert max(found.G.values()) <= 1e-6


def two(**others):
    return Robot.from_limits(
        **{"velocity": ["100 deg/s", 1.0], "acceleration": 2.0, "jerk": [8.0, INF], "name": "two"} | others
    )


def test_limits_are_what_was_given():
    robot = two(position=[[-1.0, 2.0], ["-30 mm", "50 mm"]], kind=["revolute", "prismatic"], names=["turn", "slide"])
    assert robot.joint_names == ("turn", "slide")
    assert robot.joint_units == ("rad", "m")
    np.testing.assert_allclose(robot.limits.lower, [-1.0, -0.03], rtol=1e-15)
    np.testing.assert_allclose(robot.limits.upper, [2.0, 0.05], rtol=1e-15)
    np.testing.assert_allclose(robot.limits.velocity, [np.radians(100.0), 1.0], rtol=1e-15)
    np.testing.assert_array_equal(robot.limits.acceleration, [2.0, 2.0])
    np.testing.assert_array_equal(robot.limits.jerk, [8.0, INF])
    np.testing.assert_array_equal(robot.limits.effort, [INF, INF])
    assert str(robot) == "two: limits alone, 2 joints"
    assert not robot.gives_effort


@pytest.mark.parametrize("given", [{}, {"position": [-3.0, 3.0], "kind": "prismatic", "names": ["u", "w"]}])
def test_it_is_made_again_from_its_settings(given):
    robot = two(**given)
    for again in (
        robot_of(json.loads(json.dumps(robot.settings))),
        pickle.loads(pickle.dumps(robot)),
        robot_of(robot.settings),
    ):
        assert again.settings == robot.settings
        assert again.joint_names == robot.joint_names
        for name, values in vars(robot.limits).items():
            np.testing.assert_array_equal(getattr(again.limits, name), values)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"velocity": 1.0, "jerk": 1.0}, "names: expected the names of the joints"),
        ({"jerk": [1.0, 2.0, 3.0]}, "limits.jerk: expected 1 or 2 values, got 3"),
        ({"names": ["a"], "jerk": 1.0}, "limits.velocity: expected 1 or 1 values, got 2"),
        ({"names": ["a", "a"]}, "robot 'two': joint 'a': expected a unique name, got 2 joints"),
        ({"names": "ab"}, "names: expected 2 names of joints, one for each, got 'ab'"),
        ({"kind": "turning"}, "unknown kind of joint 'turning'"),
        ({"kind": ["revolute"]}, "names: "),
        ({"jerk": {"joint_1": 1.0}}, "jerk: expected a limit for joint_2, got none; inf is no limit"),
        ({"velocity": [180.0, 1.0]}, "looks like deg/s"),
        ({"velocity": [0.0, 1.0]}, "robot 'two': joint 'joint_1': velocity: expected a positive limit, got 0"),
        ({"position": [2.0, 1.0]}, "position: lower must be below upper"),
        ({"name": ""}, "name: expected printable characters"),
    ],
)
def test_a_wrong_limit_is_refused(given, told):
    whole = {"velocity": [1.0, 1.0], "acceleration": 2.0, "jerk": [8.0, INF], "name": "two"} | given
    if told == "names: ":
        told = "limits.velocity: expected 1 or 1 values, got 2"
    with pytest.raises(TrajevoError) as error:
        Robot.from_limits(**whole)
    assert told in str(error.value)


POINTS = [[0.0, 0.0], [1.0, 0.5], [0.3, 0.2], [1.5, 1.0]]


@pytest.mark.parametrize(
    ("given", "named"),
    [
        ({"objectives": ("time", "energy")}, "energy"),
        ({"objectives": ("time", "square_effort_rate")}, "square_effort_rate"),
        ({"objectives": ("time", "effort_ratio")}, "effort_ratio"),
        ({"objectives": ("time", "tool_path")}, "tool_path"),
        ({"objectives": ("time", "unused_payload"), "constraints": ("velocity", "effort")}, "a limit of effort"),
        ({"constraints": ("velocity", "effort")}, "a limit of effort"),
        ({"payload": 2.0}, "a payload"),
        ({"payload": Payload(1.0)}, "a payload"),
        ({"tool_speed": 1.0}, "a limit of tool speed"),
        ({"tool_height": 0.1}, "a limit of tool height"),
        ({"clearance": 0.01, "scene": {"sphere": [{"name": "s", "position": [1.0, 0.0, 0.0], "radius": 0.1}]}}, "clear"),
        ({"moving": [{"point": 1, "tool": (0.1, 0.1, 0.0)}]}, "a box of the tool"),
        ({"points": [[0.0, 0.0], {"position": [0.1, 0.2, 0.3]}, [1.0, 1.0]]}, "the place of the tool"),
    ],
)
def test_what_needs_a_body_is_refused_by_name(given, named):
    with pytest.raises(InvalidInputError) as error:
        ViaPointProblem(**{"robot": two(), "points": POINTS, "constraints": ("velocity",)} | given)
    said = str(error.value)
    assert said.startswith(f"robot 'two': {named}")
    assert "needs a body, and this robot is joints and limits alone" in said
    assert "\n" not in said


def test_points_move_in_a_box_of_joints():
    problem = ViaPointProblem(robot=two(), points=POINTS, moving=[{"point": 1, "joints": 0.1}], interpolant="cubic")
    assert [v.name for v in problem.interpolant.variables if v.name.startswith("q_1")] == [
        "q_1 of joint_1",
        "q_1 of joint_2",
    ]


@pytest.fixture(scope="module")
def solved(tmp_path_factory):
    folder = tmp_path_factory.mktemp("alone")
    (folder / "task.toml").write_text(TASK)
    problem = load_task(folder / "task.toml")
    return optimise(problem.problem if hasattr(problem, "problem") else problem, seed=1, generations=4, population=12)
