"""Files for robots and simulators, each read back by a reader that knows nothing of the writer."""

import csv
import json
import re
from dataclasses import replace

import numpy as np
import pytest
import yaml

from tests.helpers import mostly_long, refused, trajevo
from trajevo import optimise
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.exporters.controllers import replay_table, states, urscript
from trajevo.exporters.export import EXPORTERS, export, extension, is_exported
from trajevo.exporters.samples import motion_schema
from trajevo.problems import HybridManipulator, PointingMechanism, ViaPointProblem
from trajevo.problems.puma_kinematics import TABLE_1_JOINTS

#: A joint of the PUMA 560 that the points leave where it is.
STANDING = 3

SMALL = {"seed": 1, "generations": 3, "population": 12, "progress": False}


@pytest.fixture(scope="module")
def front():
    return optimise(ViaPointProblem(robot="puma560", points=TABLE_1_JOINTS, payload=1.0), **SMALL, polish=False)


@pytest.fixture(scope="module")
def knee(front):
    return front.knee()


@pytest.fixture(scope="module")
def hybrid():
    return optimise(HybridManipulator(payload=5.0), **SMALL, polish=False).knee()


def duration(solution):
    return float(solution.trajectory.duration[0])


def settings(file):
    """The comment lines that say what was solved."""
    lines = [line[2:].split(": ", 1) for line in file.read_text().splitlines() if line.startswith("# ")]
    return {key: json.loads(value) for key, value in lines if key in ("problem", "run", "solution", "locked")}


def points_of(message):
    """Nanoseconds and the four arrays of a JointTrajectory."""
    stamps = [p["time_from_start"]["sec"] * 10**9 + p["time_from_start"]["nanosec"] for p in message["points"]]
    arrays = [[p[key] for p in message["points"]] for key in ("positions", "velocities", "accelerations", "effort")]
    return stamps, [np.array(rows) for rows in arrays]


def replay(file):
    rows = list(csv.reader(line for line in file.read_text().splitlines() if not line.startswith("#")))
    table = np.array(rows[1:], dtype=float)
    return dict(zip(rows[0], table.T, strict=True))


def program(text):
    """Lines of a URScript program as (function, joint vector or None, named arguments)."""
    lines = [line.strip() for line in text.splitlines() if line.strip() and not line.startswith("#")]
    assert lines[0] == "def trajevo_motion():"
    assert lines[-1] == "end"
    calls = []
    for line in lines[1:-1]:
        name, inside = re.fullmatch(r"(\w+)\((.*)\)", line).groups()
        vector = re.match(r"\[([-0-9., ]+)\]", inside)
        named = {key: float(value) for key, value in re.findall(r"(\w+)=([0-9.]+)", inside)}
        calls.append((name, [float(x) for x in vector[1].split(",")] if vector else None, named))
    return calls


# --- ROS 2


