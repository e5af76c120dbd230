"""Integrals over whole motions against dense sums, their derivatives, and that no motion depends on its neighbours."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from tests.helpers import mostly_long
from trajevo import ViaPointProblem, load_robot
from trajevo.base import polynomials
from trajevo.dynamics.integrals import efforts, travel
from trajevo.dynamics.integrals.nodes import MOST_NODES, lobatto, nested
from trajevo.robot.joints import Friction

OBJECTIVES = (
    *("energy", "square_power", "square_effort", "square_effort_rate"),
    *("effort_ratio", "joint_travel", "tool_path"),
)
#: Dense instants of every segment, with dry friction, which jumps, and without it; how much sums may differ.
DENSE, APART = {True: 8_000, False: 4_000}, {"square_effort_rate": 2e-4}
#: Points of the tool's path on every segment: chords of it are too short by less than 1e-5 of it.
CHORDS = 1_000
ROBOTS = {
    "ur5": {"tool": "tool0", "limits": {"acceleration": 10.0, "jerk": 100.0}},
    "puma560": {},
    "z1": {"limits": {"acceleration": 10.0, "jerk": 100.0}, "friction": "none"},  # smooth efforts of seven joints
}


def problem_of(name, interpolant="cubic", *, robot=None, **settings):
    robot = load_robot(name, **ROBOTS[name]) if robot is None else robot
    lower, upper = np.clip(robot.limits.lower, -2.0, 2.0), np.clip(robot.limits.upper, -2.0, 2.0)
    share = np.random.default_rng(4).uniform(0.3, 0.7, (4, robot.dof))
    return ViaPointProblem(
        robot=robot,
        points=lower + share * (upper - lower),
        interpolant=interpolant,
        objectives=OBJECTIVES,
        constraints=("velocity",),
        payload=1.5,
        **settings,
    )


def motions(problem, count=2, seed=0):
    return np.exp(np.random.default_rng(seed).uniform(np.log(0.6), np.log(3.0), (count, problem.n_var)))


def dense_values(problem, x):
    """Objectives by sums over dense instants inside every segment."""
    rollout, robot = problem.rollout(x), problem.robot
    count = DENSE[bool(robot.friction.dry(np.ones(robot.dof)).any())]
    u = (np.arange(count) + 0.5) / count
    shape = (len(x), -1, count, robot.dof)
    q, v, a = (rollout.trajectory.at_shares(u, k) for k in range(3))
    effort = rollout.effort_in(q, v, a)
    smooth = (effort - robot.friction.dry(rollout.without_rounding(v))).reshape(shape)
    step = (rollout.trajectory.segment_durations / count)[..., None, None]
    rate = np.gradient(smooth, axis=2, edge_order=2) / step
    q, v, effort = (values.reshape(shape) for values in (q, v, effort))
    ends = rollout.trajectory.at_shares(np.linspace(0.0, 1.0, CHORDS), 0)
    tool = robot.tool_poses(ends.reshape(-1, robot.dof))[0].reshape(*q.shape[:2], CHORDS, 3)
    tool = np.linalg.norm(np.diff(tool, axis=2), axis=-1).sum(axis=(1, 2))
    return {
        "energy": (np.abs(effort * v) * step).sum(axis=(1, 2, 3)),
        "square_power": (np.square(effort * v) * step).sum(axis=(1, 2, 3)),
        "square_effort": (np.square(effort) * step).sum(axis=(1, 2, 3)),
        "square_effort_rate": (np.square(rate) * step).sum(axis=(1, 2, 3)),
        "effort_ratio": (np.abs(effort) / robot.limits.effort).max(axis=(1, 2, 3)),
        "joint_travel": (np.abs(v) * step).sum(axis=(1, 2, 3)),
        "tool_path": tool,
    }


CURVES = ("cubic", "hybrid", "septic_spline", "linear_blends")
OFTEN = [("ur5", "cubic"), ("z1", "septic_spline")]


@pytest.mark.parametrize(
    ("name", "interpolant", "count"),
    [
        *((*pair, 1) for pair in OFTEN),
        *(pytest.param(name, curve, 2, marks=pytest.mark.long) for name in ROBOTS for curve in CURVES),
    ],
)
def test_objectives_are_their_dense_sums(name, interpolant, count):
    problem = problem_of(name, interpolant)
    x = motions(problem, count)
    x = x if x.shape[1] == 3 else np.random.default_rng(1).uniform(problem.xl, problem.xu, (count, problem.n_var))
    expected, F = dense_values(problem, x), problem.evaluate(x)[0]
    for column, objective in zip(F.T, OBJECTIVES, strict=True):
        np.testing.assert_allclose(column, expected[objective], rtol=APART.get(objective, 1e-4), err_msg=objective)


@pytest.mark.parametrize("seed", mostly_long(range(3), 0))
def test_peaks_between_nodes_are_found_with_the_friction_of_a_urdf(seed):
    """Cubics between nodes missed that of seed 0 by 1.1e-4."""
    robot = load_robot("z1", limits=ROBOTS["z1"]["limits"])
    assert robot.friction.is_dry
    problem = problem_of("z1", "septic_spline", robot=robot)
    x = motions(problem, seed=seed)
    expected, F = dense_values(problem, x), problem.evaluate(x)[0]
    for column, objective in zip(F.T, OBJECTIVES, strict=True):
        rtol = 2e-6 if objective == "effort_ratio" else 1e-4
        np.testing.assert_allclose(column, expected[objective], rtol=rtol, err_msg=objective)


@pytest.mark.parametrize("share", mostly_long([0.0, 0.3, 3.0], 3.0))
@pytest.mark.parametrize("count", mostly_long([1, 2], 1))
def test_dry_friction_of_any_size_that_differs_by_direction(share, count):
    bare = load_robot("z1", **ROBOTS["z1"])
    dry = share * np.array([2.0, 8.0, 5.0, 1.0, 0.5, 0.5, 0.1])
    friction = Friction(np.full(7, 0.1), dry, np.full(7, 0.01), 0.4 * dry)
    problem = problem_of("z1", robot=replace(bare, friction=friction))
    x = motions(problem, count)
    expected, F = dense_values(problem, x), problem.evaluate(x)[0]
    for column, objective in zip(F.T, OBJECTIVES, strict=True):
        np.testing.assert_allclose(column, expected[objective], rtol=APART.get(objective, 1e-4), err_msg=objective)


@pytest.mark.parametrize("count", mostly_long([1, 2], 1))
def test_a_joint_that_rests_has_no_dry_friction(count):
    problem = problem_of("puma560")
    points = np.array(problem.settings["points"])
    points[:, 2] = 0.3
    still = ViaPointProblem(**(problem.settings | {"points": points.tolist()}))
    x = motions(still, count)
    expected, F = dense_values(still, x), still.evaluate(x)[0]
    for column, objective in zip(F.T, OBJECTIVES, strict=True):
        np.testing.assert_allclose(column, expected[objective], rtol=APART.get(objective, 1e-4), err_msg=objective)


@pytest.mark.parametrize("name", ["ur5", "puma560"])
def test_derivatives_are_those_of_differences(name):
    problem = problem_of(name)
    x = motions(problem, 3, seed=5)
    dF, step = problem.evaluate_with_gradients(x)[1], 1e-5
    rough = np.stack(
        [
            (problem.evaluate(x + step * e)[0] - problem.evaluate(x - step * e)[0]) / (2.0 * step)
            for e in np.eye(problem.n_var)
        ],
        axis=2,
    )
    scale = np.abs(rough).max(axis=2, keepdims=True)
    assert (np.abs(dF - rough) <= 1e-4 * scale).all()


@pytest.mark.parametrize("name", mostly_long(["ur5", "puma560"], "puma560"))
@pytest.mark.parametrize("count", mostly_long([15, 40, 150], 15))
def test_a_motion_has_the_same_values_alone_and_among_others(name, count):
    problem = problem_of(name)
    x = motions(problem, count)
    together = problem.evaluate(x)[0]
    for size in (1, 2, 3, 7):
        parts = [problem.evaluate(x[begin : begin + size])[0] for begin in range(0, len(x), size)]
        np.testing.assert_array_equal(np.concatenate(parts), together)
    np.testing.assert_array_equal(problem.evaluate(x[::-1])[0][::-1], together)


@pytest.mark.thinned(2)
@pytest.mark.parametrize("samples", [2, 3, 5, 8, 20, 60])
def test_the_number_of_first_samples_does_not_matter(samples):
    usual, other = problem_of("ur5"), problem_of("ur5", samples=samples)
    x = motions(usual)
    for objective, first, second in zip(OBJECTIVES, usual.evaluate(x)[0].T, other.evaluate(x)[0].T, strict=True):
        np.testing.assert_allclose(second, first, rtol=2e-4, err_msg=objective)


def test_segments_get_the_nodes_that_they_need():
    problem = problem_of("ur5", "septic_spline")
    slow, fast = (problem.rollout(np.full((1, problem.n_var), time)) for time in (3.0, 0.1))
    sizes = [{len(group.nodes.shares) for group in rollout.resolved} for rollout in (slow, fast)]
    assert max(sizes[0]) <= max(sizes[1]) <= MOST_NODES
    for rollout in (slow, fast):
        numbers = np.concatenate([group.segments for group in rollout.resolved])
        np.testing.assert_array_equal(np.sort(numbers), np.arange(rollout.trajectory.segment_durations.size))


@pytest.mark.parametrize("samples", [2, 3, 6, 13])
def test_nested_nodes_hold_each_other_and_integrate_polynomials(samples):
    sets = nested(samples)
    np.testing.assert_array_equal(sets[0].shares, lobatto(samples)[0])
    for coarse, fine in pairwise(sets):
        np.testing.assert_array_equal(fine.shares[::2], coarse.shares)
    for nodes in sets:
        power = min(len(nodes.shares) - 1, 6)
        values = nodes.shares**power
        integrals = np.diff(nodes.shares ** (power + 1)) / (power + 1)
        np.testing.assert_allclose(nodes.integrals @ values, integrals, atol=1e-13)
        np.testing.assert_allclose(nodes.slopes @ values, power * nodes.shares ** (power - 1), atol=1e-9)
        inside = np.linspace(0.0, 1.0, 7)
        np.testing.assert_allclose(nodes.onto(inside) @ values, inside**power, atol=1e-12)


def test_crossings_lie_where_polynomials_change_their_sign():
    roots = np.linspace(0.05, 0.95, 7)
    line = np.stack([-roots, np.ones(7), np.zeros(7), np.zeros(7)])
    ends = np.zeros(7), np.ones(7)
    np.testing.assert_allclose(polynomials.crossing(line, *ends), roots, atol=1e-12)
    np.testing.assert_array_equal(polynomials.crossing(line, np.full(7, 0.96), np.ones(7)), np.ones(7))
    np.testing.assert_array_equal(polynomials.crossing(np.abs(line), *ends), np.ones(7))


def test_integrals_of_septic_motions_hardly_change_with_more_samples():
    problem = problem_of("ur5", "septic_spline")
    rollout = problem.rollout(motions(problem, 1))
    for function in (efforts.mechanical_energy, efforts.integrated_square_effort, travel.tool_path_length):
        values = [function(replace(rollout, dynamics=rollout.dynamics.sampled(samples)))[0] for samples in (6, 12, 24)]
        np.testing.assert_allclose(values[:2], values[2], rtol=1e-4)
