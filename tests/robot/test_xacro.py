"""xacro: evaluated by xacrodoc for a user, told by its URDF in runs, and never opened for the data of a run."""

import json
import sys

import numpy as np
import pytest

from tests.helpers import refused, trajevo
from trajevo import Front, load_robot, load_task, verify
from trajevo.base.files import opening_robots_only
from trajevo.formulation.constraints.solids import robot_geometry
from trajevo.page.facts import run_facts
from trajevo.robot.examine import examine
from trajevo.robot.robot import robot_of

LIMITS = {"acceleration": 10.0, "jerk": 100.0}

MACRO = """<robot xmlns:xacro="http://ros.org/wiki/xacro">
  <xacro:include filename="$(find arms_resources)/colours.xacro"/>
  <xacro:macro name="arm" params="prefix length *origin">
    <xacro:property name="limits" value="${load_yaml('$(find arms_support)/config/limits.yaml')}"/>
    <link name="${prefix}base_link"/>
    <joint name="${prefix}world" type="fixed"><parent link="world"/><child link="${prefix}base_link"/>
      <xacro:insert_block name="origin"/></joint>
    <xacro:joint_of name="${prefix}joint_1" parent="${prefix}base_link" child="${prefix}link_1" away="0"/>
    <xacro:joint_of name="${prefix}joint_2" parent="${prefix}link_1" child="${prefix}link_2" away="${length}"/>
    <link name="${prefix}tool0"/>
    <joint name="${prefix}flange" type="fixed"><parent link="${prefix}link_2"/><child link="${prefix}tool0"/>
      <origin xyz="0.2 0 0"/></joint>
  </xacro:macro>
  <xacro:macro name="joint_of" params="name parent child away">
    <link name="${child}">
      <inertial><origin xyz="0.1 0 0"/><mass value="${mass}"/>
        <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial>
      <collision><geometry><box size="${2 * radius} 0.1 0.1"/></geometry></collision>
    </link>
    <joint name="${name}" type="revolute"><parent link="${parent}"/><child link="${child}"/>
      <origin xyz="${away} 0 0"/><axis xyz="0 1 0"/>
      <limit lower="${-limits['range']}" upper="${limits['range']}" velocity="${limits['speed']}" effort="50"/></joint>
  </xacro:macro>
</robot>
"""
TOP = """<robot name="arm" xmlns:xacro="http://ros.org/wiki/xacro">
  <xacro:arg name="length" default="0.4"/>
  <xacro:arg name="name" default=""/>
  <xacro:arg name="tall" default="false"/>
  <xacro:include filename="arm_macro.xacro"/>
  <link name="world"/>
  <xacro:property name="up" value="${0.9 if tall else 0.3}"/>
  <xacro:property name="tall" value="$(arg tall)"/>
  <xacro:arm prefix="$(arg name)" length="$(arg length)"><origin xyz="0 0 ${0.9 if tall else 0.3}"/></xacro:arm>
</robot>
"""
COLOURS = """<robot xmlns:xacro="http://ros.org/wiki/xacro"><xacro:property name="mass" value="1.5"/>
<xacro:property name="radius" value="0.05"/></robot>"""


@pytest.fixture
def arm(tmp_path):
    """A xacro file in the layout of ROS-Industrial: two packages beside each other, macros, limits in YAML."""
    support = tmp_path / "ros/arms_support"
    for folder in (support / "urdf", support / "config", tmp_path / "ros/arms_resources"):
        folder.mkdir(parents=True)
    (support / "urdf/arm.urdf.xacro").write_text(
        TOP.replace('  <xacro:property name="up" value="${0.9 if tall else 0.3}"/>\n', "")
    )
    (support / "urdf/arm_macro.xacro").write_text(MACRO)
    (support / "config/limits.yaml").write_text("range: 2.5\nspeed: 3.0\n")
    (tmp_path / "ros/arms_resources/colours.xacro").write_text(COLOURS)
    return support / "urdf/arm.urdf.xacro"


