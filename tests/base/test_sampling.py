"""Samplers spread their points evenly."""

import numpy as np
import pytest
from scipy.stats import qmc

from trajevo.base.sampling import latin_hypercube, sobol


@pytest.mark.parametrize("draw", [sobol, latin_hypercube])
def test_one_point_lies_in_each_slice_of_every_axis(draw):
    drawn = draw(7, 256, np.random.default_rng(4))
    assert drawn.shape == (256, 7)
    slices = np.sort((256 * drawn).astype(int), axis=0)
    np.testing.assert_array_equal(slices, np.broadcast_to(np.arange(256)[:, None], slices.shape))


@pytest.mark.thinned(5)
@pytest.mark.parametrize("dimensions", [1, 2, 7, 14, 40, 63, 64, 65])
@pytest.mark.parametrize("count", [1, 2, 5, 60, 64, 1000])
def test_sobol_points_are_those_of_scipy_to_the_bit(dimensions, count):
    ours, theirs = np.random.default_rng(dimensions), np.random.default_rng(dimensions)
    for _ in range(2):  # each draw takes another child of the generator
        points = qmc.Sobol(dimensions, rng=theirs).random_base2((count - 1).bit_length())[:count]
        np.testing.assert_array_equal(sobol(dimensions, count, ours), points, strict=True)
    assert ours.random() == theirs.random()
