"""Runs along a path in unit time: against a slow composition of scipy's B-splines, and by their properties."""

import numpy as np
import pytest

from tests.helpers import mostly_long, refused
from tests.reference import full_control_points, slow_composition
from trajevo import GeometricPath
from trajevo.problems.gemini_and_s import gemini, s_points, s_shape
from trajevo.trajectory.along_path import ComposedBatch
from trajevo.trajectory.parameterisation import Course

FINE = np.linspace(0.0, 1.0, 40_001)


def random_rows(count, size=16, seed=0):
    """Control points with (18) built in; some rises are 0, so that u stands still for a while."""
    rng = np.random.default_rng(seed)
    rises = rng.uniform(size=(count, size - 5)) * (rng.uniform(size=(count, size - 5)) > 0.2)
    rises[:, 0] += 1e-3
    rows = np.zeros((count, size))
    rows[:, 3:-2] = np.cumsum(rises, axis=1) / rises.sum(axis=1, keepdims=True)
    rows[:, -3:] = 1.0
    return np.minimum(rows, 1.0)


PATHS = {
    "gemini": gemini,
    "s": s_shape,
    "cubic": lambda: GeometricPath.through(s_points(), order=4),
    "septic": lambda: GeometricPath.through(s_points(), order=8),
    "space": lambda: GeometricPath.through(np.random.default_rng(3).normal(size=(8, 3))),
}


@pytest.fixture(params=mostly_long(PATHS, "cubic"))
def path(request):
    return PATHS[request.param]()


@pytest.fixture
def course(path):
    return Course(path, random_rows(12))


def test_values_are_those_of_the_slow_composition(path, course):
    t = np.sort(np.random.default_rng(1).uniform(size=300))
    for row in range(3):
        expected = slow_composition(path, course.control_points[row], 6, t)
        found = [course.at(np.tile(t, (12, 1)), order)[:, row].T for order in range(4)]
        for order in range(4):
            np.testing.assert_allclose(found[order], expected[order], atol=1e-9 * np.abs(expected[order]).max())


def test_shares_of_segments_are_the_same_values(course):
    shares = np.array([0.0, 0.3, 0.99])
    t = course.breaks[:, :-1, None] + np.diff(course.breaks, axis=1)[..., None] * shares
    for order in range(4):
        found, there = course.at_shares(shares, order), course.at(t.reshape(12, -1), order)
        inside = np.abs(found.reshape(there.shape) - there)[..., np.tile(shares, t.shape[1]) > 0.0]
        assert inside.max() <= 1e-8 * np.abs(there).max()


def test_knots_of_the_path_are_crossed_at_breaks(path, course):
    crossings = course.instants_of(path.breaks[1:-1])
    np.testing.assert_allclose(course.parameter(crossings), np.tile(path.breaks[1:-1], (12, 1)), atol=1e-9)
    assert (np.abs(course.breaks[:, :, None] - crossings[:, None]).min(axis=1) == 0.0).all()
    assert (np.diff(course.breaks, axis=1) >= 0.0).all()
    assert course.instants_of(np.array([0.0, 1.0])).tolist() == [[0.0, 1.0]] * 12


def test_runs_start_and_end_at_rest(course):
    ends = np.tile([0.0, 1.0], (12, 1))
    for order in (1, 2):
        reach = course.peak(order).T[..., None]
        assert (np.abs(course.at(ends, order)) <= 1e-9 * reach).all()


def test_peaks_are_guaranteed_and_tight(course):
    for order in (1, 2, 3):
        sampled = np.abs(course.at(np.tile(FINE, (12, 1)), order)).max(axis=2).T
        at_breaks = np.abs(course.at_shares(np.array([0.0, 1.0]), order)).max(axis=(2, 3)).T
        greatest = np.maximum(sampled, at_breaks)
        assert (course.peak(order) >= greatest * (1.0 - 1e-12)).all()
        assert (course.peak(order) <= greatest * (1.0 + 2e-4)).all()


def test_extremes_bound_from_both_sides(course):
    for order in range(4):
        values = course.at(np.tile(FINE, (12, 1)), order)
        lower, upper = course.extremes(order)
        reach = np.abs(values).max()
        assert (upper >= values.max(axis=2).T - 1e-12 * reach).all()
        assert (lower <= values.min(axis=2).T + 1e-12 * reach).all()
        assert (upper <= values.max(axis=2).T + 1e-3 * reach).all() or order == 0


