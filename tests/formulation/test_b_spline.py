"""Problems with B-splines: settings, gradients, faster motions under the same limits, proven at every instant."""

import numpy as np
import pytest

from tests.formulation.test_free_points import ARM, ROWS, UR5
from tests.helpers import assert_exact_gradients, mostly_long, refused
from trajevo import BSpline, Passing, ViaPointProblem, certify, load_task, optimise

#: Shapes whose random motions are certified.
SHAPES = (
    {},
    {"degree": 3, "control_points": 2, "knots": "even"},
    {"degree": 5, "ends": "jerk"},
    {"degree": 7, "knots": "even", "ends": "velocity"},
)


def problem(**more):
    given = {"robot": ARM, "points": ROWS, "duration_bounds": (0.05, 4.0), "interpolant": "bspline"}
    return ViaPointProblem(**given | more)


def drawn(made, count, seed=1):
    return made.xl + np.random.default_rng(seed).random((count, made.n_var)) * (made.xu - made.xl)


def exceeded(made, X, instants):
    """Whether values of random motions lie beyond the exact extremes, by joint and order, at dense instants."""
    motions, worst = made.decode(X), 0.0
    for order in range(4):
        lower, upper = motions.extremes(order)
        for row in range(len(X)):
            at = motions[row].evaluate(np.linspace(0.0, motions.duration[row], instants), order)[0]
            beyond = np.maximum(lower[row] - at.min(axis=0), at.max(axis=0) - upper[row])
            worst = max(worst, float((beyond / np.abs(at).max()).max()))
    return worst


@pytest.mark.parametrize("shape", SHAPES)
def test_exact_extremes_are_exceeded_nowhere(shape):
    made = problem(bspline=shape)
    assert exceeded(made, drawn(made, 10), 2001) < 1e-12


@pytest.mark.long
@pytest.mark.parametrize("shape", SHAPES)
def test_exact_extremes_are_exceeded_at_none_of_many_instants(shape):
    made = problem(bspline=shape)
    assert exceeded(made, drawn(made, 250, seed=2), 50_001) < 1e-12


@pytest.mark.parametrize("shape", SHAPES)
def test_certificates_of_random_motions_hold_at_dense_instants(shape):
    """Slow ones of a UR5 with a load: what is proven of efforts bounds them at 4,000 instants."""
    made = problem(
        robot=UR5, bspline=shape, payload=2.0, constraints=("velocity", "effort"), duration_bounds=(2.0, 9.0)
    )
    for x in drawn(made, 3, seed=3):
        rollout = made.rollout(x[None])
        t = np.linspace(0.0, rollout.trajectory.duration[0], 4001)
        states = [rollout.trajectory.evaluate(t, order) for order in range(3)]
        G = made.evaluate(x[None])[1][0]
        limits, names = made.robot.limits, list(made.constraint_names)
        for values, limit, kind in (
            (states[1], limits.velocity, "velocity"),
            (rollout.effort_in(*states), limits.effort, "effort"),
        ):
            reached = (np.abs(values[0]) / limit).max(axis=0) - 1.0
            bounds = np.array([g for g, name in zip(G, names, strict=True) if kind in name])
            assert len(bounds) == made.robot.dof
            assert (bounds >= reached - 1e-9).all()


@pytest.mark.parametrize("shape", [{}, {"degree": 5, "knots": "even", "control_points": 2}])
def test_gradients_agree_with_differences(shape):
    made = problem(bspline=shape, robot=UR5, objectives=("time", "energy", "jerk"), payload=2.0)
    assert_exact_gradients(
        made, made.xl + np.random.default_rng(2).uniform(0.3, 0.7, (2, made.n_var)) * (made.xu - made.xl)
    )


FEW = {"generations": 2, "population": 16}


@pytest.mark.long
@pytest.mark.parametrize(("jerk", "by_b_spline"), [(200.0, 1.346), pytest.param(2000.0, 1.278, marks=pytest.mark.long)])
@pytest.mark.parametrize(
    "search",
    mostly_long(
        [{"generations": 2, "population": 16}, {"generations": 4}, {"generations": 30}],
        {"generations": 2, "population": 16},
    ),
    ids=str,
)
def test_least_time_is_below_that_of_an_even_b_spline(jerk, by_b_spline, search):
    """The B-spline of degree 5 with 24 control points was optimised by another package."""
    limits = ARM["limits"] | {"jerk": jerk}
    best = optimise(problem(robot=ARM | {"limits": limits}), seed=1, progress=False, **search).pick("0")
    assert best.F["time"] < by_b_spline
    assert certify(best).proven
    t = np.linspace(0.0, best.F["time"], 5001)
    for order, limit in enumerate((limits["velocity"], limits["acceleration"], jerk), start=1):
        assert (np.abs(best.trajectory.evaluate(t, order)[0]) <= limit).all()


