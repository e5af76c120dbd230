"""Points evenly spread over the unit cube, by SciPy."""

from __future__ import annotations

import numpy as np

from trajevo.base.arrays import Array


def sobol(dimensions: int, count: int, random: np.random.Generator) -> Array:
    """First points of the scrambled Sobol sequence, balanced if their number is a power of two, (count, dimensions)."""
    # Imported only when needed: it takes a quarter as long as all other imports together.
    from scipy.stats import qmc

    drawn: Array = qmc.Sobol(dimensions, rng=random).random_base2(max(count - 1, 0).bit_length())[:count]
    return drawn


def latin_hypercube(dimensions: int, count: int, random: np.random.Generator) -> Array:
    """One point in each of ``count`` slices of every axis, shape (count, dimensions)."""
    from scipy.stats import qmc

    drawn: Array = qmc.LatinHypercube(dimensions, rng=random).random(count)
    return drawn
