"""A fast pace along many points: the least time under limits of velocity and acceleration, then smoothed for jerk.

Along a spline through the points, the greatest speed is found by a forward and a backward pass (Bobrow et al. 1985,
Shin and McKay 1985). Its acceleration jumps; a moving average of the position over time turns the jumps into ramps
whose slope is the limit of jerk, for as much more time as the average takes. Curvature changes that a little, so the
result is a pace to begin with: it keeps limits nearly, not exactly.
"""

from __future__ import annotations

import numpy as np

from trajevo.base.arrays import Array, frozen

#: Steps of a pass between two points.
_STEPS = 8

#: Least distance between two points, as a share of the average: points may follow each other at the same place.
_CLOSE = 1e-3

#: Slope below which a joint stands still along the path, as a share of the greatest one.
_STILL = 1e-9

#: Number of instants of the averaged motion.
_FINE = 20_001


def path_pace(positions: Array, velocity: Array, acceleration: Array, jerk: Array) -> Array:
    """Times between points at a fast pace, at rest at both ends.

    Args:
        positions: points, shape (K, n_joints) [rad or m].
        velocity: limits, shape (n_joints,) [rad/s or m/s]; inf for none.
        acceleration: limits [rad/s² or m/s²].
        jerk: limits [rad/s³ or m/s³].

    Returns:
        Shape (K - 1,) [s]; up to a common factor where neither velocity nor acceleration is limited.
    """
    from scipy.interpolate import CubicSpline  # imported where it computes, since that takes long

    unit = np.where(np.isfinite(velocity), velocity, np.where(np.isfinite(acceleration), acceleration, 1.0))
    chords = np.linalg.norm(np.diff(positions, axis=0) / unit, axis=1)
    chords = np.maximum(chords, _CLOSE * max(float(chords.mean()), np.finfo(float).tiny))
    if not (np.isfinite(velocity) | np.isfinite(acceleration)).any():
        return frozen(chords)
    at = np.append(0.0, np.cumsum(chords))
    spline = CubicSpline(at, positions)
    fine = np.append((at[:-1, None] + chords[:, None] * np.arange(_STEPS) / _STEPS).ravel(), at[-1])
    squared = squared_speed(np.diff(fine), spline(fine, 1), spline(fine, 2), velocity, acceleration)
    steps = 2.0 * np.diff(fine) / (np.sqrt(squared[:-1]) + np.sqrt(squared[1:]))
    instants = np.append(0.0, np.cumsum(steps))
    width = window(acceleration, jerk, instants[-1])
    if not width:
        return frozen(np.diff(instants[::_STEPS]))
    t = np.linspace(0.0, instants[-1] + width, _FINE)
    way = averaged(instants, fine, t, width)
    passed = np.interp(at[1:-1], way, t)
    return frozen(np.diff([0.0, *passed.tolist(), float(t[-1])]))


def squared_speed(ds: Array, first: Array, second: Array, velocity: Array, acceleration: Array) -> Array:
    """The greatest squared speed along the path at its steps, 0 at both ends.

    Args:
        ds: steps, shape (M - 1,).
        first: derivatives of the joints along the path, shape (M, n_joints).
        second: second derivatives, the same shape.
        velocity: limits, shape (n_joints,).
        acceleration: limits, the same shape.
    """
    slope, bend = np.abs(first), np.abs(second)
    moving, bent = slope > _STILL * slope.max(), bend > _STILL * bend.max()
    by_velocity = np.where(moving, velocity / np.where(moving, slope, 1.0), np.inf).min(axis=1) ** 2
    by_bend = np.where(bent, acceleration / np.where(bent, bend, 1.0), np.inf).min(axis=1)
    most = np.minimum(by_velocity, by_bend)
    forward = _passed(most, ds, first, second, moving, acceleration)
    # Backwards the path is the same with slopes of the other sign.
    return _passed(forward[::-1], ds[::-1], -first[::-1], second[::-1], moving[::-1], acceleration)[::-1]


def _passed(most: Array, ds: Array, first: Array, second: Array, moving: Array, acceleration: Array) -> Array:
    """The greatest squared speed that can be reached from rest at the first step."""
    reached = most.copy()
    reached[0] = 0.0
    sign, slope = np.sign(first), np.where(moving, np.abs(first), 1.0)
    for k, step in enumerate(ds.tolist()):
        left = (acceleration - sign[k] * second[k] * reached[k]) / slope[k]
        reached[k + 1] = min(reached[k + 1], max(reached[k] + 2.0 * step * left[moving[k]].min(initial=np.inf), 0.0))
    # Where nothing bounds the speed it would be infinite; a step from rest to rest would take for ever.
    bounded = np.where(np.isfinite(reached), reached, np.nanmax(np.where(np.isfinite(reached), reached, 0.0)))
    lowest = max(float(bounded.max()), np.finfo(float).tiny) * 1e-12
    bounded[1:-1] = np.maximum(bounded[1:-1], lowest)
    return bounded


def window(acceleration: Array, jerk: Array, duration: float) -> float:
    """Time over which positions are averaged, so that a jump from no acceleration to the greatest is a ramp [s]."""
    limited = np.isfinite(acceleration) & np.isfinite(jerk)
    wanted = float((acceleration[limited] / jerk[limited]).max(initial=0.0))
    return min(wanted, duration)


def averaged(instants: Array, way: Array, t: Array, width: float) -> Array:
    """Means of a way over the time ``width`` before each instant, at rest before and after.

    Args:
        instants: when the way is known, shape (M,) [s].
        way: the way there, shape (M,).
        t: where the means are wanted, from 0 to the end plus the width, shape (T,) [s].
        width: time over which is averaged [s].
    """
    from scipy.interpolate import PchipInterpolator  # imported where it computes, since that takes long

    integral, end, last = PchipInterpolator(instants, way).antiderivative(), instants[-1], way[-1]
    found: Array = (_extended(integral, t, end, last) - _extended(integral, t - width, end, last)) / width
    return found


def _extended(integral: object, t: Array, end: float, last: float) -> Array:
    """Integral of the position from 0 to t, where it is 0 before the start and the last one after the end."""
    inside = integral(np.clip(t, 0.0, end))  # type: ignore[operator]
    extended: Array = inside + np.maximum(t - end, 0.0) * last
    return extended
