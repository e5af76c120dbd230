"""Obstacles that move: their poses over time, distances, proofs between samples, gradients, and what is refused."""

import json
import pickle
import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from tests.formulation.test_broad_phase import Everything, decided
from tests.formulation.test_clearance import LIMITS, centre, rollout, states
from tests.helpers import assert_exact_gradients, mostly_long, refused
from trajevo import ViaPointProblem, certify, check, load_problem, load_robot, optimise
from trajevo.base import jit
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.formulation.constraints.broad_phase.near import INTERVALS, Grid
from trajevo.formulation.constraints.broad_phase.sweeps import Sweeps
from trajevo.formulation.constraints.clearance import clearance_along, clearance_limit
from trajevo.formulation.constraints.clearance_search import ClearanceSearch
from trajevo.formulation.constraints.collision import DISTANCE_ERROR, Collision
from trajevo.formulation.constraints.scene import Attached, Box, Capsule, Cylinder, Hull, Plane, Scene, Sphere
from trajevo.formulation.constraints.scenes.motions import ObstacleMotion
from trajevo.solvers.task import load_task
from trajevo.trajectory.polynomial import PolynomialBatch

#: A cart that comes by and turns, and stands before and after.
CART = [
    {"t": 0.2, "position": [0.7, -0.6, 0.3], "rpy": [0.0, 0.0, 0.4]},
    {"t": 0.9, "position": [0.6, 0.1, 0.35], "rpy": [0.3, -0.2, 2.0]},
    {"t": 1.7, "position": [0.4, 0.5, 0.3], "rpy": [0.1, 0.5, -1.4]},
]
SHAPES = (
    Box(position=(0.02, -0.03, 0.0), rpy=(0.2, 0.0, 0.1), size=(0.1, 0.2, 0.15), motion=CART),
    Cylinder(position=(0.0, 0.0, 0.1), radius=0.05, length=0.3, motion=CART),
    Capsule(position=(0.0, 0.1, 0.0), radius=0.04, length=0.2, motion=CART),
    Sphere(position=(0.05, 0.0, 0.0), radius=0.06, motion=CART),
    Hull(position=(0, 0, 0), points=((0, 0, 0), (0.2, 0, 0), (0, 0.15, 0), (0, 0, 0.1)), motion=CART),
)


def scene(*shapes, itself=0.01):
    post = Box(name="post", position=(0.5, 0.4, 0.2), size=(0.1, 0.1, 0.4))
    return Scene((post, *(shapes or SHAPES[:2])), clearance=0.02, self_clearance=itself)


def timed(robot, count, seed, until=2.0):
    """States with instants."""
    return np.column_stack([states(robot, count, seed), np.random.default_rng(seed).uniform(-0.2, until, count)])


def still(shape, t):
    """An equal obstacle that stands where a moving one is at an instant, by SciPy."""
    moving = ObstacleMotion.of(CART)
    rotations = Rotation.from_euler("xyz", moving.rpys)
    at = np.clip(t, CART[0]["t"], CART[-1]["t"])
    turned = Slerp(moving.t, rotations)(at)
    origin = np.array([np.interp(at, moving.t, axis) for axis in np.array(moving.positions).T])
    given = shape.settings
    placed = turned.apply(given["position"]) + origin
    rotation = turned.as_matrix() @ Rotation.from_euler("xyz", given["rpy"]).as_matrix()
    return {k: v for k, v in given.items() if k not in ("motion", "rpy")} | {
        "position": placed.tolist(),
        "rotation": rotation.tolist(),
    }


# --- poses over time


def test_poses_are_those_of_lines_and_turns_by_scipy():
    motion, t = ObstacleMotion.of(CART), np.linspace(-0.5, 2.5, 301)
    rotations, positions = motion.poses(t)
    at = np.clip(t, motion.t[0], motion.t[-1])
    expected = Slerp(motion.t, Rotation.from_euler("xyz", motion.rpys))(at).as_matrix()
    np.testing.assert_allclose(rotations, expected, atol=1e-13)
    np.testing.assert_allclose(positions[:, 1], np.interp(at, motion.t, [p[1] for p in motion.positions]), atol=1e-14)
    alone = motion.poses(t[40:41])
    np.testing.assert_array_equal(alone[0][0], rotations[40])
    np.testing.assert_array_equal(alone[1][0], positions[40])


