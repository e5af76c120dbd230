import numpy as np
import pytest
from scipy.interpolate import BSpline, make_interp_spline

from tests.reference import improved_spline, septic_by_equation_14
from trajevo import TrajevoError, ViaPoints
from trajevo.trajectory.interpolants import (
    HybridQuartic,
    ImprovedQuarticBSpline,
    QuarticCubicQuartic,
    QuinticSpline,
    SepticPolynomial,
    SepticSpline,
    State,
)

BOUNDS = (0.1, 20.0)
RNG = np.random.default_rng(7)
POINTS = ViaPoints(RNG.normal(size=(7, 3)))
DURATIONS = RNG.uniform(0.5, 5.0, (40, 6))

#: Interpolant, and the order up to which derivatives are continuous, and zero at both ends, for all durations.
FAMILIES = {
    "smooth": (lambda points: HybridQuartic(points, duration_bounds=BOUNDS), 3, 3),
    "printed": (lambda points: HybridQuartic(points, form="printed", duration_bounds=BOUNDS), 0, 3),
    "improved": (lambda points: ImprovedQuarticBSpline(points, duration_bounds=BOUNDS), 3, 3),
    "improved_printed": (lambda points: ImprovedQuarticBSpline(points, form="printed", duration_bounds=BOUNDS), 0, 3),
    "quartic_cubic_quartic": (lambda points: QuarticCubicQuartic(points, duration_bounds=BOUNDS), 2, 2),
    "quintic": (lambda points: QuinticSpline(points, duration_bounds=BOUNDS), 4, 2),
    "septic_spline": (lambda points: SepticSpline(points, duration_bounds=BOUNDS), 6, 3),
}


@pytest.fixture(params=FAMILIES)
def family(request):
    make, continuous, at_rest = FAMILIES[request.param]
    return make(POINTS), continuous, at_rest


def test_passes_every_point_at_its_time(family):
    interpolant, _, _ = family
    times = interpolant.via_times(DURATIONS)
    np.testing.assert_allclose(times[:, -1], DURATIONS.sum(axis=1))
    reached = interpolant(DURATIONS).evaluate(times)
    np.testing.assert_allclose(reached, np.broadcast_to(POINTS.positions, reached.shape), atol=1e-11)


def test_jumps_vanish_for_random_durations(family):
    interpolant, continuous, _ = family
    durations = np.random.default_rng(0).uniform(1.0, 10.0, (500, 6))
    batch = interpolant(durations)
    for order in range(continuous + 1):
        assert np.abs(batch.jump(order)).max() < 1e-9, f"derivative {order} jumps"


def test_starts_and_ends_at_rest(family):
    interpolant, _, at_rest = family
    batch = interpolant(DURATIONS)
    ends = np.stack([np.zeros(len(batch)), batch.duration], axis=1)
    for order in range(1, at_rest + 1):
        assert np.abs(batch.evaluate(ends, order)).max() < 1e-9


def test_a_uniform_stretch_scales_every_derivative(family):
    interpolant, _, _ = family
    slow, fast = interpolant(2.0 * DURATIONS), interpolant(DURATIONS)
    for order in range(4):
        np.testing.assert_allclose(slow.peak(order), fast.peak(order) / 2.0**order, rtol=1e-9)


def test_a_row_does_not_depend_on_the_others(family):
    interpolant, _, _ = family
    batch, alone = interpolant(DURATIONS), interpolant(DURATIONS[3:4])
    np.testing.assert_allclose(alone.coefficients[0], batch.coefficients[3], rtol=1e-12, atol=1e-12)


def test_input_is_not_touched(family):
    interpolant, _, _ = family
    x = DURATIONS.copy()
    interpolant(x)
    np.testing.assert_array_equal(x, DURATIONS)


def test_variables_are_the_segment_times(family):
    interpolant, _, _ = family
    assert [(v.name, v.unit, v.lower, v.upper) for v in interpolant.variables] == [
        (f"dt_{i}", "s", *BOUNDS) for i in range(1, 7)
    ]


@pytest.mark.parametrize(
    "x", [np.ones(6), np.ones((2, 5)), np.zeros((1, 6)), -np.ones((1, 6)), np.full((1, 6), np.nan)]
)
def test_bad_durations_are_refused(family, x):
    interpolant, _, _ = family
    with pytest.raises(TrajevoError, match="segment times"):
        interpolant(x)


@pytest.mark.parametrize("name", FAMILIES)
def test_too_few_points_are_refused(name):
    least = {"printed": 4, "smooth": 3, "quartic_cubic_quartic": 3}.get(name, 2)
    with pytest.raises(TrajevoError, match=f"at least {least} points, got {least - 1}"):
        FAMILIES[name][0](ViaPoints(np.arange(2.0 * (least - 1)).reshape(-1, 2)))
    FAMILIES[name][0](ViaPoints(np.arange(2.0 * least).reshape(-1, 2)))(np.ones((2, least - 1)))


