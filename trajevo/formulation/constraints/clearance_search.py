"""Least distances along motions, proven between samples by branch and bound.

Over an interval Δt with distances d₀, d₁ at its ends a distance stays above (d₀ + d₁ - Σ reach ∫|v| dt)/2. Intervals
whose bound is too low are halved until the bound is high enough or within a tolerance of the distance.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.formulation.constraints.collision import DISTANCE_ERROR, Collision
from trajevo.trajectory.batch import TrajectoryBatch

#: Number of halvings in the search for the greatest depth of a collision; 3 give 16 intervals per segment.
_SEARCHED = 3


def kinds_of(collision: Collision) -> Array:
    """Kind of every pair, 0 with an obstacle and 1 for two links of the robot, shape (n_pairs,)."""
    return np.array([int(pair.itself) for pair in collision.pairs], dtype=np.intp)


def states_at(
    trajectory: TrajectoryBatch, row: Array, t: Array, derivatives: tuple[int, ...]
) -> tuple[list[Array], Array, Array]:
    """Distinct states of trajectories.

    Args:
        trajectory: B trajectories.
        row: index of the trajectory of each instant, shape (K,).
        t: instants, shape (K,) [s].
        derivatives: orders of the derivatives, 0 for positions.

    Returns:
        Each derivative in N distinct states, (N, n_joints), the trajectory of each state, (N,), and the state of each
        instant, (K,).
    """
    instants, state = np.unique(np.stack([row, t], axis=1), axis=0, return_inverse=True)
    own = instants[:, 0].astype(np.intp)
    column = np.arange(len(own)) - np.searchsorted(own, own)  # place among the instants of its trajectory
    padded = np.zeros((len(trajectory), column.max(initial=0) + 1))
    padded[own, column] = instants[:, 1]
    return [trajectory.evaluate(padded, derivative)[own, column] for derivative in derivatives], own, state


def furthest(v: Array, peak: Array, dt: Array) -> Array:
    """How far joints can move in an interval: |v| is at most both |v₀| + a τ and |v₁| + a (Δt - τ).

    Args:
        v: velocities at both ends, shape (2, ..., n_joints) [rad/s or m/s]; complex steps are kept.
        peak: greatest |acceleration| a, shape (..., n_joints) [rad/s² or m/s²].
        dt: length Δt of the interval, shape (..., 1) [s].

    Returns:
        Shape (..., n_joints) [rad or m].
    """
    speed = v * np.sign(v.real)
    most: Array = 0.5 * speed.sum(axis=0) * dt + 0.25 * peak * dt**2
    return most


@dataclass(frozen=True, eq=False)
class Intervals:
    """K time intervals, each of one pair.

    Attributes:
        row: index of the trajectory, (K,).
        pair: index of the pair, (K,).
        t: both ends, (2, K) [s].
        v: joint velocities at both ends, within the segment, (2, K, n_joints) [rad/s or m/s].
        d: distances at both ends, (2, K) [m].
        known: a lower bound that is already proven, (K,) [m].
        proof: both ends of the interval for which this bound was proven, (2, K) [s].
    """

    row: Array
    pair: Array
    t: Array
    v: Array
    d: Array
    known: Array
    proof: Array

    def chosen(self, keep: Array) -> Intervals:
        """The intervals selected by a mask, (K,)."""
        single = {name: getattr(self, name)[keep] for name in ("row", "pair", "known")}
        return Intervals(**single, **{name: getattr(self, name)[:, keep] for name in ("t", "v", "d", "proof")})


@final
class Least:
    """Least distances of B motions to obstacles and to itself (B, 2) [m], their pairs and time intervals (2, B, 2)."""

    def __init__(self, count: int) -> None:
        self.d, self.pair, self.t = np.full((count, 2), np.inf), np.zeros((count, 2), np.intp), np.zeros((2, count, 2))

    def take(self, row: Array, kind: Array, pair: Array, d: Array, t: Array) -> None:
        """Take in distances (K,) of pairs in intervals t, (2, K)."""
        better = d < self.d[row, kind]
        row, kind, d = row[better], kind[better], d[better]
        np.minimum.at(self.d, (row, kind), d)
        least = d == self.d[row, kind]
        row, kind = row[least], kind[least]
        self.pair[row, kind], self.t[:, row, kind] = pair[better][least], t[:, better][:, least]


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
    halvings: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        trajectory = self.trajectory
        self.reach = self.collision.reach(*trajectory.extremes(0))
        self.peak = trajectory.peak(2)
        self.kind = kinds_of(self.collision)
        self.sampled, self.proven = Least(len(trajectory)), Least(len(trajectory))

    def start(self) -> Intervals:
        """Both halves of every segment."""
        trajectory, shares = self.trajectory, np.array([0.0, 0.5, 1.0])
        B, S, n = len(trajectory), trajectory.breaks.shape[1] - 1, trajectory.n_joints
        q, v = (trajectory.at_shares(shares, order).reshape(B, S, 3, n) for order in (0, 1))
        t = trajectory.breaks[:, :-1, None] + shares * trajectory.segment_durations[:, :, None]
        ends = np.concatenate([q[:, :, :2].reshape(B, 2 * S, n), q[:, -1, 2:]], axis=1)
        motion = np.repeat(np.arange(B), 2 * S + 1)
        d = self.collision.distances(ends.reshape(-1, n), motion=motion).reshape(B, 2 * S + 1, -1) - DISTANCE_ERROR
        row, step, pair = (index.ravel() for index in np.indices((B, 2 * S, d.shape[2])))
        segment, half = step // 2, step % 2
        ends_t = np.stack([t[row, segment, half], t[row, segment, half + 1]])
        self._sample(row, pair, d[row, step, pair], ends_t[0])
        self._sample(row, pair, d[row, step + 1, pair], ends_t[1])
        return self._open(
            Intervals(
                row=row,
                pair=pair,
                t=ends_t,
                v=np.stack([v[row, segment, half], v[row, segment, half + 1]]),
                d=np.stack([d[row, step, pair], d[row, step + 1, pair]]),
                known=np.full(len(row), -np.inf),
                proof=ends_t,
            )
        )

    def halve(self, work: Intervals) -> Intervals:
        """Sample the middle of every interval and keep the halves that are still open."""
        self.halvings += 1
        middle = work.t.mean(axis=0)
        d, v = self._look(work, middle)
        self._sample(work.row, work.pair, d, middle)
        known, proof = self._bound(work)
        inner = {"t": middle, "v": v, "d": d}
        left = {name: np.stack([getattr(work, name)[0], value]) for name, value in inner.items()}
        right = {name: np.stack([value, getattr(work, name)[1]]) for name, value in inner.items()}
        halves = {name: np.concatenate([left[name], right[name]], axis=1) for name in inner}
        row, pair, known = (np.tile(values, 2) for values in (work.row, work.pair, known))
        return self._open(Intervals(row=row, pair=pair, known=known, proof=np.tile(proof, 2), **halves))

    def _look(self, work: Intervals, t: Array) -> tuple[Array, Array]:
        """Distances (K,) and joint velocities (K, n_joints) at one instant of every interval."""
        (q, v), row, state = states_at(self.trajectory, work.row, t, (0, 1))
        order, d = np.argsort(state, kind="stable"), np.empty(len(t))
        d[order] = self.collision.distances_of(q, state[order], work.pair[order], motion=row) - DISTANCE_ERROR
        return d, v[state]

    def _open(self, work: Intervals) -> Intervals:
        """Settle the intervals that are proven or need no further halving, and return the others."""
        kind, (bound, proof) = self.kind[work.pair], self._bound(work)
        sampled = self.sampled.d[work.row, kind]
        collides = sampled < self.wanted[kind]
        near = np.where(collides, -np.inf, self.wanted[kind])
        enough = np.maximum(sampled - self.tolerance, near) if self.to_the_end else self.wanted[kind]
        settled = np.where(
            collides & (not self.to_the_end),
            (bound >= sampled) | (self.halvings >= _SEARCHED),
            (bound >= enough) | (0.5 * self._travel(work) <= self.tolerance),
        )
        self.proven.take(work.row[settled], kind[settled], work.pair[settled], bound[settled], proof[:, settled])
        return work.chosen(~settled)

    def _bound(self, work: Intervals) -> tuple[Array, Array]:
        """Lower bounds (K,) [m] and the intervals for which they were proven, (2, K) [s]."""
        own = 0.5 * (work.d.sum(axis=0) - self._travel(work))
        better = own > work.known
        return np.where(better, own, work.known), np.where(better, work.t, work.proof)

    def _travel(self, work: Intervals) -> Array:
        """How far the two solids can move relative to each other, (K,) [m]."""
        most = furthest(work.v, self.peak[work.row], (work.t[1] - work.t[0])[:, None])
        travel: Array = (self.reach[work.row, work.pair] * most).sum(axis=1)
        return travel

    def _sample(self, row: Array, pair: Array, d: Array, t: Array) -> None:
        self.sampled.take(row, self.kind[pair], pair, d, np.stack([t, t]))
