"""The robot in its cell: where its base stands, and tools whose masses are the robot's and no payload."""

import json

import mujoco
import numpy as np
import pytest

from tests.helpers import refused
from tests.robot.mjcf_files import ARM
from trajevo import Dynamics, Payload, Robot, ViaPointProblem, certify, load_robot, load_task, optimise, verify
from trajevo.formulation.constraints.collision import Collision
from trajevo.formulation.constraints.scene import Scene, Sphere
from trajevo.path.via_points import joint_points
from trajevo.robot.kinematics import ToolKinematics
from trajevo.robot.robot import robot_of
from trajevo.verification.newton_euler import NewtonEuler

LIMITS = {"acceleration": 10.0, "jerk": 100.0}
UR5 = {"name": "ur5", "limits": LIMITS}
BASE = {"position": ["200 mm", -0.3, 0.8], "rpy": ["180 deg", 0.1, 0.4]}
GRIPPER = {
    "name": "gripper",
    "parent": "tool0",
    "position": [0.01, 0.0, "120 mm"],
    "rpy": [0.0, "90 deg", 0.0],
    "mass": "1.3 kg",
    "com": [0.02, 0.0, "-40 mm"],
    "inertia": [0.002, 0.003, 0.001],
}
WELDER = {"name": "welder", "parent": "tool0", "mass": 4.0, "com": [0.0, 0.1, 0.2]}


def turned(rpy):
    """Rotation about the fixed axes x, y and z, by MuJoCo."""
    quat, matrix = np.empty(4), np.empty(9)
    mujoco.mju_euler2Quat(quat, np.array(rpy), "XYZ")
    mujoco.mju_quat2Mat(matrix, quat)
    return matrix.reshape(3, 3)


def states(robot, count=20):
    return np.random.default_rng(4).uniform(-2.0, 2.0, (3, count, robot.dof))


ROTATION, POSITION = turned([np.pi, 0.1, 0.4]), np.array([0.2, -0.3, 0.8])


def test_poses_are_those_of_the_cell():
    plain, placed = load_robot(**UR5, tool="tool0"), load_robot(**UR5, tool="tool0", base=BASE)
    q = states(plain)[0]
    position, rotation = plain.tool_poses(q)
    for found in (placed.tool_poses(q), ToolKinematics.of(placed).pose(q)):
        np.testing.assert_allclose(found[0], position @ ROTATION.T + POSITION, atol=1e-12)
        np.testing.assert_allclose(found[1], ROTATION @ rotation, atol=1e-12)
    goal = ROTATION @ np.array([0.4, 0.2, 0.4]) + POSITION
    found = joint_points([{"position": list(goal)}, q[0]], placed)
    np.testing.assert_allclose(placed.tool_poses(found.positions[:1])[0][0], goal, atol=1e-6)


def test_gravity_points_down_in_the_cell():
    placed = load_robot(**UR5, tool="tool0", base=BASE)
    turned_gravity = load_robot(**UR5, tool="tool0", gravity=ROTATION.T @ [0.0, 0.0, -9.80665])
    q, v, a = states(placed)
    load = Payload(3.0, com=(0.01, 0.02, 0.03))
    expected = Dynamics(turned_gravity, load).effort(q[None], v[None], a[None])
    np.testing.assert_allclose(Dynamics(placed, load).effort(q[None], v[None], a[None]), expected, atol=1e-9)
    np.testing.assert_allclose(NewtonEuler(placed, load).effort(q, v, a), expected[0], atol=1e-9)


def test_obstacles_stand_in_the_cell():
    at = ROTATION @ np.array([0.5, 0.1, 0.2]) + POSITION
    plain, placed = load_robot(**UR5, tool="tool0"), load_robot(**UR5, tool="tool0", base=BASE)
    q = states(plain, 5)[0]
    one = Collision(plain, Scene((Sphere(position=(0.5, 0.1, 0.2), radius=0.05),))).distances(q)
    other = Collision(placed, Scene((Sphere(position=tuple(at), radius=0.05),))).distances(q)
    np.testing.assert_allclose(other.min(axis=-1), one.min(axis=-1), atol=1e-6)


@pytest.mark.parametrize("make", ["dh", "planar", "mjcf"])
def test_robots_without_a_urdf_stand_in_the_cell_too(make, tmp_path):
    def arm(base):
        if make == "planar":
            return Robot.planar([1.0, 1.0], [1.0, 2.0], [0.5, 0.5], [0.1, 0.1], base=base)
        if make == "dh":
            rows = [{"a": 0.5, "alpha": 0.3, "d": 0.1}, {"a": 0.4, "alpha": 0.0, "d": 0.0}]
            return Robot.from_dh(rows, convention="standard", masses=[2.0, 1.0], coms=[[-0.2, 0, 0]] * 2, base=base)
        (tmp_path / "arm.xml").write_text(ARM)
        return load_robot(tmp_path / "arm.xml", limits=LIMITS | {"velocity": 2.0}, base=base)

    plain, placed = arm(None), arm(BASE)
    again = robot_of(json.loads(json.dumps(placed.settings)))
    q = states(plain)[0]
    for robot in (placed, again):
        expected = plain.tool_poses(q)[0] @ ROTATION.T + POSITION
        np.testing.assert_allclose(robot.tool_poses(q)[0], expected, atol=1e-12)


