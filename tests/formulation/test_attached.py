"""Solids attached to links: where they are, what they are checked against, and what is refused."""

import json

import numpy as np
import pinocchio as pin
import pytest

from tests.formulation.test_clearance import LIMITS, rollout, states
from tests.helpers import assert_exact_gradients, mostly_long, refused
from trajevo import Robot, Scene, ViaPointProblem, certify, check, load_robot, load_task, optimise
from trajevo.formulation.constraints.clearance import clearance_along, clearance_limit
from trajevo.formulation.constraints.collision import CarriedSolid, Collision
from trajevo.formulation.constraints.scene import Attached, Box, Plane, Sphere

CAMERA = {"name": "camera", "on": "link4", "shape": "sphere", "radius": 0.04, "position": [0.1, 0.05, -0.1]}
LAMP = {"name": "lamp", "shape": "sphere", "radius": 0.1, "position": [0.5, 0.3, 0.6]}


@pytest.fixture(scope="module")
def xarm():
    return load_robot("xarm7", limits=LIMITS)


def places(robot, frame, q):
    """Poses of a frame by Pinocchio."""
    data, number = robot.model.createData(), robot.model.getFrameId(frame, pin.FrameType.BODY)
    for configuration in q:
        pin.framesForwardKinematics(robot.model, data, configuration)
        yield data.oMf[number].copy()


def test_an_attached_ball_moves_with_its_link(xarm):
    scene, q = Scene.of({"obstacles": [LAMP], "attached": [CAMERA]}), states(xarm, 50, seed=1)
    collision = Collision(xarm, scene)
    column = [pair.first for pair in collision.pairs].index("camera")
    centres = np.array([place.act(np.array(CAMERA["position"])) for place in places(xarm, "link4", q)])
    expected = np.linalg.norm(centres - LAMP["position"], axis=1) - 0.14
    np.testing.assert_allclose(collision.distances(q)[:, column], expected, atol=1e-8)
    bare = Collision(xarm, Scene.of({"obstacles": [LAMP]}))
    np.testing.assert_array_equal(np.delete(collision.distances(q), column, axis=1), bare.distances(q))


def test_it_is_checked_against_links_that_are_not_next_to_its_own(xarm):
    both = Collision(xarm, Scene.of({"self_clearance": 0.01, "attached": [CAMERA]}))
    against = {
        ({pair.first, pair.second} - {"camera"}).pop() for pair in both.pairs if "camera" in (pair.first, pair.second)
    }
    assert against
    assert not against & {"link3_0", "link4_0", "link5_0"}
    freed = Collision(xarm, Scene.of({"self_clearance": 0.01, "attached": [CAMERA | {"touches": ["link7"]}]}))
    assert "link7_0" in against
    assert len(freed.pairs) == len(both.pairs) - 1


def test_what_touches_is_told_on_either_side(xarm):
    floor = {"name": "floor", "shape": "plane", "position": [0, 0, 0]}
    for attached, obstacle in ((CAMERA | {"touches": ["floor"]}, floor), (CAMERA, floor | {"touches": ["camera"]})):
        pairs = Collision(xarm, Scene.of({"obstacles": [obstacle], "attached": [attached]})).pairs
        assert pairs
        assert not [pair for pair in pairs if pair.first == "camera"]


def test_a_load_is_checked_against_what_is_attached(xarm):
    scene = Scene.of({"self_clearance": 0.0, "attached": [CAMERA], "obstacles": [LAMP]})
    load = CarriedSolid(Box(name="part", position=(0, 0, 0.1), size=(0.1, 0.1, 0.1)))
    named = [(pair.first, pair.second) for pair in Collision(xarm, scene, load).pairs]
    assert ("part", "camera") in named
    assert ("part", "lamp") in named
    assert {first for first, _ in named} == {"part"}


@pytest.mark.parametrize("seed", range(2))
def test_proven_bounds_are_not_above_dense_minima(xarm, seed):
    scene = Scene.of({"clearance": 0.03, "self_clearance": 0.01, "obstacles": [LAMP], "attached": [CAMERA]})
    motions = rollout(xarm, states(xarm, 4, seed, most=0.8), 5, seed)
    wanted, limit = np.array([0.03, 0.01]), clearance_limit(xarm, scene)
    least, profile = limit.function.least(motions.trajectory), clearance_along(motions, scene, density=150)
    dense = np.stack([profile.least(itself=kind).min(axis=1) for kind in (False, True)], axis=1)
    proven = least >= wanted
    assert (least[proven] <= dense[proven] + 1e-6).all()
    assert (dense[~proven] <= wanted[np.nonzero(~proven)[1]] + 1e-3).all()


def planar(**scene):
    """A robot without geometry of its own: two links in a plane, with solids on both."""
    robot = Robot.planar(
        [0.4, 0.3],
        [1.0, 0.5],
        [0.2, 0.15],
        [0.01, 0.01],
        limits={"position": [-2.0, 2.0], "velocity": 3.0, "acceleration": 10.0, "jerk": 100.0, "effort": 50.0},
    )
    along = [0.0, 0.5 * np.pi, 0.0]
    rods = [
        {"name": f"rod {k}", "on": f"link_{k}", "shape": "capsule", "radius": 0.03, "length": length, "rpy": along}
        | {"position": [0.5 * length, 0.0, 0.0]}
        for k, length in ((1, 0.4), (2, 0.3))
    ]
    return ViaPointProblem(
        robot=robot,
        points=[[-0.8, 0.2], [0.0, 0.3], [0.8, 0.2]],
        moving=[{"point": 1, "joints": [0.3, 1.5]}],
        objectives=("time", "jerk"),
        constraints=("velocity", "acceleration", "jerk"),
        duration_bounds=(0.2, 3.0),
        scene={"clearance": 0.02, "attached": rods} | scene,
    )


