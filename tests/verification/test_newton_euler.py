"""Inverse dynamics by our own recursion: equal to Pinocchio's on every robot, and right where there is a formula."""

import dataclasses

import numpy as np
import pytest

from tests.helpers import refused
from trajevo import load_robot
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.robot.joints import Friction
from trajevo.robot.payload import Payload
from trajevo.verification.newton_euler import NewtonEuler

LIMITS = {"acceleration": 10.0, "jerk": 100.0}
KINOVA = {f"j2s6s200_joint_{k}": 0.3 * k for k in (1, 4, 5, 6)}

#: Robots, and how they are loaded.
ROBOTS = {
    "puma560": {},
    "hybrid_manipulator": {},
    "pointing_mechanism": {},
    "feed_drive": {},
    "ur5": {"tool": "tool0", "limits": LIMITS},
    "panda": {
        "tool": "panda_hand_tcp",
        "lock": {"panda_finger_joint1": 0.01, "panda_finger_joint2": 0.02},
        "limits": LIMITS,
    },
    "xarm7": {"limits": LIMITS},
    "z1": {"limits": LIMITS},
    "talos_arm": {"tool": "wrist_left_ft_tool_link", "limits": LIMITS},
    "kinova": {"tool": "j2s6s200_end_effector", "lock": KINOVA, "limits": LIMITS},
}

PAYLOADS = {
    "none": Payload(0.0),
    "rigid": Payload(3.0, (0.02, -0.05, 0.1), ((0.3, 0.01, 0.0), (0.01, 0.2, 0.02), (0.0, 0.02, 0.25))),
    "weight_only": Payload(3.0, (0.02, -0.05, 0.1), model="weight_only"),
    "tool_axis": Payload(3.0, model="tool_axis"),
}


@pytest.fixture(params=ROBOTS, scope="module")
def robot(request):
    return load_robot(request.param, **ROBOTS[request.param])


def random_states(robot, count, seed=0):
    """Positions inside the range, at most a half turn, velocities and accelerations up to 5."""
    rng = np.random.default_rng(seed)
    lower, upper = np.clip(robot.limits.lower, -np.pi, np.pi), np.clip(robot.limits.upper, -np.pi, np.pi)
    shape = (count, robot.dof)
    return rng.uniform(lower, upper, shape), rng.uniform(-5.0, 5.0, shape), rng.uniform(-5.0, 5.0, shape)


@pytest.mark.thinned(7)
@pytest.mark.parametrize("payload", PAYLOADS.values(), ids=PAYLOADS)
def test_effort_equals_pinocchios(robot, payload):
    states = random_states(robot, 2000)
    ours, pinocchio = NewtonEuler(robot, payload).effort(*states), Dynamics(robot, payload).effort(*states)
    np.testing.assert_allclose(ours, pinocchio, rtol=0.0, atol=1e-9)
    assert np.abs(ours).max() > 1.0


def test_friction_and_armature_count():
    bare = load_robot("ur5", tool="tool0", limits=LIMITS)
    rough = dataclasses.replace(bare, friction=Friction(*np.arange(1.0, 19.0).reshape(3, 6)))
    states = random_states(rough, 50)
    np.testing.assert_allclose(
        NewtonEuler(rough).effort(*states) - NewtonEuler(bare).effort(*states),
        rough.friction.effort(*states[1:]),
        rtol=0.0,
        atol=1e-9,
    )


PENDULUM = """<robot name="pendulum">
  <link name="ground"/>
  <link name="beam"><inertial><origin xyz="0 0 -0.4" rpy="0.3 0 0"/><mass value="2"/>
    <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.03"/></inertial></link>
  <link name="tip"/><link name="loose"><inertial><mass value="1"/>
    <inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial></link>
  <joint name="pivot" type="revolute"><parent link="ground"/><child link="beam"/>{axis}
    <limit lower="-3" upper="3" velocity="9" effort="99"/></joint>
  <joint name="end" type="fixed"><parent link="beam"/><child link="tip"/><origin xyz="0 0 -0.8"/></joint>
  <joint name="bolted" type="{kind}"><parent link="ground"/><child link="loose"/><origin xyz="1 0 0"/>
    <axis xyz="0 0 1"/><limit lower="-3" upper="3" velocity="9" effort="99"/></joint>
</robot>"""


def pendulum(folder, *, axis="", kind="fixed", tool="tip"):
    file = folder / "pendulum.urdf"
    file.write_text(PENDULUM.format(axis=axis, kind=kind))
    return load_robot(file, tool=tool, limits=LIMITS)


@pytest.mark.parametrize("axis", ['<axis xyz="1 0 0"/>', '<axis xyz="7 0 0"/>', ""], ids=["unit", "long", "default"])
@pytest.mark.parametrize("tool", ["tip", "end"], ids=["a link", "a joint"])
def test_a_pendulum_obeys_its_formula(tmp_path, axis, tool):
    """Its inertia about the pivot is that of the URDF, Steiner's share and the payload's at the tip."""
    robot, load = pendulum(tmp_path, axis=axis, tool=tool), 0.5
    q, v, a = random_states(robot, 100)
    inertia = 0.02 + 2.0 * 0.4**2 + load * 0.8**2
    expected = inertia * a + 9.80665 * (2.0 * 0.4 + load * 0.8) * np.sin(q)
    np.testing.assert_allclose(NewtonEuler(robot, Payload(load)).effort(q, v, a), expected, rtol=0.0, atol=1e-12)


def test_what_hangs_on_the_base_costs_no_effort(tmp_path):
    robot = pendulum(tmp_path, tool="loose")
    states = random_states(robot, 10)
    np.testing.assert_array_equal(NewtonEuler(robot, Payload(9.0)).effort(*states), NewtonEuler(robot).effort(*states))


def test_bad_input_is_refused(tmp_path):
    robot = pendulum(tmp_path)
    dynamics, two = NewtonEuler(robot), np.zeros((2, 1))
    refused(lambda: dynamics.effort(np.zeros((2, 3)), two, two), r"^q: expected shape \(N, 1\), got \(2, 3\)")
    refused(lambda: dynamics.effort(two, np.zeros((3, 1)), two), r"^v: expected shape \(2, 1\), got \(3, 1\)")
    refused(lambda: dynamics.effort(two, two, two + np.nan), r"^a: expected finite numbers")
    refused(lambda: NewtonEuler(dataclasses.replace(robot, tool="gripper")), r"unknown tool frame.*'gripper'.*beam")
    gone = dataclasses.replace(robot, urdf=tmp_path / "gone.urdf")
    refused(lambda: NewtonEuler(gone), r"gone\.urdf: no such URDF file")


def test_a_joint_that_is_neither_planned_for_nor_locked_is_refused(tmp_path):
    fixed = pendulum(tmp_path)

    loose = dataclasses.replace(fixed, urdf=pendulum(tmp_path, kind="revolute").urdf)
    refused(
        lambda: NewtonEuler(loose), r"joint 'bolted': expected a fixed or locked joint.* got one of type 'revolute'"
    )
