"""The least times from every place of a base: against SLSQP on the robot that stands there."""

import numpy as np
import pytest

from trajevo import base_map, load_problem, load_task, minimise_weighted, optimise, plots
from trajevo.errors import TrajevoError
from trajevo.formulation.problem import Weights
from trajevo.solvers.base_map import _spaced, base_columns, least_from

DOWN = [np.pi, 0.0, 0.0]
POSES = [
    {"position": [0.29, -0.25, 0.12], "rpy": DOWN},
    {"position": [0.09, 0.35, 0.30], "rpy": DOWN},
    {"position": [0.39, 0.30, 0.12], "rpy": DOWN},
]
UR5 = {"name": "ur5", "tool": "tool0", "limits": {"acceleration": 14.0, "jerk": 140.0}}


def problem(**more):
    usual = {
        "robot": UR5,
        "points": POSES,
        "base": {"moving": {"x": [-0.9, 0.1], "y": [-0.2, 0.2]}},
        "duration_bounds": [0.1, 4.0],
        "interpolant": "quintic_spline",
        "objectives": ["time", "jerk"],
        "constraints": ["position", "velocity", "acceleration", "jerk"],
    }
    return load_problem("via-points", **(usual | more))


@pytest.fixture(scope="module")
def found():
    return base_map(problem(), cells=4)


def test_the_least_times_are_those_of_slsqp_on_a_robot_that_stands_there(found):
    seen = np.argwhere(np.isfinite(found.least))
    assert len(seen) >= 4
    for row, column in seen[:: max(1, len(seen) // 3)]:
        points = found.problem.rollout(found.X[row, column]).arranged.points[0]
        place = {"position": [float(found.columns[column]), float(found.rows[row]), 0.0]}
        there = problem(robot=UR5 | {"base": place}, points=points, base=None)
        least = minimise_weighted(there, Weights((1.0, 0.0)), seed=1).F["time"]
        assert found.least[row, column] == pytest.approx(least, rel=1e-4)


def test_every_motion_of_the_map_keeps_its_limits_and_its_base(found):
    columns = list(base_columns(found.problem).values())
    for row, column in np.argwhere(np.isfinite(found.least)):
        x = found.X[row, column]
        F, G = found.problem.evaluate(x[None], return_values_of=["F", "G"])
        assert G.max() <= 0.0
        assert F[0, 0] == found.least[row, column]
        np.testing.assert_array_equal(x[columns], [found.columns[column], found.rows[row]])


def test_a_place_without_a_value_is_one_from_which_a_point_is_missed(found):
    missed = found.missed > 1e-6
    assert missed.any()
    np.testing.assert_array_equal(np.isnan(found.least), missed)
    assert np.isnan(found.X[missed]).all()
    assert f"{int((~missed).sum())} of 16 bases with a motion; least time" in str(found)
    assert found.best == tuple(
        float(values[k])
        for values, k in zip(
            (found.columns, found.rows), reversed(np.unravel_index(np.nanargmin(found.least), (4, 4))), strict=True
        )
    )


@pytest.mark.long
def test_the_ends_of_the_front_against_200_random_bases_each():
    task = load_task("ur5_base")
    front = optimise(task.problem, task.search, progress=False)
    columns = list(base_columns(task.problem).values())
    xl, xu = task.problem.xl[columns], task.problem.xu[columns]
    bases = np.random.default_rng(11).uniform(xl, xu, (200, len(columns)))
    for k in range(2):
        least = least_from(task.problem, bases, objective=k)[1]
        assert np.isfinite(least).sum() > 50
        assert np.nanmin(least) >= 0.99 * front.F[:, k].min()
    given = least_from(task.problem, np.zeros((1, len(columns))))[1][0]
    assert front.F[:, 0].min() <= 0.85 * given


def test_another_objective_and_other_coordinates():
    given = problem(base={"moving": {"y": [-0.2, 0.2], "z": [0.0, 0.2], "yaw": [-0.3, 0.3]}})
    found = base_map(given, axes=("z", "y"), cells=2, at={"yaw": "10 deg"}, objective="jerk")
    assert (found.axes, found.objective, found.unit) == (("z", "y"), "jerk", "rad/s^3")
    assert np.isfinite(found.least).all()
    np.testing.assert_allclose(found.X[..., -1], np.radians(10.0))
    np.testing.assert_array_equal(found.X[0, :, 3], found.columns)
    np.testing.assert_array_equal(found.X[:, 0, 2], found.rows)


def test_the_picture_has_a_colour_for_every_time_and_marks_places(found):
    ax = plots.base_map(found)
    image = ax.collections[0].get_array()
    np.testing.assert_allclose(np.ma.filled(image, np.nan).reshape(4, 4), found.least)
    assert ax.get_xlabel() == "x of the base [m]"
    labels = (
        [entry.get_text() for entry in ax.figure.legends[0].get_texts()]
        if ax.figure.legends
        else [entry.get_text() for entry in ax.get_legend().get_texts()]
    )
    assert {"given place", "best place", "points", "a point is not reached"} <= set(labels)
    low, high = ax.get_xlim()
    assert low <= -0.9
    assert high >= 0.39


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"axes": ("x", "z")}, "unknown coordinate that moves 'z'"),
        ({"axes": ("x", "x")}, "axes: expected two coordinates of the base"),
        ({"axes": "xy"}, "axes: expected two coordinates of the base"),
        ({"cells": 1}, "cells: expected a whole number from 2 on, got 1"),
        ({"cells": 10**9}, "cells: expected at most 200 along each axis, got 1000000000"),
        ({"objective": "tome"}, "unknown objective 'tome'"),
        ({"at": {"yaw": 1.0}}, "unknown coordinate that moves 'yaw'"),
        ({"at": {"x": 5.0}}, "at: x: expected -0.9 to 0.1 m"),
        ({"at": 3}, "at: expected a solution or displacements"),
    ],
)
def test_what_cannot_be_mapped_is_refused(found, change, said):
    with pytest.raises(TrajevoError) as error:
        base_map(found.problem, **({"cells": 2} | change))
    assert said in str(error.value)


def test_a_base_that_stands_still_has_no_map():
    with pytest.raises(TrajevoError, match="expected one whose base moves"):
        base_map(problem(base=None), cells=2)


@pytest.mark.parametrize("given", [3, None, "run"])
def test_what_is_no_problem_and_no_map_is_told_by_its_kind(given):
    kind = type(given).__name__
    with pytest.raises(TrajevoError, match=f"^problem: expected one whose base moves, got {kind}$"):
        base_map(given)
    with pytest.raises(TrajevoError, match=f"^found: expected a map, as .* gives it, got {kind}$"):
        plots.base_map(given)


@pytest.mark.parametrize("cells", range(3, 40, 4))
def test_the_given_place_is_0_where_the_places_hit_it(cells):
    places = _spaced(-0.45, 0.15, cells)
    np.testing.assert_allclose(places, np.linspace(-0.45, 0.15, cells), rtol=0.0, atol=1e-15)
    assert ((places == 0.0) | (np.abs(places) > 1e-3)).all()
    assert (0.0 in places) == ((cells - 1) % 4 == 0)
