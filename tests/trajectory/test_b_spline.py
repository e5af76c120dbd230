"""B-splines with free control points: those of SciPy, through their points, smooth, with what is held at their ends."""

import numpy as np
import pytest
from scipy.interpolate import BSpline as SciPyBSpline
from scipy.interpolate import make_interp_spline

from tests.helpers import refused
from trajevo import BSpline, Passing, QuinticSpline, SepticSpline, ViaPoints
from trajevo.path.passing import passings_of
from trajevo.trajectory.interpolants import interpolant_through
from trajevo.trajectory.interpolants.splines.b_spline import HELD
from trajevo.trajectory.interpolants.splines.basis import basis_pieces

BOUNDS = (0.1, 20.0)
POINTS = ViaPoints(np.random.default_rng(3).normal(size=(5, 3)))
#: Degree, control points, knots, ends.
SHAPES = [
    (3, 2, "even", "acceleration"),
    (3, 3, "free", "velocity"),
    (5, 1, "even", "acceleration"),
    (5, 3, "free", "jerk"),
    (5, 4, "even", "position"),
    (7, 1, "free", "jerk"),
    (7, 3, "even", "acceleration"),
]


def made(shape=SHAPES[2], points=POINTS, **more):
    degree, count, knots, ends = shape
    given = {"degree": degree, "control_points": count, "knots": knots, "ends": ends, "duration_bounds": BOUNDS}
    return BSpline(points, **given | more)


def drawn(interpolant, count=6, seed=0):
    """Decision vectors with times of 0.4 to 1.5 s and all else within its bounds."""
    generator, own = np.random.default_rng(seed), interpolant.variables
    low, high = np.array([(0.4, 1.5) if one.unit == "s" else (one.lower, one.upper) for one in own]).T
    return generator.uniform(low, high, (count, len(own)))


@pytest.mark.thinned(4)
@pytest.mark.parametrize("degree", [3, 5, 7])
@pytest.mark.parametrize("pieces", [1, 2, 6])
def test_basis_is_scipy_s(degree, pieces):
    parts = np.random.default_rng(degree).uniform(0.1, 1.0, (3, pieces))
    basis, u = basis_pieces(parts, degree), np.linspace(0.05, 0.95, 7)
    for row, spans in enumerate(parts):
        ends = np.concatenate([[0.0], np.cumsum(spans)])
        knots = np.concatenate([[0.0] * degree, ends, [ends[-1]] * degree])
        for number in range(pieces + degree):
            scipy = SciPyBSpline(knots, np.eye(pieces + degree)[number], degree)
            for piece in range(max(number - degree, 0), min(number, pieces - 1) + 1):
                own = np.polynomial.Polynomial(basis[row, piece, number - piece])
                local = u * spans[piece]
                for order in range(degree + 1):
                    at, expected = own.deriv(order) if order else own, scipy(ends[piece] + local, order)
                    scale = spans.min() ** -float(order)
                    np.testing.assert_allclose(at(local), expected, rtol=1e-9, atol=1e-11 * scale)


@pytest.mark.parametrize("shape", SHAPES)
def test_passes_the_points_smoothly_and_holds_its_ends(shape):
    interpolant, (degree, count, _, ends) = made(shape), shape
    x = drawn(interpolant)
    motion, via = interpolant(x), interpolant.via_times(x)
    np.testing.assert_allclose(motion.evaluate(via), np.broadcast_to(POINTS.positions, (len(x), 5, 3)), atol=1e-12)
    at = np.arange(4) * (count + 1)
    np.testing.assert_array_equal(motion.coefficients[..., 0][:, at], np.tile(POINTS.positions[:-1], (len(x), 1, 1)))
    instants = np.stack([np.zeros(len(x)), motion.duration], axis=1)
    for order in range(degree):
        size = np.abs(motion.at_shares(np.linspace(0.0, 1.0, 9), order)).max()
        assert np.abs(motion.jump(order)).max() < 1e-9 * size
        if 0 < order <= HELD.index(ends):
            assert np.abs(motion.evaluate(instants, order)).max() < 1e-9 * size
        elif order:
            assert (np.abs(motion.evaluate(instants, order)).max(axis=2) > 1e-3 * size).any()
    assert np.abs(motion.jump(degree)).max() > 1e-3


