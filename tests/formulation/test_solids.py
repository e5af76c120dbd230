"""Meshes and their hulls are made once for all problems of a robot, and again when a file has changed."""

import os
import struct
from collections import OrderedDict

import numpy as np
import pytest

from trajevo import Scene, ViaPointProblem, load_robot
from trajevo.formulation.constraints import solids
from trajevo.formulation.constraints.scene import Sphere

URDF = """<robot name="arm"><link name="base"/>
<joint name="turn" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" velocity="2" effort="50"/></joint>
<link name="arm"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><mesh filename="{mesh}"/></geometry></collision></link></robot>"""


def write_tetrahedron(file, size):
    corners = size * np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    faces = corners[[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]]
    rows = [struct.pack("<12fH", 0.0, 0.0, 0.0, *face.ravel(), 0) for face in faces]
    file.write_bytes(bytes(80) + struct.pack("<I", 4) + b"".join(rows))


@pytest.fixture
def arm(tmp_path):
    mesh = tmp_path / "arm.stl"
    write_tetrahedron(mesh, 0.5)
    (tmp_path / "arm.urdf").write_text(URDF.format(mesh=mesh))
    return load_robot(tmp_path / "arm.urdf", limits={"acceleration": 5.0, "jerk": 50.0}), mesh


def radius(robot):
    (entry,) = solids.robot_geometry(robot)[0].geometryObjects
    return solids.bounding_ball(entry)[1]


def test_another_payload_makes_no_hull_again(arm, monkeypatch):
    robot, _ = arm
    scene = Scene(obstacles=[Sphere(position=(2.0, 2.0, 2.0), radius=0.1)])
    problem = ViaPointProblem(robot=robot, points=[[0.0], [0.5], [1.0]], scene=scene, payload=1.0)
    G = problem.evaluate(np.full((1, 2), 3.0), return_values_of=["G"])
    monkeypatch.setattr(solids, "_hull", lambda *_: pytest.fail("a hull was made again"))
    other = problem.with_payload(problem.dynamics.payload.with_mass(2.0))
    assert other.dynamics.payload.mass == 2.0
    clear = [k for k, name in enumerate(problem.constraint_names) if "clearance" in name]
    again = other.evaluate(np.full((1, 2), 3.0), return_values_of=["G"])
    assert clear
    np.testing.assert_array_equal(again[:, clear], G[:, clear])


def test_what_a_caller_adds_stays_its_own(arm):
    robot, _ = arm
    geometry, _ = solids.robot_geometry(robot)
    geometry.removeGeometryObject(geometry.geometryObjects[0].name)
    assert len(solids.robot_geometry(robot)[0].geometryObjects) == 1


def test_a_changed_mesh_is_read_again(arm):
    robot, mesh = arm
    before = radius(robot)
    write_tetrahedron(mesh, 1.0)
    os.utime(mesh, ns=(10**18, 10**18))
    assert radius(robot) == pytest.approx(2.0 * before)


def test_only_a_few_are_kept(arm, monkeypatch):
    _, mesh = arm
    monkeypatch.setattr(solids, "_kept", OrderedDict())
    for k in range(solids._MOST_KEPT + 3):
        (mesh.parent / f"arm_{k}.urdf").write_text(URDF.format(mesh=mesh))
        radius(load_robot(mesh.parent / f"arm_{k}.urdf", limits={"acceleration": 5.0, "jerk": 50.0}))
    assert len(solids._kept) == solids._MOST_KEPT
