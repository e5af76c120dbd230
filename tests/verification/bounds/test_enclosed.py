"""Enclosures hold everything that random points of their boxes give, and say so where nothing is known."""

import numpy as np
import pytest

from trajevo.path.via_points import ViaPoints
from trajevo.trajectory.interpolants import (
    HybridQuartic,
    ImprovedQuarticBSpline,
    QuinticSpline,
    SepticSpline,
    SinglePolynomial,
)
from trajevo.verification.bounds.enclosed import Enclosed, stacked
from trajevo.verification.bounds.pieces import Times
from trajevo.verification.bounds.shapes import shape_of

KINDS = {
    "smooth": lambda points: HybridQuartic(points, form="smooth", duration_bounds=(1.0, 9.0)),
    "printed": lambda points: HybridQuartic(points, form="printed", duration_bounds=(1.0, 9.0)),
    "b-spline": lambda points: ImprovedQuarticBSpline(points, duration_bounds=(1.0, 9.0)),
    "quintic": lambda points: QuinticSpline(points, duration_bounds=(1.0, 9.0)),
    "septic": lambda points: SepticSpline(points, duration_bounds=(1.0, 9.0)),
    "polynomial": lambda points: SinglePolynomial(points, duration_bounds=(1.0, 9.0)),
}


#: Kinds whose coefficients are enclosed; splines are near others, which test_cells.py covers.
ENCLOSED = [kind for kind in KINDS if kind not in ("quintic", "septic")]


def at(points, degree=None):
    """Logarithms of ratios as boxes that are points."""
    return Times(points, points, points=True, degree=degree)


def expression(times):
    """Sums, products and powers of segment times, (B, 2)."""
    a, b, c = (times.product({k: 1.0, 1: -0.5}) for k in range(3))
    over = (a * times.total + b * c).to_power(-1.0)
    first = (a.to_power(2.0) * times.total - b.times(0.3) * times.share_of_others(1)) * over
    return stacked([first, (b * c + a.to_power(0.5)) * over])


@pytest.mark.parametrize("width", [1e-3, 0.02, 0.1])
def test_values_and_slopes_of_random_points_are_inside(width):
    rng = np.random.default_rng(1)
    middle = rng.uniform(-0.5, 0.5, (200, 2))
    found = expression(Times(middle - width, middle + width))
    assert np.isfinite(found.radius).all()
    for _ in range(5):
        points = middle + rng.uniform(-width, width, middle.shape)
        value = expression(at(points)).middle[0]
        assert (np.abs(value - found.over_box[0]) <= found.over_box[1] + 1e-13).all()
        assert (value >= found.low - 1e-13).all()
        for k in range(2):
            step = 1e-6 * np.eye(2)[k]
            slope = (expression(at(points + step)).middle[0] - expression(at(points - step)).middle[0]) / 2e-6
            assert (np.abs(slope - found.slopes_over_box[0][k]) <= found.slopes_over_box[1][k] + 1e-8).all()


def test_what_is_lost_falls_with_the_square_of_the_width():
    middle = np.array([[0.3, -0.2]])
    lost = []
    for width in (0.02, 0.01):
        corners = middle + width * np.array([[i, j] for i in np.linspace(-1, 1, 41) for j in np.linspace(-1, 1, 41)])
        least = expression(at(corners)).middle[0].min(axis=0)
        lost.append(least - expression(Times(middle - width, middle + width)).low[0])
    assert (lost[1] < lost[0] / 4.0).all()


def test_a_power_of_what_may_be_zero_is_not_known():
    times = Times(np.full((1, 1), -0.2), np.full((1, 1), 0.2))
    assert np.isnan((times.known(1.0) - times.product({1: 1.0})).to_power(0.5).low).all()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("count", [3, 4, 6])
def test_pieces_are_those_of_the_interpolant(kind, count):
    if (kind, count) == ("printed", 3):
        pytest.skip("the printed form needs 4 points")
    rng = np.random.default_rng(count)
    interpolant = KINDS[kind](ViaPoints(rng.uniform(-1.0, 1.0, (count, 2))))
    ratios = rng.uniform(-0.5, 0.5, (20, count - 2))
    shape = shape_of(interpolant)
    pieces = shape(at(ratios, shape.degree))
    x = np.exp(np.concatenate([np.zeros((20, 1)), np.cumsum(ratios, axis=1)], axis=1))
    own, rates = interpolant(x), pieces.rates.middle[0]
    motion = own.sample(9)
    start = np.concatenate([np.zeros((20, 1)), np.cumsum(1.0 / rates, axis=1)], axis=1)
    for k, t in enumerate(motion.t.T):
        piece = np.minimum((t[:, None] >= start[:, 1:] - 1e-12).sum(axis=1), rates.shape[1] - 1)
        rows = np.arange(20)
        share = (t - start[rows, piece]) * rates[rows, piece]
        value = np.einsum(
            "bjk,bk->bj",
            pieces.coefficients.middle[0][rows, piece],
            share[:, None] ** np.arange(pieces.coefficients.middle.shape[-1]),
        )
        np.testing.assert_allclose(value, motion.q[:, k], atol=1e-7)


@pytest.mark.parametrize("kind", ENCLOSED)
def test_coefficients_of_random_motions_are_inside(kind):
    rng = np.random.default_rng(3)
    shape = shape_of(KINDS[kind](ViaPoints(rng.uniform(-1.0, 1.0, (5, 2)))))
    width, middle = 0.01, rng.uniform(-0.4, 0.4, (100, 3))
    found = shape(Times(middle - width, middle + width)).coefficients
    known = np.isfinite(found.over_box[1])
    assert known.mean() > 0.9
    other = shape(at(middle + rng.uniform(-width, width, middle.shape))).coefficients
    inside = np.abs(other.middle[0] - found.over_box[0]) <= found.over_box[1] + other.radius[0]
    assert inside[known].all()


def test_a_known_array_does_not_depend_on_the_variables():
    one = Enclosed.known(np.ones((2, 3)), np.full((2, 2), 0.1))
    assert one.middle.shape == (6, 2, 3)
    assert (one.slopes_over_box[0] == 0.0).all()
