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
from trajevo.base.shown.brief import brief
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.formulation.constraints.broad_phase.bodies import Placed, PlacedByLoops
from trajevo.formulation.constraints.broad_phase.near import INTERVALS, Grid
from trajevo.formulation.constraints.broad_phase.sweeps import Sweeps
from trajevo.formulation.constraints.clearance_search import kinds_of
from trajevo.formulation.constraints.collision import DISTANCE_ERROR, Collision
from trajevo.formulation.constraints.scene import Scene
from trajevo.trajectory.batch import TrajectoryBatch
from trajevo.trajectory.polynomial import PolynomialBatch

#: Least divisor of a column [m], since a clearance of 0 cannot be one.
_LEAST_SCALE = 0.01

#: Steps of every interval of the samples to which minima are refined for the terms.
_FINER = 256
_SHARE = 1.0 / (INTERVALS * _FINER)
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


def bases_of(rollout: Rollout) -> Array | None:
    """Where the base is in each motion, shape (B, 4) or (B, 6), see ``Arranged.bases``; None if it stands still."""
    return None if rollout.arranged is None else rollout.arranged.bases


def from_bases(trajectory: TrajectoryBatch, bases: Array | None) -> TrajectoryBatch:
    """Motions of a robot on a gantry, whose first joints hold its base at bases, (B, 4) or (B, 6); None adds none."""
    if bases is None or not isinstance(trajectory, PolynomialBatch):
        return trajectory
    return trajectory.after_constants(bases)


def part_of(trajectory: TrajectoryBatch, segments: tuple[int, ...] | None) -> TrajectoryBatch:
    """Motions on some of their segments alone, one after another; all of them for None.

    Raises:
        InvalidInputError: motions that are no polynomials.
    """
    if segments is None:
        return trajectory
    if not isinstance(trajectory, PolynomialBatch):
        raise InvalidInputError(
            f"payload: the clearance of a load needs motions of piecewise polynomials, got {type(trajectory).__name__}"
        )
    chosen = list(segments)
    ends = np.cumsum(trajectory.segment_durations[:, chosen], axis=1)
    return PolynomialBatch(np.pad(ends, ((0, 0), (1, 0))), trajectory.coefficients[:, chosen])


def real_parts(trajectory: TrajectoryBatch) -> tuple[Array, Array]:
    """First row of every run of rows with equal real parts, (N,), and which of these runs each row is of, (B,)."""
    q = trajectory.at_shares(np.linspace(0.0, 1.0, INTERVALS + 1), 0).real.reshape(len(trajectory), -1)
    told = np.concatenate([trajectory.breaks.real, q], axis=1)
    first = np.append(True, (told[1:] != told[:-1]).any(axis=1))[: len(told)]
    return np.flatnonzero(first), np.cumsum(first) - 1


@final
class SampledDistances:
    """Distances of all pairs in N states, computed where they are needed.

    Args:
        collision: robot and scene.
        q: positions of the joints, shape (N, n_joints) [rad or m].
        placed: the robot's solids there.

    Attributes:
        d: distances, inf where none was computed, shape (N, n_pairs) [m].
        lower: their lower bounds, the distances where these are known, shape (N, n_pairs) [m].
    """

    def __init__(self, collision: Collision, q: Array, placed: Placed | PlacedByLoops) -> None:
        self.collision, self.q, self.placed = collision, q, placed
        self.lower = collision.lower_bounds.everywhere(placed.whole).T - DISTANCE_ERROR
        self.d = np.full(self.lower.shape, np.inf)
        self._coarse = np.ones(self.lower.shape, dtype=bool)

    def find_least(self, at: Array) -> None:
        """Compute the least distance of each pair in each group of states, (..., U), and all that are equal to it."""
        lower = self.lower[at]
        self.ask(at, lower == lower.min(axis=-2, keepdims=True))
        self.ask(at, self.below(at, self.d[at].min(axis=-2, keepdims=True)))

    def below(self, at: Array, most: Array) -> Array:
        """Mask (..., n_pairs) of distances in states at, (...), that may be less than most."""
        rough = self._mask(at, self.lower[at] < most) & self._coarse
        state, pair = np.nonzero(rough)
        closer = self.collision.lower_bounds.of(self.placed, state, pair) - DISTANCE_ERROR
        self.lower[state, pair] = np.maximum(self.lower[state, pair], closer)
        self._coarse[state, pair] = False
        low: Array = self.lower[at] < most
        return low

    def ask(self, at: Array, chosen: Array) -> None:
        """Compute distances in states at, (...), chosen by a mask (..., n_pairs)."""
        state, pair = np.nonzero(self._mask(at, chosen) & np.isinf(self.d))
        self.d[state, pair] = self.lower[state, pair] = self.collision.distances_of(self.q, state, pair)
        self._coarse[state, pair] = False

    def _mask(self, at: Array, chosen: Array) -> Array:
        mask = np.zeros(self.d.shape, dtype=bool)
        where = np.nonzero(chosen)
        mask[at[where[:-1]], where[-1]] = True
        return mask


