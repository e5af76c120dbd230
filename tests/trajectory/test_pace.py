"""Smooth paces along many points: closed forms, the same motions by fewer variables, what is refused."""

import json

import numpy as np
import pytest

from tests.helpers import assert_exact_gradients, mostly_long, refused
from trajevo import Robot, ViaPointProblem, certify, load_problem, optimise
from trajevo.path.via_points import ViaPoints
from trajevo.trajectory.interpolants import CubicSpline, QuinticSpline, SepticSpline
from trajevo.trajectory.pace.paced import Paced
from trajevo.trajectory.pace.path_pace import path_pace


def ellipse(count, joints=3):
    turns = np.linspace(0.0, 2.0 * np.pi, count)
    across, along = np.random.default_rng(0).uniform(-0.5, 0.5, (2, joints))
    return np.outer(np.cos(turns), across) + np.outer(np.sin(turns), along)


def arm(joints=3, **limits):
    usual = {"velocity": [2.0] * joints, "acceleration": [10.0] * joints, "jerk": [100.0] * joints} | limits
    return Robot.from_limits(**usual, names=[f"axis {k}" for k in range(joints)])


def problem(points, **given):
    usual = {"robot": arm(points.shape[1]), "points": points.tolist(), "duration_bounds": (0.001, 3.0)}
    return ViaPointProblem(**(usual | {"objectives": ("time", "jerk")} | given))


def line(count, distance=1.0):
    """Unevenly spaced points of a line for two joints, the first of which sets the pace."""
    shares = np.sort(np.append(np.random.default_rng(1).uniform(0.0, 1.0, count - 2), [0.0, 1.0]))
    return np.outer(shares, [distance, -0.4 * distance])


@pytest.mark.parametrize(("velocity", "acceleration"), [(0.5, 1.0), (9.0, 1.0), (0.3, np.inf), (np.inf, 2.0)])
def test_the_pace_along_a_line_is_the_trapezoid_of_its_limits(velocity, acceleration):
    limits = np.array([velocity, 10.0 * velocity]), np.array([acceleration, 10.0 * acceleration])
    times = path_pace(line(60), *limits, np.full(2, np.inf))
    ramp = velocity / acceleration
    expected = 1.0 / velocity + ramp if velocity * ramp < 1.0 else 2.0 * np.sqrt(1.0 / acceleration)
    np.testing.assert_allclose(times.sum(), expected, rtol=1e-2)
    assert (times > 0.0).all()
    jerk = np.full(2, 20.0)
    if np.isfinite(acceleration):  # every jump of the acceleration becomes a ramp of a / j
        smooth = path_pace(line(60), *limits, np.array([20.0, 2000.0]))
        np.testing.assert_allclose(smooth.sum(), times.sum() + acceleration / jerk[0], rtol=5e-3)


def test_paces_without_limits_follow_the_distances():
    points = line(12)
    times = path_pace(points, *[np.full(2, np.inf)] * 3)
    distances = np.abs(np.diff(points[:, 0]))
    np.testing.assert_allclose(times / times.sum(), distances / distances.sum(), rtol=1e-12)


def test_points_at_the_same_place_have_a_pace_too():
    points = np.repeat(line(20), 2, axis=0)
    times = path_pace(points, np.full(2, 1.0), np.full(2, 5.0), np.full(2, 50.0))
    assert np.isfinite(times).all()
    assert (times > 0.0).all()


