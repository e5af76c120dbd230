"""The regressor of a payload's ten parameters: published closed forms, Pinocchio's own, and inverse dynamics."""

import numpy as np
import pinocchio as pin
import pytest

from tests.random_robots import random_urdf
from trajevo import Dynamics, Payload, load_robot
from trajevo.dynamics.payload_regressor.regressor import payload_regressor
from trajevo.dynamics.payload_regressor.wrench import wrench_regressor
from trajevo.robot.payload import PARAMETERS, entries_of

FREE = {"acceleration": np.inf, "jerk": np.inf}


def parameters_of(mass, com, inertia):
    com = np.array(com)
    about_tool = np.array(inertia) + mass * (com @ com * np.eye(3) - np.outer(com, com))
    return np.array([mass, *(mass * com), *entries_of(about_tool)])


def test_wrench_of_a_body_in_closed_form():
    phi = parameters_of(2.0, (0.05, 0.0, 0.1), np.diag([0.004, 0.005, 0.003]))
    named = dict(zip(PARAMETERS, phi, strict=True))
    np.testing.assert_allclose(
        [named[one] for one in ("m", "m cx", "m cy", "m cz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")],
        (2, 0.1, 0, 0.2, 0.024, 0, -0.01, 0.03, 0, 0.008),
        atol=1e-15,
    )
    acceleration = np.array([0.5, 0.0, 0.2]) - [0.0, 0.0, -9.81]
    wrench = wrench_regressor(acceleration, np.array([0.3, -0.2, 1.0]), np.array([1.0, 2.0, -1.0])) @ phi
    np.testing.assert_allclose(wrench, (1.356, -0.346, 19.824, 0.039, -0.8453, -0.02036), atol=1e-12)


def states(robot, rng, shape):
    return [rng.uniform(-2.0, 2.0, (*shape, robot.dof)) for _ in range(3)]


def test_it_equals_pinocchios_own_regressor():
    robot = load_robot(
        "panda", limits=FREE, tool="panda_hand_tcp", lock={"panda_finger_joint1": 0.0, "panda_finger_joint2": 0.0}
    )
    model, data = robot.model, robot.model.createData()
    rng = np.random.default_rng(4)
    q, v, a = states(robot, rng, (20,))
    phi = parameters_of(1.7, (0.03, -0.02, 0.1), [[0.02, 0.001, 0.002], [0.001, 0.03, 0.003], [0.002, 0.003, 0.025]])
    frame = model.frames[model.getFrameId(robot.tool)]
    inertia = pin.Inertia(
        1.7, np.array([0.03, -0.02, 0.1]), np.array([[0.02, 0.001, 0.002], [0.001, 0.03, 0.003], [0.002, 0.003, 0.025]])
    )
    body = frame.placement.act(inertia).toDynamicParameters()
    for k in range(20):
        whole = pin.computeJointTorqueRegressor(model, data, q[k], v[k], a[k])
        columns = whole[:, 10 * (frame.parentJoint - 1) : 10 * frame.parentJoint]
        np.testing.assert_allclose(
            payload_regressor(robot, q[k], v[k], a[k]) @ phi, columns @ body, rtol=1e-9, atol=1e-9
        )


@pytest.mark.parametrize("seed", range(12))
def test_it_equals_inverse_dynamics_of_any_robot(seed, tmp_path):
    """Also with sliding joints, couplings and other gravity; ten times the batched regressor of single states too."""
    rng = np.random.default_rng(seed)
    file = tmp_path / "robot.urdf"
    file.write_text(random_urdf(rng, 4 + seed % 4))
    robot = load_robot(file, limits=FREE, gravity=[1.0, -2.0, 9.0])
    q, v, a = states(robot, rng, (3, 5))
    found = payload_regressor(robot, q, v, a)
    payload = Payload(
        2.0, tuple(rng.uniform(-0.3, 0.3, 3)), ((0.05, 0.01, 0.0), (0.01, 0.04, 0.002), (0.0, 0.002, 0.06))
    )
    added = 2.0 * Dynamics(robot, payload).effort_per_kilogram(q, v, a)
    expected = found @ parameters_of(2.0, payload.com, payload.inertia)
    np.testing.assert_allclose(expected, added, rtol=1e-9, atol=1e-9 * np.abs(added).max())
    flat = [x.reshape(-1, robot.dof) for x in (q, v, a)]
    single = Dynamics(robot, payload).effort_per_parameter(*flat)
    np.testing.assert_allclose(found.reshape(single.shape), single, atol=1e-9 * np.abs(single).max())


def test_rows_do_not_depend_on_others_and_derivatives_pass_through():
    robot = load_robot("hybrid_manipulator")
    rng = np.random.default_rng(6)
    q, v, a = states(robot, rng, (7, 9))
    whole = payload_regressor(robot, q, v, a)
    for k in (0, 3, 6):
        np.testing.assert_array_equal(payload_regressor(robot, q[k : k + 1], v[k : k + 1], a[k : k + 1])[0], whole[k])
    step, way = 1e-30, rng.normal(size=q.shape)
    slope = payload_regressor(robot, q + 1j * step * way, v, a).imag / step
    h = 1e-6
    difference = (payload_regressor(robot, q + h * way, v, a) - payload_regressor(robot, q - h * way, v, a)) / (2 * h)
    np.testing.assert_allclose(slope, difference, atol=1e-6 * np.abs(difference).max())
