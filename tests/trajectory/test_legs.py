"""Motions with stops, waits, given velocities and fixed durations: exact at the points, and as smooth as told."""

import numpy as np
import pytest

from tests.helpers import refused
from trajevo import Interpolant, Passing, PolynomialBatch, QuinticSpline, Variable, ViaPoints
from trajevo.path.passing import passings_of
from trajevo.trajectory.interpolants import THROUGH_POINTS, CubicSpline, Legs, SepticSpline, interpolant_through

BOUNDS = (0.1, 20.0)
POINTS = ViaPoints(np.random.default_rng(3).normal(size=(7, 3)))
#: Legs of two, one and three segments: the hybrid curve needs three points, the others two.
PASSING = (Passing(2, stop=True), Passing(3, dwell=0.4))
LONG = (Passing(2, stop=True), Passing(4, dwell=0.4))
MEETING = sorted(name for name in THROUGH_POINTS if name != "linear_blends")
#: Accelerations of this one jump, at stops too.
JUMPING = "hermite"
#: Interpolant, and up to which order its derivatives are continuous where a velocity is given.
GIVEN = {"quintic_spline": (QuinticSpline, 3), "septic_spline": (SepticSpline, 5), "cubic": (CubicSpline, 2)}


def made(name="quintic_spline", passing=PASSING, bounds=BOUNDS, points=POINTS):
    passing = passings_of(passing, len(points), ("a", "b", "c"))
    return interpolant_through(name, points, duration_bounds=bounds, passing=passing)


def times(interpolant, count=5, seed=0):
    return np.random.default_rng(seed).uniform(0.3, 2.0, (count, len(interpolant.variables)))


def jumps(motion, order):
    """Greatest jump of a derivative, as a share of its size."""
    return np.abs(motion.jump(order)).max() / np.abs(motion.at_shares(np.linspace(0.0, 1.0, 9), order)).max()


@pytest.mark.parametrize("name", MEETING)
def test_a_stop_is_at_rest_and_a_dwell_stays(name):
    interpolant = made(name, LONG)
    x = times(interpolant)
    motion, via = interpolant(x), interpolant.via_times(x)
    for k, row in enumerate(via):
        one = motion[k]
        np.testing.assert_allclose(one.evaluate(row[None])[0], POINTS.positions, atol=1e-12)
        for point, dwell in ((2, 0.0), (4, 0.4)):
            for order in (1,) if name == JUMPING else (1, 2):
                size = float(one.peak(order).max())
                assert np.abs(one.evaluate(row[None, [point]], order)).max() < 1e-11 * size
            stay = one.evaluate(row[point] + dwell * np.linspace(0.0, 1.0, 9)[None, 1:-1])[0]
            if dwell:
                np.testing.assert_array_equal(stay, np.tile(POINTS.positions[point], (7, 1)))
                for order in (1, 2, 3):
                    waiting = one.evaluate(row[point] + dwell * np.linspace(0.01, 0.99, 9)[None], order)
                    np.testing.assert_array_equal(waiting, 0.0)
    for order in range(2 if name == JUMPING else 3):
        assert jumps(motion, order) < 1e-9
    assert name != JUMPING or jumps(motion, 2) > 1e-3
    moving = [variable for variable in interpolant.variables if variable.unit == "s"] if name != "cubic" else []
    assert len({variable.name for variable in interpolant.variables}) == len(interpolant.variables)
    assert [variable.name for variable in moving] == [f"dt_{k}" for k in range(1, len(moving) + 1)]


@pytest.mark.parametrize("name", MEETING)
def test_legs_are_the_motions_of_the_interpolant_itself(name):
    interpolant = made(name, LONG)
    x = times(interpolant)
    motion = interpolant(x)
    first = THROUGH_POINTS[name](ViaPoints(POINTS.positions[:3]), duration_bounds=BOUNDS)
    count = len(first.variables)
    alone = first(x[:, :count])
    own = motion.coefficients[:, : alone.segment_durations.shape[1]]
    np.testing.assert_array_equal(own[..., : alone.degree + 1], alone.coefficients)
    np.testing.assert_array_equal(own[..., alone.degree + 1 :], 0.0)
    of_time = [variable.unit == "s" for variable in interpolant.variables]
    np.testing.assert_allclose(motion.duration, x[:, of_time].sum(axis=1) + 0.4, rtol=1e-14)


