"""Which pairs of solids can decide a motion's clearance, and when: every other one is provably further apart.

A distance changes at most by how far its solids move. Starting at the halves of every segment, lower bounds of the
distances at both ends of an interval therefore bound the distance within, and pairs that stay further apart than a
distance that is known are left out; what is left is halved.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.formulation.constraints.broad_phase import loops
from trajevo.formulation.constraints.broad_phase.bodies import PlacedByLoops
from trajevo.formulation.constraints.broad_phase.lower_bounds import LowerBounds
from trajevo.formulation.constraints.broad_phase.sweeps import Sweeps
from trajevo.trajectory.batch import TrajectoryBatch

#: Number of intervals of every segment in the end, a power of two, and at the start.
INTERVALS, _FIRST = 16, 2


@final
class Grid:
    """States of B motions at the ends of even intervals of all S segments, whose ends are the starts of the next.

    Args:
        trajectory: the motions.
        sweeps: how far solids move.

    Attributes:
        size: number of instants of each motion, S x INTERVALS + 1.
        segments: number S of segments.
        q: positions, shape (B, size, n_joints) [rad or m].
        v: velocities within the segment, shape (B, S, INTERVALS + 1, n_joints) [rad/s or m/s]; (..., 0) if not needed.
        dt: durations of the segments, shape (B, S) [s].
        t: instants, shape (B, S, INTERVALS + 1) [s].
        placed: the solids in all states, B x size of them.
        travel: how far the solids of each column can move relative to each other in every interval, shape
            (B x S x INTERVALS, columns) [m].
    """

    def __init__(self, trajectory: TrajectoryBatch, sweeps: Sweeps) -> None:
        shares = np.linspace(0.0, 1.0, INTERVALS + 1)
        B, S, n = len(trajectory), trajectory.breaks.shape[1] - 1, trajectory.n_joints
        q = trajectory.at_shares(shares, 0).reshape(B, S, len(shares), n)
        v = trajectory.at_shares(shares, 1) if sweeps.need_velocities else np.empty((B, S * len(shares), 0))
        self.v = v.reshape(B, S, len(shares), -1)
        self.dt = dt = trajectory.segment_durations
        self.t = trajectory.breaks[:, :-1, None] + shares * dt[:, :, None]
        self.segments, self.size = S, S * INTERVALS + 1
        self.q = np.concatenate([q[:, :, :-1].reshape(B, -1, n), q[:, -1, -1:]], axis=1)
        self.placed = sweeps.bodies.placed(self.q.reshape(-1, n))
        interval = np.arange(B * S * INTERVALS)
        row, segment = np.divmod(interval // INTERVALS, S)
        moved = sweeps.bodies.moved(self.placed)[interval + row]
        v = np.stack([self.v[:, :, side : INTERVALS + side].reshape(len(row), -1) for side in (0, 1)])
        self.travel = sweeps.travel((row, segment), moved, v, dt[row, segment] / INTERVALS)

    def ends(self, interval: Array) -> tuple[Array, Array, Array, Array, Array]:
        """Rows, segments, and instants, positions and velocities at both ends, of intervals by their numbers (J,)."""
        row, segment = np.divmod(interval // INTERVALS, self.segments)
        steps = interval % INTERVALS + np.array([[0], [1]])
        return (
            row,
            segment,
            self.t[row, segment, steps],
            self.q[row, segment * INTERVALS + steps],
            self.v[row, segment, steps],
        )

    def instants(self, number: Array) -> Array:
        """Instants by their numbers [s]."""
        row, step = np.divmod(number, self.size)
        segment = np.minimum(step // INTERVALS, self.segments - 1)
        instants: Array = self.t[row, segment, step - segment * INTERVALS]
        return instants


@final
@dataclass(frozen=True, eq=False)
class Near:
    """K intervals between neighbouring steps of a grid, each of one pair.

    Attributes:
        interval: number of the interval, (K,): those of a segment follow each other, then those of the next segment.
        pair: index of the pair, (K,).
        lower: lower bounds of the distance at both ends, (2, K) [m].
    """

    interval: Array
    pair: Array
    lower: Array


@final
class Sieve:
    """Leaves out what is provably no closer than a distance that is known.

    Args:
        bounds: lower bounds of distances.
        grid: the motions' states.
        kind: kind of every pair, 0 or 1, shape (n_pairs,).
        column: column of every pair in :attr:`Grid.travel`, shape (n_pairs,).
        known: numbers of instants and indices of pairs, (M,) each, -> their distances, (M,) [m].
        error: how far a distance may be below its lower bound [m].

    Attributes:
        nearest: a distance of each motion and kind of pair, near its least one, shape (B, 2) [m]; inf without pairs.
    """

    def __init__(
        self,
        bounds: LowerBounds,
        grid: Grid,
        kind: Array,
        column: Array,
        known: Callable[[Array, Array], Array],
        error: float,
    ) -> None:
        self.bounds, self.grid, self.kind, self.column, self.error = bounds, grid, kind, column, error
        self.coarse = self._coarse()
        self.nearest = self._nearest(known)

    def near(self) -> Near:
        """What is left."""
        width = INTERVALS // _FIRST
        if isinstance(self.grid.placed, PlacedByLoops):
            return self._near_by_loops(self.grid.placed, width)
        near = self._first(width)
        while width > 1:
            width //= 2
            near = self._halved(near, width)
        return near

    def _coarse(self) -> Array:
        """Bounds at the ends of the first intervals, shape (n_pairs, B, S x _FIRST + 1) [m]."""
        grid = self.grid
        solids, axes, _ = grid.placed.whole.shape
        centres = grid.placed.whole.reshape(solids, axes, -1, grid.size)[..., :: INTERVALS // _FIRST]
        found = self.bounds.everywhere(centres.reshape(solids, axes, -1)) - self.error
        return found.reshape(len(found), *centres.shape[2:])

    def _nearest(self, known: Callable[[Array, Array], Array]) -> Array:
        """The distance where the bound is least."""
        B = self.coarse.shape[1]
        nearest = np.full((B, 2), np.inf)
        for kind in np.unique(self.kind).tolist():
            pairs = np.flatnonzero(self.kind == kind)
            least = np.moveaxis(self.coarse[pairs], 0, 2).reshape(B, -1).argmin(axis=1)
            end, pair = np.divmod(least, len(pairs))
            nearest[:, kind] = known(np.arange(B) * self.grid.size + end * (INTERVALS // _FIRST), pairs[pair])
        return nearest

    def _near_by_loops(self, placed: PlacedByLoops, width: int) -> Near:
        """The same in one loop, which halves one interval after the other."""
        pair, row, end = np.nonzero(self._close(width))
        begin, count = np.stack([pair, row, end * width]), np.zeros(1, dtype=np.int64)
        found, lower = np.empty((2, len(pair) * width), dtype=np.int64), np.empty((2, len(pair) * width))
        most, sizes = self.nearest[:, self.kind], (self.error, self.grid.size, width)
        given: list[Any] = [placed.frames, *self.bounds.for_loops, self.grid.travel, self.column, most, *sizes]
        given += [begin, found, lower, count]
        loops.near(*given)
        interval, pair = found[:, : count[0]]
        return Near(interval, pair, lower[:, : count[0]])

    def _close(self, width: int) -> Array:
        """Mask of the first intervals that the bounds at their ends leave, shape (n_pairs, B, S x _FIRST)."""
        travel, ends = self._travel(width).T, self.coarse[:, :, :-1] + self.coarse[:, :, 1:]
        close: Array = ends - travel[self.column].reshape(ends.shape) < 2.0 * self.nearest[:, self.kind].T[:, :, None]
        return close

    def _first(self, width: int) -> Near:
        """What is left of the first intervals."""
        coarse, column, close = self.coarse, self.column, self._close(width)
        travel, most = self._travel(width).T, 2.0 * self.nearest[:, self.kind].T
        # Closer bounds where they are needed.
        needed = np.zeros(coarse.shape, dtype=bool)
        needed[:, :, :-1] |= close
        needed[:, :, 1:] |= close
        pair, row, end = np.nonzero(needed)
        state = row * self.grid.size + end * width
        coarse[pair, row, end] = self.bounds.of(self.grid.placed, state, pair) - self.error
        pair, row, end = np.nonzero(close)
        lower = np.stack([coarse[pair, row, end], coarse[pair, row, end + 1]])
        piece = row * close.shape[2] + end
        left = np.flatnonzero(lower.sum(axis=0) - travel[column[pair], piece] < most[pair, row])
        return Near(piece[left] * width, pair[left], lower[:, left])

    def _halved(self, near: Near, width: int) -> Near:
        """What is left of halves."""
        row = near.interval // (self.grid.size - 1)
        middle = self.bounds.of(self.grid.placed, near.interval + row + width, near.pair) - self.error
        most, column = 2.0 * self.nearest[row, self.kind[near.pair]], self.column[near.pair]
        travel, halves = self._travel(width), []
        for side in (0, 1):
            start = near.interval + side * width
            lower = np.stack([middle, near.lower[1]] if side else [near.lower[0], middle])
            left = np.flatnonzero(lower.sum(axis=0) - travel[start // width, column] < most)
            halves.append((start[left], near.pair[left], lower[:, left]))
        return Near(*(np.concatenate(both, axis=-1) for both in zip(*halves, strict=True)))

    def _travel(self, width: int) -> Array:
        """How far the solids of each column move relative to each other in intervals of a width, at most."""
        travel: Array = self.grid.travel.reshape(-1, width, self.grid.travel.shape[1]).sum(axis=1)
        return travel


@final
class KnownDistances:
    """Distances of pairs at instants, K of them in ascending order of the instants, computed when they are asked for.

    Args:
        instant: numbers of instants, shape (K,).
        pair: indices of pairs, shape (K,).
        compute: numbers of instants and indices of pairs, (M,) each, -> distances, (M,) [m].

    Attributes:
        d: distances, NaN where they were not asked for, shape (K,) [m].
    """

    def __init__(self, instant: Array, pair: Array, compute: Callable[[Array, Array], Array]) -> None:
        self.instant, self.pair, self.compute = instant, pair, compute
        self.d = np.full(len(instant), np.nan)

    def distances(self, chosen: Array) -> Array:
        """Distances of states by their indices, the same shape [m]."""
        needed = np.zeros(len(self.d), dtype=bool)
        needed[chosen] = True
        new = np.flatnonzero(needed & np.isnan(self.d))
        self.d[new] = self.compute(self.instant[new], self.pair[new])
        return self.d[chosen]


def ask_least(group: Array, lower: Array, most: Array, ask: Callable[[Array], Array]) -> Array:
    """Ask for values until the least one of every group is known, as far as it is less than a known number.

    Args:
        group: index of the group of each value, shape (K,).
        lower: numbers below the values, shape (K,).
        most: known number of every group, shape (G,); becomes the least value asked for if that is less.
        ask: indices (M,) -> values, (M,).

    Returns:
        Indices of the values asked for; all that are equal to the least of their group are among them.
    """
    asked, open_ = [], lower < most[group]
    for best in (True, False):
        chosen = open_ & (lower < most[group])
        if best:  # one or few of every group, that others need not be asked for
            least = np.full(len(most), np.inf)
            np.minimum.at(least, group, lower)
            chosen &= lower == least[group]
        asked.append(np.flatnonzero(chosen))
        open_ &= ~chosen
        np.minimum.at(most, group[asked[-1]], ask(asked[-1]))
    return np.concatenate(asked)
