"""Robots of MJCF files: efforts, places and distances are MuJoCo's, and what cannot be planned for is refused."""

import json

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from tests.helpers import refused
from tests.robot.mjcf_files import ARM, Mujoco
from trajevo import Dynamics, load_robot
from trajevo.base.files import opening_robots_only
from trajevo.formulation.constraints.collision import Collision
from trajevo.formulation.constraints.scene import Scene, Sphere
from trajevo.robot.examine import examine
from trajevo.robot.robot import robot_of
from trajevo.verification.newton_euler import NewtonEuler

LIMITS = {"velocity": 2.0, "acceleration": 5.0, "jerk": 50.0}


@pytest.fixture
def write(tmp_path):
    def write(*changes, text=ARM, name="arm.xml"):
        for old, new in changes:
            assert old in text, old
            text = text.replace(old, new)
        (tmp_path / name).write_text(text, encoding="utf-8")
        return tmp_path / name

    return write


def states(robot, count=30):
    return np.random.default_rng(2).uniform(-1.5, 1.5, (3, count, robot.dof))


def rigid(robot, q, v, a):
    """Efforts without dry friction."""
    return Dynamics(robot).effort(q[None], v[None], a[None])[0] - robot.friction.dry(v)


@pytest.mark.parametrize("lock", [None, {"elbow": 0.4}, {"my joint": -0.3, "slide": 0.12}])
def test_efforts_are_those_of_mj_inverse(write, lock):
    robot = load_robot(write(), limits=LIMITS, lock=lock)
    q, v, a = states(robot)
    expected = Mujoco(ARM).effort(robot, q, v, a)
    assert abs(expected).max() > 5.0
    np.testing.assert_allclose(rigid(robot, q, v, a), expected, rtol=0.0, atol=1e-9)
    own = NewtonEuler(robot).effort(q, v, a) - robot.friction.dry(v)
    np.testing.assert_allclose(own, expected, rtol=0.0, atol=1e-9)


def test_a_site_can_be_the_tool_and_lies_where_mujoco_has_it(write):
    robot = load_robot(write(), limits=LIMITS)
    assert robot.tool == "tcp"
    q = states(robot)[0]
    for found, expected in zip(robot.tool_poses(q), Mujoco(ARM).site(robot, q, "tcp"), strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-12)


def test_pinocchio_s_own_reader_agrees(write):
    """It leaves out frames, gravity and the reference of a slide, and turns about three axes in another order."""
    file = write(
        ('<geom type="mesh" mesh="nowhere" contype="0" conaffinity="0"/>', ""),
        ('<keyframe><key name="home" qpos="0 0 0.1 0"/></keyframe>', ""),
        ('<frame pos="0.05 0 0" euler="0 0 40">', ""),
        ("</frame>", ""),
        ('gravity="0.5 0 -9.7"', 'gravity="0 0 -9.81"'),
        ('euler="10 20 30"', 'euler="0 0 30"'),
        (' ref="0.05"', ""),
    )
    robot, model = (
        load_robot(file, limits=LIMITS, friction={"armature": 0.0, "viscous": 0.0}),
        pin.buildModelFromMJCF(str(file)),
    )
    q, v, a = states(robot)
    model.armature[:] = 0.0
    expected = [pin.rnea(model, model.createData(), *state) for state in zip(q, v, a, strict=True)]
    np.testing.assert_allclose(rigid(robot, q, v, a), expected, rtol=0.0, atol=1e-9)


def test_limits_are_those_of_ranges_and_actuators(write):
    limits = load_robot(write(), limits=LIMITS).limits
    np.testing.assert_allclose(limits.lower, [-np.pi / 2, -np.pi / 3, -0.1, -np.radians(50)], rtol=1e-15)
    np.testing.assert_allclose(limits.upper, [np.radians(120), np.pi / 3, 0.2, np.radians(50)], rtol=1e-15)
    # Gear times control, gear times force the other way round, gain times control, and two actuators together.
    np.testing.assert_allclose(limits.effort, [100.0, 30.0, 20.0, 13.0], rtol=1e-15)
    np.testing.assert_allclose(limits.effort_backward, [100.0, 60.0, 20.0, 13.0], rtol=1e-15)