def test_a_wait_lasts_as_long_as_it_is_told():
    interpolant = made()
    x = times(interpolant)
    breaks, via = interpolant(x).breaks, interpolant.via_times(x)
    assert breaks.shape[1] == len(POINTS) + 1
    np.testing.assert_allclose(breaks[:, 4] - breaks[:, 3], 0.4, rtol=1e-13)
    np.testing.assert_allclose(np.delete(breaks, 4, axis=1), via, rtol=1e-14)


@pytest.mark.parametrize("name", GIVEN)
def test_given_states_are_met_exactly(name):
    make, smooth = GIVEN[name]
    there, start, rise, end = np.array([0.3, -0.2, 0.0]), [0.5, 0.0, -0.4], [1.0, -2.0, 0.5], [0.0, 0.2, 0.1]
    passing = (Passing(0, velocity=start, acceleration=rise), Passing(3, velocity=there), Passing(6, velocity=end))
    interpolant = made(name, passing)
    assert isinstance(interpolant, Legs)
    x = times(interpolant)
    motion, via = interpolant(x), interpolant.via_times(x)
    for k, row in enumerate(via):
        one = motion[k]
        np.testing.assert_allclose(one.evaluate(row[None])[0], POINTS.positions, atol=1e-10)
        at = one.evaluate(np.minimum(row, one.duration[0])[None], 1)[0]
        np.testing.assert_allclose(at[[0, 3, 6]], [start, there, end], atol=1e-9 * float(one.peak(1).max()))
        at = one.evaluate(np.array([[0.0, float(one.duration[0])]]), 2)[0]
        np.testing.assert_allclose(at, [rise, [0.0] * 3], atol=1e-9 * float(one.peak(2).max()))
    for order in range(smooth + 1):
        assert jumps(motion, order) < 1e-8
    assert make.takes_velocities


@pytest.mark.parametrize(("name", "degree"), [("quintic_spline", 5), ("septic_spline", 7)])
def test_a_polynomial_is_its_own_spline(name, degree):
    """Points, end states and one velocity of a polynomial determine it: the spline that is given them is this one."""
    powers, random = np.polynomial.polynomial, np.random.default_rng(1)
    coefficients = random.normal(size=(degree + 1, 3))
    if degree == 7:  # the septic spline has no jerk at its ends: one that is t (2 - t) times anything
        jerk = np.stack([powers.polymul([0.0, 2.0, -1.0], factor) for factor in random.normal(size=(3, 3))], axis=1)
        coefficients = powers.polyint(jerk, 3, k=[0.3, -0.2, 0.5])
    t = np.array([0.0, 0.7, 1.1, 2.0])
    at = [powers.polyval(t, powers.polyder(coefficients, m)).T for m in range(3)]
    passing = (
        Passing(0, velocity=at[1][0], acceleration=at[2][0]),
        Passing(3, velocity=at[1][3], acceleration=at[2][3]),
    )
    points = ViaPoints(at[0])
    free = made(name, passing, points=points)(np.diff(t)[None])
    both = made(name, (*passing, Passing(1, velocity=at[1][1])), points=points)(np.diff(t)[None])
    seen = np.linspace(0.0, 2.0, 41)
    for motion in (free, both):
        np.testing.assert_allclose(motion.evaluate(seen[None])[0], powers.polyval(seen, coefficients).T, atol=1e-10)


