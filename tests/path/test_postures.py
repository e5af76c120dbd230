"""Postures for many poses: met inside the limits, all branches of known arms, neighbours, the same from any seed."""

import numpy as np
import pytest

from tests.helpers import mostly_long, refused
from tests.robot.test_kinematics import LIMITS, ROBOTS
from trajevo import load_robot
from trajevo.path.levenberg_marquardt import TOLERANCE, JointRanges, PostureSolver
from trajevo.path.postures import find_postures
from trajevo.problems.puma_kinematics import all_inverse_kinematics
from trajevo.robot.kinematics import ToolKinematics

ELBOW_UP = np.array([0.3, -1.2, 1.4, -1.7, -1.4, 0.2])


def ur5():
    return load_robot("ur5", **ROBOTS["ur5"])


def solved(robot, positions, rotation, starts):
    """Where starts lead, and which of them meet their pose."""
    kinematics = ToolKinematics.of(robot)
    q, error = PostureSolver(kinematics, JointRanges.of(robot, kinematics), rotation)(positions, np.array(starts))
    return q, error <= TOLERANCE


def turned(q):
    """Angles brought to between -π and π."""
    return np.mod(q + np.pi, 2.0 * np.pi) - np.pi


def line(count=6, step=0.03):
    """Positions of the UR5's tool along a line, from where one posture puts it, and its orientation."""
    position, rotation = (values[0] for values in ur5().tool_poses(ELBOW_UP[None]))
    return position + step * np.arange(count)[:, None] * np.array([0.0, 1.0, 0.0]), rotation


def beside(count):
    """Neighbours along a line."""
    numbers = np.arange(count)
    return np.stack([numbers - 1, np.where(numbers + 1 < count, numbers + 1, -1)], axis=1)


@pytest.mark.thinned(3)
@pytest.mark.parametrize("name", ["ur5", "xarm7", "panda", "puma560", "hybrid_manipulator"])
@pytest.mark.parametrize("oriented", [True, False])
def test_solutions_meet_the_pose_inside_the_limits(name, oriented):
    robot = load_robot(name, **ROBOTS[name])
    generator = np.random.default_rng(2)
    limits = robot.limits
    aim = generator.uniform(limits.lower, limits.upper)
    position, rotation = (values[0] for values in robot.tool_poses(aim[None]))
    starts = generator.uniform(limits.lower - 0.5, limits.upper + 0.5, (200, robot.dof))
    q, met = solved(robot, np.tile(position, (200, 1)), rotation if oriented else None, starts)
    assert met.sum() >= 20
    assert (q >= limits.lower).all()
    assert (q <= limits.upper).all()
    positions, rotations = robot.tool_poses(q)
    near = np.linalg.norm(positions - position, axis=1) <= 1e-6
    if oriented:
        near &= np.linalg.norm((rotations - rotation).reshape(-1, 9), axis=1) / np.sqrt(2.0) <= 1e-6
    np.testing.assert_array_equal(near, met)


def test_every_start_is_on_its_own():
    robot = ur5()
    positions, rotation = line()
    starts = np.random.default_rng(3).uniform(-2.0, 2.0, (6, 6))
    together, met = solved(robot, positions, rotation, starts)
    for k in range(6):
        alone, alone_met = solved(robot, positions[k : k + 1], rotation, starts[k : k + 1])
        assert alone_met[0] == met[k]
        if met[k]:
            np.testing.assert_allclose(alone[0], together[k], rtol=0.0, atol=1e-8)


def test_a_start_at_a_solution_stays():
    positions, rotation = line(1)
    q, met = solved(ur5(), positions, rotation, [ELBOW_UP])
    assert met.all()
    np.testing.assert_allclose(q[0], ELBOW_UP, rtol=0.0, atol=1e-12)


def test_a_solution_at_a_limit_is_found():
    """The elbow begins beyond its limit, which is where the pose needs it; the others bring the tool there."""
    limits = LIMITS | {"position": {"elbow_joint": [-3.0, ELBOW_UP[2]]}}
    robot = load_robot("ur5", tool="tool0", limits=limits)
    position, rotation = robot.tool_poses(ELBOW_UP[None])
    q, met = solved(robot, position, rotation[0], [ELBOW_UP + np.array([0.1, 0.1, 0.4, -0.1, 0.1, -0.1])])
    assert met.all()
    np.testing.assert_allclose(q[0], ELBOW_UP, rtol=0.0, atol=1e-6)
    assert q[0, 2] <= robot.limits.upper[2]


def test_joints_without_limits_are_searched_for_a_turn():
    robot = load_robot("ur5", tool="tool0", limits=LIMITS | {"position": [-np.inf, np.inf]})
    positions, rotation = line(1)
    found = find_postures(robot, positions, rotation)
    assert len(found.q) == 8
    np.testing.assert_allclose(robot.tool_poses(found.q)[0], np.tile(positions, (8, 1)), atol=1e-6)


@pytest.mark.parametrize("count", mostly_long([4, 8], 4))
def test_all_branches_of_the_puma_that_its_limits_leave(count):
    """Against the closed form of Raji 2022."""
    robot = load_robot("puma560")
    limits = robot.limits
    q = np.random.default_rng(4).uniform(limits.lower, limits.upper, (count, 6))
    counts = []
    for position, rotation in zip(*robot.tool_poses(q), strict=True):
        branches = all_inverse_kinematics(position[None], rotation[None])[0]
        windings = branches + 2.0 * np.pi * np.arange(-2, 3)[:, None, None]
        inside = (limits.lower <= windings) & (windings <= limits.upper)
        expected = branches[inside.any(axis=0).all(axis=-1)]
        found = find_postures(robot, position[None], rotation)
        apart = np.abs(turned(found.q[:, None] - expected)).max(axis=-1)
        assert len(found.q) == len(expected)
        assert apart.min(axis=0).max() < 1e-6
        counts.append(len(expected))
    assert len(set(counts)) > 1


