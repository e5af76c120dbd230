"""What all motions of a problem have in common: where they pass, where they rest, how long they take at least.

Nothing here is derived from the kind of interpolant. Motions of a few random decision vectors are compared: a position
or a rest that all of them share does not depend on the decision variables.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.formulation.cell.varied_points import VariedPoints
from trajevo.formulation.moving_points import MovingPoints
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.path.via_points import ViaPoints
from trajevo.trajectory.batch import TrajectoryBatch
from trajevo.trajectory.interpolants import LinearBlends

#: Number of motions that are compared.
_COMPARED = 3

#: Positions that differ by less are the same [rad or m].
SAME_POSITION = 1e-7

#: Share of the greatest velocity or acceleration that counts as none, and share of a time that is rounding.
_NONE, _ROUNDING = 1e-7, 1e-9


@final
@dataclass(frozen=True, eq=False)
class KnownPoints:
    """The points of a problem, and what every one of its motions does there.

    Attributes:
        positions: the points; of one that moves, its given place, shape (K, n_joints) [rad or m].
        passed: whether every motion passes exactly there, shape (K,).
        resting: whether every motion passes there without velocity and acceleration, shape (K,).
        on_break: whether a segment of every motion ends there, so that samples include it, shape (K,).
        chords: whether every motion moves from this point to the next at least on a line between them, shape (K - 1,).
        smooth: how many derivatives are continuous in every motion: 0, 1 or 2.
        shortest: least time from each point to the next that the decision variables allow, shape (K - 1,) [s].
        longest: the greatest, inf if unknown, shape (K - 1,) [s].
        waits: how long every motion stands still from each point to the next, shape (K - 1,) [s].
    """

    positions: Array
    passed: Array
    resting: Array
    on_break: Array
    chords: Array
    smooth: int
    shortest: Array
    longest: Array
    waits: Array

    @property
    def known(self) -> list[int]:
        """Numbers of the points through which every motion passes exactly, or whose chords it takes."""
        chord = np.append(self.chords, False) | np.append(False, self.chords)
        return [int(k) for k in np.flatnonzero(self.passed | chord)]


def known_points(problem: TrajectoryProblem) -> KnownPoints | None:
    """Find what all motions of a problem have in common; None if its motions cannot be compared."""
    x = _vectors(problem)
    try:
        trajectory, instants = problem.decode(x), np.asarray(problem.via_times(x), dtype=np.float64)
        shortest, longest = _spans(problem, x, instants)
    except Exception:  # noqa: BLE001 - a decision vector may fail for any reason, and a search would go on
        return None
    if instants.ndim != 2 or instants.shape[1] < 2 or not np.isfinite(instants).all():
        return None
    q, v, a = (_at(trajectory, instants, order) for order in range(3))
    given = _given(problem, q)
    passed = np.abs(q - given).max(axis=(0, 2)) <= SAME_POSITION
    if isinstance(problem.interpolant, VariedPoints):  # a few motions may agree by chance
        passed &= problem.interpolant.arrangement.still
    smooth = _smooth(trajectory)
    still = [np.abs(values).max(axis=(0, 2)) <= _NONE * _size(trajectory, k) for k, values in ((1, v), (2, a))]
    distance = np.abs(trajectory.breaks[:, None, :] - instants[:, :, None]).min(axis=2)
    return KnownPoints(
        positions=given,
        passed=passed & (smooth >= 0),
        resting=passed & still[0] & still[1],
        on_break=(distance <= _ROUNDING * trajectory.duration[:, None]).all(axis=0),
        chords=np.full(len(given) - 1, isinstance(problem.interpolant, LinearBlends)),
        smooth=max(smooth, 0),
        shortest=shortest,
        longest=longest,
        waits=_waits(trajectory, instants),
    )


def segments_at_points(problem: TrajectoryProblem) -> list[list[int]]:
    """The segments that end or begin at each point, or in which it lies; across a wait, the one after it too."""
    x = 0.5 * (problem.xl + problem.xu)[None]
    trajectory, instants = problem.decode(x), problem.via_times(x)[0]
    breaks, still = trajectory.breaks[0], (trajectory.segment_peaks(1)[0] == 0.0).all(axis=1)
    rounding = _ROUNDING * breaks[-1]
    found = []
    for instant in instants:
        near = (breaks[:-1] <= instant + rounding) & (breaks[1:] >= instant - rounding)
        segments = np.flatnonzero(near).tolist()
        after = segments[-1] + 1
        found.append([*segments, *([after] if still[segments[-1]] and after < len(still) else [])])
    return found


def _vectors(problem: TrajectoryProblem) -> Array:
    """Decision vectors to compare, shape (_COMPARED, n_var)."""
    shares = np.random.default_rng(0).uniform(0.1, 0.9, (_COMPARED, problem.n_var))
    vectors: Array = problem.xl + shares * (problem.xu - problem.xl)
    return vectors


def _at(trajectory: TrajectoryBatch, instants: Array, order: int) -> Array:
    """Values at instants (B, K), which rounding may put a little after the end, shape (B, K, n_joints)."""
    return trajectory.evaluate(np.minimum(instants, trajectory.duration[:, None]), order)


def _given(problem: TrajectoryProblem, q: Array) -> Array:
    points = getattr(problem.interpolant, "points", None)
    fits = isinstance(points, ViaPoints) and points.positions.shape == q.shape[1:]
    return points.positions if isinstance(points, ViaPoints) and fits else q[0]


def _size(trajectory: TrajectoryBatch, order: int) -> float:
    return float(np.abs(trajectory.at_shares(np.linspace(0.0, 1.0, 5), order)).max())


def _smooth(trajectory: TrajectoryBatch) -> int:
    """Order of the last continuous derivative up to the acceleration; -1 if not even the position is continuous."""
    for order in range(3):
        if np.abs(trajectory.jump(order)).max(initial=0.0) > _NONE * _size(trajectory, order):
            return order - 1
    return 2


def _spans(problem: TrajectoryProblem, x: Array, instants: Array) -> tuple[Array, Array]:
    """Least and greatest time from each point to the next, 0 and inf where the instants are not affine in x."""
    unknown = np.zeros(instants.shape[1] - 1), np.full(instants.shape[1] - 1, np.inf)
    if _blends(problem.interpolant):  # every time grows with every variable
        low, high = np.diff(problem.via_times(np.stack([problem.xl, problem.xu])), axis=1)
        return low, high
    spans, between = np.diff(instants, axis=1), problem.via_times(x.mean(axis=0, keepdims=True))
    if not _agree(np.diff(between, axis=1)[0], spans.mean(axis=0)):
        return unknown
    width = problem.xu - problem.xl
    corner = np.diff(problem.via_times(np.vstack([problem.xl, problem.xl + np.diag(width)])), axis=1)
    rise = corner[1:] - corner[0]
    if not _agree(corner[0] + ((x - problem.xl) / width) @ rise, spans):
        return unknown
    return corner[0] + np.minimum(rise, 0.0).sum(axis=0), corner[0] + np.maximum(rise, 0.0).sum(axis=0)


def _waits(trajectory: TrajectoryBatch, instants: Array) -> Array:
    """Time from each point to the next in segments in which nothing moves, the least of all motions, (K - 1,) [s]."""
    still = (trajectory.segment_peaks(1) == 0.0).all(axis=2)
    middle = 0.5 * (trajectory.breaks[:, 1:] + trajectory.breaks[:, :-1])
    between = (middle[:, None] > instants[:, :-1, None]) & (middle[:, None] < instants[:, 1:, None])
    waits: Array = (between * (still * trajectory.segment_durations)[:, None]).sum(axis=2).min(axis=0)
    return waits


def _agree(times: Array, others: Array) -> bool:
    return bool(np.abs(times - others).max() <= _ROUNDING * np.abs(others).max())


def _blends(interpolant: Any) -> bool:
    return isinstance(interpolant, LinearBlends) or (
        isinstance(interpolant, MovingPoints) and interpolant.kind == "linear_blends"
    )
