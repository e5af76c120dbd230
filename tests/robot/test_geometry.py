"""Links as they look: on the joints that carry them, with few triangles that stay close to their meshes."""

from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest

from tests.helpers import mostly_long, refused
from trajevo import load_robot
from trajevo.robot.shapes import geometry
from trajevo.robot.shapes.geometry import link_shapes, read_geometry, simplified

FREE = {"acceleration": 10.0, "jerk": 100.0}
SOLIDS = """<robot name="solids">
<link name="base"><visual><origin xyz="0 0 0.1"/><geometry><box size="0.2 0.3 0.2"/></geometry></visual></link>
<link name="one"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><geometry><cylinder radius="0.05" length="0.4"/></geometry></visual>
<visual><origin xyz="0 0 0.3"/><geometry><sphere radius="0.1"/></geometry>
<material name="red"><color rgba="1 0 0 1"/></material></visual></link>
<joint name="turn" type="revolute"><parent link="base"/><child link="one"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" velocity="1" effort="1"/></joint></robot>"""


@pytest.fixture(scope="module")
def ball():
    """A fine ball: 20,000 triangles."""
    turns, heights = np.linspace(0, 2 * np.pi, 101)[:-1], np.linspace(-np.pi / 2, np.pi / 2, 101)
    grid = np.array([[np.cos(h) * np.cos(t), np.cos(h) * np.sin(t), np.sin(h)] for h in heights for t in turns])
    faces = []
    for row in range(100):
        for k in range(100):
            a, b = 100 * row + k, 100 * row + (k + 1) % 100
            faces += [[a, b, a + 100], [b, b + 100, a + 100]]
    return grid, np.array(faces)


def solids(folder, text=SOLIDS):
    (folder / "solids.urdf").write_text(text)
    return load_robot(folder / "solids.urdf", limits=FREE)


def test_solids_have_their_sizes_in_the_frames_of_their_joints(tmp_path):
    robot = solids(tmp_path)
    base, cylinder, sphere = link_shapes(robot)
    assert [(one.link, one.joint) for one in (base, cylinder, sphere)] == [("base", 0), ("one", 1), ("one", 1)]
    ends = [base.vertices.min(axis=0), base.vertices.max(axis=0)]
    np.testing.assert_allclose(ends, [[-0.1, -0.15, 0.0], [0.1, 0.15, 0.2]], atol=1e-12)
    np.testing.assert_allclose(np.ptp(cylinder.vertices, axis=0), [0.1, 0.1, 0.4], atol=1e-12)
    np.testing.assert_allclose(sphere.vertices.mean(axis=0), [0.0, 0.0, 0.3], atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(sphere.vertices - [0.0, 0.0, 0.3], axis=1), 0.1, atol=1e-12)
    assert sphere.colour == (1.0, 0.0, 0.0)
    for shape, volume in ((base, 0.012), (cylinder, np.pi * 1e-3), (sphere, 4e-3 / 3 * np.pi)):
        a, b, c = np.swapaxes(shape.vertices[shape.triangles] - shape.vertices.mean(axis=0), 0, 1)
        assert 0.93 * volume < np.sum(a * np.cross(b, c)) / 6.0 < 1.0001 * volume  # counter-clockwise from outside


def test_a_simpler_mesh_has_few_triangles_and_stays_near(ball):
    vertices, triangles = simplified(*ball, 1200)
    assert 300 < len(triangles) <= 1200
    assert np.abs(np.linalg.norm(vertices, axis=1) - 1.0).max() < 0.1
    assert np.ptp(vertices, axis=0) == pytest.approx([2.0] * 3, abs=0.2)
    assert triangles.max() == len(vertices) - 1
    same = simplified(*ball, 20_000)
    assert same[0] is ball[0]
    assert same[1] is ball[1]


@pytest.mark.parametrize("name", mostly_long(["ur5", "panda"], "ur5"))
def test_links_are_where_pinocchio_has_them(name):
    tool = {"ur5": "tool0", "panda": "panda_hand_tcp"}[name]
    robot = load_robot(name, tool=tool, limits=FREE)
    read = read_geometry(robot, "visual")
    shapes = link_shapes(robot)
    assert len(shapes) == read.ngeoms >= 7
    text = ElementTree.tostring(robot.description(), encoding="unicode")
    whole = pin.buildModelFromXML(text)
    folders = [str(folder) for folder in robot.packages]
    others = pin.buildGeomFromUrdfString(whole, text, pin.GeometryType.VISUAL, package_dirs=folders)
    q = pin.neutral(whole)
    rng = np.random.default_rng(3)
    own = rng.uniform(-1.0, 1.0, robot.dof)
    moved = robot.transmission.motion(own, own, own)[0]
    for joint, value in {**dict(zip(list(robot.model.names)[1:], moved, strict=True)), **robot.locked}.items():
        q[whole.joints[whole.getJointId(joint)].idx_q] = value
    data, placed = whole.createData(), others.createData()
    pin.updateGeometryPlacements(whole, data, others, placed, q)
    positions, rotations = robot.joint_poses(own[None])
    for shape, entry, place in zip(shapes, others.geometryObjects, placed.oMg, strict=True):
        corners = np.asarray(entry.geometry.vertices()) @ place.rotation.T + place.translation
        seen = shape.vertices
        if shape.joint:
            seen = seen @ rotations[0, shape.joint - 1].T + positions[0, shape.joint - 1]
        size = np.ptp(corners, axis=0).max()
        np.testing.assert_allclose(seen.min(axis=0), corners.min(axis=0), atol=0.1 * size)
        np.testing.assert_allclose(seen.max(axis=0), corners.max(axis=0), atol=0.1 * size)
        assert len(shape.triangles) <= 2000


def test_a_robot_without_geometry_has_no_shapes_and_a_damaged_one_gets_a_sentence(tmp_path):
    assert link_shapes(load_robot("puma560")) == ()
    broken = SOLIDS.replace('<box size="0.2 0.3 0.2"/>', '<box size="0.2 0.3"/>')
    refused(lambda: link_shapes(solids(tmp_path, broken)), "visual: <box>: expected 3 positive")
    (tmp_path / "mesh.stl").write_bytes(b"solid no mesh")
    mesh = SOLIDS.replace('<box size="0.2 0.3 0.2"/>', f'<mesh filename="{tmp_path}/mesh.stl"/>')
    refused(lambda: link_shapes(solids(tmp_path, mesh)), "mesh.stl: expected vertices of a mesh, got none")


def test_shapes_are_kept_until_a_mesh_changes_and_a_damaged_file_is_made_again(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    made = []
    monkeypatch.setattr(geometry, "read_geometry", lambda robot, kind: made.append(kind) or read_geometry(robot, kind))
    robot = solids(tmp_path)
    first = link_shapes(robot)
    again = link_shapes(robot)
    assert made == ["visual"]
    for one, other in zip(first, again, strict=True):
        np.testing.assert_array_equal(one.vertices, other.vertices)
        np.testing.assert_array_equal(one.triangles, other.triangles)
        assert (one.link, one.joint, one.colour) == (other.link, other.joint, other.colour)
    (file,) = (tmp_path / "cache" / "trajevo" / "links").iterdir()
    file.write_bytes(b"no archive")
    assert len(link_shapes(robot)) == 3
    assert made == ["visual", "visual"]
    assert len(link_shapes(solids(tmp_path, SOLIDS.replace("0.05", "0.06")))) == 3
    assert len(made) == 3
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "solids.urdf"))  # no place for a cache
    assert len(link_shapes(robot)) == 3