def test_arguments_macros_yaml_and_packages(arm, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    robot = load_robot("ros/arms_support/urdf/arm.urdf.xacro", limits=LIMITS)
    assert robot.joint_names == ("joint_1", "joint_2")
    assert (robot.name, robot.tool, robot.mass) == ("arm", "tool0", 3.0)
    np.testing.assert_array_equal(robot.limits.upper, [2.5, 2.5])
    np.testing.assert_array_equal(robot.limits.velocity, [3.0, 3.0])
    np.testing.assert_allclose(robot.tool_poses([[0.0, 0.0]])[0][0], [0.6, 0.0, 0.3], atol=1e-15)
    given = load_robot(arm, limits=LIMITS, xacro={"length": 0.7, "name": "left_", "tall": True})
    assert given.joint_names == ("left_joint_1", "left_joint_2")
    np.testing.assert_allclose(given.tool_poses([[0.0, 0.0]])[0][0], [0.9, 0.0, 0.9], atol=1e-15)
    assert robot_geometry(given)[0].ngeoms == 2


def test_packages_elsewhere_are_named(arm, tmp_path):
    (tmp_path / "ros/arms_resources").rename(tmp_path / "arms_resources")
    # Three folders above the file are looked through: it is still found there.
    assert load_robot(arm, limits=LIMITS).dof == 2
    (tmp_path / "away").mkdir()
    (tmp_path / "arms_resources").rename(tmp_path / "away/arms_resources")
    refused(
        lambda: load_robot(arm, limits=LIMITS),
        "arm.urdf.xacro: cannot be evaluated: package 'arms_resources' is in none of the folders .*by packages=",
    )
    assert load_robot(arm, limits=LIMITS, packages=tmp_path / "away").dof == 2
    assert not examine(arm, packages=[tmp_path / "away"]).errors
    shown = trajevo("check-robot", arm, "--packages", tmp_path / "away", "--xacro", "length=0.5")
    assert shown.returncode == 0
    assert "0 errors" in shown.stdout


@pytest.mark.parametrize(
    ("change", "given", "says"),
    [
        (None, {"lenght": 0.4}, "xacro: unknown argument 'lenght'; .*did you mean 'length'"),
        (None, {"length": [0.4]}, r"xacro: length: expected a text, a number or a truth value, got \[0.4\]"),
        (None, "length=0.4", "xacro: expected a mapping from the names of arguments to values, got 'length=0.4'"),
        (None, {"length": "1 +"}, "cannot be evaluated|expected three finite numbers as xyz"),
        (("$(arg length)", "$(arg far)"), {}, "its argument 'far' has no value: give it by xacro={'far': ...}"),
        (('prefix="$(arg name)"', ""), {}, r"cannot be evaluated: .*prefix"),
        (('"arm_macro.xacro"', '"macro.xacro"'), {}, "cannot be evaluated: .*macro.xacro"),
        (("xacro:arm", "xacro:leg"), {}, "cannot be evaluated: .*xacro:leg"),
        (("${0.9 if tall else 0.3}", "${1 / 0}"), {}, "cannot be evaluated: .*division by zero"),
        (("<link name=\"world\"/>", ""), {}, "joint 'world': parent: expected a link of the file, got 'world'"),
    ],
)  # fmt: skip
def test_what_cannot_be_evaluated_costs_a_sentence(arm, change, given, says):
    if change is not None:
        text = arm.read_text()
        assert change[0] in text
        arm.write_text(text.replace(*change))
    refused(lambda: load_robot(arm, limits=LIMITS, xacro=given), f"{says}")


def test_arguments_need_a_xacro_file(tmp_path):
    refused(
        lambda: load_robot("ur5", tool="tool0", limits=LIMITS, xacro={"length": 1}),
        "ur5.*: xacro: expected arguments for a file .xacro alone, got {'length': 1}",
    )


def test_without_the_package_one_sentence_says_how_to_get_it(arm, monkeypatch):
    monkeypatch.setitem(sys.modules, "xacrodoc.packages", None)
    refused(
        lambda: load_robot(arm, limits=LIMITS),
        r"arm.urdf.xacro is xacro, which needs the package xacrodoc: pip install 'trajevo\[xacro\]' brings it; or run "
        "`xacro arm.urdf.xacro > arm.urdf` where ROS is",
    )


def test_runs_hold_its_urdf_and_open_no_xacro(arm, tmp_path):
    (tmp_path / "task.toml").write_text(
        'robot = { name = "ros/arms_support/urdf/arm.urdf.xacro", '
        'xacro = { length = 0.5, name = "a_", tall = true } }\n'
        "points = [[0.0, 0.0], [0.5, 0.4]]\nduration_bounds = [0.3, 4.0]\n"
        "[algorithm]\ngenerations = 3\npopulation = 8\n[limits]\nacceleration = 10.0\njerk = 100.0\n"
    )
    task = load_task(tmp_path / "task.toml")
    robot = task.problem.robot
    assert robot.joint_names == ("a_joint_1", "a_joint_2")
    front = task.solve(progress=False)
    front.save(tmp_path / "front.json")
    arm.unlink()
    again = Front.load(tmp_path / "front.json")
    told = dict(run_facts(again))["problem settings (SI)"]
    assert "'urdf': 'a text of " in told
    assert "<robot" not in told
    assert again.problem.robot.joint_names == robot.joint_names
    np.testing.assert_array_equal(again.problem.evaluate(again.X)[0], front.F)
    assert verify(again.pick("0")).passed
    assert str(tmp_path) not in json.dumps({**robot.settings, "packages": []})


def test_the_data_of_a_run_opens_none(arm, tmp_path):
    settings = {"name": str(arm), "limits": LIMITS, "xacro": {"length": 0.5}}
    assert robot_of(settings).dof == 2
    with opening_robots_only("front.json"):
        refused(lambda: robot_of(settings), "front.json names a file to read, .*arm.urdf.xacro.*opens no other files")
    folder = tmp_path / "stranger"
    folder.mkdir()
    (folder / "robot.toml").write_text(
        'format = 1\nname = "arm"\nurdf = "../ros/arms_support/urdf/arm.urdf.xacro"\ntool = "tool0"\nreference = "x"\n'
        'gravity = { vector = [0.0, 0.0, -9.81], unit = "m/s^2" }\n[joints]\n'
    )
    refused(lambda: load_robot(folder), "robot.toml: urdf: expected a URDF or MJCF file, got xacro, which runs may not")


def test_the_text_of_a_urdf_takes_the_place_of_a_file(arm):
    by_file = load_robot(arm, limits=LIMITS)
    by_text = load_robot("mine", urdf=by_file.written, limits=LIMITS)
    assert (by_text.name, by_text.urdf) == ("mine", None)
    q = np.array([[0.3, -0.4]])
    np.testing.assert_array_equal(by_text.tool_poses(q)[0], by_file.tool_poses(q)[0])
    assert robot_geometry(by_text)[0].ngeoms == 2
    refused(lambda: load_robot("mine", urdf=3, limits=LIMITS), "robot: urdf: expected the text of a URDF, got 3")
    refused(lambda: load_robot("mi\nne", urdf="<robot/>"), "robot: expected a name of printable characters with urdf")
    refused(lambda: load_robot("mine", urdf="<robot/>", limits=LIMITS), "mine: expected at least one movable joint")
