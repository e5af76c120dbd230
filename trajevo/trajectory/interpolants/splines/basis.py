"""B-splines as polynomials: those of one clamped knot vector with simple inner knots, piece by piece."""

from __future__ import annotations

import numpy as np

from trajevo.base.arrays import Array


def basis_pieces(parts: Array, degree: int) -> Array:
    """Power coefficients of the B-splines that do not vanish on a piece, for every piece between two knots.

    The recursion of de Boor and Cox, with polynomials in the time since the piece began in the place of numbers. On
    piece s they are the B-splines s to s + degree, of S + degree in all.

    Args:
        parts: times between neighbouring knots, shape (B, S) [s].
        degree: their degree.

    Returns:
        Shape (B, S, degree + 1, degree + 1): B-spline, ascending power of the time since the piece began [1/s^k].
    """
    rows, pieces = parts.shape
    ends = np.concatenate([np.zeros((rows, 1)), np.cumsum(parts, axis=1)], axis=1)
    knots = np.concatenate([np.repeat(ends[:, :1], degree, axis=1), ends, np.repeat(ends[:, -1:], degree, axis=1)], 1)
    found = np.zeros((rows, pieces, degree + 1, degree + 1), dtype=parts.dtype)
    found[:, :, degree, 0] = 1.0
    starts = knots[:, degree : degree + pieces]
    for order in range(1, degree + 1):
        # The B-splines of the order below on piece s: at the last `order` places, knot s + degree - order + 1 on.
        lower = found[:, :, degree - order + 1 :]
        places = np.arange(pieces)[:, None] + degree - order + 1 + np.arange(order)
        first, last = knots[:, places], knots[:, places + order]
        share = lower / (last - first)[..., None]
        rising = (starts[..., None] - first)[..., None] * share
        rising[..., 1:] += share[..., :-1]
        found[:, :, degree - order] = 0.0
        found[:, :, degree - order + 1 :] = rising
        found[:, :, degree - order : degree] += share * (last - starts[..., None])[..., None]
        found[:, :, degree - order : degree, 1:] -= share[..., :-1]
    return found