@pytest.mark.parametrize(("make", "k", "ends"), [(QuinticSpline, 5, 2), (SepticSpline, 7, 3)])
def test_splines_equal_scipys(make, k, ends):
    interpolant = make(POINTS, duration_bounds=BOUNDS)
    batch, times = interpolant(DURATIONS), interpolant.via_times(DURATIONS)
    rest = [(order, np.zeros(3)) for order in range(1, ends + 1)]
    for b in range(len(batch)):
        theirs = make_interp_spline(times[b], POINTS.positions, k=k, bc_type=(rest, rest))
        t = np.linspace(0.0, times[b, -1], 200)
        for order in range(4):
            exact = theirs.derivative(order)(t) if order else theirs(t)
            np.testing.assert_allclose(batch[b].evaluate(t, order)[0], exact, atol=1e-8 * np.abs(exact).max())


def test_quartic_cubic_quartic_is_the_solution_of_its_14_conditions():
    """Raji 2022, section 2.6: 6 crossings, 4 conditions at the ends, 4 of continuity, as one linear system."""
    points, h = ViaPoints(POINTS.positions[:4]), np.array([[0.7, 2.0, 1.3]])
    batch = QuarticCubicQuartic(points, duration_bounds=BOUNDS)(h)
    degrees, rows, values = (4, 3, 4), [], []

    def row(segment, end, order):
        """Derivative of a segment at its beginning or end, as a row over the 14 coefficients."""
        one = [np.zeros(degree + 1) for degree in degrees]
        for power in range(order, degrees[segment] + 1):
            factor = np.prod(np.arange(power, power - order, -1.0))
            one[segment][power] = factor * (h[0, segment] if end else 0.0) ** (power - order)
        return np.concatenate(one)

    for segment in range(3):
        for end in (0, 1):
            rows.append(row(segment, end, 0))
            values.append(points.positions[segment + end])
    for order in (1, 2):
        rows += [row(0, 0, order), row(2, 1, order)]
        rows += [row(k, 1, order) - row(k + 1, 0, order) for k in (0, 1)]
        values += [np.zeros(3)] * 4
    solved = np.linalg.solve(np.array(rows), np.array(values))
    for segment, at in enumerate((0, 5, 9)):
        count = degrees[segment] + 1
        np.testing.assert_allclose(batch.coefficients[0, segment, :, :count].T, solved[at : at + count], atol=1e-10)
        np.testing.assert_array_equal(batch.coefficients[0, segment, :, count:], 0.0)


def test_splines_through_many_points_stay_exact():
    many = ViaPoints(np.random.default_rng(5).normal(size=(60, 2)))
    batch = SepticSpline(many, duration_bounds=BOUNDS)(np.random.default_rng(6).uniform(0.5, 20.0, (5, 59)))
    for order in range(7):
        scale = np.abs(batch.evaluate(batch.breaks[:, 1:-1], order)).max()
        assert np.abs(batch.jump(order)).max() < 1e-8 * scale


def test_printed_form_is_the_papers_matrix_product():
    batch = FAMILIES["printed"][0](POINTS)(DURATIONS[:1])
    times = np.concatenate([[0.0], np.cumsum(DURATIONS[0])])
    for i in range(1, 5):
        for share in np.linspace(0.0, 0.999, 23):
            t = np.array([times[i] + share * DURATIONS[0, i]])
            expected = [improved_spline(POINTS.positions[:, joint], i, 4.0 * share) for joint in range(3)]
            np.testing.assert_allclose(batch.evaluate(t)[0, 0], expected, atol=1e-12)


def test_printed_form_is_smooth_where_inner_durations_are_equal():
    equal = DURATIONS.copy()
    equal[:, 1:-1] = equal[:, 1:2]
    batch = FAMILIES["printed"][0](POINTS)(equal)
    for order in range(4):
        assert np.abs(batch.jump(order)).max() < 1e-9
    unequal = FAMILIES["printed"][0](POINTS)(DURATIONS)
    assert np.abs(unequal.jump(1)).max() > 1e-2, "the paper's claim of a continuous jerk would hold"


def test_smooth_form_follows_a_straight_row_at_constant_speed():
    row = ViaPoints(np.arange(6.0)[:, None] * np.array([1.0, -2.0]))
    batch = HybridQuartic(row, duration_bounds=BOUNDS)(np.full((1, 5), 2.0))
    t = np.linspace(2.0, 8.0, 50)
    np.testing.assert_allclose(batch.evaluate(t, 1)[0], np.broadcast_to([0.5, -1.0], (50, 2)), atol=1e-12)


