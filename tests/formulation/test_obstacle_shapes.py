"""Capsules, hulls and planes: distances against closed forms and MuJoCo, derivatives, and what is refused."""

import json

import coal
import numpy as np
import pinocchio
import pytest

from tests.formulation.test_clearance import LIMITS, centre, rollout, states
from tests.helpers import assert_exact_gradients, refused
from trajevo import ViaPointProblem, certify, check, optimise
from trajevo.formulation.constraints.clearance import clearance_along, clearance_limit
from trajevo.formulation.constraints.collision import Collision
from trajevo.formulation.constraints.scene import Box, Capsule, Hull, Plane, Scene, Sphere

SLANTED = Plane(name="ramp", position=(0.3, 0.1, 0.2), normal=(0.2, -0.4, 2.0))


def test_distance_of_hulls_to_a_plane_is_that_of_their_lowest_corner(xarm):
    collision, q = Collision(xarm, Scene((SLANTED,))), states(xarm, 300, seed=1)
    found = collision.distances(q)
    assert (found < 0.0).any()
    normal = np.array([0.2, -0.4, 2.0]) / np.linalg.norm([0.2, -0.4, 2.0])
    with collision._buffers() as (geometry, places, data):
        assert all(isinstance(entry.geometry, coal.Convex) for entry in list(geometry.geometryObjects)[:-1])
        moving = [k for k, entry in enumerate(geometry.geometryObjects) if entry.parentJoint > 0]
        for row, configuration in zip(found, q, strict=True):
            pinocchio.updateGeometryPlacements(xarm.model, places, geometry, data, configuration)
            for gap, k in zip(row, moving, strict=True):
                corners = np.asarray(geometry.geometryObjects[k].geometry.points())
                at = corners @ data.oMg[k].rotation.T + data.oMg[k].translation
                assert abs(((at - SLANTED.position) @ normal).min() - gap) < 1e-12


def test_distance_of_a_ball_to_a_plane(ball):
    q = states(ball, 50, seed=1)
    above = Plane(position=(0.0, 0.0, 0.1))
    np.testing.assert_allclose(Collision(ball, Scene((above,))).distances(q)[:, 0], 0.05, atol=1e-12)
    wall = Plane(position=(9.0, -7.0, 3.0), rpy=(0.0, -0.5 * np.pi, 0.0))  # its free side is towards -x
    expected = 9.0 - centre(q)[:, 0] - 0.05
    np.testing.assert_allclose(Collision(ball, Scene((wall,))).distances(q)[:, 0], expected, atol=1e-12)


def test_planes_are_told_by_a_normal_or_by_angles():
    for normal in ((0.0, 0.0, 3.0), (0.0, 0.0, -1.0), (1.0, 2.0, -0.5), (-4.0, 0.0, 0.0)):
        rotation = Plane(position=(0, 0, 0), normal=normal).rotation
        np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
        np.testing.assert_allclose(rotation[:, 2], np.array(normal) / np.linalg.norm(normal), atol=1e-12)
        assert np.linalg.det(rotation) > 0.0


def test_a_plane_is_a_slab_that_is_larger_than_the_reach(xarm):
    """Distances outside, and their derivatives, to a box whose top is the plane."""
    slab = Box(position=SLANTED.position - 5.0 * SLANTED.rotation[:, 2], size=(10.0, 10.0, 10.0), rpy=(0, 0, 0))
    given = {key: value for key, value in slab.settings.items() if key != "rpy"}
    boxed = Scene.of({"obstacles": [given | {"rotation": SLANTED.rotation.tolist()}]})
    q = states(xarm, 100, seed=3)
    some = [Collision(xarm, scene) for scene in (Scene((SLANTED,)), boxed)]
    plane, box = (each.distances(q) for each in some)
    clear = box > 1e-3
    assert clear.sum() > 100
    np.testing.assert_allclose(plane[clear], box[clear], atol=1e-6)
    state, pair = np.nonzero(clear)
    slopes = [each.slopes_of(q, state, pair) for each in some]
    assert np.quantile(np.abs(slopes[0] - slopes[1]).max(axis=1), 0.95) < 1e-3  # corners lie in one plane at times