@pytest.mark.parametrize(
    ("change", "effort"),
    [
        (('forcerange="-9 9"', 'forcerange="-9 9" forcelimited="false"'), None),
        (('<position joint="turn" forcerange="-9 9"/>', ""), 4.0),
        (('range="-50 50"', 'range="-50 50" actuatorfrcrange="-7 7"'), 7.0),
        (('range="-50 50"', 'range="-50 50" actuatorfrcrange="-70 70"'), 13.0),
        (('<velocity joint="turn" forcerange="-4 4"/>', '<muscle joint="turn"/>'), None),
    ],
)
def test_an_effort_that_nothing_limits_has_to_be_given(write, change, effort):
    file = write(change)
    if effort is None:
        refused(
            lambda: load_robot(file, limits=LIMITS),
            "arm.xml: no effort limit for turn, for which the file has no forcerange: give it in robot.toml",
        )
    robot = load_robot(file, limits=LIMITS | ({"effort": {"turn": 8.0}} if effort is None else {}))
    assert robot.limits.effort[3] == (effort or 8.0)


def test_velocity_limits_have_to_be_given(write):
    refused(
        lambda: load_robot(write(), limits={"acceleration": 5.0, "jerk": 50.0}),
        "arm.xml: no velocity limit for my joint, elbow, slide, turn, which MJCF cannot hold: give it in robot.toml",
    )


def test_friction_and_armature_are_used_and_told(write):
    file = write()
    friction = load_robot(file, limits=LIMITS).friction
    np.testing.assert_array_equal(friction.viscous, [1.0, 3.0, 1.0, 1.0])
    np.testing.assert_array_equal(friction.coulomb, np.full(4, 0.5))
    np.testing.assert_array_equal(friction.armature, np.full(4, 0.1))
    for name in ("file", "urdf"):
        np.testing.assert_array_equal(load_robot(file, limits=LIMITS, friction=name).friction.coulomb, np.full(4, 0.5))
    robot = load_robot(file, limits=LIMITS, friction="none")
    assert not robot.friction.viscous.any()
    assert robot.friction.armature.all()
    assert any(
        "efforts leave out what the MJCF file says: friction 0.5 N·m and damp" in note for note in robot.mass_notes
    )
    robot = load_robot(file, limits=LIMITS, friction={"armature": {"elbow": 0.7, "slide": "2 kg"}})
    np.testing.assert_array_equal(robot.friction.armature, [0.1, 0.7, 2.0, 0.1])
    notes = load_robot(file, limits=LIMITS).mass_notes
    assert any(
        "friction and armature of the MJCF file used: " in note and "armature 0.1 kg of" in note for note in notes
    )
    assert not any("effort of joint" in note for note in notes)


def test_a_coupling_is_a_joint_that_follows(write):
    coupled = "<equality><joint joint1='turn' joint2='elbow' polycoef='0.1 -2 0 0 0'/></equality><actuator>"
    text = ARM.replace("<actuator>", coupled)
    robot = load_robot(write(text=text), limits=LIMITS)
    assert robot.dof == 3
    assert [str(each) for each in robot.followers] == ["'turn' follows 'elbow' × -2 + 0.1"]
    q, v, a = states(robot)
    np.testing.assert_allclose(rigid(robot, q, v, a), Mujoco(text).effort(robot, q, v, a), rtol=0.0, atol=1e-9)
    # MuJoCo itself pulls the follower to where it is here.
    model = mujoco.MjModel.from_xml_string(
        text.replace('<geom type="mesh" mesh="nowhere" contype="0" conaffinity="0"/>', "")
    )
    data = mujoco.MjData(model)
    data.qpos[:] = [0.2, 0.3, 0.05, 0.1 - 2.0 * 0.3]
    mujoco.mj_forward(model, data)
    violations = data.efc_pos[data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY]
    np.testing.assert_allclose(violations, 0.0, atol=1e-12)


