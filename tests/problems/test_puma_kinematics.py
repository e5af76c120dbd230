"""Kinematics of the PUMA 560: all eight branches, Table 1 of Raji 2022, edges of the workspace, bad input."""

import numpy as np
import pinocchio as pin
import pytest

from tests.reference import RAJI2022
from trajevo import TrajevoError, load_robot
from trajevo.errors import UnreachableError
from trajevo.problems.puma_kinematics import (
    BRANCHES,
    D3,
    TABLE_1_JOINTS,
    TABLE_1_POSITIONS,
    TURN_MIDDLE,
    all_inverse_kinematics,
    forward_kinematics,
    inverse_kinematics,
)

PUMA = RAJI2022["puma"]
ROBOT = load_robot("puma560")
ANYWHERE = np.random.default_rng(0).uniform(-np.pi, np.pi, (500, 6))
NEAR, FAR, FOLDED = [0.1, 0.1, 0.2], [0.5, 0.5, 0.6], [0.15005, 0.0, 0.0]
every_branch = pytest.mark.parametrize("branch", BRANCHES, ids="-".join)


def posed(q):
    pose = forward_kinematics(q)
    return pose[:, :3, 3], pose[:, :3, :3]


def turned(q):
    """Angles brought to between -π and π."""
    return np.mod(q + np.pi, 2.0 * np.pi) - np.pi


def assert_all_branches_reach(position, rotation):
    for q in np.swapaxes(all_inverse_kinematics(position, rotation), 0, 1):
        reached = posed(q)
        np.testing.assert_allclose(reached[0], position, rtol=0.0, atol=1e-11)
        np.testing.assert_allclose(reached[1], rotation, rtol=0.0, atol=1e-11)


