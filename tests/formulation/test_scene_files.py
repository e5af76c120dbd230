"""Scenes of MoveIt and MJCF: what is read, against MuJoCo and closed forms, and mistakes in them."""

import json

import numpy as np
import pinocchio
import pytest

from tests.formulation.test_clearance import BALL, LIMITS, states
from tests.helpers import refused
from trajevo import Scene, load_robot, load_task
from trajevo.base.files import opening_robots_only
from trajevo.formulation.constraints.collision import Collision
from trajevo.formulation.constraints.scene import Box, Capsule, Cylinder, Hull, Plane, Sphere

#: As RViz saves it: objects with poses, several shapes, a mesh, subframes and a plane.
NEW = """(noname)
* work bench
0.5 0 0.1
0 0 0.7071067811865476 0.7071067811865476
2
box
0.2 0.4 0.06
0.1 0 0
0 0 0 1
0 0 0 0
cylinder
0.05 0.3
0 0 0.2
0.5 0.5 0.5 0.5
0.2 0.4 0.6 1
1
corner
0.1 0.1 0
0 0 0 1
* ball
0.1 0.2 0.3
0 0 0 1
1
sphere
0.08
0 0 0
0 0 0 1
0 0 0 0
0
* wedge
1 0 0
0 0 0 1
1
mesh
5 4
0 0 0
0.1 0 0
0 0.1 0
0 0 0.1
0.01 0.01 0.01
0 2 1
0 1 3
0 3 2
1 2 3
0 0 0
0 0 0 1
0 0 0 0
0
* floor
0 0 0
0 0 0 1
1
plane
0 0 2 0.4
0 0 0
0 0 0 1
0 0 0 0
0
.
"""
#: As older versions save it: neither poses of objects nor subframes.
OLD = """cell
* pole
1
cylinder
0.05 0.3
0.4 0.1 0.2
0 0 0 1
0 0 0 0
* pole
1
box
0.1 0.2 0.3
0.4 0.5 0.6
0.7071067811865476 0 0 0.7071067811865476
0 0 0 0
.
"""

#: A cell: class and angles of the file, frames, fixed bodies in each other, a robot on a table, a part that is loose.
WORLD = """<mujoco model="cell">
  <compiler angle="degree" eulerseq="XYZ" meshdir="parts"/>
  <default>
    <geom rgba="1 0 0 1"/>
    <default class="picture"><geom contype="0" conaffinity="0"/></default>
    <default class="post"><geom type="capsule" size="0.05 0.2"/></default>
  </default>
  <asset><mesh name="corner" file="corner.obj" scale="0.1 0.1 0.2"/></asset>
  <worldbody>
    <light pos="0 0 3"/>
    <geom name="floor" type="plane" size="2 2 0.1" pos="0 0 -0.3" zaxis="0.1 0 1"/>
    <geom name="sight" class="picture" type="box" size="1 1 1"/>
    <body name="table" pos="0.6 0.1 0.1" euler="0 0 30">
      <geom name="top" type="box" size="0.3 0.2 0.02"/>
      <frame pos="0.1 0 0.1" euler="0 90 0"><geom class="post" name="post"/></frame>
      <body name="shelf" pos="0 0.3 0.2" childclass="post">
        <geom/>
        <geom type="cylinder" size="0.03" fromto="0 0 0 0.1 0.2 0.3"/>
        <geom type="mesh" mesh="corner" pos="0.1 0.2 0" euler="20 0 0"/>
      </body>
      <body name="base" pos="0 0 0.1">
        <geom name="of the robot" type="sphere" size="0.1"/>
        <body name="link"><joint name="turn"/><geom name="of the link" size="0.1" mass="1"/></body>
      </body>
    </body>
    <body name="part" pos="0.5 0.5 0"><freejoint/><geom name="loose" size="0.05"/></body>
  </worldbody>
</mujoco>"""
CORNER = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
FIXED = ("floor", "top", "post", "shelf", "shelf (2)", "shelf (3)")


@pytest.fixture(scope="module")
def ball(tmp_path_factory):
    file = tmp_path_factory.mktemp("ball") / "ball.urdf"
    file.write_text(BALL)
    return load_robot(file, limits=LIMITS)


@pytest.fixture
def world(tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "corner.obj").write_text(CORNER)
    (tmp_path / "cell.xml").write_text(WORLD)
    return tmp_path / "cell.xml"


def written(folder, text, name="cell.scene"):
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


