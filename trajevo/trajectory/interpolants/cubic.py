"""The cubic spline with two virtual knots (Guo 2016, section 3.2; its eqs. (133)-(143) are lost and derived anew).

A cubic spline through m₀ points cannot also have given velocities and accelerations at both ends. Two knots whose
positions are free, the second and the last but one, make up for it: m = m₀ + 2 knots, m₀ + 1 intervals.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, final

import numpy as np

from trajevo.base import jit
from trajevo.base.arrays import Array, numbers, read_only
from trajevo.base.jit import fast
from trajevo.path.via_points import ViaPoints
from trajevo.trajectory.batch import TrajectoryBatch
from trajevo.trajectory.interpolants.interpolant import (
    Interpolant,
    Variable,
    breaks_of,
    check_durations,
    checked_bounds,
    checked_points,
    duration_variables,
)
from trajevo.trajectory.polynomial import PolynomialBatch


@fast
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
    known[0], known[2 : count - 2], known[count - 1] = points[0], points[1:-1], points[-1]
    a[0], a[count - 1] = ends[1], ends[3]
    for b in range(batch):
        step = h[b]
        first, last = step[0], step[intervals - 1]
        known[1] = points[0] + first * ends[0] + first**2 * ends[1] / 3.0
        known[count - 2] = points[-1] - last * ends[2] + last**2 * ends[3] / 3.0
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
class CubicSpline(Interpolant):
    """C2 cubic spline through the points with two virtual knots; velocity and acceleration are given at both ends.

    Attributes:
        points: at least 2 via points.
        duration_bounds: least and greatest time of an interval [s].
        start_velocity: shape (n_joints,) [rad/s or m/s]; zero if not given, as the next three.
        start_acceleration: [rad/s² or m/s²].
        end_velocity: [rad/s or m/s].
        end_acceleration: [rad/s² or m/s²].
    """

    points: ViaPoints
    duration_bounds: tuple[float, float] = field(kw_only=True)
    start_velocity: Array | None = field(default=None, kw_only=True)
    start_acceleration: Array | None = field(default=None, kw_only=True)
    end_velocity: Array | None = field(default=None, kw_only=True)
    end_acceleration: Array | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        checked_points(self.points, 2, "the cubic spline")
        object.__setattr__(self, "duration_bounds", checked_bounds(self.duration_bounds))
        joints = self.points.n_joints
        for name in ("start_velocity", "start_acceleration", "end_velocity", "end_acceleration"):
            given: Any = getattr(self, name)
            values = np.zeros(joints) if given is None else numbers(given, name=name, shape=(joints,))
            object.__setattr__(self, name, read_only(values))

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The interval lengths, named ``h_1`` to ``h_{m-1}`` as in the paper."""
        return duration_variables(len(self.points) + 1, self.duration_bounds, "h")

    def __call__(self, x: Array) -> TrajectoryBatch:
        """Splines for interval lengths of shape (B, m - 1) [s]."""
        h = check_durations(x, len(self.points) + 1)
        if jit.can_compile():
            return self._by_loops(np.ascontiguousarray(h))
        q, a = self._knots(h)
        step = h.T[:, :, None]
        velocity = (q[1:] - q[:-1]) / step - step * (2.0 * a[:-1] + a[1:]) / 6.0
        cubic = (a[1:] - a[:-1]) / (6.0 * step)
        coefficients = np.stack([q[:-1], velocity, 0.5 * a[:-1], cubic], axis=-1)
        return PolynomialBatch(breaks_of(h), np.moveaxis(coefficients, 0, 1))

    def _by_loops(self, h: Array) -> TrajectoryBatch:
        names = ("start_velocity", "start_acceleration", "end_velocity", "end_acceleration")
        ends = np.stack([getattr(self, name) for name in names])
        coefficients = np.empty((*h.shape, self.points.n_joints, 4), dtype=h.dtype)
        _coefficients(h, np.array(self.points.positions), ends, coefficients)
        return PolynomialBatch(breaks_of(h), coefficients)

    def via_times(self, x: Array) -> Array:
        """Instants of all knots but the two virtual ones, (B, m - 1) -> (B, m₀) [s]."""
        times = breaks_of(check_durations(x, len(self.points) + 1))
        return np.delete(times, [1, times.shape[1] - 2], axis=1)

    def _knots(self, h: Array) -> tuple[Array, Array]:
        """Positions and accelerations at all knots, each (m, B, n_joints).

        The position of knot k is ``known[k] + share[k] a[k]``: that of a virtual knot depends on its acceleration.
        Continuity of velocity at the inner knots gives one tridiagonal matrix for all joints.
        """
        p = self.points.positions
        step = h.T[:, :, None]
        known = np.empty((len(p) + 2, len(h), p.shape[1]), dtype=h.dtype)
        share = np.zeros((len(p) + 2, len(h), 1), dtype=h.dtype)
        known[0], known[2:-2], known[-1] = p[0], p[1:-1, None], p[-1]
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
