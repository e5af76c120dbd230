"""The least time along a path under limits of velocity and acceleration alone, by reachability analysis.

In x = u'² and a = u'' limits are linear at every station of the path, and x grows by 2 Δu a from one to the next. A
pass from the end finds the greatest x from which rest at the end can be reached, a pass from the start then accelerates
as much as limits and these x allow (Pham and Pham 2018, IEEE Transactions on Robotics, 10.1109/TRO.2018.2819195).
Either greatest value is the least of a few linear functions of x, so that no programs are solved. Where an axis turns
round, the greatest speed at one station may cost some at the next: with many stations the loss vanishes.
"""

from __future__ import annotations

import numpy as np

from trajevo.base.arrays import Array

#: Slope below which an axis stands still along the path, as a share of the greatest one.
_STILL = 1e-9

#: Least x between the ends as a share of the greatest, so that a path takes a finite time.
_LEAST = 1e-12


def greatest_squares(du: Array, first: Array, second: Array, velocity: Array, acceleration: Array) -> Array:
    """The greatest u'² at stations, 0 at both ends.

    Args:
        du: steps of u between the stations, shape (M - 1,).
        first: derivatives of the axes along the path, shape (M, n_axes).
        second: second derivatives, the same shape.
        velocity: limits of the axes, shape (n_axes,); inf for none.
        acceleration: limits, the same shape.
    """
    slope = np.where(np.abs(first) > _STILL * np.abs(first).max(), first, 0.0)
    limited = np.isfinite(acceleration)
    half, tilt, free = _half_planes(slope[:, limited], second[:, limited], acceleration[limited])
    most: Array = np.minimum(free, np.square(_quotients(velocity, np.abs(slope)).min(axis=1)))
    steps = 2.0 * du[:, None]
    # As -half + tilt x <= a <= half + tilt x for every axis, the next x is grown times x, give or take the reach.
    reach, grown = steps * half[:-1], 1.0 + steps * tilt[:-1]
    falls = np.where((grown > 0.0) & np.isfinite(reach), grown, 0.0)
    inverse, back = np.where(falls > 0.0, 1.0 / np.where(falls > 0.0, falls, 1.0), 0.0), _quotients(reach, falls)
    # Where an axis turns round so sharply that this speed cannot fall to 0, it must not be so great.
    most[:-1] = np.minimum(most[:-1], _quotients(reach, np.maximum(-grown, 0.0)).min(axis=1, initial=np.inf))
    most[0] = most[-1] = 0.0
    for k in range(len(du) - 1, 0, -1):
        most[k] = min(most[k], (most[k + 1] * inverse[k] + back[k]).min(initial=np.inf))
    for k in range(len(du) - 1):
        most[k + 1] = min(most[k + 1], max((most[k] * grown[k] + reach[k]).min(initial=np.inf), 0.0))
    # Where nothing bounds the speed it would be infinite; a step from rest to rest would take for ever.
    greatest = max(float(most[np.isfinite(most)].max()), np.finfo(float).tiny)
    most[1:-1] = np.clip(most[1:-1], _LEAST * greatest, greatest)
    return most


def _half_planes(slope: Array, bend: Array, limit: Array) -> tuple[Array, Array, Array]:
    """Limits |slope a + bend x| <= limit as |a - tilt x| <= half, and the greatest x with any a.

    Returns:
        half, infinite where an axis stands still, and tilt, each (M, n_axes); the greatest x (M,).
    """
    moves = slope != 0.0
    half = _quotients(limit, np.abs(slope))
    tilt = np.where(moves, -bend, 0.0) / np.where(moves, slope, 1.0)
    alone = np.where(moves, np.inf, _quotients(limit, np.abs(bend))).min(axis=1, initial=np.inf)
    apart = np.maximum(tilt[:, :, None] - tilt[:, None, :], 0.0)
    together = _quotients(half[:, :, None] + half[:, None, :], apart).min(axis=(1, 2), initial=np.inf)
    return half, tilt, np.minimum(alone, together)


def _quotients(above: Array, below: Array) -> Array:
    """Quotients of numbers that are not negative, infinite where the lower one is 0."""
    found: Array = np.where(below > 0.0, above, np.inf) / np.where(below > 0.0, below, 1.0)
    return found
