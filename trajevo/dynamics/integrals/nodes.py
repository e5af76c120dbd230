"""Nested sets of nodes on the unit interval: every set holds the one before it, so that no value is computed twice."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from typing import final

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.base.shown.brief import brief

#: Greatest number of nodes: beyond it the polynomial through values at interlaced nodes begins to swing between them.
MOST_NODES = 49


@cache
def lobatto(count: int) -> tuple[Array, Array]:
    """Gauss-Lobatto nodes on [0, 1] and weights of sum 1; exact for polynomials of degree 2 count - 3."""
    legendre = np.polynomial.Legendre.basis(count - 1)
    nodes = np.concatenate([[-1.0], np.sort(legendre.deriv().roots().real), [1.0]])
    weights = 2.0 / (count * (count - 1) * legendre(nodes) ** 2)
    return frozen(0.5 * (nodes + 1.0)), frozen(0.5 * weights)


@final
@dataclass(frozen=True, eq=False)
class Nodes:
    """Nodes on [0, 1], both ends included, and what the polynomial through values at them gives.

    Attributes:
        shares: the nodes, shape (M,) [1], increasing; neighbours bound M - 1 cells.
    """

    shares: Array

    __repr__ = brief

    @property
    def finer(self) -> Nodes | None:
        """These nodes and one more in every cell; None if they would be too many."""
        if 2 * len(self.shares) - 1 > MOST_NODES:
            return None
        angles = np.arccos(1.0 - 2.0 * self.shares)
        finer = np.empty(2 * len(angles) - 1)
        # Halving angles keeps the nodes dense near the ends, which polynomials of high degree need.
        finer[::2], finer[1::2] = self.shares, 0.5 * (1.0 - np.cos(0.5 * (angles[1:] + angles[:-1])))
        return Nodes(frozen(finer))

    @cached_property
    def widths(self) -> Array:
        """Widths of the cells, shape (M - 1,) [1]."""
        return frozen(np.diff(self.shares))

    @cached_property
    def slopes(self) -> Array:
        """Matrix (M, M) from values at the nodes to the polynomial's derivative there [1]."""
        derivatives = np.polynomial.legendre.legder(np.eye(len(self.shares)))
        at_nodes = np.ascontiguousarray((2.0 * np.polynomial.legendre.legval(self._centred, derivatives)).T)
        return frozen(at_nodes @ self.coefficients)

    @cached_property
    def bends(self) -> Array:
        """Matrix (M, M) from values at the nodes to the polynomial's second derivative there [1]."""
        return frozen(self.slopes @ self.slopes)

    @cached_property
    def integrals(self) -> Array:
        """Matrix (M - 1, M) from values at the nodes to the polynomial's integral over every cell [1]."""
        integrals = np.polynomial.legendre.legint(np.eye(len(self.shares)))
        at_nodes = np.ascontiguousarray((0.5 * np.polynomial.legendre.legval(self._centred, integrals)).T)
        return frozen(np.diff(at_nodes, axis=0) @ self.coefficients)

    @cached_property
    def last_terms(self) -> Array:
        """Matrix (2, M) from values at the nodes to the polynomial's last two coefficients in Legendre polynomials.

        What a polynomial of higher degree would add is about as great as these, or less.
        """
        return frozen(self.coefficients[-2:].copy())

    @cached_property
    def weights(self) -> Array:
        """Weights (M,) of values at the nodes in the polynomial's integral, of sum 1."""
        return frozen(self.integrals.sum(axis=0))

    def onto(self, shares: Array) -> Array:
        """Matrix (U, M) from values at the nodes to the polynomial's values at other shares (U,)."""
        return frozen(np.polynomial.legendre.legvander(2.0 * shares - 1.0, len(self.shares) - 1) @ self.coefficients)

    @property
    def _centred(self) -> Array:
        return 2.0 * self.shares - 1.0

    @cached_property
    def coefficients(self) -> Array:
        """Matrix (M, M) from values at the nodes to coefficients in Legendre polynomials [1]."""
        return frozen(np.linalg.inv(np.polynomial.legendre.legvander(self._centred, len(self.shares) - 1)))


@cache
def nested(samples: int) -> tuple[Nodes, ...]:
    """The Gauss-Lobatto nodes of a number of samples, and all finer sets, which hold each other."""
    sets = [Nodes(lobatto(samples)[0])]
    while (finer := sets[-1].finer) is not None:
        sets.append(finer)
    return tuple(sets)


@cache
def for_squares(nodes: Nodes, degree: int) -> tuple[Array, Array, Array]:
    """Gauss-Legendre nodes, exact for squares of the polynomials through values at given nodes times a factor.

    Args:
        nodes: the given nodes, M of them.
        degree: degree of the factor.

    Returns:
        Shares (U,), their weights (U,) of sum 1, and the matrix (U, M) from values at the given nodes to those there.
    """
    places, weights = np.polynomial.legendre.leggauss(len(nodes.shares) + degree)
    shares = frozen(0.5 * (1.0 + places))
    return shares, frozen(0.5 * weights), nodes.onto(shares)
