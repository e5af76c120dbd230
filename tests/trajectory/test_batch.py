import numpy as np
import pytest
from scipy.integrate import quad

from trajevo import PolynomialBatch, TrajevoError


@pytest.fixture
def batch() -> PolynomialBatch:
    """Three trajectories of two joints, four segments of degree 7, not continuous on purpose."""
    rng = np.random.default_rng(1)
    durations = rng.uniform(0.2, 3.0, (3, 4))
    breaks = np.concatenate([np.zeros((3, 1)), np.cumsum(durations, axis=1)], axis=1)
    return PolynomialBatch(breaks, rng.normal(size=(3, 4, 2, 8)))


def inside(batch: PolynomialBatch, count: int = 40) -> np.ndarray:
    """Instants well inside the segments, (B, T)."""
    shares = np.linspace(0.05, 0.95, count)
    durations = np.diff(batch.breaks, axis=1)
    return (batch.breaks[:, :-1, None] + durations[:, :, None] * shares).reshape(len(batch), -1)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_derivatives_equal_finite_differences(batch, order):
    t, h = inside(batch), 1e-6
    difference = (batch.evaluate(t + h, order - 1) - batch.evaluate(t - h, order - 1)) / (2 * h)
    exact = batch.evaluate(t, order)
    np.testing.assert_allclose(difference, exact, rtol=1e-5, atol=1e-6 * np.abs(exact).max())


@pytest.mark.parametrize("order", [0, 1, 2, 3])
def test_integral_of_square_equals_quadrature(batch, order):
    exact = batch.integral_of_square(order)
    for b in range(len(batch)):
        for joint in range(2):
            total = sum(
                quad(lambda t, b=b, j=joint: batch[b].evaluate(np.array([t]), order)[0, 0, j] ** 2, left, right)[0]
                for left, right in zip(batch.breaks[b, :-1], batch.breaks[b, 1:] * (1 - 1e-15), strict=True)
            )
            assert exact[b, joint] == pytest.approx(total, rel=1e-8)


def test_peak_bounds_samples_and_is_the_greater_of_both_extremes(batch):
    motion = batch.sample(5000)
    for order, values in enumerate((motion.q, motion.v, motion.a, motion.j)):
        lower, upper = batch.extremes(order)
        np.testing.assert_array_equal(batch.peak(order), np.maximum(-lower, upper))
        slack = 1e-12 * batch.peak(order)
        assert (values.max(axis=1) <= upper + slack).all()
        assert (values.min(axis=1) >= lower - slack).all()


def test_jump_is_value_after_minus_value_before(batch):
    for order in range(4):
        before = batch.evaluate(batch.breaks[:, 1:-1] * (1 - 1e-13), order)
        after = batch.evaluate(batch.breaks[:, 1:-1], order)
        np.testing.assert_allclose(batch.jump(order), after - before, atol=1e-7 * np.abs(after).max())


def test_sample_runs_from_start_to_end_with_named_shapes(batch):
    motion = batch.sample(11)
    assert motion.t.shape == (3, 11)
    assert motion.q.shape == motion.v.shape == motion.a.shape == motion.j.shape == (3, 11, 2)
    np.testing.assert_array_equal(motion.t[:, 0], 0.0)
    np.testing.assert_array_equal(motion.t[:, -1], batch.duration)


def test_indexing_keeps_the_numbers(batch):
    assert len(batch[1]) == 1
    assert len(batch[-1]) == 1
    np.testing.assert_array_equal(batch[-1].breaks[0], batch.breaks[2])
    np.testing.assert_array_equal(batch[1].peak(2)[0], batch.peak(2)[1])
    assert len(batch[:2]) == 2


def test_a_batch_is_a_sequence(batch):
    assert [len(one) for one in batch] == [1, 1, 1]
    assert len(batch[np.int64(2)]) == 1
    for index in (3, -4):
        with pytest.raises(IndexError, match="of a batch of 3"):
            batch[index]


def test_segments_sampled_at_shares_are_the_motion(batch):
    shares = np.array([0.0, 0.3, 0.9])
    t = (batch.breaks[:, :-1, None] + batch.segment_durations[:, :, None] * shares).reshape(3, -1)
    for order in range(9):
        exact = batch.evaluate(t, order)
        values = batch.at_shares(shares, order)
        assert values.shape == (3, 12, 2)
        np.testing.assert_allclose(values, exact, rtol=1e-9, atol=1e-9 * np.abs(exact).max())


def test_arrays_are_copies_and_read_only(batch):
    breaks = np.array([[0.0, 1.0]])
    own = PolynomialBatch(breaks, np.zeros((1, 1, 1, 3)))
    breaks[0, 1] = 5.0
    assert own.duration[0] == 1.0
    for array in (batch.breaks, batch.coefficients, batch.duration, batch.peak(1), batch.jump(1), batch.sample(3).q):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0.0


@pytest.mark.parametrize(
    ("breaks", "coefficients", "says"),
    [
        ([[0.0, 1.0]], np.zeros((1, 2, 1, 3)), r"breaks \(B, S \+ 1\)"),
        ([[0.0, 1.0, 1.0]], np.zeros((1, 2, 1, 3)), "trajectory 0 must increase"),
        ([[0.5, 1.0]], np.zeros((1, 1, 1, 3)), "start at 0"),
        ([[0.0, np.nan]], np.zeros((1, 1, 1, 3)), "finite"),
        ([[0.0, 1.0]], np.full((1, 1, 1, 3), np.inf), "finite"),
    ],
)
def test_bad_batches_are_refused(breaks, coefficients, says):
    with pytest.raises(TrajevoError, match=says):
        PolynomialBatch(np.array(breaks), coefficients)


def test_bad_questions_are_refused(batch):
    with pytest.raises(TrajevoError, match="from 0 to the duration"):
        batch.evaluate(np.array([1e3]))
    with pytest.raises(TrajevoError, match="from 0 to the duration"):
        batch.evaluate(np.array([np.nan]))
    with pytest.raises(TrajevoError, match="0 to 3, got 4"):
        batch.peak(4)
    for count in (1, 2.5):
        with pytest.raises(TrajevoError, match="at least 2 samples"):
            batch.sample(count)
    for ask in (batch.jump, batch.integral_of_square, batch.peak, lambda order: batch.evaluate(np.array([0.0]), order)):
        for order in (-1, 1.5, True):
            with pytest.raises(TrajevoError, match="derivative: expected a whole number from 0 on"):
                ask(order)
    for t in (0.5, np.zeros((2, 4)), np.zeros((1, 1, 1))):
        with pytest.raises(TrajevoError, match=r"t: expected shape \(T,\) or \(3, T\)"):
            batch.evaluate(t)
    with pytest.raises(TrajevoError, match="expected arrays of numbers"):
        PolynomialBatch("a", "b")