def test_a_scene_of_moveit_has_its_objects_where_their_poses_put_them(tmp_path):
    scene = Scene.read(written(tmp_path, NEW), clearance=0.02)
    assert [each.name for each in scene.obstacles] == ["work bench 1", "work bench 2", "ball", "wedge", "floor"]
    top, leg, ball, wedge, floor = scene.obstacles
    assert [type(each) for each in scene.obstacles] == [Box, Cylinder, Sphere, Hull, Plane]
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    np.testing.assert_allclose(top.position, [0.5, 0.1, 0.1], atol=1e-12)  # 0.1 along x, which the bench turns to y
    np.testing.assert_allclose(top.rotation, quarter, atol=1e-12)
    np.testing.assert_allclose(leg.position, [0.5, 0.0, 0.3], atol=1e-12)
    cycled = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])  # x to y to z to x
    np.testing.assert_allclose(leg.rotation, quarter @ cycled, atol=1e-12)
    assert (top.size, leg.radius, leg.length) == ((0.2, 0.4, 0.06), 0.05, 0.3)
    assert (ball.position, ball.radius) == ((0.1, 0.2, 0.3), 0.08)
    assert wedge.points == ((0, 0, 0), (0.1, 0, 0), (0, 0.1, 0), (0, 0, 0.1))  # the inner corner is none of the hull
    np.testing.assert_allclose(floor.position, [0.0, 0.0, -0.2])
    np.testing.assert_allclose(floor.normal, [0.0, 0.0, 1.0])


def test_the_older_format_has_no_poses_of_objects(tmp_path):
    pole, box = Scene.read(written(tmp_path, OLD)).obstacles
    assert (pole.name, pole.position, pole.radius, pole.length) == ("pole", (0.4, 0.1, 0.2), 0.05, 0.3)
    assert (box.name, box.position, box.size) == ("pole (2)", (0.4, 0.5, 0.6), (0.1, 0.2, 0.3))
    np.testing.assert_allclose(box.rotation @ [0, 1, 0], [0, 0, 1], atol=1e-12)


def test_the_free_side_of_a_plane_of_moveit_is_that_of_the_base(tmp_path):
    ceiling = NEW.replace("0 0 2 0.4", "0 0 2 -4")
    plane = Scene.read(written(tmp_path, ceiling)).obstacles[-1]
    np.testing.assert_allclose(plane.position, [0.0, 0.0, 2.0])
    np.testing.assert_allclose(plane.rotation[:, 2], [0.0, 0.0, -1.0])


def test_a_cell_of_mjcf_is_as_mujoco_places_it(world, ball):
    """Distances of a ball to every geom that stands still, by MuJoCo."""
    mujoco = pytest.importorskip("mujoco")
    scene = Scene.read(world)
    assert tuple(each.name for each in scene.obstacles) == FIXED
    kinds = [Plane, Box, Capsule, Capsule, Cylinder, Hull]
    assert [type(each) for each in scene.obstacles] == kinds
    probe = '<body name="probe" mocap="true"><geom name="probe" size="0.05"/></body></worldbody>'
    (world.parent / "probe.xml").write_text(WORLD.replace("</worldbody>", probe))
    model = mujoco.MjModel.from_xml_path(str(world.parent / "probe.xml"))
    data = mujoco.MjData(model)
    numbers = [k for k in range(model.ngeom) if model.geom(k).name not in ("sight", "of the robot", "of the link")]
    numbers = [k for k in numbers if model.geom(k).name not in ("loose", "probe")]
    assert len(numbers) == len(FIXED)
    q, collision = states(ball, 25, seed=4), Collision(ball, scene)
    found = collision.distances(q)
    with collision._buffers() as (geometry, places, placed):
        for row, configuration in zip(found, q, strict=True):
            pinocchio.updateGeometryPlacements(ball.model, places, geometry, placed, configuration)
            data.mocap_pos[0] = placed.oMg[0].translation
            mujoco.mj_forward(model, data)
            expected = [mujoco.mj_geomDistance(model, data, k, model.geom("probe").id, 10.0, None) for k in numbers]
            apart = row > 1e-3
            np.testing.assert_allclose(row[apart], np.array(expected)[apart], atol=2e-4)


def test_settings_hold_what_was_read(tmp_path, world):
    for file in (written(tmp_path, NEW), world):
        scene = Scene.read(
            file, clearance=0.02, self_clearance=0.01, obstacles=[Sphere(position=(3, 0, 0), radius=0.1)]
        )
        settings = json.loads(json.dumps(scene.settings))
        file.unlink()
        with opening_robots_only("a run"):
            again = Scene.of(settings)
        assert again == scene
        assert "file" not in settings
        assert again.clearance == 0.02
        assert again.self_clearance == 0.01
        for one, other in zip(again.obstacles, scene.obstacles, strict=True):
            np.testing.assert_array_equal(one.rotation, other.rotation)


