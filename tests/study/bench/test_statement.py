"""Plain statements: a second opinion by SciPy and Pinocchio on every problem of the suite."""

from functools import cache

import numpy as np
import pytest
from scipy.interpolate import BSpline, PPoly

from trajevo import ViaPointProblem, load_task
from trajevo.errors import InvalidInputError
from trajevo.study.bench.plain import curves
from trajevo.study.bench.statement import Statement
from trajevo.study.bench.suite import benchmark, benchmarks

#: Whose tasks ask for what no plain statement has, and what that is.
UNSTATED = {
    "pick_and_place_cell": "passing: no plain statement of it",
    "puma_path": "interpolant: no plain statement of motions along a path but as printed",
    "puma_path_jerk_free": "interpolant: no plain statement of motions along a path but as printed",
}
STATED = [name for name in benchmarks() if name not in UNSTATED]

#: Objectives that are integrals of efforts: neither the problem nor a statement integrates them exactly.
OF_EFFORTS = {"energy", "square_power", "square_effort", "cost"}


@cache
def made(name):
    of = benchmark(name)
    problem = of.problem()
    return of, problem, Statement.of(problem)


def rows_of(problem, count, seed=1):
    return np.random.default_rng(seed).uniform(problem.xl, problem.xu, (count, problem.n_var))


def some_members(of, most):
    members = np.array(of.told.variables)
    return members[np.unique(np.linspace(0, len(members) - 1, most).astype(int))]


@pytest.mark.parametrize("name", STATED)
def test_a_plain_statement_finds_what_the_problem_finds(name):
    of, problem, statement = made(name)
    X = np.concatenate([rows_of(problem, 4), some_members(of, 3)])
    F, G = problem.evaluate(X, return_values_of=["F", "G"])
    plain = [statement.evaluate(x) for x in X]
    own_F, own_G = (np.stack(values) for values in zip(*plain, strict=True))
    exact = [k for k, objective in enumerate(problem.objective_names) if objective not in OF_EFFORTS]
    # Where true extremes set the least time, the problem's are bounds that lie up to a tolerance above.
    above = problem.settings.get("tolerance", 0.0) if problem.settings.get("limits") == "certified" else 0.0
    np.testing.assert_allclose(
        own_F[:, exact], F[:, exact], rtol=max(1e-9, 6.0 * above)
    )  # jerk is to the power of 5 of time
    assert own_G.shape == G.shape
    np.testing.assert_array_equal((own_G <= 0.0).all(axis=1), (G <= 0.0).all(axis=1))
    assert (G[4:] <= 0.0).all()
    sampled = [
        k
        for limit in problem.constraints
        for k in [problem.constraint_names.index(name) for name in limit.names]
        if limit.quantity not in ("effort", "tool speed", "torque at speed", "clearance") or limit.proof == "samples"
    ]
    same = max(1e-9, above)
    np.testing.assert_allclose(own_G[:, sampled], G[:, sampled], rtol=same, atol=same)


@pytest.mark.parametrize("name", [name for name in STATED if OF_EFFORTS & set(benchmark(name).told.objectives)])
def test_integrals_of_efforts_agree_as_far_as_both_know_them(name):
    """The problem promises 1e-4 of energies; on 24 panels a piece only dry friction costs as much."""
    of, problem, _ = made(name)
    X = some_members(of, 3)
    F = problem.evaluate(X, return_values_of=["F"])
    dense = np.stack([Statement.of(problem, panels=24).evaluate(x)[0] for x in X])
    np.testing.assert_allclose(dense, F, rtol=2e-4)


@pytest.mark.parametrize("name", STATED)
def test_a_statement_says_what_the_problem_is(name):
    of, problem, statement = made(name)
    np.testing.assert_array_equal(statement.lower, problem.xl)
    np.testing.assert_array_equal(statement.upper, problem.xu)
    assert statement.objectives == problem.objective_names == of.told.objectives
    assert statement.units == of.told.units
    assert statement.constraints == problem.constraint_names
    assert not statement.lower.flags.writeable


@pytest.mark.parametrize(("name", "told"), UNSTATED.items())
def test_what_has_no_plain_statement_says_so(name, told):
    with pytest.raises(InvalidInputError, match=told):
        benchmark(name).statement()


POINTS = [[0.0, 0.0], [0.5, 0.3], [0.2, -0.4]]


def two(**given):
    limits = {"velocity": 3.0, "acceleration": 20.0, "jerk": 300.0}
    robot = {"name": "two", "joints": ["a", "b"], "kind": "revolute", "limits": limits}
    return ViaPointProblem(**({"robot": robot, "points": POINTS, "duration_bounds": (0.1, 2.0)} | given))


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"interpolant": "linear_blends", "objectives": ["time"], "constraints": ["velocity"]}, "linear_blends"),
        ({"interpolant": "hermite"}, "hermite"),
        ({"extra_points": 1, "interpolant": "quintic_spline"}, "extra_points: no plain statement of it"),
        ({"passing": [{"point": 1, "stop": True}], "interpolant": "quintic_spline"}, "passing: no plain statement"),
        ({"objectives": ["time", "joint_travel"]}, "objectives: no plain statement of 'joint_travel'"),
        ({"overshoot": 0.1}, "constraints: no plain statement of 'overshoot'"),
    ],
)
def test_other_problems_are_refused_by_name(given, told):
    with pytest.raises(InvalidInputError, match=told):
        Statement.of(two(**given))


