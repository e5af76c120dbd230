"""What drives draw and give back, and what a DC link makes of it: mains, capacitors, braking resistor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from trajevo.base import polynomials
from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.dynamics.drives.smooth_pieces import NODES, SHARES, WEIGHTS, SmoothPieces

#: Coefficients of powers on [0, 1] from values at the nodes of a piece, shape (N, N).
_POWERS = np.linalg.inv(np.vander(SHARES, increasing=True))


@final
@dataclass(frozen=True, eq=False)
class Works:
    """Work in Q parts of motions in each of which a power keeps its sign.

    Attributes:
        segments: numbers of their segments among all S of all B trajectories, shape (Q,).
        begins: where they begin in their segments, shares of shape (Q,).
        net: the work, positive if it is drawn, shape (Q,) [J].
        columns: numbers of the powers of their pieces that do it, shape (Q,).
    """

    segments: Array
    begins: Array
    net: Array
    columns: Array

    __repr__ = brief

    @property
    def drawn(self) -> Array:
        """The work where it is drawn, 0 where it is given back, shape (Q,) [J]."""
        return np.where(self.net.real > 0.0, self.net, 0.0)


def powers_of(values: Array) -> Array:
    """Coefficients of powers of shares of pieces from values at their nodes, shapes (K, N) -> (N, K)."""
    return np.stack([_weighted(row, values.T) for row in _POWERS])


def works_of(pieces: SmoothPieces, power: Array) -> Works:
    """The work of powers in parts in which they keep their signs.

    Args:
        pieces: L smooth pieces.
        power: C powers at the nodes of the pieces, shape (L, N, C) [W].
    """
    count = power.shape[2]
    power = power.swapaxes(1, 2).reshape(-1, NODES)
    real = power.real
    # Between nodes a power goes no further than it does from one node to the next, as far as a sign is concerned.
    mixed = np.abs(real).min(axis=1) <= np.abs(np.diff(real, axis=1)).max(axis=1)
    clear, some = np.flatnonzero(~mixed), np.flatnonzero(mixed)
    whole = _weighted(WEIGHTS, power[clear].T)
    coefficients = powers_of(power[some])
    start, end = np.zeros(len(some)), np.ones(len(some))
    which, lower, upper = polynomials.of_one_sign(coefficients.real, start, end)
    integral = np.concatenate([np.zeros_like(coefficients[:1]), coefficients / np.arange(1.0, NODES + 1.0)[:, None]])
    ends = [polynomials.values(integral[:, which], at) for at in (upper, lower)]
    number, share = np.concatenate([clear, some[which]]), np.concatenate([np.zeros(len(clear)), lower])
    found = number // count
    per_share = np.concatenate([whole, ends[0] - ends[1]])
    return Works(
        pieces.segments[found],
        pieces.begins[found].real + share * pieces.widths[found].real,
        per_share * pieces.durations[found],
        number % count,
    )


@final
@dataclass(frozen=True, eq=False)
class Link:
    """What a link that stores energy made of B motions, each array (B,) [J].

    Attributes:
        drawn: what came from the mains.
        burnt: what the braking resistor took.
        stored: what is left in the capacitors.
    """

    drawn: Array
    burnt: Array
    stored: Array

    __repr__ = brief


def link_of(works: Sequence[Works], shape: tuple[int, ...], storable: float) -> Link:
    """A link that begins at the voltage of the mains.

    Args:
        works: all parts of all motions.
        shape: numbers of trajectories and of segments, (B, S).
        storable: what capacitors can store beyond that voltage [J].
    """
    segments, begins, net = (np.concatenate([getattr(one, name) for one in works]) for name in _COLUMNS)
    order = np.lexsort((begins, segments))
    rows, net = segments[order] // shape[1], net[order]
    places = np.arange(len(rows)) - np.searchsorted(rows, rows)
    parts = np.zeros((int(places.max(initial=-1)) + 1, shape[0]), dtype=net.dtype)
    parts[places, rows] = net
    drawn, burnt, stored = (np.zeros(shape[0], dtype=net.dtype) for _ in range(3))
    for part in parts:
        left = stored - part
        drawn = drawn + np.where(left.real < 0.0, -left, 0.0)
        burnt = burnt + np.where(left.real > storable, left - storable, 0.0)
        stored = np.where(left.real < 0.0, 0.0, np.where(left.real > storable, storable, left))
    return Link(drawn, burnt, stored)


_COLUMNS = ("segments", "begins", "net")


def _weighted(weights: Array, values: Array) -> Array:
    """Sum over the first axis of weights (N,) times values (N, K), with the same digits whatever K is."""
    total: Array = weights[0] * values[0]
    for weight, value in zip(weights[1:], values[1:], strict=True):
        total = total + weight * value
    return total
