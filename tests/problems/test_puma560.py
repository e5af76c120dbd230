"""The robot PUMA 560: the published numbers, the torques they make, and the toolbox they were read from."""

import numpy as np
import pinocchio as pin
import pytest

from tests.reference import RAJI2022
from trajevo import load_robot
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.problems.puma_kinematics import TABLE_1_JOINTS, forward_kinematics

PUMA = RAJI2022["puma"]
PUBLISHED = {name: np.array(values) for name, values in PUMA["parameters"].items() if name != "source"}
GEAR = np.abs(PUBLISHED["gear_ratio_G"])
ARMATURE = GEAR**2 * PUBLISHED["motor_inertia_Jm"]
VISCOUS = GEAR**2 * PUBLISHED["viscous_B"]
#: Magnitudes of the Coulomb friction at positive and at negative velocity, (6, 2) [N·m].
COULOMB = GEAR[:, None] * np.abs(PUBLISHED["coulomb_Tc_plus_minus"])
LINK_1_INERTIA = np.array([PUBLISHED["inertia_diag_kgm2"][0, 1], 0.0, 0.0, 0.0, 0.0, 0.0])

ROBOT = load_robot("puma560")


def coulomb(v):
    """The published Coulomb friction, that of the direction of motion."""
    return np.where(v > 0.0, COULOMB[:, 0], -COULOMB[:, 1])


def random_motion(count, seed):
    rng = np.random.default_rng(seed)
    return rng.uniform(-np.pi, np.pi, (count, 6)), rng.normal(size=(count, 6)), rng.normal(scale=2.0, size=(count, 6))


def published_model():
    """The robot with the published tensors as they stand, which no URDF may hold, built joint by joint."""
    model = pin.Model()
    step = pin.SE3.Identity()
    rows = zip(
        PUBLISHED["dh_d_a_alpha"],
        PUBLISHED["mass_kg"],
        PUBLISHED["com_m"],
        PUBLISHED["inertia_diag_kgm2"],
        strict=True,
    )
    for i, ((d, a, alpha), mass, center, moments) in enumerate(rows):
        model.addJoint(i, pin.JointModelRZ(), step, f"joint_{i + 1}")
        step = pin.SE3(pin.utils.rotate("x", alpha), np.array([a, 0.0, d]))
        model.appendBodyToJoint(i + 1, pin.Inertia(mass, center, np.diag(moments)), step)
    return model


def test_robot_holds_the_published_numbers():
    friction, limits = ROBOT.friction, ROBOT.limits
    np.testing.assert_allclose(friction.viscous, VISCOUS, rtol=1e-13)
    np.testing.assert_allclose(friction.armature, ARMATURE + LINK_1_INERTIA, rtol=1e-13)
    np.testing.assert_allclose(friction.coulomb, COULOMB[:, 0], rtol=1e-11)
    np.testing.assert_allclose(friction.coulomb_backward, COULOMB[:, 1], rtol=1e-11)
    np.testing.assert_array_equal(limits.velocity, PUMA["velocity_limits_secondhand"])
    np.testing.assert_array_equal(limits.effort, PUMA["effort_limits_secondhand"])
    np.testing.assert_array_equal(ROBOT.model.effortLimit, limits.effort)


def test_position_limits_are_the_toolboxs_or_leave_1_deg_to_table_1():
    toolbox, table = PUBLISHED["joint_limits_rad"], np.array(TABLE_1_JOINTS)
    violated = table.min(axis=0) < toolbox[:, 0]
    assert violated.tolist() == [False, True, False, True, True, False]
    lower = np.where(violated, table.min(axis=0) - np.radians(1.0), toolbox[:, 0])
    np.testing.assert_allclose(ROBOT.limits.lower, lower, rtol=0.0, atol=np.radians(0.0005))
    np.testing.assert_allclose(ROBOT.limits.upper, toolbox[:, 1], rtol=0.0, atol=1e-12)
    assert (table.max(axis=0) < ROBOT.limits.upper).all()


def test_moved_inertias_change_no_torque():
    q, v, a = random_motion(200, seed=2)
    model = published_model()
    data = model.createData()
    published = [pin.rnea(model, data, *state) for state in zip(q, v, a, strict=True)]
    rigid = Dynamics(ROBOT).unloaded_effort(q, v, a) - VISCOUS * v - ARMATURE * a
    rigid -= coulomb(v)
    np.testing.assert_allclose(rigid, published, rtol=0.0, atol=1e-11)


def test_inverse_dynamics_equal_the_stored_states():
    for state in PUMA["rtb_states"]:
        q, v, a = (np.array(state[name]) for name in ("q", "qd", "qdd"))
        effort = Dynamics(ROBOT).unloaded_effort(q, v, a)
        frictionless = effort - coulomb(v)
        np.testing.assert_allclose(effort, state["full"], rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(frictionless, state["nofric"], rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(frictionless - VISCOUS * v - ARMATURE * a, state["rigid"], rtol=0.0, atol=1e-9)


@pytest.mark.parametrize(
    ("q", "name"),
    [(np.zeros(6), "gravity_qz"), ([0.0, np.pi / 4.0, np.pi, 0.0, np.pi / 4.0, 0.0], "gravity_qn")],
)
def test_gravity_torques(q, name):
    still = np.zeros(6)
    effort = Dynamics(ROBOT).unloaded_effort(np.array(q), still, still)
    np.testing.assert_allclose(effort, PUMA[name], rtol=0.0, atol=1e-8)


def test_kinematics_and_dynamics_equal_the_robotics_toolbox():
    toolbox = pytest.importorskip("roboticstoolbox").models.DH.Puma560()
    q, v, a = random_motion(50, seed=3)
    effort = Dynamics(ROBOT).unloaded_effort(q, v, a)
    np.testing.assert_allclose(effort, toolbox.rne(q, v, a), rtol=0.0, atol=1e-9)
    poses = forward_kinematics(q)
    poses[:, 2, 3] += PUMA["pedestal"]
    np.testing.assert_allclose(poses, np.array([toolbox.fkine(state).A for state in q]), rtol=0.0, atol=1e-12)
