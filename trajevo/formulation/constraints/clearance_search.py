"""Least distances along motions, proven between samples by branch and bound.

Over an interval with distances d₀, d₁ at its ends a distance stays above (d₀ + d₁ - T)/2, with T how far both solids
can move relative to each other. Sixteenths of segments come first; those whose bound is too low are halved until it is
high enough or within a tolerance of the distance. Distances are computed only where lower bounds leave it open whether
they are the least ones, so that the results are those of all pairs at all instants.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import final

import numpy as np

from trajevo.base import jit
from trajevo.base.arrays import Array
from trajevo.formulation.constraints.broad_phase import search_loops
from trajevo.formulation.constraints.broad_phase.near import Grid, KnownDistances, Near, Sieve, ask_least
from trajevo.formulation.constraints.broad_phase.sweeps import Sweeps
from trajevo.formulation.constraints.collision import DISTANCE_ERROR, Collision
from trajevo.trajectory.batch import TrajectoryBatch


def kinds_of(collision: Collision) -> Array:
    """Kind of every pair, 0 with an obstacle and 1 for two links of the robot, shape (n_pairs,)."""
    return np.array([int(pair.itself) for pair in collision.pairs], dtype=np.intp)


@dataclass(frozen=True, eq=False)
class Spans:
    """J intervals of time.

    Attributes:
        row: index of the trajectory, (J,).
        segment: index of its segment, (J,).
        t: both ends, (2, J) [s].
        q: joint positions there, (2, J, n_joints) [rad or m].
        v: joint velocities there, within the segment, (2, J, n_joints) [rad/s or m/s]; (2, J, 0) if not needed.
        travel: how far the solids of each column of :class:`Sweeps` can move relative to each other, (J, columns) [m].
    """

    row: Array
    segment: Array
    t: Array
    q: Array
    v: Array
    travel: Array

    def used(self, index: Array) -> tuple[Spans, Array]:
        """Those with given indices, each once and in order, and the new indices."""
        marked = np.zeros(len(self.row), dtype=bool)
        marked[index] = True
        t, q, v = (each[:, marked] for each in (self.t, self.q, self.v))
        used = Spans(self.row[marked], self.segment[marked], t, q, v, self.travel[marked])
        return used, (np.cumsum(marked) - 1)[index]

    def halves(self, sweeps: Sweeps, middle: tuple[Array, Array, Array]) -> Spans:
        """Their first halves, then their second halves; the middle's instants, positions and velocities are given."""
        t, q, v = (
            np.stack([ends[0], inner, ends[1]]) for ends, inner in zip((self.t, self.q, self.v), middle, strict=True)
        )
        placed = sweeps.bodies.placed(np.swapaxes(q, 0, 1).reshape(-1, q.shape[2]))
        between = sweeps.bodies.moved(placed)  # the third of three is from one interval to the next
        moved = np.concatenate([between[0::3], between[1::3]])
        t, q, v = (np.concatenate([each[:2], each[1:]], axis=1) for each in (t, q, v))
        row, segment = np.tile(self.row, 2), np.tile(self.segment, 2)
        return Spans(row, segment, t, q, v, sweeps.travel((row, segment), moved, v, t[1] - t[0]))


@dataclass(frozen=True, eq=False)
class Intervals:
    """K intervals of time, each of one pair.

    Attributes:
        pieces: J intervals of time.
        piece: index of the interval of time, ascending, (K,).
        pair: index of the pair, (K,).
        d: distances at both ends, (2, K) [m].
        known: a lower bound that is already proven, (K,) [m].
        proof: both ends of the interval for which this bound was proven, (2, K) [s].
    """

    pieces: Spans
    piece: Array
    pair: Array
    d: Array
    known: Array
    proof: Array

    @property
    def row(self) -> Array:
        """Indices of the trajectories, (K,)."""
        return self.pieces.row[self.piece]

    def chosen(self, keep: Array) -> Intervals:
        """The intervals selected by a mask, (K,)."""
        pieces, piece = self.pieces.used(self.piece[keep])
        return Intervals(pieces, piece, self.pair[keep], self.d[:, keep], self.known[keep], self.proof[:, keep])