@pytest.mark.parametrize("shape", SHAPES)
def test_it_is_the_b_spline_of_scipy_through_as_many_of_its_own_values(shape):
    """A spline with these knots is known by its values at as many instants as it has control points."""
    interpolant, degree = made(shape), shape[0]
    motion = interpolant(drawn(interpolant, count=2))
    for row in range(len(motion)):
        ends, one = motion.breaks[row], motion[row]
        knots = np.concatenate([[0.0] * degree, ends, [ends[-1]] * degree])
        averages = np.array([knots[k + 1 : k + 1 + degree].mean() for k in range(len(ends) - 1 + degree)])
        averages[-1] = ends[-1]
        scipy = make_interp_spline(averages, one.evaluate(averages)[0], k=degree, t=knots)
        at = np.linspace(0.0, ends[-1], 301)
        for order in range(3):
            size = np.abs(one.evaluate(at, order)).max()
            np.testing.assert_allclose(one.evaluate(at, order)[0], scipy(at, order), atol=1e-9 * size)


@pytest.mark.parametrize(("degree", "plain"), [(5, QuinticSpline), (7, SepticSpline)])
def test_without_offsets_it_is_the_spline_itself(degree, plain):
    interpolant, plain = made((degree, 3, "even", "acceleration")), plain(POINTS, duration_bounds=BOUNDS)
    x = drawn(interpolant)
    x[:, 4:] = 0.0  # even knots have no weights
    one, other = plain(x[:, :4]), interpolant(x)
    shares = np.linspace(0.0, 1.0, 41)
    for row in range(len(x)):
        at = one.duration[row] * shares
        np.testing.assert_allclose(other[row].evaluate(at), one[row].evaluate(at), atol=1e-12)
        np.testing.assert_allclose(other[row].evaluate(at, 3), one[row].evaluate(at, 3), rtol=1e-8, atol=1e-8)


def test_any_spline_with_its_knots_is_one_of_its_motions():
    """Free control points are as many as what is held and passed leaves: their effects are independent."""
    for shape in SHAPES:
        interpolant, (degree, count, knots, ends) = made(shape), shape
        x = drawn(interpolant, count=1)
        times = 4 * (count + 2) if knots == "free" else 4
        free = (x.shape[1] - times) // 3
        assert free == 4 * (count + 1) + degree - 2 * (HELD.index(ends) + 1) - 3
        moves = [interpolant(x + e).coefficients - interpolant(x).coefficients for e in np.eye(x.shape[1])[times:]]
        flat = np.stack([move.ravel() / np.linalg.norm(move) for move in moves])
        assert np.linalg.svd(flat, compute_uv=False).min() > 1e-4


