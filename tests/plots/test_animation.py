"""Pictures and animations of the arm, and the forward kinematics of its chain."""

import base64
import re
import subprocess
import sys
import threading

import matplotlib.pyplot as plt
import numpy as np
import pytest
import umsgpack

from tests.helpers import refused
from tests.reference import TABLE_4_DURATIONS
from trajevo import load_robot
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.path.via_points import ViaPoints
from trajevo.plots.animation import animate, stick_figure
from trajevo.problems import HybridManipulator, PointingMechanism
from trajevo.problems.hybrid_manipulator import paper_solution
from trajevo.robot.locate import list_robots
from trajevo.trajectory.interpolants import QuinticSpline


def rollout_through(robot):
    """A motion of any robot: to a random point inside its limits and back, 2 s."""
    rng = np.random.default_rng(1)
    limits = robot.limits
    low, high = np.clip(limits.lower, -1.0, None), np.clip(limits.upper, None, 1.0)
    points = low + (high - low) * rng.uniform(0.3, 0.7, (3, robot.dof))
    spline = QuinticSpline(ViaPoints(points), duration_bounds=(0.5, 2.0))
    return Rollout(Dynamics(robot), spline(np.array([[1.0, 1.0]])))


@pytest.fixture(params=list_robots())
def motion(request):
    return rollout_through(load_robot(request.param))


@pytest.fixture(scope="module")
def hybrid():
    return HybridManipulator().rollout(paper_solution())


def commands_of(file):
    """What the page tells the viewer, by kind."""
    found = {}
    for command in re.findall(r'^"([\w+/=]+)",?$', file.read_text(), re.MULTILINE):
        unpacked = umsgpack.unpackb(base64.b64decode(command))
        found.setdefault(unpacked["type"], []).append(unpacked)
    return found


def tracks_of(file):
    """Track by (path, property) of the animation, with the frames' rates."""
    (animation,) = commands_of(file)["set_animation"]
    return {
        (part["path"].removeprefix("/meshcat/arm/"), track["name"].removeprefix(".")): (
            part["clip"]["fps"],
            track["keys"],
        )
        for part in animation["animations"]
        for track in part["clip"]["tracks"]
    }


def test_the_chain_ends_at_the_tool_and_turning_joints_keep_its_lengths(motion):
    robot, q = motion.robot, motion.trajectory.sample(50).q[0]
    positions, rotations = robot.joint_poses(q)
    assert positions.shape == (50, robot.dof + 1, 3)
    tool, turned = robot.tool_poses(q)
    np.testing.assert_array_equal(positions[:, -1], tool)
    np.testing.assert_array_equal(rotations[:, -1], turned)
    lengths = np.linalg.norm(np.diff(positions, axis=1), axis=2)
    turns = np.append(robot.joint_axes[1][1:], True)  # the tool is fixed to the last joint
    np.testing.assert_allclose(
        lengths[:, turns], np.broadcast_to(lengths[0, turns], lengths[:, turns].shape), atol=1e-12
    )


def test_a_joint_moves_its_frame_about_or_along_its_axis(motion):
    """One joint of the model after the other, by hand: without the transmission, which moves several."""
    robot, q = motion.robot, motion.trajectory.sample(2).q[0][:1]
    axes, turns = robot.joint_axes
    np.testing.assert_allclose(np.linalg.norm(axes, axis=1), 1.0)
    assert [name for name, turning in zip(robot.model.names[1:], turns, strict=True) if not turning] == {
        "feed_drive": ["x", "y"],
        "hybrid_manipulator": ["slide", "screw_3"],
        "pointing_mechanism": [],
        "puma560": [],
    }[robot.name]
    step = np.zeros_like(q)
    step[0, -1] = 1e-6
    before, after = robot.joint_poses(q), robot.joint_poses(q + step)
    axis = before[1][0, -2] @ axes[-1]
    if turns[-1]:
        np.testing.assert_allclose(after[0][0, -2], before[0][0, -2], atol=1e-12)
        np.testing.assert_allclose(after[1][0, -2] @ axes[-1], axis, atol=1e-12)
    else:
        np.testing.assert_allclose((after[0] - before[0])[0, -2] / 1e-6, axis, atol=1e-6)


def test_chains_are_drawn_from_the_base_to_the_tool(motion):
    space = plt.figure().add_subplot(projection="3d")
    assert stick_figure(motion, count=4, ax=space) is space
    chains = [np.array(line.get_data_3d()).T for line in space.lines if line.get_marker() == "o"]
    ends = motion.trajectory.evaluate(np.linspace(0.0, 2.0, 4))[0]
    assert [chain.shape for chain in chains] == [(motion.robot.dof + 2, 3)] * 4
    np.testing.assert_array_equal([chain[0] for chain in chains], np.zeros((4, 3)))
    np.testing.assert_allclose([chain[-1] for chain in chains], motion.robot.tool_poses(ends)[0], atol=1e-12)
    widths = [np.ptp(limits) for limits in (space.get_xlim(), space.get_ylim(), space.get_zlim())]
    np.testing.assert_allclose(widths, widths[0])
    assert len({line.get_color() for line in space.lines if line.get_marker() == "o"}) == 4


def test_the_picture_shows_the_time_and_stands_upright(hybrid):
    ax = stick_figure(hybrid, count=1)
    assert ax.figure.axes[1].get_ylabel() == "time [s]"
    assert ax.figure.axes[1].get_ylim() == pytest.approx((0.0, 6.19))
    assert (ax.roll, ax.elev) == (180, -20)  # the base's z axis points down
    pointing = PointingMechanism(interpolant="printed").rollout(TABLE_4_DURATIONS)
    assert stick_figure(pointing).roll == 0


