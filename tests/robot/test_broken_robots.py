"""Robots broken in one place each: refused by load_robot, and told by examine, with the same culprit."""

import re
import shutil
import warnings

import pytest

from tests.helpers import refused
from trajevo import load_robot
from trajevo.robot.examine import examine
from trajevo.robot.locate import ROBOTS_FOLDER

INERTIAL = (
    '<inertial><origin xyz="0.1 0 0"/><mass value="1"/>'
    '<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial>'
)
URDF = f"""<robot name="two">
<link name="base"/>
<link name="upper">{INERTIAL}</link>
<link name="lower">{INERTIAL.replace('"1"', '"2"')}</link>
<link name="tip"/>
<joint name="shoulder" type="revolute"><origin xyz="0 0 1"/><parent link="base"/><child link="upper"/>
<axis xyz="0 1 0"/><limit lower="-1" upper="1" velocity="2" effort="30"/></joint>
<joint name="elbow" type="revolute"><origin xyz="0.3 0 0"/><parent link="upper"/><child link="lower"/>
<axis xyz="0 1 0"/><limit lower="-2" upper="2" velocity="3" effort="20"/></joint>
<joint name="flange" type="fixed"><parent link="lower"/><child link="tip"/></joint>
</robot>
"""
LIMITS = {"acceleration": 10.0, "jerk": 100.0}
SHOULDER = "joint 'shoulder': "
TREE = "expected links that form a tree, got a loop: "


def changed(text, *changes):
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    return text


def robot_file(folder, *changes):
    file = folder / "two.urdf"
    file.write_text(changed(URDF, *changes))
    return file


