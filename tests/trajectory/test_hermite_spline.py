"""Cubic Hermite splines with free velocities: those of SciPy, through their points, fast where no jerk is limited."""

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from tests.helpers import mostly_long, refused
from trajevo import HermiteSpline, Passing, Robot, ViaPointProblem, ViaPoints, certify, optimise, verify
from trajevo.trajectory.interpolants.hermite import odd_spline

BOUNDS = (0.1, 20.0)
POINTS = ViaPoints(np.random.default_rng(3).normal(size=(5, 3)))


def made(extra=0, points=POINTS, **more):
    return HermiteSpline(points, extra_points=extra, duration_bounds=BOUNDS, **more)


def drawn(interpolant, count=6, seed=0):
    """Decision vectors with times of 0.4 to 1.5 s and all else within its bounds."""
    generator, own = np.random.default_rng(seed), interpolant.variables
    low, high = np.array([(0.4, 1.5) if one.unit == "s" else (one.lower, one.upper) for one in own]).T
    return generator.uniform(low, high, (count, len(own)))


@pytest.mark.parametrize("extra", [0, 1, 3])
def test_it_is_the_hermite_spline_of_scipy_through_its_own_states(extra):
    interpolant = made(extra)
    x = drawn(interpolant)
    motion, via = interpolant(x), interpolant.via_times(x)
    np.testing.assert_allclose(motion.evaluate(via), np.broadcast_to(POINTS.positions, (len(x), 5, 3)), atol=1e-12)
    np.testing.assert_array_equal(motion.coefficients[..., 0][:, :: extra + 1], [POINTS.positions[:-1]] * len(x))
    for row, one in enumerate(motion):
        knots = motion.breaks[row]
        scipy = CubicHermiteSpline(knots, one.evaluate(knots)[0], one.evaluate(knots, 1)[0])
        at = np.linspace(0.0, knots[-1], 301)
        for order in (0, 1):
            np.testing.assert_allclose(one.evaluate(at, order)[0], scipy(at, order), rtol=0.0, atol=1e-9)
    for order in (0, 1):
        assert np.abs(motion.jump(order)).max() < 1e-9 * np.abs(motion.at_shares(np.linspace(0.0, 1.0, 9), order)).max()
    assert np.abs(motion.evaluate(np.stack([np.zeros(len(x)), motion.duration], axis=1), 1)).max() < 1e-9
    assert np.abs(motion.jump(2)).max() > 1.0
    assert len(x[0]) == 4 + 4 * (extra + 1) * bool(extra) + 3 * (4 * extra + 3) + 3 * 4 * extra


