"""Joints that turn without end: loaded, planned for the way that is asked for, with a range where one is given."""

import json
import shutil
import warnings

import numpy as np
import pytest

from tests.helpers import UNDRAWN, mostly_long, refused, trajevo
from tests.robot.arms import GEN3
from tests.twin import Twin
from trajevo import Dynamics, Payload, ViaPointProblem, certify, export, load_robot, optimise, verify
from trajevo.path.inverse_kinematics import Pose
from trajevo.path.via_points import joint_points
from trajevo.path.whole_turns import the_shorter_way, turning_joints
from trajevo.robot.examine import examine
from trajevo.robot.kinematics import ToolKinematics
from trajevo.robot.locate import ROBOTS_FOLDER
from trajevo.robot.moveit_limits import read_joint_limits, write_joint_limits
from trajevo.verification.newton_euler import NewtonEuler

GIVEN = {"acceleration": 8.0, "jerk": 80.0}
TURN = 2.0 * np.pi
SOME = {"generations": 6, "population": 20, "seed": 1, "progress": False}


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "gen3.urdf"
    path.write_text(GEN3, encoding="utf-8")
    return path


@pytest.fixture
def gen3(file):
    return load_robot(file, limits=GIVEN)


def test_a_continuous_joint_is_one_coordinate_without_a_range(gen3):
    assert gen3.model.nq == gen3.model.nv == gen3.dof == 4
    np.testing.assert_array_equal(gen3.limits.lower, [-np.inf, -2.24, -np.inf, -2.57])
    np.testing.assert_array_equal(gen3.limits.upper, [np.inf, 2.24, np.inf, 2.57])
    np.testing.assert_array_equal(gen3.limits.velocity, np.full(4, 1.39))
    assert gen3.joint_units == ("rad",) * 4


def test_efforts_and_poses_are_those_of_mujoco_and_of_newton_and_euler(gen3):
    random = np.random.default_rng(0)
    q, v, a = random.uniform(-20.0, 20.0, (3, 50, 4))
    payload = Payload(2.0, com=(0.01, 0.02, 0.05))
    effort, twin = Dynamics(gen3, payload).effort(q, v, a), Twin.of(gen3, payload, gravity=(0.0, 0.0, -9.80665))
    size = np.abs(effort).max()
    np.testing.assert_allclose(effort, twin.effort(q, v, a), rtol=0.0, atol=1e-12 * size)
    np.testing.assert_allclose(effort, NewtonEuler(gen3, payload).effort(q, v, a), rtol=0.0, atol=1e-12 * size)
    for found, expected in zip(ToolKinematics.of(gen3).pose(q), twin.tool_poses(q), strict=True):
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12)


def test_a_whole_turn_is_the_same_posture_and_another_position(gen3):
    np.testing.assert_array_equal(turning_joints(gen3), np.full(4, True))
    np.testing.assert_array_equal(turning_joints(load_robot("hybrid_manipulator")), [False] * 3 + [True] * 2)
    written = np.array([[3.0, 0.0, -10.0, 0.0], [-3.0, 1.0, 10.0, 1.0], [TURN, 2.0, 0.0, -2.0]])
    shorter = the_shorter_way(gen3, written)
    assert (np.abs(np.diff(shorter, axis=0))[:, [0, 2]] <= np.pi).all()
    np.testing.assert_array_equal(shorter[:, [1, 3]], written[:, [1, 3]])  # their ranges hold no other turn
    turns = (shorter - written) / TURN
    np.testing.assert_allclose(turns, np.rint(turns), atol=1e-12)
    for found, expected in zip(gen3.tool_poses(shorter), gen3.tool_poses(written), strict=True):
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12)
    np.testing.assert_array_equal(the_shorter_way(gen3, shorter), shorter)