def test_paths_and_rates_are_those_of_fine_steps():
    motion, t = ObstacleMotion.of(CART), np.linspace(-0.2, 2.0, 20_001)
    rotations, positions = motion.poses(t)
    way, turned = motion.travelled(t)
    steps = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    angles = Rotation.from_matrix(rotations[1:] @ np.swapaxes(rotations[:-1], 1, 2)).magnitude()
    np.testing.assert_allclose(way, np.append(0.0, np.cumsum(steps)), atol=1e-3 * way[-1])
    np.testing.assert_allclose(turned, np.append(0.0, np.cumsum(angles)), atol=1e-3 * turned[-1])
    inner = np.array([0.5, 1.2])
    velocity, turning = motion.rates(inner)
    stepped = motion.poses(inner + 1e-20j)
    np.testing.assert_allclose(stepped[1].imag / 1e-20, velocity, atol=1e-12)
    spin = stepped[0].imag / 1e-20 @ np.swapaxes(stepped[0].real, 1, 2)
    np.testing.assert_allclose(np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1), turning, atol=1e-12)


def test_settings_make_an_equal_obstacle_and_files_the_same_motion(tmp_path):
    for shape in SHAPES:
        again = Scene.of(json.loads(json.dumps(scene(shape).settings)))
        assert again == scene(shape)
        assert pickle.loads(pickle.dumps(scene(shape))) == scene(shape)
    table = tmp_path / "cart.csv"
    rows = "\n".join(
        ",".join(map(str, [1e3 * p["t"], *(1e3 * x for x in p["position"]), *np.degrees(p["rpy"])])) for p in CART
    )
    table.write_text("t [ms],x [mm],y [mm],z [mm],roll [deg],pitch [deg],yaw [deg]\n" + rows + "\n")
    read, written = ObstacleMotion.of({"file": str(table)}), ObstacleMotion.of(CART)
    for key in ("t", "positions", "rpys"):
        np.testing.assert_allclose(getattr(read, key), getattr(written, key), rtol=1e-14)
    quaternions = [
        {k: v for k, v in p.items() if k != "rpy"} | {"quaternion": Rotation.from_euler("xyz", p["rpy"]).as_quat()}
        for p in CART
    ]
    np.testing.assert_allclose(ObstacleMotion.of(quaternions).rpys, written.rpys, atol=1e-14)


# --- distances


@pytest.mark.thinned(2)
@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: type(shape).__name__)
def test_distances_are_those_of_an_obstacle_that_stands_there(xarm, shape):
    collision, q = Collision(xarm, scene(shape)), timed(xarm, 12, seed=1)
    found = collision.distances(q)
    moving = [k for k, pair in enumerate(collision.pairs) if pair.second == "obstacle 2"]
    for row, state in zip(found, q, strict=True):
        there = Collision(xarm, Scene.of({"obstacles": [still(shape, state[-1])]}))
        np.testing.assert_allclose(row[moving], there.distances(state[None, :-1])[0], atol=2.0 * DISTANCE_ERROR)
    alone = Collision(xarm, Scene(scene().still, 0.02, 0.01))
    rest = [k for k in range(len(collision.pairs)) if k not in moving]
    np.testing.assert_array_equal(np.sort(found[:, rest]), np.sort(alone.distances(q[:, :-1])))
    state, pair = (index.ravel() for index in np.indices(found.shape))
    np.testing.assert_array_equal(collision.distances_of(q, state, pair).reshape(found.shape), found)