@pytest.mark.parametrize("extra", [0, 2])
def test_without_offsets_it_is_the_cubic_spline_itself(extra):
    interpolant = made(extra)
    x = drawn(interpolant)
    x[:, 4 + 4 * (extra + 1) * bool(extra) :] = 0.0
    motion, spline = interpolant(x), odd_spline(POINTS.positions, x[:, :4], 2)
    at = motion.duration[:, None] * np.linspace(0.0, 1.0, 101)
    np.testing.assert_allclose(motion.evaluate(at, 2), spline.evaluate(at, 2), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("extra", [0, 2])
def test_complex_steps_agree_with_differences_and_rows_do_not_depend_on_others(extra):
    interpolant = made(extra)
    x, h, at = drawn(interpolant, count=3), 1e-6, np.array([0.1, 0.35, 0.8])
    together = interpolant(x).coefficients
    for row in range(3):
        np.testing.assert_array_equal(interpolant(x[row : row + 1]).coefficients[0], together[row])
    for move in np.eye(x.shape[1]):
        exact = interpolant(x + 1e-20j * move).at_shares(at, 1).imag / 1e-20
        above, below = (interpolant(x + sign * h * move).at_shares(at, 1) for sign in (1.0, -1.0))
        np.testing.assert_allclose(exact, (above - below) / (2.0 * h), rtol=1e-5, atol=1e-5)


def test_given_velocities_are_held_and_no_variables():
    there, start = np.array([0.3, -0.2, 0.5]), np.array([0.1, 0.0, -0.4])
    interpolant = made(1, velocities={2: there}, at_rest=[(1, 0)], start_velocity=start)
    x = drawn(interpolant)
    motion, via = interpolant(x), interpolant.via_times(x)
    at = motion.evaluate(via, 1)
    np.testing.assert_allclose(at[:, [0, 2]], [[start, there]] * len(x), atol=1e-12)
    np.testing.assert_allclose(at[:, 1, 0], 0.0, atol=1e-12)
    assert len(made(1).variables) - len(interpolant.variables) == 4


def arm(**limits):
    return Robot.from_limits(velocity=[9.0, 9.0], acceleration=[4.0, 4.0], jerk=[np.inf, np.inf], names=["a", "b"])


def test_with_one_free_point_it_reaches_the_least_time_under_limits_of_acceleration():
    """From rest to rest with |a| at most 4 rad/s², 1 rad takes 2 √(1 / 4) s: full acceleration, then full braking."""
    given = {"robot": arm(), "points": [[0.0, 0.0], [1.0, 0.4]], "duration_bounds": (0.1, 5.0)}
    given |= {"objectives": ["time", "acceleration"], "constraints": ["velocity", "acceleration"]}
    free = ViaPointProblem(**given, interpolant="hermite", extra_points=1)
    front = optimise(free, seed=1, population=20, generations=10, progress=False)
    assert front.F[:, 0].min() == pytest.approx(1.0, rel=1e-6)
    assert certify(front.least("time")).proven
    stiff = optimise(ViaPointProblem(**given, interpolant="cubic"), seed=1, population=20, generations=10)
    assert stiff.F[:, 0].min() > 1.04


@pytest.mark.parametrize("seed", mostly_long(range(40), 0))
@pytest.mark.parametrize("instants", mostly_long([5_001, 50_001], 5_001))
def test_of_random_motions_nothing_passes_what_is_certified(seed, instants):
    """Many instants of velocities, accelerations and positions, and the certificate of the whole."""
    generator = np.random.default_rng(seed)
    points = np.cumsum(generator.uniform(-0.5, 0.5, (4, 2)), axis=0)
    problem = ViaPointProblem(
        robot=arm(),
        points=points,
        interpolant="hermite",
        extra_points=int(generator.integers(3)),
        objectives=["time"],
        constraints=["velocity", "acceleration"],
        duration_bounds=(0.2, 2.0),
    )
    x = generator.uniform(problem.xl, problem.xu, (25, problem.n_var))
    motion = problem.decode(x)
    at = motion.duration[:, None] * np.linspace(0.0, 1.0, instants)
    for order in (0, 1, 2):
        low, high = motion.extremes(order)
        found = motion.evaluate(at, order)
        size = np.abs(found).max()
        assert (found.min(axis=1) >= low - 1e-9 * size).all()
        assert (found.max(axis=1) <= high + 1e-9 * size).all()
    G = problem.evaluate(x, return_values_of=["G"])
    worst = np.stack([np.abs(motion.evaluate(at, order)).max(axis=1) for order in (1, 2)])
    kept, limits = (G <= 0.0).all(axis=1), np.array([9.0, 4.0])[:, None, None]
    assert (worst[:, kept] <= limits).all()
    assert kept[(worst <= 0.999 * limits).all(axis=(0, 2))].all()  # a peak between instants is hardly higher


def task(**given):
    points = [[0.0, 0.0], [1.0, 0.4], [0.3, 0.2]]
    return ViaPointProblem(robot=arm(), points=points, interpolant="hermite", **given)


def test_limits_of_jerk_are_broken_where_an_acceleration_jumps_and_that_is_told():
    jerky = Robot.from_limits(velocity=[9.0, 9.0], acceleration=[4.0, 4.0], jerk=[50.0, 80.0], names=["a", "b"])
    given = {"points": [[0.0, 0.0], [1.0, 0.4], [0.3, 0.2]], "objectives": ["time"], "constraints": ["acceleration"]}
    problem = ViaPointProblem(robot=jerky, interpolant="hermite", **given)
    assert "breaks the robot's limits of jerk" in problem.notes[0]
    front = optimise(problem, seed=1, population=20, generations=5, progress=False, polish=False)
    proof, checked = certify(front.knee()), verify(front.knee())
    assert {row.quantity for row in proof.violated} == {"jerk"}
    assert " is infinite at " in str(proof)
    assert [row for row in proof.summary["rows"] if row["quantity"] == "jerk" and row["bound"] is row["share"] is None]
    assert {row.limit for row in checked.exceeded} == {"jerk"}
    assert "infinite at" in checked.verdict
    assert ViaPointProblem(robot=arm(), interpolant="hermite", **given).notes == ()


SMOOTH = {"objectives": ["time"], "constraints": ["acceleration"]}


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (
            task,
            "objectives: 'jerk' is infinite where accelerations of 'hermite' jump; expected others, or the interpol",
        ),
        (
            lambda: ViaPointProblem(
                robot={"name": "ur5", "tool": "tool0", "limits": {"acceleration": 5.0, "jerk": 50.0}},
                points=[[0.0] * 6, [0.2] * 6],
                interpolant="hermite",
                objectives=["time"],
            ),
            "constraints: 'jerk of shoulder_pan_joint' cannot be kept, as accelerations of 'hermite' jump; expected",
        ),
        (lambda: task(**SMOOTH, extra_points=9), "extra_points: expected a whole number from 0 to 8, got 9"),
        (lambda: task(**SMOOTH, bspline={}), "bspline: 'hermite' is none; expected interpolant = 'bspline'"),
        (lambda: task(**SMOOTH, cyclic=True), "cyclic"),
        (
            lambda: task(**SMOOTH, passing=[Passing(0, velocity=[0.1, 0.1], acceleration=[0.1, 0.0])]),
            "start_acceleration: expected none, as accelerations of 'hermite' are free and may jump; cubic, bspline, ",
        ),
        (lambda: made(span=[1.0, 0.0, 1.0]), "span: expected positive numbers"),
    ],
)
def test_bad_input_gets_a_sentence(call, says):
    refused(call, says)
