"""Limits that differ by direction, as files, tasks, commands and exports state and hold them."""

import json
from dataclasses import replace

import netCDF4
import numpy as np
import pytest

from tests.helpers import UNDRAWN, limits_shown, refused, trajevo
from trajevo import Payload, Robot, ViaPoints, load_robot, load_task, plots
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.robot.examine import examine
from trajevo.robot.moveit_limits import read_joint_limits, write_joint_limits
from trajevo.robot.robot import robot_of
from trajevo.trajectory.interpolants import QuinticSpline

PAIR = {"backward": "60 deg/s", "forward": "80 deg/s"}
PAIR_2 = {"backward": 2.0, "forward": 4.0}


@pytest.mark.parametrize("form", [PAIR, [PAIR] * 6, {f"joint_{k}": PAIR for k in range(1, 7)}])
def test_a_pair_may_stand_for_any_number(form):
    robot = load_robot("puma560", limits={"velocity": form})
    np.testing.assert_allclose(robot.limits.velocity, np.radians(80.0))
    np.testing.assert_allclose(robot.limits.velocity_backward, np.radians(60.0))
    again = robot_of(json.loads(json.dumps(robot.settings)))
    np.testing.assert_array_equal(again.limits.velocity_backward, robot.limits.velocity_backward)


def test_joints_may_have_one_limit_or_two():
    limits = {"effort": {"joint_2": {"backward": 90.0, "forward": np.inf}}, "acceleration": [4.0, PAIR_2, 4, 4, 4, 4]}
    robot = load_robot("puma560", limits=limits)
    plain = load_robot("puma560").limits
    np.testing.assert_array_equal(robot.limits.effort_backward[[0, 1]], [plain.effort[0], 90.0])
    np.testing.assert_array_equal(robot.limits.acceleration_backward, [4.0, 2.0, 4.0, 4.0, 4.0, 4.0])
    assert robot.limits.effort[1] == np.inf
    again = robot_of(json.loads(json.dumps(robot.settings)))
    np.testing.assert_array_equal(again.limits.sides("effort").both, robot.limits.sides("effort").both)
    agreeing = load_robot("puma560", limits={"velocity": {"backward": 1.0, "forward": 1.0}})
    assert agreeing.limits.velocity_backward is None


def test_from_limits_takes_pairs_and_counts_no_joints_by_them():
    robot = Robot.from_limits(velocity=PAIR, acceleration=[1.0, 2.0], jerk=9.0)
    assert robot.dof == 2
    np.testing.assert_allclose(robot.limits.velocity_backward, np.radians([60.0, 60.0]))
    refused(lambda: Robot.from_limits(velocity=PAIR, acceleration=1.0, jerk=9.0), "names: expected the names")
    named = Robot.from_limits(
        velocity={"backward": 1.0, "forward": 2.0}, acceleration=1.0, jerk=9.0, names=["backward", "forward"]
    )  # joints of these names: a limit for each
    np.testing.assert_array_equal(named.limits.velocity, [1.0, 2.0])
    assert named.limits.velocity_backward is None


@pytest.mark.parametrize(
    ("limits", "says"),
    [
        ({"velocity": {"forward": 2.0}}, "limits.velocity: expected backward and forward, got no backward"),
        ({"velocity": {"joint_1": {"backward": 2.0}}}, "limits.velocity.joint_1: expected .* got no forward"),
        ({"effort": [9, 9, 9, {"fwd": 1.0}, 9, 9]}, "limits.effort: unknown direction 'fwd'; .*did you mean 'forward'"),
        ({"jerk": {"joint_1": PAIR_2}}, "limits.jerk.joint_1: expected one limit for both directions, which only vel"),
        ({"jerk": PAIR_2}, "limits.jerk: expected one limit for both directions"),
        (
            {"velocity": {"backward": 0.0, "forward": 2.0}},
            "joint_1': velocity: expected a positive limit, got 0",
        ),
        ({"velocity": {"backward": "1 m/s", "forward": 2.0}}, "limits.velocity.joint_1: .*m/s"),
        ({"effort": [-60.0, 80.0]}, "limits.effort: expected 1 or 6 values, got 2"),
    ],
)
def test_what_is_no_pair_is_refused_by_name(limits, says):
    refused(lambda: load_robot("puma560", limits=limits), says)


def folder(tmp_path, change, name="velocity = { limit = 1.92"):
    source = load_robot("puma560").source
    text = (source / "robot.toml").read_text(encoding="utf-8")
    for file in source.iterdir():
        if file.is_file():
            (tmp_path / file.name).write_bytes(file.read_bytes())
    assert name in text
    (tmp_path / "robot.toml").write_text(text.replace(name, change, 1), encoding="utf-8")
    return tmp_path


