"""Free points between via points: the same spline where they stay, a clamped B-spline where they move."""

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from tests.helpers import refused
from trajevo import Passing, ViaPoints
from trajevo.path.passing import passings_of
from trajevo.trajectory.interpolants import THROUGH_POINTS, ExtraPoints, interpolant_through

BOUNDS = (0.1, 20.0)
JOINTS, UNITS = ("a", "b", "c"), ("rad", "m", "rad")
POINTS = ViaPoints(np.random.default_rng(3).normal(size=(5, 3)))
#: Interpolants that take free points: degree, and order up to which derivatives vanish at both ends.
TAKES = {"quintic_spline": (5, 2), "septic_spline": (7, 3), "cubic": (3, 2)}


def extra(count):
    return ExtraPoints(count, [0.3, 0.2, 0.4], JOINTS, UNITS)


def made(name, count, points=POINTS, passing=(), bounds=BOUNDS, **more):
    passing = passings_of(passing, len(points), JOINTS)
    free = {"extra": extra(count)} if count else {}
    return interpolant_through(name, points, duration_bounds=bounds, passing=passing, **free, **more)


def drawn(interpolant, count=6, seed=0):
    """Decision vectors with times of 0.4 to 1.5 s and all else within its bounds."""
    generator, own = np.random.default_rng(seed), interpolant.variables
    low, high = np.array([(0.4, 1.5) if one.unit == "s" else (one.lower, one.upper) for one in own]).T
    return generator.uniform(low, high, (count, len(own)))


@pytest.mark.parametrize("name", TAKES)
@pytest.mark.parametrize("count", [1, 3])
def test_passes_the_points_smoothly_and_ends_at_rest(name, count):
    interpolant, (degree, at_rest) = made(name, count), TAKES[name]
    x = drawn(interpolant)
    motion, via = interpolant(x), interpolant.via_times(x)
    np.testing.assert_allclose(motion.evaluate(via), np.broadcast_to(POINTS.positions, (len(x), 5, 3)), atol=1e-12)
    shares, ends = np.linspace(0.0, 1.0, 9), np.stack([np.zeros(len(x)), motion.duration], axis=1)
    for order in range(degree):
        size = np.abs(motion.at_shares(shares, order)).max()
        assert np.abs(motion.jump(order)).max() < 1e-9 * size
        if 0 < order <= at_rest:
            assert np.abs(motion.evaluate(ends, order)).max() < 1e-9 * size
    assert np.abs(motion.jump(degree)).max() > 1e-3