@pytest.mark.thinned(2)
@pytest.mark.parametrize(
    ("turns", "wide", "expected"),
    [("as_written", 400.0, 200.0), ("shortest", 400.0, -160.0), ("shortest", 90.0, 200.0)],
)
def test_points_are_as_written_or_the_shorter_way_round_within_the_range(file, tmp_path, turns, wide, expected):
    """From 0 to 200 deg; a range of 90 deg to the negative side holds no shorter way."""
    (tmp_path / "task.toml").write_text(
        f'robot = "gen3.urdf"\nangle = "deg"\nturns = "{turns}"\npoints = [[0, 0, 0, 10], [200, 20, 0, 40]]\n'
        "duration_bounds = [1.0, 9.0]\n"
        f"[limits]\nacceleration = 8.0\njerk = 80.0\nposition = {{ joint_1 = ['-{wide} deg', '400 deg'] }}\n"
    )
    small = ("--generations", "2", "--population", "12", *UNDRAWN)
    done = trajevo("solve", "task.toml", *small, "--out", "run", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    settings = json.loads((tmp_path / "run" / "front.json").read_text())["problem"]["settings"]
    assert settings["points"][1][0] == pytest.approx(np.radians(expected))


def test_another_way_round_is_refused(gen3):
    points = [[0.0] * 4, [1.0] * 4]
    refused(lambda: ViaPointProblem(robot=gen3, points=points, turns="shorter"), "unknown turns 'shorter'.*'shortest'")


def test_a_pose_takes_the_turn_nearest_to_the_point_before(gen3):
    before = np.array([7.0, 1.0, -9.0, 1.0])
    (position,), (rotation,) = gen3.tool_poses(before[None] - [[TURN, 0.0, -TURN, 0.0]])
    found = joint_points([before - 0.1, Pose(position, rotation)], gen3).positions[1]
    np.testing.assert_allclose(found, before, atol=1e-5)


@pytest.mark.parametrize("polish", mostly_long([False, True], False))
@pytest.mark.parametrize(
    "interpolant",
    mostly_long(["quintic_spline", "cubic", "hybrid", "linear_blends", "polynomial"], "linear_blends"),
)
def test_a_motion_over_several_turns_is_solved_proven_and_exported(gen3, interpolant, polish, tmp_path):
    points = [[0.0, 0.5, 0.0, 0.5], [8.0, -0.5, -7.0, 1.0], [15.0, 0.5, 3.0, -1.0]]
    limits = ("position", "velocity", "acceleration", "jerk", "effort")
    problem = ViaPointProblem(
        robot=gen3, points=points, interpolant=interpolant, constraints=limits, duration_bounds=(4.0, 25.0)
    )
    front = optimise(problem, polish=polish, **SOME)
    assert len(front)
    solution = front.knee()
    certificate = certify(solution)
    assert certificate.proven
    told = {row.joint for row in certificate.rows if row.quantity == "position" and row.limit < np.inf}
    assert not told & {"joint_1", "joint_3"}
    assert verify(solution).passed
    for name in ("csv", "ros2", "json", "mujoco", "moveit", "netcdf"):
        assert export(solution, tmp_path / f"file_{name}", format=name).stat().st_size


def test_ranges_may_be_given_for_endless_joints(file, tmp_path):
    pair = {"joint_1": ["-400 deg", "90 deg"]}
    robot = load_robot(file, limits=GIVEN | {"position": pair})
    np.testing.assert_allclose([robot.limits.lower[0], robot.limits.upper[0]], np.radians([-400.0, 90.0]))
    assert np.isinf(robot.limits.lower[2])
    refused(lambda: joint_points([[0.0] * 4, [2.0, 0.0, 0.0, 0.0]], robot), "'joint_1' at 2 rad, outside its range")
    folder = shutil.copytree(ROBOTS_FOLDER / "pointing_mechanism", tmp_path / "mine")
    urdf = folder / "pointing_mechanism.urdf"
    urdf.write_text(urdf.read_text(encoding="utf-8").replace('type="revolute"', 'type="continuous"'), encoding="utf-8")
    plain = load_robot("pointing_mechanism")
    np.testing.assert_array_equal(load_robot(folder).limits.upper, plain.limits.upper)  # those of robot.toml


def test_moveit_knows_joints_without_a_range(gen3, tmp_path):
    text = write_joint_limits(gen3.limits, gen3.joint_names)
    assert text.count("has_position_limits: false") == 2
    (tmp_path / "limits.yaml").write_text(text)
    again = read_joint_limits(tmp_path / "limits.yaml", gen3.joint_names, gen3.joint_units)["position"]
    assert [again["joint_1"], again["joint_3"]] == [(-np.inf, np.inf)] * 2


def test_what_is_not_limited_and_what_is_not_used_is_told(file):
    assert not [said for said in examine(file).warnings if "continuous" in said]
    shown = trajevo("check-robot", file)
    assert shown.returncode == 0
    assert "no range" in " ".join(shown.stdout.split()) or shown.stdout.count("range") == 2
    text = GEN3.replace('<axis xyz="0 0 1"/><limit effort="39" velocity="1.39"/>', '<axis xyz="0 0 1"/>', 1)
    file.write_text(text.replace('<limit effort="39"', '<limit lower="-3" upper="3" effort="39"'), encoding="utf-8")
    said = examine(file).warnings
    assert any("'joint_1' is continuous and has no <limit>: its velocity and effort are not" in each for each in said)
    assert any(
        "'joint_3' is continuous, so the range of its <limit>, -3 to 3 rad, is not used" in each for each in said
    )
    robot = load_robot(file, limits=GIVEN)
    assert np.isinf([robot.limits.velocity[0], robot.limits.effort[0], robot.limits.upper[2]]).all()
    assert robot.limits.velocity[1] == 1.39


@pytest.mark.thinned(2)
@pytest.mark.parametrize("name", ["bravo7_no_ee", "kinova", "double_pendulum_continuous"])
def test_published_robots_with_endless_joints_load_and_solve(name):
    tool = {"kinova": "j2s6s200_end_effector", "bravo7_no_ee": "contact_point"}.get(name)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        robot = load_robot(name, tool=tool, limits=GIVEN | {"velocity": 1.0, "effort": 300.0})
    endless = np.isinf(robot.limits.lower)
    start = np.where(endless, 5.0, robot.limits.lower + 0.5)
    points = [start, start + np.where(endless, 4.0, 0.2)]
    front = optimise(ViaPointProblem(robot=robot, points=points, duration_bounds=(1.0, 30.0)), **SOME)
    assert len(front)
    assert certify(front.knee()).proven
