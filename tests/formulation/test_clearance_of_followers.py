"""Clearance of robots whose joints mimic others, against the same robot without mimics."""

import re

import numpy as np
import pytest

from tests.formulation.test_broad_phase import Everything, decided
from tests.formulation.test_clearance import LIMITS
from tests.helpers import assert_exact_gradients, mostly_long
from trajevo import ViaPointProblem, ViaPoints, certify, load_robot, optimise, verify
from trajevo.base import jit
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.formulation.constraints.broad_phase.near import INTERVALS, Grid
from trajevo.formulation.constraints.broad_phase.sweeps import Sweeps
from trajevo.formulation.constraints.clearance import clearance_along, clearance_limit
from trajevo.formulation.constraints.clearance_search import ClearanceSearch
from trajevo.formulation.constraints.collision import DISTANCE_ERROR, Collision
from trajevo.formulation.constraints.scene import Box, Plane, Scene, Sphere
from trajevo.trajectory.interpolants import QuinticSpline


def _link(name, solid):
    inertia = '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>'
    return f'<link name="{name}"><inertial><mass value="0.5"/>{inertia}</inertial><collision>{solid}</collision></link>'


def _joint(name, kind, ends, xyz, axis, mimic=""):
    parent, child = ends
    limit = '<limit lower="-1.5" upper="1.5" velocity="2" effort="200"/>'
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/><origin xyz="{xyz}"/>'
        f'<axis xyz="{axis}"/>{limit}{mimic}</joint>'
    )


#: An arm that is kept level by a follower, a slide, and fingers that follow it: one slides back, one turns.
FOLLOWING = (
    '<robot name="following"><link name="base"/>'
    + _link("upper", '<origin xyz="0.2 0 0"/><geometry><box size="0.4 0.06 0.06"/></geometry>')
    + _link("level", '<origin xyz="0.1 0 0"/><geometry><cylinder radius="0.04" length="0.2"/></geometry>')
    + _link("cart", '<geometry><box size="0.06 0.1 0.06"/></geometry>')
    + _link("finger", '<origin xyz="0 0 0.1"/><geometry><box size="0.03 0.03 0.2"/></geometry>')
    + _link("thumb", '<origin xyz="0.15 0 0"/><geometry><sphere radius="0.03"/></geometry>')
    + _joint("lift", "revolute", ("base", "upper"), "0 0 0.5", "0 1 0")
    + _joint("keep", "revolute", ("upper", "level"), "0.4 0 0", "0 1 0", '<mimic joint="lift" multiplier="-1"/>')
    + _joint("a slide", "prismatic", ("level", "cart"), "0.2 0 0", "0 1 0")
    + _joint(
        "back",
        "prismatic",
        ("cart", "finger"),
        "0 0 0.1",
        "0.6 0 0.8",
        '<mimic joint="a slide" multiplier="-0.5" offset="0.1"/>',
    )
    + _joint(
        "bend",
        "revolute",
        ("cart", "thumb"),
        "0 0.1 0",
        "0 0 1",
        '<mimic joint="a slide" multiplier="2.5" offset="-0.3"/>',
    )
    + "</robot>"
)
FACTORS = {"lift": (0, 1.0, 0.0), "keep": (0, -1.0, 0.0), "a slide": (1, 1.0, 0.0)}
FACTORS |= {"back": (1, -0.5, 0.1), "bend": (1, 2.5, -0.3)}
SCENE = Scene(
    (
        Box(name="left", size=(0.2, 0.2, 0.4), position=(0.7, 0.4, 0.3)),
        Sphere(name="right", radius=0.1, position=(0.8, -0.4, 0.6)),
        Plane(name="floor", position=(0.0, 0.0, 0.05)),
    ),
    clearance=0.03,
    self_clearance=0.01,
)


@pytest.fixture(scope="module")
def robots(tmp_path_factory):
    """The robot, and the same without mimics, whose joints all move by themselves."""
    folder, found = tmp_path_factory.mktemp("following"), []
    for name, text in (("led", FOLLOWING), ("free", re.sub("<mimic[^>]*>", "", FOLLOWING))):
        (folder / f"{name}.urdf").write_text(text)
        found.append(load_robot(folder / f"{name}.urdf", tool="cart", limits=LIMITS))
    return found


def positions(free, q):
    return np.stack([q[:, FACTORS[name][0]] * FACTORS[name][1] + FACTORS[name][2] for name in free.joint_names], axis=1)


def states(count, seed, most=1.0):
    return np.random.default_rng(seed).uniform(-most, most, (count, 2)) * [1.0, 0.4]


def motions(robot, seed, count=4):
    rng = np.random.default_rng(seed)
    durations = 10.0 ** rng.uniform(-1.0, 1.0, (count, 3))
    return QuinticSpline(ViaPoints(states(4, seed)), duration_bounds=(0.1, 10.0))(durations)


def test_distances_are_those_of_all_joints_where_they_are(robots):
    led, free = robots
    assert (led.dof, free.dof) == (2, 5)
    assert list(led.joint_names) == ["lift", "a slide"]
    q = states(200, 1)
    some, all_ = Collision(led, SCENE), Collision(free, SCENE)
    pairs = [all_.pairs.index(pair) for pair in some.pairs]
    np.testing.assert_allclose(some.distances(q), all_.distances(positions(free, q))[:, pairs], atol=1e-9)
    assert (some.distances(q) < 0.0).any()


