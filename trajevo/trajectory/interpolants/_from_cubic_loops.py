"""The cubic spline's equations one number at a time: what numba, the optional extra ``fast``, compiles.

With numba installed they take the place of numpy's, with the same arithmetic.
"""

from __future__ import annotations

import numpy as np

from trajevo.arrays import Array
from trajevo.compiled import fast


@fast
def coefficients(h: Array, points: Array, ends: Array, out: Array) -> None:
    """Coefficients of splines with two virtual knots.

    Args:
        h: interval lengths, shape (B, m - 1) [s].
        points: via points, shape (m - 2, n).
        ends: velocity and acceleration at the start, velocity and acceleration at the end, shape (4, n).
        out: what is written, shape (B, m - 1, n, 4).
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
    """Those at the inner knots, by elimination, where the position of knot k is known[k] + share[k] a[k]."""
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