def test_fixed_durations_are_no_variables():
    bounds = [[0.2, 3.0], [1.5, 1.5], [0.1, 2.0], [0.4, 0.9], [0.7, 0.7], [0.1, 5.0]]
    for passing in ((), PASSING):
        interpolant = made(passing=passing, bounds=bounds)
        assert [(v.name, v.lower, v.upper) for v in interpolant.variables] == [
            ("dt_1", 0.2, 3.0),
            ("dt_3", 0.1, 2.0),
            ("dt_4", 0.4, 0.9),
            ("dt_6", 0.1, 5.0),
        ]
        x = times(interpolant)
        whole = np.insert(x, [1, 3], [1.5, 0.7], axis=1)
        np.testing.assert_array_equal(interpolant(x).coefficients, made(passing=passing)(whole).coefficients)


def test_derivatives_by_complex_steps_are_right():
    interpolant = made(passing=(*PASSING, Passing(0, velocity=[0.1, 0.2, 0.3]), Passing(5, velocity=[0.0, 1.0, 0.0])))
    x, h = times(interpolant, 1), 1e-6
    for column in range(x.shape[1]):
        step = np.eye(x.shape[1])[column]
        exact = interpolant(x + 1e-30j * step).coefficients.imag / 1e-30
        rough = (interpolant(x + h * step).coefficients - interpolant(x - h * step).coefficients) / (2.0 * h)
        np.testing.assert_allclose(exact, rough, atol=1e-7 * np.abs(rough).max())


def test_nothing_changes_without_wishes():
    assert isinstance(made(passing=()), QuinticSpline)
    assert isinstance(made(passing=[{"point": 2, "window": [1.0, 2.0]}]), QuinticSpline)


def test_lines_with_blends_meet_the_points_at_which_they_stop():
    interpolant = made("linear_blends", LONG)
    assert [variable.name for variable in interpolant.variables if variable.unit == "1"] == [
        "blend of leg 1",
        "blend of leg 2",
        "blend of leg 3",
    ]
    x = times(interpolant)
    x[:, [2, 5, 8]] = [0.5, 0.7, 0.3]
    motion, via = interpolant(x), interpolant.via_times(x)
    errors = interpolant.via_errors(motion)
    assert errors.shape == (5, 7, 3)
    at = np.stack([motion[k].evaluate(np.minimum(via[k], motion.duration[k])[None])[0] for k in range(5)])
    np.testing.assert_allclose(errors, np.abs(at - POINTS.positions), atol=1e-12)
    assert errors[:, [0, 2, 4, 6]].max() < 1e-12
    assert errors[:, [1, 3, 5]].min() > 0.0
    assert made("quintic_spline").via_errors(made("quintic_spline")(times(made()))).shape == (5, 0, 3)


class Restless(Interpolant):
    """Straight lines, which do not begin at rest."""

    def __init__(self, points, *, duration_bounds):
        self.points, self.bounds = points, duration_bounds

    @property
    def variables(self):
        return (Variable("T", "s", *self.bounds),)

    def __call__(self, x):
        p = self.points.positions
        return PolynomialBatch(
            np.concatenate([0.0 * x, x], axis=1), np.stack([p[0] + 0.0 * x, (p[-1] - p[0]) / x], axis=-1)[:, None]
        )

    def via_times(self, x):
        return np.linspace(0.0, x[:, 0], len(self.points), axis=1)


def test_what_an_interpolant_cannot_do_is_refused():
    stop, given = (Passing(2, stop=True),), (Passing(2, velocity=[0.0, 0.0, 1.0]),)
    refused(lambda: made("hybrid", given), "passing: point 2: velocity: 'hybrid' takes none; quintic_spline,")
    refused(
        lambda: made("hybrid", (Passing(1, stop=True),)),
        "passing: from point 0 to 1, between stops: points: the smooth hybrid quartic needs at least 3 points, got 2",
    )
    refused(
        lambda: Legs("restless", Restless, POINTS, passing=stop, duration_bounds=BOUNDS),
        "'restless' does not begin and end at rest, as a stop needs",
    )
    pairs = [[0.1, 2.0]] * 6
    for name in ("cubic", "linear_blends"):
        refused(
            lambda name=name: made(name, (), pairs), f"duration_bounds: expected one pair.* of '{name}' are not the"
        )


