"""Robots from Denavit-Hartenberg tables and from links in a plane, against the PUMA 560 and textbooks' formulas."""

import contextlib
import json
import pickle
import re

import numpy as np
import pytest

from tests.helpers import UNDRAWN, refused, trajevo
from trajevo import (
    Payload,
    Robot,
    ViaPointProblem,
    load_robot,
    load_task,
)
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.errors import TrajevoError
from trajevo.robot.examine import examine
from trajevo.robot.robot import robot_of
from trajevo.verification.newton_euler import NewtonEuler

#: a and d [m] and alpha [deg] of the PUMA 560, robots/puma560/SOURCE.md.
A, D = [0.0, 0.4318, 0.0203, 0.0, 0.0, 0.0], [0.0, 0.0, 0.15005, 0.4318, 0.0, 0.0]
ALPHA = [90.0, 0.0, -90.0, 90.0, -90.0, 0.0]
MASSES = [0.0, 17.4, 4.8, 0.82, 0.34, 0.09]
COMS = [[0, 0, 0], [-0.3638, 0.006, 0.2275], [-0.0203, -0.0141, 0.07], [0, 0.019, 0], [0, 0, 0], [0, 0, 0.032]]
INERTIAS = [
    [0, 0, 0],
    [0.126, 0.52, 0.539],
    [0.07, 0.086, 0.0165],
    [0.0018, 0.0013, 0.0018],
    [0.0003, 0.0004, 0.0003],
    [0.00015, 0.00015, 0.00004],
]
TABLE = {
    "rows": [{"a": a, "alpha": f"{alpha} deg", "d": d} for a, alpha, d in zip(A, ALPHA, D, strict=True)],
    "convention": "standard",
    "masses": MASSES,
    "coms": COMS,
    "inertias": INERTIAS,
}


