"""Motions along fixed paths by convex programs: least times, least jerk, effort, and the programs themselves."""

from dataclasses import replace

import numpy as np
import pytest
from ruckig import InputParameter, Ruckig, Trajectory
from scipy.interpolate import PchipInterpolator
from scipy.linalg import solveh_banded
from scipy.optimize import linprog
from scipy.sparse import diags, vstack

from tests.helpers import mostly_long
from trajevo import GeometricPath, certify, load_robot, optimise
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.errors import InvalidInputError
from trajevo.problems import TimeJerkReparameterisation, path_optimum
from trajevo.problems.puma_kinematics import TABLE_1_JOINTS
from trajevo.robot.payload import Payload
from trajevo.solvers.along_path.beginning import begun
from trajevo.solvers.along_path.effort import EffortLimits
from trajevo.solvers.along_path.fastest import fastest, least_time
from trajevo.solvers.along_path.instants import HELD, Instants
from trajevo.solvers.along_path.kinematics import KinematicLimits, PathDerivatives
from trajevo.solvers.along_path.program import Linearised, Program, Quadratic
from trajevo.solvers.along_path.reachability import greatest_squares

FINE = 50_001


@pytest.fixture(scope="module")
def puma():
    return load_robot("puma560")


@pytest.fixture(scope="module")
def path():
    """Ten points between those of a pick and place."""
    table = PchipInterpolator(np.arange(4), np.array(TABLE_1_JOINTS))(np.linspace(0.0, 3.0, 10))
    return GeometricPath.through(table)


def freed(robot, **limits):
    """A robot with other limits."""
    return replace(robot, limits=replace(robot.limits, **limits))


def along(path, robot, **settings):
    return TimeJerkReparameterisation(path=path, robot=robot, longest_time=12.0, **settings)


def greatest_share(motion, limits):
    """Greatest share of the limits of velocity, acceleration and jerk at many instants."""
    t = np.linspace(0.0, float(motion.duration[0]), FINE)[None]
    values = [np.abs(motion.evaluate(t, order)[0]).max(axis=0) for order in (1, 2, 3)]
    return max(
        (value / limit).max()
        for value, limit in zip(values, (limits.velocity, limits.acceleration, limits.jerk), strict=True)
    )


LINES = [(30.0, 1.0), (300.0, 1.0), (30.0, 0.05), (np.inf, 1.0)]


@pytest.mark.parametrize(("jerk", "length"), mostly_long(LINES, LINES[0], LINES[3], several=True))
def test_on_a_straight_line_the_least_time_is_that_of_ruckig(jerk, length):
    feed = load_robot("feed_drive")
    robot = freed(feed, velocity=np.full(2, 0.8), acceleration=np.full(2, 4.0), jerk=np.full(2, jerk))
    robot = freed(robot, lower=np.full(2, -1.0), upper=np.full(2, 2.0))
    line = GeometricPath.through(np.linspace(0.0, 1.0, 6)[:, None] * np.array([length, 0.4 * length]))
    found = along(line, robot, control_points=150).least_time()
    asked = InputParameter(1)
    asked.current_position, asked.target_position = [0.0], [length]
    asked.max_velocity, asked.max_acceleration, asked.max_jerk = [0.8], [4.0], [jerk if np.isfinite(jerk) else 1e9]
    exact = Trajectory(1)
    Ruckig(1).calculate(asked, exact)
    assert exact.duration * (1.0 - 1e-6) <= found.F["time"] <= exact.duration * 1.005
    assert greatest_share(found.trajectory, robot.limits) <= 1.0


def test_a_curved_path_takes_no_longer_than_by_others(puma, path):
    """4.7033 s: COPP's third-order SOCP with 1001 stations, linearised twice, which keeps the limits at these alone."""
    found = along(path, puma, control_points=100).least_time()
    assert 4.68 < found.F["time"] <= 4.7033
    assert max(found.G.values()) <= 0.0
    assert greatest_share(found.trajectory, puma.limits) <= 1.0
    few = along(path, puma, control_points=16).least_time()
    assert found.F["time"] < few.F["time"] < 1.1 * found.F["time"]