@pytest.mark.parametrize(
    ("bounds", "says"),
    [
        ([[0.1, 2.0]] * 5, r"duration_bounds: expected shape \(6, 2\), got \(5, 2\); one pair \[s\] for each segment"),
        (
            [[0.1, 2.0]] * 5 + [[2.0, 1.0]],
            "segment 5, from point 5 to 6: expected 0 < lower <= upper .*got 2.0 and 1.0",
        ),
        ([[0.0, 2.0]] + [[0.1, 2.0]] * 5, "segment 0, from point 0 to 1: expected 0 < lower"),
        ([0.5, 0.5], "expected 0 < lower < upper"),
        ([[0.1, 2.0], [0.1]], "duration_bounds: expected numbers of shape"),
    ],
)
def test_bad_bounds_are_refused(bounds, says):
    refused(lambda: made(passing=(), bounds=bounds), says)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"point": 2, "stop": True}, "passing: expected a list"),
        (["stop"], "passing.0: expected point and how it is passed, got 'stop'"),
        ([{"stop": True}], "passing.0: expected point and"),
        ([{"point": 1, "halt": True}], "passing.0: unknown key 'halt'; known: acceleration, dwell,"),
        ([{"point": 1, "dwel": 0.1}], "did you mean 'dwell'"),
        ([{"point": 1.5, "stop": True}], "point: expected the number of a point, from 0, got 1.5"),
        ([{"point": 7, "stop": True}], "passing: point: expected 0 to 6, got 7"),
        ([{"point": 1, "stop": 1}], "point 1: stop: expected true or false, got 1"),
        ([{"point": 1, "dwell": -0.1}], "point 1: dwell: expected 0 to 1000 s, got -0.1 s"),
        ([{"point": 1, "dwell": 4000.0}], "dwell: expected 0 to 1000 s, got 4000 s, 4 if it is ms"),
        ([{"point": 1, "dwell": float("nan")}], "point 1: dwell: expected finite numbers"),
        ([{"point": 1, "dwell": 0.4, "stop": False}], "point 1: stop: expected true, as a dwell of 0.4 s is a stop"),
        ([{"point": 1, "stop": True, "velocity": [0, 0, 0]}], "point 1: expected stop or velocity, got both"),
        ([{"point": 1, "velocity": [0, 0]}], "point 1: velocity: expected 3 numbers, one for each of a, b, c, got 2"),
        ([{"point": 1, "acceleration": [0, 0, 0]}], "point 1: acceleration: expected one at the first or the last"),
        (
            [{"point": 0, "stop": True}],
            "point 0: stop: expected an inner point, 1 to 5, got the first, .*begins at rest",
        ),
        ([{"point": 6, "dwell": 0.1}], "point 6: dwell: expected an inner point, 1 to 5, got the last, .*ends at rest"),
        (
            [{"point": 1, "stop": True}, {"point": 1, "dwell": 1}],
            "expected one entry for each point, got two for point 1",
        ),
        (
            [{"point": 1, "window": [2.0, 1.0]}],
            "point 1: window: expected an earliest and a later latest .*got 2 and 1",
        ),
        ([{"point": 1, "window": [-1.0, 1.0]}], "point 1: window: expected an earliest"),
        ([{"point": 1, "window": 2.0}], r"point 1: window: expected shape \(2\)"),
        ([{"point": 0, "window": [0.0, 1.0]}], "point 0: window: expected a later point"),
    ],
)
def test_contradictions_cost_a_sentence(given, says):
    refused(lambda: made(passing=given), says)