def about_x(degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def craig():
    """The same arm in modified rows: frame i stands before a and alpha of row i, which go to the row after it."""
    rows = [
        {"a": a, "alpha": f"{alpha} deg", "d": d}
        for a, alpha, d in zip([0.0, *A[:-1]], [0.0, *ALPHA[:-1]], D, strict=True)
    ]
    turns = [about_x(alpha) for alpha in ALPHA]
    coms = [np.array([a, 0.0, 0.0]) + turn @ com for a, turn, com in zip(A, turns, COMS, strict=True)]
    inertias = [turn @ np.diag(inertia) @ turn.T for turn, inertia in zip(turns, INERTIAS, strict=True)]
    return {"rows": rows, "convention": "modified", "masses": MASSES, "coms": coms, "inertias": inertias}


def puma(table):
    return Robot.from_dh(**table, gravity=(0.0, 0.0, -9.81), allow_massless=True, name="puma")


@pytest.fixture(scope="module")
def states():
    return np.random.default_rng(7).uniform(-2.5, 2.5, (3, 40, 6))


@pytest.mark.parametrize("table", [TABLE, craig()], ids=["standard", "modified"])
@pytest.mark.parametrize("payload", [Payload(0.0), Payload(2.5, com=(0.0, 0.05, 0.1))], ids=["empty", "loaded"])
def test_both_conventions_are_the_puma(table, payload, states):
    made, given, (q, v, a) = puma(table), load_robot("puma560"), states
    for ours, theirs in zip(made.tool_poses(q), given.tool_poses(q), strict=True):
        assert np.abs(ours - theirs).max() < 1e-9
    rigid = Dynamics(given, payload).effort(q, v, a) - given.friction.effort(v, a)  # its motors are no part of a table
    assert np.abs(Dynamics(made, payload).effort(q, v, a) - rigid).max() < 1e-9
    assert np.abs(NewtonEuler(made, payload).effort(q, v, a) - rigid).max() < 1e-9


def step(theta, d, a, alpha):
    """Rz(theta) Tz(d) Tx(a) Rx(alpha) as printed in books, 4 x 4."""
    c, s, u, w = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
    return np.array([[c, -s * u, s * w, a * c], [s, c * u, -c * w, a * s], [0, w, u, d], [0, 0, 0, 1]])


@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_forward_kinematics_are_the_product_of_the_rows(convention):
    random = np.random.default_rng(3)
    kinds = ["revolute", "prismatic", "revolute", "prismatic", "revolute"]
    table = random.uniform(-1.5, 1.5, (5, 4))
    keys = ("theta", "d", "a", "alpha")
    rows = [{"joint": kind, **dict(zip(keys, row, strict=True))} for kind, row in zip(kinds, table, strict=True)]
    robot = Robot.from_dh(rows, convention=convention, tool={"position": [0.1, -0.2, 0.3], "rpy": [0.0, 0.0, 0.7]})
    for q in random.uniform(-2.0, 2.0, (5, 5)):
        place = np.eye(4)
        for kind, (theta, d, a, alpha), position in zip(kinds, table, q, strict=True):
            theta, d = (theta + position, d) if kind == "revolute" else (theta, d + position)
            if convention == "standard":
                place = place @ step(theta, d, a, alpha)
            else:
                place = place @ step(0.0, 0.0, a, alpha) @ step(theta, d, 0.0, 0.0)
        tool = step(0.7, 0.0, 0.0, 0.0)
        tool[:3, 3] = 0.1, -0.2, 0.3
        place = place @ tool
        positions, rotations = robot.tool_poses(q[None])
        assert np.abs(positions[0] - place[:3, 3]).max() < 1e-12
        assert np.abs(rotations[0] - place[:3, :3]).max() < 1e-12


def test_a_turning_and_a_sliding_joint_have_the_forces_of_polar_coordinates():
    rows = [{"a": 0.0, "alpha": "90 deg", "d": 0.0}, {"joint": "prismatic", "a": 0.0, "alpha": 0.0, "theta": 0.0}]
    robot = Robot.from_dh(
        rows,
        convention="standard",
        masses=[2.0, 3.0],
        coms=np.zeros((2, 3)),
        inertias=[[0.2, 0.3, 0.25], [0.0, 0.0, 0.0]],
    )
    assert robot.joint_units == ("rad", "m")
    q, v, a = np.array([[0.4, 0.7], [-1.0, 0.2]]), np.array([[1.5, -0.6], [0.3, 2.0]]), np.array([[2.0, 3.0], [-1, 1]])
    r, moment = q[:, 1], 0.3  # the axis of joint 1 is y of the frame of row 1
    torque = (moment + 3.0 * r**2) * a[:, 0] + 6.0 * r * v[:, 0] * v[:, 1]
    force = 3.0 * (a[:, 1] - r * v[:, 0] ** 2)
    assert np.abs(Dynamics(robot).effort(q, v, a) - np.stack([torque, force], axis=1)).max() < 1e-12


#: Two rods of 1 m and 1 kg with their joints at their ends, as a URDF.
RODS = """<robot name="rods"><link name="base"/>
  <link name="l1"><inertial><origin xyz="0.5 0 0"/><mass value="1"/>
    <inertia ixx="1e-6" ixy="0" ixz="0" iyy="0.0833333333333333" iyz="0" izz="0.0833333333333333"/></inertial></link>
  <link name="l2"><inertial><origin xyz="0.5 0 0"/><mass value="1"/>
    <inertia ixx="1e-6" ixy="0" ixz="0" iyy="0.0833333333333333" iyz="0" izz="0.0833333333333333"/></inertial></link>
  <link name="tip"/>
  <joint name="q1" type="revolute"><parent link="base"/><child link="l1"/><axis xyz="0 0 1"/>
    <limit lower="-6" upper="6" velocity="100" effort="1"/></joint>
  <joint name="q2" type="revolute"><parent link="l1"/><child link="l2"/><origin xyz="1 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-6" upper="6" velocity="100" effort="1"/></joint>
  <joint name="tool" type="fixed"><parent link="l2"/><child link="tip"/><origin xyz="1 0 0"/></joint></robot>"""
UPRIGHT = (0.0, -9.81, 0.0)


def two_links(lengths, masses, coms, inertias, gravity, q, v, a):
    """Torques of a planar arm of two links, Spong, Hutchinson, Vidyasagar: Robot Modeling and Control, section 7.4."""
    (l1, _), (m1, m2), (c1, c2), (i1, i2) = lengths, masses, coms, inertias
    q1, q2 = q.T
    d11 = m1 * c1**2 + m2 * (l1**2 + c2**2 + 2.0 * l1 * c2 * np.cos(q2)) + i1 + i2
    d12 = m2 * (c2**2 + l1 * c2 * np.cos(q2)) + i2
    d22 = np.full_like(q1, m2 * c2**2 + i2)
    h = -m2 * l1 * c2 * np.sin(q2)
    g1 = (m1 * c1 + m2 * l1) * gravity * np.cos(q1) + m2 * c2 * gravity * np.cos(q1 + q2)
    g2 = m2 * c2 * gravity * np.cos(q1 + q2)
    one = d11 * a[:, 0] + d12 * a[:, 1] + h * v[:, 1] * (2.0 * v[:, 0] + v[:, 1]) + g1
    return np.stack([one, d12 * a[:, 0] + d22 * a[:, 1] - h * v[:, 0] ** 2 + g2], axis=1)


@pytest.mark.parametrize("links", [([1.0, 1.0], [1.0, 1.0], [0.5, 0.5], [1 / 12, 1 / 12]), None], ids=["rods", "any"])
def test_planar_links_have_the_torques_of_the_closed_form(links):
    links = links or ([0.7, 0.4], [3.0, 1.2], [0.31, 0.25], [0.2, 0.013])
    robot = Robot.planar(*links, gravity=UPRIGHT)
    q, v, a = np.random.default_rng(5).uniform(-3.0, 3.0, (3, 50, 2))
    expected = two_links(*links, 9.81, q, v, a)
    assert np.abs(Dynamics(robot).effort(q, v, a) - expected).max() < 1e-10
    assert np.abs(NewtonEuler(robot).effort(q, v, a) - expected).max() < 1e-10
    level = Robot.planar(*links)  # gravity is along the axes
    assert np.abs(Dynamics(level).effort(q, v, a) - two_links(*links, 0.0, q, v, a)).max() < 1e-10


def test_planar_rods_are_those_of_their_urdf(tmp_path):
    (tmp_path / "rods.urdf").write_text(RODS)
    given = load_robot(tmp_path / "rods.urdf", gravity=UPRIGHT, limits={"acceleration": 10.0, "jerk": 100.0})
    made = Robot.planar([1.0, 1.0], [1.0, 1.0], [0.5, 0.5], [0.0833333333333333] * 2, gravity=UPRIGHT)
    q, v, a = np.random.default_rng(6).uniform(-3.0, 3.0, (3, 30, 2))
    payload = Payload(0.5, com=(0.1, 0.0, 0.0))
    for load in (Payload(0.0), payload):
        difference = Dynamics(made, load).effort(q, v, a) - Dynamics(given, load).effort(q, v, a)
        assert np.abs(difference).max() < 1e-12
    for ours, theirs in zip(made.tool_poses(q), given.tool_poses(q), strict=True):
        assert np.abs(ours - theirs).max() < 1e-12


LIMITS = {
    "position": [[-3, 3]] * 6,
    "velocity": 2.0,
    "acceleration": "10 rad/s^2",
    "jerk": np.full(6, 50.0),
    "effort": 200,
}


@pytest.mark.parametrize("table", [TABLE, craig()], ids=["standard", "modified"])
def test_it_is_made_again_from_its_settings(table):
    robot = Robot.from_dh(**table, limits=LIMITS, gravity=[0, 0, -9.0], allow_massless=True, name="puma")
    for again in (robot_of(json.loads(json.dumps(robot.settings))), pickle.loads(pickle.dumps(robot))):
        assert again.settings == robot.settings
        assert again.written == robot.written
        assert again.gives_effort
        np.testing.assert_array_equal(again.model.gravity.linear, [0.0, 0.0, -9.0])
        for name, values in vars(robot.limits).items():
            np.testing.assert_array_equal(getattr(again.limits, name), values)
    np.testing.assert_array_equal(robot.limits.effort, np.full(6, 200.0))


def test_great_numbers_with_units_survive_their_settings():
    rows = [{"a": "200 m", "alpha": "400 deg", "d": "-150 m", "theta": "500 deg"}]
    robot = Robot.from_dh(rows, convention="modified", masses=["2000 kg"], coms=[[1.0, 0.0, 0.0]])
    assert robot.mass == 2000.0
    again = robot_of(json.loads(json.dumps(robot.settings)))
    assert again.written == robot.written
    assert again.settings == robot.settings


@pytest.mark.parametrize("taken", ["tool", "base", "link_1", "flange"])
def test_a_joint_may_have_the_name_of_a_link(taken):
    one, other = Robot.planar([1.0], [1.0], [0.5], [0.1], names=[taken]), Robot.planar([1.0], [1.0], [0.5], [0.1])
    for ours, theirs in zip(one.tool_poses([[0.4]]), other.tool_poses([[0.4]]), strict=True):
        np.testing.assert_array_equal(ours, theirs)
    assert one.joint_names == (taken,)


def test_limits_of_a_moveit_file_go_into_the_settings(tmp_path, monkeypatch):
    text = "joint_limits:\n  hinge:\n    has_velocity_limits: true\n    max_velocity: 1.5\n"
    (tmp_path / "joint_limits.yaml").write_text(text)
    monkeypatch.chdir(tmp_path)
    robot = Robot.planar([1.0], [1.0], [0.5], [0.1], limits="joint_limits.yaml", names=["hinge"])
    assert robot.settings["limits"] == {"velocity": {"hinge": 1.5}}
    assert float(robot_of(robot.settings).limits.velocity[0]) == 1.5


def test_what_is_not_limited_is_unlimited():
    robot = Robot.planar([1.0], [1.0], [0.5], [0.1], limits={"velocity": 2.0}, names=["hinge"])
    assert robot.joint_names == ("hinge",)
    assert float(robot.limits.velocity[0]) == 2.0
    assert np.isinf([robot.limits.upper, -robot.limits.lower, robot.limits.jerk, robot.limits.effort]).all()


ROW = {"a": 0.1, "alpha": 0.0, "d": 0.0}


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"convention": "craig"}, "unknown convention 'craig'; "),
        ({"rows": []}, r"dh.rows: expected a list of at least one row, got \[\]"),
        (
            {"rows": [[0.1, 0.0, 0.0, 0.0]]},
            r"dh.rows\[0\]: expected a mapping with a, alpha, d and theta, as books differ",
        ),
        ({"rows": [ROW, {"a": 0.1, "alpha": 0.0}]}, r"dh.rows\[1\]: expected d \[m\] of a revolute joint, got none"),
        ({"rows": [ROW | {"joint": "prismatic"}]}, r"dh.rows\[0\]: expected theta \[rad\] of a prismatic joint"),
        ({"rows": [ROW | {"joint": "ball"}]}, r"unknown kind of joint in dh.rows\[0\] 'ball'"),
        ({"rows": [ROW | {"twist": 0.0}]}, r"unknown key of dh.rows\[0\] 'twist'"),
        ({"rows": [ROW | {"alpha": 90}]}, r"dh.rows\[0\].alpha: 90 rad looks like deg"),
        ({"rows": [ROW | {"a": 431.8}]}, r"dh.rows\[0\].a: 431.8 m looks like mm"),
        ({"rows": [ROW | {"a": float("nan")}]}, r"dh.rows\[0\].a: expected a finite number \[m\], got nan"),
        ({"rows": [ROW | {"a": "1 kg"}]}, r"dh.rows\[0\].a: expected a number and a unit that converts to m"),
        ({"coms": [[0, 0, 0]]}, "coms: expected masses with them, got none"),
        ({"masses": [1.0]}, "coms: expected the centres of the masses"),
        ({"masses": [1.0, 2.0], "coms": [[0, 0, 0]]}, r"masses: expected 1 numbers \[kg\], one for each row"),
        ({"masses": [-1.0], "coms": [[0, 0, 0]]}, "link 'link_1': mass: expected a number from 0 on"),
        ({"masses": [1.0], "coms": [[0, 0]]}, r"coms: expected shape \(1, 3\)"),
        (
            {"masses": [1.0], "coms": [[0, 0, 0]], "inertias": [[1, 1, 3]]},
            "link 'link_1': inertia: .*triangle inequality",
        ),
        ({"masses": [1.0], "coms": [[0, 0, 0]], "inertias": [1, 2]}, "inertias: expected 1 tensors, one for each row"),
        (
            {"masses": [1.0], "coms": [[0, 0, 0]], "inertias": [[[1, 1, 0], [0, 1, 0], [0, 0, 1]]]},
            r"inertias\[0\]: expected a symmetric tensor",
        ),
        ({"names": ["a", "b"]}, "names: expected 1 names of joints, one for each"),
        ({"tool": [0, 0, 1]}, "tool: expected a mapping with position and rpy"),
        ({"tool": {"xyz": [0, 0, 1]}}, "unknown key of tool 'xyz'"),
        ({"gravity": [0, 0, -9810]}, "gravity: .* looks like mm/s²"),
        ({"limits": {"speed": 1.0}}, "unknown limit 'speed'"),
        ({"limits": {"velocity": 0.0}}, "robot 'dh_robot': joint 'joint_1': velocity: expected a positive limit"),
        ({"allow_massless": "yes"}, "allow_massless: expected True or False"),
    ],
)
def test_a_wrong_table_is_refused(given, says):
    refused(lambda: Robot.from_dh(**{"rows": [ROW], "convention": "standard"} | given), says)


