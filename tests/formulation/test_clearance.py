"""Clearance: distances against closed forms, bounds that hold between samples, motions that keep clear."""

import copy
import pickle

import coal
import numpy as np
import pinocchio as pin
import pytest

import trajevo.formulation.constraints.collision
from tests.helpers import mostly_long, refused
from trajevo import ViaPoints, load_robot
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.formulation.constraints.clearance import clearance_along, clearance_limit
from trajevo.formulation.constraints.collision import Collision
from trajevo.formulation.constraints.scene import Box, Cylinder, Scene, Sphere
from trajevo.trajectory.interpolants import QuinticSpline

LIMITS = {"acceleration": 10.0, "jerk": 100.0}
SCENE = Scene(
    (
        Box(name="left", size=(0.2, 0.2, 0.4), position=(0.5, 0.3, 0.2)),
        Cylinder(name="right", radius=0.1, length=0.4, position=(0.4, -0.4, 0.3)),
    ),
    clearance=0.03,
    self_clearance=0.01,
)
#: A slide along x, on it an arm of 0.4 m that turns about z with a ball of 0.05 m at its end.
BALL = """<robot name="ball">
  <link name="base"/><link name="cart"/>
  <link name="arm"><collision><origin xyz="0.4 0 0"/><geometry><sphere radius="0.05"/></geometry></collision></link>
  <joint name="slide" type="prismatic"><parent link="base"/><child link="cart"/><axis xyz="1 0 0"/>
    <origin xyz="0 0 0.2"/><limit lower="-1" upper="1" velocity="2" effort="1"/></joint>
  <joint name="turn" type="revolute"><parent link="cart"/><child link="arm"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" velocity="2" effort="1"/></joint>
</robot>"""


def states(robot, count: int, seed: int, most: float = 1.5):
    lower, upper = np.maximum(robot.limits.lower, -most), np.minimum(robot.limits.upper, most)
    return np.random.default_rng(seed).uniform(lower, upper, (count, robot.dof))


def rollout(robot, points, B: int, seed: int, least: float = 0.5) -> Rollout:
    x = np.random.default_rng(seed).uniform(least, 2.0, (B, len(points) - 1))
    return Rollout(Dynamics(robot), QuinticSpline(ViaPoints(points), duration_bounds=(least, 2.0))(x))


def centre(q):
    """Where the ball is."""
    return np.stack([q[:, 0] + 0.4 * np.cos(q[:, 1]), 0.4 * np.sin(q[:, 1]), np.full(len(q), 0.2)], axis=1)


def test_distance_of_two_balls_is_that_of_their_centres(ball):
    scene = Scene((Sphere(position=(0.3, 0.2, 0.5), radius=0.1),))
    q = states(ball, 50, seed=1)
    expected = np.linalg.norm(centre(q) - [0.3, 0.2, 0.5], axis=1) - 0.15
    np.testing.assert_allclose(Collision(ball, scene).distances(q)[:, 0], expected, atol=1e-8)


def test_distance_of_a_ball_to_a_turned_box(ball):
    box = Box(position=(0.5, -0.1, 0.3), rpy=(0.3, -0.4, 1.0), size=(0.2, 0.3, 0.1))
    q = states(ball, 200, seed=2)
    local = np.abs((centre(q) - box.position) @ box.rotation) - 0.5 * np.array(box.size)
    expected = np.linalg.norm(np.maximum(local, 0.0), axis=1) + np.minimum(local.max(axis=1), 0.0) - 0.05
    assert (expected < 0.0).any()
    np.testing.assert_allclose(Collision(ball, Scene((box,))).distances(q)[:, 0], expected, atol=1e-6)


def test_distance_of_a_ball_to_a_turned_cylinder(ball):
    """Also deep inside, where coal is wrong for its own balls."""
    post = Cylinder(position=(0.3, -0.1, 0.2), rpy=(0.9, -0.4, 1.0), radius=0.2, length=0.5)
    q = states(ball, 500, seed=2)
    local = (centre(q) - post.position) @ post.rotation
    beyond = np.stack([np.linalg.norm(local[:, :2], axis=1) - 0.2, np.abs(local[:, 2]) - 0.25], axis=1)
    expected = np.linalg.norm(np.maximum(beyond, 0.0), axis=1) + np.minimum(beyond.max(axis=1), 0.0) - 0.05
    assert (expected < -0.15).any()
    np.testing.assert_allclose(Collision(ball, Scene((post,))).distances(q)[:, 0], expected, atol=1e-6)