@pytest.mark.parametrize("kind", [QuinticSpline, SepticSpline, CubicSpline])
def test_even_variables_are_the_pace_and_factors_stretch_it(kind):
    inner = kind(ViaPoints(ellipse(30)), duration_bounds=(0.001, 3.0))
    pace = np.random.default_rng(0).uniform(0.5, 1.5, len(inner.variables))
    paced, rng = Paced(inner, pace, 7), np.random.default_rng(1)
    np.testing.assert_allclose(paced.times(np.full((1, 7), 2.5))[0], 2.5 * pace / pace.sum(), rtol=1e-12)
    x = rng.uniform(1.0, 3.0, (5, 7))
    np.testing.assert_allclose(paced.times(1.7 * x), 1.7 * paced.times(x), rtol=1e-12)
    np.testing.assert_array_equal(paced(x).coefficients, inner(paced.times(x)).coefficients)
    np.testing.assert_array_equal(paced.via_times(x), inner.via_times(paced.times(x)))
    for k in range(5):  # whatever else is in the batch
        np.testing.assert_array_equal(paced.times(x[k : k + 1])[0], paced.times(x)[k])
    corners = np.stack([[v.lower for v in paced.variables], [v.upper for v in paced.variables]])
    times = paced.times(corners)
    assert (times >= 0.001 * (1.0 - 1e-12)).all()
    assert (times <= 3.0 * (1.0 + 1e-12)).all()


def test_gradients_pass_through_the_pace():
    made = problem(ellipse(25), pace=6)
    assert made.n_var == 6
    assert_exact_gradients(made, np.random.default_rng(0).uniform(1.5, 3.0, (4, 6)))


@pytest.mark.parametrize(
    ("count", "generations", "objectives"),
    mostly_long([(20, 4, "time"), (20, 10, "time jerk"), (60, 10, "time jerk")], (20, 4, "time"), several=True),
)
def test_many_points_of_a_line_are_passed_in_the_least_time_of_a_double_s(count, generations, objectives):
    """1 rad at 2 rad/s, 10 rad/s² and 100 rad/s³ from rest to rest takes 0.8 s."""
    made = problem(line(count), pace=16, duration_bounds=(1e-5, 3.0), objectives=objectives.split())
    found = optimise(made, seed=1, population=4 * generations, generations=generations, progress=False).least("time")
    velocity, acceleration, jerk = 2.0, 10.0, 100.0
    expected = 1.0 / velocity + velocity / acceleration + acceleration / jerk
    assert expected <= found.F["time"] < 1.02 * expected
    assert certify(found).proven


def test_many_points_take_a_pace_unless_told_otherwise():
    usual, single = problem(ellipse(41)), problem(ellipse(41), pace=0)
    assert (usual.n_var, single.n_var, problem(ellipse(40)).n_var) == (24, 40, 39)
    assert usual.settings["pace"] == 24
    assert single.settings["pace"] == 0
    assert any("smooth pace of 24 variables" in note for note in usual.notes)
    assert not single.notes
    again = load_problem("via-points", **json.loads(json.dumps(usual.settings)))
    x = np.random.default_rng(0).uniform(2.0, 3.0, (3, 24))
    np.testing.assert_array_equal(again.evaluate(x)[0], usual.evaluate(x)[0])
    assert not any("smooth pace" in note for note in again.notes), "it is asked for there"
    stopping = problem(ellipse(41), passing=[{"point": 20, "stop": True}])
    assert stopping.n_var == 40, "a pace does not know of stops"


def test_what_a_pace_does_not_know_is_refused():
    for count in (1, 3, 201, 6.0, True, "8"):
        refused(lambda count=count: problem(ellipse(25), pace=count), "pace: expected a whole number from 4 to 200")
    refused(lambda: problem(ellipse(25), pace=6, cyclic=True), "pace: expected no cyclic with it")
    refused(
        lambda: problem(ellipse(25), pace=6, passing=[{"point": 2, "dwell": 0.1}]), "pace: expected no passing with it"
    )
    refused(lambda: problem(ellipse(25), pace=6, extra_points=1), "pace: expected no extra_points with it")
    refused(
        lambda: problem(ellipse(25), pace=6, interpolant="linear_blends"),
        "pace: expected an interpolant that meets its",
    )
    refused(
        lambda: problem(ellipse(25), pace=6, duration_bounds=(0.05, 0.06)),
        "duration_bounds: expected bounds between which all segments fit at a smooth pace",
    )
    inner = QuinticSpline(ViaPoints(ellipse(5)), duration_bounds=(0.1, 1.0))
    refused(lambda: Paced(inner, np.ones(3), 4), "pace: expected shape")
    refused(lambda: Paced(inner, -np.ones(4), 4), "pace: expected positive times")