def squares(u, path, robot):
    """The greatest u'² at stations under limits of velocity and acceleration there, by HiGHS."""
    count, steps, first, second = len(u) - 1, np.diff(u), path(u, 1), path(u, 2)
    rising = diags(0.5 / steps) @ diags([-np.ones(count), np.ones(count)], [0, 1], shape=(count, count + 1))
    rows = [diags(first[:-1, k]) @ rising + diags(second[:-1, k], shape=(count, count + 1)) for k in range(6)]
    A, b = vstack(rows), np.repeat(robot.limits.acceleration, count)
    with np.errstate(divide="ignore"):
        most = np.minimum((robot.limits.velocity / np.abs(first)).min(axis=1) ** 2, 1e6)
    most[[0, -1]] = 0.0
    bounds = [(0.0, top) for top in most]
    found = linprog(-np.ones(count + 1), A_ub=vstack([A, -A]), b_ub=np.append(b, b), bounds=bounds)
    return np.maximum(found.x, 0.0)


def reachable(path, robot):
    """The least time under limits of velocity and acceleration at 1,001 stations."""
    u = np.linspace(0.0, 1.0, 1_001)
    speed = np.sqrt(squares(u, path, robot))
    return float((2.0 * u[1] / (speed[:-1] + speed[1:])).sum())


@pytest.mark.parametrize("joints", [[0, 1, 2, 3, 4, 5], [0, 3], []])
def test_two_passes_find_speeds_within_limits_that_are_nearly_the_greatest(puma, path, joints):
    """Of joints whose accelerations are limited. Where joints turn round, a greedy pass may lose a little."""
    u = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, 202))
    slope, bend, limits = path(u, 1), path(u, 2), puma.limits
    acceleration = np.full(6, np.inf)
    acceleration[joints] = limits.acceleration[joints]
    found = greatest_squares(np.diff(u), slope, bend, limits.velocity, acceleration)
    rates = 0.5 * np.diff(found) / np.diff(u)
    needed = slope[:-1] * rates[:, None] + bend[:-1] * found[:-1, None]
    assert (np.abs(needed) <= acceleration * (1.0 + 1e-9)).all()
    assert (np.abs(slope) * np.sqrt(found)[:, None] <= limits.velocity * (1.0 + 1e-12)).all()
    high = freed(puma, acceleration=np.minimum(acceleration, 1e5))
    taken, least = (
        (2.0 * np.diff(u) / (np.sqrt(x[1:]) + np.sqrt(x[:-1]))).sum() for x in (found, squares(u, path, high))
    )
    assert taken <= 1.01 * least


@pytest.mark.parametrize("velocity", [np.inf, 0.8])
def test_on_a_straight_line_two_passes_go_full_on(velocity):
    u = np.linspace(0.0, 1.0, 401)
    slope, none = np.tile([2.0, 0.0], (401, 1)), np.zeros((401, 2))
    found = greatest_squares(np.diff(u), slope, none, np.full(2, velocity), np.full(2, 4.0))
    assert found == pytest.approx(np.minimum(4.0 * np.minimum(u, 1.0 - u), (velocity / 2.0) ** 2), rel=1e-12)


def test_without_limits_of_jerk_programs_begin_near_the_least_time(puma, path):
    problem = along(path, freed(puma, jerk=np.full(6, np.inf)), control_points=100)
    runs, least = problem.interpolant, problem.least_time().F["time"]
    start = runs.course_of(begun(path, runs.limits, runs.control_points, runs.order)[None])
    assert least < runs.least_durations(start)[0] < 1.02 * least


@pytest.mark.parametrize(("name", "slsqp"), [("gemini", 1.83201), ("s", 2.31195)])
def test_few_control_points_reach_what_slsqp_reaches(name, slsqp):
    found = TimeJerkReparameterisation(path=name).least_time()
    assert found.F["time"] == pytest.approx(slsqp, rel=1e-4)
    assert max(found.G.values()) <= 0.0


def test_without_jerk_the_least_time_is_near_that_of_the_greatest_speeds(puma, path):
    robot = freed(puma, jerk=np.full(6, np.inf))
    found = along(path, robot, control_points=200).least_time()
    least = reachable(path, robot)
    assert 0.999 * least <= found.F["time"] <= 1.005 * least
    assert greatest_share(found.trajectory, robot.limits) <= 1.0


def test_more_control_points_are_never_slower(puma, path):
    times = [along(path, puma, control_points=count).least_time().F["time"] for count in (20, 40, 80)]
    assert times == sorted(times, reverse=True)


