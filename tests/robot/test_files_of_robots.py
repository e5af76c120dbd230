"""Robots from files as they are met: endings, other formats, packages of meshes, shared names, bases, other units."""

import json
import re

import numpy as np
import pytest

from tests.helpers import refused
from trajevo import load_robot, load_task
from trajevo.formulation.constraints.solids import robot_geometry
from trajevo.robot.examine import examine
from trajevo.robot.robot import robot_of
from trajevo.verification.newton_euler import NewtonEuler

LIMITS = {"acceleration": 10.0, "jerk": 100.0}
URDF = """\
<robot name="arm">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0.2 0 0"/><mass value="2"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.03"/></inertial></link>
  <link name="lower"><inertial><origin xyz="0.15 0 0"/><mass value="1"/>
    <inertia ixx="0.005" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
  <link name="tip"/>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.3"/>
    <axis xyz="0 1 0"/><limit lower="-3" upper="3" velocity="2" effort="60"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0.4 0 0"/>
    <axis xyz="0 1 0"/><limit lower="-2" upper="2" velocity="2" effort="30"/></joint>
  <joint name="mount" type="fixed"><parent link="lower"/><child link="tip"/><origin xyz="0.3 0 0"/></joint>
</robot>
"""
#: A tetrahedron in STL.
FACETS = ("0 0 0 / 0 .1 0 / .1 0 0", "0 0 0 / .1 0 0 / 0 0 .1", "0 0 0 / 0 0 .1 / 0 .1 0", ".1 0 0 / 0 .1 0 / 0 0 .1")
STL = "solid t\n{}endsolid t\n".format(
    "".join(
        "facet normal 0 0 0\nouter loop\n"
        + "".join(f"vertex {corner.strip()}\n" for corner in facet.split("/"))
        + "endloop\nendfacet\n"
        for facet in FACETS
    )
)


@pytest.fixture
def write(tmp_path):
    def write(name, *changes):
        text = URDF
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        file = tmp_path / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
        return file

    return write


@pytest.mark.parametrize("name", ["arm.urdf", "arm.URDF", "arm.xml", "arm.XML"])
def test_a_urdf_is_read_whatever_its_ending(write, tmp_path, name):
    file = write(name)
    robot = load_robot(file, limits=LIMITS)
    assert robot_of(json.loads(json.dumps(robot.settings))).urdf == file
    assert not examine(file).errors
    (tmp_path / "task.toml").write_text(
        f'robot = "{name}"\npoints = [[0.0, 0.0], [0.5, 0.4]]\nduration_bounds = [0.3, 4.0]\n'
        "[limits]\nacceleration = 10.0\njerk = 100.0\n"
    )
    assert load_task(tmp_path / "task.toml").problem.robot.dof == 2


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("arm.urdf.xacro", "<robot/>", "expected at least one movable joint, got 0 fixed ones"),
        ("arm.xacro", "<robot>", "cannot be evaluated: .*no element found"),
        (
            "arm.xml",
            "<mujoco/>",
            "expected <worldbody> with the bodies of a robot, got none",
        ),
        ("arm.sdf", "<sdf/>", "got <sdf>, SDF of Gazebo: give the URDF from which it was made"),
        ("arm.stl", "solid", "got a file .stl, a mesh: give the URDF that refers to it"),
        ("arm.3ds", "MM", "got a file .3ds, a mesh: give the URDF that refers to it"),
        ("arm.dae", "<COLLADA/>", "got <COLLADA>, a mesh: give the URDF that refers to it"),
        ("arm.usda", "#usda 1.0", "got a file .usda, USD: export a URDF or MJCF"),
        ("arm.mjb", "MJB", "got a file .mjb, a compiled model of MuJoCo: save it as XML"),
        ("arm.txt", "arm", "got a file .txt$"),
        ("arm", "arm", "got a file arm$"),
    ],
)
def test_other_formats_are_named_with_the_way_out(tmp_path, name, text, says):
    (tmp_path / name).write_text(text)
    refused(lambda: load_robot(tmp_path / name, limits=LIMITS), f"{name}.* {says}")


def test_paths_that_lead_nowhere_are_told(write, tmp_path):
    file = write("arm.urdf")
    for wrong, says in (
        (tmp_path / "amr.urdf", "amr.urdf: no such URDF file; did you mean '.*arm.urdf'"),
        (tmp_path / "arm.xacro", "arm.xacro: no such file"),
        (tmp_path / "nowhere" / "arm", "arm: no such file or folder, nor the folder '.*nowhere'"),
        (tmp_path, "a folder without robot.toml; give the path of its file, '.*arm.urdf'"),
    ):
        refused(lambda wrong=wrong: load_robot(wrong, limits=LIMITS), says)
    file.unlink()
    refused(lambda: load_robot(tmp_path, limits=LIMITS), "a folder without robot.toml; expected one, or the path")


MESH = (
    '<link name="tip"/>',
    '<link name="tip"><collision><geometry><mesh filename="package://PACKAGE/meshes/t.stl"/></geometry></collision></link>',
)


def test_packages_are_found_where_ros_has_them(write, tmp_path, monkeypatch):
    file = write("ros/arm/urdf/arm.urdf", MESH, ("PACKAGE", "arm"))
    (tmp_path / "ros/arm/meshes").mkdir()
    (tmp_path / "ros/arm/meshes/t.stl").write_text(STL)
    assert robot_geometry(load_robot(file, limits=LIMITS))[0].ngeoms == 1
    monkeypatch.chdir(file.parent)
    assert robot_geometry(load_robot("arm.urdf", limits=LIMITS))[0].ngeoms == 1


