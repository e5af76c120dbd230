"""The cells into which a path is cut, and what is known of the path on each of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import final

import numpy as np

from trajevo.base import polynomials
from trajevo.base.arrays import Array, frozen
from trajevo.base.shown.brief import brief
from trajevo.path.curve import GeometricPath
from trajevo.trajectory.bernstein import bernstein_halves, gauss

#: Share of the greatest slope of an axis below which it counts as standing still.
STILL = 1e-9

#: Nodes nearer to each other than this are one.
_APART = 1e-9


@final
@dataclass(frozen=True, eq=False)
class PathCells:
    """C cells of a path s(u), on each of which it is one polynomial and no axis turns round.

    Attributes:
        path: the path.
        stations: ends of the cells, rising from 0 to 1, shape (C + 1,).
        nodes: number N of Gauss-Legendre nodes in a cell.
    """

    path: GeometricPath
    stations: Array
    nodes: int

    __repr__ = brief

    @classmethod
    def of(cls, path: GeometricPath, stations: int, nodes: int) -> PathCells:
        """Cells that become narrow towards both ends, where a motion is slow, cut where pieces or directions change."""
        x = np.linspace(0.0, 1.0, stations + 1)
        even = x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
        kept = _merged(np.concatenate([path.breaks, _turns(path)]), np.empty(0))
        return cls(path, frozen(_merged(kept, even)), nodes)

    @property
    def count(self) -> int:
        """Number of cells C."""
        return len(self.stations) - 1

    @cached_property
    def widths(self) -> Array:
        """Widths of the cells, shape (C,)."""
        return frozen(np.diff(self.stations))

    @cached_property
    def shares(self) -> Array:
        """Places of the nodes in a cell, shape (N,)."""
        return gauss(self.nodes)[0]

    @cached_property
    def slopes(self) -> tuple[Array, Array, Array, Array]:
        """The path and its first three derivatives at the nodes, each shape (C, N, n_axes)."""
        middle = 0.5 * (self.stations[:-1] + self.stations[1:])
        piece = np.searchsorted(self.path.breaks[1:-1], middle, side="right")
        u = self.stations[:-1, None] + self.widths[:, None] * self.shares
        offset = u - self.path.breaks[piece][:, None]
        found = [
            np.moveaxis(polynomials.values(self.path.pieces(order)[..., piece][..., None], offset), 0, -1)
            for order in range(4)
        ]
        return found[0], found[1], found[2], found[3]

    @cached_property
    def signs(self) -> Array:
        """Direction of every axis on every cell: 1, -1, or 0 if it stands still or is not known, shape (C, n_axes)."""
        lower, upper = self._slope_range
        ahead, back = lower >= -self._still, upper <= self._still
        return np.where(ahead & ~back, 1.0, np.where(back & ~ahead, -1.0, 0.0))

    @cached_property
    def unsure(self) -> Array:
        """Whether it is not known in which direction an axis moves, shape (C, n_axes)."""
        lower, upper = self._slope_range
        unsure: Array = (lower < -self._still) & (upper > self._still)
        return unsure

    @cached_property
    def least_slope(self) -> Array:
        """Lower bounds of the magnitude of every axis's slope on every cell, shape (C, n_axes)."""
        lower, upper = self._slope_range
        return np.maximum(np.maximum(lower, -upper), 0.0)

    @cached_property
    def _slope_range(self) -> tuple[Array, Array]:
        return self.hull(self.slopes[1])

    @cached_property
    def _still(self) -> float:
        return float(STILL * np.abs(self.slopes[1]).max())

    def hull(self, values: Array) -> tuple[Array, Array]:
        """Bounds on every cell of polynomials given at the nodes, (C, N, ...) -> two of shape (C, ...)."""
        coefficients, slack = self.bernstein(values)
        return coefficients.min(axis=1) - slack, coefficients.max(axis=1) + slack

    def bernstein(self, values: Array) -> tuple[Array, Array]:
        """Bernstein coefficients of both halves of every cell, and bounds of their rounding.

        Args:
            values: polynomials of degree below N at the nodes, shape (C, N, ...).

        Returns:
            Shapes (C, 2 N, ...) and (C, ...).
        """
        found, slack = bernstein_halves(np.moveaxis(values, 1, -1))
        return np.moveaxis(found, -1, 1), slack

    def at(self, values: Array, share: float) -> Array:
        """Values at one share of every cell of polynomials given at the nodes, (C, N, ...) -> (C, ...)."""
        size = self.nodes
        nodes = 2.0 * self.shares - 1.0
        basis = np.linalg.solve(
            np.polynomial.legendre.legvander(nodes, size - 1).T,
            np.polynomial.legendre.legvander(np.array([2.0 * share - 1.0]), size - 1)[0],
        )
        found: Array = np.tensordot(basis, values, axes=(0, 1))
        return found

    def linear(self, at_stations: Array) -> Array:
        """Continuous piecewise linear functions at the nodes, (C + 1, ...) -> (C, N, ...)."""
        shape = (1, -1) + (1,) * (at_stations.ndim - 1)
        share = self.shares.reshape(shape)
        values: Array = at_stations[:-1, None] + share * (at_stations[1:] - at_stations[:-1])[:, None]
        return values

    def integral(self, values: Array) -> Array:
        """Integrals over [0, 1] of polynomials given at the nodes, (C, N, ...) -> (...)."""
        weights = self.widths[:, None] * gauss(self.nodes)[1]
        return np.tensordot(weights, values, axes=2)


def _turns(path: GeometricPath) -> Array:
    """Where the slope of an axis changes its sign."""
    found = [np.empty(0)]
    for piece, (start, width) in enumerate(zip(path.breaks[:-1], np.diff(path.breaks), strict=True)):
        for axis in range(path.n_axes):
            slope = path.pieces(1)[:, axis, piece]
            if np.abs(slope).max() > 0.0:
                roots = np.polynomial.polynomial.polyroots(np.trim_zeros(slope, "b"))
                real = roots.real[np.abs(roots.imag) <= _APART]
                found.append(start + real[(real > 0.0) & (real < width)])
    return np.concatenate(found)


def _merged(kept: Array, others: Array) -> Array:
    """Kept places, and others that are not next to one of these; all apart from each other."""
    places = np.unique(kept)
    places = places[np.concatenate([[True], np.diff(places) > _APART])]
    if len(others):
        distance = np.abs(others[:, None] - places).min(axis=1)
        places = np.unique(np.concatenate([places, others[distance > _APART]]))
    places[0], places[-1] = 0.0, 1.0
    return places