POST = {"name": "post", "shape": "cylinder", "radius": 0.05, "length": 1.0, "position": [0.62, 0.0, 0.0]}


@pytest.mark.parametrize("polish", mostly_long([False, True], False))
def test_a_robot_without_geometry_goes_around_a_post_with_solids_on_its_links(polish):
    task = planar(obstacles=[POST])
    assert not check(task).impossible
    best = optimise(task, seed=1, population=24, generations=12, polish=polish, progress=False).pick("0")
    (row,) = [row for row in certify(best).rows if row.quantity.startswith("clearance")]
    assert row.proven
    assert set(row.between) <= {"rod 1", "rod 2", "post"}
    q = best.trajectory.evaluate(np.linspace(0.0, float(best.trajectory.duration[0]), 2000))[0]
    elbow = 0.4 * np.stack([np.cos(q[:, 0]), np.sin(q[:, 0])], axis=1)
    tip = elbow + 0.3 * np.stack([np.cos(q.sum(axis=1)), np.sin(q.sum(axis=1))], axis=1)
    share = np.clip(((np.array([0.62, 0.0]) - elbow) * (tip - elbow)).sum(axis=1) / 0.09, 0.0, 1.0)
    away = np.linalg.norm(elbow + share[:, None] * (tip - elbow) - [0.62, 0.0], axis=1)
    assert away.min() > 0.05 + 0.03 + 0.02 - 1e-6
    assert_exact_gradients(task, np.vstack([best.x, best.x + 0.01]))


def test_settings_make_the_same_again_through_json():
    task = planar(obstacles=[POST])
    settings = json.loads(json.dumps(task.settings))
    again = ViaPointProblem(**settings)
    assert Scene.of(settings["scene"]) == Scene.of(again.settings["scene"])
    x = np.random.default_rng(0).uniform(task.xl, task.xu, (3, task.n_var))
    np.testing.assert_array_equal(task.evaluate(x)[1], again.evaluate(x)[1])


TASK = """format = 1
robot = { name = "xarm7" }
points = [[0, 0.9, 0, 1.6, 0, 0.7, 0], [0.8, 0.9, 0, 1.6, 0, 0.7, 0]]
duration_bounds = [0.3, 4.0]
objectives = ["time", "jerk"]
[limits]
acceleration = 10.0
jerk = 100.0
[scene]
clearance = 0.02
self_clearance = 0.01
[[scene.obstacles]]
name = "floor"
shape = "plane"
position = [0.0, 0.0, 0.0]
touches = ["link1"]
[[scene.attached]]
name = "hose"
on = "link5"
shape = "capsule"
radius = 0.02
length = 0.2
position = [0.0, 0.08, 0.0]
"""


def test_a_task_attaches_solids(tmp_path):
    (tmp_path / "task.toml").write_text(TASK)
    scene = load_task(tmp_path / "task.toml").problem.settings["scene"]
    assert [(each["name"], each["on"]) for each in scene["attached"]] == [("hose", "link5")]
    assert scene["obstacles"][0]["touches"] == ["link1"]


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"on": "link_4"}, "unknown link that carries attached 'camera' 'link_4'; .*did you mean 'link4'"),
        ({"touches": ["lmap"]}, "unknown link or body that touches 'camera' 'lmap'; .*did you mean 'lamp'"),
        ({"on": 3}, "attached 'camera': on: expected the name of a link, got 3"),
        ({"radius": -1.0}, "obstacle 'camera': radius: expected a number above 0"),
        ({"name": "lamp"}, "expected names that differ, got 'lamp' twice"),
        ({"size": 1.0}, "obstacle 'camera': size: unknown key"),
    ],
)
def test_bad_attachments_are_refused(xarm, given, says):
    refused(lambda: Collision(xarm, Scene.of({"obstacles": [LAMP], "attached": [CAMERA | given]})), says)


def test_what_cannot_be_attached_is_refused():
    without = {key: value for key, value in CAMERA.items() if key != "on"}
    refused(
        lambda: Scene.of({"obstacles": [LAMP], "attached": [without]}),
        "'camera': on: expected the name of a link, got none",
    )
    refused(
        lambda: Scene.of({"obstacles": [LAMP], "attached": [3]}),
        "attached 1: expected a mapping with shape and on, got 3",
    )
    refused(lambda: Scene.of({"obstacles": [LAMP], "attached": CAMERA}), "scene: attached: expected a list of solids")
    refused(
        lambda: Attached(Plane(position=(0, 0, 0)), "link1"), "attached: expected a solid, one of box, .* got Plane"
    )
    refused(lambda: Scene((Sphere(position=(1, 0, 0), radius=0.1),), attached=(1,)), "scene: attached: expected solids")