def test_a_coarser_tolerance_only_raises_peaks(path):
    rows = random_rows(12)
    fine, coarse = Course(path, rows, tolerance=1e-8), Course(path, rows, tolerance=1e-2)
    for order in (1, 2, 3):
        ratio = coarse.peak(order) / fine.peak(order)
        assert (ratio >= 1.0 - 1e-9).all()
        assert (ratio <= 1.02).all()


def test_hull_bounds_are_never_below_the_true_peaks(course):
    for order in (1, 2, 3):
        assert (course.hull_peak(order) * (1.0 + 1e-6) >= course.peak(order) * (1.0 - 1e-9)).all()
        np.testing.assert_allclose(course.hull_terms(order).max(axis=2), course.hull_peak(order), rtol=1e-14)


def test_local_terms_reach_the_peaks(course):
    for order in (1, 2, 3):
        np.testing.assert_allclose(course.local_terms(order).max(axis=2), course.peak(order), rtol=2e-4)


def test_integrals_are_exact(path):
    course = Course(path, random_rows(3))
    nodes, weights = np.polynomial.legendre.leggauss(40)
    for order in range(4):
        pieces = np.linspace(0.0, 1.0, 801)
        t = pieces[:-1, None] + np.diff(pieces)[:, None] * 0.5 * (nodes + 1.0)
        square = course.at(np.tile(t.ravel(), (3, 1)), order) ** 2
        slow = (square.reshape(path.n_axes, 3, 800, 40) @ (0.5 * weights) / 800.0).sum(axis=2).T
        # The slow quadrature is not cut at the path's knots, where a cubic path's jerk jumps.
        tolerance = {2: 1e-6, 3: 1e-3}.get(order, 1e-9) if path.order == 4 else 1e-9
        np.testing.assert_allclose(course.integral_of_square(order), slow, rtol=tolerance)


def test_integrals_do_not_depend_on_what_was_asked_before(path):
    rows = random_rows(4)
    alone, after = Course(path, rows), Course(path, rows)
    after.peak(1)
    np.testing.assert_allclose(after.integral_of_square(3), alone.integral_of_square(3), rtol=1e-12)


def test_no_rows_are_an_empty_course(path):
    course = Course(path, random_rows(2)[:0])
    for order in (1, 2, 3):
        assert course.peak(order).shape == course.hull_peak(order).shape == (0, path.n_axes)
    assert ComposedBatch(course, np.empty(0)).integral_of_square(3).shape == (0, path.n_axes)


def test_rows_do_not_depend_on_each_other(path, course):
    alone = Course(path, course.control_points[7:8])
    for order in (1, 2, 3):
        np.testing.assert_allclose(alone.peak(order), course.peak(order)[7:8], rtol=1e-12)
        np.testing.assert_allclose(alone.integral_of_square(order), course.integral_of_square(order)[7:8], rtol=1e-12)
    np.testing.assert_array_equal(course.rows(slice(7, 8)).control_points, alone.control_points)


def quantities(course):
    return {
        "peak": np.concatenate([course.peak(order) / 10.0**order for order in (1, 2, 3)], axis=1),
        "hull": np.concatenate([course.hull_peak(order) / 10.0**order for order in (1, 2, 3)], axis=1),
        "integral": np.concatenate([course.integral_of_square(order) for order in range(4)], axis=1),
        "instants": course.instants_of(np.array([0.2, 0.5, 0.8])),
        "values": np.swapaxes(course.at(np.array([[0.31, 0.52, 0.77]]), 2), 0, 1).reshape(1, -1),
    }


def test_complex_steps_are_derivatives(path):
    rises = np.random.default_rng(4).uniform(0.2, 1.0, 11)
    row = full_control_points(np.cumsum(rises / rises.sum())[:-1])
    direction = np.zeros((1, 16))
    direction[0, 3:-3] = np.random.default_rng(5).normal(size=10)
    stepped = quantities(Course(path, row + 1e-20j * direction))
    h = 1e-7
    above, below = (quantities(Course(path, row + sign * h * direction)) for sign in (1.0, -1.0))
    for name, values in stepped.items():
        numerical = (above[name] - below[name]) / (2.0 * h)
        np.testing.assert_allclose(
            values.imag / 1e-20, numerical, rtol=2e-5, atol=1e-6 * np.abs(numerical).max(), err_msg=name
        )


