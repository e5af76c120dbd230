"""The cubic spline with two virtual knots (Guo 2016, section 3.2; its eqs. (133)-(143) are lost and derived anew).

A cubic spline through m₀ points cannot also have given velocities and accelerations at both ends. Two knots whose
positions are free, the second and the last but one, make up for it: m = m₀ + 2 knots, m₀ + 1 intervals.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np

from trajevo.base import jit, polynomials
from trajevo.base.arrays import Array
from trajevo.base.jit import fast
from trajevo.base.shown.brief import brief
from trajevo.trajectory.batch import TrajectoryBatch
from trajevo.trajectory.interpolants.interpolant import (
    END_STATES,
    Variable,
    alike,
    breaks_of,
    check_durations,
    duration_variables,
    known_velocities,
)
from trajevo.trajectory.interpolants.splines.spline import Spline
from trajevo.trajectory.polynomial import PolynomialBatch


@fast("f8[2], f8[2], f8[2] -> f8[4]", "c16[2], f8[2], f8[2] -> c16[4]")
def _coefficients(h: Array, points: Array, ends: Array, out: Array) -> None:
    """Coefficients of splines with two virtual knots.

    Args:
        h: interval lengths, shape (B, m - 1) [s].
        points: via points, shape (m - 2, n).
        ends: velocity and acceleration at the start, velocity and acceleration at the end, shape (4, n).
        out: output, shape (B, m - 1, n, 4).
    """
    batch, intervals = h.shape
    count, joints = intervals + 1, points.shape[1]
    known, a = np.empty((count, joints), out.dtype), np.empty((count, joints), out.dtype)
    share = np.zeros(count, out.dtype)
    for j in range(joints):
        known[0, j], known[count - 1, j] = points[0, j], points[count - 3, j]
        a[0, j], a[count - 1, j] = ends[1, j], ends[3, j]
        for k in range(2, count - 2):
            known[k, j] = points[k - 1, j]
    for b in range(batch):
        step = h[b]
        first, last = step[0], step[intervals - 1]
        for j in range(joints):
            known[1, j] = points[0, j] + first * ends[0, j] + first**2 * ends[1, j] / 3.0
            known[count - 2, j] = points[count - 3, j] - last * ends[2, j] + last**2 * ends[3, j] / 3.0
        share[1], share[count - 2] = first**2 / 6.0, last**2 / 6.0
        _accelerations(step, known, share, a)
        for k in range(intervals):
            for j in range(joints):
                start, end = known[k, j] + share[k] * a[k, j], known[k + 1, j] + share[k + 1] * a[k + 1, j]
                out[b, k, j, 0] = start
                out[b, k, j, 1] = (end - start) / step[k] - step[k] * (2.0 * a[k, j] + a[k + 1, j]) / 6.0
                out[b, k, j, 2] = 0.5 * a[k, j]
                out[b, k, j, 3] = (a[k + 1, j] - a[k, j]) / (6.0 * step[k])


@fast
def _accelerations(step: Array, known: Array, share: Array, a: Array) -> None:
    """Accelerations at the inner knots, by elimination; the position of knot k is known[k] + share[k] a[k]."""
    count, joints = known.shape
    pivot = np.empty(count, a.dtype)
    for k in range(1, count - 1):
        before, after = step[k - 1], step[k]
        pivot[k] = 2.0 * (before + after) + 6.0 * share[k] * (1.0 / before + 1.0 / after)
        for j in range(joints):
            rise, fall = (known[k + 1, j] - known[k, j]) / after, (known[k, j] - known[k - 1, j]) / before
            a[k, j] = 6.0 * (rise - fall)
    for j in range(joints):
        a[1, j] -= step[0] * a[0, j]
        a[count - 2, j] -= step[count - 2] * a[count - 1, j]
    for k in range(2, count - 1):
        before = step[k - 1]
        factor = (before - 6.0 * share[k - 1] / before) / pivot[k - 1]
        pivot[k] -= factor * (before - 6.0 * share[k] / before)
        for j in range(joints):
            a[k, j] -= factor * a[k - 1, j]
    for j in range(joints):
        a[count - 2, j] /= pivot[count - 2]
    for k in range(count - 3, 0, -1):
        after = step[k] - 6.0 * share[k + 1] / step[k]
        for j in range(joints):
            a[k, j] = (a[k, j] - after * a[k + 1, j]) / pivot[k]


@final
@dataclass(frozen=True, eq=False)
class CubicSpline(Spline):
    """C2 cubic spline through the points with two virtual knots; velocity and acceleration are given at both ends.

    Attributes:
        points: at least 2 via points.
        duration_bounds: least and greatest time of an interval [s].
        start_velocity: shape (n_joints,) [rad/s or m/s]; zero if not given, as the next three.
        start_acceleration: shape (n_joints,) [rad/s² or m/s²].
        end_velocity: shape (n_joints,) [rad/s or m/s].
        end_acceleration: shape (n_joints,) [rad/s² or m/s²].
        at_rest: joints at rest at inner points, pairs (point, joint) from 0. Half-way through the interval after such
            a point these joints have one more virtual knot.
        velocities: velocities at inner points, shape (n_joints,) each [rad/s or m/s], with the same effect.
    """

    price_of_rest: ClassVar[str | None] = "its jerk may jump half-way through the next interval"
    called: ClassVar[str] = "the cubic spline"
    virtual_knots: ClassVar[int | None] = 1

    __repr__ = brief

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The interval lengths, named ``h_1`` to ``h_{m-1}`` as in the paper."""
        return duration_variables(len(self.points) + 1, self.duration_bounds, "h")

    def __call__(self, x: Array) -> TrajectoryBatch:
        """Splines for interval lengths of shape (B, m - 1) [s]."""
        h = check_durations(x, len(self.points) + 1)
        if jit.can_compile() and not self.at_rest and not self.velocities:
            return self._by_loops(np.ascontiguousarray(h))
        return self.through(self.points.positions, h)

    def through(self, positions: Array, x: Array) -> TrajectoryBatch:
        """The same through other points, (n_points, n_joints) or of each motion (B, n_points, n_joints) [rad or m]."""
        h = check_durations(x, len(self.points) + 1)
        if self.at_rest or self.velocities:
            return self._with_velocities(positions, h)
        q, a = self._knots(positions, h)
        step = h.T[:, :, None]
        velocity = (q[1:] - q[:-1]) / step - step * (2.0 * a[:-1] + a[1:]) / 6.0
        cubic = (a[1:] - a[:-1]) / (6.0 * step)
        coefficients = np.stack([q[:-1], velocity, 0.5 * a[:-1], cubic], axis=-1)
        return PolynomialBatch(breaks_of(h), np.moveaxis(coefficients, 0, 1))

    def _by_loops(self, h: Array) -> TrajectoryBatch:
        ends = np.stack([getattr(self, name) for name in END_STATES])
        coefficients = np.empty((*h.shape, self.points.n_joints, 4), dtype=h.dtype)
        _coefficients(h, np.array(self.points.positions), ends, coefficients)
        return PolynomialBatch(breaks_of(h), coefficients)

    def via_times(self, x: Array) -> Array:
        """Instants of all knots but the two virtual ones, (B, m - 1) -> (B, m₀) [s]."""
        times = breaks_of(check_durations(x, len(self.points) + 1))
        return np.delete(times, [1, times.shape[1] - 2], axis=1)

    def _with_velocities(self, positions: Array, h: Array) -> TrajectoryBatch:
        """Splines whose intervals after known velocities of any joint are cut in two, for all joints alike."""
        known, values = known_velocities(self.points.positions.shape, self.at_rest, self.velocities)
        cut = {point + 1 for point, _ in known}
        common = _halved(h, cut)
        coefficients = np.empty((*common.shape, self.points.n_joints, 4), dtype=h.dtype)
        for joints, at in alike(known, self.points.n_joints):
            own = {point + 1: values[point, joints] for point in at}
            q, a, step = self._knots_with_velocities(positions[..., joints], h, joints, own)
            velocity = (q[:, 1:] - q[:, :-1]) / step - step * (2.0 * a[:, :-1] + a[:, 1:]) / 6.0
            for k, exact in own.items():
                velocity[:, k + sum(other < k for other in own)] = exact
            pieces = np.stack([q[:, :-1], velocity, 0.5 * a[:, :-1], (a[:, 1:] - a[:, :-1]) / (6.0 * step)], axis=-1)
            coefficients[:, :, joints] = _split(pieces, h, set(own), cut)
        return PolynomialBatch(breaks_of(common), coefficients)

    def _knots_with_velocities(
        self, p: Array, h: Array, joints: list[int], given: dict[int, Array]
    ) -> tuple[Array, Array, Array]:
        """Positions and accelerations (B, knots, n) of joints with velocities given at knots, and interval lengths.

        Positions are ``known + share @ a``: that of a virtual knot, after the start or such a knot or before the end,
        depends on its own acceleration and that of the knot next to it.
        """
        h = _halved(h, set(given))
        count = h.shape[1] + 1
        ends = (self.start_velocity, self.start_acceleration, self.end_velocity, self.end_acceleration)
        v0, a0, v1, a1 = (np.asarray(end)[joints] for end in ends)
        at = sorted(given)
        after = [0, *(k + place for place, k in enumerate(at))]
        virtual = [*(k + 1 for k in after), count - 2]
        known = np.empty((len(h), count, len(joints)), dtype=h.dtype)
        known[:, np.setdiff1d(np.arange(count), virtual)] = p
        share = np.zeros((len(h), count, count), dtype=h.dtype)
        for k, velocity in zip(after, [v0, *(given[k] for k in at)], strict=True):
            known[:, k + 1] = known[:, k] + h[:, k, None] * velocity
            share[:, k + 1, k], share[:, k + 1, k + 1] = h[:, k] ** 2 / 3.0, h[:, k] ** 2 / 6.0
        known[:, -2] = known[:, -1] - h[:, -1, None] * v1
        share[:, -2, -1], share[:, -2, -2] = h[:, -1] ** 2 / 3.0, h[:, -1] ** 2 / 6.0
        rise, spread = (np.zeros((len(h), count, count), dtype=h.dtype) for _ in range(2))
        inner = np.arange(1, count - 1)
        before, beyond = h[:, :-1], h[:, 1:]
        rise[:, inner, inner - 1], rise[:, inner, inner + 1] = 6.0 / before, 6.0 / beyond
        rise[:, inner, inner] = -6.0 / before - 6.0 / beyond
        spread[:, inner, inner - 1], spread[:, inner, inner + 1] = before, beyond
        spread[:, inner, inner] = 2.0 * (before + beyond)
        spread[:, 0, 0] = spread[:, -1, -1] = 1.0
        drive = rise @ known
        drive[:, 0], drive[:, -1] = a0, a1
        a = np.linalg.solve(spread - rise @ share, drive)
        return known + share @ a, a, h[..., None]

    def _knots(self, positions: Array, h: Array) -> tuple[Array, Array]:
        """Positions and accelerations at all knots, each (m, B, n_joints).

        The position of knot k is ``known[k] + share[k] a[k]``: that of a virtual knot depends on its acceleration.
        Continuity of velocity at the inner knots gives one tridiagonal matrix for all joints.
        """
        p = np.moveaxis(positions, -2, 0).reshape(len(self.points), -1, self.points.n_joints)
        step = h.T[:, :, None]
        known = np.empty((len(p) + 2, len(h), p.shape[2]), dtype=h.dtype)
        share = np.zeros((len(p) + 2, len(h), 1), dtype=h.dtype)
        known[0], known[2:-2], known[-1] = p[0], p[1:-1], p[-1]
        known[1] = p[0] + step[0] * self.start_velocity + step[0] ** 2 * self.start_acceleration / 3.0
        known[-2] = p[-1] - step[-1] * self.end_velocity + step[-1] ** 2 * self.end_acceleration / 3.0
        share[1], share[-2] = step[0] ** 2 / 6.0, step[-1] ** 2 / 6.0
        before, after = step[:-1], step[1:]
        lower = before - 6.0 * share[:-2] / before
        diagonal = 2.0 * (before + after) + 6.0 * share[1:-1] * (1.0 / before + 1.0 / after)
        upper = after - 6.0 * share[2:] / after
        drive = 6.0 * ((known[2:] - known[1:-1]) / after - (known[1:-1] - known[:-2]) / before)
        a = np.empty_like(known)
        a[0], a[-1] = self.start_acceleration, self.end_acceleration
        drive[0] -= before[0] * a[0]
        drive[-1] -= after[-1] * a[-1]
        a[1:-1] = _tridiagonal(lower, diagonal, upper, drive)
        return known + share * a, a