def test_points_keep_their_numbers():
    given = {
        "robot": UR5,
        "points": [*ROWS, ROWS[0]],
        "bspline": {"degree": 5, "control_points": 2},
        "passing": [Passing(1, dwell=0.3), Passing(2, window=(1.0, 9.0))],
        "moving": [{"point": 2, "joints": [0.1, 0.0, 0.0, 0.0, 0.0, 0.0]}],
        "payload": [{"mass": 1.0}, {"mass": 2.0, "from": 1, "to": 2}],
        "objectives": ("time", "energy"),
    }
    made = problem(**given)
    names = [variable.name for variable in made.variables]
    assert len(set(names)) == len(names)
    assert names[-1].startswith("q_2 of ")
    assert sum("control point" in name for name in names) == 3 * 2 * 6
    motion, via = made.decode(0.5 * (made.xl + made.xu)[None]), made.via_times(0.5 * (made.xl + made.xu)[None])
    middle = motion.evaluate(via)[0]
    np.testing.assert_allclose(middle[[0, 1, 3]], np.array(given["points"])[[0, 1, 3]], atol=1e-12)
    loads = made.dynamics.schedule.carried
    assert loads == (*((0,),) * 4, *((0, 1),) * 3, *((0,),) * 3)  # the fourth one is the dwell
    again = ViaPointProblem(**made.settings)
    assert made.settings["bspline"] == {"degree": 5, "control_points": 2, "knots": "free", "ends": "acceleration"}
    np.testing.assert_array_equal(again.decode(drawn(made, 2)).coefficients, made.decode(drawn(made, 2)).coefficients)


def test_a_moved_point_moves_motions_whose_ends_hold_more_than_their_spline():
    """The jerk at the ends depends on the moved point too."""
    box = {"point": 1, "joints": [0.2] * 6}
    made = problem(bspline={"degree": 5, "ends": "jerk"}, moving=[box])
    motion = made.decode(drawn(made, 5))
    ends = np.stack([np.zeros(5), motion.duration], axis=1)
    for order in range(1, 4):
        size = np.abs(motion.at_shares(np.linspace(0.0, 1.0, 9), order)).max()
        assert np.abs(motion.evaluate(ends, order)).max() < 1e-9 * size


def test_a_point_on_a_limit_is_a_rest_without_a_price_in_smoothness():
    limits = ARM["limits"] | {"position": [[-6.0, 0.4], *ARM["limits"]["position"][1:]]}
    made = problem(robot=ARM | {"limits": limits}, points=[ROWS[0], ROWS[1], ROWS[0]])
    motion = made.decode(drawn(made, 4))
    assert "one of its control points is no longer free" in made.notes[0]
    for order in range(3):
        size = np.abs(motion.at_shares(np.linspace(0.0, 1.0, 9), order)).max()
        assert np.abs(motion.jump(order)).max() < 1e-9 * size
    np.testing.assert_array_equal(motion.evaluate(made.via_times(drawn(made, 4)), 1)[:, 1, 0], 0.0)


def test_a_task_says_it_in_a_table(tmp_path):
    text = """
format = 1
robot = "puma560"
points = [[0.0, 0.0, 0.0, 0.0, 0.0, 0.0], [0.5, 0.2, 0.1, 0.0, 0.3, 0.0], [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]]
duration_bounds = [0.3, 4.0]
interpolant = "bspline"
objectives = ["time", "jerk"]
[bspline]
degree = 7
knots = "even"
"""
    file = tmp_path / "task.toml"
    file.write_text(text)
    made = load_task(file).problem
    assert made.settings["bspline"] == {"degree": 7, "control_points": 3, "knots": "even", "ends": "acceleration"}
    file.write_text(text.replace("knots", "knotz"))
    refused(lambda: load_task(file), r"task.toml: line 8: bspline: unknown key 'knotz'.*did you mean 'knots'")
    file.write_text(text.replace("7", "6"))
    refused(lambda: load_task(file), r"task.toml: line 8: bspline: degree: expected 3, 5, 7, got 6")


def test_a_class_is_an_interpolant_too():
    assert problem(interpolant=BSpline).n_var == problem().n_var


def test_refusals():
    refused(lambda: problem(bspline={"order": 4}), "bspline: unknown key 'order'; known: control_points, degree")
    refused(lambda: problem(bspline=5), "bspline: expected degree, control_points, knots, ends by name, got 5")
    refused(lambda: problem(bspline={"degree": 9}), "bspline: degree: expected 3, 5, 7, got 9")
    refused(lambda: problem(bspline={"knots": "odd"}), "unknown knots 'odd'; known: even, free")
    refused(lambda: problem(extra_points=2), "extra_points: 'bspline' takes none; its control_points are free")
    refused(
        lambda: problem(interpolant="cubic", bspline={}), "bspline: 'cubic' is none; expected interpolant = 'bspline'"
    )
    refused(
        lambda: problem(points=[*ROWS, ROWS[0]], cyclic=True),
        "cyclic: 'bspline' makes no cyclic motions; quintic_spline and septic_spline do",
    )
    refused(
        lambda: problem(bspline={"ends": "velocity"}, passing=[{"point": 1, "stop": True}]),
        "passing: 'bspline' does not begin and end at rest, as a stop needs",
    )