def test_durations_scale_everything_by_their_powers(path, course):
    slow = ComposedBatch(course, np.full(12, 2.0))
    unit = ComposedBatch(course, np.ones(12))
    assert (slow.duration == 2.0).all()
    for order in (1, 2, 3):
        np.testing.assert_allclose(slow.peak(order), unit.peak(order) / 2.0**order, rtol=1e-14)
        np.testing.assert_allclose(slow.hull_peak(order), unit.hull_peak(order) / 2.0**order, rtol=1e-14)
        np.testing.assert_allclose(
            slow.integral_of_square(order), unit.integral_of_square(order) * 2.0 ** (1 - 2 * order), rtol=1e-14
        )
        np.testing.assert_allclose(slow.evaluate([1.0], order), unit.evaluate([0.5], order) / 2.0**order, rtol=1e-14)
    np.testing.assert_array_equal(slow.extremes(0)[1][0], path.extremes(0)[1])


def test_the_batch_is_as_smooth_as_its_path(path, course):
    batch = ComposedBatch(course, np.linspace(1.0, 3.0, 12))
    for order in range(min(path.order - 1, 4)):
        jump = np.abs(batch.jump(order))
        assert jump.max() <= 1e-7 * max(np.abs(batch.at_shares(np.array([0.0, 0.5]), order)).max(), 1e-3)


def test_a_batch_is_indexed_like_a_list(course):
    batch = ComposedBatch(course, np.linspace(1.0, 3.0, 12))
    assert len(batch[2:5]) == 3
    assert float(batch[-1].duration[0]) == 3.0
    np.testing.assert_allclose(batch[4].evaluate([0.5], 1), batch.evaluate([0.5], 1)[4:5], rtol=1e-13)
    with pytest.raises(IndexError):
        batch[12]


def test_what_is_handed_out_is_read_only(course):
    batch = ComposedBatch(course, np.ones(12))
    for array in (batch.breaks, batch.peak(1), batch.evaluate([0.5]), batch.integral_of_square(3), course.breaks):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0.0


ROW = random_rows(1)
BAD = {
    "falling": (lambda: Course(gemini(), ROW[:, ::-1]), "control_points: expected rows that run from 0 to 1"),
    "short": (lambda: Course(gemini(), ROW[:, :4]), r"control_points: expected shape \(B, n\) with n of at least"),
    "NaN": (lambda: Course(gemini(), ROW * np.nan), "control_points: expected rows that run from 0 to 1"),
    "tolerance": (lambda: Course(gemini(), ROW, tolerance=1e-12), "tolerance: expected a number from 1e-08 to 0.1"),
    "steep path": (
        lambda: Course(GeometricPath.through(np.random.default_rng(1).normal(size=(13, 2)), order=13), ROW),
        "tolerance: expected a number from .* to 0.1 for a path of order 13, got 1e-06",
    ),
    "peak of the position": (lambda: Course(gemini(), ROW).peak(0), "derivative: expected 1 to 3, got 0"),
    "hull of the position": (
        lambda: ComposedBatch(Course(gemini(), ROW), np.ones(1)).hull_peak(0),
        "derivative: expected 1 to 3, got 0",
    ),
    "durations": (lambda: ComposedBatch(Course(gemini(), ROW), np.ones(2)), r"durations: expected shape \(1,\)"),
    "no time": (lambda: ComposedBatch(Course(gemini(), ROW), np.zeros(1)), "durations: expected positive times"),
    "fourth": (
        lambda: ComposedBatch(Course(gemini(), ROW), np.ones(1)).evaluate([0.5], 4),
        "derivative: expected 0 to 3, got 4",
    ),
    "late": (lambda: ComposedBatch(Course(gemini(), ROW), np.ones(1)).evaluate([1.5]), "t: expected instants from 0"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_gets_a_sentence(case):
    refused(*BAD[case])
