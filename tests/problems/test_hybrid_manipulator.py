"""The 5-DOF hybrid manipulator: kinematics, Table 6, Table 7 in three conventions, payload everywhere, bad input."""

import copy
import json
import pickle

import numpy as np
import pytest

from tests import guo2016
from tests.guo2016 import GUO2016, TABLE_7
from tests.helpers import mostly_long
from trajevo import load_problem, load_robot, optimise
from trajevo.errors import InvalidInputError, UnknownNameError, UnreachableError
from trajevo.problems import HybridManipulator
from trajevo.problems.hybrid_kinematics import (
    forward_kinematics,
    inverse_kinematics,
    path_normals,
    saddle_line,
    tracking_error,
    via_positions,
)
from trajevo.problems.hybrid_manipulator import CONVENTIONS, PAPER_WEIGHTS, cost, paper_solution
from trajevo.robot.payload import LOAD_MODELS, Payload

ROBOT = load_robot("hybrid_manipulator")
every_convention = pytest.mark.parametrize("convention", CONVENTIONS)
every_model = pytest.mark.parametrize("model", LOAD_MODELS)


def random_intervals(count, seed=0, low=0.15, high=1.4):
    return np.random.default_rng(seed).uniform(low, high, (count, 12))


def random_joints(count, seed=0, tilt=(0.01, np.pi - 0.01)):
    """Joint positions inside the range with |α| < 45°."""
    rng, limits = np.random.default_rng(seed), ROBOT.limits
    q = rng.uniform(limits.lower, limits.upper, (20 * count, 5))
    q[:, 4] = rng.uniform(*tilt, len(q))
    return q[np.abs(q[:, 1] - q[:, 0]) < 0.419][:count]


def test_table_6_to_its_printed_digits():
    table = np.array(GUO2016["table6_mm_rad"])
    np.testing.assert_allclose(1000.0 * via_positions(), table[:, 5:], atol=1e-9)
    q = inverse_kinematics(via_positions(), path_normals(via_positions()))
    q[:, :3] *= 1000.0
    assert q[1, 2] == pytest.approx(325.1298, abs=1e-4)  # the paper cuts it off to 325.12 instead of rounding
    table[1, 2] = 325.13
    # half a unit of the last printed digit
    np.testing.assert_allclose(q[:, :3], table[:, :3], rtol=0.0, atol=0.005 + 1e-6)
    np.testing.assert_allclose(q[:, 3:], table[:, 3:5], rtol=0.0, atol=0.0005 + 1e-6)
    assert q[4, 2] == pytest.approx(226.38, abs=0.005)