def test_limits_that_differ_by_direction_are_refused():
    limits = {"velocity": {"a": {"backward": 1.0, "forward": 2.0}, "b": 1.0}, "acceleration": 20.0, "jerk": 300.0}
    robot = {"name": "two", "joints": ["a", "b"], "kind": "revolute", "limits": limits}
    with pytest.raises(InvalidInputError, match="no plain statement of velocity that differs by direction"):
        Statement.of(two(robot=robot, interpolant="cubic"))


@pytest.mark.parametrize("x", [[1.0], [1.0, 1.0, 1.0, 1.0, 1.0], "x", [1.0, 1.0, 1.0, float("nan")]])
def test_a_decision_vector_of_another_kind_is_refused(x):
    with pytest.raises(InvalidInputError, match="x: expected"):
        Statement.of(two(interpolant="cubic", objectives=["time"])).evaluate(x)


@pytest.mark.parametrize(
    "shape", [{"degree": d, "control_points": 3, "knots": k} for d in (3, 5, 7) for k in ("even", "free")]
)
def test_b_splines_of_all_degrees_agree(shape):
    problem = two(interpolant="bspline", bspline=shape)
    X = rows_of(problem, 4)
    F, G = problem.evaluate(X, return_values_of=["F", "G"])
    plain = [Statement.of(problem).evaluate(x) for x in X]
    np.testing.assert_allclose([values[0] for values in plain], F, rtol=1e-8)
    np.testing.assert_allclose([values[1] for values in plain], G, rtol=1e-7, atol=1e-8)


def test_extremes_are_those_of_a_dense_sample():
    rng = np.random.default_rng(3)
    curve = PPoly(rng.normal(size=(5, 3, 2)), [0.0, 0.4, 1.0, 1.3])
    for order in range(5):
        least, greatest = curves.extremes(curve, order)
        rate = curve.derivative(order) if order else curve
        t = np.concatenate([np.linspace(a, b, 20_001)[:-1] for a, b in zip(curve.x, curve.x[1:], strict=False)])
        values = rate(t)
        assert (least <= values.min(axis=0) + 1e-12).all()
        assert (greatest >= values.max(axis=0) - 1e-12).all()
        scale = np.abs(values).max()
        np.testing.assert_allclose(least, values.min(axis=0), atol=1e-3 * scale)
        np.testing.assert_allclose(greatest, values.max(axis=0), atol=1e-3 * scale)


def test_squares_are_integrated_exactly():
    curve = PPoly(np.array([[[1.0]], [[0.0]], [[0.0]]]), [0.0, 2.0])  # q = t^2
    np.testing.assert_allclose(curves.square_integral(curve, 1), [4.0 * 8.0 / 3.0], rtol=1e-14)
    np.testing.assert_allclose(curves.square_integral(curve, 2), [8.0], rtol=1e-14)


def test_lobatto_shares_are_those_of_the_rule():
    np.testing.assert_allclose(curves.lobatto_shares(2), [0.0, 1.0])
    np.testing.assert_allclose(curves.lobatto_shares(4), 0.5 + 0.5 * np.array([-1.0, -(0.2**0.5), 0.2**0.5, 1.0]))


def test_pieces_of_a_spline_are_the_spline():
    knots = np.concatenate([[0.0] * 4, [0.3, 0.7], [1.0] * 4])
    spline = BSpline(knots, np.random.default_rng(0).normal(size=(6, 2)), 3)
    t = np.linspace(0.0, 1.0, 101)
    np.testing.assert_allclose(curves.pieces_of(spline)(t), spline(t), atol=1e-13)


def test_a_hermite_segment_meets_both_states():
    start = [np.array([1.0]), np.array([0.5]), np.array([-2.0]), np.array([3.0])]
    end = [np.array([2.0]), np.array([-0.5]), np.array([1.0]), np.array([0.0])]
    curve = PPoly(curves._hermite(0.8, start, end)[:, None], [0.0, 0.8])
    for order in range(4):
        np.testing.assert_allclose(curve(0.0, order), start[order], atol=1e-12)
        np.testing.assert_allclose(curve(0.8, order), end[order], atol=1e-9)


def test_a_task_of_ones_own_has_a_statement(tmp_path):
    task = tmp_path / "task.toml"
    task.write_text(
        "format = 1\npoints = [[0.0, -1.2, 1.4, -1.7, -1.57, 0.0], [1.0, -0.9, 1.2, -1.9, -1.2, 0.8]]\n"
        'duration_bounds = [0.5, 3.0]\ninterpolant = "quintic_spline"\nobjectives = ["time"]\npayload = 1.0\n'
        '[robot]\nname = "ur5"\ntool = "tool0"\n[limits]\nacceleration = 10.0\njerk = 100.0\n'
        '[constraints]\nlimits = ["velocity", "effort"]\nheld = "sampled"\n'
    )
    problem = load_task(task).problem
    statement = Statement.of(problem)
    for x in rows_of(problem, 3):
        F, G = problem.evaluate(x, return_values_of=["F", "G"])
        np.testing.assert_allclose(statement.evaluate(x)[0], F, rtol=1e-12)
        np.testing.assert_allclose(statement.evaluate(x)[1], G, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("name", ["lin1983", "gasparetto2007", "gemini_path", "luus1993"])
def test_many_instants_show_what_few_show_and_more(name):
    of = benchmark(name)
    few, many = of.statement(), of.statement(instants=2_000)
    for x in of.told.variables[:2]:
        F, G = few.evaluate(x)
        same, dense = many.evaluate(x)
        np.testing.assert_array_equal(same, F)
        if "path" in name:  # bounds of the motion, which the motion itself keeps
            assert dense.max() <= G.max() + 1e-9
        else:
            assert (dense >= G - 1e-9).all()