def test_slopes_of_planes_and_capsules_are_finite_differences(xarm):
    pole = Capsule(name="pole", position=(0.4, 0.3, 0.3), rpy=(0.3, 0.5, 0.0), radius=0.08, length=0.4)
    collision, q = Collision(xarm, Scene((SLANTED, pole))), states(xarm, 60, seed=1)
    state, pair = (index.ravel() for index in np.indices((len(q), len(collision.pairs))))
    slopes = collision.slopes_of(q, state, pair).reshape(len(q), len(collision.pairs), -1)
    direction, h = np.random.default_rng(2).normal(size=q.shape), 1e-6
    numerical = (collision.distances(q + h * direction) - collision.distances(q - h * direction)) / (2.0 * h)
    error = np.abs(numerical - np.einsum("npj,nj->np", slopes, direction))
    assert np.quantile(error, 0.95) < 1e-4
    assert error.max() < 1e-2


def test_distance_of_a_ball_to_a_capsule_and_to_a_hull(ball):
    q = states(ball, 200, seed=2)
    pole = Capsule(position=(0.5, -0.1, 0.3), rpy=(0.3, -0.4, 1.0), radius=0.06, length=0.3)
    local = (centre(q) - pole.position) @ pole.rotation
    local[:, 2] -= np.clip(local[:, 2], -0.15, 0.15)
    expected = np.linalg.norm(local, axis=1) - 0.06 - 0.05
    np.testing.assert_allclose(Collision(ball, Scene((pole,))).distances(q)[:, 0], expected, atol=1e-6)
    box = Box(position=(0.5, -0.1, 0.3), rpy=(0.3, -0.4, 1.0), size=(0.2, 0.3, 0.1))
    corners = 0.5 * np.array(box.size) * np.array(list(np.ndindex(2, 2, 2))) * 2.0 - 0.5 * np.array(box.size)
    hull = Hull(position=box.position, rpy=box.rpy, points=corners)
    found = [Collision(ball, Scene((solid,))).distances(q)[:, 0] for solid in (box, hull)]
    np.testing.assert_allclose(found[1], found[0], atol=2e-6)


def test_mujoco_finds_the_same_distances(ball):
    mujoco = pytest.importorskip("mujoco")
    pole = Capsule(name="pole", position=(0.5, -0.1, 0.3), rpy=(0.3, -0.4, 1.0), radius=0.06, length=0.3)
    floor = Plane(name="floor", position=(0.0, 0.0, 0.02), normal=(0.1, 0.2, 1.0))
    collision = Collision(ball, Scene((pole, floor)))
    x, y = pole.rotation[:, 0], pole.rotation[:, 1]
    u, v = floor.rotation[:, 0], floor.rotation[:, 1]
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><worldbody>
        <geom name="pole" type="capsule" size="0.06 0.15" pos="0.5 -0.1 0.3"
          xyaxes="{" ".join(map(str, [*x, *y]))}"/>
        <geom name="floor" type="plane" size="9 9 1" pos="0 0 0.02" xyaxes="{" ".join(map(str, [*u, *v]))}"/>
        <body pos="0 0 0.2"><joint type="slide" axis="1 0 0"/><joint axis="0 0 1"/>
        <geom name="ball" size="0.05" pos="0.4 0 0" mass="1"/></body></worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    for q in states(ball, 20, seed=5):
        data.qpos[:] = q
        mujoco.mj_forward(model, data)
        expected = [mujoco.mj_geomDistance(model, data, k, model.geom("ball").id, 10.0, None) for k in (0, 1)]
        np.testing.assert_allclose(collision.distances(q[None])[0], expected, atol=1e-6)


FLOOR = {"name": "floor", "shape": "plane", "position": [0.0, 0.0, 0.0]}


@pytest.mark.parametrize("seed", range(3))
def test_bounds_over_a_floor_are_not_above_dense_minima(xarm, seed):
    scene = Scene.of({"clearance": 0.05, "obstacles": [FLOOR]})
    points = states(xarm, 4, seed, most=1.8)
    motions = rollout(xarm, points, 4, seed)
    least = clearance_limit(xarm, scene).function.least(motions.trajectory)[:, 0]
    dense = clearance_along(motions, scene, density=150).least(itself=False).min(axis=1)
    proven = least >= 0.05
    assert (least[proven] <= dense[proven] + 1e-6).all()
    np.testing.assert_allclose(least[~proven], dense[~proven], atol=0.02)