def test_via_points_equal_the_stored_ones():
    axes = path_normals(via_positions())
    np.testing.assert_allclose(axes, GUO2016["tool_axes"], rtol=0.0, atol=1e-12)
    stored = GUO2016["via_points"]
    np.testing.assert_allclose(inverse_kinematics(via_positions(), axes), stored, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(HybridManipulator().interpolant.points.positions, stored, rtol=0.0, atol=1e-12)


def test_forward_of_inverse_kinematics():
    position, axis = forward_kinematics(random_joints(1000))
    assert len(position) == 1000
    again = forward_kinematics(inverse_kinematics(position, axis))
    np.testing.assert_allclose(again[0], position, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(again[1], axis, rtol=0.0, atol=1e-9)


def test_inverse_of_forward_kinematics():
    q = random_joints(1000, seed=1, tilt=(0.05, np.pi - 0.05))
    position, axis = forward_kinematics(q)
    np.testing.assert_allclose(inverse_kinematics(position, axis), q, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(inverse_kinematics(position, 3.0 * axis), q, rtol=0.0, atol=1e-9)


def test_the_other_branch_reaches_the_same_pose():
    position, axis = forward_kinematics(random_joints(200, tilt=(-np.pi + 0.05, -0.05)))
    q = inverse_kinematics(position, axis)
    assert (q[:, 4] >= 0.0).all()
    np.testing.assert_allclose(forward_kinematics(q), (position, axis), rtol=0.0, atol=1e-9)


def test_forward_kinematics_equal_pinocchio():
    q = np.random.default_rng(2).uniform(ROBOT.limits.lower, ROBOT.limits.upper, (300, 5))
    position, axis = forward_kinematics(q)
    by_pinocchio, rotation = ROBOT.tool_poses(q)
    np.testing.assert_allclose(position, by_pinocchio, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(axis, rotation[:, :, 2], rtol=0.0, atol=1e-12)


def test_unreachable_positions_are_named():
    positions = via_positions()
    positions[3, 1] = 2.0
    with pytest.raises(UnreachableError, match=r"via point \d .*cannot be reached: link 1"):
        HybridManipulator(positions=positions)
    with pytest.raises(UnreachableError, match=r"via point 3 \(720, 2000, 1083\) mm cannot be reached: link 1"):
        inverse_kinematics(positions, np.array(GUO2016["tool_axes"]))


@pytest.mark.parametrize(
    ("axis", "why"), [((0.1, 0.0, -0.9), "points up"), ((0.0, 0.0, 2.0), "straight down"), ((0.0, 0.0, 0.0), "is zero")]
)
def test_unreachable_axes_are_named(axis, why):
    axes = np.array(GUO2016["tool_axes"])
    axes[7] = axis
    with pytest.raises(UnreachableError, match=rf"via point 7 \(880, 60, 983\) mm .*{why}"):
        inverse_kinematics(via_positions(), axes)


def test_paths_without_a_tool_axis_are_named():
    level = np.array([[0.6, 0.0, 1.2], [0.7, 0.02, 1.1], [0.8, 0.03, 1.0], [0.9, 0.05, 1.0], [1.0, 0.06, 1.0]])
    with pytest.raises(UnreachableError, match="via point 3 .*straight down"):
        HybridManipulator(positions=level)
    vertical = np.array([[0.6, 0.0, 1.2], [0.6, 0.0, 1.1], [0.6, 0.0, 1.0]])
    with pytest.raises(UnreachableError, match="via point 0 .*vertical"):
        HybridManipulator(positions=vertical)


def test_points_outside_a_screw_are_named():
    positions = via_positions()
    positions[:, 0] += 0.5
    with pytest.raises(InvalidInputError, match=r"point 8 puts 'screw_2' at 1.04304 m, outside its range 0 to 1 m"):
        HybridManipulator(positions=positions)


@pytest.mark.parametrize("positions", [[[0.6, 0.0, 1.2]], np.ones((3, 2)), np.full((3, 3), np.nan), "line", []])
def test_bad_positions_are_refused(positions):
    with pytest.raises(InvalidInputError, match=r"position|point"):
        HybridManipulator(positions=positions)


COSTS = {"continuous": 2.71390164, "printed": 2.70218817, "as_run": 3.09140867}


@every_convention
def test_table_7_in_every_convention(convention):
    F = HybridManipulator(convention=convention).evaluate(paper_solution())[0][0]
    np.testing.assert_allclose(F, GUO2016["table7_z"][convention], rtol=1e-6)
    assert cost(F) == pytest.approx(COSTS[convention], abs=1e-6)
    assert cost(F) == pytest.approx(GUO2016["table7_cost"][convention], abs=1e-6)
    assert HybridManipulator(convention=convention, objectives="cost").evaluate(paper_solution())[0] == pytest.approx(
        cost(F), rel=1e-12
    )


def test_table_7_single_values():
    F = {name: HybridManipulator(convention=name).evaluate(paper_solution())[0][0] for name in CONVENTIONS}
    assert all(values[0] == pytest.approx(6.19, abs=1e-12) for values in F.values())
    assert F["as_run"][1] == pytest.approx(3914.5564, abs=1e-4)
    assert F["continuous"][2] == pytest.approx(1.06564297, abs=1e-6)
    assert F["as_run"][2] == pytest.approx(1.06564297, abs=1e-6)
    assert F["printed"][3] == pytest.approx(0.19364450, abs=1e-6)
    assert F["as_run"][3] == pytest.approx(0.19364450, abs=1e-6)


def test_table_7_continuous_with_the_weight_only_payload():
    F = HybridManipulator(convention="continuous", payload_model="weight_only").evaluate(paper_solution())[0][0]
    np.testing.assert_allclose(F, GUO2016["table7_z"]["continuous_weight_only"], rtol=1e-6)
    assert cost(F) == pytest.approx(GUO2016["table7_cost"]["continuous_weight_only"], abs=1e-6)


@every_convention
@every_model
def test_table_7_is_feasible(convention, model):
    G = HybridManipulator(convention=convention, payload_model=model).evaluate(paper_solution())[1]
    assert G.max() <= 0.0


@every_convention
@pytest.mark.parametrize("count", mostly_long([1, 3, 15], 1))
def test_objectives_equal_loops_over_the_knots(convention, count):
    model = {"continuous": "weight_only"}.get(convention)
    problem = HybridManipulator(payload=6.0, convention=convention, payload_model=model, samples=16)
    h = np.concatenate([random_intervals(count), TABLE_7[None]])
    F = problem.evaluate(h)[0]
    for row, got in zip(h, F, strict=True):
        trajectory = problem.decode(row)
        q, v, a = (
            np.concatenate(
                [factor * trajectory.coefficients[0, :, :, order], trajectory.evaluate(trajectory.duration, order)[0]]
            )
            for order, factor in enumerate((1.0, 1.0, 2.0))
        )
        expected = guo2016.objectives(convention, row, q, v, a, payload=6.0)
        np.testing.assert_allclose(got, expected, rtol=1e-8)
        assert cost(got) == pytest.approx(guo2016.cost(expected), rel=1e-8)


def test_conventions_at_knots_do_not_depend_on_the_samples():
    h = random_intervals(5)
    for convention in ("printed", "as_run"):
        few, many = (HybridManipulator(convention=convention, samples=s).evaluate(h)[0] for s in (2, 9))
        np.testing.assert_allclose(few, many, rtol=1e-9)


def test_energy_converges_with_the_samples():
    h = random_intervals(20, seed=3)
    six, many = (HybridManipulator(samples=s).evaluate(h)[0][:, 1] for s in (6, 24))
    np.testing.assert_allclose(six, many, rtol=1e-3)


def test_tracking_error_of_table_7():
    positions = forward_kinematics(HybridManipulator().decode(TABLE_7).sample(2001).q[0])[0]
    error = 1000.0 * tracking_error(positions)
    assert error.max() == pytest.approx(GUO2016["tracking_error_mm"], abs=5e-5)
    assert error.argmax() / 2000 * 6.19 == pytest.approx(0.5 * (0.330 + 1.167), abs=0.5)  # in the second interval
    at_points = forward_kinematics(np.array(GUO2016["via_points"]))[0]
    np.testing.assert_allclose(tracking_error(at_points), 0.0, atol=1e-9)


def test_tracking_error_is_the_distance_to_the_line():
    eta = np.linspace(0.3, 9.7, 20)
    on = saddle_line(eta)
    np.testing.assert_allclose(tracking_error(on), 0.0, atol=1e-9)
    away = on + np.random.default_rng(0).uniform(-1e-3, 1e-3, on.shape)
    fine = saddle_line(np.linspace(-0.4, 10.4, 200_001))
    expected = [np.linalg.norm(fine - point, axis=1).min() for point in away]
    np.testing.assert_allclose(tracking_error(away), expected, rtol=1e-5)


@every_convention
@pytest.mark.parametrize(
    ("payload", "message"),
    [
        (10.001, r"payload: expected 0 to 10 kg, eq\. \(123\), got 10\.001 kg"),
        (Payload(11.0), r"payload: expected 0 to 10 kg, eq\. \(123\), got 11 kg"),
        ({"mass": 12.0}, r"expected 0 to 10 kg"),
        (-1.0, r"payload\.mass"),
        (float("nan"), r"payload\.mass"),
        (float("inf"), r"payload\.mass"),
        ("10", r"payload\.mass"),
        ({"mass": -1.0}, r"payload\.mass"),
    ],
)
def test_bad_payloads_are_refused(convention, payload, message):
    with pytest.raises(InvalidInputError, match=message):
        HybridManipulator(payload=payload, convention=convention)


def test_payload_bounds_count():
    assert HybridManipulator(payload=12.0, payload_bounds=(0.0, 15.0)).dynamics.payload.mass == 12.0
    with pytest.raises(InvalidInputError, match=r"expected 2 to 5 kg.*got 1 kg"):
        HybridManipulator(payload=1.0, payload_bounds=(2.0, 5.0))
    with pytest.raises(InvalidInputError, match="payload_bounds"):
        HybridManipulator(payload_bounds=(0.0, float("nan")))


def test_unknown_names_list_the_known_ones():
    with pytest.raises(UnknownNameError, match="convention 'exact'; known: as_run, continuous, printed"):
        HybridManipulator(convention="exact")
    with pytest.raises(UnknownNameError, match="payload model 'magnet'; known: rigid, tool_axis, weight_only"):
        HybridManipulator(payload_model="magnet")
    with pytest.raises(UnknownNameError, match="objectives 'some'; known: all, cost"):
        HybridManipulator(objectives="some")


@pytest.mark.parametrize("bad", [{"samples": 1}, {"threads": 0}, {"duration_bounds": (0.0, 1.0)}])
def test_bad_settings_are_refused(bad):
    with pytest.raises(InvalidInputError, match="samples|threads|duration_bounds"):
        HybridManipulator(**bad)


@every_convention
@pytest.mark.parametrize("interval", [0.005, 1e-3, 1e-6])
def test_times_below_152_are_infeasible_and_nothing_more(convention, interval):
    problem = HybridManipulator(convention=convention)
    h = np.tile(TABLE_7, (13, 1))
    h[0] = interval
    h[np.arange(1, 13), np.arange(12)] = interval
    out = problem.evaluate(h, return_as_dictionary=True)
    assert "failure" not in out
    assert np.isfinite(out["F"]).all()
    assert np.isfinite(out["G"]).all()
    inner = [0, *range(3, 12)]  # a very short first or last interval moves next to nothing
    assert (out["G"][inner, problem.constraint_names.index("interval above eq. (152)")] > 0.0).all()
    assert (out["G"][inner].max(axis=1) > 0.0).all()


def test_interval_bound_is_eq_152():
    problem, h = HybridManipulator(), random_intervals(20, low=0.05)
    column = problem.evaluate(h)[1][:, problem.constraint_names.index("interval above eq. (152)")]
    for row, got in zip(h, column, strict=True):
        trajectory = problem.decode(row)
        knots = np.concatenate([trajectory.coefficients[0, :, :, 0], trajectory.evaluate(trajectory.duration)[0]])
        least = np.max(np.abs(np.diff(knots, axis=0)) / ROBOT.limits.velocity, axis=1)
        assert got == pytest.approx((least / row).max() - 1.0, rel=1e-9, abs=1e-9)
        assert (got <= 0.0) == (row >= least).all()


def test_bad_times_in_a_batch_do_not_touch_the_others():
    problem = HybridManipulator()
    h = np.stack([TABLE_7, -TABLE_7, TABLE_7])
    out = problem.evaluate(h, return_as_dictionary=True)
    assert np.isinf(out["F"][1]).all()
    assert "positive segment times" in out["failure"][1]
    np.testing.assert_array_equal(out["F"][[0, 2]], problem.evaluate(np.stack([TABLE_7, TABLE_7]))[0])


@pytest.mark.thinned(4)
@every_convention
@every_model
def test_every_payload_model_under_every_convention(convention, model):
    by_name = HybridManipulator(payload=8.0, convention=convention, payload_model=model)
    by_payload = HybridManipulator(payload=Payload(8.0, model=model), convention=convention)
    assert by_name.dynamics.payload == by_payload.dynamics.payload == Payload(8.0, model=model)
    for a, b in zip(by_name.evaluate(TABLE_7[None]), by_payload.evaluate(TABLE_7[None]), strict=True):
        np.testing.assert_array_equal(a, b)
    default = HybridManipulator(payload=8.0, convention=convention)
    assert default.dynamics.payload.model == CONVENTIONS[convention]
    same = by_name.evaluate(TABLE_7[None])[1] == default.evaluate(TABLE_7[None])[1]
    assert same.all() == (model == CONVENTIONS[convention])


@pytest.mark.thinned(4)
@every_convention
@every_model
def test_settings_make_an_equal_problem(convention, model):
    com = (0.01, 0.0, 0.02) if model != "tool_axis" else (0.0, 0.0, 0.0)
    problem = HybridManipulator(payload=Payload(5.0, com, model=model), convention=convention, samples=4)
    again = load_problem("hybrid", **json.loads(json.dumps(problem.settings)))
    assert again.dynamics.payload == problem.dynamics.payload
    assert again.settings == problem.settings
    for a, b in zip(problem.evaluate(TABLE_7[None]), again.evaluate(TABLE_7[None]), strict=True):
        np.testing.assert_array_equal(a, b)
    heavier = problem.with_payload(problem.dynamics.payload.with_mass(9.0))
    assert heavier.dynamics.payload == Payload(9.0, com, model=model)
    assert heavier.convention == convention
    assert problem.dynamics.payload.mass == 5.0


@every_convention
@pytest.mark.parametrize("objectives", ["all", "cost"])
def test_problem_is_copied_and_pickled(convention, objectives):
    problem = HybridManipulator(convention=convention, objectives=objectives)
    expected = problem.evaluate(TABLE_7[None])
    for again in (copy.deepcopy(problem), pickle.loads(pickle.dumps(problem))):
        for a, b in zip(again.evaluate(TABLE_7[None]), expected, strict=True):
            np.testing.assert_array_equal(a, b)


@every_model
def test_front_records_name_the_payload_model(model):
    problem = HybridManipulator(payload=5.0, convention="printed", payload_model=model)
    front = optimise(problem, seed=1, generations=3, population=8, progress=False, polish=False)
    assert front.record.settings["payload"]["model"] == model
    assert front.record.settings["payload"]["mass"] == 5.0
    assert front.record.settings["convention"] == "printed"


def test_papers_settings():
    evolution = HybridManipulator.evolution
    assert (evolution.population, evolution.generations) == (100, 200)
    assert (evolution.crossover_probability, evolution.crossover_index) == (0.9, 10.0)
    assert (evolution.mutation_probability, evolution.mutation_index) == (0.1, 100.0)
    assert PAPER_WEIGHTS.weights == (0.3, 0.3, 0.2, 0.2)
    assert PAPER_WEIGHTS.scales == (1.0, 1000.0, 10.0, 1.0)
    problem = HybridManipulator()
    assert problem.objective_names == ("time", "energy", "jerk", "acceleration")
    assert len(problem.constraint_names) == 5 * 5 + 1
    assert problem.dynamics.payload == Payload(10.0)
    assert problem.convention == "continuous"
    np.testing.assert_array_equal(paper_solution(), TABLE_7[None])
