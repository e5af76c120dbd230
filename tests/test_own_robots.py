"""Robots that are not ours: loaded, solved, verified; the xArm7 goes around its post; the motions come out again."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from tests.helpers import mostly_long, refused
from trajevo import Scene, load_robot, load_task, optimise
from trajevo.exporters.export import export
from trajevo.formulation.constraints.clearance import clearance_along
from trajevo.path.boxes import CartesianBox
from trajevo.problems import ViaPointProblem
from trajevo.verification.verify import verify, verify_all

LIMITS = {"acceleration": 12.0, "jerk": 150.0}
FINGERS = {"panda_finger_joint1": 0.02, "panda_finger_joint2": 0.02}
ROBOTS = {
    "ur5": {"tool": "tool0"},
    "panda": {"tool": "panda_hand_tcp", "lock": FINGERS},
    "xarm7": {},
    "z1": {},
    # The dry friction of its gripper is all that the gripper's motor can give.
    "talos_arm": {"tool": "wrist_left_ft_tool_link", "lock": {"gripper_left_joint": 0.0}},
    "kinova": {"tool": "j2s6s200_end_effector", "lock": {f"j2s6s200_joint_{k}": 0.3 for k in (1, 4, 6)}},
}
XARM7 = Path(__file__).parents[1] / "problems" / "tasks" / "xarm7_obstacle.toml"


@pytest.mark.parametrize("every", mostly_long([1, 8], 8))
@pytest.mark.parametrize("name", mostly_long(ROBOTS, "ur5"))
def test_no_limit_is_exceeded_between_the_samples(name, every):
    robot = load_robot(name, limits=LIMITS, **ROBOTS[name])
    middle, half = 0.5 * (robot.limits.lower + robot.limits.upper), 0.5 * (robot.limits.upper - robot.limits.lower)
    way = np.minimum(0.25 * half, 0.5)
    # The middle of the ranges, or with the arm hanging where it could not hold itself up with its load.
    start = (
        np.clip(np.zeros(robot.dof), robot.limits.lower + way, robot.limits.upper - way)
        if name == "talos_arm"
        else np.clip(middle, -1.5, 1.5)
    )
    points = start + way * np.array([-1.0, 0.3, 1.0])[:, None] * np.where(np.arange(robot.dof) % 2, -1.0, 1.0)
    problem = ViaPointProblem(
        robot=robot,
        points=points,
        payload=0.5,
        duration_bounds=(0.2, 4.0),
        objectives=("time", "energy", "jerk"),
        constraints=("position", "velocity", "acceleration", "jerk", "effort"),
    )
    sizes = {"generations": 25, "population": 60} if every == 1 else {"generations": 12, "population": 40}
    front = optimise(problem, seed=1, **sizes, progress=False, polish=False)
    assert len(front) > 20, front.blocking
    some = replace(front, **{values: getattr(front, values)[::every] for values in "XFG"})
    for found in verify_all(some, density=20):
        assert found.passed, found.verdict
        assert found.effort_difference < 1e-9
    assert {row.limit for row in found.rows} >= {"position", "velocity", "acceleration", "jerk", "effort"}


@pytest.fixture(scope="module", params=mostly_long(["short", "polished"], "short"))
def around(request):
    task, whole = load_task(XARM7), request.param == "polished"
    settings = {"generations": 30 if whole else 15, "population": 40, "polish": whole, "progress": False}
    return optimise(task.problem, task.search, **settings)


def test_every_front_member_keeps_its_distance_at_every_instant(around):
    assert len(around) > 20
    scene = Scene.of(around.problem.settings["scene"])
    motions = around.problem.rollout(around.X)
    profile = clearance_along(motions, scene, density=20 * around.problem.dynamics.samples)
    assert profile.least(itself=False).min() >= scene.clearance - 1e-9


def test_without_the_obstacle_the_same_task_collides(around):
    settings = around.problem.settings
    blind = optimise(
        ViaPointProblem(**(settings | {"scene": None})),
        seed=1,
        generations=15,
        population=40,
        progress=False,
        polish=False,
    )
    scene = Scene.of(settings["scene"])
    assert any(
        clearance_along(blind.pick(row), scene, density=20).least(itself=False).min() < 0.0 for row in range(len(blind))
    )


def test_a_moving_point_wins_time(around):
    """With the point held where the task puts it, in the post, nothing is feasible at all."""
    held = ViaPointProblem(**(around.problem.settings | {"moving": []}))
    front = optimise(held, seed=1, generations=4, population=40, progress=False, polish=False)
    assert not len(front)
    assert "point 1 is in collision: link7 and post overlap" in str(front.blocking)


@pytest.mark.parametrize("polish", mostly_long([False, True], False))
def test_points_moved_at_the_tool_stay_in_their_boxes(polish):
    task = load_task(XARM7.with_name("ur5_pick_and_place.toml"))
    front = optimise(task.problem, task.search, generations=8, population=20, progress=False, polish=polish)
    assert len(front), front.blocking
    decoder = front.problem.interpolant
    nominal = front.problem.robot.tool_poses(decoder.points.positions)
    for row in range(0, len(front), 3):
        moved, turned = front.problem.robot.tool_poses(decoder.points_of(decoder(front.X[row : row + 1]))[0])
        assert (np.abs(moved - nominal[0]) <= [[1e-6, 0.05 + 1e-6, 0.05 + 1e-6]]).all()
        np.testing.assert_allclose(turned, nominal[1], atol=1e-5)
        np.testing.assert_allclose(moved[[0, 3]], nominal[0][[0, 3]], atol=1e-9)


def test_whether_the_tool_may_turn_goes_into_the_settings():
    robot = load_robot("ur5", tool="tool0", limits=LIMITS)
    points = [{"position": [0.45, y, 0.3], "rpy": [np.pi, 0.0, 0.0]} for y in (-0.25, 0.0, 0.25)]
    for keep in (True, False):
        box = CartesianBox(1, [0.02, 0.02, 0.02], keep_orientation=keep)
        problem = ViaPointProblem(robot=robot, points=points, moving=[box])
        again = ViaPointProblem(**problem.settings)
        assert again.interpolant.boxes[0].keep_orientation is keep
        x = np.append(problem.xl[:2] + 0.5, [0.02, -0.02, 0.01])[None]
        np.testing.assert_array_equal(again.evaluate(x)[0], problem.evaluate(x)[0])
    refused(
        lambda: ViaPointProblem(robot=robot, points=points, moving=[{"point": 1}]),
        "moving.0: expected point, and joints or tool",
    )


def test_limits_go_to_moveit_and_come_back(around, tmp_path):
    file = export(around.knee(), tmp_path / "joint_limits.yaml", format="moveit")
    assert yaml.safe_load(file.read_text())["joint_limits"]["joint1"]["max_velocity"] == 3.14
    robot = load_robot("xarm7", limits=file)
    np.testing.assert_array_equal(robot.limits.jerk, around.problem.robot.limits.jerk)


def test_a_tampered_motion_is_not_verified(around):
    faster = replace(around, X=np.concatenate([around.X[:, :2] * 0.3, around.X[:, 2:]], axis=1))
    assert not verify(faster.pick(0)).passed


def test_points_of_another_make_are_refused():
    robot = load_robot("ur5", tool="tool0", limits=LIMITS)
    for points, says in (
        (None, "robot 'ur5' needs via points"),
        ([[0.0, 1.0]], "expected at least 2 points|has 6 joints|expected 6 numbers, one for each of"),
        ([{"position": [9.0, 0.0, 0.0]}, {"position": [0.4, 0.0, 0.3]}], "point 0: expected a pose that 'ur5' reaches"),
        ([[0.0] * 6, {"position": [0.4, 0.0, 9.0]}, [0.0] * 6], "point 1: expected a pose.*misses it by"),
        ([[0.0] * 6, {"place": [0.4, 0.0, 0.3]}], "unknown key of a pose 'place'"),
        ([[0.0] * 6, {"rpy": [0.4, 0.0, 0.3]}], "pose: expected a 'position'"),
        ([[0.0] * 5, {"position": [0.4, 0.0, 0.3]}], "points: point 0: expected 6 numbers, one for"),
    ):
        refused(lambda given=points: ViaPointProblem(robot=robot, points=given), says)
