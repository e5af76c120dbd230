"""What links look like stays with a robot that is made from text, and meshes have the colours of their files."""

import numpy as np
import pytest

from tests.helpers import mostly_long
from trajevo import load_robot
from trajevo.robot.robot import robot_of
from trajevo.robot.shapes.collada import diffuse_colour
from trajevo.robot.shapes.geometry import link_shapes

FREE = {"acceleration": 5.0, "jerk": 50.0}
ARM = """<robot name="r"><material name="red"><color rgba="0.8 0.1 0.1 1"/></material>
<link name="base"><visual><geometry><box size="0.2 0.4 0.1"/></geometry><material name="red"/></visual></link>
<link name="arm"><inertial><mass value="1"/><origin xyz="0 0 0.2"/>
<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>{visuals}{collision}</link>
<joint name="j" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" velocity="1" effort="10"/></joint></robot>"""
ROD = """<visual><origin xyz="0 0 0.2"/><geometry><cylinder radius="0.04" length="0.4"/></geometry>
<material name="own"><color rgba="0 0 1 1"/></material></visual>"""
SHELL = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'


def text_of(visuals=ROD, collision=""):
    return ARM.format(visuals=visuals, collision=collision)


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


def triangle(folder):
    file = folder / "part.stl"
    corners = "\n".join(f"vertex {corner}" for corner in ("0 0 0", "0.5 0 0", "0 0.25 0"))
    file.write_text(f"solid a\nfacet normal 0 0 1\nouter loop\n{corners}\nendloop\nendfacet\nendsolid a\n")
    return file


def test_shapes_and_colours_of_text_are_drawn_and_kept_in_settings():
    robot = load_robot("mine", urdf=text_of(), limits=FREE)
    for one in (robot, robot_of(robot.settings)):
        base, rod = link_shapes(one)
        np.testing.assert_allclose(np.ptp(base.vertices, axis=0), [0.2, 0.4, 0.1])
        np.testing.assert_allclose(base.colour, (0.8, 0.1, 0.1), atol=1e-7)
        np.testing.assert_allclose(
            [rod.vertices.min(axis=0), rod.vertices.max(axis=0)], [[-0.04] * 2 + [0], [0.04] * 2 + [0.4]], atol=1e-9
        )
        assert (rod.joint, rod.colour) == (1, (0.0, 0.0, 1.0))
    assert robot_of(robot.settings).settings == robot.settings


def test_a_robot_from_text_with_a_base_stands_there_with_its_looks():
    robot = load_robot("mine", urdf=text_of(), limits=FREE, base={"position": [1.0, 2.0, 3.0]})
    base, _ = link_shapes(robot)
    np.testing.assert_allclose(base.vertices.mean(axis=0), [1.0, 2.0, 3.0])


@pytest.mark.parametrize("name", mostly_long(["ur5", "xarm7"], "xarm7"))
def test_a_robot_of_a_file_keeps_its_meshes_with_a_base(name):
    given = {"name": name, "tool": {"ur5": "tool0"}.get(name), "limits": FREE}
    plain, standing = (link_shapes(load_robot(**given, **more)) for more in ({}, {"base": {"position": [1, 0, 0]}}))
    assert [one.link for one in standing] == [one.link for one in plain]
    np.testing.assert_allclose(standing[0].vertices - plain[0].vertices, [[1.0, 0.0, 0.0]] * len(plain[0].vertices))
    np.testing.assert_array_equal(standing[3].vertices, plain[3].vertices)


def test_meshes_are_drawn_where_they_are_found(tmp_path):
    file = triangle(tmp_path)
    visuals = f'<visual><geometry><mesh filename="{file.as_uri()}" scale="2 2 2"/></geometry></visual>'
    *_, part = link_shapes(load_robot("mine", urdf=text_of(visuals), limits=FREE))
    np.testing.assert_allclose(np.ptp(part.vertices, axis=0), [1.0, 0.5, 0.0])
    lost = '<visual><geometry><mesh filename="package://nowhere/a.stl"/></geometry></visual>'
    robot = load_robot("mine", urdf=text_of(lost + ROD), limits=FREE)
    assert [one.link for one in link_shapes(robot)] == ["base", "arm"]
    assert robot_of(robot.settings).settings == robot.settings