@pytest.mark.parametrize("order", mostly_long([4, 5, 6, 7], 4, 7))
def test_every_order_keeps_the_limits(puma, path, order):
    found = along(path, puma, control_points=60, order=order).least_time()
    assert found.F["time"] < 4.8
    assert greatest_share(found.trajectory, puma.limits) <= 1.0


def test_jerk_may_be_the_only_limit(puma, path):
    robot = freed(puma, velocity=np.full(6, np.inf), acceleration=np.full(6, np.inf))
    found = along(path, robot, control_points=60).least_time()
    assert greatest_share(found.trajectory, robot.limits) <= 1.0
    assert found.F["time"] <= along(path, puma, control_points=60).least_time().F["time"]


@pytest.mark.long
@pytest.mark.parametrize("count", [44, 60])
def test_effort_is_proven_and_faster_than_slowing_down(puma, path, count):
    limits = puma.limits
    robot = freed(puma, jerk=20.0 * limits.jerk, effort=0.5 * limits.effort)
    free = along(path, robot, control_points=count).least_time()
    found = along(path, robot, control_points=count, effort=True, payload=2.5, limits="certified").least_time()
    assert max(found.G.values()) <= 0.0
    assert bool(certify(found.rollout))
    assert greatest_share(found.trajectory, robot.limits) <= 1.0
    t = np.linspace(0.0, found.F["time"], FINE)[None]
    states = [found.trajectory.evaluate(t, order)[0] for order in range(3)]
    effort = np.abs(Dynamics(robot, Payload(2.5)).effort(*states))
    assert (effort <= robot.limits.effort).all()
    path_terms = EffortLimits(PathDerivatives(path), Dynamics(robot, Payload(2.5)), np.ones(6))
    states = np.stack([free.trajectory.course.parameter(t / t.max(), order)[0] for order in range(4)], axis=1)
    slowed = path_terms.least_time(states, free.F["time"])
    assert free.F["time"] < found.F["time"] < 0.9 * slowed


def test_what_cannot_be_held_is_told(puma, path):
    robot = freed(puma, effort=0.2 * puma.limits.effort)
    problem = along(path, robot, control_points=60, effort=True, payload=5.0)
    with pytest.raises(InvalidInputError, match="cannot hold itself and its payload everywhere on the path"):
        problem.least_time()
    assert problem.known_good(10).shape == (0, problem.n_var)


@pytest.mark.parametrize("settings", [{"limits": "hull"}, {"interpolant": "linear"}])
def test_where_there_are_no_programs_that_is_told(settings):
    with pytest.raises(InvalidInputError, match="least_time: expected limits='tight' or 'certified'"):
        TimeJerkReparameterisation(**settings).least_time()


def test_a_longest_time_that_is_too_short_is_told(puma, path):
    with pytest.raises(InvalidInputError, match="longest_time: the path needs 4.7"):
        TimeJerkReparameterisation(path=path, robot=puma, control_points=60, longest_time=4.0)


#: Encodings, numbers of control points, and sizes of a population.
BEGINNINGS = [
    ("shape", 44, 4),
    ("shape", 44, 5),
    ("shape", 44, 8),
    *((kind, *size) for kind in ("plain", "shape") for size in ((44, 15), (60, 30))),
]


@pytest.mark.parametrize(("encoding", "count", "size"), mostly_long(BEGINNINGS, BEGINNINGS[0], several=True))
def test_a_search_begins_with_a_front(puma, path, encoding, count, size):
    problem = along(path, puma, control_points=count, encoding=encoding)
    known = problem.known_good(size)
    F, G = problem.evaluate(known, return_values_of=["F", "G"])
    assert len(known) == size
    assert (G <= 0.0).all()
    constant = F[:, 1] * (F[:, 0] ** 5 if encoding == "plain" else 1.0)
    assert (np.diff(F[:, 0]) >= -1e-9).all()
    assert (np.diff(constant) <= 1e-3 * constant[0]).all()
    front = optimise(problem, seed=1, population=size, generations=2, polish=False, progress=False)
    assert front.F[0, 0] <= problem.least_time().F["time"] * (1.0 + 1e-12)
    assert front.F[:, 0].max() > 11.0


HURRIED = [("plain", np.inf, 1.05), ("shape", np.inf, 1.05), ("plain", None, 1.5), ("shape", None, 1.5)]


