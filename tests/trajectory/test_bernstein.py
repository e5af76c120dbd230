"""Bounds of polynomials: guaranteed, tight, and with exact derivatives."""

import numpy as np
import pytest

from trajevo import TrajevoError
from trajevo.trajectory.bernstein import gauss, greatest_magnitude, least_tolerance, local_greatest

FINE = np.linspace(0.0, 1.0, 5001)


def polynomials(count, size, seed=0):
    """Legendre coefficients of random polynomials, and their values at the nodes, each (count, size)."""
    coefficients = np.random.default_rng(seed).normal(size=(count, size)) / (1.0 + np.arange(size)) ** 1.5
    return coefficients, at(coefficients, gauss(size)[0])


def at(coefficients, u):
    return coefficients @ np.polynomial.legendre.legvander(2.0 * np.asarray(u) - 1.0, coefficients.shape[1] - 1).T


@pytest.mark.thinned(4)
@pytest.mark.parametrize("size", [1, 2, 3, 5, 15, 25, 35])
@pytest.mark.parametrize("tolerance", [1e-8, 1e-6, 1e-2])
def test_no_value_exceeds_the_bound_and_the_bound_is_tight(size, tolerance):
    coefficients, values = polynomials(60, size)
    bound = greatest_magnitude(values.reshape(12, 5, size), tolerance)
    sampled = np.abs(at(coefficients, FINE)).max(axis=1).reshape(12, 5).max(axis=1)
    assert (bound >= sampled).all()
    assert (bound <= sampled * (1.0 + tolerance) + 1e-4 * sampled).all()


def test_peaks_between_the_nodes_and_at_the_ends_are_found():
    """Needles that no node sees, at the places where a search that trusts its nodes would miss them."""
    size = 25
    nodes, _ = gauss(size)
    for place in [0.0, 1.0, *(0.5 * (nodes[1:] + nodes[:-1]))]:
        coefficients = np.linalg.solve(
            np.polynomial.legendre.legvander(2.0 * nodes - 1.0, size - 1), np.exp(-(((nodes - place) / 0.02) ** 2))
        )[None]
        sampled = np.abs(at(coefficients, FINE)).max()
        bound = greatest_magnitude(at(coefficients, nodes)[None], 1e-6)
        assert bound[0] >= sampled
        assert bound[0] <= sampled * (1.0 + 1e-3)


def test_a_tolerance_below_rounding_is_refused():
    _, values = polynomials(2, 15)
    with pytest.raises(TrajevoError, match="tolerance: 0 cannot be proven for polynomials of degree 14"):
        greatest_magnitude(values[None], 0.0)
    for size in (15, 25, 35, 50):
        _, values = polynomials(20, size)
        greatest_magnitude(values.reshape(4, 5, size), least_tolerance(size))


def test_a_group_of_zeros_is_bounded_by_zero():
    assert greatest_magnitude(np.zeros((2, 3, 25)), 1e-6).tolist() == [0.0, 0.0]


def test_constants_are_their_own_bound():
    bound = greatest_magnitude(np.full((1, 2, 25), -3.0), 1e-6)
    np.testing.assert_allclose(bound, 3.0 * (1.0 + 1e-6), rtol=1e-12)


@pytest.mark.parametrize("size", [5, 15, 25])
def test_an_imaginary_part_is_the_derivative_of_the_bound(size):
    _, values = polynomials(40, size, seed=1)
    _, slopes = polynomials(40, size, seed=2)
    step, h = 1e-20, 1e-6
    stepped = greatest_magnitude((values + 1j * step * slopes).reshape(8, 5, size), 1e-6)
    above, below = (greatest_magnitude((values + s * h * slopes).reshape(8, 5, size), 1e-6) for s in (1.0, -1.0))
    np.testing.assert_allclose(stepped.real, greatest_magnitude(values.reshape(8, 5, size), 1e-6), rtol=1e-14)
    np.testing.assert_allclose(stepped.imag / step, (above - below) / (2.0 * h), rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("size", [5, 15, 25])
def test_local_extremes_are_values_of_the_group(size):
    coefficients, values = polynomials(40, size, seed=3)
    groups = np.random.default_rng(0).permutation(np.repeat(np.arange(8), 5))
    found = local_greatest(values, groups)
    for group in range(8):
        sampled = at(coefficients[groups == group], FINE).max()
        assert found[group] == pytest.approx(sampled, rel=1e-5, abs=1e-6)


def test_summits_of_rows_that_share_their_real_parts_are_those_of_each_alone():
    random = np.random.default_rng(6)
    real = np.repeat(random.normal(size=(30, 9)), 4, axis=0)[random.permutation(120)]
    values, groups = real + 1e-20j * random.normal(size=real.shape), np.arange(120)
    alone = np.concatenate([local_greatest(row[None], np.zeros(1, dtype=np.intp)) for row in values])
    np.testing.assert_array_equal(local_greatest(values, groups), alone)
    np.testing.assert_allclose(alone.real, local_greatest(real, groups), rtol=1e-14)
