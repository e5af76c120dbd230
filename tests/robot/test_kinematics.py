"""The tool's kinematics in numpy against Pinocchio's and against complex steps."""

import pickle

import numpy as np
import pinocchio as pin
import pytest

from tests.helpers import refused
from trajevo import load_robot
from trajevo.robot.kinematics import ToolKinematics

LIMITS = {"acceleration": 10.0, "jerk": 100.0}
FINGERS = {"panda_finger_joint1": 0.0, "panda_finger_joint2": 0.0}
ROBOTS = {
    "ur5": {"tool": "tool0", "limits": LIMITS},
    "xarm7": {"limits": LIMITS},
    "panda": {"lock": FINGERS, "tool": "panda_hand_tcp", "limits": LIMITS},
    "puma560": {},
    "hybrid_manipulator": {},
    "pointing_mechanism": {},
}


@pytest.fixture(params=ROBOTS, scope="module")
def robot(request):
    return load_robot(request.param, **ROBOTS[request.param])


def configurations(robot, shape):
    limits = robot.limits
    return np.random.default_rng(3).uniform(limits.lower, limits.upper, (*shape, robot.dof))


def test_poses_are_pinocchios(robot):
    q = configurations(robot, (30,))
    positions, rotations = robot.tool_poses(q)
    ours = ToolKinematics.of(robot).pose(q)
    np.testing.assert_allclose(ours[0], positions, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(ours[1], rotations, rtol=0.0, atol=1e-12)


def test_jacobian_is_the_complex_step_of_the_pose(robot):
    kinematics, q, step = ToolKinematics.of(robot), configurations(robot, (5,)), 1e-30
    jacobian, rotation = kinematics.jacobian(q), kinematics.pose(q)[1]
    for joint in range(robot.dof):
        moved, turned = kinematics.pose(q + 1j * step * np.eye(robot.dof)[joint])
        np.testing.assert_allclose(jacobian[..., :3, joint], moved.imag / step, rtol=0.0, atol=1e-12)
        spin = (turned.imag / step) @ np.swapaxes(rotation, -1, -2)
        omega = np.stack([spin[..., 2, 1], spin[..., 0, 2], spin[..., 1, 0]], axis=-1)
        np.testing.assert_allclose(jacobian[..., 3:, joint], omega, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("name", ["ur5", "xarm7", "panda", "puma560"])
def test_jacobian_is_pinocchios(name):
    robot = load_robot(name, **ROBOTS[name])
    data, tool = robot.model.createData(), robot.model.getFrameId(robot.tool)
    q = configurations(robot, (4,))
    theirs = [
        pin.computeFrameJacobian(robot.model, data, row, tool, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED).copy()
        for row in q
    ]
    np.testing.assert_allclose(ToolKinematics.of(robot).jacobian(q), theirs, rtol=0.0, atol=1e-12)


def test_twist_is_the_jacobian_times_the_velocity(robot):
    kinematics = ToolKinematics.of(robot)
    q, v = configurations(robot, (2, 3)), np.random.default_rng(4).normal(size=(2, 3, robot.dof))
    expected = np.einsum("...ij,...j->...i", kinematics.jacobian(q), v)
    np.testing.assert_allclose(kinematics.twist(q, v), expected, rtol=0.0, atol=1e-12)
    stepped = kinematics.twist(q, v + 1e-30j * v)  # q stays real
    np.testing.assert_allclose(stepped.imag / 1e-30, expected, rtol=0.0, atol=1e-12)


def test_leading_axes_may_be_any(robot):
    kinematics, q = ToolKinematics.of(robot), configurations(robot, (4, 3))
    position, rotation = kinematics.pose(q)
    assert (position.shape, rotation.shape) == ((4, 3, 3), (4, 3, 3, 3))
    assert kinematics.jacobian(q).shape == (4, 3, 6, robot.dof)
    np.testing.assert_allclose(kinematics.pose(q[2, 1])[0], position[2, 1], rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(kinematics.jacobian(q[2, 1]), kinematics.jacobian(q)[2, 1], rtol=0.0, atol=1e-14)


def test_joints_beside_the_tools_chain_do_not_move_it():
    lock = {"panda_finger_joint2": 0.0}
    robot = load_robot("panda", tool="panda_hand_tcp", lock=lock, limits=LIMITS)
    q = configurations(robot, (3,))
    assert robot.dof == 8
    np.testing.assert_allclose(ToolKinematics.of(robot).pose(q)[0], robot.tool_poses(q)[0], rtol=0.0, atol=1e-12)
    assert not ToolKinematics.of(robot).jacobian(q)[..., 7:].any()


def test_it_can_be_pickled():
    kinematics, q = ToolKinematics.of(load_robot("hybrid_manipulator")), np.full(5, 0.3)
    again = pickle.loads(pickle.dumps(kinematics))
    np.testing.assert_array_equal(again.pose(q)[0], kinematics.pose(q)[0])


def test_another_number_of_joints_is_refused():
    kinematics = ToolKinematics.of(load_robot("puma560"))
    refused(lambda: kinematics.pose(np.zeros(5)), r"q: expected shape \(..., 6\), got \(5,\)")
    refused(lambda: kinematics.twist(np.zeros(6), np.zeros(7)), r"v: expected shape \(..., 6\)")


def test_squared_speed_is_that_of_the_twist(robot):
    kinematics = ToolKinematics.of(robot)
    q, v = configurations(robot, (3, 4)), np.random.default_rng(5).normal(size=(3, 4, robot.dof))
    linear = kinematics.twist(q, v)[..., :3]
    np.testing.assert_allclose(kinematics.squared_speed(q, v), (linear**2).sum(axis=-1), rtol=1e-12, atol=1e-14)
    stepped = q + 1e-30j * v
    linear = kinematics.twist(stepped, v)[..., :3]
    slope, expected = kinematics.squared_speed(stepped, v).imag, (linear**2).sum(axis=-1).imag
    np.testing.assert_allclose(slope / 1e-30, expected / 1e-30, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_axes_may_have_any_direction(seed, tmp_path):
    random, joints = np.random.default_rng(seed), []
    for k in range(4):
        kind = "prismatic" if (k + seed) % 3 == 0 else "revolute"
        axis, place, turn = (" ".join(map(str, x)) for x in random.normal(size=(3, 3)))
        joints.append(
            f'<link name="link_{k + 1}"/><joint name="joint_{k}" type="{kind}"><parent link="link_{k}"/>'
            f'<child link="link_{k + 1}"/><origin xyz="{place}" rpy="{turn}"/><axis xyz="{axis}"/>'
            '<limit lower="-2" upper="2" velocity="1" effort="1"/></joint>'
        )
    urdf = tmp_path / "robot.urdf"
    urdf.write_text(f'<robot name="any"><link name="link_0"/>{"".join(joints)}</robot>')
    robot = load_robot(urdf, tool="link_4", limits=LIMITS, allow_massless=True)
    kinematics, q, v = ToolKinematics.of(robot), configurations(robot, (5,)), random.normal(size=(5, 4))
    for ours, theirs in zip(kinematics.pose(q), robot.tool_poses(q), strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=1e-12)
    data, tool, frame = robot.model.createData(), robot.model.getFrameId("link_4"), pin.ReferenceFrame.LOCAL
    speeds = []
    for at, moving in zip(q, v, strict=True):
        pin.forwardKinematics(robot.model, data, at, moving)
        speeds.append(pin.getFrameVelocity(robot.model, data, tool, frame).linear)
    np.testing.assert_allclose(kinematics.squared_speed(q, v), np.square(speeds).sum(axis=1), rtol=1e-12)