def test_neighbours_pass_their_postures_on():
    """Of few starts each: what one pose on a line has, the others get, and each is near one of the pose before."""
    positions, rotation = line()
    alone = find_postures(ur5(), positions, rotation, starts=4)
    both = find_postures(ur5(), positions, rotation, starts=4, neighbours=beside(6))
    assert len(alone.q) < len(both.q)
    counts = np.bincount(both.pose, minlength=6)
    assert (counts >= np.bincount(alone.pose, minlength=6)).all()
    for k in range(1, 6):
        here, before = both.q[both.pose == k], both.q[both.pose == k - 1]
        assert len(here) <= len(before)  # the line leaves the reach of some branches
        assert np.abs(turned(here[:, None] - before)).max(axis=-1).min(axis=1).max() < 0.5


@pytest.mark.parametrize("count", mostly_long([2, 3], 2))
def test_the_seed_makes_no_difference_without_redundancy(count):
    positions, rotation = line(count)
    found = [find_postures(ur5(), positions, rotation, seed=seed, neighbours=beside(count)) for seed in range(count)]
    assert set(np.bincount(found[0].pose).tolist()) <= {2, 4, 6, 8}
    for other in found[1:]:
        np.testing.assert_array_equal(other.pose, found[0].pose)
        for k in range(count):
            here, there = found[0].q[found[0].pose == k], other.q[other.pose == k]
            assert np.abs(turned(here[:, None] - there)).max(axis=-1).min(axis=1).max() < 1e-8


def test_postures_are_told_apart_and_given_by_the_nearest_turn():
    positions, rotation = line(1)
    wound = ELBOW_UP + 2.0 * np.pi * np.array([0.0, 1.0, 0.0, 0.0, 1.0, -1.0])
    found = find_postures(ur5(), positions, rotation, start=wound)
    assert len(found.q) == 8
    apart = np.abs(turned(found.q[:, None] - found.q)).max(axis=-1)
    assert apart[~np.eye(8, dtype=bool)].min() > 0.05
    assert np.abs(found.q - wound).max(axis=1).min() < 1e-8


def test_a_redundant_arm_is_searched_where_it_is_worth_more():
    robot = load_robot("panda", **ROBOTS["panda"])
    position, down = np.array([[0.5, 0.1, 0.4]]), np.diag([1.0, -1.0, -1.0])

    def straightness(q):
        return -np.abs(q[:, 2])

    found = find_postures(robot, position, down, worth=straightness, starts=4)
    blind = find_postures(robot, position, down, starts=4)
    np.testing.assert_array_equal(found.worth, straightness(found.q))
    assert (blind.worth == 0.0).all()
    assert found.worth.max() > -0.05
    assert found.worth.max() > straightness(blind.q).max()
    positions, rotations = robot.tool_poses(found.q)
    np.testing.assert_allclose(positions, np.tile(position, (len(found.q), 1)), atol=1e-6)
    np.testing.assert_allclose(rotations, np.tile(down, (len(found.q), 1, 1)), atol=2e-6)


def test_poses_out_of_reach_have_no_postures():
    positions, rotation = line(2)
    positions[1] += 3.0
    found = find_postures(ur5(), positions, rotation, neighbours=beside(2))
    assert set(found.pose.tolist()) == {0}
    nothing = find_postures(ur5(), positions[1:], rotation)
    assert nothing.q.shape == (0, 6)
    assert nothing.pose.shape == nothing.worth.shape == (0,)
    assert not nothing.pose.flags.writeable
    assert len(find_postures(ur5(), np.zeros((0, 3)), rotation).q) == 0


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: find_postures(ur5(), [[np.nan] * 3], None), "positions: expected finite numbers"),
        (lambda: find_postures(ur5(), [[0.0] * 3], np.eye(2)), r"rotation: expected shape \(3, 3\)"),
        (lambda: find_postures(ur5(), [[0.0] * 3], 2.0 * np.eye(3)), "rotation: expected a rotation matrix"),
        (lambda: find_postures(ur5(), [[0.0] * 3], None, start=[0.0]), r"start: expected shape \(6\)"),
        (lambda: find_postures(ur5(), [[0.0] * 3], None, seed=-1), "seed: expected a whole number"),
        (lambda: find_postures(ur5(), [[0.0] * 3], None, starts=1.5), "starts: expected a whole number"),
        (lambda: find_postures(ur5(), [[0.0] * 3], None, neighbours=[0]), r"whole numbers of shape \(1, K\)"),
        (lambda: find_postures(ur5(), [[0.0] * 3], None, neighbours=[[1]]), "numbers from -1 to 0, got 1 to 1"),
        (lambda: find_postures(ur5(), [[0.0] * 3] * 2, None, neighbours=[[0], [0, 1]]), "neighbours: expected whole"),
        (lambda: find_postures(ur5(), line(1)[0], None, worth=lambda q: q), "worth: expected one number per posture"),
        (lambda: find_postures(ur5(), line(1)[0], None, worth=lambda q: q[:, 0] * np.nan), "worth: expected one num"),
    ],
)
def test_bad_input_is_refused(call, says):
    refused(call, says)
