"""Loads that are picked up and put down on the way: efforts, objectives, limits, capacities, files, and bad input."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from tests.helpers import assert_exact_gradients, refused, trajevo
from trajevo import (
    Front,
    Load,
    Passing,
    Payload,
    Study,
    ViaPointProblem,
    capacities,
    certify,
    check,
    dlcc,
    export,
    optimise,
    payload_bounds,
    payload_effort,
    slowdown_for,
    verify,
)
from trajevo.capacity.payload_time import capacity_front, largest_payload, max_payload_problem
from trajevo.capacity.robust import robust_slowdown
from trajevo.capacity.scaled_path import ScaledPath
from trajevo.capacity.sensitivity import sensitivity
from trajevo.capacity.uncertainty import robust_problem
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.payload_masses import masses_held
from trajevo.dynamics.rollout import Rollout
from trajevo.page.facts import run_facts
from trajevo.path.loads import together
from trajevo.problems.puma_kinematics import TABLE_1_JOINTS
from trajevo.robot.payload import carrying
from trajevo.solvers.evolutionary.first_population import first_population
from trajevo.solvers.rivals import rivals_of
from trajevo.solvers.task import load_task
from trajevo.trajectory.polynomial import PolynomialBatch
from trajevo.verification.newton_euler import NewtonEuler

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
SMALL = {"population": 16, "generations": 3, "polish": False, "progress": False}


def made(payload, **given):
    usual = {"robot": ARM, "points": POINTS, "passing": DWELLS, "objectives": OBJECTIVES, "constraints": LIMITS}
    return ViaPointProblem(payload=payload, **(usual | {"duration_bounds": (0.4, 3.0)} | given))


@pytest.fixture(scope="module")
def problem():
    return made([GRIPPER, Load(PART, from_point=1, to_point=3)])


@pytest.fixture(scope="module")
def front():
    task = made([GRIPPER, Load(PART, from_point=1, to_point=3)], objectives=("time", "energy"), samples=4)
    return optimise(task, seed=1, **SMALL)


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


def test_a_single_load_needs_no_list():
    load = {"mass": 3.0, "com": [0.0, 0.0, 0.1], "from": 1, "to": 3}
    listed = made([load])
    for given in (load, Load(Payload(3.0, (0.0, 0.0, 0.1)), 1, 3)):
        assert made(given).settings == listed.settings


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
    alone = [
        Dynamics(problem.robot, one).effort(*states) - dynamics.unloaded_effort(*states) for one in (GRIPPER, PART)
    ]
    np.testing.assert_allclose(both.effort(*states), dynamics.unloaded_effort(*states) + sum(alone), atol=1e-11)


def test_point_masses_are_one_body_wherever_they_are():
    random = np.random.default_rng(1)
    for count in (2, 2, 2, 3, 5) * 40:
        masses, places = random.uniform(0.1, 5.0, count), random.uniform(-0.3, 0.3, (count, 3))
        one = together([Payload(m, tuple(c)) for m, c in zip(masses.tolist(), places.tolist(), strict=True)])
        about = np.array(one.inertia)
        arms = places - np.array(one.com)
        expected = sum(m * (r @ r * np.eye(3) - np.outer(r, r)) for m, r in zip(masses, arms, strict=True))
        np.testing.assert_allclose(about, expected, atol=1e-14)
        assert one.mass == pytest.approx(masses.sum(), rel=1e-14)


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


@pytest.mark.parametrize("model", ["rigid", "weight_only", "tool_axis"])
def test_every_model_of_a_payload_and_friction_change_with_the_load(model):
    load = {"mass": 2.0, "model": model} | ({} if model == "tool_axis" else {"com": [0.0, 0.02, 0.1]})
    task = ViaPointProblem(
        robot="puma560",
        points=TABLE_1_JOINTS,
        payload=[load | {"from": 1, "to": 2}],
        objectives=("energy", "square_effort"),
        constraints=("effort",),
    )
    assert task.robot.friction.is_dry
    x = vectors(task, 2)
    rollout, batch, F = task.rollout(x), task.decode(x), task.evaluate(x, return_values_of=["F"])
    carried = [Payload.of(load, model=None) if loads else Payload(0.0) for loads in task.dynamics.schedule.carried]
    for k, payload in enumerate(carried):
        states = (x[0, rollout.segments == k] for x in (rollout.q, rollout.without_rounding(rollout.v), rollout.a))
        expected = NewtonEuler(task.robot, payload).effort(*states)
        np.testing.assert_allclose(rollout.effort[0, rollout.segments == k], expected, atol=1e-10)
    parts = [Rollout(Dynamics(task.robot, payload), part_of(batch, [k])) for k, payload in enumerate(carried)]
    for column, objective in enumerate(task.objectives):
        np.testing.assert_allclose(F[:, column], sum(map(objective.function, parts)), rtol=1e-4)
    bounds, greatest = certify(task.rollout(x[0])), np.abs(task.rollout(x[0]).effort[0]).max(axis=0)
    proven = {row.joint: row.bound for row in bounds.rows if row.quantity == "effort"}
    assert (greatest <= np.array([proven[name] for name in task.robot.joint_names])).all()


def test_efforts_in_states_of_several_motions_are_those_of_their_instants(problem):
    x = vectors(problem, 3)
    rollout = problem.rollout(x)
    motion = rollout.trajectory.sample(50)
    found = rollout.effort_in(motion.q, motion.v, motion.a, motion.t)
    for row in range(3):
        begin, end = rollout.trajectory.breaks[row, [2, 4]]
        on = (motion.t[row] >= begin) & (motion.t[row] < end)
        for chosen, payload in ((on, together([GRIPPER, PART])), (~on, GRIPPER)):
            states = (values[row, chosen] for values in (motion.q, motion.v, motion.a))
            expected = NewtonEuler(problem.robot, payload).effort(*states)
            np.testing.assert_allclose(found[row, chosen], expected, atol=1e-9)


def test_first_populations_are_stretched_to_the_efforts_with_the_load():
    task = made([GRIPPER, {"mass": 15.5, "from": 1, "to": 3}], objectives=("time",), constraints=("effort",), samples=4)
    found = first_population(task, 6, starts="spread", seed=1)
    G = task.evaluate(found.X, return_values_of=["G"])
    assert (G <= 0.0).all()
    rollout = task.rollout(found.X)
    used = (np.abs(rollout.effort) / task.robot.limits.effort).max(axis=2)
    assert (used.max(axis=1) > 0.9).all()
    assert np.isin(rollout.segments[used.argmax(axis=1)], (2, 3)).all()


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
    _, dF, _, dG = problem.evaluate_with_gradients(x)
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
    certificate = certify(best, tolerance=0.01)
    assert certificate.proven
    dense = Rollout(best.rollout.dynamics.sampled(150), best.trajectory)
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


def with_mass(rollout, mass, samples=600):
    """A motion with another mass of the load that capacities mean, at many samples."""
    dynamics = rollout.dynamics.sampled(samples)
    return Rollout(replace(dynamics, payload=dynamics.payload.with_mass(mass)), rollout.trajectory)


def test_capacity_is_what_may_be_carried_on_the_loaded_part_with_all_else_as_it_is(front):
    best = front.knee()
    found = dlcc(best)
    light, heavy = (with_mass(best.rollout, mass).effort[0] for mass in (1.0, 2.0))
    each, limit = heavy - light, best.rollout.robot.limits.effort
    carrying = np.isin(with_mass(best.rollout, 1.0).segments, (2, 3))
    assert not each[~carrying].any()
    room = (limit - np.sign(each) * (light - each))[carrying] / np.abs(each[carrying]).clip(1e-12)
    assert found.mass == pytest.approx(room.min(), rel=1e-3)
    assert found.mass <= room.min()
    first, last = best.rollout.trajectory.breaks[0, [2, 4]]
    assert first - 1e-9 <= found.time <= last + 1e-9
    always = made([GRIPPER, Load(PART, vary=True)])
    assert found.mass > dlcc(always.rollout(best.x)).mass


def test_every_way_to_the_capacity_agrees(front):
    best = front.knee()
    mass, com = dlcc(best).mass, [PART.com]
    assert capacities(front).mass[best.index] == pytest.approx(mass, rel=1e-3)
    sampled, proven = payload_effort(best).mass_range(com), payload_bounds(best).mass_range(com)
    assert sampled.upper[0] == pytest.approx(mass, rel=1e-3)
    assert proven.upper[0] == pytest.approx(mass, rel=3e-3)
    assert proven.upper[0] <= sampled.upper[0]


@pytest.mark.parametrize("seed", [*range(4), *(pytest.param(seed, marks=pytest.mark.long) for seed in range(4, 60))])
def test_capacities_and_certificates_of_random_loads_are_those_of_dense_samples(seed):
    random = np.random.default_rng(seed)
    given = []
    for k in range(random.integers(1, 4)):
        first, last = sorted(random.choice(5, 2, replace=False).tolist())
        load = {"mass": float(random.uniform(0.3, 4.0)), "com": random.uniform(-0.1, 0.15, 3).tolist()}
        given.append(load | ({"from": first, "to": last} if random.random() < 0.8 or not k else {}))
    given[0]["vary"] = True
    stops = [Passing(point, dwell=0.2) for point in (1, 2, 3) if random.random() < 0.5]
    task = made(given, passing=stops, interpolant=str(random.choice(["quintic_spline", "cubic", "septic_spline"])))
    rollout = task.rollout(random.uniform(np.maximum(task.xl, 0.6), task.xu))
    dense = Rollout(rollout.dynamics.sampled(100), rollout.trajectory)
    proven = {row.joint: row.bound for row in certify(rollout, tolerance=0.01).rows if row.quantity == "effort"}
    bounds = np.array([proven[name] for name in task.robot.joint_names])
    assert (np.abs(dense.effort[0]).max(axis=0) <= bounds * (1.0 + 1e-12)).all()
    found = dlcc(rollout)
    assert found.feasible

    def used(mass):
        return (np.abs(with_mass(rollout, mass, 300).effort[0]) / task.robot.limits.effort).max()

    assert used(found.mass) <= 1.0 + 1e-9
    assert used(1.0005 * found.mass) > 1.0


def test_a_motion_that_breaks_a_limit_without_the_load_has_no_capacity():
    task = made([Load(Payload(40.0)), Load(PART, 1, 3)], objectives=("time",))
    found = dlcc(task.rollout(np.full(task.n_var, 2.0)))
    assert found.mass == 0.0
    assert not found.feasible


def test_slower_motions_are_proven_with_the_load_where_it_is_carried(front):
    best = front.knee()
    mass = 0.9999 * ScaledPath(best, 20).static_bound
    found = slowdown_for(best, mass)
    assert found.proven
    assert found.limit == "effort"
    slower = with_mass(found.rollout, mass)
    used = (np.abs(slower.effort[0]) / slower.robot.limits.effort).max(axis=1)
    assert used.max() == pytest.approx(1.0, abs=1e-4)
    assert used.max() <= 1.0
    assert slower.segments[used.argmax()] in (2, 3)


def test_sensitivities_are_those_of_the_loaded_part(front):
    best = front.knee()
    found, step = sensitivity(best), 1e-5
    masses = [
        sensitivity(replace(best.rollout, trajectory=best.trajectory.slowed(1.0 + sign * step))).mass
        for sign in (1.0, -1.0)
    ]
    assert found.per_percent_slower == pytest.approx(0.01 * (masses[0] - masses[1]) / (2.0 * step), rel=1e-3)


def test_the_mass_of_the_load_as_a_variable(problem):
    task = made([GRIPPER, Load(PART, 1, 3)], objectives=("time", "unused_payload"))
    ends = [np.array(POINTS[k]) for k in (1, 3)]
    held = min(masses_held(Dynamics(heavier(problem.robot, GRIPPER), PART), q[None])[1] for q in ends)
    assert task.payload_range[1] == pytest.approx(held, rel=1e-9)
    x = vectors(task, 3)
    for row, mass in enumerate(x[:, -1].tolist()):
        fixed = made([GRIPPER, Load(PART.with_mass(mass), 1, 3)])
        given, expected = task.rollout(x[row]), fixed.rollout(x[row, :-1])
        np.testing.assert_allclose(given.effort, expected.effort, atol=1e-10)
    sampled = made([GRIPPER, Load(PART, 1, 3)], objectives=("energy", "unused_payload"), limits="sampled")
    assert_exact_gradients(sampled, x)


def heavier(robot, payload):
    return replace(robot, model=carrying(robot, payload))


def test_largest_payload_and_curves_keep_the_other_loads():
    task = made([GRIPPER, Load(PART, 1, 3)], objectives=("time",), constraints=("velocity", "effort"), samples=4)
    found = largest_payload(task, within=3.0, seed=1, starts=1)
    assert found.mass <= found.at_rest
    assert dlcc(found.rollout).mass == pytest.approx(found.mass, rel=1e-2)
    loaded = max_payload_problem(task)
    assert loaded.dynamics.schedule == task.dynamics.schedule
    curve = capacity_front(task, [0.0, 5.0], seed=1, starts=1)
    assert np.isfinite(curve.times).all()
    assert task.with_payload(PART.with_mass(5.0)).settings["payload"] == [
        Load(GRIPPER).settings,
        Load(PART.with_mass(5.0), 1, 3).settings,
    ]


def test_a_load_that_is_not_known_well_is_so_where_it_is_carried(problem, front):
    best, com = front.knee(), np.array(PART.com)
    robust = robust_problem(problem, mass=(2.0, 4.0), com=[com - 0.05, com + 0.05])
    rollout = best.rollout
    limit = next(c for c in robust.constraints if c.quantity == "effort of every payload")
    G = limit.function(rollout)[0]
    worst = np.full(6, -np.inf)
    random = np.random.default_rng(0)
    for mass, offset in zip(random.choice([2.0, 4.0], 60), random.choice([-0.05, 0.05], (60, 3)), strict=True):
        other = replace(PART.with_mass(mass), com=tuple((com + offset).tolist()))
        moved = Rollout(replace(rollout.dynamics, payload=other), rollout.trajectory)
        worst = np.maximum(worst, np.abs(moved.effort[0]).max(axis=0) / problem.robot.limits.effort - 1.0)
    assert (worst <= G + 1e-12).all()
    np.testing.assert_allclose(worst, G, atol=0.02)
    least = robust_slowdown(best, mass=(2.0, 4.0), com=[com - 0.05, com + 0.05])
    assert least.factor <= 1.0


# --- before the search


def test_points_are_checked_with_what_is_held_before_and_after_the_change():
    def used(payload):
        return check(made(payload)).effort_used.max(axis=1)

    before, with_part = used(GRIPPER), used(together([GRIPPER, PART]))
    found = used([GRIPPER, Load(PART, 1, 3)])
    np.testing.assert_allclose(found[[0, 4]], before[[0, 4]], rtol=1e-12)
    np.testing.assert_allclose(found[[1, 2, 3]], np.maximum(before, with_part)[[1, 2, 3]], rtol=1e-12)
    later = used([GRIPPER, Load(PART, 2)])
    np.testing.assert_allclose(later[[0, 1]], before[[0, 1]], rtol=1e-12)
    np.testing.assert_allclose(later[[2, 3, 4]], np.maximum(before, with_part)[[2, 3, 4]], rtol=1e-12)


def test_a_part_that_cannot_be_held_where_it_is_picked_up_is_told_before_the_search():
    told = check(made([{"mass": 40.0, "from": 1, "to": 3}]))
    assert {finding.point for finding in told.impossible} == {1, 3}
    assert "40 kg from point 1 to point 3" in told.title
    assert any("a payload of at most" in finding.remedy for finding in told.impossible)


# --- settings and files


def test_settings_survive_json(front):
    problem = front.problem
    again = ViaPointProblem(**json.loads(json.dumps(problem.settings)))
    assert again.settings == problem.settings
    assert again.dynamics.schedule == problem.dynamics.schedule
    assert (again.evaluate(front.X, return_values_of=["F"]) == front.F).all()


def test_fronts_are_read_back_with_their_loads(front, tmp_path):
    front.save(tmp_path / "front.json")
    read = Front.load(tmp_path / "front.json")
    assert read.problem.dynamics.schedule == front.problem.dynamics.schedule
    assert dlcc(read.knee()).mass == dlcc(front.knee()).mass
    assert "1 kg all the time, 3 kg from point 1 to point 3" in dict(run_facts(read))["payload"]


def test_samples_of_exports_have_the_effort_with_the_load(front, tmp_path):
    best = front.knee()
    told = json.loads(export(best, tmp_path / "motion.json", format="json", step=0.01).read_text())
    samples = {header.split(" [")[0]: np.array(column) for header, column in told["samples"].items()}
    t, names = samples["time"], best.rollout.robot.joint_names
    loads = best.rollout.trajectory.breaks[0, [2, 4]]
    carrying_part = (t >= loads[0]) & (t < loads[1])
    states = [
        np.stack([samples[f"{name} {what}"] for name in names], 1) for what in ("position", "velocity", "acceleration")
    ]
    found = np.stack([samples[f"{name} effort"] for name in names], 1)
    for chosen, carried in ((carrying_part, together([GRIPPER, PART])), (~carrying_part, GRIPPER)):
        expected = NewtonEuler(best.rollout.robot, carried).effort(*(x[chosen] for x in states))
        np.testing.assert_allclose(found[chosen], expected, atol=1e-8)


TASK = """
duration_bounds = [0.4, 3.0]
points = [
  [0.0, -1.5, 1.5, -1.5, -1.5, 0.0],
  [0.8, -1.2, 1.4, -1.7, -1.5, 0.0],
  [0.4, -1.0, 1.0, -1.0, -1.0, 0.3],
  [0.2, -1.2, 1.4, -1.7, -1.5, 0.1],
]
objectives = ["time", "energy"]