def test_an_obstacle_may_be_called_like_a_link(ball):
    scene = Scene((Sphere(name="arm_0", position=(0, 0, 2.0), radius=0.1),))
    assert [(pair.first, pair.second, pair.itself) for pair in Collision(ball, scene).pairs] == [
        ("arm_0", "arm_0", False)
    ]


def test_distances_of_some_pairs_are_those_of_all(xarm):
    collision, q = Collision(xarm, SCENE), states(xarm, 20, seed=3)
    state, pair = (index.ravel() for index in np.indices((20, len(collision.pairs))))
    some = collision.distances_of(q, state, pair).reshape(20, -1)
    np.testing.assert_allclose(some, collision.distances(q), atol=1e-9)


def test_convex_hulls_never_overestimate_the_distance_of_the_meshes(xarm):
    """Against the meshes themselves, by coal, without a hull."""
    q = states(xarm, 3, seed=4)
    text = xarm.urdf.read_text()
    folders = [str(folder) for folder in xarm.packages]
    meshes = pin.buildGeomFromUrdfString(xarm.model, text, pin.GeometryType.COLLISION, package_dirs=folders)
    assert isinstance(meshes.geometryObjects[3].geometry, coal.BVHModelBase)
    collision = Collision(xarm, SCENE)
    box, placement = coal.Box(0.2, 0.2, 0.4), coal.Transform3s(np.eye(3), np.array([0.5, 0.3, 0.2]))
    data, places = meshes.createData(), xarm.model.createData()
    columns = {pair.first: k for k, pair in enumerate(collision.pairs) if pair.second == "left"}
    for configuration, hulls in zip(q, collision.distances(q), strict=True):
        pin.updateGeometryPlacements(xarm.model, places, meshes, data, configuration)
        for entry, at in zip(meshes.geometryObjects, data.oMg, strict=True):
            if entry.parentJoint == 0:
                continue
            where = coal.Transform3s(at.rotation, at.translation)
            mesh = coal.distance(entry.geometry, where, box, placement, coal.DistanceRequest(), coal.DistanceResult())
            gap = hulls[columns[entry.name]]
            assert gap <= mesh + 1e-5
            assert mesh < 0.0 or gap > mesh - 0.1


def test_every_distance_is_a_finite_number_and_repeats_exactly(xarm):
    """coal answers -1.8e308 where it does not find the depth of an overlap."""
    collision, q = Collision(xarm, SCENE), states(xarm, 2000, seed=7)
    distances = collision.distances(q)
    assert (np.abs(distances) < 3.0).all()
    assert (distances < 0.0).any()
    np.testing.assert_array_equal(collision.distances(q), distances)


def test_overlaps_of_unknown_depth_are_overlaps(xarm, monkeypatch):
    collision, q = Collision(xarm, SCENE), states(xarm, 500, seed=7)
    usual = collision.distances(q)
    make = trajevo.formulation.constraints.collision._distance_data

    def impatient(geometry):
        data = make(geometry)
        for request in data.distanceRequests:
            request.epa_tolerance, request.epa_max_iterations = 1e-13, 1000
        return data

    monkeypatch.setattr(trajevo.formulation.constraints.collision, "_distance_data", impatient)
    hurried = Collision(xarm, SCENE).distances(q)
    assert (np.abs(hurried - usual) > 1e-3).any()
    assert (hurried[usual < 0.0] < 0.0).all()
    assert (np.abs(hurried) < 3.0).all()


def test_pairs_are_neither_neighbours_nor_always_in_touch(xarm):
    z1 = load_robot("z1", limits=LIMITS)
    collision = Collision(z1, Scene(self_clearance=0.0))
    joints = {"link00": 0, "link02": 2, "link03": 3, "link04": 4, "link06": 6, "gripperStator": 6, "gripperMover": 7}
    for pair in collision.pairs:
        first, second = (joints[name.rsplit("_", 1)[0]] for name in (pair.first, pair.second))
        assert abs(first - second) > 1
        assert pair.itself
    scene = Scene(SCENE.obstacles, clearance=0.03)
    assert len(Collision(xarm, scene).pairs) == 7 * 2
    assert clearance_limit(xarm, scene).names == ("clearance to obstacles",)
    assert clearance_limit(z1, Scene(self_clearance=0.0)).names == ("clearance to itself",)


