"""Joint positions for poses: met, inside the limits, near the point before, or refused with what is missed."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.helpers import mostly_long, refused
from tests.reference import posture_by_scipy
from tests.robot.test_kinematics import ROBOTS
from trajevo import load_robot
from trajevo.errors import UnreachableError
from trajevo.path.inverse_kinematics import Pose, inverse_kinematics
from trajevo.path.levenberg_marquardt import JointRanges
from trajevo.path.via_points import joint_points
from trajevo.robot.kinematics import ToolKinematics


def poses_of(robot, count=3, seed=1):
    """Joint positions inside the limits, and the poses they give."""
    q = np.random.default_rng(seed).uniform(robot.limits.lower, robot.limits.upper, (count, robot.dof))
    return q, [Pose(position, rotation) for position, rotation in zip(*robot.tool_poses(q), strict=True)]


ARMS = ("ur5", "xarm7", "panda", "puma560", "hybrid_manipulator")


@pytest.fixture(params=mostly_long(ARMS, "ur5", "hybrid_manipulator"), scope="module")
def robot(request):
    return load_robot(request.param, **ROBOTS[request.param])


def test_poses_within_reach_are_met_inside_the_limits(robot):
    _, poses = poses_of(robot)
    q = inverse_kinematics(robot, poses, starts=12)
    positions, rotations = robot.tool_poses(q)
    np.testing.assert_allclose(positions, [pose.position for pose in poses], rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(rotations, [pose.rotation for pose in poses], rtol=0.0, atol=2e-6)
    assert (q >= robot.limits.lower).all()
    assert (q <= robot.limits.upper).all()
    assert not q.flags.writeable


def test_a_start_at_a_solution_is_kept(robot):
    q, poses = poses_of(robot, 1)
    np.testing.assert_allclose(inverse_kinematics(robot, poses, start=q[0], starts=3)[0], q[0], rtol=0.0, atol=1e-6)


def test_neighbouring_poses_have_neighbouring_joints():
    robot = load_robot("ur5", **ROBOTS["ur5"])
    start = np.array([0.3, -1.2, 1.4, -1.0, -1.4, 0.2])
    position, rotation = (values[0] for values in robot.tool_poses(start[None]))
    poses = [Pose(position + np.array([0.0, 0.02 * i, 0.0]), rotation) for i in range(5)]
    q = inverse_kinematics(robot, poses, start=start, starts=6)
    assert np.abs(np.diff(q, axis=0)).max() < 0.15
    np.testing.assert_allclose(q[0], start, rtol=0.0, atol=1e-6)


@pytest.mark.thinned(2)
@pytest.mark.parametrize("count", mostly_long([3, 8], 3))
def test_no_solution_known_is_nearer(robot, count):
    """Neither what the pose was made from nor what SciPy finds from a few starts."""
    (before, far), _ = poses_of(robot, 2, seed=4)
    generator, limits = np.random.default_rng(6), robot.limits
    beside = np.clip(before + 0.3 * generator.normal(size=robot.dof), limits.lower, limits.upper)
    ranges = JointRanges.of(robot, ToolKinematics.of(robot))
    for aim in (far, beside):
        pose = Pose(*(values[0] for values in robot.tool_poses(aim[None])))
        starts = [before, *generator.uniform(limits.lower, limits.upper, (count, robot.dof))]
        tries = [posture_by_scipy(robot, pose.position, pose.rotation, start) for start in starts]
        theirs = ranges.unwound(np.array([aim, *(q for q in tries if q is not None)]), before)
        ours = inverse_kinematics(robot, [pose], start=before)[0]
        assert np.abs(ours - before).max() <= 1.01 * np.abs(theirs - before).max(axis=1).min() + 1e-6


@pytest.mark.parametrize("turn", [-1.0, 1.0])
def test_whole_turns_count_for_nearness(turn):
    robot = load_robot("ur5", **ROBOTS["ur5"])
    q = np.array([[0.5 * turn, -1.2, 1.4, -1.0, -1.4, 0.2]])
    pose = Pose(*(values[0] for values in robot.tool_poses(q)))
    wound = q[0] + 2.0 * np.pi * np.array([-turn, 0.0, 0.0, 1.0, 0.0, -1.0])
    np.testing.assert_allclose(inverse_kinematics(robot, [pose], start=wound, starts=0)[0], wound, atol=1e-6)
    outside = q[0] + 2.0 * np.pi * np.array([turn, 0.0, 0.0, 0.0, 0.0, 0.0])  # beyond the end of the range
    kept = inverse_kinematics(robot, [pose], start=outside, starts=0)[0]
    assert (np.abs(kept) <= robot.limits.upper).all()


def test_position_alone_leaves_the_orientation_open():
    robot = load_robot("pointing_mechanism")
    position = robot.tool_poses(np.array([[0.4, -0.3]]))[0][0]
    q = inverse_kinematics(robot, [{"position": position}], starts=4)
    np.testing.assert_allclose(robot.tool_poses(q)[0][0], position, rtol=0.0, atol=1e-6)


def test_what_cannot_be_reached_is_named_with_what_is_missed():
    robot = load_robot("ur5", **ROBOTS["ur5"])
    good = {"position": [0.4, 0.1, 0.3]}
    far = {"position": [2.0, 0.0, 0.089], "name": "shelf"}
    with pytest.raises(UnreachableError, match=r"point 1 'shelf': expected a pose that 'ur5' .* misses it by (\S+) mm"):
        inverse_kinematics(robot, [good, far], starts=2)
    tilted = far | {"rpy": [0.0, 0.5, 0.0]}
    refused(lambda: inverse_kinematics(robot, [tilted], starts=2), r"point 0 'shelf': .* mm and \S+ deg")


def test_the_miss_is_the_distance_to_the_reach():
    robot = load_robot("pointing_mechanism")
    points = robot.tool_poses(np.array([[0.1, 0.2]]))[0][0]
    with pytest.raises(UnreachableError) as caught:
        inverse_kinematics(robot, [{"position": 3.0 * points}], starts=4)
    q = np.stack(np.meshgrid(*(np.linspace(-1.0, 1.2, 200),) * 2), axis=-1).reshape(-1, 2)
    sampled = np.linalg.norm(robot.tool_poses(q)[0] - 3.0 * points, axis=1).min()
    missed = float(str(caught.value).split("misses it by ")[1].split(" mm")[0])
    assert missed == pytest.approx(1e3 * sampled, rel=1e-3)


def test_a_seed_gives_the_same_joints():
    robot = load_robot("xarm7", **ROBOTS["xarm7"])
    _, poses = poses_of(robot, 2)
    first, again = (inverse_kinematics(robot, poses, seed=5, starts=3) for _ in range(2))
    np.testing.assert_array_equal(first, again)


def test_via_points_come_from_poses():
    robot = load_robot("puma560")
    _, poses = poses_of(robot, 2)
    points = joint_points(poses, robot)
    np.testing.assert_allclose(robot.tool_poses(points.positions)[0], [pose.position for pose in poses], atol=1e-6)
    refused(lambda: joint_points([poses[0], poses[0]], robot), "point 1 repeats point 0")


def test_orientations_are_read_as_a_urdf_writes_them():
    rpy = np.array([0.1, -0.4, 2.0])
    expected = Rotation.from_euler("ZYX", rpy[::-1])
    pose = Pose.of({"position": [1, 2, 3], "rpy": rpy})
    np.testing.assert_allclose(pose.rotation, expected.as_matrix(), atol=1e-15)
    same = Pose.of({"position": [1, 2, 3], "quaternion": expected.as_quat()})
    np.testing.assert_allclose(same.rotation, pose.rotation, atol=1e-15)
    assert Pose.of({"position": [1, 2, 3]}).rotation is None
    assert Pose.of(pose) is pose


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"rpy": [0, 0, 0]}, "expected a 'position'"),
        ({"position": [0, 0]}, r"position: expected shape \(3\)"),
        ({"position": [0, 0, np.nan]}, "position: expected finite numbers"),
        ({"position": [0, 0, 0], "rpy": [0, 0]}, "rpy: expected shape"),
        ({"position": [0, 0, 0], "quaternion": [0, 0, 0, 0]}, "quaternion: expected .* norm 1"),
        ({"position": [0, 0, 0], "rpy": [0, 0, 0], "quaternion": [0, 0, 0, 1]}, "got both"),
        ({"position": [0, 0, 0], "euler": [0, 0, 0]}, "unknown key of a pose 'euler'; known: free, name, position"),
        ([0, 0, 0], "expected a Pose or a mapping"),
    ],
)
def test_bad_poses_are_refused(given, says):
    refused(lambda: Pose.of(given), says)


def test_what_is_no_rotation_is_refused():
    refused(lambda: Pose(np.zeros(3), np.diag([1.0, 1.0, -1.0])), "expected a rotation matrix")
    refused(lambda: Pose(np.zeros(3), 2.0 * np.eye(3)), "expected a rotation matrix")


@pytest.mark.parametrize(
    ("poses", "options", "says"),
    [
        ([], {}, "poses: expected a sequence of at least 1 pose"),
        ({"position": [0, 0, 0]}, {}, "poses: expected a sequence"),
        ([{"position": [0, 0, 0]}], {"starts": -1}, "starts: expected a whole number"),
        ([{"position": [0, 0, 0]}], {"seed": 0.5}, "seed: expected a whole number"),
        ([{"position": [0, 0, 0]}], {"tolerance": 0.0}, "tolerance: expected a positive number"),
        ([{"position": [0, 0, 0]}], {"start": [0.0]}, r"start: expected shape \(2\)"),
    ],
)
def test_bad_arguments_are_refused(poses, options, says):
    robot = load_robot("pointing_mechanism")
    refused(lambda: inverse_kinematics(robot, poses, **options), says)


@pytest.mark.thinned(2)
def test_a_free_axis_leaves_the_turn_about_it_open(robot):
    """Position and axis are met, and the next posture is no further away than with the turn prescribed."""
    q, poses = poses_of(robot)
    free = [Pose(pose.position, pose.rotation, free="z") for pose in poses]
    found = inverse_kinematics(robot, free, start=q[0], starts=12)
    positions, rotations = robot.tool_poses(found)
    np.testing.assert_allclose(positions, [pose.position for pose in poses], rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(rotations[:, :, 2], [pose.rotation[:, 2] for pose in poses], rtol=0.0, atol=2e-6)
    fixed = inverse_kinematics(robot, poses, start=q[0], starts=12)
    first, others = np.abs(found[0] - q[0]).max(), np.abs(fixed[0] - q[0]).max()
    assert first <= 1.02 * others + 1e-6


def test_a_robot_of_five_joints_takes_poses_with_a_free_axis():
    locked = load_robot(**{"name": "ur5"} | ROBOTS["ur5"], lock={"wrist_3_joint": 0.3})
    wanted = {"position": [0.4, -0.2, 0.3], "rpy": [np.pi, 0.0, 1.1]}
    refused(lambda: inverse_kinematics(locked, [wanted]), "point 0: expected a pose that 'ur5' reaches")
    q = inverse_kinematics(locked, [wanted | {"free": "z"}])
    position, rotation = locked.tool_poses(q)
    np.testing.assert_allclose(position[0], wanted["position"], atol=1e-6)
    np.testing.assert_allclose(rotation[0, :, 2], [0.0, 0.0, -1.0], atol=1e-6)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"rpy": [0, 0, 0], "free": "w"}, "unknown free axis of a pose 'w'; known: x, y, z"),
        ({"free": "z"}, "free: expected an orientation with it"),
    ],
)
def test_a_free_axis_that_cannot_be_is_refused(given, says):
    robot = load_robot("ur5", **ROBOTS["ur5"])
    refused(lambda: inverse_kinematics(robot, [{"position": [0.4, 0.0, 0.3], **given}]), says)
