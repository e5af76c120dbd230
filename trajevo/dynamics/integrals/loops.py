"""Loops over segments, one number at a time, which numba (the optional extra ``fast``) compiles."""

from __future__ import annotations

from trajevo.base.arrays import Array
from trajevo.base.jit import fast


@fast("f8[1], f8[3] -> f8[2]", "f8[1], c16[3] -> c16[2]")
def combined(weights: Array, values: Array, out: Array) -> None:
    """Sums of values at nodes times weights; also of complex values.

    Args:
        weights: shape (M,).
        values: shape (P, M, F).
        out: output, shape (P, F).
    """
    segments, nodes, fields = values.shape
    for p in range(segments):
        for f in range(fields):
            out[p, f] = weights[0] * values[p, 0, f]
        for m in range(1, nodes):
            for f in range(fields):
                out[p, f] += weights[m] * values[p, m, f]


@fast("f8[2], f8[1], f8[3], f8[3] -> f8[1]", "f8[2], f8[1], c16[3], c16[3] -> c16[1]")
def squares(onto: Array, weights: Array, values: Array, factors: Array, out: Array) -> None:
    """Integrals over unit intervals of the square of polynomials times a factor, summed over them; also complex ones.

    Args:
        onto: matrix (U, M) from values at nodes to the polynomials at those of a quadrature.
        weights: weights of the quadrature, shape (U,).
        values: values at the nodes, shape (P, M, F).
        factors: factors at the nodes of the quadrature, shape (P, U, F).
        out: output, shape (P,).
    """
    segments, nodes, fields = values.shape
    for p in range(segments):
        out[p] = 0.0
        for u in range(len(weights)):
            for f in range(fields):
                value = onto[u, 0] * values[p, 0, f]
                for m in range(1, nodes):
                    value += onto[u, m] * values[p, m, f]
                value *= factors[p, u, f]
                out[p] += weights[u] * value * value