STRANGE = [None, True, 0, -1, 10**400, float("nan"), "", "1 m", [], {}, [[]], [None], [1, 2], b"x", object(), 1j]


@pytest.mark.parametrize("strange", STRANGE, ids=lambda value: repr(value)[:12])
def test_a_strange_argument_costs_a_sentence(strange):
    whole = {"rows": [ROW], "convention": "standard", "masses": [1.0], "coms": [[0, 0, 0]]}
    given = [{"rows": [ROW | {key: strange}]} for key in ("a", "alpha", "d", "theta", "joint")]
    given += [{"rows": [strange]}, {"inertias": [strange]}, {"masses": [strange]}, {"tool": {"position": strange}}]
    keys = ("rows", "convention", "masses", "coms", "inertias", "names", "tool", "limits", "gravity", "name")
    for each in (*given, *({key: strange} for key in keys)):
        with contextlib.suppress(TrajevoError):  # some of them can be used
            assert Robot.from_dh(**whole | each).dof == 1
    for place in range(4):
        links = [[1.0], [1.0], [0.5], [0.1]]
        links[place] = strange
        with contextlib.suppress(TrajevoError):
            assert Robot.planar(*links).dof == 1
    for mapping in ({"dh": strange}, {"dh": {"rows": strange, "convention": "standard"}}, {"kind": strange}):
        with pytest.raises(TrajevoError):
            robot_of(mapping)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (([1.0, -1.0], [1, 1], [0, 0], [0, 0]), "lengths: expected numbers from 0 on"),
        (([1.0], [1, 1], [0.5], [0.1]), "masses: expected 1 numbers"),
        (([1.0], [1], [0.5, 0.5], [0.1]), r"coms: expected shape \(1\)"),
        (([1.0], [1], [0.5], [-0.1]), "link 'link_1': inertia: expected a positive definite tensor"),
    ],
)
def test_wrong_links_in_a_plane_are_refused(given, says):
    refused(lambda: Robot.planar(*given), says)


