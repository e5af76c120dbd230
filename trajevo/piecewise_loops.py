"""Loops over polynomial segments, one number at a time: what numba, the optional extra ``fast``, compiles.

With numba installed they take the place of :mod:`trajevo.polynomials` for real numbers and do the same arithmetic, so that
results are the same to rounding.
"""

from __future__ import annotations

import math

import numpy as np

from trajevo.arrays import Array
from trajevo import compiled
fast = compiled.fast

#: As in :mod:`trajevo.polynomials`: how near to the last guess a root is found, and in how many steps at most.
_STEP_TOLERANCE, _MAX_STEPS = 1e-10, 60


def samples(coefficients: Array, steps: Array, shares: Array, out: Array) -> None:
    """Values of the first derivatives at shares of every segment.

    Args:
        coefficients: shape (B, S, n, degree + 1), ascending powers of the time since the segment began.
        steps: lengths of the segments, shape (B, S).
        shares: shape (U,).
        out: what is written, shape (derivatives, B, S, U, n).
    """
    orders, batch, segments, instants, joints = out.shape
    count = coefficients.shape[3]
    local = np.empty((count, joints))
    for b in range(batch):
        for s in range(segments):
            for k in range(count):
                for j in range(joints):
                    local[k, j] = coefficients[b, s, j, k]
            for order in range(orders):
                for u in range(instants):
                    t = steps[b, s] * shares[u]
                    for j in range(joints):
                        value = 0.0
                        for k in range(count - 1, order - 1, -1):
                            value = value * t + local[k, j]
                        out[order, b, s, u, j] = value
                for k in range(order, count):
                    for j in range(joints):
                        local[k, j] *= k - order


def extremes(coefficients: Array, steps: Array, least: Array, greatest: Array) -> None:
    """Exact least and greatest values of the first derivatives in every segment, as :func:`trajevo.polynomials.extremes`.

    Args:
        coefficients: shape (B, S, n, degree + 1), ascending powers of the time since the segment began.
        steps: lengths of the segments, shape (B, S).
        least: what is written, shape (derivatives, B, S, n).
        greatest: the same.
    """
    orders, batch, segments, joints = least.shape
    degree = coefficients.shape[3] - 1
    unit, current, nodes, values, roots = np.empty((5, degree + 3))
    for b in range(batch):
        for s in range(segments):
            step = steps[b, s]
            for j in range(joints):
                power = 1.0
                for k in range(degree + 1):
                    unit[k] = coefficients[b, s, j, k] * power
                    power *= step
                nodes[0], nodes[1], count = 0.0, 1.0, 2
                for order in range(degree, -1, -1):
                    size = degree - order
                    for i in range(size + 1):
                        current[i] = unit[i + order]
                        for k in range(order):
                            current[i] *= i + order - k
                    low, high = np.inf, -np.inf
                    for i in range(count):
                        values[i] = _value(current, size, nodes[i])
                        low, high = min(low, values[i]), max(high, values[i])
                    if order < orders:
                        scale = 1.0
                        for _ in range(order):
                            scale /= step
                        least[order, b, s, j], greatest[order, b, s, j] = low * scale, high * scale
                    if order == 0 or size == 0:
                        continue
                    roots[0], found = 0.0, 1
                    for i in range(count - 1):
                        if (values[i] < 0.0 < values[i + 1]) or (values[i] > 0.0 > values[i + 1]):
                            roots[found] = _root(current, size, nodes[i], nodes[i + 1], values[i], values[i + 1])
                            found += 1
                    roots[found] = 1.0
                    nodes, roots, count = roots, nodes, found + 1
                for order in range(degree + 1, orders):
                    least[order, b, s, j] = greatest[order, b, s, j] = 0.0


@fast
def _value(coefficients: Array, degree: int, u: float) -> float:
    value = coefficients[degree]
    for k in range(degree - 1, -1, -1):
        value = value * u + coefficients[k]
    return value


@fast
def _root(c: Array, degree: int, left: float, right: float, from_value: float, to_value: float) -> float:
    """The root between two neighbouring stationary points with values of opposite signs."""
    if degree == 1:
        return min(max(-c[0] / c[1], left), right)
    if degree == 2:
        half = -0.5 * (c[1] + math.copysign(math.sqrt(max(c[1] * c[1] - 4.0 * c[2] * c[0], 0.0)), c[1]))
        root = half / c[2]
        if not left <= root <= right:
            root = c[0] / half
        return min(max(root, left), right)
    share = from_value / (from_value - to_value)
    root = left + (right - left) * (0.5 - math.sin(math.asin(1.0 - 2.0 * share) / 3.0))
    last_step = right - left
    for _ in range(_MAX_STEPS):
        value, slope = c[degree], 0.0
        for k in range(degree - 1, -1, -1):
            slope = slope * root + value
            value = value * root + c[k]
        if (value > 0.0) == (to_value > 0.0):
            right = root
        else:
            left = root
        following = root - value / slope
        if not (left <= following <= right and abs(following - root) <= 0.5 * last_step):
            following = 0.5 * (left + right)
        last_step = abs(following - root)
        root = following
        if last_step <= _STEP_TOLERANCE:
            break
    return root