@pytest.mark.parametrize("name", TAKES)
def test_without_offsets_it_is_the_spline_itself(name):
    plain, free = made(name, 0), made(name, 2)
    x, count = drawn(free), len(plain.variables)
    x[:, count + 2 * 4 :] = 0.0
    one, other = plain(x[:, :count]), free(x)
    shares = np.linspace(0.0, 1.0, 41)
    for row in range(len(x)):
        at = one.duration[row] * shares
        np.testing.assert_allclose(other[row].evaluate(at), one[row].evaluate(at), atol=1e-11)
        np.testing.assert_allclose(other[row].evaluate(at, 2), one[row].evaluate(at, 2), rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize("name", ["quintic_spline", "septic_spline"])
def test_it_is_the_clamped_b_spline_of_scipy(name):
    """With the breaks as knots, through all knots, at rest up to half its degree at both ends."""
    interpolant, degree = made(name, 2), TAKES[name][0]
    motion = interpolant(drawn(interpolant, count=2))
    still = [(order, np.zeros(3)) for order in range(1, degree // 2 + 1)]
    for row in range(len(motion)):
        t, one = motion.breaks[row], motion[row]
        scipy = make_interp_spline(t, one.evaluate(t)[0], k=degree, bc_type=(still, still), axis=0)
        at = np.linspace(0.0, t[-1], 301)
        np.testing.assert_allclose(one.evaluate(at)[0], scipy(at), atol=1e-9)
        np.testing.assert_allclose(one.evaluate(at, 3)[0], scipy(at, 3), rtol=1e-6, atol=1e-5)


@pytest.mark.parametrize("name", TAKES)
def test_a_free_point_is_where_its_offset_says(name):
    interpolant, plain = made(name, 1), made(name, 0)
    x, times = drawn(interpolant, count=1), len(plain.variables)
    motion, without = interpolant(x), plain(x[:, :times])
    offsets = x[:, times + 4 :].reshape(3, 4).T
    instants = motion.breaks[0, np.isin(motion.breaks[0].round(9), interpolant.via_times(x)[0].round(9), invert=True)]
    at = instants if name != "cubic" else np.delete(instants, [0, -1])  # those of the virtual knots
    np.testing.assert_allclose(motion.evaluate(at)[0] - without.evaluate(at)[0], offsets, atol=1e-11)


@pytest.mark.parametrize("name", TAKES)
def test_complex_steps_agree_with_differences(name):
    interpolant = made(name, 2)
    x, h = drawn(interpolant, count=2), 1e-6
    at = np.array([0.1, 0.35, 0.8])
    for column in range(x.shape[1]):
        move = np.zeros(x.shape[1])
        move[column] = 1.0
        exact = interpolant(x + 1e-20j * move).at_shares(at, 1).imag / 1e-20
        above, below = (interpolant(x + sign * h * move).at_shares(at, 1) for sign in (1.0, -1.0))
        np.testing.assert_allclose(exact, (above - below) / (2.0 * h), rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("name", TAKES)
def test_alone_and_among_others_to_the_bit(name):
    interpolant = made(name, 2)
    x = drawn(interpolant, count=7)
    together = interpolant(x)
    for row in range(len(x)):
        np.testing.assert_array_equal(interpolant(x[row : row + 1]).coefficients[0], together.coefficients[row])


@pytest.mark.parametrize("name", ["quintic_spline", "septic_spline"])
def test_with_stops_dwells_and_a_duration_for_each_gap(name):
    passing = (Passing(1, stop=True), Passing(3, dwell=0.4))
    bounds = [[0.4, 2.0], [0.7, 0.7], [0.5, 2.0], [0.6, 0.6]]
    interpolant = made(name, 1, passing=passing, bounds=bounds)
    names = [one.name for one in interpolant.variables]
    assert len(set(names)) == len(names) == 2 + 4 + 12
    assert [one for one in names if one.startswith("dt")] == ["dt_1", "dt_3"]
    assert [one for one in names if one.startswith("share")] == [f"share of knot_{k}" for k in range(1, 5)]
    x = drawn(interpolant)
    motion, via = interpolant(x), interpolant.via_times(x)
    np.testing.assert_allclose(np.diff(via, axis=1)[:, 1], 0.7)
    np.testing.assert_allclose(motion.evaluate(via), np.broadcast_to(POINTS.positions, (len(x), 5, 3)), atol=1e-12)
    for point in (1, 3):
        assert np.abs(motion.evaluate(via[:, [point]], 1)).max() < 1e-9
    np.testing.assert_allclose(motion.evaluate(via[:, [3]] + 0.3)[:, 0], np.tile(POINTS.positions[3], (len(x), 1)))


@pytest.mark.parametrize("name", TAKES)
def test_with_velocities_and_rests(name):
    velocity = [0.3, -0.2, 0.5]
    passing = (Passing(0, velocity=velocity), Passing(2, velocity=velocity))
    interpolant = made(name, 1, passing=passing, at_rest=[(1, 2)])
    x = drawn(interpolant)
    motion, via = interpolant(x), interpolant.via_times(x)
    np.testing.assert_allclose(motion.evaluate(via[:, [0, 2]], 1), np.broadcast_to(velocity, (len(x), 2, 3)), atol=1e-9)
    assert np.abs(motion.evaluate(via[:, [1]], 1)[..., 2]).max() < 1e-12


@pytest.mark.parametrize("name", ["quintic_spline", "septic_spline"])
def test_a_cycle_goes_through_its_seam(name):
    points = ViaPoints(np.vstack([POINTS.positions, POINTS.positions[:1]]))
    interpolant = made(name, 2, points=points, cyclic=True)
    motion = interpolant(drawn(interpolant))
    ends = np.stack([np.zeros(len(motion)), motion.duration], axis=1)
    for order in range(TAKES[name][0]):
        values = motion.evaluate(ends, order)
        assert (
            np.abs(values[:, 0] - values[:, 1]).max()
            < 1e-7 * np.abs(motion.at_shares(np.array([0.0, 0.5]), order)).max()
        )


@pytest.mark.parametrize("name", sorted(set(THROUGH_POINTS) - {*TAKES, "hermite"}))
def test_others_take_none(name):
    refused(
        lambda: made(name, 1), f"extra_points: {name!r} takes none; quintic_spline, septic_spline, cubic and hermite do"
    )


@pytest.mark.parametrize("count", [0, -1, 9, 1.0, True, "2"])
def test_refuses_other_numbers(count):
    refused(lambda: extra(count), f"extra_points: expected a whole number from 1 to 8, got {count!r}")