def test_packages_elsewhere_are_named(write, tmp_path, monkeypatch):
    file = write("mine/arm.urdf", MESH, ("PACKAGE", "grippers"))
    (tmp_path / "away/grippers/meshes").mkdir(parents=True)
    (tmp_path / "away/grippers/meshes/t.stl").write_text(STL)
    refused(
        lambda: robot_geometry(load_robot(file, limits=LIMITS)),
        r"arm.urdf: mesh 'package://grippers/meshes/t.stl': no such file in .*mine, .*ROS_PACKAGE_PATH.*by packages=$",
    )
    for packages in (tmp_path / "away", str(tmp_path / "away"), [tmp_path, tmp_path / "away"]):
        robot = load_robot(file, limits=LIMITS, packages=packages)
        assert robot_geometry(robot)[0].ngeoms == 1
        assert robot_geometry(robot_of(json.loads(json.dumps(robot.settings))))[0].ngeoms == 1
    (tmp_path / "task.toml").write_text(
        'robot = { name = "mine/arm.urdf", packages = "away" }\npoints = [[0.0, 0.0], [0.5, 0.4]]\n'
        "duration_bounds = [0.3, 4.0]\n[limits]\nacceleration = 10.0\njerk = 100.0\n"
    )
    monkeypatch.chdir("/")
    assert robot_geometry(load_task(tmp_path / "task.toml").problem.robot)[0].ngeoms == 1
    refused(lambda: load_robot(file, limits=LIMITS, packages=tmp_path / "awry"), "packages: .*did you mean '.*away'")
    refused(lambda: load_robot(file, limits=LIMITS, packages=3), "packages: expected the path of a folder or a list")


def test_a_link_and_a_joint_may_share_a_name(write):
    plain = load_robot(write("arm.urdf"), lock={"elbow": 0.5}, limits=LIMITS)
    shared = load_robot(
        write("same.urdf", ('joint name="elbow"', 'joint name="lower"')), lock={"lower": 0.5}, limits=LIMITS
    )
    assert shared.joint_names == plain.joint_names == ("shoulder",)
    for there, here in zip(shared.tool_poses([[0.3]]), plain.tool_poses([[0.3]]), strict=True):
        np.testing.assert_array_equal(there, here)


def test_a_tool_that_shares_its_name_with_a_joint_is_the_link(write):
    """The joint of that name moves another link, whose frame is elsewhere."""
    file = write("same.urdf", ('joint name="shoulder"', 'joint name="lower"'))
    robot, plain = (
        load_robot(file, tool="lower", limits=LIMITS),
        load_robot(write("arm.urdf"), tool="lower", limits=LIMITS),
    )
    q = np.array([[0.3, -0.4]])
    np.testing.assert_array_equal(robot.tool_poses(q)[0], plain.tool_poses(q)[0])
    assert NewtonEuler(robot).robot.tool == "lower"


def test_a_base_with_an_inertia_and_no_mass_is_told_not_refused(write):
    inertial = '<inertial><mass value="0"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
    file = write("arm.urdf", ('<link name="base"/>', f'<link name="base">{inertial}</link>'))
    assert load_robot(file, limits=LIMITS).mass == 3.0
    found = examine(file)
    assert not found.errors
    assert any("link 'base', which stands still, has an inertia without a mass" in said for said in found.warnings)
    moving = write("arm.urdf", ('<link name="tip"/>', f'<link name="tip">{inertial}</link>'))
    refused(lambda: load_robot(moving, limits=LIMITS), "link 'tip': inertia: expected zeros for a link of mass 0")


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        (
            [('lower="-3" upper="3"', 'lower="-180" upper="180"')],
            "ranges look like degrees or mm: -180 to 180 rad of 'sh",
        ),
        (
            [('velocity="2"', 'velocity="120"')],
            "speeds look like deg/s, rpm .*: 120 rad/s of 'shoulder', 120 rad/s of 'el",
        ),
        ([('xyz="0.4 0 0"', 'xyz="400 0 0"')], "distances between joints look like mm: 400 m of 'elbow'"),
        (
            [('iyy="0.01"', 'iyy="10000"'), ('izz="0.01"', 'izz="10000"'), ('ixx="0.005"', 'ixx="5000"')],
            "looks like kg·mm²",
        ),
        (
            [('mass value="2"', 'mass value="20000"'), ('mass value="1"', 'mass value="9000"')],
            "29000 kg together look like g",
        ),
    ],
)
def test_numbers_of_a_urdf_in_other_units_are_warned_of(write, changes, says):
    found = examine(write("arm.urdf", *changes))
    warned = [said for said in found.warnings if "a URDF is in m, kg, s and rad" in said]
    assert len(warned) == 1, found.warnings
    assert re.search(says, warned[0]), warned


def test_wide_ranges_and_fast_joints_are_not_warned_of(write):
    changes = [('lower="-3" upper="3"', 'lower="-12.56" upper="12.56"'), ('velocity="2"', 'velocity="20"')]
    found = examine(write("arm.urdf", *changes))
    assert not [said for said in found.warnings if "a URDF is in m" in said]
