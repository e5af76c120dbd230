"""Obstacles and loads in animations: where they stand, and that loads go where the tool carries them."""

import base64
import re

import numpy as np
import pytest
import umsgpack

from trajevo import ViaPointProblem, optimise
from trajevo.plots.animation import animate
from trajevo.plots.solids import obstacles_of, poses_of

pytest.importorskip("meshcat", reason="meshcat is not installed: pip install 'trajevo[animation]'")

PART = {"mass": 2.0, "com": (0.0, 0.0, 0.1), "from": 1, "to": 3, "shape": {"shape": "box", "size": [0.1, 0.1, 0.2]}}
GRIPPER = {"mass": 0.5, "shape": {"shape": "cylinder", "radius": 0.03, "length": 0.08, "position": [0.0, 0.0, 0.05]}}
WALL = {"name": "wall", "shape": "box", "size": [0.05, 0.4, 0.3], "position": [-0.6, 0.0, 0.15], "rpy": [0.0, 0.0, 0.3]}
BALL = {"name": "ball", "shape": "sphere", "radius": 0.1, "position": [0.0, -0.8, 0.6]}
ROUND = {"name": "pole", "shape": "cylinder", "radius": 0.05, "length": 0.9, "position": [-0.5, -0.5, 0.45]}


@pytest.fixture(scope="module")
def solution():
    task = ViaPointProblem(
        robot={"name": "ur5", "tool": "tool0", "limits": {"acceleration": 10.0, "jerk": 100.0}},
        points=[
            [0.0, -1.5, 1.5, -1.5, -1.5, 0.0],
            [0.8, -1.2, 1.4, -1.7, -1.5, 0.0],
            [0.4, -1.0, 1.0, -1.0, -1.0, 0.3],
            [0.2, -1.2, 1.4, -1.7, -1.5, 0.1],
            [0.0, -1.5, 1.5, -1.5, -1.5, 0.0],
        ],
        payload=[GRIPPER, PART],
        constraints=("position", "velocity", "acceleration", "jerk"),
        scene={"obstacles": [WALL, BALL, ROUND], "clearance": 0.001},
        objectives=("time", "jerk"),
    )
    return optimise(task, seed=1, generations=3, population=12, progress=False, polish=False).pick("0")


def commands_of(file):
    listed = re.search(r"const commands = \[\n(.*?)\n\];", file.read_text(), re.DOTALL)[1]
    return [umsgpack.unpackb(base64.b64decode(text.strip().strip(",").strip('"'))) for text in listed.splitlines()]


def poses(commands, kind="set_transform"):
    return {
        one["path"].removeprefix("/meshcat/arm/"): np.array(one["matrix"]).reshape(4, 4).T
        for one in commands
        if one["type"] == kind
    }


def test_obstacles_stand_where_the_scene_has_them(solution, tmp_path):
    commands = commands_of(animate(solution, tmp_path / "arm.html", rate=10.0))
    found, obstacles = poses(commands), obstacles_of(solution)
    assert [obstacle.name for obstacle in obstacles] == ["wall", "ball", "pole"]
    for k, obstacle in enumerate(obstacles):
        pose = found[f"obstacle_{k}"]
        np.testing.assert_allclose(pose[:3, 3], obstacle.position, atol=1e-6)
        along = pose[:3, 1] if k == 2 else pose[:3, 2]  # a cylinder of the viewer lies along y
        np.testing.assert_allclose(along, obstacle.rotation[:, 2], atol=1e-6)
    shapes = {
        one["path"].removeprefix("/meshcat/arm/"): one["object"]["geometries"][0]["type"]
        for one in commands
        if one["type"] == "set_object" and one["object"].get("geometries")
    }
    assert [shapes[f"obstacle_{k}"] for k in range(3)] == ["BoxGeometry", "SphereGeometry", "CylinderGeometry"]
    assert shapes["load_1/shape"] == "BoxGeometry"
    assert shapes[f"frame_{6}/load_0/shape"] == "CylinderGeometry", "the gripper moves with the tool"


def test_a_part_stands_where_it_is_picked_up_and_put_down(solution):
    rollout, breaks = solution.rollout, solution.trajectory.breaks[0]
    picked, placed = breaks[1], breaks[3]
    times = np.array([0.0, 0.5 * picked, picked, 0.5 * (picked + placed), placed, breaks[-1]])
    part = rollout.dynamics.schedule.loads[1]
    drawn = np.array(poses_of(rollout, part, times))
    positions, rotations = rollout.robot.tool_poses(
        solution.trajectory.evaluate(np.array([picked, times[3], placed]))[0]
    )
    for k, tool in zip(range(6), (0, 0, 0, 1, 2, 2), strict=True):
        np.testing.assert_allclose(drawn[k, :3, 3], positions[tool], atol=1e-12)
        np.testing.assert_allclose(drawn[k, :3, :3], rotations[tool], atol=1e-12)


def test_a_rollout_knows_no_obstacles(solution, tmp_path):
    assert obstacles_of(solution.rollout) == ()
    assert "obstacle_0" not in poses(commands_of(animate(solution.rollout, tmp_path / "arm.html", rate=5.0)))