def test_forward_kinematics_equal_pinocchios():
    position, rotation = posed(ANYWHERE)
    by_pinocchio = ROBOT.tool_poses(ANYWHERE)
    np.testing.assert_allclose(position, by_pinocchio[0], rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(rotation, by_pinocchio[1], rtol=0.0, atol=1e-12)


def test_forward_kinematics_equal_the_stored_ones_on_a_pedestal():
    for state in PUMA["rtb_states"]:
        pose = forward_kinematics([state["q"]])[0]
        pose[2, 3] += PUMA["pedestal"]
        np.testing.assert_allclose(pose, state["fk"], rtol=0.0, atol=1e-12)


@every_branch
def test_every_branch_reaches_the_pose(branch):
    position, rotation = posed(ANYWHERE)
    q = inverse_kinematics(position, rotation, branch)
    reached = posed(q)
    np.testing.assert_allclose(reached[0], position, rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(reached[1], rotation, rtol=0.0, atol=1e-11)
    np.testing.assert_array_equal(q, all_inverse_kinematics(position, rotation)[:, BRANCHES.index(branch)])


@pytest.mark.thinned(3)
@every_branch
def test_words_of_a_branch_mean_what_they_say(branch):
    """Looking from the axis of joint 1 towards the wrist, by the places that Pinocchio gives the links."""
    position, rotation = posed(ANYWHERE)
    data, up = ROBOT.model.createData(), np.array([0.0, 0.0, 1.0])
    link_1, link_2 = (ROBOT.model.getFrameId(name) for name in ("link_1", "link_2"))
    for q, wrist in zip(inverse_kinematics(position, rotation, branch), position, strict=True):
        pin.framesForwardKinematics(ROBOT.model, data, q)
        shoulder, elbow = D3 * data.oMf[link_1].rotation[:, 2], data.oMf[link_2].translation
        rightwards = np.cross(wrist, up)
        assert ("right" if shoulder @ rightwards > 0.0 else "left") == branch[0]
        # The elbow lies in the plane through the axis of joint 1, the wrist in the parallel one through the shoulder.
        line = wrist - shoulder
        above = elbow @ np.cross(np.cross(line, up), line) > 0.0
        assert ("up" if above else "down") == branch[1]
        assert ("flip" if np.sin(q[4]) > 0.0 else "noflip") == branch[2]


def test_branches_are_distinct_and_hold_the_angles_that_made_the_pose():
    q = all_inverse_kinematics(*posed(ANYWHERE))
    apart = np.abs(turned(q[:, :, None] - q[:, None])).max(axis=-1)
    assert apart[:, ~np.eye(8, dtype=bool)].min() > 1e-4
    nearest = np.abs(turned(q - ANYWHERE[:, None])).max(axis=-1).min(axis=-1)
    assert nearest.max() < 1e-9


def test_angles_inside_the_limits_are_found_as_they_are():
    limits = ROBOT.limits
    assert (TURN_MIDDLE - np.pi < limits.lower)[:5].all()
    assert (limits.upper < TURN_MIDDLE + np.pi)[:5].all()
    inside = np.random.default_rng(1).uniform(limits.lower, limits.upper, (500, 6))
    inside[:, 5] = turned(inside[:, 5])  # the range of joint 6 is more than a whole turn
    q = all_inverse_kinematics(*posed(inside))
    assert np.abs(q - inside[:, None]).max(axis=-1).min(axis=-1).max() < 1e-9


def test_table_1():
    q = inverse_kinematics(TABLE_1_POSITIONS, np.eye(3))
    np.testing.assert_array_equal(TABLE_1_JOINTS, RAJI2022["septic"]["table1"])
    np.testing.assert_allclose(q, TABLE_1_JOINTS, rtol=0.0, atol=4e-5)
    np.testing.assert_allclose(q, PUMA["ik_exact"], rtol=0.0, atol=1e-9)
    position, rotation = posed(TABLE_1_JOINTS)
    np.testing.assert_allclose(position, PUMA["fk_table1_d1_0"], rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(position, TABLE_1_POSITIONS, rtol=0.0, atol=3e-5)
    np.testing.assert_allclose(rotation, np.broadcast_to(np.eye(3), (4, 3, 3)), rtol=0.0, atol=2e-5)


def test_the_printed_height_of_the_point_to_drop_has_other_angles():
    q = all_inverse_kinematics([[0.5, -0.5, -0.3]], np.eye(3))
    assert np.abs(turned(q[0] - TABLE_1_JOINTS[2])).max(axis=-1).min() > 0.4


@pytest.mark.parametrize("bend", [0.0, 1e-13, 1e-11, 1e-9, 1e-6, np.pi - 1e-9, np.pi])
def test_wrists_whose_axes_are_in_line(bend):
    q = ANYWHERE.copy()
    q[:, 4] = bend
    position, rotation = posed(q)
    assert_all_branches_reach(position, rotation)
    if bend in (0.0, np.pi):
        found = all_inverse_kinematics(position, rotation)
        error = np.abs(turned(found - q[:, None])[:, :, :3]).max(axis=-1)
        np.testing.assert_array_equal((error < 1e-9).sum(axis=1), 2)  # both wrists of the arm that made the pose
        # Near a stretched arm the first three angles are less sharp, and the pose is that of a wrist slightly bent.
        sharp = error < 1e-13
        assert sharp.sum() > 900
        np.testing.assert_array_equal(found[sharp][:, 3], 0.0)


@pytest.mark.parametrize("off", [0.0, 1e-9, 1e-6])
@pytest.mark.parametrize("edge", ["stretched", "folded", "above the shoulder"])
def test_edges_of_the_workspace(edge, off):
    q = ANYWHERE.copy()
    lean = np.arctan2(0.4318, 0.0203)  # from the x axis of frame 3 to the line from elbow to wrist
    if edge == "above the shoulder":
        wrist = 0.4318 + np.hypot(0.4318, 0.0203) * np.exp(1j * (q[:, 2] + lean))  # in frame 1, at q2 = 0
        q[:, 1] = np.pi / 2.0 - np.angle(wrist) + off
    else:
        q[:, 2] = off - lean + (np.pi if edge == "folded" else 0.0)
    assert_all_branches_reach(*posed(q))


@pytest.mark.parametrize(
    ("point", "says"),
    [
        (NEAR, r"point 1 \(0.1, 0.1, 0.2\) m cannot be reached: it is closer than 0.15005 m to the axis of joint 1"),
        (FAR, r"point 1 \(0.5, 0.5, 0.6\) m .*: the stretched arm ends 0.877\d* m from the origin"),
        (FOLDED, r"point 1 \(0.15005, 0, 0\) m .*: the folded arm ends 0.15005\d* m from the origin"),
    ],
)
def test_unreachable_points_are_named_and_leave_the_others_alone(point, says):
    points = [TABLE_1_POSITIONS[0], point]
    with pytest.raises(UnreachableError, match=says):
        inverse_kinematics(points, np.eye(3))
    q = all_inverse_kinematics(points, np.eye(3))
    assert np.isnan(q[1]).all()
    np.testing.assert_array_equal(q[:1], all_inverse_kinematics(points[:1], np.eye(3)))


@pytest.mark.parametrize(
    ("position", "rotation", "branch", "says"),
    [
        ([0.5, 0.5, 0.1], np.eye(3), BRANCHES[0], r"position: expected shape \(K, 3\), got \(3,\)"),
        ([[0.5, np.nan, 0.1]], np.eye(3), BRANCHES[0], r"position: expected finite numbers, got nan at index \(0, 1\)"),
        ([[0.5, 0.5, 0.1]], np.eye(4), BRANCHES[0], r"rotation: expected shape \(1, 3, 3\), got \(4, 4\)"),
        ([[0.5, 0.5, 0.1]], [[1.0], [1.0, 2.0]], BRANCHES[0], r"rotation: expected numbers of shape \(1, 3, 3\)"),
        ([[0.5, 0.5, 0.1]], [["x"] * 3] * 3, BRANCHES[0], r"rotation: expected numbers of shape \(1, 3, 3\)"),
        (
            [[0.5, 0.5, 0.1]],
            2.0 * np.eye(3),
            BRANCHES[0],
            r"rotation: expected rotation matrices, got \[\[2.0.*index 0",
        ),
        ([[0.5, 0.5, 0.1]], np.diag([1.0, 1.0, -1.0]), BRANCHES[0], "rotation: expected rotation matrices"),
        ([[0.5, 0.5, 0.1]], np.eye(3), ("right", "middle", "flip"), "unknown elbow 'middle'; known: down, up"),
        (
            [[0.5, 0.5, 0.1]],
            np.eye(3),
            ("right", "up", 1),
            "unknown wrist 1: expected a name, got int; known: flip, noflip",
        ),
        ([[0.5, 0.5, 0.1]], np.eye(3), "rdn", "branch: expected three words for shoulder, elbow, wrist, got 'rdn'"),
    ],
)
def test_bad_arguments_are_refused(position, rotation, branch, says):
    with pytest.raises(TrajevoError, match=says):
        inverse_kinematics(position, rotation, branch)


def test_bad_joint_angles_are_refused():
    with pytest.raises(TrajevoError, match=r"q: expected shape \(K, 6\), got \(2, 5\)"):
        forward_kinematics(np.zeros((2, 5)))


def test_no_points_are_no_error():
    assert all_inverse_kinematics(np.zeros((0, 3)), np.zeros((0, 3, 3))).shape == (0, 8, 6)
    assert inverse_kinematics(np.zeros((0, 3)), np.eye(3)).shape == (0, 6)
