"""Bounds of cells: no motion of a cell is below them, by samples, by dense grids and by SciPy's splines."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from trajevo import ViaPointProblem
from trajevo.problems import PointingMechanism
from trajevo.problems.puma_kinematics import TABLE_1_JOINTS
from trajevo.verification.bounds.cells import coarse_cells, fine_cells
from trajevo.verification.bounds.question import Question

ALL = ("time", "acceleration", "jerk", "square_acceleration", "square_jerk", "peak_acceleration", "peak_jerk")
POINTS = [[0.2, 0.1], [0.0, 0.3], [-0.2, 0.0], [0.1, -0.1]]


def question(interpolant, **given):
    return Question.of(
        ViaPointProblem(
            robot="pointing_mechanism",
            points=POINTS,
            duration_bounds=(1.0, 10.0),
            interpolant=interpolant,
            objectives=ALL,
            **given,
        )
    )


@pytest.mark.parametrize(
    "interpolant", ["hybrid", "improved_quartic_bspline", "quintic_spline", "septic_spline", "polynomial"]
)
@pytest.mark.parametrize("width", [0.003, 0.05, 0.5])
def test_no_random_motion_of_a_cell_is_below_its_bounds(interpolant, width):
    asked, rng = question(interpolant), np.random.default_rng(7)
    middle = rng.uniform(-1.0, 1.0, (60, 2))
    coarse = coarse_cells(asked, middle - width, middle + width)
    fine = fine_cells(asked, coarse_cells(asked, middle - width, middle + width))
    assert (fine.constants >= coarse.constants).all()
    for _ in range(10):
        constants, least, most, _ = asked.at_points(middle + rng.uniform(-width, width, middle.shape))
        assert (constants >= fine.constants).all()
        assert (least >= fine.least).all()
        assert (most <= fine.most).all()


def test_no_random_quintic_spline_is_below_the_bounds_of_cells_of_any_shape():
    asked, rng = question("quintic_spline"), np.random.default_rng(11)
    middle = rng.uniform(-1.2, 1.2, (400, 2))
    half = rng.choice([0.002, 0.02, 0.06, 0.1], (400, 1)) * rng.uniform(0.2, 1.0, (400, 2))
    cells = fine_cells(asked, coarse_cells(asked, middle - half, middle + half))
    for _ in range(5):
        constants, least, most, _ = asked.at_points(middle + rng.uniform(-half, half))
        assert (constants >= cells.constants).all()
        assert (least >= cells.least).all()
        assert (most <= cells.most).all()


def test_bounds_of_quintic_splines_are_near_the_least_of_cells_that_are_not_narrow():
    asked, rng = question("quintic_spline"), np.random.default_rng(12)
    middle = rng.uniform(-0.5, 0.5, (60, 2))
    cells = fine_cells(asked, coarse_cells(asked, middle - 0.03, middle + 0.03))
    corners = [asked.at_points(middle + 0.03 * np.array([i, j]))[0] for i in (-1, 0, 1) for j in (-1, 0, 1)]
    shares = cells.constants / np.min(corners, axis=0)
    assert np.median(shares[:, : ALL.index("square_jerk") + 1], axis=0).min() > 0.95


@pytest.mark.parametrize("interpolant", ["hybrid", "quintic_spline", "polynomial"])
def test_bounds_of_narrow_cells_are_near_the_truth(interpolant):
    asked, middle = question(interpolant), np.random.default_rng(8).uniform(-0.5, 0.5, (60, 2))
    cells = fine_cells(asked, coarse_cells(asked, middle - 1e-3, middle + 1e-3))
    constants, least, _, _ = asked.at_points(middle)
    assert np.median(cells.constants / constants, axis=0).min() > 0.97
    assert np.median(cells.least / least) > 0.995


def test_coarse_bounds_at_a_point_are_the_least_of_all_accelerations():
    """The motion with least ∫ a² through points from rest to rest is the clamped cubic spline, here SciPy's."""
    asked, ratios = question("quintic_spline"), np.random.default_rng(9).uniform(-0.7, 0.7, (5, 2))
    found = coarse_cells(asked, ratios, ratios).constants[:, ALL.index("acceleration")]
    for row, bound in zip(ratios, found, strict=True):
        times = np.concatenate([[0.0], np.cumsum(np.exp(np.concatenate([[0.0], np.cumsum(row)])))])
        spline = CubicSpline(times / times[-1], asked.positions, bc_type="clamped")
        nodes, weights = np.polynomial.legendre.leggauss(3)
        square = 0.0
        for a, b in zip(spline.x[:-1], spline.x[1:], strict=True):
            square = square + 0.5 * (b - a) * (weights @ spline(0.5 * (a + b) + 0.5 * (b - a) * nodes, 2) ** 2)
        assert bound == pytest.approx(np.sqrt(square).sum(), rel=1e-7)


def test_the_form_whose_velocity_jumps_has_no_coarse_bound_of_accelerations():
    asked = Question.of(PointingMechanism(interpolant="printed"))
    low = np.full((1, 3), -0.1)
    assert (coarse_cells(asked, low, -low).constants[:, 1:] == 0.0).all()


def test_cells_that_leave_the_range_are_left_out_and_no_others():
    problem = ViaPointProblem(
        robot="puma560",
        points=TABLE_1_JOINTS,
        duration_bounds=(0.5, 6.0),
        interpolant="polynomial",
        objectives=("time", "jerk"),
    )
    asked, middle = Question.of(problem), np.random.default_rng(4).uniform(-1.5, 1.5, (300, 2))
    cells = fine_cells(asked, coarse_cells(asked, middle - 1e-3, middle + 1e-3))
    _, _, most, _ = asked.at_points(middle)
    left_out = cells.most < 0.0
    assert 10 < left_out.sum() < 290
    assert (most[left_out] < 0.0).all()
    assert left_out[most < 0.0].mean() > 0.7
