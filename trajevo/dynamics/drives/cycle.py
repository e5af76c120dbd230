"""Averages and temperatures over a cycle that repeats: a motion in smooth pieces, then a time at rest.

A winding warms up by τ dΔ/dt = ρ u - Δ with the square u of its motor's torque. The response to u is linear, so it is
found for u = 1, and for what u is made of; it is exact for polynomials through the values at the nodes of every piece.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from typing import final

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.base.shown.brief import brief

#: Nodes of every piece, and evenly spaced instants at which temperatures are looked at.
NODES, LOOKED_AT = 24, 49

_LOOKED_AT, _AT_END = frozen(np.linspace(0.0, 1.0, LOOKED_AT)), frozen(np.ones(1))

#: How often the surroundings of a greatest temperature are looked at again, and how much more closely.
ZOOMS, ZOOM = 6, 8.0

#: Longest piece as a multiple of the time constant, and how many pieces there may be.
LONGEST, MOST_PIECES = 2.0, 4000


@final
@dataclass(frozen=True, eq=False)
class Cycle:
    """A motion in P pieces and a time at rest, which repeat.

    Values of something over a cycle have the shape (..., P, N), at the nodes of all pieces, and (...) while it stands.

    Attributes:
        ends: instants at which pieces begin and end, shape (P + 1,) [s].
        dwell: time at rest after the motion [s].
        cycles: number of cycles from cold on; None if they go on for ever.
    """

    ends: Array
    dwell: float
    cycles: int | None

    __repr__ = brief

    @cached_property
    def durations(self) -> Array:
        """Durations of the pieces, shape (P,) [s]."""
        return frozen(np.diff(self.ends))

    @property
    def total(self) -> float:
        """Duration of a cycle [s]."""
        return float(self.ends[-1] - self.ends[0]) + self.dwell

    @property
    def nodes(self) -> Array:
        """Instants of the nodes of all pieces, shape (P, N) [s]."""
        nodes: Array = self.ends[:-1, None] + self.durations[:, None] * legendre(NODES)[0]
        return nodes

    @cached_property
    def looked_at(self) -> Array:
        """Instants for which :meth:`response` is given, shape (P x M + 1,) [s]; the last is the end of the cycle."""
        within = self.ends[:-1, None] + self.durations[:, None] * _LOOKED_AT
        return frozen(np.append(within.reshape(-1), self.ends[0] + self.total))

    def mean(self, values: Array, held: Array) -> Array:
        """Average over a cycle, shape (...)."""
        moving: Array = (values * (self.durations[:, None] * legendre(NODES)[1])).sum(axis=(-2, -1))
        average: Array = (moving + self.dwell * held) / self.total
        return average

    def response(self, values: Array, held: Array, time_constant: float) -> Array:
        """What follows values with a time constant [s] in the last cycle, at :attr:`looked_at`, shape (..., P x M + 1).

        In a steady state its average is that of the values.
        """
        begins, end = self.begins(values, held, time_constant)
        durations, shares = self.durations / time_constant, _LOOKED_AT
        rows = values.reshape(-1, *values.shape[-2:])
        added = (rows.swapaxes(0, 1) @ response_matrices(durations, shares, NODES).swapaxes(1, 2)).swapaxes(0, 1)
        within = added.reshape(*values.shape[:-1], -1) + begins[..., None] * np.exp(-durations[:, None] * shares)
        return np.concatenate([within.reshape(*within.shape[:-2], -1), end[..., None]], axis=-1)

    def hottest(self, values: Array, held: Array, time_constant: float) -> tuple[float, float]:
        """The greatest response to values (P, N) and the one at rest (), and its instant [s]."""
        response = self.response(values, held, time_constant)
        most, time = float(response.max()), float(self.looked_at[response.argmax()])
        begins = self.begins(values, held, time_constant)[0]
        for piece in self.pieces_at(time):
            share, width = (time - self.ends[piece]) / self.durations[piece], 1.0 / (LOOKED_AT - 1)
            for _ in range(ZOOMS):
                shares = around(share, width)
                inside = self.inside(piece, values[piece], begins[piece], time_constant, shares)
                share, width = shares[inside.argmax()], width / ZOOM
                if inside.max() > most:
                    most, time = float(inside.max()), float(self.ends[piece] + share * self.durations[piece])
        return most, time

    def pieces_at(self, time: float) -> list[int]:
        """The pieces in which an instant [s] lies, both where two of them meet."""
        return [k for k in range(len(self.ends) - 1) if self.ends[k] <= time <= self.ends[k + 1]]

    def begins(self, values: Array, held: Array, time_constant: float) -> tuple[Array, Array]:
        """The response at the begin of every piece (..., P), and at the end of the cycle (...)."""
        shares = self.durations / time_constant
        from_cold = np.zeros((*values.shape[:-2], len(shares) + 1))
        added = (values * response_matrices(shares, _AT_END, NODES)[:, 0]).sum(axis=-1)
        for k, left in enumerate(np.exp(-shares).tolist()):
            from_cold[..., k + 1] = left * from_cold[..., k] + added[..., k]
        rest = self.dwell / time_constant
        end = np.exp(-rest) * from_cold[..., -1] - np.expm1(-rest) * held
        before = end * self._kept(time_constant)
        gone = (self.ends - self.ends[0]) / time_constant
        begins = from_cold + before[..., None] * np.exp(-gone)
        return begins[..., :-1], end + before * np.exp(-self.total / time_constant)

    def inside(self, piece: int, values: Array, begin: Array, time_constant: float, shares: Array) -> Array:
        """The response at shares (U,) of one piece, from values (..., N) at its nodes and that at its begin (...)."""
        duration = self.durations[piece] / time_constant
        added = values @ response_matrices(np.array([duration]), shares, NODES)[0].T
        response: Array = added + begin[..., None] * np.exp(-duration * shares)
        return response

    def _kept(self, time_constant: float) -> float:
        """What is left at the begin of the last cycle of what one cycle adds, over that of all cycles before it."""
        share = self.total / time_constant
        if self.cycles is None:
            return float(-1.0 / np.expm1(-share))
        return float(np.expm1(-(self.cycles - 1) * share) / np.expm1(-share))

    def split(self, instants: Array) -> Cycle:
        """The same cycle with pieces that end at further instants [s] too."""
        inner = instants[(instants > self.ends[0]) & (instants < self.ends[-1])]
        ends = np.unique(np.concatenate([self.ends, inner]))
        near = np.diff(ends) < 1e-9 * self.ends[-1]  # pieces that are but rounding
        return Cycle(frozen(np.concatenate([ends[:1], ends[1:][~near]])), self.dwell, self.cycles)

    def onto(self, values: Array, other: Cycle) -> Array:
        """Values of shape (..., P, N) at the nodes of finer pieces, by the polynomials of these pieces."""
        owner = np.clip(np.searchsorted(self.ends, other.ends[:-1], side="right") - 1, 0, len(self.ends) - 2)
        shares = (other.nodes - self.ends[owner, None]) / self.durations[owner, None]
        found = values[..., owner, :]
        # Most pieces are whole ones of these, whose nodes are the same.
        cut = np.flatnonzero((self.ends[owner] != other.ends[:-1]) | (self.ends[owner + 1] != other.ends[1:]))
        if len(cut):
            terms = np.polynomial.legendre.legvander(2.0 * shares[cut] - 1.0, NODES - 1)
            coefficients = found[..., cut, :] @ legendre(NODES)[2].T
            found[..., cut, :] = (terms @ coefficients[..., None])[..., 0]
        return found


def around(share: float, width: float) -> Array:
    """Shares of a piece around one, by a width on either side at most."""
    shares: Array = np.linspace(max(share - width, 0.0), min(share + width, 1.0), 2 * int(2.0 * ZOOM) + 1)
    return shares


@cache
def legendre(count: int) -> tuple[Array, Array, Array]:
    """Gauss-Legendre nodes on [0, 1], weights of sum 1, and the matrix from values there to Legendre coefficients."""
    places, weights = np.polynomial.legendre.leggauss(count)
    polynomials = np.polynomial.legendre.legvander(places, count - 1)
    matrix = (polynomials * weights[:, None]).T * (np.arange(count)[:, None] + 0.5)
    return frozen(0.5 * (1.0 + places)), frozen(0.5 * weights), frozen(matrix)


def response_matrices(durations: Array, shares: Array, count: int) -> Array:
    """Matrices (P, U, N) from values at pieces' nodes to the response at shares of them, from 0 at their begins.

    Args:
        durations: durations of the pieces over the time constant, shape (P,).
        shares: shares from 0 to 1, shape (U,).
        count: number of nodes, N.
    """
    nodes = legendre(count)[0]
    grown = np.exp(durations[:, None, None] * (nodes - shares[:, None]))
    matrices: Array = durations[:, None, None] * _integrals(tuple(shares.tolist()), count) * grown
    return matrices


@lru_cache(maxsize=64)
def _integrals(shares: tuple[float, ...], count: int) -> Array:
    """Matrix (U, N) from values at a piece's nodes to integrals from its begin to shares of it, over its duration."""
    polynomials = np.polynomial.legendre.legvander(2.0 * np.array(shares) - 1.0, count)
    between = (polynomials[:, 2:] - polynomials[:, :-2]) / (2.0 * np.arange(1, count) + 1.0)
    integrals = np.concatenate([2.0 * np.array(shares)[:, None], between], axis=1)
    return frozen(0.5 * integrals @ legendre(count)[2])