def test_mujoco_measures_the_same_distances(ball):
    mujoco = pytest.importorskip("mujoco")
    collision, q = Collision(ball, Scene((SHAPES[0], SHAPES[2]))), timed(ball, 40, seed=3)
    found = collision.distances(q)
    geoms = "".join(
        f'<body mocap="true" name="{name}"><geom type="{kind}" size="{size}" pos="{pos}" quat="{quat}"/></body>'
        for name, kind, size, pos, quat in (
            ("a", "box", "0.05 0.1 0.075", "0.02 -0.03 0", " ".join(map(str, _wxyz((0.2, 0.0, 0.1))))),
            ("b", "capsule", "0.04 0.1", "0 0.1 0", "1 0 0 0"),
        )
    )
    probe = '<body mocap="true" name="p"><geom name="ball" type="sphere" size="0.05"/></body>'
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{geoms}{probe}</worldbody></mujoco>")
    data, motion = mujoco.MjData(model), ObstacleMotion.of(CART)
    rotations, positions = motion.poses(q[:, -1])
    for row, state, rotation, position in zip(found, q, rotations, positions, strict=True):
        for k in (0, 1):
            data.mocap_pos[k], data.mocap_quat[k] = position, np.roll(Rotation.from_matrix(rotation).as_quat(), 1)
        data.mocap_pos[2] = centre(state[None, :2])[0]
        mujoco.mj_kinematics(model, data)
        apart = [mujoco.mj_geomDistance(model, data, k, model.geom("ball").id, 10.0, None) for k in (0, 1)]
        far = np.array(apart) > 0.01  # depths are not compared
        np.testing.assert_allclose(row[far], np.array(apart)[far], atol=1e-6)
    assert (found > 0.01).mean() > 0.5


def _wxyz(rpy):
    return np.roll(Rotation.from_euler("xyz", rpy).as_quat(), 1)


@pytest.mark.parametrize("kernels", ["compiled", "plain"])
def test_lower_bounds_and_places_are_those_of_the_moment(xarm, kernels):
    if kernels == "compiled":
        pytest.importorskip("numba")
    collision, q = Collision(xarm, scene(*SHAPES)), timed(xarm, 150, seed=2)
    with jit.one_kind(kernels):
        distances, placed, bounds = collision.distances(q), collision.bodies.placed(q), collision.lower_bounds
        state, pair = (index.ravel() for index in np.indices(distances.shape))
        around, closer = bounds.everywhere(placed.whole).T, bounds.of(placed, state, pair).reshape(distances.shape)
        assert (around <= distances + 2.0 * DISTANCE_ERROR).all()
        assert (closer <= distances + 2.0 * DISTANCE_ERROR).all()
        moving = [k for k, pair in enumerate(collision.pairs) if pair.second.startswith("obstacle")]
        assert np.median((distances - closer)[:, moving]) < 0.1
        some = collision.bodies.placed(q[70:71])
        np.testing.assert_array_equal(some.whole[..., 0], placed.whole[..., 70])
        np.testing.assert_array_equal(some.axes[..., 0], placed.axes[..., 70])


def test_slopes_of_distances_follow_joints_and_time(xarm, ball):
    for robot in (xarm, ball):
        collision = Collision(robot, scene(*SHAPES[:3], itself=0.01 if robot is xarm else None))
        q = timed(robot, 60, seed=1, until=1.6)
        direction, h = np.random.default_rng(2).normal(size=q.shape), 1e-6
        numerical = (collision.distances(q + h * direction) - collision.distances(q - h * direction)) / (2.0 * h)
        state, pair = (index.ravel() for index in np.indices(numerical.shape))
        slopes = collision.slopes_of(q, state, pair).reshape(*numerical.shape, -1)
        error = np.abs(numerical - (slopes * direction[:, None]).sum(axis=2))
        assert np.quantile(error, 0.9) < 1e-4
        # The time alone, of the pairs with what moves and of the others.
        moving = np.array([pair.second.startswith("obstacle") for pair in collision.pairs])
        assert (slopes[:, ~moving, -1] == 0.0).all()
        assert (np.abs(slopes[:, moving, -1]) > 1e-3).mean() > 0.5


# --- proofs


@pytest.mark.thinned(2)
@pytest.mark.parametrize("seed", range(3))
def test_distances_within_an_interval_are_not_below_its_bound(xarm, seed):
    collision = Collision(xarm, scene())
    motions = rollout(xarm, states(xarm, 4, seed, most=0.8), 5, seed)
    trajectory = collision.with_time(motions.trajectory)
    sweeps = Sweeps(collision, trajectory)
    travel = Grid(trajectory, sweeps).travel[:, sweeps.column].reshape(len(trajectory), 3, INTERVALS, -1)
    finer = 4
    q = trajectory.at_shares(np.linspace(0.0, 1.0, finer * INTERVALS + 1), 0)
    distances = collision.distances(q.reshape(-1, 8)).reshape(len(trajectory), 3, finer * INTERVALS + 1, -1)
    bound = 0.5 * (distances[:, :, :-1:finer] + distances[:, :, finer::finer] - travel)
    for between in range(finer + 1):
        assert (distances[:, :, between : between - finer or None : finer] >= bound - DISTANCE_ERROR).all()