[robot]
name = "ur5"
tool = "tool0"

[limits]
acceleration = 10.0
jerk = 100.0

[[passing]]
point = 1
dwell = 0.3

[[payload]]
mass = 1.0
com = [0.0, 0.0, "50 mm"]

[[payload]]
mass = "3000 g"
from = 1
to = 2
"""


def test_tasks_say_what_is_carried_from_where_to_where(tmp_path):
    file = tmp_path / "task.toml"
    file.write_text(TASK, encoding="utf-8")
    task = load_task(file)
    expected = [{"mass": 1.0, "com": [0.0, 0.0, 0.05]}, {"mass": 3.0, "from": 1, "to": 2}]
    same = made(expected, points=POINTS[:4], passing=DWELLS[:1])
    assert task.problem.settings["payload"] == same.settings["payload"]
    assert task.problem.dynamics.schedule == same.dynamics.schedule
    told = trajevo("check", str(file))
    assert told.returncode == 0, told.stderr
    assert "1 kg all the time, 3 kg from point 1 to point 2" in told.stdout


def test_a_task_may_say_of_its_only_payload_where_it_is_carried(tmp_path):
    text = TASK[: TASK.index("[[payload]]")] + "[payload]\nmass = 3.0\nfrom = 1\n"
    (tmp_path / "task.toml").write_text(text, encoding="utf-8")
    assert load_task(tmp_path / "task.toml").problem.dynamics.schedule.carried == ((), (), (0,), (0,))
    (tmp_path / "task.toml").write_text(text.replace("from", "form"), encoding="utf-8")
    refused(lambda: load_task(tmp_path / "task.toml"), "line 25: payload.form: unknown key; known: .*from")


def test_studies_vary_a_load_by_its_number(tmp_path):
    file = tmp_path / "task.toml"
    file.write_text(TASK, encoding="utf-8")
    study = Study(task=file, seed=1, repeats=1, factors={"payload.1.mass": [1.0, 2.5]})
    assert [[one["mass"] for one in job["arguments"]["payload"]] for job in study.jobs] == [[1.0, 1.0], [1.0, 2.5]]
    refused(
        lambda: Study(task=file, seed=1, factors={"payload.2.mass": [1.0]}),
        "factors.payload.2.mass: payload.2 is no table in this task, but None",
    )


def test_the_capacity_of_a_run_says_of_which_load_it_is(front, tmp_path):
    front.save(tmp_path / "front.json")
    told = trajevo("capacity", str(tmp_path))
    assert told.returncode == 0, told.stderr
    said = " ".join(told.stdout.split())
    assert (
        "the mass of payload 1, where it is carried; carried: 1 kg all the time, 3 kg from point 1 to point 3" in said
    )


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("from = 1\nto = 2", "from = 2\nto = 1", "line 30: payload.1.to: expected a later point than 2"),
        ("to = 2", "to = 7", "line 30: payload.1.to: expected the number of a point, 0 to 3, got 7"),
        ("to = 2", "too = 2", "payload.1.too: unknown key; .*did you mean 'to'"),
        ("from = 1", "from = -1", "line 29: payload.1.from: expected a number greater than or equal to 0"),
        ("from = 1", "from = 1.5", "line 29: payload.1.from: expected a whole number"),
        ('mass = "3000 g"', "mass = -3.0", "line 28: payload.1.mass: expected a number from 0 on"),
        ('mass = "3000 g"', "com = [0.0, 0.0, 0.0]", "payload.1.mass: this key is missing"),
        ('mass = "3000 g"', 'mass = 3.0\nmodel = "weight_only"', "payload.1.model: expected 'rigid', as there are"),
    ],
)
def test_mistakes_in_a_task_are_told_with_line_and_key(tmp_path, old, new, sentence):
    file = tmp_path / "task.toml"
    assert old in TASK
    file.write_text(TASK.replace(old, new), encoding="utf-8")
    refused(lambda: load_task(file), sentence)


@pytest.mark.parametrize(
    ("payload", "sentence"),
    [
        ([], "payload: expected at least one load in the list"),
        ([{"mass": 1.0, "from": 2, "to": 2}], "payload.0.to: expected a later point than 2"),
        ([{"mass": 1.0, "to": 0}], "payload.0.to: expected a later point than 0.*never be carried"),
        ([{"mass": 1.0, "from": 4}], "payload.0.to: expected a later point than 4"),
        ([{"mass": 1.0, "from": 5}], "payload.0.from: expected the number of a point, 0 to 4, got 5"),
        ([{"mass": 1.0, "from": True}], "payload.0.from: expected the number of a point"),
        ([1.0, {"mass": 1.0, "form": 1}], "payload.1: unknown key 'form'; .*did you mean 'from'"),
        ([{"from": 1}], "payload.0.mass: expected a mass"),
        ({"mass": 1.0, "from": 3, "to": 2}, "payload.0.to: expected a later point than 3"),
        ([{"mass": 1.0, "vary": "yes"}], "payload.0.vary: expected true or false"),
        ([{"mass": 1.0, "vary": True}, {"mass": 1.0, "vary": True}], "payload.1.vary: expected one load"),
        ([{"mass": 1.0, "com": [0, 0, 30]}], "payload.0.com: .*looks like mm"),
        ([{"mass": 1.0}, {"mass": 1.0, "model": "tool_axis"}], "payload.1.model: expected 'rigid'"),
    ],
)
def test_bad_loads_are_refused(payload, sentence):
    refused(lambda: made(payload), sentence)


@pytest.mark.parametrize(
    ("payload", "sentence"),
    [
        ({"mass": 1.0, "from": 1}, "payload.0.to: expected the number of a point, as a cyclic motion goes on"),
        ({"mass": 1.0, "to": 1}, "payload.0.from: expected the number of a point, as a cyclic motion goes on"),
        ({"mass": 1.0, "from": 0, "to": 4}, "payload.0.to: expected another point of the cycle than 0"),
    ],
)
def test_a_cycle_says_where_its_loads_are_put_down(payload, sentence):
    refused(lambda: made([payload], passing=(), cyclic=True), sentence)


def test_questions_about_one_load_need_to_know_which(tmp_path):
    two = [{"mass": 1.0, "from": 0, "to": 2}, {"mass": 2.0, "from": 2}]
    open_ = made(two, objectives=("time",))
    rollout = open_.rollout(np.full(open_.n_var, 1.0))
    sentence = "payload: .* asks about one load, and there are 2: 1 kg from point 0 to point 2, .*vary = true"
    for ask in (dlcc, capacities, payload_effort, lambda motion: slowdown_for(motion, 2.0)):
        refused(lambda ask=ask: ask(rollout), sentence)
    refused(lambda: made(two, objectives=("time", "unused_payload")), sentence)
    refused(lambda: robust_problem(open_, mass=(1.0, 2.0), com=[[0.0] * 3] * 2), sentence)
    refused(lambda: open_.with_payload(PART), sentence)
    named = made([two[0], two[1] | {"vary": True}], objectives=("time",))
    assert dlcc(named.rollout(np.full(open_.n_var, 1.0))).mass > 0.0
    refused(lambda: rivals_of(open_), "rivals: expected")


def test_a_rollout_of_other_segments_is_refused(problem):
    trajectory = made(PART, passing=()).decode(np.ones((1, 4)))
    refused(lambda: Rollout(problem.dynamics, trajectory), "trajectory: expected 6 segments")
    refused(lambda: problem.dynamics.effort(*np.zeros((3, 2, 6))), "segments: expected")
    rollout = problem.rollout(np.ones(problem.n_var))
    refused(lambda: rollout.effort_in(rollout.q, rollout.v, rollout.a), "t: expected the instants of the states")
