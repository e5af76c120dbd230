"""The cubic spline with two virtual knots: ends, points, smoothness, scipy, exact peaks, bad input."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline as ScipySpline

from tests.guo2016 import GUO2016, TABLE_7
from trajevo import ViaPoints
from trajevo.errors import InvalidInputError
from trajevo.trajectory.interpolants import CubicSpline

VIA = ViaPoints(np.array(GUO2016["via_points"]))
ENDS = ("start_velocity", "start_acceleration", "end_velocity", "end_acceleration")
BOUNDS = (0.005, 1.5)


def spline(points=VIA, **ends):
    return CubicSpline(points, duration_bounds=BOUNDS, **ends)


def random_intervals(count, segments=12, seed=0, low=0.01, high=10.0):
    return np.exp(np.random.default_rng(seed).uniform(np.log(low), np.log(high), (count, segments)))


def random_ends(joints=5, seed=1):
    return dict(zip(ENDS, np.random.default_rng(seed).uniform(-0.3, 0.3, (4, joints)), strict=True))


def at_ends(batch):
    """Velocity and acceleration at the beginning and at the end, in the order of ENDS, (4, B, n_joints)."""
    stop = batch.duration[:, None]
    start = np.zeros_like(stop)
    return [batch.evaluate(t, order)[:, 0] for t in (start, stop) for order in (1, 2)]


def knots_of(batch, order):
    """Values at all breaks from the coefficients, (B, S + 1, n_joints)."""
    factor = (1.0, 1.0, 2.0)[order]
    last = batch.evaluate(batch.duration[:, None], order)
    return np.concatenate([factor * batch.coefficients[..., order], last], axis=1)


def test_variables_are_the_papers_intervals():
    variables = spline().variables
    assert [variable.name for variable in variables] == [f"h_{i}" for i in range(1, 13)]
    assert {(variable.unit, variable.lower, variable.upper) for variable in variables} == {("s", *BOUNDS)}


def test_points_are_passed_at_their_instants():
    h = random_intervals(200)
    batch, times = spline()(h), spline().via_times(h)
    assert times.shape == (200, 11)
    np.testing.assert_allclose(times[:, 0], 0.0)
    np.testing.assert_allclose(times[:, -1], h.sum(axis=1))
    np.testing.assert_allclose(times[:, 1], h[:, :2].sum(axis=1))
    np.testing.assert_allclose(batch.evaluate(times), np.broadcast_to(VIA.positions, (200, 11, 5)), atol=1e-9)


@pytest.mark.parametrize("given", [{}, random_ends()], ids=["zero", "given"])
def test_velocity_and_acceleration_at_the_ends(given):
    batch = spline(**given)(random_intervals(200))
    for name, values in zip(ENDS, at_ends(batch), strict=True):
        expected = np.broadcast_to(given.get(name, 0.0), values.shape)
        scale = np.abs(batch.coefficients[..., 1:3]).max()
        np.testing.assert_allclose(values, expected, rtol=1e-9, atol=1e-9 * scale, err_msg=name)


@pytest.mark.parametrize("name", ENDS)
def test_every_end_value_counts_alone(name):
    value = np.array([0.1, -0.2, 0.05, 0.3, -0.1])
    values = dict(zip(ENDS, at_ends(spline(**{name: value})(TABLE_7[None])), strict=True))
    for other in ENDS:
        np.testing.assert_allclose(values[other][0], value if other == name else 0.0, atol=1e-12, err_msg=other)


@pytest.mark.parametrize("given", [{}, random_ends()], ids=["zero", "given"])
def test_c2_at_all_knots(given):
    batch = spline(**given)(random_intervals(500))
    assert batch.breaks.shape == (500, 13)
    for order in range(3):
        size = np.abs(knots_of(batch, order)).max(axis=(1, 2))
        jump = np.abs(batch.jump(order)).max(axis=(1, 2))
        assert (jump <= 1e-9 * size).all(), order
    assert (np.abs(batch.jump(3)).max(axis=(1, 2)) > 0.0).all()


@pytest.mark.parametrize("given", [{}, random_ends()], ids=["zero", "given"])
def test_equals_scipy_through_all_knots(given):
    h = random_intervals(100, low=0.05, high=2.0)
    batch = spline(**given)(h)
    positions = knots_of(batch, 0)
    ends = [given.get(name, np.zeros(5)) for name in ("start_acceleration", "end_acceleration")]
    share = np.linspace(0.0, 1.0, 101)
    for i in range(len(h)):
        other = ScipySpline(batch.breaks[i], positions[i], bc_type=((2, ends[0]), (2, ends[1])))
        t = share * batch.duration[i]
        for order in range(3):
            mine, theirs = batch[i].evaluate(t, order)[0], other(t, order)
            np.testing.assert_allclose(mine, theirs, rtol=0.0, atol=1e-9 * max(1.0, np.abs(theirs).max()))
        # the velocities at the ends were not asked of scipy: the virtual knots make them come out right
        np.testing.assert_allclose(other(0.0, 1), given.get("start_velocity", 0.0), atol=1e-9)
        np.testing.assert_allclose(other(batch.duration[i], 1), given.get("end_velocity", 0.0), atol=1e-9)


def test_knots_of_table_7():
    batch = spline()(TABLE_7[None])
    np.testing.assert_allclose(knots_of(batch, 0)[0], GUO2016["table7_q_knots"], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(knots_of(batch, 2)[0], GUO2016["table7_a_knots"], rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("given", [{}, random_ends(2)], ids=["zero", "given"])
def test_two_points_work(given):
    points = ViaPoints(np.array([[0.0, 1.0], [0.5, -1.0]]))
    interpolant = spline(points, **given)
    assert len(interpolant.variables) == 3
    h = random_intervals(50, segments=3, low=0.1, high=3.0)
    batch = interpolant(h)
    np.testing.assert_allclose(interpolant.via_times(h), np.stack([np.zeros(50), h.sum(axis=1)], axis=1))
    np.testing.assert_allclose(batch.evaluate(interpolant.via_times(h)), np.broadcast_to(points.positions, (50, 2, 2)))
    for name, values in zip(ENDS, at_ends(batch), strict=True):
        size = 1.0 + np.abs(batch.coefficients).max()
        np.testing.assert_allclose(values, np.broadcast_to(given.get(name, 0.0), (50, 2)), atol=1e-11 * size)
    for order in range(3):
        assert np.abs(batch.jump(order)).max() <= 1e-10 * (1.0 + np.abs(knots_of(batch, order)).max())


def test_three_points_work():
    points = ViaPoints(np.array([[0.0], [0.5], [0.2]]))
    h = random_intervals(20, segments=4, low=0.1, high=3.0)
    batch, times = spline(points)(h), spline(points).via_times(h)
    np.testing.assert_allclose(times[:, 1], h[:, :2].sum(axis=1))
    np.testing.assert_allclose(batch.evaluate(times)[:, :, 0], np.broadcast_to([0.0, 0.5, 0.2], (20, 3)), atol=1e-12)


def test_peaks_of_acceleration_are_at_knots():
    batch = spline()(random_intervals(200))
    np.testing.assert_allclose(batch.peak(2), np.abs(knots_of(batch, 2)).max(axis=1), rtol=1e-9)


def test_peaks_of_velocity_are_where_acceleration_is_zero():
    batch = spline()(random_intervals(100, low=0.1, high=2.0))
    v, a, h = knots_of(batch, 1), knots_of(batch, 2), batch.segment_durations[:, :, None]
    a0, a1 = a[:, :-1], a[:, 1:]
    with np.errstate(divide="ignore", invalid="ignore"):
        inside = np.where(a0 * a1 < 0.0, np.abs(v[:, :-1] - a0**2 * h / (2.0 * (a1 - a0))), 0.0)
    expected = np.maximum(np.abs(v).max(axis=1), inside.max(axis=1))
    np.testing.assert_allclose(batch.peak(1), expected, rtol=1e-9)


def test_integrals_are_exact():
    batch = spline()(random_intervals(100, low=0.1, high=2.0))
    a, h = knots_of(batch, 2), batch.segment_durations[:, :, None]
    jerk = np.diff(a, axis=1) / h
    np.testing.assert_allclose(batch.integral_of_square(3), (h * jerk**2).sum(axis=1), rtol=1e-10)
    by_ends = h * (a[:, :-1] ** 2 + a[:, :-1] * a[:, 1:] + a[:, 1:] ** 2) / 3.0
    np.testing.assert_allclose(batch.integral_of_square(2), by_ends.sum(axis=1), rtol=1e-10)


def test_a_batch_equals_its_rows():
    h = random_intervals(40)
    together = spline()(h).coefficients
    alone = np.concatenate([spline()(row[None]).coefficients for row in h])
    assert (together == alone).all()


def test_stretched_time_scales_the_derivatives():
    h = random_intervals(30, low=0.1, high=2.0)
    fast, slow = spline()(h), spline()(3.0 * h)
    for order in range(1, 4):
        np.testing.assert_allclose(slow.peak(order), fast.peak(order) / 3.0**order, rtol=1e-9)


def test_complex_step_equals_central_differences():
    h = TABLE_7[None]
    steps = np.repeat(h, 12, axis=0) + 1e-20j * np.eye(12)
    slope = spline(**random_ends())(steps).coefficients.imag / 1e-20
    step = 1e-6
    for i in range(12):
        move = step * np.eye(12)[i]
        ahead, behind = (spline(**random_ends())(h + s * move).coefficients[0] for s in (1.0, -1.0))
        expected = (ahead - behind) / (2.0 * step)
        np.testing.assert_allclose(slope[i], expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize(
    "x",
    [
        np.ones((1, 11)),
        np.ones((1, 13)),
        np.ones(12),
        np.ones((1, 1, 12)),
        np.zeros((1, 12)),
        -np.ones((1, 12)),
        np.full((1, 12), np.nan),
        np.full((1, 12), np.inf),
    ],
    ids=["short", "long", "flat", "deep", "zero", "negative", "nan", "inf"],
)
def test_bad_interval_lengths_are_refused(x):
    with pytest.raises(InvalidInputError, match=r"^x: expected"):
        spline()(x)
    with pytest.raises(InvalidInputError, match=r"^x: expected"):
        spline().via_times(x)


def test_a_bad_interval_is_named():
    h = np.ones((3, 12))
    h[1, 4] = -0.5
    with pytest.raises(InvalidInputError, match=r"-0\.5 for segment 4 of row 1"):
        spline()(h)


@pytest.mark.parametrize("name", ENDS)
@pytest.mark.parametrize("value", [np.zeros(4), 0.0, [0.0, 0.0, 0.0, 0.0, np.nan], "none"], ids=str)
def test_bad_end_values_are_refused(name, value):
    with pytest.raises(InvalidInputError, match=name):
        spline(**{name: value})


@pytest.mark.parametrize("bounds", [(0.0, 1.0), (-1.0, 1.0), (1.0, 1.0), (2.0, 1.0), (0.1, np.inf)])
def test_bad_bounds_are_refused(bounds):
    with pytest.raises(InvalidInputError, match=r"bounds|lower < upper"):
        _ = CubicSpline(VIA, duration_bounds=bounds).variables
