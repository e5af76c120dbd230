"""Loads that are picked up and put down on the way: efforts, objectives, limits, capacities, files, and bad input."""

import json
import re

import numpy as np
import pytest

from tests.helpers import refused, trajevo
from trajevo import (
    Front,
    Load,
    Passing,
    Payload,
    ViaPointProblem,
    certify,
    check,
    dlcc,
    export,
    load_robot,
    optimise,
    payload_bounds,
    payload_effort,
    slowdown_for,
    verify,
)
from trajevo.capacity.payload_time import capacity_front, largest_payload, max_payload_problem
from trajevo.capacity.uncertainty import robust_problem
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.path.loads import together
from trajevo.solvers.optimise import load_task
from trajevo.solvers.rivals import rivals_of
from trajevo.trajectory.polynomial import PolynomialBatch

ARM = {"name": "ur5", "tool": "tool0", "limits": {"acceleration": 10.0, "jerk": 100.0}, "gravity": (0.0, 0.0, -9.81)}
POINTS = [
    [0.0, -1.5, 1.5, -1.5, -1.5, 0.0],
    [0.8, -1.2, 1.4, -1.7, -1.5, 0.0],
    [0.4, -1.0, 1.0, -1.0, -1.0, 0.3],
    [0.2, -1.2, 1.4, -1.7, -1.5, 0.1],
    [0.0, -1.5, 1.5, -1.5, -1.5, 0.0],
]
GRIPPER = Payload(1.0, (0.0, 0.0, 0.05), ((0.002, 0.0, 0.0), (0.0, 0.003, 0.0), (0.0, 0.0, 0.001)))
PART = Payload(3.0, (0.01, -0.02, 0.12), ((0.01, 0.001, 0.0), (0.001, 0.012, 0.0), (0.0, 0.0, 0.008)))
DWELLS = (Passing(1, dwell=0.3), Passing(3, dwell=0.3))
LIMITS = ("position", "velocity", "acceleration", "jerk", "effort")
OBJECTIVES = ("time", "energy", "square_power", "square_effort", "square_effort_rate", "effort_ratio")
SMALL = {"population": 24, "generations": 6, "progress": False}


def made(payload, **given):
    usual = {"robot": ARM, "points": POINTS, "passing": DWELLS, "objectives": OBJECTIVES, "constraints": LIMITS}
    return ViaPointProblem(payload=payload, **(usual | {"duration_bounds": (0.4, 3.0)} | given))


@pytest.fixture(scope="module")
def problem():
    return made([GRIPPER, Load(PART, from_point=1, to_point=3)])


@pytest.fixture(scope="module")
def front(problem):
    return optimise(problem, seed=1, **SMALL)


def vectors(problem, count, seed=0):
    return np.random.default_rng(seed).uniform(problem.xl, problem.xu, (count, problem.n_var))


def part_of(batch, segments):
    """The motions on some consecutive segments alone."""
    breaks = batch.breaks[:, segments[0] : segments[-1] + 2]
    return PolynomialBatch(breaks - breaks[:, :1], batch.coefficients[:, segments])


# --- what is carried where


def test_a_load_is_there_after_the_dwell_at_its_first_point_and_until_that_at_its_last(problem):
    assert problem.dynamics.schedule.carried == ((0,), (0,), (0, 1), (0, 1), (0,), (0,))
    on_the_way = made([{"mass": 1.0, "to": 2}, {"mass": 2.0, "from": 2}, {"mass": 0.5, "from": 1, "to": 2}], passing=())
    assert on_the_way.dynamics.schedule.carried == ((0,), (0, 2), (1,), (1,))


@pytest.mark.parametrize("name", ["cubic", "hybrid", "polynomial", "quintic_spline", "septic_spline"])
def test_loads_change_where_segments_meet_at_points_that_are_passed_on_the_way(name):
    check_places(made([{"mass": 1.0}, {"mass": 2.0, "from": 1, "to": 3}], interpolant=name, passing=()), 1, 3)


@pytest.mark.parametrize("name", ["cubic", "hybrid", "linear_blends", "polynomial", "quintic_spline", "septic_spline"])
def test_loads_change_where_motions_stop_with_every_interpolant(name):
    stop = [Passing(2, dwell=0.2)]
    check_places(made([{"mass": 1.0}, {"mass": 2.0, "from": 2}], interpolant=name, passing=stop), 2, 4, 0.2)


def check_places(task, first, last, wait=0.0):
    x = vectors(task, 2)
    for breaks, times in zip(task.decode(x).breaks, task.via_times(x), strict=True):
        middle = 0.5 * (breaks[1:] + breaks[:-1])
        expected = (middle > times[first] + wait) & (middle < times[last])
        np.testing.assert_array_equal([1 in loads for loads in task.dynamics.schedule.carried], expected)
        assert expected.any()
        assert not expected.all()