def test_distances_are_those_of_mujoco(write):
    ball = np.array([0.9, 0.3, 0.4])
    text = ARM.replace("</worldbody>", '<geom name="ball" type="sphere" size="0.1" pos="0.9 0.3 0.4"/></worldbody>')
    robot, twin = load_robot(write(text=text), limits=LIMITS), Mujoco(text)
    q = states(robot, 10)[0]
    found = Collision(robot, Scene((Sphere(position=tuple(ball), radius=0.1),))).distances(q).min(axis=-1)
    geoms = [k for k in range(twin.model.ngeom) if twin.model.geom_bodyid[k]]
    ellipsoid = int(np.flatnonzero(twin.model.geom_type == mujoco.mjtGeom.mjGEOM_ELLIPSOID)[0])
    assert len(geoms) == 5
    for row, _ in zip(found, twin.states(robot, q, 0.0 * q, 0.0 * q), strict=False):
        mujoco.mj_forward(twin.model, twin.data)
        each = {
            k: mujoco.mj_geomDistance(twin.model, twin.data, k, twin.model.geom("ball").id, 10.0, None) for k in geoms
        }
        assert row <= min(each.values()) + 1e-6
        if min(each, key=each.get) != ellipsoid:
            assert row == pytest.approx(min(each.values()), abs=1e-3)