@pytest.mark.parametrize("kernels", ["compiled", "plain"])
def test_the_broad_phase_leaves_out_nothing_that_decides(xarm, kernels):
    if kernels == "compiled":
        pytest.importorskip("numba")
    motions = rollout(xarm, states(xarm, 4, 5, most=0.8), 6, 5)
    for to_the_end in (False, True):
        with jit.one_kind(kernels):
            collision = Collision(xarm, scene())
            given = collision, collision.with_time(motions.trajectory), np.array([0.02, 0.01]), 1e-3, to_the_end
            some, every = (decided(kind(*given), to_the_end=to_the_end) for kind in (ClearanceSearch, Everything))
        for one, other in zip(some, every, strict=True):
            np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(
    ("seed", "count"), mostly_long([(0, 2), *((seed, 5) for seed in range(3))], (0, 2), several=True)
)
def test_the_proven_bound_is_never_above_what_dense_samples_find(xarm, seed, count):
    around = scene(*SHAPES[:3])
    motions = rollout(xarm, states(xarm, 4, seed, most=0.8), count, seed)
    profile = clearance_along(motions, around, density=300)
    for kind, closest in enumerate(clearance_limit(xarm, around, tolerance=1e-3).function.closest(motions.trajectory)):
        dense = profile.least(itself=bool(kind)).min(axis=1)
        assert (closest.proven <= dense + 1e-6).all()
        low = closest.sampled < closest.wanted
        assert (closest.proven >= closest.sampled - 1e-3)[~low].all()
        np.testing.assert_allclose(closest.sampled[low], dense[low], atol=0.02)


def test_a_ball_that_flies_past_is_missed_by_the_closed_form(ball):
    """The robot's ball flies along x; another one crosses its way: the least distance of two lines over time."""
    breaks, coefficients = np.array([[0.0, 2.0]]), np.array([[[[-0.5, 0.5], [0.0, 0.0]]]])
    motion = Rollout(Dynamics(ball), PolynomialBatch(breaks, coefficients))
    for shift in (0.0, 0.3, 0.7):
        crossing = [{"t": 0.0, "position": [0.4 + shift, -1.0, 0.2]}, {"t": 2.0, "position": [0.4 + shift, 1.0, 0.2]}]
        other = Scene((Sphere(position=(0.0, 0.0, 0.0), radius=0.02, motion=crossing),), clearance=0.0)
        # Apart by (shift + 0.5 - 0.5 t, t - 1): least where t = (0.5 (shift + 0.5) + 1) / 1.25.
        t = (0.5 * (shift + 0.5) + 1.0) / 1.25
        expected = np.hypot(shift + 0.5 - 0.5 * t, t - 1.0) - 0.07
        closest = clearance_limit(ball, other, tolerance=1e-5).function.closest(motion.trajectory)[0]
        if expected < 0.0:
            assert closest.sampled[0] < 0.0
            continue
        assert expected - 2e-5 <= closest.proven[0] <= expected + DISTANCE_ERROR
        np.testing.assert_allclose(closest.instant[0], t, atol=0.02)


