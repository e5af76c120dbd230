"""Gauss-Lobatto nodes, weights and derivatives on [0, 1]: samples of segments with both ends among them."""

from __future__ import annotations

from functools import cache

import numpy as np

from trajevo.arrays import Array, frozen


@cache
def lobatto(count: int) -> tuple[Array, Array]:
    """Gauss-Lobatto nodes on [0, 1] and weights of sum 1; exact for polynomials of degree 2 count - 3."""
    legendre = np.polynomial.Legendre.basis(count - 1)
    nodes = np.concatenate([[-1.0], np.sort(legendre.deriv().roots().real), [1.0]])
    weights = 2.0 / (count * (count - 1) * legendre(nodes) ** 2)
    return frozen(0.5 * (nodes + 1.0)), frozen(0.5 * weights)


@cache
def lobatto_derivative(count: int) -> Array:
    """Matrix (count, count) from values at Gauss-Lobatto nodes to the derivative of their polynomial there."""
    nodes = lobatto(count)[0]
    powers = nodes[:, None] ** np.arange(count)
    slopes = np.arange(1, count) * nodes[:, None] ** np.arange(count - 1)
    return frozen(np.linalg.solve(powers.T, np.pad(slopes, ((0, 0), (1, 0))).T).T)