@pytest.mark.parametrize(("make", "smooth"), [(QuinticSpline, 4), (SepticSpline, 6)])
def test_a_cyclic_spline_has_no_seam(make, smooth):
    """Begun at another point of the cycle, it is the same motion."""
    p = POINTS.positions
    closed, turned = ViaPoints(np.vstack([p, p[:1]])), ViaPoints(np.vstack([p[3:], p[:4]]))
    x = np.random.default_rng(0).uniform(0.3, 2.0, (4, len(p)))
    motion = make(closed, duration_bounds=BOUNDS, cyclic=True)(x)
    other = make(turned, duration_bounds=BOUNDS, cyclic=True)(np.roll(x, -3, axis=1))
    size = np.abs(motion.coefficients).max(axis=(0, 1, 2))
    np.testing.assert_allclose(np.roll(other.coefficients, 3, axis=1) / size, motion.coefficients / size, atol=1e-10)
    for order in range(smooth + 1):
        assert jumps(other, order) < 1e-7
        ends = motion.at_shares(np.array([0.0, 1.0]), order)[:, [0, -1]]
        assert np.abs(ends[:, 0] - ends[:, 1]).max() < 1e-7 * float(motion.at_shares(np.linspace(0, 1, 9), order).max())


def test_a_cycle_with_known_velocities_and_rests():
    p = POINTS.positions
    closed, x = ViaPoints(np.vstack([p, p[:1]])), np.random.default_rng(0).uniform(0.3, 2.0, (4, len(p)))
    spline = QuinticSpline(
        closed, duration_bounds=BOUNDS, cyclic=True, at_rest=[(2, 1)], velocities={4: [0.1, 0.2, 0.3]}
    )
    motion, via = spline(x), spline.via_times(x)
    at = np.stack([motion[k].evaluate(via[k : k + 1, [2, 4]], 1)[0] for k in range(4)])
    np.testing.assert_allclose(at[:, 0, 1], 0.0, atol=1e-12)
    np.testing.assert_allclose(at[:, 1], np.tile([0.1, 0.2, 0.3], (4, 1)), atol=1e-12)
    for order in range(5):
        ends = motion.at_shares(np.array([0.0, 1.0]), order)[:, [0, -1]]
        assert np.abs(ends[:, 0] - ends[:, 1]).max() < 1e-8 * float(motion.at_shares(np.linspace(0, 1, 9), order).max())
    exact = spline(x[:1] + 1e-30j * np.eye(len(p))[0]).coefficients.imag / 1e-30
    rough = (
        spline(x[:1] + 1e-6 * np.eye(len(p))[0]).coefficients - spline(x[:1] - 1e-6 * np.eye(len(p))[0]).coefficients
    )
    np.testing.assert_allclose(exact, rough / 2e-6, atol=1e-6 * np.abs(rough / 2e-6).max())


def test_a_circle_is_known_in_closed_form():
    """A periodic quintic spline through N even points of a circle: its error falls with the sixth power of the step."""
    errors = []
    for count in (8, 16):
        angle = 2.0 * np.pi * np.arange(count + 1) / count
        circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        circle[-1] = circle[0]
        spline = QuinticSpline(ViaPoints(circle), duration_bounds=BOUNDS, cyclic=True)
        motion = spline(np.full((1, count), 2.0 * np.pi / count))
        t = np.linspace(0.0, float(motion.duration[0]), 400)
        errors.append(np.abs(motion.evaluate(t[None])[0] - np.stack([np.cos(t), np.sin(t)], axis=1)).max())
    assert errors[0] < 1e-4
    assert 50.0 < errors[0] / errors[1] < 80.0


def test_what_is_no_cycle_is_refused():
    refused(
        lambda: QuinticSpline(POINTS, duration_bounds=BOUNDS, cyclic=True),
        "cyclic: expected the last point to be the first",
    )
    closed = ViaPoints(np.vstack([POINTS.positions, POINTS.positions[:1]]))
    refused(
        lambda: SepticSpline(closed, duration_bounds=BOUNDS, cyclic=True, end_velocity=[1.0, 0.0, 0.0]),
        "cyclic: expected no end_velocity, as a cyclic motion has no end",
    )
