"""Joints at rest at inner points: their velocity is 0 there for all times, and nothing else is lost than told."""

import math

import numpy as np
import pytest

from tests.helpers import refused
from trajevo import ViaPoints
from trajevo.trajectory.interpolants import (
    THROUGH_POINTS,
    CubicSpline,
    HybridQuartic,
    ImprovedQuarticBSpline,
    QuinticSpline,
    SepticSpline,
    price_of_rest,
)

BOUNDS = (0.1, 20.0)
POINTS = ViaPoints(np.random.default_rng(7).normal(size=(6, 4)))
#: The first joint rests twice in a row, the second once, the fourth at the first and the last inner point.
AT_REST = ((1, 0), (2, 0), (4, 1), (1, 3), (4, 3))

#: Interpolant, the order up to which derivatives stay continuous, and up to which the ends are at rest.
FAMILIES = {
    "quintic_spline": (QuinticSpline, 3, 2),
    "septic_spline": (SepticSpline, 5, 3),
    "cubic": (CubicSpline, 2, 2),
    "hybrid": (HybridQuartic, 3, 3),
    "improved_quartic_bspline": (ImprovedQuarticBSpline, 3, 3),
}


@pytest.fixture(params=FAMILIES)
def family(request):
    make, continuous, ends = FAMILIES[request.param]
    return make(POINTS, duration_bounds=BOUNDS, at_rest=AT_REST), continuous, ends


def terms(motion, order):
    """Rounding of the greatest sum of the terms of a polynomial's derivative: terms of 1e5 may cancel to 1."""
    powers = np.arange(motion.coefficients.shape[-1])
    factors = np.array([math.perm(k, order) for k in powers])
    spans = motion.segment_durations[:, :, None, None] ** np.maximum(powers - order, 0)
    return np.finfo(float).eps * (np.abs(motion.coefficients) * factors * spans).sum(axis=-1).max(axis=(1, 2))


def drawn(interpolant, count=30):
    return np.random.default_rng(3).uniform(0.5, 5.0, (count, len(interpolant.variables)))


def test_every_point_is_passed_and_the_joints_rest(family):
    interpolant, _, _ = family
    x = drawn(interpolant)
    motion, times = interpolant(x), interpolant.via_times(x)
    np.testing.assert_allclose(motion.evaluate(times), np.broadcast_to(POINTS.positions, (len(x), 6, 4)), atol=1e-11)
    speeds = motion.evaluate(times, 1)
    for point, joint in AT_REST:
        assert np.abs(speeds[:, point, joint]).max() < 1e-12
    assert np.abs(speeds[:, 2, 2]).min() > 1e-4, "a joint rests where it was not asked to"


def test_segments_begin_at_the_points_with_velocity_zero(family):
    interpolant, _, _ = family
    x = drawn(interpolant)
    motion = interpolant(x)
    begins = np.abs(motion.breaks[:, :-1, None] - interpolant.via_times(x)[:, None, :-1]).argmin(axis=1)
    for point, joint in AT_REST:
        first = motion.coefficients[np.arange(len(x)), begins[:, point], joint]
        assert np.abs(first[:, 0] - POINTS.positions[point, joint]).max() < 1e-15
        assert np.abs(first[:, 1]).max() < 1e-15


def test_derivatives_stay_continuous_as_far_as_told(family):
    interpolant, continuous, ends = family
    motion = interpolant(drawn(interpolant))
    for order in range(continuous + 1):
        scale = max(1.0, float(np.abs(motion.at_shares(np.array([0.0]), order)).max()))
        jumps = np.abs(motion.jump(order)).max(axis=(1, 2))
        assert (jumps < 1e-11 * scale + 4.0 * terms(motion, order)).all(), f"derivative {order} jumps"
    both = np.stack([np.zeros(len(motion)), motion.duration], axis=1)
    for order in range(1, ends + 1):
        assert np.abs(motion.evaluate(both, order)).max() < 1e-9


def test_other_joints_move_as_without_rests(family):
    interpolant, _, _ = family
    x, shares = drawn(interpolant), np.linspace(0.0, 1.0, 50)
    free = type(interpolant)(POINTS, duration_bounds=BOUNDS)
    t = interpolant(x).duration[:, None] * shares
    for order in range(4):
        found, expected = (made(x).evaluate(t, order)[..., 2] for made in (interpolant, free))
        np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("name", FAMILIES)
def test_no_rests_are_the_interpolant_itself_to_the_bit(name):
    make = FAMILIES[name][0]
    plain, told = make(POINTS, duration_bounds=BOUNDS), make(POINTS, duration_bounds=BOUNDS, at_rest=())
    x = drawn(plain)
    np.testing.assert_array_equal(plain(x).coefficients, told(x).coefficients)


def test_derivatives_by_times_are_exact(family):
    interpolant, _, _ = family
    x, step, small = drawn(interpolant, 4), 1e-6, 1e-20
    for column in range(x.shape[1]):
        along = np.zeros_like(x)
        along[:, column] = 1.0
        exact = interpolant(x + 1j * small * along).integral_of_square(2).imag / small
        ahead, behind = (interpolant(x + sign * step * along).integral_of_square(2) for sign in (1.0, -1.0))
        np.testing.assert_allclose(exact, (ahead - behind) / (2.0 * step), rtol=1e-5, atol=1e-5 * np.abs(exact).max())


def test_a_row_does_not_depend_on_the_others(family):
    interpolant, _, _ = family
    x = drawn(interpolant)
    np.testing.assert_array_equal(interpolant(x[3:4]).coefficients[0], interpolant(x).coefficients[3])


def test_a_joint_that_turns_at_its_rest_stays_on_one_side():
    """Between two lower neighbours the resting joint has its maximum at the point, but for rounding."""
    points = ViaPoints(np.array([[0.0], [1.0], [0.2]]))
    for make, *_ in FAMILIES.values():
        interpolant = make(points, duration_bounds=BOUNDS, at_rest=[(1, 0)])
        x = np.random.default_rng(0).uniform(0.9, 1.1, (200, len(interpolant.variables)))
        greatest = interpolant(x).extremes(0)[1]
        assert (np.abs(greatest - 1.0) < 2e-13).all(), make.__name__


def test_which_interpolants_take_rests_is_told():
    """Those which have other variables than times are tested by themselves."""
    assert {name for name in THROUGH_POINTS if price_of_rest(name) is not None} == {*FAMILIES, "bspline", "hermite"}


@pytest.mark.parametrize(
    ("at_rest", "message"),
    [
        ([(0, 0)], "expected inner points, 1 to 4, got point 0"),
        ([(5, 0)], "expected inner points, 1 to 4, got point 5"),
        ([(1, 4)], "expected joints 0 to 3, got joint 4"),
        ([(1, -1)], "expected joints 0 to 3, got joint -1"),
        ([(1.0, 0.0)], "expected pairs"),
        ([1, 2], "expected pairs"),
        ([(1, 2), (1,)], "expected pairs"),
        (3, "expected pairs"),
        ("12", "expected pairs"),
        (None, "expected pairs"),
    ],
)
def test_rests_that_do_not_exist_are_refused(family, at_rest, message):
    interpolant, _, _ = family
    refused(lambda: type(interpolant)(POINTS, duration_bounds=BOUNDS, at_rest=at_rest), message)
