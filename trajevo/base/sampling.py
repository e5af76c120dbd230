"""Points evenly spread over the unit cube: SciPy's, to the bit, but Sobol's without the import of scipy.stats."""

from __future__ import annotations

from functools import cache

import numpy as np

from trajevo.base.arrays import Array, frozen

#: Binary digits of a coordinate.
_DIGITS = 30

#: The numbers of S. Joe and F. Y. Kuo (2008), doi:10.1137/070709359, from the second dimension on, one of them a line:
#: the inner coefficients of a primitive polynomial as binary digits, then the odd numbers that begin its recurrence.
_JOE_KUO = """
0 1
1 1 3
1 1 3 1
2 1 1 1
1 1 1 3 3
4 1 3 5 13
2 1 1 5 5 17
4 1 1 5 5 5
7 1 1 7 11 19
11 1 1 5 1 1
13 1 1 1 3 11
14 1 3 5 5 31
1 1 3 3 9 7 49
13 1 1 1 15 21 21
16 1 3 1 13 27 49
19 1 1 1 15 7 5
22 1 3 1 15 13 25
25 1 1 5 5 19 61
1 1 3 7 11 23 15 103
4 1 3 7 13 13 15 69
7 1 1 3 13 7 35 63
8 1 3 5 9 1 25 53
14 1 3 1 13 9 35 107
19 1 3 1 5 27 61 31
21 1 1 5 11 19 41 61
28 1 3 5 3 3 13 69
31 1 1 7 13 1 19 1
32 1 3 7 5 13 19 59
37 1 1 3 9 25 29 41
41 1 3 5 13 23 1 55
42 1 3 7 3 13 59 17
50 1 3 1 3 5 53 69
55 1 1 5 5 23 33 13
56 1 1 7 7 1 61 123
59 1 1 7 9 13 61 49
62 1 3 3 5 3 55 33
14 1 3 1 15 31 13 49 245
21 1 3 5 15 31 59 63 97
22 1 3 1 11 11 11 77 249
38 1 3 1 11 27 43 71 9
47 1 1 7 15 21 11 81 45
49 1 3 7 3 25 31 65 79
50 1 3 1 1 19 11 3 205
52 1 1 5 9 19 21 29 157
56 1 3 7 11 1 33 89 185
67 1 3 3 3 15 9 79 71
70 1 3 7 11 15 39 119 27
84 1 1 3 1 11 31 97 225
97 1 1 1 3 23 43 57 177
103 1 3 7 7 17 17 37 71
115 1 3 1 5 27 63 123 213
122 1 1 3 5 11 43 53 133
8 1 3 5 5 29 17 47 173 479
13 1 3 3 11 3 1 109 9 69
16 1 1 1 5 17 39 23 5 343
22 1 3 1 5 25 15 31 103 499
25 1 1 1 11 11 17 63 105 183
44 1 1 5 11 9 29 97 231 363
47 1 1 5 15 19 45 41 7 383
52 1 3 7 7 31 19 83 137 221
55 1 1 1 3 23 15 111 223 83
59 1 1 5 13 31 15 55 25 161
62 1 1 3 13 25 47 39 87 257
"""


def sobol(dimensions: int, count: int, random: np.random.Generator) -> Array:
    """First points of the scrambled Sobol sequence, balanced if their number is a power of two, (count, dimensions).

    They are those of ``scipy.stats.qmc.Sobol``, which scrambles as J. Matoušek (1998) does: by random lower triangular
    matrices of binary digits, and a shift. More than 64 dimensions are left to SciPy.
    """
    directions = _directions()
    if dimensions > len(directions):
        # Imported only when needed: it takes a quarter as long as all other imports together.
        from scipy.stats import qmc

        drawn: Array = qmc.Sobol(dimensions, rng=random).random_base2(max(count - 1, 0).bit_length())[:count]
        return drawn
    own = random.spawn(1)[0]
    powers = np.uint32(1) << np.arange(_DIGITS, dtype=np.uint32)
    shift = (own.integers(2, size=(dimensions, _DIGITS), dtype=np.uint32) * powers).sum(axis=1, dtype=np.uint32)
    lower = np.tril(own.integers(2, size=(dimensions, _DIGITS, _DIGITS), dtype=np.uint32)) > 0
    lower |= np.eye(_DIGITS, dtype=bool)
    # The digits of every direction, the greatest first, through the matrix of its dimension, modulo 2.
    digits = (directions[:dimensions, :, None] & powers[::-1]) > 0
    scrambled = np.logical_xor.reduce(digits[:, :, None, :] & lower[:, None, :, :], axis=3)
    steps = (scrambled * powers[::-1]).sum(axis=2, dtype=np.uint32)
    # From one point to the next, the direction of the last zero digit of its number is added without carry.
    numbers = np.arange(count - 1)
    last = np.bitwise_count(numbers & ~(numbers + 1))
    points = np.bitwise_xor.accumulate(np.concatenate([shift[None], steps[:, last].T]), axis=0)
    return np.asarray(points[:count] * 2.0**-_DIGITS, dtype=np.float64)


def latin_hypercube(dimensions: int, count: int, random: np.random.Generator) -> Array:
    """One point in each of ``count`` slices of every axis, shape (count, dimensions)."""
    from scipy.stats import qmc

    drawn: Array = qmc.LatinHypercube(dimensions, rng=random).random(count)
    return drawn


@cache
def _directions() -> Array:
    """Directions of the sequence as whole numbers of 30 binary digits, shape (dimensions, digits)."""
    rows = np.zeros((_JOE_KUO.count("\n"), _DIGITS), dtype=np.uint32)
    rows[0] = 1
    for row, line in zip(rows[1:], _JOE_KUO.split("\n")[1:], strict=False):
        inner, *first = map(int, line.split())
        degree = len(first)
        row[:degree] = first
        for k in range(degree, _DIGITS):
            row[k] = row[k - degree] ^ (row[k - degree] << degree)
            for j in range(1, degree):
                if inner >> (degree - 1 - j) & 1:
                    row[k] ^= row[k - j] << j
    return frozen(rows << np.arange(_DIGITS - 1, -1, -1, dtype=np.uint32))
