"""One motion in space: the page moves the robot as Pinocchio does, and shows what stands, moves and is carried."""

import re
import shutil
import subprocess
import sys
import threading

import numpy as np
import pytest
from PIL import Image

from tests.formulation.test_attached import POST, planar
from tests.helpers import mostly_long, refused
from tests.page.reading import Page
from trajevo import ViaPointProblem, animate, load_robot, optimise
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.formulation.constraints.clearance import scene_of
from trajevo.page import parts
from trajevo.page.film import _near
from trajevo.path.via_points import ViaPoints
from trajevo.plots.scenery import scenery
from trajevo.problems import HybridManipulator
from trajevo.problems.hybrid_manipulator import paper_solution
from trajevo.robot.locate import list_robots
from trajevo.trajectory.interpolants import QuinticSpline

pytest.importorskip("meshcat", reason="meshcat is not installed: pip install 'trajevo[animation]'")

FREE = {"acceleration": 10.0, "jerk": 100.0}
ARMS = {
    "ur5": {"tool": "tool0", "limits": FREE},
    "panda": {"tool": "panda_hand_tcp", "limits": FREE},
}
PART = {"mass": 2.0, "com": (0.0, 0.0, 0.1), "from": 1, "to": 3, "shape": {"shape": "box", "size": [0.1, 0.1, 0.2]}}
GRIPPER = {"mass": 0.5, "shape": {"shape": "cylinder", "radius": 0.03, "length": 0.08, "position": [0.0, 0.0, 0.05]}}
WALL = {"name": "wall", "shape": "box", "size": [0.05, 0.4, 0.3], "position": [-0.6, 0.0, 0.15], "rpy": [0.0, 0.0, 0.3]}
BALL = {"name": "ball", "shape": "sphere", "radius": 0.1, "position": [0.0, -0.8, 0.6]}
CART = {
    "name": "cart",
    "shape": "box",
    "size": [0.1, 0.1, 0.1],
    "motion": [{"t": 0.1, "position": [-1.0, -1.0, 1.2]}, {"t": 1.0, "position": [-1.0, 1.0, 1.2]}],
}


def rollout_through(robot):
    """A motion of any robot: to a random point inside its limits and back, 2 s."""
    rng = np.random.default_rng(1)
    limits = robot.limits
    low, high = np.clip(limits.lower, -1.0, None), np.clip(limits.upper, None, 1.0)
    points = low + (high - low) * rng.uniform(0.3, 0.7, (3, robot.dof))
    spline = QuinticSpline(ViaPoints(points), duration_bounds=(0.5, 2.0))
    return Rollout(Dynamics(robot), spline(np.array([[1.0, 1.0]])))


@pytest.fixture(scope="module")
def hybrid():
    return HybridManipulator().rollout(paper_solution())


@pytest.fixture(scope="module")
def carrying():
    task = ViaPointProblem(
        robot={"name": "ur5", "tool": "tool0", "limits": FREE},
        points=[
            [0.0, -1.5, 1.5, -1.5, -1.5, 0.0],
            [0.8, -1.2, 1.4, -1.7, -1.5, 0.0],
            [0.4, -1.0, 1.0, -1.0, -1.0, 0.3],
            [0.2, -1.2, 1.4, -1.7, -1.5, 0.1],
            [0.0, -1.5, 1.5, -1.5, -1.5, 0.0],
        ],
        payload=[GRIPPER, PART],
        constraints=("position", "velocity", "acceleration", "jerk"),
        scene={"obstacles": [WALL, BALL, CART], "clearance": 0.001},
        objectives=("time", "jerk"),
    )
    return optimise(task, seed=1, generations=3, population=12, progress=False, polish=False).pick("0")


@pytest.mark.parametrize("name", [*list_robots(), *ARMS])
def test_every_robot_moves_as_pinocchio_says(name, tmp_path):
    motion = rollout_through(load_robot(name, **ARMS.get(name, {})))
    page = Page.of(animate(motion, tmp_path / "arm.html"))
    instants = np.linspace(0.0, float(motion.trajectory.duration[0]), 7)
    positions, rotations = motion.robot.joint_poses(motion.trajectory.evaluate(instants)[0])
    for k, time in enumerate(instants):
        frames = page.frames(0, time)
        # A robot whose actuators do not drive joints one by one has its positions at instants, straight lines between.
        near = 1e-3 if "model" in page.data["members"] else 2e-6
        np.testing.assert_allclose(frames[:, :3, 3], positions[k], atol=near)
        np.testing.assert_allclose(frames[:, :3, :3], rotations[k], atol=near)


