"""Anchors that the lockstep leaves early end where SLSQP ends from other starts."""

from functools import cache

import numpy as np
import pytest
from scipy.optimize import minimize

from tests.benchmarks.arms import ARMS, CORNERS, rods
from tests.formulation.test_free_points import problem
from tests.helpers import mostly_long, small_problem
from trajevo import certify, minimise_weighted, optimise, polish
from trajevo.formulation.problem import Weights
from trajevo.front.hypervolume import hypervolume
from trajevo.robot.kinematics import ToolKinematics
from trajevo.solvers.gradient import anchors
from trajevo.solvers.gradient.anchors import AnchorSearch
from trajevo.solvers.gradient.optimality import residual
from trajevo.solvers.gradient.passings import Passings
from trajevo.solvers.gradient.restoration import restored
from trajevo.solvers.gradient.scaling import Columns, Scaled
from trajevo.solvers.gradient.sqp import with_objectives

SOLVED = {"seed": 1, "population": 60, "generations": 30, "polish": False, "progress": False}


QUICK = {"members": 4, "rounds": 1}


@pytest.mark.long
@pytest.mark.parametrize("members", [QUICK, {}], ids=str)
def test_the_least_time_is_that_of_other_starts(members):
    made = problem(duration_bounds=(0.02, 3.0))
    front = optimise(made, **SOLVED)
    drawn = np.random.default_rng(0).uniform(0.4, 0.6, (2, made.n_var)) * (made.xu - made.xl) + made.xl
    drawn[:, :4] = [0.1, 0.6, 0.6, 0.1]
    other = minimise_weighted(made, Weights((1.0, 0.0)), seed=1, initial=drawn)
    assert polish(front, **members).front.F[:, 0].min() <= 1.001 * other.cost


def test_a_budget_ends_it_with_the_best_so_far():
    made = problem(interpolant="quintic_spline", extra_points=1)
    front = optimise(made, **SOLVED)
    order = front.F[:, 0].argsort()
    search = AnchorSearch(made, np.array([1.0, 0.0]), 1, lambda gradients, _: gradients >= 5)
    found = search.run(front.X[order[0]], front.X[order], explore=False)
    assert found.gradients == 5
    assert found.x is not None
    assert made.evaluate(found.x[None], return_values_of=["F"]).ravel()[0] <= front.F[:, 0].min()
    budget = front.run.evaluations // 2
    assert polish(front, evaluations=budget).front.run.evaluations < front.run.evaluations + 2 * budget


def test_slower_copies_keep_the_path():
    made = problem(interpolant="quintic_spline")
    columns = Columns.of(np.array([[1.0, 2.0], [2.0, 1.0]]), np.eye(2), np.array([3.0, 3.0]))
    scaled, x = Scaled(made, columns, 0.0), 0.5 * (made.xl + made.xu)
    x[:2] = [0.5, 0.7]
    rows = scaled.outside(anchors.slowed(scaled, made, x))
    np.testing.assert_allclose(rows[:, :2], x[:2] * 1.07 ** np.arange(17)[:, None])
    np.testing.assert_allclose(rows[:, 2:], np.tile(x[2:], (17, 1)))
    shares = np.linspace(0.0, 1.0, 5)
    paths = made.decode(rows).at_shares(shares, 0)
    np.testing.assert_allclose(paths, np.broadcast_to(paths[0], paths.shape), atol=1e-9)


def least_time_by_scipy(made, starts):
    """The least time of SLSQP from random starts, in SciPy's own words; durations as logarithms."""
    timed = np.array([variable.unit == "s" for variable in made.variables])
    inside = [np.where(timed, np.log(np.where(timed, end, 1.0)), end) for end in (made.xl, made.xu)]

    def outside(y):
        return np.where(timed, np.exp(np.where(timed, y, 0.0)), y)

    terms = with_objectives(made, np.array([True, False])).in_terms()

    @cache
    def evaluated(y):
        return terms.evaluate_with_gradients(outside(np.array(y))[None])[2:]

    def limits(y):
        return evaluated(tuple(y.tolist()))

    def slopes(y):
        return limits(y)[1][0] * np.where(timed, outside(y), 1.0)

    best = np.inf
    for start in np.random.default_rng(0).uniform(*inside, (starts, made.n_var)):
        end = minimize(
            lambda y: np.log(np.exp(y[timed]).sum()),
            start,
            jac=lambda y: np.where(timed, outside(y), 0.0) / np.exp(y[timed]).sum(),
            method="SLSQP",
            bounds=np.stack(inside, axis=1),
            constraints=[{"type": "ineq", "fun": lambda y: -limits(y)[0][0], "jac": lambda y: -slopes(y)}],
            options={"maxiter": 300, "ftol": 1e-8},
        ).x
        x = np.clip(outside(end), made.xl, made.xu)
        F, G = made.evaluate(x[None], return_values_of=["F", "G"])
        best = min(best, F[0, 0]) if G.max() <= 1e-6 else best
    return best