def test_every_robot_is_animated(motion, tmp_path):
    file = animate(motion, tmp_path / "arm.html", rate=10.0)
    tracks = tracks_of(file)
    assert {path for path, _ in tracks} == {
        f"{kind}_{k}" for kind in ("frame", "link") for k in range(motion.robot.dof + 1)
    }
    assert all(fps == 10.0 and len(keys) == 21 for fps, keys in tracks.values())
    assert all([key["time"] for key in keys] == list(range(21)) for _, keys in tracks.values())


def test_the_animation_moves_as_pinocchio_says_until_the_end(hybrid, tmp_path):
    tracks = tracks_of(animate(hybrid, tmp_path / "arm.html"))
    _, keys = tracks["frame_5", "position"]
    times = np.array([key["time"] for key in keys]) / 25.0
    assert len(times) == int(25.0 * 6.19) + 2
    assert times[-1] == pytest.approx(6.19)
    positions, _ = hybrid.robot.joint_poses(hybrid.trajectory.evaluate(times)[0])
    np.testing.assert_allclose([key["value"] for key in keys], positions[:, -1], atol=1e-6)
    _, scales = tracks["link_4", "scale"]
    lengths = np.linalg.norm(positions[:, 4] - positions[:, 3], axis=1)
    np.testing.assert_allclose([key["value"][1] for key in scales], lengths, rtol=1e-5)


def test_links_lie_between_the_origins(hybrid, tmp_path):
    tracks = tracks_of(animate(hybrid, tmp_path / "arm.html", rate=5.0))
    keys = [tracks["link_2", name][1] for name in ("position", "quaternion", "scale")]
    middle, quaternion, scale = (np.array([key["value"] for key in track]) for track in keys)
    x, y, z, w = quaternion.T
    along = np.stack([2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)], axis=1)  # turned y axis
    times = np.append(np.arange(31) / 5.0, float(hybrid.trajectory.duration[0]))
    positions, _ = hybrid.robot.joint_poses(hybrid.trajectory.evaluate(times)[0])
    np.testing.assert_allclose(middle + 0.5 * scale[:, 1:2] * along, positions[:, 2], atol=1e-5)
    np.testing.assert_allclose(middle - 0.5 * scale[:, 1:2] * along, positions[:, 1], atol=1e-5)


def test_gravity_points_down_in_the_viewer(motion, tmp_path):
    stage = next(
        command
        for command in commands_of(animate(motion, tmp_path / "arm.html"))["set_transform"]
        if command["path"] == "/meshcat/arm"
    )
    rotation = np.array(stage["matrix"]).reshape(4, 4).T[:3, :3]
    gravity = rotation @ motion.robot.model.gravity.linear
    np.testing.assert_allclose(gravity / np.linalg.norm(gravity), [0.0, 0.0, -1.0], atol=1e-6)
    assert np.linalg.det(rotation) > 0.0


def test_the_page_needs_no_network(hybrid, tmp_path):
    page = animate(hybrid, tmp_path / "arm.html").read_text()
    assert not re.search(r"<(link|iframe|img|script[^>]*\ssrc)\b", page)
    assert "default-src 'unsafe-inline' data: blob:" in page
    assert not re.search(r"(fetch|import|src|href)\s*[=(]\s*[\"'`](https?:)?//", page)
    assert "viewer.connect(" not in page
    assert "Copyright 2010-2021 Three.js Authors" in page


def test_nothing_is_left_running_and_nothing_is_printed(hybrid, tmp_path, monkeypatch, capfd):
    def refuse(*arguments, **settings):
        raise OSError("a process was started")

    monkeypatch.setattr(subprocess, "Popen", refuse)
    before = threading.active_count()
    animate(hybrid, tmp_path / "arm.html")
    assert threading.active_count() == before
    assert capfd.readouterr() == ("", "")


BAD = {
    "no motion": (lambda motion, folder: stick_figure(5), "motion: expected a solution, an optimum or a rollout"),
    "no figure": (
        lambda motion, folder: stick_figure(motion, count=0),
        "count: expected a positive whole number, got 0",
    ),
    "half": (
        lambda motion, folder: stick_figure(motion, count=2.5),
        "count: expected a positive whole number, got 2.5",
    ),
    "plane": (lambda motion, folder: stick_figure(motion, ax=plt.gca()), "ax: expected axes in space"),
    "no rate": (lambda motion, folder: animate(motion, folder / "a", rate=0.0), "rate: expected a positive number"),
    "backwards": (lambda motion, folder: animate(motion, folder / "a", rate=-1), "rate: expected a positive number"),
    "NaN": (lambda motion, folder: animate(motion, folder / "a", rate=np.nan), "rate: expected a positive number"),
    "text": (lambda motion, folder: animate(motion, folder / "a", rate="fast"), "rate: .* got 'fast'"),
    "too many": (
        lambda motion, folder: animate(motion, folder / "a", rate=1e6),
        "over 10000 frames of a motion of 6.19 s",
    ),
    "no path": (lambda motion, folder: animate(motion, 5), "file: expected a path, got 5"),
    "folder": (lambda motion, folder: animate(motion, folder), "cannot be written: Is a directory"),
    "nowhere": (lambda motion, folder: animate(motion, folder / "b" / "a"), "cannot be written: No such file"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_cannot_be_shown_gets_a_sentence(case, hybrid, tmp_path):
    call, says = BAD[case]
    refused(lambda: call(hybrid, tmp_path), says)
    assert not list(tmp_path.iterdir())


def test_a_missing_meshcat_gets_a_sentence(hybrid, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "meshcat", None)
    refused(
        lambda: animate(hybrid, tmp_path / "a.html"),
        "needs the package meshcat, pip install 'trajevo.animation.'",
    )