REFUSED = {
    "free joint": (('<joint name="my joint"', '<freejoint/><joint name="my joint"'), "body 'upper': stands on a free"),
    "free type": (('type="slide"', 'type="free"'), "joint 'slide': type: expected hinge or slide, got 'free'"),
    "ball": (('type="slide"', 'type="ball"'), "joint 'slide': type: expected hinge or slide, got 'ball'"),
    "spring": (('ref="10"', 'ref="10" stiffness="3"'), "joint 'my joint': stiffness: expected no spring at a joint"),
    "include": (
        ("<worldbody>", '<include file="x.xml"/><worldbody>'),
        "<include> 'x.xml': give the file that it names",
    ),
    "replicate": (("<frame pos", '<replicate count="2"/><frame pos'), "<replicate> '': give a file that holds"),
    "tendon": (
        (
            "<actuator>",
            '<tendon><fixed name="t" stiffness="2"><joint joint="turn" coef="1"/></fixed></tendon><actuator>',
        ),
        "tendon 't': stiffness: expected a tendon that actuators alone pull, got '2'",
    ),
    "weld": (
        ("<actuator>", '<equality><weld body1="lower" body2="base"/></equality><actuator>'),
        "<weld> of 'lower' and 'base' closes a loop, which cannot be planned for",
    ),
    "curve": (
        ("<actuator>", '<equality><joint joint1="turn" joint2="elbow" polycoef="0 1 1"/></equality><actuator>'),
        "<equality> of joint 'turn': polycoef: expected a straight line, got '0 1 1'",
    ),
    "held": (
        ("<actuator>", '<equality><joint joint1="turn" polycoef="0.1"/></equality><actuator>'),
        "<equality> of joint 'turn' holds it still at 0.1: lock it there",
    ),
    "coupled to nothing": (
        ("<actuator>", '<equality><joint joint1="turn" joint2="elbw"/></equality><actuator>'),
        "<equality> of joint 'turn': no joint 'elbw'; .*did you mean 'elbow'",
    ),
    "mass of a mesh": (
        ('<geom type="sphere" size="0.05"', '<geom type="mesh" mesh="m" name="hull"'),
        "body 'lower': geom 'hull': its mass follows from a mesh, which is not read: give an <inertial>",
    ),
    "class": (('class="bigger"/>', 'class="biger"/>'), "class 'biger' has no <default>; .*did you mean 'bigger'"),
    "actuator": (('joint="turn" forcerange="-4', 'joint="trn" forcerange="-4'), "joint 'trn' is none of the file"),
    "total mass": (('eulerseq="XYz"', 'settotalmass="9"'), "<compiler>: expected masses as they are written"),
    "angle": (('angle="degree"', 'angle="grad"'), "<compiler>: angle: expected degree or radian, got 'grad'"),
    "number": (('pos="0.3 0 0"', 'pos="0.3 0"'), "body 'lower': pos: expected 3 numbers below 1e.15, got '0.3 0'"),
    "huge": (('size="0.05 0.2"', 'size="0.05 1e200"'), "size: expected 1 to 3 numbers below 1e.15, got '0.05 1e200'"),
    "orientations": (('zaxis="1 1 0"', 'zaxis="1 1 0" quat="1 0 0 0"'), "expected one orientation, got quat and zaxis"),
    "axis": (('axis="1 1 0"', 'axis="0 0 0"'), r"joint 'elbow': axis: expected a direction, got \[0.0, 0.0, 0.0\]"),
    "one way": (
        ('ctrlrange="-5 5"', 'ctrlrange="0 5"'),
        "joint 'slide': expected efforts in both directions, got -?0 to 20",
    ),
    "fluid": (('gravity="0.5 0 -9.7"', 'density="1.2"'), "<option>: density: expected a robot in no fluid, got '1.2'"),
    "no mass": (('mass="1" pos', "pos"), "inertial: mass: expected a number .kg., got none"),
    "tensor": (('diaginertia="0.02 0.02 0.01"', 'diaginertia="0.02 0.02 0.09"'), "triangle inequality"),
    "size": (('size="0.05 0.06 0.07"', 'size="0.05 0.06"'), "size: expected 3 positive numbers, got '0.05 0.06'"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_planned_for_is_refused_by_name(write, case):
    change, says = REFUSED[case]
    file = write(change)
    refused(lambda: load_robot(file, limits=LIMITS), f"arm.xml: .*{says}")
    assert examine(file).errors


def test_what_is_locked_may_be_what_could_not_be_planned_for(write):
    text = ARM.replace("<actuator>", '<equality><weld body1="lower" body2="upper"/></equality><actuator>')
    refused(lambda: load_robot(write(text=text), limits=LIMITS), "<weld> of 'lower' and 'upper' closes a loop")
    assert load_robot(write(text=text), limits=LIMITS, lock={"elbow": 0.0}).dof == 3
    spring = ARM.replace('ref="10"', 'ref="10" stiffness="3"')
    assert load_robot(write(text=spring), limits=LIMITS, lock={"my joint": 0.0}).dof == 3


def test_it_is_read_by_its_content_and_found_again(write, tmp_path):
    for name in ("arm.xml", "arm.mjcf", "arm.txt"):
        file = write(name=name)
        robot = load_robot(file, limits=LIMITS)
        again = robot_of(json.loads(json.dumps(robot.settings)))
        assert again.urdf == file
        np.testing.assert_array_equal(again.limits.effort, robot.limits.effort)
    with opening_robots_only("front.json"):
        assert load_robot(tmp_path / "arm.mjcf", limits=LIMITS).dof == 4


def test_robot_toml_completes_it(write, tmp_path):
    write(('name="my joint"', 'name="pan"'), ('joint="my joint"', 'joint="pan"'))
    joints = "".join(
        f"[joints.{name}]\nposition = {{ lower = -0.1, upper = 0.1, unit = '{unit}' }}\n"
        + "".join(
            f"{key} = {{ limit = 9.0, unit = '{unit}/s{power}' }}\n"
            for key, power in (("velocity", ""), ("acceleration", "^2"), ("jerk", "^3"))
        )
        + f"effort = {{ limit = 9.0, unit = '{'N' if unit == 'm' else 'N*m'}' }}\n"
        + ("armature = { value = 0.3, unit = 'kg*m^2' }\n" if name == "pan" else "")
        for name, unit in (("pan", "rad"), ("elbow", "rad"), ("slide", "m"), ("turn", "rad"))
    )
    (tmp_path / "robot.toml").write_text(
        "format = 1\nname = 'arm'\nurdf = 'arm.xml'\ntool = 'tcp'\nreference = 'made up'\n"
        "gravity = { vector = [0.0, 0.0, -9.81], unit = 'm/s^2' }\n" + joints
    )
    robot = load_robot(tmp_path)
    np.testing.assert_array_equal(robot.limits.effort, np.full(4, 9.0))
    np.testing.assert_array_equal(robot.friction.armature, [0.3, 0.1, 0.1, 0.1])
    np.testing.assert_array_equal(robot.model.gravity.linear, [0.0, 0.0, -9.81])
    assert not examine(tmp_path).errors


def test_its_check_shows_the_joints_and_what_is_missing(write):
    found = examine(write())
    assert not found.errors
    rows = {row.name: row for row in found.joints}
    assert rows["turn"].effort == 13.0
    assert rows["turn"].upper == pytest.approx(np.radians(50))
    assert np.isnan(rows["turn"].velocity)
    assert any("velocity, acceleration and jerk limits are not in the file" in warning for warning in found.warnings)
    assert not any("without mass" in warning for warning in found.warnings)
