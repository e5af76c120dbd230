import numpy as np
import pytest
from scipy.interpolate import BSpline

from tests.helpers import refused
from tests.reference import PAING2021
from trajevo import GeometricPath
from trajevo.problems.gemini_and_s import gemini, gemini_points, s_points, s_shape

STEP = 1e-5


def squared_error(path, points):
    """Sum of squares of every axis at the path's own parameters."""
    return ((path(path.parameters) - points) ** 2).sum(axis=0)


@pytest.fixture(params=["gemini", "s", "cubic", "septic", "space"])
def path(request):
    rng = np.random.default_rng(3)
    return {
        "gemini": gemini,
        "s": s_shape,
        "cubic": lambda: GeometricPath.through(s_points(), order=4, parameters="chord"),
        "septic": lambda: GeometricPath.near(gemini_points(), control_points=20, order=8),
        "space": lambda: GeometricPath.through(rng.normal(size=(9, 3)), knots="uniform"),
    }[request.param]()


def test_a_derivative_equals_its_finite_difference(path):
    u = np.random.default_rng(0).uniform(0.01, 0.99, 50)
    u = u[np.abs(u[:, None] - path.breaks).min(axis=1) > 2.0 * STEP]
    for order in range(3):
        numerical = (path(u + STEP, order) - path(u - STEP, order)) / (2.0 * STEP)
        np.testing.assert_allclose(numerical, path(u, order + 1), atol=2e-6 * np.abs(path.peak(order + 1)).max())


def test_values_are_scipys(path):
    spline = BSpline(path.knots, path.control_points, path.order - 1)
    u = np.linspace(0.0, 1.0, 101)
    for order in range(4):
        expected = spline(u, order)
        np.testing.assert_allclose(path(u, order), expected, atol=1e-11 * np.abs(expected).max())


@pytest.mark.thinned(2)
def test_peaks_are_reached_and_never_exceeded(path):
    u = np.linspace(0.0, 1.0, 200_001)
    for order in range(4):
        sampled = path(u, order)
        lower, upper = path.extremes(order)
        reach = np.abs(sampled).max()
        assert (sampled.min(axis=0) >= lower - 1e-12 * reach).all()
        assert (sampled.max(axis=0) <= upper + 1e-12 * reach).all()
        np.testing.assert_allclose(np.abs(sampled).max(axis=0), path.peak(order), rtol=1e-4)


def test_a_clamped_curve_begins_and_ends_at_its_outer_control_points(path):
    np.testing.assert_allclose(path([0.0, 1.0]), path.control_points[[0, -1]], atol=1e-15)


@pytest.mark.parametrize("order", [2, 3, 4, 5, 6, 8, 9])
@pytest.mark.parametrize("parameters", ["uniform", "centripetal", "chord"])
def test_interpolation_passes_through_every_point(order, parameters):
    points = s_points()
    path = GeometricPath.through(points, order=order, parameters=parameters)
    np.testing.assert_allclose(path(path.parameters), points, atol=1e-12)


def test_parameters_spread_as_the_chords_do():
    points = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 4.0], [1.0, 5.0]])
    for name, chords in {"uniform": [1, 1, 1], "centripetal": [1, 2, 1], "chord": [1, 4, 1]}.items():
        path = GeometricPath.through(points, order=4, parameters=name)
        np.testing.assert_allclose(np.diff(path.parameters), np.array(chords) / sum(chords), atol=1e-15)
    own = GeometricPath.through(points, order=4, parameters=[0.0, 0.2, 0.9, 1.0])
    np.testing.assert_array_equal(own.parameters, [0.0, 0.2, 0.9, 1.0])


def test_least_squares_cannot_be_improved():
    points = gemini_points()
    path = GeometricPath.near(points, control_points=14)
    best = squared_error(path, points).sum()
    rng = np.random.default_rng(0)
    for _ in range(20):
        moved = path.control_points.copy()
        moved[1:-1] += 1e-5 * rng.normal(size=moved[1:-1].shape)
        assert squared_error(GeometricPath(path.knots, moved, path.parameters), points).sum() > best


def test_as_many_control_points_as_points_interpolate():
    points = s_points()
    near = GeometricPath.near(points, control_points=9)
    np.testing.assert_allclose(near.control_points, GeometricPath.through(points).control_points, atol=1e-12)


@pytest.mark.parametrize("make", ["through", "near"])
def test_a_path_at_rest_has_no_slope_and_no_bend_at_its_ends(make):
    if make == "through":
        path = GeometricPath.through(s_points(), knots="quantiles", at_rest=True)
        np.testing.assert_allclose(path(path.parameters), s_points(), atol=1e-12)
        # Order 6 and four conditions: the inner knots are the points' parameters, as the paper's baseline has them.
        np.testing.assert_allclose(path.breaks, path.parameters, atol=1e-15)
    else:
        path = GeometricPath.near(gemini_points(), control_points=16, knots="quantiles", at_rest=True)
    for order in (1, 2):
        np.testing.assert_allclose(path([0.0, 1.0], order), 0.0, atol=1e-10 * path.peak(order).max())


