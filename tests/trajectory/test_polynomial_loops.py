"""Loops that numba compiles: the same trajectories, samples and extremes as numpy's, to rounding."""

import numpy as np
import pytest

from trajevo.base import jit
from trajevo.path.via_points import ViaPoints
from trajevo.trajectory.interpolants.splines.cubic import CubicSpline
from trajevo.trajectory.polynomial import PolynomialBatch

pytest.importorskip("numba")

DEGREES = (0, 1, 2, 3, 4, 5, 7)


@pytest.fixture
def plain(monkeypatch):
    """As where numba is not installed, when asked for."""
    return lambda: monkeypatch.setattr(jit, "can_compile", lambda: False)


def batch(degree, coefficients=None):
    random = np.random.default_rng(degree)
    steps = random.uniform(0.2, 3.0, (40, 3))
    breaks = np.concatenate([np.zeros((40, 1)), np.cumsum(steps, axis=1)], axis=1)
    drawn = random.normal(size=(40, 3, 2, degree + 1)) if coefficients is None else coefficients
    return PolynomialBatch(breaks, drawn)


def close(found, expected):
    """To rounding of the greatest value of each derivative."""
    for order in range(4):
        within = 1e-12 * np.abs(expected[order]).max()
        np.testing.assert_allclose(found[order], expected[order], rtol=0.0, atol=within)


def states(trajectory, shares):
    return [trajectory.at_shares(shares, order) for order in range(4)]


@pytest.mark.parametrize("degree", DEGREES)
@pytest.mark.parametrize("shares", [np.linspace(0.0, 1.0, 6), np.array([0.0, 1.0]), np.array([0.3])])
def test_samples_are_numpy_s(degree, shares, plain):
    found = states(batch(degree), shares)
    plain()
    close(found, states(batch(degree), shares))


def test_samples_of_other_shares_are_not_those_of_the_last():
    trajectory = batch(3)
    shares = [np.linspace(0.0, 1.0, count) for count in (6, 7, 6)]
    first, other, again = (states(trajectory, share) for share in shares)
    close(again, first)
    close(other, states(batch(3), shares[1]))


def rounded(degree):
    """Whole numbers, of which many are 0: roots that coincide, derivatives that vanish, ends that are stationary."""
    return np.random.default_rng(100 + degree).integers(-2, 3, (40, 3, 2, degree + 1)).astype(np.float64)


@pytest.mark.parametrize("degree", DEGREES)
@pytest.mark.parametrize("draw", [lambda degree: None, rounded, lambda degree: np.zeros((40, 3, 2, degree + 1))])
def test_extremes_are_numpy_s(degree, draw, plain):
    found = batch(degree, draw(degree))
    all_found = [[*found.extremes(order), *found.segment_extremes(order)] for order in range(4)]
    plain()
    expected = batch(degree, draw(degree))
    for order in range(4):
        for one, other in zip(
            all_found[order], [*expected.extremes(order), *expected.segment_extremes(order)], strict=True
        ):
            np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-12 * max(np.abs(other).max(), 1e-300))


@pytest.mark.parametrize("degree", DEGREES)
def test_integrals_of_squares_are_numpy_s(degree, plain):
    found = [batch(degree).integral_of_square(order) for order in range(4)]
    plain()
    close(found, [batch(degree).integral_of_square(order) for order in range(4)])


def stepped(degree):
    """Segments whose durations and coefficients have imaginary parts far below rounding of the real ones."""
    random, real = np.random.default_rng(50 + degree), batch(degree)
    steps, coefficients = (
        values + 1e-20j * random.normal(size=values.shape) for values in (real.segment_durations, real.coefficients)
    )
    breaks = np.concatenate([np.zeros((len(steps), 1)), np.cumsum(steps, axis=1)], axis=1)
    return PolynomialBatch(breaks, coefficients)


def everything(trajectory):
    """What loops give, by what it is: a list of one array for each derivative."""
    orders, shares = range(4), np.linspace(0.0, 1.0, 5)
    return {
        "samples": [trajectory.at_shares(shares, order) for order in orders],
        "squares": [trajectory.integral_of_square(order) for order in orders],
        **{f"bound {k}": [trajectory.extremes(order)[k] for order in orders] for k in (0, 1)},
        **{f"bound of a segment {k}": [trajectory.segment_extremes(order)[k] for order in orders] for k in (0, 1)},
    }


@pytest.mark.parametrize("degree", DEGREES)
def test_derivatives_by_complex_steps_are_numpy_s(degree, plain):
    found = everything(stepped(degree))
    plain()
    for name, expected in everything(stepped(degree)).items():
        assert all(np.iscomplexobj(values) for values in found[name]), name
        for part in (np.real, np.imag):
            close([part(values) for values in found[name]], [part(values) for values in expected])


@pytest.mark.parametrize("degree", [3, 4, 7])
def test_derivatives_of_extremes_are_their_finite_differences(degree):
    trajectory, size = stepped(degree), 1e-6
    moved = [
        PolynomialBatch(*(values.real + side * size * values.imag * 1e20 for values in (t.breaks, t.coefficients)))
        for t, side in ((trajectory, 1.0), (trajectory, -1.0))
    ]
    for order in range(4):
        for found, up, down in zip(*(t.extremes(order) for t in (trajectory, *moved)), strict=True):
            slope = (up - down) / (2.0 * size)
            np.testing.assert_allclose(found.imag * 1e20, slope, rtol=0.0, atol=1e-4 * np.abs(slope).max())


@pytest.mark.parametrize("count", [2, 3, 11])
def test_cubic_splines_are_numpy_s(count, plain):
    random = np.random.default_rng(count)
    ends = {f"{end}_{what}": random.normal(size=3) for end in ("start", "end") for what in ("velocity", "acceleration")}
    spline = CubicSpline(ViaPoints(random.normal(size=(count, 3))), duration_bounds=(0.1, 3.0), **ends)
    x = random.uniform(0.1, 3.0, (50, count + 1))
    found = spline(x)
    strided = spline(np.asfortranarray(x))
    np.testing.assert_array_equal(strided.coefficients, found.coefficients)
    plain()
    expected = spline(x)
    np.testing.assert_array_equal(found.breaks, expected.breaks)
    within = 1e-12 * np.abs(expected.coefficients).max()
    np.testing.assert_allclose(found.coefficients, expected.coefficients, rtol=0.0, atol=within)