def standing(**scene):
    return ViaPointProblem(
        robot={"name": "xarm7", "limits": LIMITS},
        points=[[0, 0.9, 0, 1.6, 0, 0.7, 0], [0.4, 1.0, 0, 1.7, 0, 0.6, 0], [0.8, 0.9, 0, 1.6, 0, 0.7, 0]],
        objectives=("time", "jerk"),
        constraints=("velocity", "acceleration", "jerk"),
        duration_bounds=(0.3, 4.0),
        scene=scene,
    )


def test_a_robot_stands_on_a_floor_that_its_base_touches():
    """The base is not checked, nor what need not stay away; every motion would miss the clearance otherwise."""
    lowest = ("link1", "link2")
    blocked = standing(clearance=0.3, obstacles=[FLOOR])
    assert [finding for finding in check(blocked).findings if "clearance" in str(finding) or "floor" in str(finding)]
    free = standing(clearance=0.03, obstacles=[FLOOR | {"touches": list(lowest)}])
    front = optimise(free, seed=1, population=16, generations=4, progress=False, polish=False)
    best = front.pick("0")
    rows = [row for row in certify(best).rows if row.quantity.startswith("clearance")]
    assert len(rows) == 1
    assert rows[0].proven
    assert "floor" in rows[0].between
    assert not {name.rsplit("_", 1)[0] for name in rows[0].between} & set(lowest)


def test_gradients_over_a_floor_are_finite_differences():
    task = standing(clearance=0.05, obstacles=[FLOOR | {"touches": ["link1", "link2"]}])
    assert_exact_gradients(task, np.random.default_rng(0).uniform(0.4, 2.0, (4, task.n_var)))


def test_settings_of_all_shapes_make_an_equal_scene_through_json():
    scene = Scene(
        (
            Capsule(name="pole", position=(1, 0, 0), radius=0.1, length=0.2, touches=("link1",)),
            Hull(name="wedge", position=(1, 0, 0), points=((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))),
            Plane(name="floor", position=(0, 0, -1)),
            Plane(name="wall", position=(0, 3, 0), normal=(0, -1, 0)),
            Sphere(name="lamp", position=(0, 0, 2), radius=0.1),
        ),
        clearance=0.02,
    )
    settings = json.loads(json.dumps(scene.settings))
    assert Scene.of(settings) == scene
    assert set(settings) == {"clearance", "self_clearance", "obstacles"}
    assert set(settings["obstacles"][4]) == {"name", "shape", "position", "rpy", "radius"}


def obstacle(**given):
    return {"obstacles": [{"name": "it", "position": [0.0, 0.0, 0.0], **given}]}


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (obstacle(shape="plane", normal=[0, 0, 0]), "obstacle 'it': normal: expected a direction, got"),
        (obstacle(shape="plane", normal=[0, 0, 1], rpy=[0.1, 0, 0]), "normal: expected either normal or rpy, got both"),
        (
            obstacle(shape="plane", size=[1, 1, 1]),
            "obstacle 'it': size: unknown key; known: motion, name, normal",
        ),
        (obstacle(shape="plane", position=[0, 0, 500]), "'it': expected an obstacle within 100 m of the base"),
        (obstacle(shape="capsule", radius=0.1), "obstacle 'it': length: expected a value"),
        (obstacle(shape="hull", points=[[0, 0, 0]]), "obstacle 'it': points: expected 4 to 100000 points, got 1"),
        (obstacle(shape="hull", points=[[0, 0]]), "obstacle 'it': points: expected shape"),
        (obstacle(shape="hull", points=200 * np.eye(4, 3)), "points: a solid of 200 m looks like mm"),
        (obstacle(shape="sphere", radius=0.1, touches="link1"), "touches: expected a list of names of links"),
    ],
)
def test_bad_shapes_are_refused_by_key(given, says):
    refused(lambda: Scene.of(given), says)


def test_what_touches_must_exist_and_hulls_are_solids(xarm):
    touching = Scene((Sphere(name="lamp", position=(2, 0, 0), radius=0.1, touches=("link_1",)),))
    refused(lambda: Collision(xarm, touching), "link or body that touches 'lamp' 'link_1'.*did you mean 'link1'")
    flat = Hull(name="sheet", position=(2, 0, 0), points=((0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)))
    refused(
        lambda: Collision(xarm, Scene((flat,))), "obstacle 'sheet': points: expected a solid, got 4 vertices in one"
    )
