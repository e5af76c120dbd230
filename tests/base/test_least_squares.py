"""What limits and bounds can bear of a slope is the bounded least squares of SciPy."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from trajevo.base.solving.least_squares import non_negative


def problems(seed):
    """Random columns, some of them nearly or quite the same, with the slacks below that leave some of them nothing."""
    rng = np.random.default_rng(seed)
    for _ in range(60):
        rows, columns = rng.integers(1, 12, 2)
        found = rng.normal(size=(rows, columns))
        if columns > 2:
            found[:, 0], found[:, 1] = found[:, -1], found[:, -1] * (1.0 + 1e-9)
        slack = np.diag(np.where(rng.random(columns) < 0.5, 0.0, rng.random(columns)))
        yield np.concatenate([found, slack]), np.concatenate([rng.normal(size=rows), np.zeros(columns)])


@pytest.mark.thinned(3)
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("most", [1, 30])
def test_it_is_that_of_scipy_to_the_bit(seed, most):
    for matrix, wanted in problems(seed):
        expected = lsq_linear(matrix, wanted, (0.0, np.inf), method="bvls", max_iter=most).x
        np.testing.assert_array_equal(non_negative(matrix, wanted, most), expected)


@pytest.mark.parametrize("seed", range(4))
def test_no_multiplier_is_negative_and_what_is_left_is_at_right_angles_to_those_that_bear(seed):
    for matrix, wanted in problems(seed):
        borne = non_negative(matrix, wanted, 30 * matrix.shape[1])
        slope = matrix.T @ (matrix @ borne - wanted)
        assert (borne >= -1e-15).all()
        assert (slope > -1e-5).all()
        assert np.abs(slope[borne > 1e-6]).max(initial=0.0) < 1e-5