@pytest.mark.parametrize("step", mostly_long([0.01, 0.0333, 0.7, 1e6], 0.0333, 0.7, 1e6))
def test_a_ros_trajectory_reads_back_as_the_motion(knee, tmp_path, step):
    file = export(knee, tmp_path / "knee.yaml", format="ros2", step=step)
    message = yaml.safe_load(file.read_text())
    assert list(message) == ["header", "joint_names", "points"]
    assert message["header"] == {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
    assert message["joint_names"] == list(knee.front.problem.robot.joint_names)
    stamps, (q, v, a, effort) = points_of(message)
    assert all(0 <= point["time_from_start"]["nanosec"] < 10**9 for point in message["points"])
    assert stamps[0] == 0
    assert stamps[-1] == round(1e9 * duration(knee))
    intervals = np.diff(stamps)
    assert np.ptp(intervals) <= 1
    assert intervals.min() >= min(round(1e9 * step), stamps[-1])
    assert len(stamps) == max(int(duration(knee) // step), 1) + 1
    t = np.minimum(np.array(stamps) / 1e9, duration(knee))
    t[-1] = duration(knee)
    for order, values in enumerate((q, v, a)):
        np.testing.assert_array_equal(values, knee.trajectory.evaluate(t, order)[0])
    v[:, STANDING] = 0.0
    expected = knee.front.problem.dynamics.effort(q[1:-1], v[1:-1], a[1:-1])
    np.testing.assert_allclose(effort[1:-1], expected, rtol=1e-12, atol=1e-12)
    assert settings(file)["solution"]["x"] == knee.x.tolist()
    assert settings(file)["problem"] == knee.front.record.model_dump(mode="json")
    assert settings(file)["run"]["seed"] == 1


def test_every_number_of_a_ros_trajectory_is_a_float(tmp_path):
    points = np.array([[1e-5, 0.1], [0.2, 0.3], [0.4, 2e-7]])  # PyYAML reads "1e-05" as a word
    front = optimise(
        ViaPointProblem(robot="pointing_mechanism", points=points, duration_bounds=(1.0, 9.0)), **SMALL, polish=False
    )
    file = export(front.knee(), tmp_path / "knee.yaml", format="ros2", step=0.5)
    found = yaml.safe_load(file.read_text())["points"]
    numbers = [x for p in found for key in ("positions", "velocities", "accelerations", "effort") for x in p[key]]
    assert {type(x) for x in numbers} == {float}
    assert found[0]["positions"] == [1e-5, 0.1]
    assert "[1.0e-05, 0.1]" in file.read_text()


def test_a_standing_joint_has_no_dry_friction(knee):
    end = duration(knee)
    t = np.linspace(0.0, end, 101)
    found, robot = states(knee.rollout, t), knee.rollout.robot
    assert np.abs(found.v[:, STANDING]).max() > 0.0  # rounding alone
    assert np.abs(found.v[-1]).max() > 0.0
    frictionless = replace(robot, friction=replace(robot.friction, coulomb=np.zeros(6), coulomb_backward=np.zeros(6)))
    smooth = states(Rollout(replace(knee.rollout.dynamics, robot=frictionless), knee.trajectory), t)
    dry = np.abs(found.effort - smooth.effort)
    assert dry[[0, -1]].max() < 1e-9
    assert dry[:, STANDING].max() < 1e-9
    moving = np.delete(dry[1:-1], STANDING, axis=1)
    assert (
        moving >= np.delete(np.minimum(robot.friction.coulomb, robot.friction.coulomb_backward), STANDING) - 1e-9
    ).all()


def test_a_payload_that_was_decided_is_carried(knee):
    t = np.linspace(0.0, duration(knee), 30)
    robot = knee.rollout.robot
    decided = states(Rollout(Dynamics(robot), knee.trajectory, np.array([1.0])), t)
    given = states(knee.rollout, t)
    np.testing.assert_allclose(decided.effort, given.effort, rtol=1e-9, atol=1e-9)
    empty = states(Rollout(Dynamics(robot), knee.trajectory), t)
    assert np.abs(given.effort - empty.effort).max() > 0.5


def test_a_robot_without_masses_has_no_effort(knee, tmp_path):
    model = knee.rollout.robot.model.copy()
    for k in range(1, model.njoints):
        model.inertias[k] = model.inertias[0]
    robot = replace(knee.rollout.robot, model=model, allow_massless=False)
    assert robot.mass == 0.0
    assert states(Rollout(Dynamics(robot), knee.trajectory), np.array([0.0, 1.0])).effort is None


# --- MuJoCo


@pytest.mark.parametrize("share", [None, 0.07, 0.1, 3.0])
def test_a_replay_is_the_motion_at_a_fixed_rate_and_then_rest(knee, tmp_path, share):
    step = None if share is None else share * duration(knee)
    table = replay(export(knee, tmp_path / "knee.mujoco.csv", format="mujoco", step=step))
    step = step or 0.002
    names = knee.front.problem.robot.joint_names
    kinds = ("qpos", "qvel", "qacc", "force")
    assert list(table) == ["time", *(f"{name}_{kind}" for kind in kinds for name in names)]
    t = table["time"]
    np.testing.assert_array_equal(t, np.arange(len(t)) * step)
    assert t[-1] >= duration(knee) * (1.0 - 1e-9)
    assert t[-2] < duration(knee)
    moving = t <= duration(knee)
    for j, name in enumerate(names):
        for order, kind in enumerate(kinds[:3]):
            expected = knee.trajectory.evaluate(t[moving], order)[0, :, j]
            np.testing.assert_array_equal(table[f"{name}_{kind}"][moving], expected)
        end = knee.trajectory.evaluate(np.array([duration(knee)]))[0, 0, j]
        np.testing.assert_array_equal(table[f"{name}_qpos"][~moving], end)
        if share != 0.1:  # with which the last row is the end itself
            assert table[f"{name}_qvel"][-1] == 0.0
            assert table[f"{name}_qacc"][-1] == 0.0
    force = np.array([table[f"{name}_force"] for name in names]).T
    q, v, a = (np.array([table[f"{name}_{kind}"] for name in names]).T for kind in kinds[:3])
    v[:, STANDING] = 0.0
    held = knee.front.problem.dynamics.effort(q[-1:], np.zeros((1, 6)), a[-1:])
    np.testing.assert_allclose(force[-1:], held, rtol=1e-12, atol=1e-12)
    inner = slice(1, max(len(t) - 2, 1))
    expected = knee.front.problem.dynamics.effort(q[inner], v[inner], a[inner])
    np.testing.assert_allclose(force[inner], expected, rtol=1e-12, atol=1e-12)


def test_rounding_adds_no_row_to_a_replay(knee):
    for count in range(1, 50):
        rows = replay_table(knee, duration(knee) / count).splitlines()
        assert len([row for row in rows if not row.startswith("#")]) == 1 + count + 1


def test_velocities_of_a_replay_are_slopes_of_its_positions(hybrid, tmp_path):
    table = replay(export(hybrid, tmp_path / "k.mujoco.csv", format="mujoco"))
    for name in list(hybrid.front.problem.robot.model.names)[1:]:
        for low, high in (("qpos", "qvel"), ("qvel", "qacc")):
            # The last steps hold the end.
            slope = (table[f"{name}_{low}"][2:-2] - table[f"{name}_{low}"][:-4]) / 0.004
            scale = np.abs(table[f"{name}_{high}"]).max()
            np.testing.assert_allclose(slope, table[f"{name}_{high}"][1:-3], atol=1e-2 * scale)


def test_a_replay_is_of_the_models_joints_and_its_forces_of_the_actuators(hybrid, tmp_path):
    file = export(hybrid, tmp_path / "k.mujoco.csv", format="mujoco", step=0.01)
    table, t = replay(file), np.arange(5) * 0.01
    screws = hybrid.trajectory.evaluate(t)[0]
    np.testing.assert_allclose(table["slide_qpos"][:5], 0.5 * (screws[:, 0] + screws[:, 1]), atol=1e-15)
    assert "screw_1_qpos" not in table
    assert {"screw_1_force", "screw_2_force", "joint_5_force"} <= set(table)
    assert settings(file)["locked"] == {}
    ros = yaml.safe_load(export(hybrid, tmp_path / "k.yaml", format="ros2").read_text())
    assert ros["joint_names"] == ["screw_1", "screw_2", "screw_3", "joint_4", "joint_5"]


# --- URScript


@pytest.mark.parametrize("step", [None, 0.002, 0.02, 0.1])
def test_a_program_streams_the_motion(knee, tmp_path, step):
    calls = program(export(knee, tmp_path / "knee.script", format="urscript", step=step).read_text())
    step = step or 0.008
    assert [name for name, _, _ in calls[:3]] == ["set_tcp", "movej", "set_payload"]
    calls = [calls[1], *calls[3:]]
    assert calls[-1][0] == "stopj"
    assert {name for name, _, _ in calls[1:-1]} == {"servoj"}
    limits = knee.front.problem.robot.limits
    assert 0.0 < calls[0][2]["v"] <= limits.velocity.min()
    assert 0.0 < calls[0][2]["a"] <= limits.acceleration.min()
    assert all(named == {"t": step, "lookahead_time": 0.1, "gain": 300.0} for _, _, named in calls[1:-1])
    q = np.array([vector for _, vector, _ in calls[:-1]])
    t = np.arange(len(q)) * step
    np.testing.assert_allclose(q, knee.trajectory.evaluate(np.minimum(t, duration(knee)))[0], atol=1e-12)
    held = t[-1] - duration(knee)
    assert 0.1 - 1e-9 <= held < 0.1 + step


def test_a_program_has_no_exponents_and_no_negative_zeros(tmp_path):
    points = np.array(
        [[1e-5, -1e-14, -0.5, 0.0, 0.0, -2e-7], [0.5, 0.2, -0.1, 0.3, 0.4, 0.1], [0.9, 0.1, -0.2, 0.4, 0.5, 0.1]]
    )
    knee = optimise(ViaPointProblem(robot="puma560", points=points), **SMALL, polish=False).knee()
    text = export(knee, tmp_path / "knee.script", format="urscript").read_text()
    assert "movej([0.00001, 0.0, -0.5, 0.0, 0.0, -0.0000002], a=1.4, v=1.05)" in text
    body = [line for line in text.splitlines() if "servoj" in line]
    assert not any(re.search(r"\de[-+]?\d|-0\.0[,\]]", line) for line in body)


@pytest.mark.parametrize("step", [0.001, 0.0019, 0.11, 10.0])
def test_a_cycle_that_no_controller_runs_is_refused(knee, tmp_path, step):
    refused(
        lambda: export(knee, tmp_path / "x", format="urscript", step=step),
        f"step: expected 0.002 to 0.1 s, which servoj can run, got {step:g} s",
    )
    assert not (tmp_path / "x").exists()


def test_other_robots_have_no_program(hybrid, tmp_path):
    pointing = optimise(PointingMechanism(), **SMALL | {"population": 20, "generations": 8}, polish=False).knee()
    says = "urscript: expected a robot with six joints that turn, got 'pointing_mechanism' with joints in rad, rad"
    refused(lambda: export(pointing, tmp_path / "x", format="urscript"), says)
    refused(lambda: urscript(hybrid, 0.008), "got 'hybrid_manipulator' with joints in m, m, m, rad, rad")


# --- all of them


@pytest.mark.parametrize("format", ["ros2", "mujoco", "urscript"])
def test_degrees_are_refused(knee, tmp_path, format):
    refused(
        lambda: export(knee, tmp_path / "x", format=format, angle="deg"),
        f"angle: the format '{format}' is in rad, got 'deg'",
    )
    refused(lambda: export(knee, tmp_path / "x", format=format, angle="gon"), "unknown angle unit 'gon'")


def test_names_of_files_differ_and_are_known_again(knee, tmp_path):
    assert len({extension(format) for format in EXPORTERS}) == len(EXPORTERS)
    assert [extension(format) for format in ("ros2", "mujoco", "urscript")] == ["yaml", "mujoco.csv", "script"]
    for format in ("csv", "json", "ros2", "mujoco", "urscript"):
        assert is_exported(export(knee, tmp_path / f"knee.{extension(format)}", format=format, step=0.1))
    for name in ("mine.yaml", "mine.script", "mine.mujoco.csv"):
        (tmp_path / name).write_text("# mine\n")
        assert not is_exported(tmp_path / name)
    refused(lambda: extension("xml"), "unknown export format 'xml'")


def test_the_command_names_files_by_their_extension(front, tmp_path):
    front.save(tmp_path / "front.json")
    for format, name in (("ros2", "knee.yaml"), ("mujoco", "knee.mujoco.csv"), ("urscript", "knee.script")):
        result = trajevo("export", tmp_path, "--format", format)
        assert result.returncode == 0, result.stderr
        assert (tmp_path / name).is_file()
    result = trajevo("export", tmp_path, "--format", "urscript", "--step", "0.001")
    assert (result.returncode, result.stdout) == (2, "")
    assert "step: expected 0.002 to 0.1 s" in result.stderr


def test_the_schema_names_every_entry_of_the_records(knee):
    schema = motion_schema()["$defs"]
    for name, record in (("problem", knee.front.record), ("run", knee.front.run)):
        fields = type(record).model_fields
        required = {key for key, field in fields.items() if field.is_required() or key == "length"}
        assert set(schema[name]["properties"]) == set(fields)
        assert set(schema[name]["required"]) == required