def test_the_data_of_a_run_reads_no_scene(world):
    with opening_robots_only("a run"):
        refused(lambda: Scene.read(world), "a run names a file to read, .*the data of a run holds its obstacles")


TASK = """format = 1
robot = { name = "xarm7" }
points = [[0, 0.9, 0, 1.6, 0, 0.7, 0], [0.8, 0.9, 0, 1.6, 0, 0.7, 0]]
duration_bounds = [0.3, 4.0]
objectives = ["time", "jerk"]
[limits]
acceleration = 10.0
jerk = 100.0
[scene]
file = "cells/cell.scene"
clearance = 0.02
[[scene.obstacles]]
name = "lamp"
shape = "sphere"
radius = 0.1
position = [0.0, 0.9, 0.9]
"""


def test_a_task_names_a_scene_beside_it(tmp_path):
    (tmp_path / "cells").mkdir()
    written(tmp_path / "cells", OLD)
    task = load_task(written(tmp_path, TASK, "task.toml"))
    assert [each["name"] for each in task.problem.settings["scene"]["obstacles"]] == ["pole", "pole (2)", "lamp"]
    wrong = TASK.replace("cell.scene", "none.scene")
    refused(lambda: load_task(written(tmp_path, wrong, "task.toml")), "line 9: scene: file: .*cannot be read: No such")


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("* ball", "+ ball", r"cell.scene: line 20: expected an object, \* and its name, .* got '\+'"),
        (
            "box\n",
            "cone\n",
            "cell.scene: line 6: expected a shape, one of box, sphere, cylinder, plane, mesh, got 'cone'",
        ),
        ("0.2 0.4 0.06", "0.2 0.4 wide", "cell.scene: line 7: expected x y z, got 'wide'"),
        ("0.2 0.4 0.06", "0.2 0.4 nan", "cell.scene: line 7: expected finite numbers as x y z, got 'nan'"),
        ("0.2 0.4 0.06", "0.2 0.4 -1", "cell.scene: line 6: obstacle 'work bench 1': size: expected positive"),
        ("0.5 0.5 0.5 0.5", "0 0 0 0", "cell.scene: line 14: expected a quaternion x y z w of length 1, got '0 0 0 0'"),
        ("5 4\n", "-5 4\n", "cell.scene: line 35: expected the number of corners of a mesh, at most .*, got '-5'"),
        ("0 0 0.1\n0.01", "0 0 0\n0.01", "mesh: expected a solid, got 5 corners in one plane"),
        ("0 0 2 0.4", "0 0 0 0.4", "expected a plane a b c d with a normal, got '0 0 0 0.4'"),
        ("0\n.\n", "0\n", "line 58: expected an object.*, got the end of the file"),
        (NEW, "", "expected an object.*, got the end of the file"),
        (NEW, "cell\n.\n", "cell.scene: expected obstacles, got none"),
    ],
)
def test_mistakes_in_a_scene_of_moveit_are_told_with_their_line(tmp_path, old, new, says):
    text = (
        NEW.replace(old, new)
        if old != "0 0 0.1\n0.01"
        else NEW.replace(old, new).replace("0.01 0.01 0.01", "0.01 0.01 0")
    )
    refused(lambda: Scene.read(written(tmp_path, text)), says)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("<mujoco ", "<robot ", "not well-formed|mismatched|expected"),
        ("0.3 0.2 0.02", "0.3 0.2", "body 'table': geom 'top': size: expected 3 positive numbers"),
        ('"corner" pos', '"edge" pos', "mesh 'edge': expected a mesh of <asset>, got none"),
        (
            'type="box" size="0.3',
            'type="hfield" size="0.3',
            "geom 'top': type: expected a box, sphere, .* got 'hfield'",
        ),
        ('name="top"', 'name="to\\np"'.replace("\\n", "&#10;"), "geom 'to.*expected printable text on one line"),
        ("<light", "<include file='x'/><light", "<include> 'x': give the file that it names"),
    ],
)
def test_mistakes_in_a_cell_of_mjcf_are_told_with_their_geom(world, old, new, says):
    world.write_text(WORLD.replace(old, new))
    refused(lambda: Scene.read(world), says)


def test_what_is_no_scene_is_refused(tmp_path):
    refused(lambda: Scene.read(3), "scene: file: expected the path of a scene, got 3")
    refused(lambda: Scene.read(tmp_path), "expected a regular file, got a folder")
    refused(lambda: Scene.read(written(tmp_path, "<robot/>")), "expected a scene of MoveIt or <mujoco>, got <robot>")
    (tmp_path / "cell.scene").write_bytes(b"\xff\xfe")
    refused(lambda: Scene.read(tmp_path / "cell.scene"), "cell.scene: expected text")
