"""Derivatives of clearance: of distances, depths, bounds between samples, and what gradient solvers make of them."""

import numpy as np
import pytest

import trajevo.formulation.constraints.collision
from tests.formulation.test_clearance import BALL, LIMITS, SCENE, rollout, states
from tests.formulation.test_gradients import OBSTACLE
from tests.helpers import mostly_long
from trajevo import ViaPoints, load_robot, optimise
from trajevo.base import jit
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.formulation.constraints.clearance import clearance_along, clearance_limit
from trajevo.formulation.constraints.collision import Collision
from trajevo.formulation.constraints.scene import Box, Scene, Sphere
from trajevo.formulation.problem import Weights
from trajevo.path.curve import GeometricPath
from trajevo.problems import ViaPointProblem
from trajevo.solvers.gradient.normal_constraint import solve_nnc
from trajevo.solvers.gradient.polish import polish
from trajevo.solvers.gradient.weighted_sum import minimise_weighted
from trajevo.solvers.task import load_task
from trajevo.trajectory.along_path import ComposedBatch
from trajevo.trajectory.interpolants import QuinticSpline
from trajevo.trajectory.parameterisation import Course


@pytest.fixture(scope="module", autouse=True)
def interpreted():
    """As where numba is not installed: arms of seven joints take a minute to compile, and distances are Pinocchio's."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(jit, "can_compile", lambda: False)
        yield


@pytest.fixture(scope="module")
def problem():
    return load_task(OBSTACLE).problem


@pytest.fixture(scope="module")
def front(problem):
    return optimise(problem, seed=1, population=40, generations=20, progress=False, polish=False)


def slopes(collision, q):
    state, pair = (index.ravel() for index in np.indices((len(q), len(collision.pairs))))
    return collision.slopes_of(q, state, pair).reshape(len(q), len(collision.pairs), -1)


def test_slopes_of_distances_and_depths_are_finite_differences(xarm, ball):
    for robot in (xarm, ball):
        collision, q = Collision(robot, SCENE), states(robot, 60, seed=1)
        direction, h = np.random.default_rng(2).normal(size=q.shape), 1e-6
        numerical = (collision.distances(q + h * direction) - collision.distances(q - h * direction)) / (2.0 * h)
        error = np.abs(numerical - np.einsum("npj,nj->np", slopes(collision, q), direction))
        deep = collision.distances(q) < -0.002
        assert deep.any()
        for chosen in (error[deep], error[~deep]):  # few states are at a kink, where an edge takes over from another
            assert np.quantile(chosen, 0.9) < 1e-4
            assert chosen.max() < 1e-2


def test_overlaps_of_unknown_depth_have_a_way_out(ball, monkeypatch):
    """As if coal found no depth: a step along the slope takes the ball out of the box, sooner or later."""
    monkeypatch.setattr(trajevo.formulation.constraints.collision, "_DEEPEST", 0.0)
    collision = Collision(ball, Scene((Box(position=(0.35, 0.02, 0.21), size=(0.3, 0.3, 0.3)),)))
    q = np.array([[0.0, 0.0], [0.1, 0.2]])
    assert (collision.distances(q) == -1e-3).all()
    for _ in range(20):
        q = q + 0.05 * slopes(collision, q)[:, 0]
    assert (collision.distances(q) > 0.0).all()


def test_complex_steps_of_a_slide_follow_the_reach_too(tmp_path):
    """The bound between samples depends on how far a slide behind a turn goes, and so does its derivative."""
    first, second = (f'<parent link="{a}"/><child link="{b}"/>' for a, b in (("base", "cart"), ("cart", "arm")))
    swapped = BALL.replace(first, "first").replace(second, first).replace("first", second)
    (tmp_path / "telescope.urdf").write_text(swapped)
    robot, points = load_robot(tmp_path / "telescope.urdf", limits=LIMITS), np.array([[0, 0], [1.0, 0.8], [0.3, 0.0]])
    limit = clearance_limit(robot, Scene((Sphere(position=(0.5, 1.5, 0.4), radius=0.2),), clearance=0.05))
    spline, rng, h = QuinticSpline(ViaPoints(points), duration_bounds=(0.5, 2.0)), np.random.default_rng(0), 1e-6
    x, direction = rng.uniform(0.6, 1.9, (4, 2)), rng.normal(size=(4, 2))

    def moved(step):
        return limit.function(Rollout(Dynamics(robot), spline(x + step * direction)))

    values = moved(1e-20j)
    np.testing.assert_allclose(values.real, moved(0.0), rtol=1e-11)
    assert (values.real < 0.0).all()
    np.testing.assert_allclose(values.imag / 1e-20, (moved(h) - moved(-h)) / (2.0 * h), rtol=1e-5)


@pytest.mark.parametrize("terms", [False, True])
def test_motions_along_a_path_have_gradients_too(ball, terms):
    path = GeometricPath.through(np.array([[0.0, 0.0], [0.3, 0.8], [0.5, 0.6], [0.6, 0.2], [0.4, -0.3], [0.1, -0.5]]))
    limit = clearance_limit(ball, Scene((Sphere(position=(0.9, 0.2, 0.3), radius=0.1),), clearance=0.4))
    function = limit.terms if terms else limit.function
    control = np.sort(np.random.default_rng(3).uniform(0.05, 0.95, (3, 8)), axis=1)
    control = np.concatenate([np.zeros((3, 1)), control, np.ones((3, 1))], axis=1)
    direction, h = np.zeros(control.shape), 1e-7
    direction[:, 3:6] = 1.0

    def moved(step):
        runs = ComposedBatch(Course(path, control + step * direction), np.array([2.0, 2.5, 3.0]) + step)
        return function(Rollout(Dynamics(ball), runs))

    values = moved(1e-20j)
    error = np.abs(values.imag / 1e-20 - (moved(h) - moved(-h)) / (2.0 * h))
    assert np.quantile(error, 0.9) < 1e-4 * np.abs(values.imag / 1e-20).max()


@pytest.mark.parametrize("seed", mostly_long(range(3), 0))
def test_terms_are_least_distances_with_the_tolerance_on_top(xarm, seed):
    motions = rollout(xarm, states(xarm, 4, seed, most=0.8), 5, seed)
    limit = clearance_limit(xarm, SCENE, tolerance=1e-3)
    collision, trajectory = Collision(xarm, SCENE), motions.trajectory
    itself = np.array([pair.itself for pair in collision.pairs])
    wanted, scale = np.where(itself, 0.01, 0.03), np.where(itself, 0.01, 0.03)
    least = wanted - limit.terms(motions).reshape(5, -1, len(itself)) * scale + 1.05e-3
    q = trajectory.at_shares(np.linspace(0.0, 1.0, 301), 0)
    dense = collision.distances(q.reshape(-1, 7)).reshape(5, 3, 301, -1).min(axis=2)
    near = dense < wanted  # others are not looked at between samples where they cannot come too close
    assert near.any()
    assert (least[near] < dense[near] + 1e-5).all()
    assert (least > dense - 1e-3).all()


@pytest.mark.parametrize(
    ("weights", "starts"),
    mostly_long([((1.0, 0.0), 1), ((1.0, 0.0), 2), ((1.0, 0.05), 2)], ((1.0, 0.0), 1), several=True),
)
def test_what_keeps_the_terms_is_proven(problem, weights, starts):
    """Polished members that a gradient solver left at its limit are feasible as they are."""
    found = minimise_weighted(problem, Weights(weights), seed=0, starts=starts)
    assert np.isfinite(found.cost)
    assert problem.evaluate(found.x[None])[1].max() <= 1e-6
    assert problem.in_terms().evaluate(found.x[None])[1].max() > -1e-3


@pytest.mark.long
def test_a_front_around_an_obstacle_is_polished(problem, front):
    found = polish(front, members=8)
    assert found.hypervolume_after > found.hypervolume_before
    assert found.front.run.settings["polish"]["gradients by"] == "complex step"
    assert found.front.F[:, 0].min() < front.F[:, 0].min() - 0.005
    G = problem.evaluate(found.front.X)[1]
    assert G.max() <= 0.0
    chosen = found.front.X[:: max(1, len(found.front) // 20)]
    scene = next(c for c in problem.constraints if c.reference == "scene").function.collision.scene
    assert clearance_along(problem.rollout(chosen), scene, density=100).least(itself=False).min() >= scene.clearance


@pytest.mark.long
def test_normal_constraints_go_around_an_obstacle(problem, front):
    """With a point that only turns the arm and lifts it, which two variables tell."""
    joints = [0.5, 0.7, 0.0, 0.0, 0.0, 0.0, 0.0]
    found = solve_nnc(ViaPointProblem(**problem.settings | {"moving": [{"point": 1, "joints": joints}]}), points=2)
    assert found.run.settings["gradients"] == "complex step"
    assert len(found) == 2
    assert found.G.max() <= 0.0
    assert found.F[1, 1] < front.F[:, 1].max()