@pytest.mark.parametrize(("encoding", "jerk", "most"), mostly_long(HURRIED, *HURRIED[:2], several=True))
def test_a_search_without_time_begins_with_a_fast_motion_that_keeps_all_limits(puma, path, encoding, jerk, most):
    robot = puma if jerk is None else freed(puma, jerk=np.full(6, jerk))
    problem = along(path, robot, control_points=44, encoding=encoding)
    least = problem.least_time().F["time"]
    known = problem.known_good(20, in_time=lambda: False)
    F, G = problem.evaluate(known, return_values_of=["F", "G"])
    assert (G <= 0.0).all()
    assert least * (1.0 - 1e-9) <= F[0, 0] <= most * least
    assert len(known) == len(np.unique(known, axis=0))
    assert F[-1, 0] == F[0, 0] if encoding == "shape" else F[-1, 0] > 11.0
    front = optimise(problem, seed=1, population=20, generations=1, cpu_time=1e-3, polish=False, progress=False)
    assert front.F[0, 0] <= F[0, 0] * (1.0 + 1e-12)


@pytest.mark.parametrize("effort", mostly_long([False, True], False))
def test_a_limit_that_leaves_time_enough_changes_nothing(puma, path, effort, monkeypatch):
    """But that motions on the way are evaluated, none of which is faster than the last by more than 1e-3."""
    monkeypatch.setattr(path_optimum, "_TIMES", 3)  # fewer programs
    problem, seen = along(path, puma, control_points=44, effort=effort), []
    expected, evaluate = problem.known_good(4), problem.evaluate

    def seeing(*rows, **options):
        seen.append(evaluate(*rows, **options))
        return seen[-1]

    problem.evaluate = seeing
    found = problem.known_good(4, in_time=lambda: True)
    assert (found == expected).all()
    times = [F[0, 0] for F, G in (one for one in seen if isinstance(one, tuple)) if (G <= 0.0).all()]
    assert len(times) > 1
    assert min(times) >= evaluate(found[:1], return_values_of=["F"])[0, 0] * (1.0 - 1e-3)


@pytest.mark.long
def test_the_jerk_of_few_control_points_is_not_below_that_of_many(puma, path):
    """A B-spline with 16 control points, whose front gradients find, never beats one with 60 in the same time."""
    few = optimise(along(path, puma), seed=1, population=20, generations=5, progress=False)
    many = along(path, puma, control_points=60)
    times, jerks = many.evaluate(many.known_good(400), return_values_of=["F"]).T
    for time, jerk in few.F:
        slowed = jerks * np.minimum(times / time, 1.0) ** 5
        assert slowed[times <= time].min() <= 1.02 * jerk


def test_few_control_points_begin_with_programs_where_efforts_are_limited(puma, path):
    problem = along(path, puma, effort=True, limits="certified")
    known = problem.known_good(8)
    assert len(known) == 4
    assert (problem.evaluate(known[:1], return_values_of=["F", "G"])[1] <= 0.0).all()
    random = np.random.default_rng(1).uniform(problem.xl, problem.xu, (50, problem.n_var))
    F, G = problem.evaluate(random, return_values_of=["F", "G"])
    times = problem.evaluate(known, return_values_of=["F", "G"])[0][:, 0]
    assert times[0] < F[(G <= 0.0).all(axis=1), 0].min(initial=np.inf)
    assert times[0] <= times.min() * (1.0 + 1e-12)


def test_few_control_points_begin_as_before():
    problem = TimeJerkReparameterisation()
    assert problem.known_good(10).shape == (0, problem.n_var)
    assert problem.evolution == TimeJerkReparameterisation.evolution


def slopes_agree(limits, states, time):
    """Compare slopes with differences, and the change with the time."""
    near = limits.linearised(states, time)
    for order in range(4):
        step = np.zeros_like(states)
        step[:, order] = 1e-6 * np.maximum(np.abs(states[:, order]), 1.0)
        more, less = (limits.linearised(states + sign * step, time).above for sign in (1.0, -1.0))
        rate = (less - more) / (2.0 * step[:, order, None])
        scale = np.abs(near.slopes[..., order]).max() + 1e-12
        assert np.abs(rate - near.slopes[..., order]).max() < 1e-5 * scale


