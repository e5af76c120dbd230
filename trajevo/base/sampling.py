"""Points evenly spread over the unit cube, by SciPy."""

from __future__ import annotations

import numpy as np

from trajevo.base.arrays import Array


def sobol(dimensions: int, count: int, random: np.random.Generator) -> Array:
    """The first points of Sobol's scrambled sequence, balanced where they are a power of two, (count, dimensions)."""
    # Imported here, as it takes a quarter of the time that importing everything else does.
    from scipy.stats import qmc

    drawn: Array = qmc.Sobol(dimensions, rng=random).random_base2(max(count - 1, 0).bit_length())[:count]
    return drawn


def latin_hypercube(dimensions: int, count: int, random: np.random.Generator) -> Array:
    """One point in each of as many slices of every axis, shape (count, dimensions)."""
    from scipy.stats import qmc

    drawn: Array = qmc.LatinHypercube(dimensions, rng=random).random(count)
    return drawn
