"""Problems with free points: faster motions under the same limits, proven at every instant."""

import numpy as np
import pytest

from tests.helpers import assert_exact_gradients, mostly_long, refused
from trajevo import Passing, ViaPointProblem, ViaPoints, certify, optimise
from trajevo.trajectory.interpolants import stop_and_go

#: Six joints between three points, at rest at both ends.
ROWS = [
    [-0.8, -1.9, 1.4, -1.2, -1.5, 0.3],
    [0.4, -1.0, 0.9, -1.6, -1.2, -0.8],
    [1.3, -1.6, 1.7, -0.9, -1.8, 1.0],
]
UR5 = {"name": "ur5", "tool": "tool0", "limits": {"acceleration": 10.0, "jerk": 100.0}}
ARM = {
    "joints": [f"j{k}" for k in range(6)],
    "limits": {
        "position": [[-6.0, 6.0]] * 6,
        "velocity": [3.14, 3.14, 3.14, 6.28, 6.28, 6.28],
        "acceleration": 15.0,
        "jerk": 200.0,
    },
}


def problem(**more):
    given = {"robot": ARM, "points": ROWS, "duration_bounds": (0.05, 4.0), "interpolant": "cubic", "extra_points": 2}
    return ViaPointProblem(**given | more)


@pytest.mark.parametrize("interpolant", ["quintic_spline", "septic_spline", "cubic"])
def test_limits_hold_at_dense_samples(interpolant):
    """Those of a first population: the exact extremes are those of 2,000 instants, and it is within its limits."""
    made = problem(interpolant=interpolant)
    X = made.xl + np.random.default_rng(1).random((20, made.n_var)) * (made.xu - made.xl)
    motions = made.decode(X)
    for order in range(4):
        lower, upper = motions.extremes(order)
        for row in range(len(X)):
            at = motions[row].evaluate(np.linspace(0.0, motions.duration[row], 2001), order)[0]
            size = np.abs(at).max()
            assert (at >= lower[row] - 1e-9 * size).all()
            assert (at <= upper[row] + 1e-9 * size).all()
            np.testing.assert_allclose(np.abs(at).max(axis=0), np.maximum(-lower, upper)[row], rtol=5e-2)


@pytest.mark.parametrize("interpolant", ["quintic_spline", "cubic"])
def test_gradients_agree_with_differences(interpolant):
    made = problem(interpolant=interpolant, robot=UR5, objectives=("time", "energy", "jerk"), payload=2.0)
    assert_exact_gradients(
        made, made.xl + np.random.default_rng(2).uniform(0.3, 0.7, (2, made.n_var)) * (made.xu - made.xl)
    )


@pytest.mark.parametrize(("jerk", "by_b_spline"), [(200.0, 1.346), pytest.param(2000.0, 1.278, marks=pytest.mark.long)])
@pytest.mark.parametrize(
    ("generations", "population", "objectives"),
    mostly_long([(8, 24, "time"), (20, 60, "time jerk"), (80, 60, "time jerk")], (8, 24, "time"), several=True),
)
def test_least_time_is_below_that_of_an_even_b_spline(jerk, by_b_spline, generations, population, objectives):
    """The B-spline of degree 5 with 24 control points was optimised by another package."""
    limits = ARM["limits"] | {"jerk": jerk}
    made = problem(robot=ARM | {"limits": limits}, duration_bounds=(0.02, 3.0), objectives=objectives.split())
    best = optimise(made, seed=1, population=population, generations=generations, progress=False).pick("0")
    stopping = stop_and_go(ViaPoints(np.array(ROWS)), made.robot.limits, profile="double_s", straight=False)
    assert best.F["time"] < by_b_spline < float(stopping.duration[0])
    assert certify(best).proven
    t = np.linspace(0.0, best.F["time"], 5001)
    for order, limit in enumerate((limits["velocity"], limits["acceleration"], jerk), start=1):
        assert (np.abs(best.trajectory.evaluate(t, order)[0]) <= limit).all()


def test_points_keep_their_numbers():
    given = {
        "robot": UR5,
        "points": [*ROWS, ROWS[0]],
        "interpolant": "quintic_spline",
        "extra_points": 1,
        "passing": [Passing(1, dwell=0.3), Passing(2, window=(1.0, 9.0))],
        "moving": [{"point": 2, "joints": [0.1, 0.0, 0.0, 0.0, 0.0, 0.0]}],
        "payload": [{"mass": 1.0}, {"mass": 2.0, "from": 1, "to": 2}],
        "objectives": ("time", "energy"),
    }
    made = problem(**given)
    names = [variable.name for variable in made.variables]
    assert names[-1].startswith("q_2 of ")
    assert sum("knot" in name for name in names) == 3 * 7
    x = 0.5 * (made.xl + made.xu)[None]
    motion, via = made.decode(x), made.via_times(x)
    middle = motion.evaluate(via)[0]
    np.testing.assert_allclose(middle[[0, 1, 3]], np.array(given["points"])[[0, 1, 3]], atol=1e-12)
    loads = made.dynamics.schedule.carried
    assert loads == ((0,), (0,), (0,), (0, 1), (0, 1), (0,), (0,))  # the third one is the dwell
    assert made.settings["extra_points"] == 1
    again = ViaPointProblem(**made.settings)
    np.testing.assert_array_equal(again.xl, made.xl)


def test_refusals():
    refused(lambda: problem(extra_points=-1), "extra_points: expected a whole number from 0 to 8, got -1")
    refused(
        lambda: problem(interpolant="hybrid"),
        "extra_points: 'hybrid' takes none; quintic_spline, septic_spline, cubic and hermite do",
    )
    assert "extra_points" not in problem(extra_points=0).settings
