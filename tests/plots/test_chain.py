"""Pictures of the arm, and the forward kinematics of its chain."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

from tests.helpers import refused
from tests.page.test_animation import rollout_through
from tests.reference import TABLE_4_DURATIONS
from trajevo import load_robot
from trajevo.plots.chain import stick_figure
from trajevo.problems import HybridManipulator, PointingMechanism
from trajevo.problems.hybrid_manipulator import paper_solution
from trajevo.robot.locate import list_robots


@pytest.fixture(params=list_robots())
def motion(request):
    return rollout_through(load_robot(request.param))


@pytest.fixture(scope="module")
def hybrid():
    return HybridManipulator().rollout(paper_solution())


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
        "ur5_drives": [],
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


BAD = {
    "no motion": (lambda motion: stick_figure(5), "motion: expected a solution, an optimum or a rollout"),
    "no figure": (lambda motion: stick_figure(motion, count=0), "count: expected a positive whole number, got 0"),
    "half": (lambda motion: stick_figure(motion, count=2.5), "count: expected a positive whole number, got 2.5"),
    "plane": (lambda motion: stick_figure(motion, ax=plt.gca()), "ax: expected axes in space"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_cannot_be_drawn_gets_a_sentence(case, hybrid):
    call, says = BAD[case]
    refused(lambda: call(hybrid), says)
