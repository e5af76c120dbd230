"""Own samplers give SciPy's numbers to the bit."""

import numpy as np
import pytest
from scipy.stats import qmc

from trajevo.base.sampling import latin_hypercube, sobol


@pytest.mark.parametrize("dimensions", [1, 2, 3, 5, 8, 13, 40, 150])
@pytest.mark.parametrize("count", [0, 1, 2, 3, 60, 64, 1000, 1024])
def test_the_sobol_sequence_is_that_of_scipy(dimensions, count):
    ours, theirs = (np.random.default_rng(dimensions + count) for _ in range(2))
    expected = qmc.Sobol(dimensions, rng=theirs).random_base2(max(count - 1, 0).bit_length())[:count]
    np.testing.assert_array_equal(sobol(dimensions, count, ours), expected)
    assert ours.random() == theirs.random()
    again = sobol(dimensions, count, ours)
    assert not count or (again != expected).any()


@pytest.mark.parametrize("draw", [sobol, latin_hypercube])
def test_one_point_lies_in_each_slice_of_every_axis(draw):
    drawn = draw(7, 256, np.random.default_rng(4))
    assert drawn.shape == (256, 7)
    slices = np.sort((256 * drawn).astype(int), axis=0)
    np.testing.assert_array_equal(slices, np.broadcast_to(np.arange(256)[:, None], slices.shape))