def test_loads_cannot_change_within_a_segment():
    sentence = re.escape("payload.0.from: expected a point at which two segments meet, and point 1 is passed within")
    refused(lambda: made([{"mass": 2.0, "from": 1, "to": 3}], interpolant="linear_blends", passing=()), sentence)


def test_a_cycle_carries_across_its_seam():
    cycle = made([{"mass": 1.0, "from": 3, "to": 1}], passing=(), cyclic=True)
    assert cycle.dynamics.schedule.carried == ((0,), (), (), (0,))


# --- efforts


def test_efforts_are_those_of_a_body_that_is_fixed_to_the_tool_while_it_is_carried(problem):
    twin = pytest.importorskip("tests.twin", reason="MuJoCo is not installed: pip install 'trajevo[twin]'")
    rollout = problem.rollout(vectors(problem, 1))
    empty, loaded = (
        twin.Twin.of(problem.robot, payload, gravity=ARM["gravity"]) for payload in (GRIPPER, together([GRIPPER, PART]))
    )
    carrying = np.isin(rollout.segments, (2, 3))
    for chosen, engine in ((~carrying, empty), (carrying, loaded)):
        states = (x[0, chosen] for x in (rollout.q, rollout.v, rollout.a))
        np.testing.assert_allclose(rollout.effort[0, chosen], engine.effort(*states), rtol=0.0, atol=1e-9)


def test_the_effort_jumps_at_the_points_where_the_load_changes_and_nowhere_else(problem):
    rollout = problem.rollout(vectors(problem, 1))
    effort = rollout.effort[0].reshape(6, -1, 6)
    jumps = np.abs(effort[1:, 0] - effort[:-1, -1]).max(axis=1)
    assert (jumps > 1.0).tolist() == [False, True, False, True, False]
    assert jumps[[0, 2, 4]].max() < 1e-9
    held = rollout.dynamics.robot.model.gravity.linear[2]
    assert jumps[1] <= PART.mass * abs(held) * 1.5


def test_several_rigid_loads_are_one(problem):
    dynamics, both = Dynamics(problem.robot), Dynamics(problem.robot, together([GRIPPER, PART]))
    states = np.random.default_rng(0).uniform(-1.0, 1.0, (3, 20, 6))
    alone = [Dynamics(problem.robot, one).effort(*states) - dynamics.unloaded_effort(*states) for one in (GRIPPER, PART)]
    np.testing.assert_allclose(both.effort(*states), dynamics.unloaded_effort(*states) + sum(alone), atol=1e-11)


def test_loads_that_never_change_are_the_payload_that_they_are_together():
    apart, one = made([GRIPPER, PART]), made(together([GRIPPER, PART]))
    x = vectors(apart, 4)
    for key in ("F", "G"):
        given, expected = (task.evaluate(x, return_values_of=[key]) for task in (apart, one))
        np.testing.assert_allclose(given, expected, rtol=1e-11)


def test_a_single_load_without_points_is_the_payload_itself():
    listed, plain = made([PART]), made(PART)
    assert listed.settings == plain.settings
    assert listed.dynamics.schedule is None


# --- objectives and limits


def test_objectives_are_those_of_the_parts_of_the_motion_with_their_own_payload(problem):
    x = vectors(problem, 3)
    whole, batch = problem.evaluate(x, return_values_of=["F"]), problem.decode(x)
    parts = (([0, 1], GRIPPER), ([2, 3], together([GRIPPER, PART])), ([4, 5], GRIPPER))
    found = np.array(
        [
            [objective.function(Rollout(Dynamics(problem.robot, carried), part_of(batch, on))) for on, carried in parts]
            for objective in problem.objectives
        ]
    )
    expected = np.stack([*found[:5].sum(axis=1), found[5].max(axis=0)], axis=1)
    np.testing.assert_allclose(whole, expected, rtol=1e-4)
    np.testing.assert_allclose(whole[:, [0, 5]], expected[:, [0, 5]], rtol=1e-9)


def test_a_motion_has_the_same_digits_alone_and_among_others(problem):
    x = vectors(problem, 9)
    F, G = problem.evaluate(x, return_values_of=["F", "G"])
    for row in (0, 4, 8):
        alone = problem.evaluate(x[row : row + 1], return_values_of=["F", "G"])
        assert (alone[0][0] == F[row]).all()
        assert (alone[1][0] == G[row]).all()