#: The least time [s] through three points: the best of SLSQP from ten random starts.
THREE_POINTS = 4.2481657
#: The hypervolume of the best front through three points that is known.
NEAREST = 0.6703
FEW = {"population": 40, "generations": 15, "progress": False}


@cache
def by_few(count, seed):
    """What a short search finds for the arm of two rods through so many points."""
    if count > 3:
        return optimise(rods(count), seed=seed, **FEW)
    return polish(optimise(rods(count), seed=seed, polish=False, **FEW), members=4, rounds=1).front


@pytest.mark.parametrize(
    ("arm", "count", "known", "seeds", "starts"),
    [
        ("rods", 3, THREE_POINTS, (1,), 1),
        *(
            pytest.param(*case, marks=pytest.mark.long)
            for case in (
                ("rods", 5, 3.17587, (1,), 3),
                ("rods", 5, 3.17587, range(1, 11), 20),
                ("rods", 8, 3.08193, range(1, 11), 20),
                ("three_links", 8, 0.65934, range(1, 4), 20),
                ("ur5", 5, 0.43663, range(1, 4), 20),
            )
        ),
    ],
    ids=["three points", "one seed", "five points", "eight points", "three links", "ur5"],
)
def test_where_points_move_under_effort_limits_the_least_time_is_the_same_from_every_seed(
    arm, count, known, seeds, starts
):
    made = ARMS[arm](count)
    least = min(least_time_by_scipy(made, starts), known)
    for seed in seeds:
        front = by_few(count, seed) if arm == "rods" and count < 8 else optimise(made, seed=seed, **FEW)
        told, found = front.run.settings["polish"]["anchors"][0], front.F[:, 0].min()
        assert found <= 1.001 * least
        assert told["objective"] == "time"
        # A later round may find the same optimum with other roundings.
        assert found <= told["value"] <= (1.0 + 1e-9) * found
        assert told["residual"] < 1e-3
        assert 1 <= told["agreeing"] <= told["starts"] > 20


@pytest.mark.parametrize(
    ("count", "search", "known"),
    mostly_long([(3, "few", NEAREST), (5, "few", 0.7262), (5, "as it is", 0.7262)], (3, "few", NEAREST), several=True),
)
def test_where_points_move_under_effort_limits_the_front_is_near_the_best_known(count, search, known):
    found = by_few(count, 1) if search == "few" else optimise(rods(count), seed=1, progress=False)
    assert hypervolume(found.F, np.array(CORNERS["rods"])) >= 0.98 * known


def test_the_same_motion_is_passed_through_points_at_other_instants():
    made = rods(8)
    passings, random = Passings.of(made), np.random.default_rng(1)
    assert set(passings.moves) == {(k, to) for k in range(1, 7) for to in range(1, 7) if k != to}
    x = 0.5 * (made.xl + made.xu) + 0.1 * random.standard_normal(made.n_var)
    x[:9] = random.uniform(0.2, 0.6, 9)
    others = passings.moved(x, passings.moves, random)
    assert len(others) == len(passings.moves)
    before, after = made.via_times(x)[0], made.via_times(others)
    same = np.isclose(after[:, :, None], before).any(axis=2).sum(axis=1)
    np.testing.assert_array_equal(same, 7)  # all but one are passed when they were
    np.testing.assert_allclose(after[:, -1], before[-1])
    for row, times in zip(others, after, strict=True):
        at = made.decode(row[None]).evaluate(np.minimum(times, made.decode(row[None]).duration[0]))
        on = made.decode(x[None]).evaluate(np.minimum(times, before[-1]))
        np.testing.assert_allclose(at, on, atol=1e-9)
    assert passings.moved(x, [], random).shape == (0, made.n_var)