def test_robot_toml_states_both_directions(tmp_path):
    made = folder(tmp_path, "velocity = { forward = 1.92, backward = 1.2")
    limits, plain = load_robot(made).limits, load_robot("puma560").limits
    np.testing.assert_array_equal(limits.velocity, plain.velocity)
    np.testing.assert_array_equal(limits.velocity_backward, [1.2, *plain.velocity[1:]])
    faster = load_robot(made, limits={"velocity": {"joint_2": 1.0}}).limits  # one number is both directions
    np.testing.assert_array_equal(faster.sides("velocity").both[:, :2], [[1.92, 1.0], [1.2, 1.0]])
    row = examine(made).joints[0]
    assert (row.velocity_backward, row.velocity, row.acceleration_backward) == (1.2, 1.92, None)
    shown = trajevo("check-robot", str(made))
    assert "-1.2 to 1.92" in shown.stdout


@pytest.mark.parametrize("change", ["velocity = { forward = 1.92", "velocity = { limit = 1.0, backward = 1.92"])
def test_robot_toml_with_half_a_pair_is_refused_with_its_line(tmp_path, change):
    refused(lambda: load_robot(folder(tmp_path, change)), "robot.toml: line .*either limit, or forward and backward")


TASK = """
format = 1
robot = "puma560"
points = [[0.0, -0.5, 0.3, 0.0, 0.4, 0.0], [0.6, -0.7, 0.7, 0.4, 0.9, 0.5], [-0.2, -0.4, 0.2, -0.3, 0.2, 0.1]]
duration_bounds = [0.3, 4.0]
[limits]
velocity = { backward = "40 deg/s", forward = "80 deg/s" }
effort = { joint_2 = { backward = 150.0, forward = 180.0 } }
[algorithm]
generations = 4
population = 12
polish = false
"""


@pytest.fixture(scope="module")
def solved(tmp_path_factory):
    file = tmp_path_factory.mktemp("task") / "task.toml"
    file.write_text(TASK, encoding="utf-8")
    out = file.parent / "run"
    assert trajevo("solve", str(file), "--out", str(out), *UNDRAWN).returncode == 0
    return file, out


def test_a_task_states_them_and_goes_all_the_way(solved):
    file, out = solved
    limits = load_task(file).problem.robot.limits
    np.testing.assert_allclose(limits.velocity_backward, np.radians(40.0))
    np.testing.assert_allclose(limits.sides("effort").both[:, 1], [180.0, 150.0])
    record = json.loads((out / "front.json").read_text(encoding="utf-8"))["problem"]
    assert record["limits"]["velocity_backward"] == pytest.approx([np.radians(40.0)] * 6)
    assert "acceleration_backward" not in record["limits"]
    certificate = trajevo("verify", str(out))
    assert certificate.returncode == 0, certificate.stderr


@pytest.mark.parametrize("format", ["moveit", "netcdf", "krl", "urscript"])
def test_exports_say_what_they_cannot_hold(solved, tmp_path, format):
    _, out = solved
    found = trajevo("export", str(out), "--format", format, "--out", str(tmp_path / "made"))
    assert found.returncode == 0, found.stderr
    made = next(tmp_path.rglob("made*"))
    if format == "moveit":
        text = made.read_text(encoding="utf-8")
        assert "velocity of joint_1: 0.698132 backward and 1.39626 forward; MoveIt has one limit" in text
        read = read_joint_limits(made, tuple(f"joint_{k}" for k in range(1, 7)), ("rad",) * 6)
        assert read["velocity"]["joint_1"] == pytest.approx(np.radians(40.0))
        assert read["effort"]["joint_2"] == 150.0
    if format == "netcdf":
        with netCDF4.Dataset(made) as data:
            np.testing.assert_allclose(data["limit_velocity_backward"][:], np.radians(40.0))
            assert "limit_acceleration_backward" not in data.variables


def test_moveit_files_of_robots_that_agree_have_no_comment():
    robot = load_robot("puma560")
    assert write_joint_limits(robot.limits, robot.joint_names).startswith("joint_limits:")
    directed = replace(robot.limits, effort_backward=0.5 * robot.limits.effort)
    assert write_joint_limits(directed, robot.joint_names).count("# effort of") == 6


def test_pictures_draw_both_bounds():
    robot = load_robot("puma560", limits={"velocity": {"backward": 0.5, "forward": 1.0}})
    ends = ViaPoints(np.array([np.zeros(6), np.full(6, 0.2)]))
    rollout = Rollout(Dynamics(robot, Payload(0.0)), QuinticSpline(ends, duration_bounds=(0.1, 5.0))(np.ones((1, 1))))
    panel = plots.profiles(rollout)[1]
    bounds = limits_shown(panel)
    assert bounds == {-0.5, 1.0}