def test_without_masses_there_is_no_effort():
    robot = Robot.from_dh(TABLE["rows"], convention="standard")
    assert not robot.gives_effort
    says = "needs masses, but these links have none in the model: link_1, which 'joint_1' moves.*give them masses"
    refused(lambda: Dynamics(robot).effort(*np.zeros((3, 1, 6))), says)
    assert robot.tool_poses(np.zeros((1, 6)))[0].shape == (1, 3)


def test_a_clearance_needs_a_urdf():
    scene = {"clearance": 0.01, "obstacles": [{"name": "s", "shape": "sphere", "radius": 0.1, "position": [2, 0, 0]}]}
    refused(
        lambda: ViaPointProblem(robot=puma(TABLE), points=np.zeros((3, 6)) + np.arange(3)[:, None] * 0.1, scene=scene),
        "robot 'puma': a clearance needs <collision> geometry, which only a URDF holds",
    )


DH = """
[dh]
convention = "standard"
rows = [
  { a = 0.5, alpha = 0.0, d = 0.0 },
  { a = "400 mm", alpha = "180 deg", d = 0.0, theta = "10 deg" },
  { joint = "prismatic", a = 0.0, alpha = 0.0, theta = 0.0 },
]
masses = [4.0, "2500 g", 1.0]
coms = [[-0.25, 0.0, 0.0], [-0.2, 0.0, 0.0], [0.0, 0.0, -0.1]]
inertias = [[0.01, 0.1, 0.1], [0.01, 0.05, 0.05], [0.002, 0.002, 0.0005]]
names = ["shoulder", "elbow", "lift"]
"""
JOINT = """
[joints.{name}]
position = {{ lower = -{range}, upper = {range}, unit = "{unit}" }}
velocity = {{ limit = 2.0, unit = "{unit}/s" }}
acceleration = {{ limit = 10.0, unit = "{unit}/s^2" }}
jerk = {{ limit = 100.0, unit = "{unit}/s^3" }}
effort = {{ limit = 90.0, unit = "{effort}" }}
viscous_friction = {{ value = 0.5, unit = "{effort}*s/{unit}" }}
"""
HEAD = """format = 1
name = "scara"
tool = "tool"
reference = "a test"
gravity = { vector = [0.0, 0.0, -9.81], unit = "m/s^2" }
"""
JOINTS = "".join(
    JOINT.format(name=name, range=at, unit=unit, effort="N" if unit == "m" else "N*m")
    for name, at, unit in (("shoulder", 2.5, "rad"), ("elbow", 2.5, "rad"), ("lift", 0.4, "m"))
)
TASK = """
robot = "scara"
points = [[0.0, 0.3, 0.0], [0.8, -0.5, 0.2], { position = [0.2, 0.75, -0.1] }]
duration_bounds = [0.2, 4.0]
objectives = ["time", "energy"]
payload = 1.0
[algorithm]
generations = 3
population = 12
polish = false
"""