def test_a_tool_is_a_body_of_the_robot_and_no_payload():
    """Its effort is that of a payload with the same mass, at the frame that carries it."""
    bare = load_robot(**UR5, tool="tool0")
    robot = load_robot(**UR5, tools=[GRIPPER, WELDER], tool="gripper")
    assert robot.mass == pytest.approx(bare.mass + 1.3, rel=1e-12)
    turn, away = turned([0.0, np.pi / 2, 0.0]), np.array([0.01, 0.0, 0.12])
    com, inertia = away + turn @ [0.02, 0.0, -0.04], turn @ np.diag([0.002, 0.003, 0.001]) @ turn.T
    same = Payload(1.3, com=tuple(com), inertia=tuple(map(tuple, inertia)))
    q, v, a = states(robot)
    expected = Dynamics(bare, same).effort(q[None], v[None], a[None])
    np.testing.assert_allclose(Dynamics(robot).effort(q[None], v[None], a[None]), expected, atol=1e-9)
    np.testing.assert_allclose(NewtonEuler(robot).effort(q, v, a), expected[0], atol=1e-9)
    position, rotation = bare.tool_poses(q)
    np.testing.assert_allclose(robot.tool_poses(q)[0], position + rotation @ away, atol=1e-12)
    np.testing.assert_allclose(robot.tool_poses(q)[1], rotation @ turn, atol=1e-12)
    assert load_robot(**UR5, tools=[GRIPPER, WELDER], tool="welder").mass == pytest.approx(bare.mass + 4.0)
    assert load_robot(**UR5, tools=[GRIPPER, WELDER], tool="tool0").mass == bare.mass
    assert load_robot(**UR5, tools=[WELDER]).tool == "welder"