def test_the_unbroken_robot_is_good(tmp_path):
    file = robot_file(tmp_path)
    assert load_robot(file, limits=LIMITS).dof == 2
    examination = examine(file)
    assert examination.errors == ()
    assert [sentence for sentence in examination.warnings if "acceleration and jerk" not in sentence] == []


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (
            'name="shoulder" type="revolute"',
            'name="shoulder" type="floating"',
            SHOULDER[:-2] + " is a free-flyer, which",
        ),
        (
            'name="shoulder" type="revolute"',
            'name="shoulder" type="planar"',
            SHOULDER[:-2] + " is a planar joint, which",
        ),
        ('name="shoulder" type="revolute"', 'name="shoulder" type="screw"', SHOULDER + "type: .*, got 'screw'"),
        ('name="shoulder" type="revolute"', 'name="shoulder"', SHOULDER + "type: .*, got None"),
        (
            '<parent link="base"/>',
            '<parent link="bsae"/>',
            SHOULDER + "parent: expected a link of the file, got 'bsae'",
        ),
        ('<parent link="base"/>', "", SHOULDER + "parent: expected a link of the file, got None"),
        ('<parent link="base"/>', "<parent/>", SHOULDER + "parent: expected a link of the file, got None"),
        ('<child link="upper"/>', '<child link="uper"/>', SHOULDER + "child: expected a link of the file, got 'uper'"),
        ('<child link="upper"/>', "", SHOULDER + "child: expected a link of the file, got None"),
        (
            '<link name="tip"/>',
            '<link name="tip"/><link name="tip"/>',
            "link 'tip': expected a unique name, got 2 links",
        ),
        ('name="elbow"', 'name="shoulder"', "joint 'shoulder': expected a unique name, got 2 joints"),
        ('<link name="tip"/>', '<link name="tip"/><link/>', "expected a name for every link, got 1 without one"),
        ('name="elbow"', "", "expected a name for every joint, got 1 without one"),
        (
            '<link name="tip"/>',
            '<link name="tip"/><link name="desk"/>',
            "expected one root link, .*got 2: .*'base', 'desk'",
        ),
        ('<child link="tip"/>', '<child link="upper"/>', "link 'upper': .*got 2, from .*'base', 'lower'"),
        ('<child link="tip"/>', '<child link="base"/>', TREE + "base -> upper -> lower -> base"),
        ('<parent link="lower"/>', '<parent link="tip"/>', TREE + "tip -> tip|one root link"),
        ('<limit lower="-1" upper="1" velocity="2" effort="30"/>', "", SHOULDER + "a revolute joint has no <limit>"),
        ('lower="-1" upper="1"', 'lower="1" upper="-1"', "lower must be below upper"),
        ('lower="-1" upper="1"', 'lower="1" upper="1"', "lower must be below upper"),
        ('lower="-1" upper="1"', "", "lower must be below upper"),
        ('lower="-1"', 'lower="nan"', SHOULDER + "limit: expected a finite number as lower, got 'nan'"),
        ('upper="1"', 'upper="pi"', SHOULDER + "limit: expected a finite number as upper, got 'pi'"),
        ('velocity="2"', "", SHOULDER + "limit: expected a finite number as velocity, got none"),
        ('velocity="2"', 'velocity="nan"', SHOULDER + "limit: expected a finite number as velocity, got 'nan'"),
        ('effort="30"', 'effort="inf"', SHOULDER + "limit: expected a finite number as effort, got 'inf'"),
        ('effort="30"', 'effort="30 Nm"', SHOULDER + "limit: expected a finite number as effort, got '30 Nm'"),
        ('velocity="2"', 'velocity="0"', "velocity: expected (a )?positive"),
        ('velocity="2"', 'velocity="-2"', "velocity: expected (a )?positive"),
        ('effort="30"', 'effort="0"', "effort: expected (a )?positive"),
        ('effort="30"', 'effort="-30"', "effort: expected (a )?positive"),
        (
            '<axis xyz="0 1 0"/>',
            '<axis xyz="0 1e200 0"/>',
            SHOULDER + "axis: expected a direction, got a vector too long",
        ),
        ('<axis xyz="0 1 0"/>', '<axis xyz="0 0 0"/>', SHOULDER + "axis: expected a direction"),
        (
            '<axis xyz="0 1 0"/>',
            '<axis xyz="0 1"/>',
            SHOULDER + "axis: expected three finite numbers as xyz, got '0 1'",
        ),
        ('<origin xyz="0 0 1"/>', '<origin xyz="0 0 nan"/>', SHOULDER + "origin: .*got '0 0 nan'"),
        (
            '<axis xyz="0 1 0"/>',
            '<axis xyz="0 1 0"/><mimic joint="elbov"/>',
            SHOULDER + "mimic: expected a joint of the file, got 'elbov'; did you mean 'elbow'",
        ),
        ('<mass value="1"/>', '<mass value="-1"/>', "link 'upper': mass: expected a number from 0"),
        ('<mass value="1"/>', "", "link 'upper': <inertial> has no <mass>"),
        ('<mass value="1"/>', '<mass value="0"/>', "link 'upper': inertia: expected zeros for a link of mass 0"),
        ('ixx="0.01"', 'ixx="-0.01"', "link 'upper': inertia: expected a positive definite tensor"),
        ('ixx="0.01"', 'ixx="0.05"', "link 'upper': inertia: .*triangle inequality"),
        ('ixx="0.01"', 'ixx="1e999"', "link 'upper': inertia: expected a finite number as ixx, got '1e999'"),
        ("robot name", "sdf name", "expected <robot> as the top element, got <sdf>"),
    ],
)
def test_a_broken_urdf_is_refused_and_told(tmp_path, old, new, says):
    text = changed(URDF, (old, new))
    if "sdf" in new:
        text = text.replace("</robot>", "</sdf>")
    file = tmp_path / "two.urdf"
    file.write_text(text)
    refused(lambda: load_robot(file, limits=LIMITS, tool="lower"), says)
    errors = examine(file).errors
    assert any(re.search(says, error) for error in errors), errors
    assert all("\n" not in error and error.startswith(str(file)) for error in errors)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("format = 1", "format = 3", "format: .*got 3"),
        ("format = 1", "format = ", "cannot be read as TOML"),
        ('name = "puma560"\n', "", "name: this key is missing"),
        ('tool = "tool"', 'tool = "hand"', "unknown tool frame in .*'hand'"),
        ('tool = "tool"', "tool = 3", "tool: .*got 3"),
        ("[0.0, 0.0, -9.81]", "[0.0, 0.0, nan]", "gravity.vector: expected finite numbers"),
        ("[0.0, 0.0, -9.81]", "[0.0, -9.81]", "gravity.vector"),
        ('unit = "m/s^2"', 'unit = "kg"', "gravity: unit 'kg', expected"),
        (
            "[joints.joint_1]",
            "[joints.joint_7]",
            r"line \d+: \[joints.joint_7\]: unknown joint 'joint_7'; known: ",
        ),
        (
            "lower = -160.0",
            "lower = 160.0",
            "joint 'joint_1': position: lower must be below upper, got 160 and 160 deg",
        ),
        ("lower = -160.0", "lower = nan", "joint 'joint_1': position: lower must be below upper, got nan and 160 deg"),
        ("limit = 1.92", "limit = 0.0", "joints.joint_1.velocity.limit: .*greater than 0, got 0"),
        ("limit = 1.92", "limit = nan", "joints.joint_1.velocity.limit: .*got nan"),
        ('unit = "rad/s"', 'unit = "rad"', "joint 'joint_1': velocity: unit 'rad', expected"),
        ('unit = "rad/s"', 'unit = "furlong"', "joint 'joint_1': velocity: unknown unit 'furlong'"),
        ("effort = { limit = 97.6", "effort = { limit = -97.6", "joints.joint_1.effort.limit: .*got -97.6"),
        ("jerk =", "jrek =", "joints.joint_1.(jerk: this key is missing|jrek)"),
        ('unit = "N*m*s/rad"', 'unit = "N"', "joint 'joint_1': viscous_friction: unit 'N', expected"),
        ("armature = { value = 1", "armature = { value = -1", "joints.joint_1.armature.value: .*greater than or equal"),
        ("forward = 24.7313845, ", "", "joints.joint_1.coulomb_friction: .*forward and backward"),
    ],
)
def test_a_broken_robot_toml_is_refused_and_told(tmp_path, old, new, says):
    folder = shutil.copytree(ROBOTS_FOLDER / "puma560", tmp_path / "mine")
    file = folder / "robot.toml"
    file.write_text(changed(file.read_text(encoding="utf-8"), (old, new)), encoding="utf-8")
    refused(lambda: load_robot(folder), says)
    examination = examine(folder)
    assert any(re.search(says, error) for error in examination.errors), examination.errors
    assert len(examination.joints) == 6
    assert examination.robot_name == "puma560"