def test_loads_keep_away_from_what_moves_at_the_time_of_the_whole_motion(xarm):
    """The obstacle is at the tool only while nothing is carried, or only while something is."""
    points = np.radians([[-40.0, 20, 0, 60, 0, 40, 0], [0.0, 20, 0, 60, 0, 40, 0], [40.0, 20, 0, 60, 0, 40, 0]])
    tool = xarm.tool_poses(points)[0]
    shape = {"shape": "sphere", "radius": 0.03, "position": [0.0, 0.0, 0.5]}

    def least(when):
        away, near = [0.0, 0.0, 3.0], (tool[1] + [0.0, 0.0, -0.5]).tolist()
        motion = [
            {"t": when - 0.3, "position": away},
            {"t": when - 0.2, "position": near},
            {"t": when + 0.2, "position": near},
            {"t": when + 0.3, "position": away},
        ]
        problem = ViaPointProblem(
            robot={"name": "xarm7", "limits": {"acceleration": 14.0, "jerk": 140.0}},
            points=points,
            payload=[{"mass": 1.0, "from": 1, "shape": shape}],
            passing=[{"point": 1, "stop": True}],
            scene={"obstacles": [{"shape": "sphere", "radius": 0.05, "name": "ball", "motion": motion}]},
            objectives=("time", "jerk"),
            duration_bounds=(1.0, 1.5),
        )
        columns = [k for k, name in enumerate(problem.constraint_names) if name.startswith("clearance of payload")]
        return problem.evaluate(np.full((1, problem.n_var), 1.25), return_as_dictionary=True)["G"][0, columns].max()

    assert least(1.25) > 0.0  # it comes by when the load is picked up at point 1
    assert least(0.5) < 0.0  # it is gone by then
    assert least(9.0) < 0.0


# --- problems


def problem_with(motion, **given):
    points = np.radians([[-50.0, 20, 0, 60, 0, 40, 0], [0.0, 20, 0, 70, 0, 60, 0], [50.0, 20, 0, 60, 0, 40, 0]])
    cart = {"name": "cart", "shape": "box", "size": [0.1, 0.1, 0.2], "motion": motion}
    usual = {"robot": {"name": "xarm7", "limits": {"acceleration": 14.0, "jerk": 140.0}}, "points": points}
    limits = {"objectives": ("time", "jerk"), "constraints": ("velocity", "acceleration", "jerk")}
    return ViaPointProblem(
        **(usual | limits | {"duration_bounds": (0.3, 3.0)} | given),
        scene={"obstacles": [cart], "clearance": 0.02, "self_clearance": 0.005},
    )


CROSSING = [{"t": 0.2, "position": [0.75, -0.5, 0.3]}, {"t": 1.5, "position": [0.45, 0.4, 0.3]}]


def test_gradients_know_that_waiting_helps():
    problem = problem_with(CROSSING)
    assert_exact_gradients(problem, np.random.default_rng(0).uniform(0.5, 1.5, (4, problem.n_var)))


@pytest.mark.parametrize("polish", mostly_long([False, True], False))
@pytest.mark.parametrize(
    ("generations", "population", "density"),
    mostly_long([(6, 16, 500), (10, 24, 5000), (20, 24, 5000)], (6, 16, 500), several=True),
)
def test_motions_wait_or_hurry_and_the_certificate_holds(tmp_path, polish, generations, population, density):
    problem = problem_with(CROSSING)
    settings = {"population": population, "generations": generations, "polish": polish, "progress": False}
    front = optimise(problem, seed=1, out=tmp_path / "run", **settings)
    assert len(front) > 3
    around = problem.constraints[-1].function.collision.scene
    for solution in (front.least("time"), front.knee()):
        assert certify(solution).proven
        profile = clearance_along(solution, around, density=density)
        assert profile.least(itself=False).min() > 0.02
    again = load_problem("via-points", **json.loads(json.dumps(problem.settings)))
    np.testing.assert_array_equal(again.evaluate(front.X)[0], problem.evaluate(front.X)[0])


def test_tasks_name_a_file_of_poses_beside_them(tmp_path):
    (tmp_path / "cart.csv").write_text("t [s],x [m],y [m],z [m]\n0.2,0.75,-0.5,0.3\n1.5,0.45,0.4,0.3\n")
    task = tmp_path / "task.toml"
    task.write_text(
        'robot = "xarm7"\nangle = "deg"\npoints = [[-50, 20, 0, 60, 0, 40, 0], [50, 20, 0, 60, 0, 40, 0]]\n'
        "duration_bounds = [0.3, 3.0]\n[limits]\nacceleration = 14.0\njerk = 140.0\n[scene]\nclearance = 0.02\n"
        '[[scene.obstacles]]\nname = "cart"\nshape = "sphere"\nradius = 0.1\nmotion = { file = "cart.csv" }\n'
    )
    problem = load_task(task).problem
    assert problem.settings["scene"]["obstacles"][0]["motion"][1] == {
        "t": 1.5,
        "position": [0.45, 0.4, 0.3],
        "rpy": [0.0, 0.0, 0.0],
    }