@pytest.mark.parametrize("curve", [HybridQuartic, ImprovedQuarticBSpline])
def test_unknown_form_lists_the_valid_ones(curve):
    with pytest.raises(TrajevoError, match=r"'rough'; known: printed, smooth"):
        curve(POINTS, form="rough", duration_bounds=BOUNDS)


@pytest.mark.parametrize("form", ["printed", "smooth"])
def test_improved_spline_is_the_hybrid_curve_between_the_inner_points(form):
    alone, hybrid = (
        make(POINTS, form=form, duration_bounds=BOUNDS)(DURATIONS) for make in (ImprovedQuarticBSpline, HybridQuartic)
    )
    np.testing.assert_array_equal(alone.coefficients[:, 4:-4], hybrid.coefficients[:, 1:-1, :, :5])


def test_first_segment_of_the_improved_spline_is_scipys_b_spline():
    """Four control points at the first point, rule (2), and four around the second at their Greville abscissae."""
    batch, slope = ImprovedQuarticBSpline(POINTS, duration_bounds=BOUNDS)(DURATIONS[:1]), POINTS.positions[2]
    slope = (slope - POINTS.positions[0]) / DURATIONS[0, :2].sum()
    offsets = np.array([-3.0, -1.0, 1.0, 3.0])[:, None] / 8.0 * DURATIONS[0, 0]
    controls = np.concatenate([np.repeat(POINTS.positions[:1], 4, axis=0), POINTS.positions[1] + offsets * slope])
    theirs = BSpline(np.arange(-4.0, 9.0) * DURATIONS[0, 0] / 4.0, controls, 4)
    t = np.linspace(0.0, DURATIONS[0, 0], 60)
    for order in range(4):
        np.testing.assert_allclose(batch.evaluate(t[:-1], order)[0], theirs(t[:-1], order), atol=1e-9)


@pytest.mark.parametrize("bounds", [(0.0, 1.0), (2.0, 1.0), (-1.0, 1.0), (np.nan, 1.0), (1.0, np.inf)])
def test_bad_bounds_are_refused(bounds):
    with pytest.raises(TrajevoError, match="bounds"):
        QuinticSpline(POINTS, duration_bounds=bounds)


def test_septic_polynomial_is_equation_14():
    states = np.random.default_rng(2).normal(size=(2, 4, 3))
    interpolant = SepticPolynomial(State(*states[0]), State(*states[1]), duration_bounds=BOUNDS)
    durations = np.array([[0.7], [1.0], [4.2]])
    batch = interpolant(durations)
    for b, T in enumerate(durations[:, 0]):
        for joint in range(3):
            expected = septic_by_equation_14(states[0, :, joint], states[1, :, joint], T)
            np.testing.assert_allclose(batch.coefficients[b, 0, joint], expected, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(interpolant.via_times(durations), [[0, 0.7], [0, 1.0], [0, 4.2]])


def test_states_of_different_size_are_refused():
    with pytest.raises(TrajevoError, match="3 joints as in start, got 2"):
        SepticPolynomial(State(np.zeros(3)), State(np.zeros(2)), duration_bounds=BOUNDS)
    with pytest.raises(TrajevoError, match=r"velocity: expected shape \(3\)"):
        State(np.zeros(3), velocity=np.zeros(2))


def test_printed_form_nearly_stops_on_a_straight_row():
    row = ViaPoints(np.arange(6.0)[:, None])
    batch = HybridQuartic(row, form="printed", duration_bounds=BOUNDS)(np.ones((1, 5)))
    middle = batch.evaluate(np.linspace(1.0, 4.0, 3001), 1)
    assert middle.min() == pytest.approx(0.27594178, abs=1e-6)
    assert middle.max() == pytest.approx(2.27777778, abs=1e-6)


@pytest.mark.parametrize(
    ("spline", "powers"),
    [(QuinticSpline, [0, 0, 0, 10, -15, 6]), (SepticSpline, [0, 0, 0, 0, 35, -84, 70, -20])],
)
def test_between_two_points_a_spline_is_the_polynomial_at_rest_at_both_ends(spline, powers):
    """The textbook polynomials, 10 s³ - 15 s⁴ + 6 s⁵ and 35 s⁴ - 84 s⁵ + 70 s⁶ - 20 s⁷."""
    start, end = np.array([0.3, -1.0]), np.array([1.1, 0.5])
    made = spline(ViaPoints([start, end]), duration_bounds=(0.1, 9.0))
    assert len(made.variables) == 1
    motion = made(np.array([[2.0], [0.7]])).sample(31)
    s = np.linspace(0.0, 1.0, 31)
    expected = start + np.polynomial.polynomial.polyval(s, powers)[:, None] * (end - start)
    np.testing.assert_allclose(motion.q, np.stack([expected, expected]), atol=1e-13)