ROBOT_TOML = """format = 1
name = "two"
urdf = "two.urdf"
tool = "hand"
reference = "made up"
gravity = { vector = [0.0, 0.0, -9.81], unit = "m/s^2" }

[base]
position = [0.0, 0.0, "0.5 m"]

[[tools]]
name = "hand"
parent = "l2"
position = [0.1, 0.0, 0.0]
mass = "0.5 kg"
com = ["20 mm", 0.0, 0.0]

[[tools]]
name = "hook"
parent = "l2"

[joints.a]
position = { lower = -90.0, upper = 90.0, unit = "deg" }
velocity = { limit = 2.0, unit = "rad/s" }
acceleration = { limit = 20.0, unit = "rad/s^2" }
jerk = { limit = 200.0, unit = "rad/s^3" }
effort = { limit = 60.0, unit = "N*m" }
rotor_inertia = { value = 0.00005, unit = "kg*m^2" }
gear_ratio = 100
"""
URDF = """<robot name="two"><link name="base"/><link name="l2"><inertial><mass value="1"/>
<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
<joint name="a" type="revolute"><parent link="base"/><child link="l2"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" velocity="1" effort="1"/></joint></robot>"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "robot.toml").write_text(ROBOT_TOML)
    (tmp_path / "two.urdf").write_text(URDF)
    return tmp_path


def test_robot_toml_has_base_tools_and_gears(folder):
    robot = load_robot(folder)
    np.testing.assert_allclose(robot.tool_poses([[0.0]])[0][0], [0.1, 0.0, 0.5])
    assert robot.mass == 1.5
    assert load_robot(folder, tool="hook").mass == 1.0
    other = {"name": "other", "parent": "l2", "mass": 3.0}
    assert load_robot(folder, tools=[other]).mass == 4.0
    np.testing.assert_allclose(load_robot(folder, base={"position": [0, 0, 2]}).tool_poses([[0.0]])[0][0], [0.1, 0, 2])
    # The rotor, times the square of the gear ratio.
    np.testing.assert_allclose(robot.friction.armature, [0.5], rtol=1e-15)
    again = robot_of(json.loads(json.dumps(load_robot(folder, base=BASE, tools=[other]).settings)))
    assert again.mass == 4.0


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("gear_ratio = 100\n", "", "line 22: joints.a: expected armature, or rotor_inertia and gear_ratio"),
        ("gear_ratio = 100", "gear_ratio = -1", "joints.a.gear_ratio: .*greater than 0"),
        (
            '0.00005, unit = "kg*m^2"',
            '0.00005, unit = "kg"',
            "joint 'a': rotor_inertia: unit 'kg', expected one that converts to 'kg.m.2'",
        ),
        ('mass = "0.5 kg"', "mass = -0.5", "tools: 'hand': mass: expected a number from 0 on .kg., got -0.5"),
        ('parent = "l2"\nposition', 'parent = "l3"\nposition', "carries the tool 'hand' 'l3'; known: base, l2"),
        ('name = "hook"', 'name = "hand"', "tools: expected a name for each, got 'hand' 2 times"),
        ('name = "hook"', 'name = "l2"', "tools: 'l2': expected a name that no link of .*two.urdf has"),
        ("[base]\nposition", "[base]\nplace", "base.place: unknown key"),
    ],
)
def test_mistakes_in_robot_toml_are_told_with_their_place(folder, old, new, says):
    file = folder / "robot.toml"
    assert old in ROBOT_TOML
    file.write_text(ROBOT_TOML.replace(old, new, 1))
    refused(lambda: load_robot(folder), says)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"base": 1.0}, "base: expected a mapping with position and rpy, got 1.0"),
        ({"base": {"positon": [0, 0, 0]}}, "unknown key of base 'positon'.*position"),
        (
            {"base": {"position": [0, 0]}},
            r"base.position: expected three numbers \[m\], or texts with a unit, got \[0, 0\]",
        ),
        ({"base": {"rpy": [0, 0, "1 m"]}}, r"base.rpy\[2\]: .*1 m"),
        ({"base": {"rpy": [0, 0, 90]}}, r"base.rpy\[2\]: 90 rad looks like deg"),
        ({"base": {"position": [0, 0, 800.0]}}, r"base.position\[2\]: 800 m looks like mm"),
        ({"tools": "gripper"}, "tools: expected a list of mappings, got 'gripper'"),
        ({"tools": [GRIPPER, WELDER]}, "tool: expected one of the tools gripper, welder, got none"),
        ({"tools": [{"name": "g"}]}, "carries the tool 'g'"),
        ({"tools": [{"name": "g", "parent": "tool0", "com": [0, 0, 0.1]}]}, "'g': expected a mass with its com"),
        ({"tools": [{"name": "g", "parent": "tool0", "weight": 1}]}, r"unknown key of tools\[0\] 'weight'"),
        ({"tools": [GRIPPER | {"inertia": [1.0, 0.1, 0.1]}]}, "'gripper': inertia: .*triangle inequality"),
    ],
)
def test_what_cannot_be_used_is_refused(given, says):
    refused(lambda: load_robot(**UR5, **given), says)


def test_a_task_states_the_cell_and_goes_all_the_way(tmp_path):
    (tmp_path / "task.toml").write_text(
        'points = [{ position = [0.5, 0.1, 1.0] }, { position = [0.4, 0.4, 0.9] }]\nangle = "deg"\n'
        'duration_bounds = [0.3, 4.0]\nobjectives = ["time", "energy"]\npayload = 1.0\n'
        "[algorithm]\ngenerations = 4\npopulation = 12\n"
        '[constraints]\nlimits = ["position", "velocity", "acceleration", "jerk", "effort"]\n'
        "[limits]\nacceleration = 10.0\njerk = 100.0\n"
        '[robot]\nname = "ur5"\ntool = "gripper"\n'
        'base = { position = [0.0, 0.0, "1.5 m"], rpy = ["180 deg", 0.0, 0.0] }\n'
        '[[robot.tools]]\nname = "gripper"\nparent = "tool0"\nposition = [0.0, 0.0, 0.1]\nmass = 1.0\n'
        "com = [0.0, 0.0, -0.05]\n"
    )
    front = load_task(tmp_path / "task.toml").solve(progress=False)
    front.save(tmp_path / "front.json")
    start = front.pick("0").rollout.q[0, :1]
    np.testing.assert_allclose(front.problem.robot.tool_poses(start)[0][0], [0.5, 0.1, 1.0], atol=1e-6)
    assert verify(front.pick("0")).passed
    assert certify(front.pick("0")).proven


def test_a_problem_with_a_cell_is_made_again_from_its_settings():
    problem = ViaPointProblem(
        robot={**UR5, "base": BASE, "tools": [GRIPPER]},
        points=[[0.0, -1.5, 1.5, -1.5, -1.5, 0.0], [0.8, -1.2, 1.4, -1.7, -1.5, 0.0]],
        objectives=("time", "energy"),
    )
    again = ViaPointProblem(**json.loads(json.dumps(problem.settings)))
    x = np.array([[1.7]])
    np.testing.assert_array_equal(again.evaluate(x)[0], problem.evaluate(x)[0])
    assert len(optimise(again, seed=1, generations=2, population=8, progress=False, polish=False))