@final
@dataclass(frozen=True, eq=False)
class ClearanceTerms:
    """Missing clearance of every pair at its least distance in every segment: rollout -> (B, S x n_pairs).

    To each clearance a little more than the tolerance of the proof is added, so that a motion that keeps it can be
    proven.

    Attributes:
        collision: robot and scene.
        tolerance: see :func:`trajevo.formulation.constraints.clearance.clearance_limit` [m].
        part: numbers of the segments on which it is kept; None for all.
    """

    collision: Collision
    tolerance: float
    part: tuple[int, ...] | None = None

    __repr__ = brief

    def __call__(self, rollout: Rollout) -> Array:
        """Missing clearance divided by the clearance."""
        moved = from_bases(rollout.trajectory, bases_of(rollout))
        trajectory = part_of(self.collision.with_time(moved), self.part)
        kinds = kinds_of(self.collision)
        wanted = wanted_clearances(self.collision.scene)[kinds]
        least = self._least(trajectory) - DISTANCE_ERROR - _KEPT * self.tolerance
        return missing(wanted, least).reshape(len(trajectory), -1)

    def _least(self, trajectory: TrajectoryBatch) -> Array:
        """Least distances, (B, S, n_pairs) [m]."""
        first, which = real_parts(trajectory)
        real = trajectory.real_rows(first)
        distances, dips = self._at_shares(real)
        at = distances.argmin(axis=2)
        least = np.take_along_axis(distances, at[:, :, None], axis=2)[:, :, 0]
        step = at * _FINER
        self._look_closer(real, distances, dips, least, step)
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

    def _look_closer(
        self, real: TrajectoryBatch, distances: Array, dips: tuple[Array, ...], least: Array, step: Array
    ) -> None:
        """Refine the least distances in place, around local minima of the samples where a pair may come too close."""
        row, segment, at, pair = dips
        items = row, segment, pair
        centre = np.clip(at, 1, INTERVALS - 1) * _FINER
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
            steps = np.clip(best[:, None] + np.array([-apart, apart]), 0, INTERVALS * _FINER)
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

    def _at_shares(self, real: TrajectoryBatch) -> tuple[Array, tuple[Array, ...]]:
        """Distances at even shares of every segment [m], inf where they are neither needed nor the least of a segment.

        Returns:
            The distances, (N, S, U, n_pairs), and where they have minima so low that a pair may be too close between.
        """
        sweeps = Sweeps(self.collision, real)
        grid = Grid(real, sweeps)
        samples = SampledDistances(self.collision, grid.q.reshape(-1, real.n_joints), grid.placed)
        N, S = grid.dt.shape
        #: The end of a segment is the start of the next.
        at = np.arange(N)[:, None, None] * grid.size + np.arange(S)[:, None] * INTERVALS + np.arange(INTERVALS + 1)
        samples.find_least(at)
        wanted = wanted_clearances(self.collision.scene)[kinds_of(self.collision)] + self.tolerance
        # Between samples a distance changes by no more than its solids move.
        travel = np.zeros((N, S, INTERVALS + 2, len(wanted)))
        travel[:, :, 1:-1] = grid.travel[:, sweeps.column].reshape(N, S, INTERVALS, -1)
        low = samples.below(at, wanted + np.maximum(travel[:, :, :-1], travel[:, :, 1:]))
        beside = low.copy()
        beside[:, :, 1:] |= low[:, :, :-1]
        beside[:, :, :-1] |= low[:, :, 1:]
        samples.ask(at, beside)
        distances = samples.d[at]
        return distances, _dips(distances, low, wanted)


def _states(real: TrajectoryBatch, row: Array, segment: Array, step: Array) -> tuple[Array, Array]:
    """Distinct states at K steps of segments: positions (N, n_joints), and the state of each step (K,)."""
    t = real.breaks[row, segment] + step * _SHARE * real.segment_durations[row, segment]
    order = np.lexsort((t, row))
    rows, instants = row[order], t[order]
    new = (np.diff(rows, prepend=-1) != 0) | (np.diff(instants, prepend=-1.0) != 0.0)
    state = np.empty(len(t), dtype=np.intp)
    state[order] = np.cumsum(new) - 1
    return real.real_rows(rows[new]).evaluate(instants[new][:, None])[:, 0], state


def _dips(distances: Array, low: Array, wanted: Array) -> tuple[Array, ...]:
    """Where distances (N, S, U, n_pairs) have local minima so low that the pair may be too close between samples.

    Args:
        distances: distances of samples; none of a low sample or beside it is missing.
        low: mask of the samples that may be such minima.
        wanted: distance that is kept, shape (n_pairs,).
    """
    places = np.nonzero(low)
    row, segment, at, pair = places
    last, d = distances.shape[2] - 1, distances[places]
    before = np.where(at > 0, distances[row, segment, np.maximum(at - 1, 0), pair], np.inf)
    after = np.where(at < last, distances[row, segment, np.minimum(at + 1, last), pair], np.inf)
    rise = np.maximum(np.where(np.isfinite(before), before, after), np.where(np.isfinite(after), after, before))
    dips = (d <= before) & (d <= after) & (2.0 * d - rise < wanted[pair])
    return tuple(index[dips] for index in places)


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
