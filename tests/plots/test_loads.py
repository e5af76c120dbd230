"""Obstacles and loads in animations: where they stand or move, and that loads go where the tool carries them."""

import base64
import re

import numpy as np
import pytest
import umsgpack

from trajevo import ViaPointProblem, optimise
from trajevo.formulation.constraints.clearance import scene_of
from trajevo.plots.animation import animate
from trajevo.plots.loads import poses_of

pytest.importorskip("meshcat", reason="meshcat is not installed: pip install 'trajevo[animation]'")

PART = {"mass": 2.0, "com": (0.0, 0.0, 0.1), "from": 1, "to": 3, "shape": {"shape": "box", "size": [0.1, 0.1, 0.2]}}
GRIPPER = {"mass": 0.5, "shape": {"shape": "cylinder", "radius": 0.03, "length": 0.08, "position": [0.0, 0.0, 0.05]}}
WALL = {"name": "wall", "shape": "box", "size": [0.05, 0.4, 0.3], "position": [-0.6, 0.0, 0.15], "rpy": [0.0, 0.0, 0.3]}
BALL = {"name": "ball", "shape": "sphere", "radius": 0.1, "position": [0.0, -0.8, 0.6]}
ROUND = {"name": "pole", "shape": "cylinder", "radius": 0.05, "length": 0.9, "position": [-0.5, -0.5, 0.45]}
CART = {
    "name": "cart",
    "shape": "box",
    "size": [0.1, 0.1, 0.1],
    "motion": [{"t": 0.1, "position": [-1.0, -1.0, 1.2]}, {"t": 1.0, "position": [-1.0, 1.0, 1.2]}],
}


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
        scene={"obstacles": [WALL, BALL, ROUND, CART], "clearance": 0.001},
        objectives=("time", "jerk"),
    )
    return optimise(task, seed=1, generations=3, population=12, progress=False, polish=False).pick("0")


def commands_of(file):
    listed = re.search(r"const commands = \[\n(.*?)\n\];", file.read_text(), re.DOTALL)[1]
    return [umsgpack.unpackb(base64.b64decode(text.strip().strip(",").strip('"'))) for text in listed.splitlines()]


def drawn_of(commands):
    """Corners of the meshes by their paths, (N, 3) each."""
    found = {}
    for one in commands:
        if one["type"] == "set_object" and one["object"].get("geometries"):
            data = one["object"]["geometries"][0].get("data", {}).get("attributes", {}).get("position")
            if data:
                corners = np.frombuffer(data["array"].data, np.float32).reshape(-1, data["itemSize"])
                found[one["path"].removeprefix("/meshcat/arm/")] = corners.astype(np.float64)
    return found


def test_obstacles_stand_where_the_scene_has_them(solution, tmp_path):
    commands = commands_of(animate(solution, tmp_path / "arm.html", rate=10.0))
    found, obstacles = drawn_of(commands), scene_of(solution.front.problem.constraints).obstacles
    assert [obstacle.name for obstacle in obstacles] == ["wall", "ball", "pole", "cart"]
    for k, obstacle in enumerate(obstacles[:3]):
        own = (found[f"obstacle_{k}"] - obstacle.position) @ obstacle.rotation
        size = [(0.05, 0.4, 0.3), (0.2, 0.2, 0.2), (0.1, 0.1, 0.9)][k]
        np.testing.assert_allclose(np.ptp(own, axis=0), size, atol=1e-6)
        np.testing.assert_allclose(own.max(axis=0) + own.min(axis=0), 0.0, atol=1e-6)
    np.testing.assert_allclose(np.ptp(found["load_1/shape"], axis=0), [0.1, 0.1, 0.2], atol=1e-6)
    np.testing.assert_allclose(np.ptp(found[f"frame_{6}/load_0/shape"], axis=0), [0.06, 0.06, 0.08], atol=1e-6)


def test_what_moves_is_drawn_in_its_own_frame_and_moved(solution, tmp_path):
    commands = commands_of(animate(solution, tmp_path / "arm.html", rate=10.0))
    np.testing.assert_allclose(np.ptp(drawn_of(commands)["obstacle_3"], axis=0), [0.1, 0.1, 0.1], atol=1e-6)
    (played,) = [one for one in commands if one["type"] == "set_animation"]
    (clip,) = [each["clip"] for each in played["animations"] if each["path"].endswith("obstacle_3")]
    (track,) = [each for each in clip["tracks"] if each["name"].endswith("position")]
    duration = float(solution.trajectory.duration[0])
    for key in track["keys"]:
        t = min(key["time"] / 10.0, duration)
        expected = [-1.0, np.interp(t, [0.1, 1.0], [-1.0, 1.0]), 1.2]
        np.testing.assert_allclose(key["value"], expected, atol=1e-6)
    assert len(track["keys"]) > 3


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
    drawn = drawn_of(commands_of(animate(solution.rollout, tmp_path / "arm.html", rate=5.0)))
    assert not [path for path in drawn if "obstacle" in path]
    assert "load_1/shape" in drawn