@final
class Least:
    """Least distances of B motions to obstacles and to itself (B, 2) [m], their pairs and time intervals (2, B, 2)."""

    def __init__(self, count: int) -> None:
        self.d, self.pair, self.t = np.full((count, 2), np.inf), np.zeros((count, 2), np.intp), np.zeros((2, count, 2))

    def take(self, row: Array, kind: Array, pair: Array, d: Array, t: Array) -> None:
        """Take in distances (K,) of pairs in intervals t, (2, K); of equal ones the first."""
        if jit.can_compile():
            search_loops.take(row, kind, pair, d, t, self.d, self.pair, self.t)
            return
        better = np.flatnonzero(d < self.d[row, kind])
        if not len(better):
            return
        group = 2 * row[better] + kind[better]
        order = np.lexsort((pair[better], t[0, better], d[better], group))
        least = better[order[np.flatnonzero(np.diff(group[order], prepend=-1))]]
        row, kind = row[least], kind[least]
        self.d[row, kind], self.pair[row, kind], self.t[:, row, kind] = d[least], pair[least], t[:, least]


@dataclass(eq=False)
class ClearanceSearch:
    """Branch and bound for a batch: the least sampled and the least proven distances.

    Attributes:
        collision: robot and scene.
        trajectory: B trajectories.
        wanted: clearance to obstacles and to itself, shape (2,) [m].
        tolerance: how far a proven distance may be below the sampled one where that matters [m].
        to_the_end: whether it matters everywhere, not only where it decides whether the clearance is kept.
    """

    collision: Collision
    trajectory: TrajectoryBatch
    wanted: Array
    tolerance: float
    to_the_end: bool = False
    sampled: Least = field(init=False)
    proven: Least = field(init=False)

    def __post_init__(self) -> None:
        self.kind, self.sweeps = kinds_of(self.collision), Sweeps(self.collision, self.trajectory)
        self.grid = Grid(self.trajectory, self.sweeps)
        self.sampled, self.proven = Least(len(self.trajectory)), Least(len(self.trajectory))

    def start(self) -> Intervals:
        """The even intervals of every segment that may decide and are still open; takes in samples at their ends."""
        bounds, column, error = self.collision.lower_bounds, self.sweeps.column, 2.0 * DISTANCE_ERROR
        sieve, P = Sieve(bounds, self.grid, self.kind, column, self._known, error), len(self.kind)
        near = sieve.near()
        instants = near.interval + near.interval // (self.grid.size - 1) + np.array([[0], [1]])
        numbers, ends = np.unique(instants * P + near.pair, return_inverse=True)
        ends = ends.reshape(instants.shape)
        states = KnownDistances(*np.divmod(numbers, P), self._known)
        lower = np.empty(len(numbers))
        lower[ends] = near.lower
        row, kind = states.instant // self.grid.size, self.kind[states.pair]
        # A motion that keeps the clearance is judged by bounds, so that its samples need not be known.
        most = sieve.nearest if self.to_the_end else np.minimum(sieve.nearest, self.wanted)
        asked = ask_least(2 * row + kind, lower, most.ravel(), states.distances)
        t = self.grid.instants(states.instant[asked])
        self.sampled.take(row[asked], kind[asked], states.pair[asked], states.d[asked], np.stack([t, t]))
        return self._open(self._deciding(near, ends, states, sieve.nearest.ravel()))

    def _deciding(self, near: Near, ends: Array, states: KnownDistances, most: Array) -> Intervals:
        """The intervals that may have the least bound of their motions, none of those whose samples decide."""
        row = near.interval // (self.grid.size - 1)
        kind, travel = self.kind[near.pair], self.grid.travel[near.interval, self.sweeps.column[near.pair]]
        enough = self._enough()
        judged = np.flatnonzero((self.sampled.d >= self.wanted)[row, kind] | self.to_the_end)

        def bounds(asked: Array) -> Array:
            chosen = judged[asked]
            d = states.distances(ends[:, chosen])
            bound = 0.5 * (d.sum(axis=0) - travel[chosen])
            # Halves of an interval that has to be halved are bounded by at most the distance at its ends.
            high: Array = np.where(bound < enough[row[chosen], kind[chosen]], d.min(axis=0), bound)
            return high

        lower = 0.5 * (near.lower.sum(axis=0) - travel)
        chosen = judged[ask_least((2 * row + kind)[judged], lower[judged], most, bounds)]
        chosen = chosen[np.argsort(near.interval[chosen], kind="stable")]
        d, unproven = states.distances(ends[:, chosen]), np.full(len(chosen), -np.inf)
        numbers, piece = np.unique(near.interval[chosen], return_inverse=True)
        pieces = Spans(*self.grid.ends(numbers), self.grid.travel[numbers])
        return Intervals(pieces, piece, near.pair[chosen], d, unproven, pieces.t[:, piece])

    def _known(self, instant: Array, pair: Array) -> Array:
        """Distances at instants of the grid in ascending order, (K,) [m]."""
        new = np.diff(instant, prepend=-1) != 0
        q = self.grid.q.reshape(-1, self.trajectory.n_joints)[instant[new]]
        return self.collision.distances_of(q, np.cumsum(new) - 1, pair) - DISTANCE_ERROR

    def halve(self, work: Intervals) -> Intervals:
        """Sample the middle of every interval and keep the halves that are still open."""
        pieces, row = work.pieces, work.row
        middle = 0.5 * (pieces.t[0] + pieces.t[1])
        own = self.trajectory.real_rows(pieces.row)
        q = own.evaluate(middle[:, None], 0)[:, 0]
        v = own.evaluate(middle[:, None], 1)[:, 0] if self.sweeps.need_velocities else pieces.v[0]
        d = self.collision.distances_of(q, work.piece, work.pair) - DISTANCE_ERROR
        self.sampled.take(row, self.kind[work.pair], work.pair, d, np.broadcast_to(middle[work.piece], (2, len(d))))
        ends = np.concatenate([np.stack([work.d[0], d]), np.stack([d, work.d[1]])], axis=1)
        halves = pieces.halves(self.sweeps, (middle, q, v))
        piece = np.concatenate([work.piece, work.piece + len(middle)])
        return self._open(
            Intervals(halves, piece, np.tile(work.pair, 2), ends, np.tile(work.known, 2), np.tile(work.proof, 2))
        )

    def _open(self, work: Intervals) -> Intervals:
        """Settle the intervals that are proven or need no further halving, and return the others."""
        kind, row, (bound, proof, settled) = self.kind[work.pair], work.row, self._bound(work)
        self.proven.take(row[settled], kind[settled], work.pair[settled], bound[settled], proof[:, settled])
        return Intervals(work.pieces, work.piece, work.pair, work.d, bound, proof).chosen(~settled)

    def _enough(self) -> Array:
        """Bounds from which on an interval needs no halving, (B, 2) [m]."""
        sampled, wanted = self.sampled.d, self.wanted
        if self.to_the_end:
            return np.where(sampled < wanted, sampled - self.tolerance, np.maximum(sampled - self.tolerance, wanted))
        return np.where(sampled < wanted, -np.inf, wanted)

    def _bound(self, work: Intervals) -> tuple[Array, Array, Array]:
        """Lower bounds (K,) [m], the intervals for which they were proven, (2, K) [s], and which need no halving."""
        pieces, enough = work.pieces, self._enough()
        if jit.can_compile():
            known, proof, settled = work.known.copy(), work.proof.copy(), np.empty(len(work.pair), bool)
            given = work.piece, work.pair, pieces.row, self.kind, work.d, self.sweeps.column, pieces.travel, pieces.t
            search_loops.settle(*given, enough, self.tolerance, known, proof, settled)
            return known, proof, settled
        travel = pieces.travel[work.piece, self.sweeps.column[work.pair]]
        own = 0.5 * (work.d.sum(axis=0) - travel)
        better = own > work.known
        bound, proof = np.where(better, own, work.known), np.where(better, pieces.t[:, work.piece], work.proof)
        settled = (bound >= enough[work.row, self.kind[work.pair]]) | (0.5 * travel <= self.tolerance)
        return bound, proof, settled