def test_slopes_of_limits_agree_with_differences(puma, path):
    instants = Instants.even(30, 6, 3)
    states = instants.states(begun(path, puma.limits, 30, 6))[5:-5]
    derivatives = PathDerivatives(path)
    slopes_agree(KinematicLimits(derivatives, puma.limits), states, 5.0)
    slopes = np.abs(derivatives(states[:, 0])[1])
    away = slopes[:, slopes.max(axis=0) > 1e-9].min(axis=1) > 1e-2  # dry friction jumps where a joint turns round
    assert away.sum() > 10
    slopes_agree(EffortLimits(derivatives, Dynamics(puma, Payload(2.0)), np.ones(6)), states[away], 5.0)


def test_the_least_time_under_effort_is_on_the_edge(puma, path):
    robot = freed(puma, effort=0.5 * puma.limits.effort)
    limits = EffortLimits(PathDerivatives(path), Dynamics(robot), np.ones(6))
    states = Instants.even(30, 6, 3).states(begun(path, robot.limits, 30, 6))
    time = limits.least_time(states, 0.0)
    assert abs(limits.excess(states, time).max()) < 1e-9
    assert limits.excess(states, 1.01 * time).max() < 0.0 < limits.excess(states, 0.99 * time).max()


def some_program(seed):
    """Instants and limits of no particular meaning, and steps of control points."""
    rng = np.random.default_rng(seed)
    instants = Instants.even(24, 6, 2)
    slopes = rng.normal(size=(len(instants.span), 3, 4)) * np.array([1.0, 0.1, 0.01, 1e-4])
    above, below = rng.uniform(0.0, 1.0, (2, *slopes.shape[:2]))
    slower = np.broadcast_to(np.array([1.0, 2.0, 3.0]), above.shape)
    return instants, Linearised(slopes, above, below, slower, slower), rng.uniform(0.01, 0.1, 23)


@pytest.mark.parametrize("seed", range(4))
def test_linear_programs_end_where_highs_does(seed):
    instants, limits, steps = some_program(seed)
    move, time = Program(instants, limits, steps, 0.05).solve()
    free = instants.count - 2 * HELD
    unit = np.eye(instants.count)[instants.free]
    columns = np.stack([instants.states(row) for row in unit], axis=2)  # (K, 4, free)
    rows = np.einsum("krd,kdf->krf", limits.slopes, columns).reshape(-1, free)
    slower = limits.slower_above.reshape(-1, 1)
    order = -np.diff(unit.T, axis=0)[HELD - 1 : instants.count - HELD]
    A = np.concatenate(
        [np.hstack([rows, -slower]), np.hstack([-rows, -slower]), np.hstack([order, np.zeros((len(order), 1))])]
    )
    b = np.concatenate([limits.above.ravel(), limits.below.ravel(), steps[HELD - 1 : instants.count - HELD]])
    best = linprog(np.eye(free + 1)[-1], A_ub=A, b_ub=b, bounds=[(-0.05, 0.05)] * free + [(None, None)])
    assert time == pytest.approx(best.fun, abs=3e-6)
    assert (A @ np.append(move[instants.free], time) <= b + 2e-6).all()


def test_quadratic_programs_within_all_limits_are_linear_equations():
    instants, limits, _ = some_program(1)
    wide = Linearised(limits.slopes, limits.above + 1e3, limits.below + 1e3, limits.slower_above, limits.slower_above)
    weights = np.broadcast_to(np.diag([1.0, 1e-2, 1e-4, 1e-6]), (len(instants.span), 4, 4))
    gradient = instants.spread(np.random.default_rng(2).normal(size=(len(instants.span), 4)) * 1e-4)
    band = instants.gram(weights)
    move, time = Program(instants, wide, np.full(23, 1e3), 1e3, Quadratic(gradient, band)).solve()
    inner = band[:, instants.free].copy()
    expected = solveh_banded(inner, -gradient[instants.free], lower=True)
    assert time == 0.0
    assert np.abs(move[instants.free] - expected).max() < 1e-3 * np.abs(expected).max()


def test_a_program_does_not_change_what_it_is_given(puma, path):
    start = begun(path, puma.limits, 40, 6)
    before = start.copy()
    limits = [KinematicLimits(PathDerivatives(path), puma.limits)]
    found = fastest(start, 6, limits, len(path.breaks) - 1)
    assert (start == before).all()
    assert not found.control_points.flags.writeable
    assert found.time < least_time(limits, Instants.even(40, 6, 3).states(start))