@pytest.mark.thinned(3)
@pytest.mark.parametrize("shape", SHAPES)
def test_complex_steps_agree_with_differences(shape):
    interpolant = made(shape)
    x, h = drawn(interpolant, count=2), 1e-6
    at = np.array([0.1, 0.35, 0.8])
    for column in range(x.shape[1]):
        move = np.zeros(x.shape[1])
        move[column] = 1.0
        exact = interpolant(x + 1e-20j * move).at_shares(at, 1).imag / 1e-20
        above, below = (interpolant(x + sign * h * move).at_shares(at, 1) for sign in (1.0, -1.0))
        np.testing.assert_allclose(exact, (above - below) / (2.0 * h), rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("shape", SHAPES)
def test_alone_and_among_others_to_the_bit(shape):
    interpolant = made(shape)
    x = drawn(interpolant, count=7)
    together = interpolant(x)
    for row in range(len(x)):
        np.testing.assert_array_equal(interpolant(x[row : row + 1]).coefficients[0], together.coefficients[row])


@pytest.mark.parametrize(
    "shape", [(3, 3, "even", "acceleration"), (5, 2, "free", "acceleration"), (7, 2, "even", "jerk")]
)
def test_with_velocities_and_rests_all_derivatives_stay_continuous(shape):
    velocity = np.array([0.3, -0.2, 0.5])
    ends = {"start_velocity": velocity, "start_acceleration": 2.0 * velocity, "end_velocity": -velocity}
    interpolant = made(shape, velocities={2: velocity}, at_rest=[(1, 2)], **ends)
    x = drawn(interpolant)
    motion, via = interpolant(x), interpolant.via_times(x)
    np.testing.assert_allclose(motion.evaluate(via), np.broadcast_to(POINTS.positions, (len(x), 5, 3)), atol=1e-12)
    at = motion.evaluate(via, 1)
    np.testing.assert_array_equal(at[:, 2], np.tile(velocity, (len(x), 1)))
    np.testing.assert_array_equal(at[:, 1, 2], 0.0)
    np.testing.assert_array_equal(at[:, 0], np.tile(velocity, (len(x), 1)))
    np.testing.assert_allclose(at[:, 4], np.tile(-velocity, (len(x), 1)), atol=1e-9)
    np.testing.assert_array_equal(motion.evaluate(via[:, :1], 2)[:, 0], np.tile(2.0 * velocity, (len(x), 1)))
    for order in range(shape[0]):
        size = np.abs(motion.at_shares(np.linspace(0.0, 1.0, 9), order)).max()
        assert np.abs(motion.jump(order)).max() < 1e-9 * size


def test_with_stops_dwells_and_a_duration_for_each_gap():
    passing = passings_of((Passing(1, stop=True), Passing(3, dwell=0.4)), 5, ("a", "b", "c"))
    bounds = [[0.4, 2.0], [0.7, 0.7], [0.5, 2.0], [0.6, 0.6]]
    interpolant = interpolant_through("bspline", POINTS, duration_bounds=bounds, passing=passing)
    names = [one.name for one in interpolant.variables]
    assert len(set(names)) == len(names)
    assert [one for one in names if one.startswith("dt")] == ["dt_1", "dt_3"]
    x = drawn(interpolant)
    motion, via = interpolant(x), interpolant.via_times(x)
    np.testing.assert_allclose(np.diff(via, axis=1)[:, 1], 0.7)
    np.testing.assert_allclose(motion.evaluate(via), np.broadcast_to(POINTS.positions, (len(x), 5, 3)), atol=1e-12)
    for point in (1, 3):
        assert np.abs(motion.evaluate(via[:, [point]], 1)).max() < 1e-9


def test_pieces_take_as_much_of_their_gap_as_their_weights_say():
    interpolant = made((5, 1, "free", "acceleration"))
    x = drawn(interpolant)
    x[:, 4:12] = np.tile([0.1, 0.3], 4)
    parts = np.diff(interpolant(x).breaks, axis=1).reshape(len(x), 4, 2)
    np.testing.assert_allclose(parts, x[:, :4, None] * np.array([0.25, 0.75]), rtol=1e-12)
    x[2, 7] = 0.0
    refused(lambda: interpolant(x), "x: expected positive weights, got 0.0 for piece 4 of row 2")


def test_names_and_widths_of_variables():
    interpolant = made((5, 1, "free", "acceleration"), joints=("a", "b"), units=("rad", "m"))
    names = [one.name for one in interpolant.variables]
    assert names[:4] == [f"dt_{k}" for k in range(1, 5)]
    assert names[4:12] == [f"weight of piece_{k}" for k in range(1, 9)]
    assert names[12:] == [f"{joint} of control point_{k}" for joint in "ab" for k in range(1, 5)]
    widths = [one.upper for one in interpolant.variables][12:]
    np.testing.assert_allclose(widths, np.repeat(0.25 * np.ptp(POINTS.positions[:, :2], axis=0), 4))


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"degree": 4}, "degree: expected 3, 5, 7, got 4"),
        ({"degree": "5"}, "degree: expected 3, 5, 7, got '5'"),
        (
            {"control_points": 1},
            "control_points: expected 2 to 30 in every gap with degree 3",
        ),
        ({"degree": 5, "control_points": 31}, "control_points: expected 1 to 30 in every gap"),
        ({"control_points": 2.0}, "control_points: expected a whole number, got 2.0"),
        ({"degree": 5, "control_points": 1, "ends": "jerk"}, "control_points: expected 2 to 30 in every gap"),
        ({"knots": "uneven"}, "unknown knots 'uneven'; known: even, free"),
        ({"ends": "snap"}, "unknown ends 'snap'; known: acceleration, jerk, position, velocity"),
        ({"degree": 3, "ends": "jerk"}, "ends: a B-spline of degree 3 cannot hold its jerk; degree 5 and 7 can"),
        ({"half_width": [0.1, -0.1, 0.1]}, "half_width: expected numbers from 0 on"),
        ({"joints": ("a",), "units": ("rad", "m")}, "joints: expected as many names as units, at most 3, got 1 and 2"),
        (
            {"ends": "position", "start_velocity": [1.0, 0.0, 0.0]},
            "start_velocity: expected none, as ends = 'position'",
        ),
        (
            {"degree": 5, "control_points": 1, "at_rest": [(1, 0)]},
            "control_points: expected at least 2 in a gap where a velocity",
        ),
    ],
)
def test_refusals(given, told):
    refused(lambda: BSpline(POINTS, duration_bounds=BOUNDS, **given), told)
