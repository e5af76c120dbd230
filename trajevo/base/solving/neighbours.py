"""The nearest of many points, in a loop that numba (the optional extra ``fast``) compiles."""

from __future__ import annotations

from trajevo.base.arrays import Array
from trajevo.base.jit import fast


@fast("f8[2] -> i8[2], f8[2]")
def nearest(points: Array, found: Array, distances: Array) -> None:
    """The nearest points of every point, itself among them, by the greatest difference in any coordinate.

    Args:
        points: shape (N, C).
        found: output, numbers of the nearest points, the nearest first, shape (N, K) with K up to N.
        distances: output, their distances, the same shape.
    """
    count = found.shape[1]
    for i in range(len(points)):
        known = 0
        for j in range(len(points)):
            distance = 0.0
            for c in range(points.shape[1]):
                distance = max(distance, abs(points[i, c] - points[j, c]))
            if known == count and distance >= distances[i, count - 1]:
                continue
            k = min(known, count - 1)
            while k > 0 and distances[i, k - 1] > distance:
                found[i, k], distances[i, k] = found[i, k - 1], distances[i, k - 1]
                k -= 1
            found[i, k], distances[i, k] = j, distance
            known = min(known + 1, count)