def test_a_robot_without_shapes_is_drawn_as_sticks_and_one_with_meshes_by_them(hybrid, tmp_path):
    sticks = Page.of(animate(hybrid, tmp_path / "sticks.html"))
    assert sticks.data["arm"]["sticks"]
    assert not sticks.data["arm"]["surfaces"]
    whole = Page.of(animate(rollout_through(load_robot("ur5", **ARMS["ur5"])), tmp_path / "ur5.html"))
    assert not whole.data["arm"]["sticks"]
    assert [joint for joint, _ in whole.surfaces("link")] == list(range(7))
    assert (tmp_path / "ur5.html").stat().st_size < 1e6


def test_obstacles_stand_where_the_scene_has_them(carrying, tmp_path):
    page = Page.of(animate(carrying, tmp_path / "arm.html"))
    obstacles = scene_of(carrying.front.problem.constraints).obstacles
    found = page.surfaces("obstacle")
    for (joint, corners), obstacle, size in zip(found, obstacles, [(0.05, 0.4, 0.3), (0.2, 0.2, 0.2)], strict=False):
        own = (corners - obstacle.position) @ obstacle.rotation
        assert joint is None
        np.testing.assert_allclose(np.ptp(own, axis=0), size, atol=1e-6)
        np.testing.assert_allclose(own.max(axis=0) + own.min(axis=0), 0.0, atol=1e-6)
    (moving,) = [one for one in page.data["arm"]["surfaces"] if "poses" in one]
    times, poses = page.array(moving["times"]), page.array(moving["poses"])
    np.testing.assert_allclose(np.ptp(found[-1][1], axis=0), [0.1, 0.1, 0.1], atol=1e-6)
    np.testing.assert_allclose(times[-1], carrying.trajectory.duration[0], rtol=1e-6)
    np.testing.assert_allclose(poses[:, 1, 3], np.interp(times, [0.1, 1.0], [-1.0, 1.0]), atol=1e-6)
    np.testing.assert_allclose(poses[:, (0, 2), 3], [[-1.0, 1.2]] * len(times), atol=1e-6)


def test_loads_are_shapes_in_the_frame_of_the_tool_with_the_segments_that_carry_them(carrying, tmp_path):
    page = Page.of(animate(carrying, tmp_path / "arm.html"))
    gripper, part = page.data["arm"]["loads"]
    assert (gripper["from"], part["from"], part["to"]) == (None, 1, 3)
    np.testing.assert_allclose(np.ptp(page.array(part["vertices"]), axis=0), [0.1, 0.1, 0.2], atol=1e-6)
    np.testing.assert_allclose(np.ptp(page.array(gripper["vertices"]), axis=0), [0.06, 0.06, 0.08], atol=1e-6)
    np.testing.assert_allclose(page.members("via")[0], carrying.trajectory.breaks[0], rtol=1e-6)


def test_what_is_attached_moves_with_its_link(tmp_path):
    front = optimise(planar(obstacles=[POST]), seed=1, population=24, generations=12, polish=False, progress=False)
    page = Page.of(animate(front.pick("0"), tmp_path / "arm.html"))
    assert [joint for joint, _ in page.surfaces("attached")] == [1, 2]
    assert len(page.surfaces("obstacle")) == 1


def test_a_rollout_knows_no_obstacles(carrying, tmp_path):
    page = Page.of(animate(carrying.rollout, tmp_path / "arm.html"))
    assert not page.surfaces("obstacle")
    assert len(page.data["arm"]["loads"]) == 2
    assert page.data["members"]["via"] is None


def test_the_page_needs_no_network(hybrid, tmp_path):
    page = animate(hybrid, tmp_path / "arm.html").read_text()
    assert not re.search(r"<(link|iframe|img|script[^>]*\ssrc)\b", page)
    assert "default-src 'none'" in page
    assert not re.search(r"(fetch|import|src|href)\s*[=(]\s*[\"'`](https?:)?//", page)
    assert "Copyright 2010-2021 Three.js Authors" in page


