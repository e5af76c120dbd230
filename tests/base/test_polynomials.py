import numpy as np
import pytest

from tests.reference import extremes_by_roots
from trajevo.base import polynomials


def cases() -> list[np.ndarray]:
    rng = np.random.default_rng(3)
    random = [rng.normal(size=8) for _ in range(150)]
    wiggly = [np.polynomial.Chebyshev.basis(7, domain=[0, 1]).convert(kind=np.polynomial.Polynomial).coef]
    low_degree = [np.pad(rng.normal(size=k), (0, 8 - k)) for k in range(1, 8)]
    double_root = [np.polynomial.Polynomial.fromroots([0.3, 0.3, 0.7, 0.7, 0.7, 1.5]).integ().coef]
    huge_and_tiny = [1e9 * rng.normal(size=8), 1e-9 * rng.normal(size=8), np.zeros(8)]
    return random + wiggly + low_degree + double_root + huge_and_tiny


def test_extremes_equal_those_at_the_roots_of_the_next_derivative():
    coefficients = np.stack(cases(), axis=1)
    lower, upper = polynomials.extremes(coefficients, 4)
    for m, column in enumerate(coefficients.T):
        for order in range(4):
            low, high = extremes_by_roots(column, order)
            scale = max(abs(low), abs(high), 1e-300)
            assert lower[order, m] == pytest.approx(low, abs=1e-11 * scale)
            assert upper[order, m] == pytest.approx(high, abs=1e-11 * scale)


def test_extremes_bound_every_sample_and_are_reached():
    coefficients = np.random.default_rng(0).normal(size=(8, 400))
    lower, upper = polynomials.extremes(coefficients, 4)
    u = np.linspace(0.0, 1.0, 4001)[:, None]
    for order in range(4):
        samples = polynomials.values(polynomials.derivative(coefficients, order), u)
        scale = np.abs(samples).max(axis=0)
        assert (samples.min(axis=0) >= lower[order] - 1e-12 * scale).all()
        assert (samples.max(axis=0) <= upper[order] + 1e-12 * scale).all()
        assert (samples.max(axis=0) >= upper[order] - 1e-4 * scale).all()


def test_a_peak_between_samples_is_found():
    # Two nearly equal dips: coarse samples would pick the wrong one, and miss the value of either.
    curve = np.polynomial.Polynomial.fromroots([0.2062, 0.2062, 0.7937, 0.7937]) + 1e-7 * np.polynomial.Polynomial(
        [0, 1]
    )
    lower, _ = polynomials.extremes(curve.coef[:, None], 1)
    assert lower[0, 0] == pytest.approx(extremes_by_roots(curve.coef, 0)[0], rel=1e-9)
    assert curve(np.linspace(0.0, 1.0, 81)).min() > 10.0 * lower[0, 0]


def test_derivative_past_the_degree_is_zero():
    assert polynomials.derivative(np.ones((3, 2)), 5).tolist() == [[0.0, 0.0]]


def test_extremes_near_cubics_are_those_of_the_polynomials():
    """Of quintics with the values, slopes and second derivatives of waves at both ends, a third of a wave long."""
    phase = np.linspace(0.0, 2.0 * np.pi, 60)
    start, end = ((np.sin(p), 2.0 * np.cos(p), -4.0 * np.sin(p)) for p in (phase, phase + 2.0))
    quintics, cubics = polynomials.quintic(start, end), polynomials.cubic(*start[:2], *end[:2])
    for order, (at_start, at_end) in enumerate(zip(start, end, strict=True)):
        slopes = polynomials.derivative(quintics, order)
        np.testing.assert_allclose(polynomials.values(slopes, np.zeros(1)), at_start, atol=1e-12)
        np.testing.assert_allclose(polynomials.values(slopes, np.ones(1)), at_end, atol=1e-12)
    found, (lower, upper) = polynomials.extremes_near_cubics(quintics, cubics), polynomials.extremes(quintics, 1)
    np.testing.assert_allclose(found.max(axis=0), upper[0], atol=1e-5)
    np.testing.assert_allclose(found.min(axis=0), lower[0], atol=1e-5)
    assert (found <= upper[0] + 1e-14).all()
    assert (found >= lower[0] - 1e-14).all()