def test_points_keep_their_places_where_a_fixed_one_is_between():
    moving = [{"point": k, "joints": [1.0, 1.5]} for k in (1, 2, 4, 5)]
    assert set(Passings.of(rods(8, moving=moving)).moves) == {(1, 2), (2, 1), (4, 5), (5, 4)}
    assert Passings.of(rods(8, moving=moving[1:3])) is None  # a fixed point is between them
    assert Passings.of(rods(4, moving=[], extra_points=1)) is None


def test_a_tool_that_moves_in_boxes_is_put_elsewhere_too():
    boxes = [{"point": k, "tool": [0.2, 0.2, 0.0]} for k in (1, 2)]
    made = rods(4, moving=boxes)
    x = 0.5 * (made.xl + made.xu)
    x[:5] = 0.4
    nominal = made.interpolant.offsets_at(made.decode(x[None]).evaluate(made.via_times(x[None])[0]))
    np.testing.assert_allclose(nominal[0], x[5:], atol=1e-9)
    kinematics = ToolKinematics.of(made.robot)
    row = Passings.of(made).moved(x, [(1, 2)], np.random.default_rng(1))[0]
    times = made.via_times(row[None])[0]
    on = kinematics.pose(made.decode(x[None]).evaluate(times)[0, 1:3])[0]
    middle = kinematics.pose(made.interpolant.points.positions[1:3])[0]
    np.testing.assert_allclose(row[5:].reshape(2, 2), (on - middle)[:, :2], atol=1e-9)


@pytest.mark.parametrize(
    ("count", "objectives", "seed", "at_samples", "known"),
    [
        (3, "time", 1, THREE_POINTS, THREE_POINTS),
        pytest.param(5, "time", 1, 3.1758, 3.1770, marks=pytest.mark.long),
        *(pytest.param(5, "time energy", k, 3.1758, 3.1770, marks=pytest.mark.long) for k in range(1, 11)),
    ],
)
def test_under_proven_limits_it_is_as_near_and_certified(count, objectives, seed, at_samples, known):
    front = optimise(rods(count, limits="certified", objectives=objectives.split()), seed=seed, **FEW)
    assert at_samples < front.F[:, 0].min() <= 1.001 * known
    assert certify(front.pick("0")).proven


#: Points, longest time [s], objectives, and the size of a search that finds feasible ones by itself.
LARGE = {"generations": 30, "population": 40}
TIGHT = [
    (3, 1.6, "time", {"generations": 12, "population": 30}),
    (3, 1.6, "time", LARGE),
    (5, 1.0, "time energy", LARGE),
]


@pytest.mark.parametrize(
    ("count", "longest", "objectives", "whole"),
    mostly_long(TIGHT, TIGHT[0], several=True),
)
def test_gradients_find_what_is_feasible_where_the_evolution_does_not(count, longest, objectives, whole):
    made = rods(count, duration_bounds=(0.02, longest), objectives=objectives.split())
    settings = {"seed": 3, "generations": 2, "population": 6, "starts": "random", "progress": False}
    plain = optimise(made, polish=False, **settings)
    assert len(plain) == 0
    found = restored(plain)
    assert found.blocking is None
    assert (made.evaluate(found.X, return_values_of=["G"]) <= 0.0).all()
    again = optimise(made, **settings)
    assert again.run.settings["restored"]["members"] == len(found) > 0
    assert again.run.evaluations == again.history.evaluations[-1] > found.run.evaluations > plain.run.evaluations
    full = optimise(made, polish=False, **settings | whole | {"starts": "spread"})
    assert restored(full) is full  # nothing is sought where something is there


def test_the_residual_is_that_of_the_first_order_conditions():
    made = small_problem()
    best = minimise_weighted(made, Weights((1.0, 0.0)), seed=1, starts=3)
    columns = Columns.of(np.array([[1.0, 2.0], [2.0, 1.0]]), np.eye(2), np.array([3.0, 3.0]))
    scaled = Scaled(made.in_terms(), columns, 0.0)
    assert residual(scaled, scaled.inside(best.x[None])[0], 0) < 1e-4
    inner = scaled.inside((0.5 * (made.xl + made.xu))[None])
    slope = scaled.slopes(inner)[1][0, 0]
    assert residual(scaled, inner[0], 0) == pytest.approx(np.linalg.norm(slope), rel=1e-9)