def test_nothing_is_left_running_and_nothing_is_printed(hybrid, tmp_path, monkeypatch, capfd):
    def refuse(*arguments, **settings):
        raise OSError("a process was started")

    monkeypatch.setattr(subprocess, "Popen", refuse)
    before = threading.active_count()
    animate(hybrid, tmp_path / "arm.html")
    assert threading.active_count() == before
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("rate", mostly_long([1, 2], 1))
def test_a_film_has_a_frame_for_every_instant_in_real_time(carrying, tmp_path, rate):
    file = animate(carrying, tmp_path / "arm.gif", rate=rate)
    with Image.open(file) as film:
        frames = [film.seek(k) or film.convert("RGB").copy() for k in range(film.n_frames)]
        assert film.info["duration"] == 1000 // rate
    assert len(frames) == int(np.ceil(rate * float(carrying.trajectory.duration[0]))) + 1
    different = np.abs(np.asarray(frames[0], dtype=int) - np.asarray(frames[1], dtype=int)) > 40
    assert 100 < different.any(axis=2).sum() < 0.5 * different.shape[0] * different.shape[1]


@pytest.mark.skipif(shutil.which("ffprobe") is None, reason="ffmpeg is not installed")
@pytest.mark.parametrize("rate", mostly_long([1, 2], 1))
def test_a_film_as_mp4_lasts_as_long_as_the_motion(carrying, tmp_path, rate):
    file = animate(carrying, tmp_path / "arm.mp4", rate=rate)
    told = ["-show_entries", "stream=nb_frames,r_frame_rate,pix_fmt", "-of", "default=noprint_wrappers=1", file]
    found = subprocess.run(["ffprobe", "-v", "error", *told], capture_output=True, text=True, check=True).stdout
    frames = int(np.ceil(rate * float(carrying.trajectory.duration[0]))) + 1
    assert set(found.split()) == {f"nb_frames={frames}", f"r_frame_rate={rate}/1", "pix_fmt=yuv420p"}


def test_a_film_has_obstacles_near_the_motion_whole_in_its_box(carrying):
    around = scenery(carrying, np.zeros(3), 1.0)
    near = _near(around, np.zeros(3), 1.0)
    assert [len(each) for each in near] == [len(one.triangles) * 3 for one in around if one.motion is None]
    assert len(near) == 2
    assert len(_near(around, np.zeros(3), 0.4)) == 1  # the ball is 1.1 m away


def test_what_is_damaged_is_told_beside_the_arm(tmp_path, monkeypatch):
    def damaged(robot, **settings):
        raise InvalidInputError("wrist.stl: expected an STL of whole triangles, got 10 bytes")

    monkeypatch.setattr("trajevo.page.arm.link_shapes", damaged)
    with pytest.warns(UserWarning, match="wrist.stl"):
        page = Page.of(animate(rollout_through(load_robot("ur5", **ARMS["ur5"])), tmp_path / "arm.html"))
    assert page.data["arm"]["sticks"]
    assert page.data["arm"]["why"] == (
        "wrist.stl: expected an STL of whole triangles, got 10 bytes; the arm is drawn as sticks"
    )


BAD = {
    "no rate": (0.0, "arm.gif", "rate: expected a positive number"),
    "backwards": (-1, "arm.gif", "rate: expected a positive number"),
    "NaN": (np.nan, "arm.gif", "rate: expected a positive number"),
    "text": ("fast", "arm.gif", "rate: .* got 'fast'"),
    "too many": (1e6, "arm.gif", "over 2000 frames of a motion of 6.19 s"),
    "of a page": (10.0, "arm.html", "rate: expected a film, which ends in .gif or .mp4, as a page shows every instant"),
    "nowhere": (None, "b/arm.html", "cannot be written: No such file"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_cannot_be_shown_gets_a_sentence(case, hybrid, tmp_path):
    rate, name, says = BAD[case]
    refused(lambda: animate(hybrid, tmp_path / name, rate=rate), says)
    assert not list(tmp_path.iterdir())


def test_something_else_than_a_motion_or_a_path_gets_a_sentence(hybrid, tmp_path):
    refused(lambda: animate(5, tmp_path / "a.html"), "motion: expected a solution, an optimum or a rollout")
    refused(lambda: animate(hybrid, 5), "file: expected the path of a file, got 5")
    refused(lambda: animate(hybrid, tmp_path), "cannot be written: Is a directory")


def test_a_film_without_ffmpeg_gets_a_sentence(hybrid, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    refused(lambda: animate(hybrid, tmp_path / "a.mp4"), "needs ffmpeg on the PATH; one that ends in .gif needs none")


def test_a_missing_viewer_gets_a_sentence(hybrid, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "meshcat", None)
    parts.packed_viewer.cache_clear()
    try:
        refused(
            lambda: animate(hybrid, tmp_path / "a.html"), "needs the package meshcat: pip install 'trajevo.animation.'"
        )
    finally:
        parts.packed_viewer.cache_clear()