def test_gradients_are_those_of_finite_differences():
    problem, step = made([GRIPPER, Load(PART, from_point=1, to_point=3)], limits="sampled"), 1e-6
    x = vectors(problem, 1, seed=3)
    F, dF, G, dG = problem.evaluate_with_gradients(x)
    for j, side in enumerate(step * np.eye(problem.n_var)):
        above, below = (problem.evaluate(x + sign * side, return_values_of=["F", "G"]) for sign in (1.0, -1.0))
        for slopes, k in ((dF, 0), (dG, 1)):
            rough = (above[k] - below[k])[0] / (2.0 * step)
            np.testing.assert_allclose(slopes[0, :, j], rough, rtol=1e-5, atol=1e-8 + 1e-5 * np.abs(rough).max())


def test_a_load_that_is_too_heavy_breaks_the_limit_where_it_is_carried_alone():
    task = made([{"mass": 30.0, "from": 1, "to": 3}])
    x = np.full((1, task.n_var), 2.5)
    rollout = task.rollout(x)
    over = (np.abs(rollout.effort[0]) > task.robot.limits.effort).any(axis=1)
    assert set(rollout.segments[over].tolist()) == {2, 3}
    assert task.evaluate(x, return_values_of=["G"]).max() > 0.0


def test_certificates_bound_efforts_on_every_segment_with_its_own_load(front, problem):
    best = front.knee()
    certificate = certify(best)
    assert certificate.proven
    dense = Rollout(best.rollout.dynamics.sampled(400), best.trajectory)
    greatest = np.abs(dense.effort[0]).max(axis=0)
    rows = {row.joint: row for row in certificate.rows if row.quantity == "effort"}
    for joint, found in zip(problem.robot.joint_names, greatest, strict=True):
        assert found <= rows[joint].bound
        assert rows[joint].bound <= found * 1.01 + 0.2


def test_certified_limits_are_decided_with_the_loads():
    task = made([{"mass": 16.0, "from": 1, "to": 3}], limits="certified", objectives=("time",))
    x = vectors(task, 40, seed=5)
    G = task.evaluate(x, return_values_of=["G"])
    columns = [k for k, name in enumerate(task.constraint_names) if name.startswith("effort")]
    dense = Rollout(task.dynamics.sampled(200), task.decode(x))
    used = np.abs(dense.effort).max(axis=1) / task.robot.limits.effort - 1.0
    kept = (G[:, columns] <= 0.0).all(axis=1)
    assert kept.any()
    assert not kept.all()
    assert (used[kept] <= 0.0).all()
    assert (used[~kept].max(axis=1) > -1e-6).all()


def test_verify_computes_the_efforts_by_its_own_recursion(front):
    found = verify(front.knee())
    assert found.effort_difference < 1e-9
    assert not found.exceeded
    assert found.record_mismatch == 0.0


# --- what can be carried


def capacity_by_samples(rollout, samples=600):
    """The greatest mass at dense samples, and the joint's limit that it uses up, from two efforts alone."""
    dynamics = rollout.dynamics.sampled(samples)
    light, heavy = (
        Rollout(dynamics_with(dynamics, mass), rollout.trajectory).effort[0] for mass in (1.0, 2.0)
    )
    each, limit = heavy - light, rollout.robot.limits.effort
    with np.errstate(divide="ignore", invalid="ignore"):
        room = np.where(each != 0.0, (limit - np.sign(each) * (light - each)) / np.abs(each), np.inf)
    return float(room.min())


def dynamics_with(dynamics, mass):
    from dataclasses import replace

    return replace(dynamics, payload=dynamics.payload.with_mass(mass))


def test_capacity_is_what_may_be_carried_on_the_loaded_part(front):
    best = front.knee()
    found = dlcc(best)
    expected = capacity_by_samples(best.rollout)
    assert found.mass == pytest.approx(expected, rel=1e-3)
    assert found.mass <= expected
    first, last = best.rollout.trajectory.breaks[0, [2, 4]]
    assert first - 1e-9 <= found.time <= last + 1e-9
    always = made(together([GRIPPER, PART]))
    assert found.mass >= dlcc(always.rollout(np.array(list(best.x.values()))[None])).mass - 2.0 * GRIPPER.mass


def test_every_way_to_the_capacity_agrees(front):
    best = front.knee()
    mass, com = dlcc(best).mass, [PART.com]
    sampled, proven = payload_effort(best).mass_range(com), payload_bounds(best).mass_range(com)
    assert sampled.upper[0] == pytest.approx(mass, rel=1e-3)
    assert proven.upper[0] == pytest.approx(mass, rel=2e-3)
    assert proven.upper[0] <= sampled.upper[0]