def test_links_that_always_touch_are_skipped_and_listed(tmp_path):
    """Three balls on one axis that overlap in every configuration."""
    solid = '<collision><geometry><sphere radius="0.2"/></geometry></collision>'
    links = "".join(f'<link name="l{k}">{solid}</link>' for k in range(4))
    joints = "".join(
        f'<joint name="j{k}" type="revolute"><parent link="l{k}"/><child link="l{k + 1}"/><axis xyz="0 0 1"/>'
        f'<origin xyz="0 0 {0.15 if k < 2 else 1.0}"/><limit lower="-1" upper="1" velocity="1" effort="1"/></joint>'
        for k in range(3)
    )
    file = tmp_path / "stack.urdf"
    file.write_text(f'<robot name="stack">{links}{joints}</robot>')
    collision = Collision(load_robot(file, limits=LIMITS), Scene(self_clearance=0.01))
    assert [(pair.first, pair.second) for pair in collision.skipped] == [("l2_0", "l0_0")]
    assert {(pair.first, pair.second) for pair in collision.pairs} == {("l3_0", "l0_0"), ("l1_0", "l3_0")}


@pytest.mark.parametrize("seed", mostly_long(range(3), 0))
def test_no_distance_changes_faster_than_the_reach_allows(xarm, ball, seed):
    """Finite differences in random directions, also where a slide is far out."""
    for robot in (xarm, ball):
        collision, q = Collision(robot, SCENE), states(robot, 200, seed, most=3.0)
        step = 1e-4 * np.random.default_rng(seed).normal(size=q.shape)
        change = np.abs(collision.distances(q + step) - collision.distances(q))
        bounds = np.abs(step) @ collision.reach(q.min(axis=0)[None], q.max(axis=0)[None])[0].T
        assert (change <= bounds + 1e-8).all()
        assert (change > 0.5 * bounds).any()


@pytest.mark.parametrize("seed", mostly_long(range(4), 0, 1))
def test_the_proven_bound_is_never_above_what_dense_samples_find(xarm, seed):
    motions = rollout(xarm, states(xarm, 4, seed, most=0.8), 5, seed)
    limit = clearance_limit(xarm, SCENE)
    wanted = np.array([SCENE.clearance, SCENE.self_clearance])
    least = limit.function.least(motions.trajectory)
    profile = clearance_along(motions, SCENE, density=150)
    dense = np.stack([profile.least(itself=kind).min(axis=1) for kind in (False, True)], axis=1)
    proven = least >= wanted
    assert (least[proven] <= dense[proven] + 1e-6).all()
    assert (dense[proven] >= wanted[np.nonzero(proven)[1]]).all()
    np.testing.assert_allclose(limit.function(motions), (wanted - least) / np.array([0.03, 0.01]), atol=1e-12)
    # What is not proven is missed by no more than the tolerance, and what collides is found as deep as it is.
    assert (dense[~proven] <= wanted[np.nonzero(~proven)[1]] + 1e-3).all()
    np.testing.assert_allclose(least[~proven], dense[~proven], atol=0.02)


def test_some_motions_keep_clear_and_others_do_not(xarm):
    clear = np.zeros((4, 7))
    clear[:, 3], clear[:, 0] = (0.5, 0.8, 0.6, 0.9), (-0.1, 0.0, 0.1, 0.0)
    limit = clearance_limit(xarm, SCENE)
    assert (limit.function(rollout(xarm, clear, 3, 0)) <= 0.0).all()
    through = clear.copy()
    through[:, 0], through[:, 1] = (-0.1, 0.5, 1.0, 1.2), 0.6
    assert (limit.function(rollout(xarm, through, 3, 0))[:, 0] > 0.0).all()


def test_a_touch_between_samples_is_found(ball):
    """The ball dashes past an obstacle that it touches for a moment only, and past one that it just misses."""
    points = np.array([[-1.0, 0.0], [0.0, 0.0], [1.0, 0.0]])
    motion = rollout(ball, points, 1, 0)
    q = motion.trajectory.evaluate(np.array([0.37 * motion.trajectory.duration[0]]))[0, 0]
    x = q[0] + 0.4
    for gap, sign in ((-0.002, 1.0), (0.002, -1.0)):
        pin_head = Sphere(position=(x, 0.055 + gap, 0.2), radius=0.005)
        limit = clearance_limit(ball, Scene((pin_head,)), tolerance=1e-4)
        assert np.sign(limit.function(motion)[0, 0]) == sign