def test_five_faults_are_told_together_and_nothing_else(tmp_path):
    file = robot_file(
        tmp_path,
        ('<mass value="1"/>', '<mass value="-1"/>'),
        ('<axis xyz="0 1 0"/>', '<axis xyz="0 0 0"/>'),
        ('velocity="2"', 'velocity="0"'),
        ('lower="-2" upper="2"', 'lower="2" upper="-2"'),
        ('<link name="tip"/>', '<link name="tip"/><link name="desk"/>'),
    )
    errors = examine(file).errors
    culprits = ("'upper': mass", "'shoulder': axis", "one root link", "'shoulder': limit: velocity", "'elbow': limit")
    assert len(errors) == 5
    for culprit, error in zip(culprits, errors, strict=True):
        assert culprit in error


def test_a_robot_toml_and_its_urdf_are_told_together(tmp_path):
    folder = shutil.copytree(ROBOTS_FOLDER / "puma560", tmp_path / "mine")
    settings, urdf = folder / "robot.toml", folder / "puma560.urdf"
    text = settings.read_text(encoding="utf-8")
    settings.write_text(changed(text, ("limit = 1.92", "limit = 0.0"), ("limit = 1.51", "limit = -1.0")), "utf-8")
    urdf.write_text(re.sub('<mass value="[^"]*"', '<mass value="heavy"', urdf.read_text(), count=1))
    errors = examine(folder).errors
    assert len(errors) == 3
    for culprit, error in zip(("joint_1.velocity", "joint_2.velocity", "got 'heavy'"), errors, strict=True):
        assert culprit in error


@pytest.mark.parametrize("kind", ["fixed", "revolute"])
def test_a_mimic_counts_only_where_something_moves(tmp_path, kind):
    file = robot_file(
        tmp_path,
        ('name="flange" type="fixed"', f'name="flange" type="{kind}"'),
        ('<child link="tip"/>', '<child link="tip"/><mimic joint="elbow"/><limit velocity="1" effort="1" upper="1"/>'),
    )
    robot = load_robot(file, tool="tip", limits=LIMITS)
    assert [str(follower) for follower in robot.followers] == ["'flange' follows 'elbow' × 1"] * (kind == "revolute")
    lock = {} if kind == "fixed" else {"flange": 0.0}
    assert examine(file, lock=lock).errors == ()
    locked = load_robot(file, lock=lock, tool="tip", limits=LIMITS)
    assert not locked.followers
    assert robot.joint_names == locked.joint_names == ("shoulder", "elbow")


def test_a_locked_joint_needs_no_sense_in_its_limits(tmp_path):
    file = robot_file(tmp_path, ('lower="-1" upper="1"', 'lower="1" upper="-1"'))
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        assert load_robot(file, lock={"shoulder": 0.0}, limits=LIMITS).dof == 1
    examination = examine(file, lock=["shoulder"])
    assert examination.errors == ()
    assert [row.name for row in examination.joints] == ["elbow"]
