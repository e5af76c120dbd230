"""Loops of the search for least distances, which numba (the optional extra ``fast``) compiles.

They replace many small calls of numpy for few intervals each; the numbers are the same to the bit.
"""

from __future__ import annotations

from trajevo.base.arrays import Array
from trajevo.base.jit import fast


@fast("i8[1], i8[1], i8[1], f8[1], f8[2] -> f8[2], i8[2], f8[3]")
def take(row: Array, kind: Array, pair: Array, d: Array, t: Array, least: Array, which: Array, when: Array) -> None:
    """Take in distances; of equal new ones the first in time, and of these the first pair.

    Args:
        row: indices of motions, shape (K,).
        kind: kinds of pairs, shape (K,).
        pair: indices of pairs, shape (K,).
        d: distances, shape (K,) [m].
        t: both ends of their intervals, shape (2, K) [s].
        least: least distances, shape (B, 2), replaced by smaller ones [m].
        which: indices of their pairs, shape (B, 2).
        when: both ends of their intervals, shape (2, B, 2) [s].
    """
    before = least.copy()
    for k in range(len(row)):
        b, c = row[k], kind[k]
        better = d[k] < least[b, c]
        if d[k] == least[b, c] and d[k] < before[b, c]:
            better = t[0, k] < when[0, b, c] or (t[0, k] == when[0, b, c] and pair[k] < which[b, c])
        if better:
            least[b, c], which[b, c], when[0, b, c], when[1, b, c] = d[k], pair[k], t[0, k], t[1, k]


@fast("i8[1], i8[1], i8[1], i8[1], f8[2], i8[1], f8[2], f8[2], f8[2], f8 -> f8[1], f8[2], b1[1]")
def settle(
    piece: Array,
    pair: Array,
    row: Array,
    kind: Array,
    d: Array,
    column: Array,
    travel: Array,
    t: Array,
    enough: Array,
    tolerance: float,
    known: Array,
    proof: Array,
    settled: Array,
) -> None:
    """Bounds of intervals, and which of them need no halving.

    Args:
        piece: indices of intervals of time, shape (K,).
        pair: indices of pairs, shape (K,).
        row: indices of motions, shape (J,).
        kind: kind of every pair, shape (n_pairs,).
        d: distances at both ends, shape (2, K) [m].
        column: column of every pair, shape (n_pairs,).
        travel: how far the solids of each column can move relative to each other, shape (J, columns) [m].
        t: both ends of the intervals of time, shape (2, J) [s].
        enough: bounds from which on an interval needs no halving, shape (B, 2) [m].
        tolerance: distance to which bounds are found [m].
        known: bounds that are proven, shape (K,), replaced by greater ones [m].
        proof: both ends of the intervals for which they were proven, shape (2, K) [s].
        settled: output, shape (K,).
    """
    for k in range(len(piece)):
        j = piece[k]
        moved = travel[j, column[pair[k]]]
        bound = 0.5 * (d[0, k] + d[1, k] - moved)
        if bound > known[k]:
            known[k], proof[0, k], proof[1, k] = bound, t[0, j], t[1, j]
        settled[k] = known[k] >= enough[row[j], kind[pair[k]]] or 0.5 * moved <= tolerance