def _halved(h: Array, cut: set[int]) -> Array:
    """Interval lengths (B, N) with the intervals ``cut`` divided in two."""
    parts = np.array([2 if k in cut else 1 for k in range(h.shape[1])])
    halved: Array = np.repeat(h / parts, parts, axis=1)
    return halved


def _split(pieces: Array, h: Array, own: set[int], cut: set[int]) -> Array:
    """Pieces (B, N, n, 4) of splines whose intervals ``own`` are halved, with those of ``cut`` halved too."""
    found, piece = [], iter(np.moveaxis(pieces, 1, 0))
    for k in range(h.shape[1]):
        found.append(next(piece))
        if k in own:
            found.append(next(piece))
        elif k in cut:
            by = 0.5 * h[:, k, None]
            found.append(np.moveaxis(polynomials.shifted(np.moveaxis(found[-1], -1, 0), by), 0, -1))
    return np.stack(found, axis=1)


def _tridiagonal(lower: Array, diagonal: Array, upper: Array, drive: Array) -> Array:
    """Elimination along the first axis, all trajectories at once; matrices (N, B, 1), drive (N, B, n_joints)."""
    count = len(diagonal)
    pivot, solution = diagonal.copy(), drive.copy()
    for i in range(1, count):
        factor = lower[i] / pivot[i - 1]
        pivot[i] -= factor * upper[i - 1]
        solution[i] -= factor * solution[i - 1]
    solution[-1] /= pivot[-1]
    for i in range(count - 2, -1, -1):
        solution[i] = (solution[i] - upper[i] * solution[i + 1]) / pivot[i]
    return solution
