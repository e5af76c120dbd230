"""Clearance as a constraint, proven between samples.

The distance of two solids changes at most as fast as their points move, and a joint moves a point at most its speed
times a reach that holds in every configuration (:meth:`trajevo.collision.Collision.reach`). Over an interval Δt with
distances d₀, d₁ at its ends it therefore stays above (d₀ + d₁ - Σ reach ∫|v| dt)/2. Intervals whose bound is too low
are halved until it is not, or until the bound is within a tolerance of the distance.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, final

import numpy as np

from trajevo.arrays import Array, frozen
from trajevo.collision import DISTANCE_ERROR, Collision, Pair
from trajevo.constraints import Constraint
from trajevo.dynamics import Rollout, rollout_of
from trajevo.errors import InvalidInputError
from trajevo.robot import Robot
from trajevo.scene import Scene
from trajevo.trajectory import TrajectoryBatch
from trajevo.transmission import Direct

#: Names of the columns: of the pairs with an obstacle, of those of the robot with itself.
NAMES = ("clearance to obstacles", "clearance to itself")

#: Least divisor of a column [m]; a clearance of 0 has to be measured against something.
_LEAST_SCALE = 0.01

#: Halvings in which motions that collide are searched for how deep they do; 3 make 16 intervals of a segment.
_SEARCHED = 3


def clearance_limit(robot: Robot, scene: Scene, *, tolerance: float = 1e-3) -> Constraint:
    """How much of a scene's clearances is missing, over them (0.01 m at least); at most 0 only where all is proven.

    A motion that keeps the clearance at all instants looked at gets a lower bound of its least distance, which may be
    far below it where there is room. One that does not gets the least distance found, negative in a collision, for the
    search to follow. The payload is not part of it.

    Args:
        robot: whose links; its actuators drive its joints directly.
        scene: obstacles and clearances.
        tolerance: how far the proven distance may be below the true one where that decides [m].

    Returns:
        A constraint with one column for obstacles and one for the robot itself, as far as the scene has them. It can be
        pickled; it has no gradient.

    Raises:
        InvalidInputError: a robot without collision geometry or with a transmission, or a tolerance that is not
            positive.
    """
    if not isinstance(robot.transmission, Direct):
        raise InvalidInputError(
            f"robot {robot.name!r}: clearance is proven for actuators that drive joints directly, "
            f"got {type(robot.transmission).__name__}"
        )
    real = isinstance(tolerance, int | float) and not isinstance(tolerance, bool)
    if not (real and 0.0 < tolerance < np.inf):
        raise InvalidInputError(f"tolerance: expected a positive number [m], got {tolerance!r}")
    clearance = ProvenClearance(Collision(robot, scene), float(tolerance))
    return Constraint(tuple(NAMES[kind] for kind in clearance.kinds), "scene", clearance)


@final
@dataclass(frozen=True, eq=False)
class ProvenClearance:
    """The function of :func:`clearance_limit`: rollout of B trajectories -> (B, number of kinds).

    Attributes:
        collision: robot and scene.
        tolerance: see there [m].
    """

    collision: Collision
    tolerance: float

    @property
    def kinds(self) -> tuple[int, ...]:
        """Indices of :data:`NAMES` that there are pairs of."""
        return tuple(sorted({int(pair.itself) for pair in self.collision.pairs}))

    def __call__(self, rollout: Rollout) -> Array:
        """Missing clearance over the clearance, at most 0 where it is proven.

        Raises:
            InvalidInputError: the trajectories are complex steps of a gradient.
        """
        wanted = self._wanted()
        excess: Array = (wanted - self.least(rollout.trajectory)) / np.maximum(wanted, _LEAST_SCALE)
        return excess[:, list(self.kinds)]

    def least(self, trajectory: TrajectoryBatch) -> Array:
        """Distance to obstacles and to itself, proven if not below the clearance, (B, 2) [m], inf if unwatched."""
        search = _Search(self.collision, trajectory, self._wanted(), self.tolerance)
        work = search.start()
        while len(work.row):
            work = search.halve(work)
        return np.where(search.sampled < self._wanted(), search.sampled, search.proven)

    def _wanted(self) -> Array:
        scene = self.collision.scene
        return np.array([scene.clearance, scene.self_clearance or 0.0])


@dataclass(frozen=True, eq=False)
class _Intervals:
    """K intervals of time of one pair each.

    Attributes:
        row: trajectory, (K,).
        pair: (K,).
        t: both ends, (2, K) [s].
        v: joint velocities at both ends, within the segment, (2, K, n_joints).
        d: distances at both ends, (2, K) [m].
        known: a lower bound that is already proven, (K,) [m].
    """

    row: Array
    pair: Array
    t: Array
    v: Array
    d: Array
    known: Array

    def chosen(self, keep: Array) -> _Intervals:
        return _Intervals(
            self.row[keep], self.pair[keep], self.t[:, keep], self.v[:, keep], self.d[:, keep], self.known[keep]
        )


@dataclass(eq=False)
class _Search:
    """Branch and bound of a batch: what was sampled, what is proven, both (B, 2) [m]."""

    collision: Collision
    trajectory: TrajectoryBatch
    wanted: Array
    tolerance: float
    sampled: Array = field(init=False)
    proven: Array = field(init=False)
    halvings: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        trajectory = self.trajectory
        if np.iscomplexobj(trajectory.breaks) or np.iscomplexobj(trajectory.at_shares(np.zeros(1), 0)):
            raise InvalidInputError("clearance: has no gradient: solve with an evolutionary algorithm")
        self.reach = self.collision.reach(*trajectory.extremes(0))
        self.peak = trajectory.peak(2)
        self.kind = np.array([int(pair.itself) for pair in self.collision.pairs])
        self.sampled, self.proven = (np.full((len(trajectory), 2), np.inf) for _ in range(2))

    def start(self) -> _Intervals:
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
        self._sample(row, pair, d[row, step, pair])
        self._sample(row, pair, d[row, step + 1, pair])
        return self._open(
            _Intervals(
                row=row,
                pair=pair,
                t=np.stack([t[row, segment, half], t[row, segment, half + 1]]),
                v=np.stack([v[row, segment, half], v[row, segment, half + 1]]),
                d=np.stack([d[row, step, pair], d[row, step + 1, pair]]),
                known=np.full(len(row), -np.inf),
            )
        )

    def halve(self, work: _Intervals) -> _Intervals:
        """Look at the middle of every interval and keep the halves that are still open."""
        self.halvings += 1
        middle = work.t.mean(axis=0)
        d, v = self._look(work, middle)
        self._sample(work.row, work.pair, d)
        known = self._bound(work)
        inner = {"t": middle, "v": v, "d": d}
        left = {name: np.stack([getattr(work, name)[0], value]) for name, value in inner.items()}
        right = {name: np.stack([value, getattr(work, name)[1]]) for name, value in inner.items()}
        halves = {name: np.concatenate([left[name], right[name]], axis=1) for name in inner}
        row, pair, known = (np.tile(values, 2) for values in (work.row, work.pair, known))
        return self._open(_Intervals(row=row, pair=pair, known=known, **halves))

    def _look(self, work: _Intervals, t: Array) -> tuple[Array, Array]:
        """Distances (K,) and joint velocities (K, n_joints) at one instant of every interval."""
        instants, state = np.unique(np.stack([work.row, t], axis=1), axis=0, return_inverse=True)
        row = instants[:, 0].astype(np.intp)
        column = np.arange(len(row)) - np.searchsorted(row, row)  # place among the instants of its trajectory
        padded = np.zeros((len(self.trajectory), column.max() + 1))
        padded[row, column] = instants[:, 1]
        q, v = (self.trajectory.evaluate(padded, derivative)[row, column] for derivative in (0, 1))
        order, d = np.argsort(state, kind="stable"), np.empty(len(t))
        d[order] = self.collision.distances_of(q, state[order], work.pair[order], motion=row) - DISTANCE_ERROR
        return d, v[state]

    def _open(self, work: _Intervals) -> _Intervals:
        """Settle the intervals that are proven, or as good as can be, and return the others."""
        kind, bound = self.kind[work.pair], self._bound(work)
        sampled = self.sampled[work.row, kind]
        collides = sampled < self.wanted[kind]
        settled = np.where(
            collides,
            (bound >= sampled) | (self.halvings >= _SEARCHED),
            (bound >= self.wanted[kind]) | (0.5 * self._travel(work) <= self.tolerance),
        )
        np.minimum.at(self.proven, (work.row[settled], kind[settled]), bound[settled])
        return work.chosen(~settled)

    def _bound(self, work: _Intervals) -> Array:
        bound: Array = np.maximum(work.known, 0.5 * (work.d.sum(axis=0) - self._travel(work)))
        return bound

    def _travel(self, work: _Intervals) -> Array:
        """How far the solids can move against each other: |v| is below both |v₀| + a τ and |v₁| + a (Δt - τ)."""
        step = (work.t[1] - work.t[0])[:, None]
        most = 0.5 * np.abs(work.v).sum(axis=0) * step + 0.25 * self.peak[work.row] * step**2
        travel: Array = (self.reach[work.row, work.pair] * most).sum(axis=1)
        return travel

    def _sample(self, row: Array, pair: Array, d: Array) -> None:
        np.minimum.at(self.sampled, (row, self.kind[pair]), d)


@final
@dataclass(frozen=True, eq=False)
class ClearanceProfile:
    """Distances along motions, sampled, for pictures and checks.

    Attributes:
        t: instants, shape (B, T) [s].
        distances: of every pair, shape (B, T, n_pairs) [m].
        pairs: what they are of.
    """

    t: Array
    distances: Array
    pairs: tuple[Pair, ...]

    def least(self, *, itself: bool) -> Array:
        """Least distance between links of the robot, or to obstacles, shape (B, T) [m]; inf where none is watched."""
        columns = [k for k, pair in enumerate(self.pairs) if pair.itself == itself]
        return frozen(self.distances[:, :, columns].min(axis=2, initial=np.inf))


def clearance_along(motion: Any, scene: Scene, *, density: int = 50) -> ClearanceProfile:
    """Distances along a solution, an optimum or a rollout.

    Args:
        motion: any of these.
        scene: obstacles and clearances.
        density: instants per segment.

    Raises:
        InvalidInputError: another kind of motion, a density that is no whole number from 1 on, or a robot without
            collision geometry.
    """
    if not isinstance(density, int) or isinstance(density, bool) or density < 1:
        raise InvalidInputError(f"density: expected a whole number from 1 on, got {density!r}")
    rollout = rollout_of(motion)
    collision, trajectory = Collision(rollout.robot, scene), rollout.trajectory
    samples = trajectory.sample(density * (trajectory.breaks.shape[1] - 1) + 1)
    distances = collision.distances(samples.q.reshape(-1, trajectory.n_joints))
    return ClearanceProfile(samples.t, frozen(distances.reshape(*samples.t.shape, -1)), collision.pairs)


def least_distances(robot: Robot, scene: Scene, q: Array) -> Array:
    """Least distance to obstacles and to itself in states q of shape (N, n_joints), (N, 2) [m]; inf if not watched."""
    collision = Collision(robot, scene)
    itself, distances = np.array([pair.itself for pair in collision.pairs]), collision.distances(q)
    return np.stack([distances[:, itself == kind].min(axis=1, initial=np.inf) for kind in (False, True)], axis=1)