def test_settings_make_an_equal_path(path):
    again = GeometricPath(**path.settings)
    np.testing.assert_array_equal(again(np.linspace(0.0, 1.0, 7)), path(np.linspace(0.0, 1.0, 7)))
    np.testing.assert_array_equal(again.parameters, path.parameters)


def test_gemini_is_the_papers_path():
    """Section VI.C: errors of 123.34 and 8.17 mm²; the reference's knots, control points and derivatives."""
    expected, path = PAING2021["gemini"], gemini()
    error = 1e6 * squared_error(path, gemini_points())
    assert error.round(2).tolist() == [123.34, 8.17]
    np.testing.assert_allclose(error, expected["sse"], rtol=1e-9)
    np.testing.assert_allclose(path.knots, expected["knots"], atol=1e-14)
    np.testing.assert_allclose(1e3 * path.control_points, expected["control_points"], atol=1e-9)
    for order in (1, 2, 3):
        np.testing.assert_allclose(1e3 * path.peak(order), expected[f"S{order}"], rtol=1e-10)


def test_knots_by_the_book_do_not_give_the_papers_errors():
    book = GeometricPath.near(gemini_points(), control_points=12, parameters="chord", knots="averaging")
    np.testing.assert_allclose(1e6 * squared_error(book, gemini_points()), [137.07, 8.64], atol=0.01)


def test_the_s_is_the_references():
    expected, path = PAING2021["sshape"], s_shape()
    np.testing.assert_allclose(1e3 * s_points(), expected["via_points"], atol=1e-12)
    np.testing.assert_allclose(path.knots, expected["knots"], atol=1e-14)
    np.testing.assert_allclose(1e3 * path.control_points, expected["control_points"], atol=1e-10)
    for name, position in expected["points"].items():
        np.testing.assert_allclose(1e3 * path(float(name[2:-1])), position, atol=1e-9)


def test_the_airfoils_file_keeps_its_header():
    from trajevo.problems.gemini_and_s import GEMINI_FILE

    assert GEMINI_FILE.read_text().startswith("GEMINI (smoothed)\n")
    assert gemini_points().shape == (79, 2)


P = s_points()
TWICE = np.insert(P, 3, P[3], axis=0)

BAD = {
    "too few": (lambda: GeometricPath.through(P[:5]), "points: a curve of order 6 needs at least 6, got 5"),
    "too few near": (
        lambda: GeometricPath.near(P[:4], control_points=4),
        "points: a curve of order 6 needs at least 6, got 4",
    ),
    "repeated": (lambda: GeometricPath.through(TWICE), "points: point 4 repeats point 3"),
    "text": (lambda: GeometricPath.through("abc"), "points: expected numbers"),
    "NaN": (lambda: GeometricPath.through(P * np.nan), "points: expected finite numbers"),
    "too many controls": (
        lambda: GeometricPath.near(P, control_points=10),
        "control_points: expected a whole number from 6 to 9, got 10",
    ),
    "controls as text": (lambda: GeometricPath.near(P, control_points="x"), "from 6 to 9, got 'x'"),
    "order": (lambda: GeometricPath.through(P, order=1), "order: expected a whole number of at least 2, got 1"),
    "parameters": (lambda: GeometricPath.through(P, parameters="cord"), "unknown parameters 'cord'; known: centri"),
    "knots": (lambda: GeometricPath.through(P, knots="even"), "unknown knots 'even'; known: averaging"),
    "own knots": (lambda: GeometricPath.through(P, knots=[0.5]), r"knots: expected shape \(3\), got \(1,\)"),
    "own parameters": (
        lambda: GeometricPath.through(P, parameters=np.zeros(9)),
        "parameters: expected numbers increasing from 0 to 1",
    ),
    "undetermined": (
        lambda: GeometricPath.through(P, knots=[0.01, 0.02, 0.03]),
        "knots: 3 inner knots leave 2 control points undetermined",
    ),
    "unclamped": (
        lambda: GeometricPath(np.linspace(0, 1, 15), P),
        "knots: expected 6 zeros, increasing inner knots, 6 ones",
    ),
    "falling": (
        lambda: GeometricPath(np.r_[np.zeros(6), 0.5, 0.4, 0.6, np.ones(6)], P),
        "knots: expected 6 zeros, increasing inner knots",
    ),
    "order of knots": (lambda: GeometricPath(np.r_[0, 0, 1, 1], P), "give order -5; expected an order from 2"),
    "outside": (lambda: s_shape()(1.5), "u: expected numbers from 0 to 1, got 1.5"),
    "derivative": (lambda: s_shape()(0.5, 4), "derivative: expected 0 to 3, got 4"),
    "derivative of peak": (lambda: s_shape().peak(4), "derivative: expected 0 to 3, got 4"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_gets_a_sentence(case):
    refused(*BAD[case])