def test_a_slide_beyond_its_stroke_is_bounded_too(ball):
    """Reach follows where the motion goes, not where the limits would have it."""
    wide = rollout(ball, np.array([[0.0, 0.0], [6.0, 3.0], [0.0, 0.0]]), 2, 0)
    scene = Scene((Sphere(position=(3.0, 1.5, 0.2), radius=0.3),), clearance=0.1)
    least = clearance_limit(ball, scene).function.least(wide.trajectory)[:, 0]
    dense = clearance_along(wide, scene, density=300).least(itself=False).min(axis=1)
    assert (least <= dense + 1e-4).all()


def test_copies_and_single_motions_give_equal_values(xarm):
    motions = rollout(xarm, states(xarm, 4, 1, most=0.8), 4, 1)
    limit = clearance_limit(xarm, SCENE)
    values = limit.function(motions)
    for other in (pickle.loads(pickle.dumps(limit)), copy.deepcopy(limit)):
        assert other.names == limit.names
        np.testing.assert_array_equal(other.function(motions), values)
    alone = [limit.function(Rollout(motions.dynamics, motions.trajectory[k]))[0] for k in range(4)]
    np.testing.assert_allclose(alone, values, atol=1e-7)


def test_locked_joints_carry_their_geometry():
    lock = {"panda_finger_joint1": 0.02, "panda_finger_joint2": 0.0}
    scene = Scene((Sphere(name="ball", position=(2.0, 0.0, 0.5), radius=0.1),))
    distances = []
    for opening in (0.0, 0.04):
        robot = load_robot("panda", lock={**lock, "panda_finger_joint1": opening}, tool="panda_hand_tcp", limits=LIMITS)
        collision = Collision(robot, scene)
        fingers = [k for k, pair in enumerate(collision.pairs) if pair.first.startswith("panda_leftfinger")]
        distances.append(collision.distances(np.zeros((1, 7)))[0, fingers])
    assert len(distances[0])
    assert (np.abs(distances[0] - distances[1]) > 1e-3).all()


def test_bad_input_is_refused(xarm, ball):
    refused(lambda: clearance_limit(load_robot("puma560"), SCENE), "'puma560'.*expected <collision> geometry")
    refused(lambda: clearance_limit(load_robot("hybrid_manipulator"), SCENE), "drive joints directly, got CoupledScr")
    refused(lambda: clearance_limit(xarm, SCENE, tolerance=0.0), "tolerance: expected a positive number")
    refused(lambda: Collision(ball, Scene(self_clearance=0.1)), "robot 'ball': expected links that can touch")
    refused(lambda: Collision(xarm, SCENE).distances(np.zeros((2, 6))), "q: expected shape")
    motion = rollout(xarm, states(xarm, 3, 0), 1, 0)
    refused(lambda: clearance_along(motion, SCENE, density=0), "density: expected a whole number")
    refused(lambda: clearance_along(SCENE, SCENE), "motion: expected a solution")


def test_a_missing_mesh_is_named(tmp_path):
    file = tmp_path / "ball.urdf"
    file.write_text(BALL.replace('<sphere radius="0.05"/>', '<mesh filename="package://ball/none.stl"/>'))
    robot = load_robot(file, limits=LIMITS)
    refused(lambda: Collision(robot, SCENE), "ball.urdf: mesh 'package://ball/none.stl': no such file in ")


def test_a_mesh_that_was_written_again_is_read_again(tmp_path):
    """Geometry is kept between problems, as long as its files stay the same."""
    file = tmp_path / "ball.urdf"
    file.write_text(BALL.replace('<sphere radius="0.05"/>', '<mesh filename="package://ball/corner.stl"/>'))
    mesh = tmp_path / "ball" / "corner.stl"
    mesh.parent.mkdir()
    scene, found = Scene((Sphere(position=(0.4, 0.0, 1.0), radius=0.1),)), []
    for size in (0.1, 0.1, 0.3):
        corners = np.vstack([np.zeros(3), size * np.eye(3)])
        facets = "".join(
            "facet normal 0 0 0\nouter loop\n"
            + "".join("vertex {} {} {}\n".format(*corners[k]) for k in facet)
            + "endloop\nendfacet\n"
            for facet in ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))
        )
        mesh.write_text(f"solid corner\n{facets}endsolid corner\n")
        robot = load_robot(file, limits=LIMITS)
        found.append(Collision(robot, scene).distances(np.zeros((1, 2)))[0, 0])
    np.testing.assert_allclose(found, [0.6, 0.6, 0.4], atol=1e-6)
