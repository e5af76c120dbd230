"""Distances along motions whose decision variables take complex steps: derivatives for gradient solvers.

The joints of a complex step are q + i ε q', with q' the derivative along the step; to first order a distance there is
d(q) + i ε ∂d/∂q · q'. A batch for a gradient holds a row per decision variable; all have the same real part, for which
distances and their derivatives are computed once.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.rollout import Rollout
from trajevo.formulation.constraints.broad_phase.sweeps import Sweeps
from trajevo.formulation.constraints.clearance_search import kinds_of
from trajevo.formulation.constraints.collision import DISTANCE_ERROR, Collision
from trajevo.formulation.constraints.scene import Scene
from trajevo.trajectory.batch import TrajectoryBatch

#: Least divisor of a column [m], since a clearance of 0 cannot be one.
_LEAST_SCALE = 0.01

#: Intervals of every segment whose ends are sampled for the terms, and steps of each to which minima are refined.
_INTERVALS, _FINER = 16, 256
_SHARE = 1.0 / (_INTERVALS * _FINER)
#: Tolerances that the terms add to a clearance: one for the proof, the rest for what is missed between steps.
_KEPT = 1.05

#: Shares of a segment are rounded to multiples of this; halving yields such multiples but for rounding errors.
_FINEST_SHARE = 2.0**-40


def wanted_clearances(scene: Scene) -> Array:
    """Clearance to obstacles and to itself, shape (2,) [m]."""
    return np.array([scene.clearance, scene.self_clearance or 0.0])


def missing(wanted: Array, distance: Array) -> Array:
    """Missing clearance, divided by the clearance."""
    share: Array = (wanted - distance) / np.maximum(wanted, _LEAST_SCALE)
    return share


def takes_steps(trajectory: TrajectoryBatch) -> bool:
    """Whether the trajectories are complex steps of a gradient."""
    return np.iscomplexobj(trajectory.breaks) or np.iscomplexobj(trajectory.at_shares(np.zeros(1), 0))


def real_parts(trajectory: TrajectoryBatch) -> tuple[Array, Array]:
    """First row of every run of rows with equal real parts, (N,), and which of these runs each row is of, (B,)."""
    q = trajectory.at_shares(np.linspace(0.0, 1.0, _INTERVALS + 1), 0).real.reshape(len(trajectory), -1)
    told = np.concatenate([trajectory.breaks.real, q], axis=1)
    first = np.append(True, (told[1:] != told[:-1]).any(axis=1))[: len(told)]
    return np.flatnonzero(first), np.cumsum(first) - 1


@final
@dataclass(frozen=True, eq=False)
class ClearanceTerms:
    """Missing clearance of every pair at its least distance in every segment: rollout -> (B, S x n_pairs).

    To each clearance a little more than the tolerance of the proof is added, so that a motion that keeps it can be
    proven.

    Attributes:
        collision: robot and scene.
        tolerance: see :func:`trajevo.formulation.constraints.clearance.clearance_limit` [m].
    """

    collision: Collision
    tolerance: float

    def __call__(self, rollout: Rollout) -> Array:
        """Missing clearance divided by the clearance."""
        trajectory, kinds = rollout.trajectory, kinds_of(self.collision)
        wanted = wanted_clearances(self.collision.scene)[kinds]
        least = self._least(trajectory) - DISTANCE_ERROR - _KEPT * self.tolerance
        return missing(wanted, least).reshape(len(trajectory), -1)

    def _least(self, trajectory: TrajectoryBatch) -> Array:
        """Least distances, (B, S, n_pairs) [m]."""
        first, which = real_parts(trajectory)
        real = trajectory.real_rows(first)
        distances = self._at_shares(real)
        at = distances.argmin(axis=2)
        least = np.take_along_axis(distances, at[:, :, None], axis=2)[:, :, 0]
        step = at * _FINER
        self._look_closer(real, distances, least, step)
        if not takes_steps(trajectory):
            return least[which]
        row, segment, pair = (index.ravel() for index in np.indices(step.shape))
        q, state = _states(real, row, segment, step.ravel())
        order, slopes = np.argsort(state, kind="stable"), np.empty((len(row), q.shape[1]))
        slopes[order] = self.collision.slopes_of(q, state[order], pair[order])
        steps, place = np.unique(step, return_inverse=True)
        moved = _at(trajectory, steps * _SHARE, 0).imag
        moved = moved[np.arange(len(which))[:, None, None], np.arange(step.shape[1])[:, None], place[which]]
        stepped: Array = least[which] + 1j * (slopes.reshape(*step.shape, -1)[which] * moved).sum(axis=3)
        return stepped

    def _look_closer(self, real: TrajectoryBatch, distances: Array, least: Array, step: Array) -> None:
        """Refine the least distances in place, around local minima of the samples where a pair may come too close."""
        wanted = wanted_clearances(self.collision.scene)[kinds_of(self.collision)] + self.tolerance
        row, segment, at, pair = np.nonzero(_dips(distances, wanted))
        items = row, segment, pair
        centre = np.clip(at, 1, _INTERVALS - 1) * _FINER
        best, d = at * _FINER, distances[row, segment, at, pair]
        apart, steps = _FINER // 4, centre[:, None] + np.arange(-4, 5) * (_FINER // 4)
        while True:
            found = self._distances(real, items, steps)
            place = found.argmin(axis=1)[:, None]
            closer = np.take_along_axis(found, place, axis=1)[:, 0]
            best = np.where(closer < d, np.take_along_axis(steps, place, axis=1)[:, 0], best)
            d = np.minimum(closer, d)
            apart //= 2
            if not apart:
                break
            steps = np.clip(best[:, None] + np.array([-apart, apart]), 0, _INTERVALS * _FINER)
        np.minimum.at(least, items, d)
        decides = d == least[items]
        step[tuple(index[decides] for index in items)] = best[decides]

    def _distances(self, real: TrajectoryBatch, items: tuple[Array, ...], steps: Array) -> Array:
        """Distances of rows, segments and pairs (K,) at steps of the finer grid, (K, M) [m]."""
        row, segment, pair = (np.repeat(index, steps.shape[1]) for index in items)
        q, state = _states(real, row, segment, steps.ravel())
        order, d = np.argsort(state, kind="stable"), np.empty(steps.size)
        d[order] = self.collision.distances_of(q, state[order], pair[order])
        return d.reshape(steps.shape)

    def _at_shares(self, real: TrajectoryBatch) -> Array:
        """Distances at even shares of every segment, (N, S, U, n_pairs) [m]."""
        q = _at(real, np.linspace(0.0, 1.0, _INTERVALS + 1), 0)
        N, S, U, n = q.shape
        # The end of a segment is the start of the next.
        ends = np.concatenate([q[:, :, :-1].reshape(N, -1, n), q[:, -1, -1:]], axis=1)
        found = self.collision.distances(ends.reshape(-1, n))
        return found.reshape(N, ends.shape[1], -1)[:, np.arange(S)[:, None] * _INTERVALS + np.arange(U)]


def _states(real: TrajectoryBatch, row: Array, segment: Array, step: Array) -> tuple[Array, Array]:
    """Distinct states at K steps of segments: positions (N, n_joints), and the state of each step (K,)."""
    t = real.breaks[row, segment] + step * _SHARE * real.segment_durations[row, segment]
    order = np.lexsort((t, row))
    rows, instants = row[order], t[order]
    new = (np.diff(rows, prepend=-1) != 0) | (np.diff(instants, prepend=-1.0) != 0.0)
    state = np.empty(len(t), dtype=np.intp)
    state[order] = np.cumsum(new) - 1
    return real.real_rows(rows[new]).evaluate(instants[new][:, None])[:, 0], state


def _dips(distances: Array, wanted: Array) -> Array:
    """Mask (N, S, U, n_pairs) of local minima so low that the pair may be too close between samples."""
    far = np.full_like(distances[:, :, :1], np.inf)
    before = np.concatenate([far, distances[:, :, :-1]], axis=2)
    after = np.concatenate([distances[:, :, 1:], far], axis=2)
    rise = np.maximum(np.where(np.isfinite(before), before, after), np.where(np.isfinite(after), after, before))
    dips: Array = (distances <= before) & (distances <= after) & (2.0 * distances - rise < wanted)
    return dips


@final
@dataclass(frozen=True, eq=False)
class Deciding:
    """The time intervals whose bounds are the result, C for each of N motions; for a sample, both ends are equal.

    Attributes:
        pair: index of the pair, shape (N, C).
        t: both ends, (2, N, C) [s].
    """

    pair: Array
    t: Array


def stepped_bounds(
    collision: Collision, trajectory: TrajectoryBatch, real: TrajectoryBatch, which: Array, deciding: Deciding
) -> Array:
    """Imaginary parts of the bounds of intervals whose ends stay at the same shares of their segments.

    Args:
        collision: robot and scene.
        trajectory: B complex steps.
        real: their N distinct real parts.
        which: index of the real part of every step, (B,).
        deciding: C intervals of each real part.

    Returns:
        Shape (B, C) [m].
    """
    N, C = deciding.pair.shape
    motion, later = np.arange(N)[:, None], np.arange(len(trajectory))[:, None]
    segment = (deciding.t.mean(axis=0)[..., None] >= real.breaks[:, None, 1:-1]).sum(axis=2)
    share = (deciding.t - real.breaks[motion, segment]) / real.segment_durations[motion, segment]
    share = np.clip(np.rint(share / _FINEST_SHARE) * _FINEST_SHARE, 0.0, 1.0)
    shares, place = np.unique(share, return_inverse=True)
    place = place.reshape(2, N, C)
    seen = _at(real, shares, 0)[motion, segment, place].reshape(2 * N * C, -1)
    alone, pairs = np.arange(len(seen)), np.tile(deciding.pair.ravel(), 2)
    slopes = collision.slopes_of(seen, alone, pairs).reshape(2, N, C, -1)
    q, v = (_at(trajectory, shares, order)[later, segment[which], place[:, which]] for order in (0, 1))
    d = (slopes[:, which] * q.imag).sum(axis=(0, 3))
    dt = (share[1] - share[0])[which] * trajectory.segment_durations[later, segment[which]]
    sweeps, count = Sweeps(collision, trajectory), d.size
    moved = sweeps.bodies.moved(sweeps.bodies.placed(np.moveaxis(q, 0, 2).reshape(2 * count, -1)))[::2]
    where = np.repeat(np.arange(len(trajectory)), C), segment[which].ravel()
    travel = sweeps.travel(where, moved, v.reshape(2, count, -1), dt.ravel())
    own = travel[np.arange(count), sweeps.column[deciding.pair[which]].ravel()]
    bounds: Array = 0.5 * (d - own.imag.reshape(d.shape))
    return bounds


def _at(trajectory: TrajectoryBatch, shares: Array, derivative: int) -> Array:
    """A derivative at shares of every segment, (B, S, U, n_joints)."""
    values = trajectory.at_shares(shares, derivative)
    return values.reshape(len(trajectory), trajectory.breaks.shape[1] - 1, len(shares), trajectory.n_joints)
