"""``trajevo base-map``, and how runs, exports and errors of a task tell where the base is."""

import json

import numpy as np
import pytest

from tests.helpers import UNDRAWN, trajevo
from trajevo import Front, export, load_task
from trajevo.formulation.cell.placement import BasePlacement
from trajevo.page.report import _choices_table
from trajevo.robot.robot import load_robot

TASK = """
points = [
  { position = [0.29, -0.25, 0.12], rpy = [3.14159265, 0.0, 0.0] },
  { position = [0.39, 0.30, 0.12], rpy = [3.14159265, 0.0, 0.0] },
]
duration_bounds = [0.2, 3.0]
objectives = ["time", "jerk"]

[base]
moving = { x = [-0.2, 0.1], y = ["-100 mm", 0.1] }

[robot]
name = "ur5"
tool = "tool0"
base = { position = [0.1, 0.0, "20 mm"], rpy = [0.0, 0.0, "5 deg"] }

[limits]
acceleration = 14.0
jerk = 140.0

[constraints]
limits = ["position", "velocity", "acceleration", "jerk"]
"""


@pytest.fixture
def task(tmp_path):
    file = tmp_path / "cell.toml"
    file.write_text(TASK)
    return file


def test_the_map_is_told_and_drawn(task, tmp_path):
    told = trajevo("base-map", task, "--cells", "3", "--out", tmp_path / "map.png")
    assert told.returncode == 0, told.stderr
    assert "bases with a motion; least time" in told.stdout
    assert "least time [s] by displacement of the base" in told.stdout
    assert (tmp_path / "map.png").stat().st_size > 5000


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--axes", "x", "z"), "unknown coordinate that moves 'z'"),
        (("--cells", "1"), "cells: expected a whole number from 2 on, got 1"),
        (("--at", "x"), "--at: expected COORDINATE=DISPLACEMENT, such as z=0.2, got 'x'"),
        (("--objective", "energy"), "unknown objective 'energy'"),
    ],
)
def test_what_the_map_cannot_be_of(task, options, said):
    told = trajevo("base-map", task, *options)
    assert told.returncode == 2
    assert said in told.stderr


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("moving = { x = [0.2, -0.2] }", "x: expected the least and the greatest [m], got 0.2 and -0.2"),
        ("moving = { tilt = [-0.1, 0.1] }", "base.moving.tilt: expected roll and pitch"),
        ("moving = { w = [-0.1, 0.1] }", "no coordinate 'w'"),
        ("moved = { x = [-0.1, 0.1] }", "unknown key; known: moving"),
        ("moving = { x = 0.1 }", "expected a list, got 0.1"),
    ],
)
def test_a_wrong_base_of_a_task_is_told_with_its_line(task, line, said):
    task.write_text(TASK.replace('moving = { x = [-0.2, 0.1], y = ["-100 mm", 0.1] }', line))
    told = trajevo("solve", task)
    assert told.returncode == 2
    assert "cell.toml: line 10: base.mov" in told.stderr
    assert said in told.stderr


def test_joint_positions_of_a_task_whose_base_moves_are_told_by_their_number(task):
    task.write_text(
        TASK.replace("{ position = [0.39, 0.30, 0.12], rpy = [3.14159265, 0.0, 0.0] }", "[0, 0, 0, 0, 0, 0]")
    )
    told = trajevo("solve", task)
    assert told.returncode == 2
    assert "point 1: expected a pose of the tool, as the base moves, got joint positions" in told.stderr


def test_a_run_tells_where_the_base_is_wherever_it_goes(task, tmp_path):
    run = tmp_path / "run"
    small = ("--generations", "6", "--population", "12", "--no-polish", "--quiet")
    assert trajevo("solve", task, *small, *UNDRAWN, "--out", run).returncode == 0
    front = Front.load(run / "front.json")
    knee = front.knee()
    assert knee.base == BasePlacement.of(knee.rollout)
    assert knee.base.position == pytest.approx(np.array([0.1, 0.0, 0.02]) + knee.base.moved)
    assert knee.base.rpy == pytest.approx((0.0, 0.0, np.radians(5.0)))
    assert str(knee.base) in knee._repr_html_().replace("&#x27;", "'")
    for format, name in (("json", "m.json"), ("ros2", "m.yaml"), ("csv", "m.csv")):
        text = export(knee, tmp_path / name, format=format).read_text()
        if format == "json":
            assert json.loads(text)["solution"]["base"] == knee.base.settings
        else:
            assert json.dumps(knee.base.settings) in text
    robot = load_robot("ur5", tool="tool0", limits={"acceleration": 14.0, "jerk": 140.0}, base=knee.base.settings)
    ends = knee.trajectory.evaluate(np.array([[0.0, knee.trajectory.duration[0]]]))[0]
    np.testing.assert_allclose(robot.tool_poses(ends)[0], [[0.29, -0.25, 0.12], [0.39, 0.30, 0.12]], atol=1e-7)
    assert "moved by" in _choices_table([knee])
    shown = trajevo("show", run)
    assert shown.returncode == 0, shown.stderr
    assert "base" in "".join(shown.stdout.splitlines()[1:4])
    assert f"x {knee.base.position[0]:.4g} m" in shown.stdout
    assert str(BasePlacement((0.1, 1e-17, -1e-17), (0.0, 0.0, 0.0), (0.1, 1e-17, -1e-17), 0.0)) == (
        "x 0.1 m, y 0 m, z 0 m (moved by +0.1, +0, +0 m)"
    )
    assert load_task(task).problem.settings["base"] == {"moving": {"x": [-0.2, 0.1], "y": [-0.1, 0.1]}}
