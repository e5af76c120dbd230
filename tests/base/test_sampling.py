"""Samplers spread their points evenly."""

import numpy as np
import pytest

from trajevo.base.sampling import latin_hypercube, sobol


@pytest.mark.parametrize("draw", [sobol, latin_hypercube])
def test_one_point_lies_in_each_slice_of_every_axis(draw):
    drawn = draw(7, 256, np.random.default_rng(4))
    assert drawn.shape == (256, 7)
    slices = np.sort((256 * drawn).astype(int), axis=0)
    np.testing.assert_array_equal(slices, np.broadcast_to(np.arange(256)[:, None], slices.shape))