@pytest.mark.parametrize(
    "visual",
    [
        '<visual><geometry><sphere radius="nan"/></geometry></visual>',
        '<visual><geometry><sphere radius="-1"/></geometry></visual>',
        '<visual><geometry><box size="1 1"/></geometry></visual>',
        '<visual><geometry><cone radius="1"/></geometry></visual>',
        '<visual><origin xyz="0 0 x"/><geometry><sphere radius="1"/></geometry></visual>',
        '<visual><geometry><mesh filename="a.stl" scale="0 1 1"/></geometry></visual>',
        "<visual/>",
    ],
)
def test_a_look_that_cannot_be_read_is_left_out_without_a_word(visual, capfd):
    shapes = link_shapes(load_robot("mine", urdf=text_of(visual + ROD), limits=FREE))
    assert [one.link for one in shapes] == ["base", "arm"]
    assert capfd.readouterr() == ("", "")


def test_looks_change_no_motion_and_collisions_stay_those_of_the_file():
    bare, dressed = (load_robot("mine", urdf=text_of(visuals, SHELL), limits=FREE) for visuals in ("", ROD))
    assert bare.checked_text() == dressed.checked_text()
    assert bare.model == dressed.model
    assert "visual" not in dressed.checked_text()


DAE = """<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema"><library_effects>
<effect id="e"><profile_COMMON><technique sid="t"><phong><diffuse><color>0.1 0.2 0.3 1</color></diffuse></phong>
</technique></profile_COMMON></effect>
<effect id="f"><profile_COMMON><technique sid="t"><phong><diffuse>{other}</diffuse></phong></technique></profile_COMMON>
</effect></library_effects><library_materials><material id="m"><instance_effect url="#e"/></material>
<material id="n"><instance_effect url="#f"/></material></library_materials>
<library_geometries><geometry id="g"><mesh><source id="p"><float_array id="a" count="9">0 0 0 1 0 0 0 1 0</float_array>
<technique_common><accessor source="#a" count="3" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
{faces}</mesh></geometry></library_geometries><library_visual_scenes><visual_scene id="s"><node>
<instance_geometry url="#g"><bind_material><technique_common><instance_material symbol="M" target="#m"/>
<instance_material symbol="N" target="#n"/></technique_common></bind_material></instance_geometry></node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>"""
FACES = (
    """<triangles material="{}" count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles>"""
)
SAME, RED, TEXTURE = "<color>0.1 0.2 0.3 1</color>", "<color>1 0 0 1</color>", '<texture texture="t"/>'


@pytest.mark.parametrize(
    ("faces", "other", "colour"),
    [
        ("M", RED, (0.1, 0.2, 0.3)),
        ("N", RED, (1.0, 0.0, 0.0)),
        ("MN", SAME, (0.1, 0.2, 0.3)),
        ("MN", RED, None),
        ("N", TEXTURE, None),
        ("N", "<color>2 0 0 1</color>", None),
        ("X", RED, None),
    ],
)
def test_a_mesh_has_the_colour_that_all_its_faces_have(faces, other, colour, tmp_path):
    file = tmp_path / "part.dae"
    file.write_text(DAE.format(faces="".join(map(FACES.format, faces)), other=other))
    assert diffuse_colour(file) == colour
    visual = f'<visual><geometry><mesh filename="{file.as_uri()}"/></geometry>{{}}</visual>'
    *_, part = link_shapes(load_robot("mine", urdf=text_of(visual.format("")), limits=FREE))
    np.testing.assert_allclose(part.colour, colour or (0.9, 0.9, 0.9), atol=1e-7)
    *_, part = link_shapes(load_robot("mine", urdf=text_of(visual.format('<material name="red"/>')), limits=FREE))
    np.testing.assert_allclose(part.colour, (0.8, 0.1, 0.1), atol=1e-7)


def test_a_file_that_is_no_collada_has_no_colour(tmp_path):
    (tmp_path / "a.dae").write_text("<COLLADA>")
    assert diffuse_colour(tmp_path / "a.dae") is None
    assert diffuse_colour(tmp_path / "missing.dae") is None