def test_slopes_are_finite_differences(robots):
    collision, q, h = Collision(robots[0], SCENE), states(100, 2), 1e-6
    state, pair = (index.ravel() for index in np.indices((len(q), len(collision.pairs))))
    slopes = collision.slopes_of(q, state, pair).reshape(len(q), len(collision.pairs), 2)
    for joint in range(2):
        step = h * np.eye(2)[joint]
        numerical = (collision.distances(q + step) - collision.distances(q - step)) / (2.0 * h)
        error = np.abs(numerical - slopes[:, :, joint])
        assert np.quantile(error, 0.95) < 1e-4  # few are at an edge


def test_no_distance_changes_faster_than_the_reach_allows(robots):
    collision, q = Collision(robots[0], SCENE), states(300, 3)
    step = 1e-4 * np.random.default_rng(3).normal(size=q.shape)
    change = np.abs(collision.distances(q + step) - collision.distances(q))
    bounds = np.abs(step) @ collision.reach(q.min(axis=0)[None], q.max(axis=0)[None])[0].T
    assert (change <= bounds + 1e-8).all()
    assert (change > 0.5 * bounds).any()


@pytest.mark.parametrize("kernels", ["compiled", "numpy"])
def test_lower_bounds_hold_and_leave_out_what_never_decides(robots, kernels):
    if kernels == "compiled":
        pytest.importorskip("numba")
    with jit.one_kind(kernels):
        collision, q = Collision(robots[0], SCENE), states(150, 4)
        distances, placed = collision.distances(q), collision.bodies.placed(q)
        state, pair = (index.ravel() for index in np.indices(distances.shape))
        closer = collision.lower_bounds.of(placed, state, pair).reshape(distances.shape)
        assert (closer <= distances + 2.0 * DISTANCE_ERROR).all()
        given = collision, motions(robots[0], 4), np.array([0.03, 0.01]), 1e-3, True
        some, every = (decided(kind(*given), to_the_end=True) for kind in (ClearanceSearch, Everything))
        for one, other in zip(some, every, strict=True):
            np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("seed", range(3))
def test_distances_within_an_interval_are_not_below_its_bound(robots, seed):
    trajectory, collision, finer = motions(robots[0], seed), Collision(robots[0], SCENE), 8
    sweeps = Sweeps(collision, trajectory)
    travel = Grid(trajectory, sweeps).travel[:, sweeps.column].reshape(len(trajectory), 3, INTERVALS, -1)
    q = trajectory.at_shares(np.linspace(0.0, 1.0, finer * INTERVALS + 1), 0)
    distances = collision.distances(q.reshape(-1, 2)).reshape(len(trajectory), 3, finer * INTERVALS + 1, -1)
    bound = 0.5 * (distances[:, :, :-1:finer] + distances[:, :, finer::finer] - travel)
    for between in range(finer + 1):
        end = between - finer or None
        assert (distances[:, :, between:end:finer] >= bound - DISTANCE_ERROR).all()


@pytest.mark.parametrize("seed", range(3))
def test_what_is_proven_is_never_above_dense_minima(robots, seed):
    x = np.random.default_rng(seed).uniform(0.5, 3.0, (5, 3))
    points = ViaPoints(0.5 * states(4, seed))
    rollout = Rollout(Dynamics(robots[0]), QuinticSpline(points, duration_bounds=(0.5, 3.0))(x))
    least = clearance_limit(robots[0], SCENE).function.least(rollout.trajectory)
    profile = clearance_along(rollout, SCENE, density=200)
    dense = np.stack([profile.least(itself=kind).min(axis=1) for kind in (False, True)], axis=1)
    proven = least >= [0.03, 0.01]
    assert (least[proven] <= dense[proven] + 1e-6).all()
    assert (dense[~proven] <= np.array([0.03, 0.01])[np.nonzero(~proven)[1]] + 1e-3).all()
    assert proven.any()


def task(robot, **more):
    return ViaPointProblem(
        robot=robot,
        points=[[0.0, 0.0], [0.25, 0.1], [0.0, 0.05]],
        objectives=("time", "jerk"),
        constraints=("velocity", "acceleration", "jerk"),
        duration_bounds=(0.3, 4.0),
        scene=SCENE,
        **more,
    )


def test_gradients_are_finite_differences(robots):
    problem = task(robots[0])
    assert_exact_gradients(problem, np.random.default_rng(0).uniform(0.4, 3.0, (5, problem.n_var)))


@pytest.mark.parametrize(("population", "generations"), mostly_long([(8, 2), (16, 4)], (8, 2), several=True))
def test_a_robot_with_followers_is_solved_and_certified(robots, population, generations):
    search = {"population": population, "generations": generations}
    best = optimise(task(robots[0]), seed=1, progress=False, **search).pick("0")
    rows = {row.quantity: row for row in certify(best).rows if row.quantity.startswith("clearance")}
    assert set(rows) == {"clearance to obstacles", "clearance to itself"}
    assert all(row.proven for row in rows.values())
    assert verify(best).worst.share <= 1.0 + 1e-9