@pytest.fixture(scope="module")
def scara(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dh")
    (folder / "scara").mkdir()
    (folder / "scara/robot.toml").write_text(HEAD + DH + JOINTS)
    (folder / "task.toml").write_text(TASK.replace('"scara"', '"./scara"'))
    solved = trajevo("solve", "task.toml", *UNDRAWN, cwd=folder)
    assert solved.returncode == 0, solved.stderr
    return folder


def test_a_table_in_robot_toml_is_a_robot(scara):
    robot = load_robot(scara / "scara")
    assert robot.joint_names == ("shoulder", "elbow", "lift")
    assert robot.joint_units == ("rad", "rad", "m")
    np.testing.assert_array_equal(robot.friction.viscous, [0.5, 0.5, 0.5])
    np.testing.assert_array_equal(robot.limits.upper, [2.5, 2.5, 0.4])
    assert robot.mass == 7.5
    place = robot.tool_poses(np.array([[0.3, 0.2, 0.1]]))[0][0]
    far = 0.3 + 0.2 + np.radians(10.0)
    expected = [0.5 * np.cos(0.3) + 0.4 * np.cos(far), 0.5 * np.sin(0.3) + 0.4 * np.sin(far), -0.1]
    np.testing.assert_allclose(place, expected, atol=1e-12)
    held = Dynamics(robot).effort(*np.zeros((3, 1, 3)))[0]
    np.testing.assert_allclose(held, [0.0, 0.0, -9.81], atol=1e-12)
    again = robot_of(robot.settings)
    assert again.written == robot.written
    locked = load_robot(scara / "scara", lock={"lift": 0.1})
    assert locked.joint_names == ("shoulder", "elbow")
    q, v, a = np.random.default_rng(2).uniform(-1.0, 1.0, (3, 5, 2))
    assert np.abs(NewtonEuler(locked).effort(q, v, a) - Dynamics(locked).effort(q, v, a)).max() < 1e-10


def test_a_table_in_robot_toml_is_checked(scara):
    found = examine(scara / "scara")
    assert found.errors == ()
    assert found.warnings == ()
    assert [(row.name, row.type, row.upper) for row in found.joints] == [
        ("shoulder", "revolute", 2.5),
        ("elbow", "revolute", 2.5),
        ("lift", "prismatic", 0.4),
    ]
    shown = trajevo("check-robot", "scara", cwd=scara)
    assert shown.returncode == 0
    assert "elbow" in shown.stdout


def test_a_robot_of_a_table_goes_all_the_way(scara):
    for command in (
        ("check", "task.toml"),
        ("show", "runs/task"),
        ("certify", "runs/task"),
        ("capacity", "runs/task"),
        ("verify", "runs/task"),
        ("report", "runs/task", "--no-pictures"),
        ("animate", "runs/task", "--out", "arm.html"),
        ("export", "runs/task", "--format", "mujoco", "--out", "replay.csv"),
        ("resume", "runs/task", "--generations", "5", *UNDRAWN),
    ):
        done = trajevo(*command, cwd=scara)
        assert done.returncode == 0, (command, done.stdout[-500:], done.stderr)
        assert "Traceback" not in done.stderr


def test_a_table_in_a_task_is_the_robot(tmp_path):
    table = DH.replace("[dh]", "[robot.dh]")
    limits = "[limits]\nposition = [[-2.5, 2.5], [-2.5, 2.5], [-0.4, 0.4]]\n"
    limits += "velocity = 2.0\nacceleration = 10.0\njerk = 90.0\n"
    rest = TASK.replace('robot = "scara"\n', "").replace("[algorithm]", limits + "effort = 90.0\n[algorithm]")
    (tmp_path / "task.toml").write_text(rest + '[robot]\nname = "scara"\n' + table)
    problem = load_task(tmp_path / "task.toml").problem
    assert problem.robot.name == "scara"
    again = type(problem)(**json.loads(json.dumps(problem.settings)))
    assert again.settings == problem.settings
    assert again.robot.written == problem.robot.written


@pytest.mark.parametrize(
    ("before", "after", "says"),
    [
        ('convention = "standard"', "", "dh.convention: this key is missing"),
        ('convention = "standard"', 'convention = "craig"', "dh.convention: "),
        ("a = 0.5, ", "", "a: this key is missing"),
        ("d = 0.0 }", "r = 0.0 }", "r: unknown key"),
        ("alpha = 0.0, d", "alpha = 90.0, d", "dh: rows[0].alpha: 90 rad looks like deg"),
        ("[-0.25, 0.0, 0.0]", "[-0.25, 0.0]", "coms"),
        ("masses = [4.0", "masses = [-4.0", "link 'link_1': mass: expected a number from 0 on"),
        ('names = ["shoulder"', 'names = ["base"', "joint"),
        ("[0.01, 0.1, 0.1]", "[0.01, 0.1, 0.3]", "triangle inequality"),
        ('tool = "tool"', 'tool = "tool"\nurdf = "x.urdf"', "urdf: expected either the name of a URDF or a table"),
        (DH, "", "urdf: this key is missing"),
    ],
)
def test_a_mistake_in_the_file_is_told(tmp_path, before, after, says):
    text = HEAD + DH + JOINTS
    assert before in text
    (tmp_path / "robot.toml").write_text(text.replace(before, after, 1))
    with pytest.raises(ValueError, match=re.escape(says)):
        load_robot(tmp_path)
    assert any(says in error for error in examine(tmp_path).errors), examine(tmp_path).errors
    shown = trajevo("check-robot", tmp_path)
    assert shown.returncode == 1
    assert "Traceback" not in shown.stderr
