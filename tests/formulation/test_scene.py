"""Scenes: plain data there and back, and what is refused."""

import json

import numpy as np
import pytest

from tests.helpers import refused
from trajevo.formulation.constraints.scene import Box, Cylinder, Scene, Sphere

DATA = {
    "clearance": 0.03,
    "self_clearance": 0.01,
    "obstacles": [
        {"name": "table", "shape": "box", "size": [1.0, 0.8, 0.05], "position": [0.5, 0, -0.1], "rpy": [0, 0, 0.3]},
        {"name": "lamp", "shape": "sphere", "radius": 0.1, "position": [0.3, 0.3, 0.8]},
        {"shape": "cylinder", "radius": 0.05, "length": 0.6, "position": [0.4, -0.4, 0.3], "rpy": [1.0, 0.2, -2.0]},
    ],
}


def changed(obstacle: int, **changes):
    """The scene with other entries of one obstacle; None drops one."""
    entries = {key: value for key, value in {**DATA["obstacles"][obstacle], **changes}.items() if value is not None}
    return {"obstacles": [entries]}


def test_settings_make_an_equal_scene_also_through_json():
    scene = Scene.of(DATA)
    assert Scene.of(json.loads(json.dumps(scene.settings))) == scene
    assert [type(obstacle) for obstacle in scene.obstacles] == [Box, Sphere, Cylinder]
    assert scene.obstacles[2].name == "3"
    assert Scene.of(scene) is scene


@pytest.mark.parametrize("rpy", [(0.3, -0.7, 2.1), (3.0, 1.2, -3.0), (0.4, np.pi / 2, 0.0), (-0.4, -np.pi / 2, 0.9)])
def test_a_rotation_matrix_means_the_same_as_its_angles(rpy):
    turned = Sphere(position=(0, 0, 0), rpy=rpy, radius=0.1)
    again = Scene.of(changed(1, rotation=turned.rotation.tolist())).obstacles[0]
    np.testing.assert_allclose(again.rotation, turned.rotation, atol=1e-7)


def test_roll_pitch_yaw_are_those_of_a_urdf():
    """Roll first, then pitch, then yaw, about fixed axes."""
    quarter = np.pi / 2
    turned = Sphere(position=(0, 0, 0), rpy=(quarter, 0.0, quarter), radius=0.1).rotation
    np.testing.assert_allclose(turned @ [0, 1, 0], [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(turned @ [1, 0, 0], [0, 1, 0], atol=1e-12)


def test_obstacles_without_a_name_are_numbered():
    ball = Sphere(position=(0, 0, 1), radius=0.1)
    assert [entry.name for entry in Scene((ball, ball)).obstacles] == ["obstacle 1", "obstacle 2"]


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (changed(0, size=[1.0, -1.0, 1.0]), "obstacle 'table': size: expected positive lengths"),
        (changed(0, size=[1.0, 1.0]), "obstacle 'table': size: expected shape"),
        (changed(0, size=None), "obstacle 'table': size: expected a value"),
        (changed(0, position=None), "obstacle 'table': position: expected a value"),
        (changed(0, position="here"), "obstacle 'table': position: expected numbers"),
        (changed(0, position=[0, np.nan, 0]), "obstacle 'table': position: expected finite"),
        (changed(0, colour="red"), "obstacle 'table': colour: unknown key; known: motion, name, position"),
        (changed(0, radius=1.0), "obstacle 'table': radius: unknown key"),
        (changed(0, rotation=np.eye(3).tolist()), "obstacle 'table': rotation: expected either"),
        (changed(1, rotation=(2 * np.eye(3)).tolist()), "obstacle 'lamp': rotation: expected a rotation matrix"),
        (changed(1, radius=0.0), "obstacle 'lamp': radius: expected a number above 0"),
        (changed(1, radius=True), "obstacle 'lamp': radius: expected a number above 0"),
        (changed(1, radius="big"), "obstacle 'lamp': radius: expected a number above 0"),
        (
            changed(1, shape="cone"),
            "unknown shape of obstacle 'lamp' 'cone'; known: box, capsule, cylinder, hull, mesh, plane, sphere",
        ),
        (
            changed(1, shape=None),
            "obstacle 'lamp': shape: expected one of box, capsule, cylinder, hull, mesh, plane, sphere",
        ),
        (changed(1, name=3), "expected text as name, got 3"),
        (changed(2, length=np.inf), "obstacle '1': length: expected a number above 0"),
        ({"obstacles": ["table"]}, "obstacle 1: expected a mapping"),
        ({"obstacles": {"table": 1}}, "scene: obstacles: expected a list"),
        ({"obstacles": [DATA["obstacles"][0]] * 2}, "expected names that differ, got 'table' twice"),
        ({**DATA, "clearance": -0.1}, "scene: clearance: expected a number from 0 on"),
        ({**DATA, "clearance": None}, "scene: clearance: expected a number from 0 on"),
        ({**DATA, "self_clearance": np.nan}, "scene: self_clearance: expected a number from 0 on"),
        (
            {**DATA, "floor": 0.0},
            "scene: floor: unknown key; known: attached, clearance, file, obstacles, self_clearance",
        ),
        ({}, "expected obstacles or a self_clearance, got neither"),
        ([], "scene: expected a mapping"),
    ],
)
def test_bad_scenes_are_refused_by_obstacle_and_key(given, says):
    refused(lambda: Scene.of(given), says)


def test_a_scene_takes_obstacles_only():
    refused(lambda: Scene((1,)), "scene: obstacles: expected boxes, spheres, cylinders, meshes and planes")