def test_the_check_looks_at_the_start_alone():
    """Where the cart is at 0 s counts at the first point; where it is later counts at no point."""
    xarm = load_robot("xarm7", limits=LIMITS)
    start = xarm.tool_poses(np.radians([[-50.0, 20, 0, 60, 0, 40, 0]]))[0][0].tolist()
    there = [{"t": 0.1, "position": start}, {"t": 0.3, "position": [0.0, 0.0, 3.0]}]
    found = [finding for finding in check(problem_with(there)).findings if finding.kind == "clearance"]
    assert [finding.point for finding in found] == [0]
    later = [{"t": 0.1, "position": [0.0, 0.0, 3.0]}, {"t": 0.3, "position": start}]
    assert not [finding for finding in check(problem_with(later)).findings if finding.kind == "clearance"]


# --- bad input


@pytest.mark.parametrize(
    ("motion", "told"),
    [
        (CART[:1], "expected 2 to 10000 poses, got 1"),
        ([CART[1], CART[0]], "t: expected rising instants [s], got 0.2 after 0.9"),
        ([{"position": [0, 0, 1]}, CART[0]], "pose 1: t: expected an instant [s], got none"),
        ([{"t": 0.0}, CART[0]], "pose 1: expected a 'position' (3) [m]"),
        ([{"t": 0.0, "position": [0, 0]}, CART[0]], "pose 1: position: expected shape (3), got (2,)"),
        ([{"t": 0.0, "position": [0, 0, 1]}, CART[0]], "pose 2: expected orientations of all poses or of none"),
        ([{"t": 0.0, "position": [0, 0, 1], "free": "z"}], "pose 1: free: unknown key; known: "),
        ([{"t": 0.0, "position": [0, 0, 1], "speed": 1.0}], "pose 1: speed: unknown key"),
        ([{"t": float("nan"), "position": [0, 0, 1]}, CART[0]], "t: expected finite numbers"),
        ([CART[0] | {"rpy": [0, 0, 4.0]}, CART[1]], "expected angles within ±π rad, got 4; it turns the shorter way"),
        ([CART[0] | {"rpy": [0, 0, 90.0]}, CART[1]], "degrees"),
        ([CART[0] | {"rpy": [0, 0, 0]}, CART[1] | {"rpy": [0, 0, 3.14159265]}], "half a turn between t = 0.2 and 0.9"),
        ({"files": "a.csv"}, "expected a list of poses, or only a file, got keys ['files']"),
        (3.0, "expected a list of poses with t and position, got 3.0"),
        ([CART[0], [0.0, 0.0, 0.0]], "pose 2: expected a mapping with t and position"),
        ([CART[0], CART[1] | {"position": [700.0, 0.0, 300.0]}], "looks like mm"),
    ],
)
def test_motions_that_cannot_be_used_are_refused(motion, told):
    given = {"obstacles": [{"name": "cart", "shape": "sphere", "radius": 0.1, "motion": motion}]}
    refused(lambda: Scene.of(given), f"cart.*{re.escape(told)}")


def test_what_cannot_move_by_itself_is_refused(xarm, tmp_path):
    refused(lambda: Plane(position=(0, 0, 0), motion=CART), "motion: expected a solid that moves, such as a box")
    solid = Sphere(position=(0, 0, 0), radius=0.1, motion=CART, name="lamp")
    refused(lambda: Attached(solid, "link7"), "attached 'lamp': motion: expected none")
    refused(
        lambda: problem_with(
            CART, payload=[{"mass": 1.0, "from": 1, "shape": solid.settings}], passing=[{"point": 1, "stop": True}]
        ),
        "payload.0.shape.motion: expected none, as a load moves with the tool",
    )
    missing = {"obstacles": [{"shape": "sphere", "radius": 0.1, "motion": {"file": str(tmp_path / "no.csv")}}]}
    refused(lambda: Scene.of(missing), "no.csv")
    refused(lambda: Collision(xarm, scene()).distances(np.zeros((2, 7))), "states: expected shape")
