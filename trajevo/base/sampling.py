"""Points evenly spread over the unit cube: those of SciPy's samplers, to the bit."""

from __future__ import annotations

import importlib.util
from functools import cache
from pathlib import Path

import numpy as np

from trajevo.base.arrays import Array

#: Binary digits of a point of the Sobol sequence.
_BITS = 30


def sobol(dimensions: int, count: int, random: np.random.Generator) -> Array:
    """First points of the scrambled Sobol sequence, balanced if their number is a power of two, (count, dimensions).

    The sequence is that of Joe and Kuo (2008), scrambled by random lower triangular matrices and shifted (Matoušek
    1998): the points of ``scipy.stats.qmc.Sobol(dimensions, rng=random)``, whose import takes longer than all others.
    """
    powers = np.left_shift(np.uint32(1), np.arange(_BITS, dtype=np.uint32))
    random = random.spawn(1)[0]  # as SciPy does, so that the caller's numbers stay as they are
    shift = random.integers(2, size=(dimensions, _BITS), dtype=np.uint32) @ powers
    lower = np.tril(random.integers(2, size=(dimensions, _BITS, _BITS), dtype=np.uint32))
    lower[:, range(_BITS), range(_BITS)] = 1
    # Row p of a matrix gives binary digit p, from the highest, of every scrambled direction number.
    digits = (_direction_numbers(dimensions)[:, :, None] >> np.arange(_BITS - 1, -1, -1, dtype=np.uint32)) & 1
    scrambled = (np.einsum("dpk,djk->djp", lower, digits) & 1) @ powers[::-1]
    number = np.arange(count, dtype=np.uint32)
    gray, points = number ^ (number >> 1), np.broadcast_to(shift, (count, dimensions)).copy()
    for place in range(max(count - 1, 0).bit_length()):
        points[(gray >> place) & 1 == 1] ^= scrambled[:, place]
    drawn: Array = points * 2.0**-_BITS
    return drawn


def latin_hypercube(dimensions: int, count: int, random: np.random.Generator) -> Array:
    """One point in each of ``count`` slices of every axis, shape (count, dimensions)."""
    # Imported only when needed: it takes longer than all other imports together.
    from scipy.stats import qmc

    drawn: Array = qmc.LatinHypercube(dimensions, rng=random).random(count)
    return drawn


@cache
def _direction_numbers(dimensions: int) -> Array:
    """Direction numbers of the Sobol sequence, shape (dimensions, 30), from the tables that SciPy is installed with."""
    found = importlib.util.find_spec("scipy")
    folder = Path(str(found and found.origin)).parent / "stats"
    with np.load(folder / "_sobol_direction_numbers.npz") as tables:
        polynomials, first = tables["poly"][:dimensions], tables["vinit"][:dimensions]
    numbers = np.ones((dimensions, _BITS), dtype=np.uint32)
    for row, (polynomial, known) in enumerate(zip(polynomials.tolist(), first, strict=True)):
        degree = polynomial.bit_length() - 1
        if row == 0:
            continue  # the first dimension has no polynomial
        numbers[row, :degree] = known[:degree]
        for j in range(degree, _BITS):
            value = numbers[row, j - degree]
            for k in range(degree):
                if (polynomial >> (degree - 1 - k)) & 1:
                    value ^= numbers[row, j - k - 1] << np.uint32(k + 1)
            numbers[row, j] = value
    return np.asarray(numbers << np.arange(_BITS - 1, -1, -1, dtype=np.uint32))
