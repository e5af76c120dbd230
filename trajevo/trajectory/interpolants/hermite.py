"""Polynomial segments from the states at their ends, and splines that determine these states by continuity.

A state is stored as Taylor coefficients q⁽ᵏ⁾/k!, which keeps the matrices integer and the systems well scaled.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from math import comb
from typing import Any

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.trajectory.interpolants.interpolant import AtRest, alike, breaks_of, known_velocities
from trajevo.trajectory.polynomial import PolynomialBatch


@cache
def hermite_matrix(r: int) -> Array:
    """Power coefficients on [0, 1] from r Taylor coefficients at each end, shape (2r, 2r), integers.

    The columns take q, q', ..., q⁽ʳ⁻¹⁾/(r-1)! at 0 and then at 1; r = 4 is the septic polynomial.
    """
    conditions = np.zeros((2 * r, 2 * r))
    conditions[:r, :r] = np.eye(r)
    for k in range(r):
        conditions[r + k] = [comb(power, k) for power in range(2 * r)]
    return frozen(np.rint(np.linalg.inv(conditions)))


def hermite_segments(start: Array, end: Array, durations: Array) -> Array:
    """The polynomial of degree 2r - 1 between two states, for any leading axes.

    Args:
        start: Taylor coefficients q⁽ᵏ⁾/k! at the beginning, shape (..., n_joints, r) [rad/s^k or m/s^k].
        end: the same at the end.
        durations: segment times, shape (...) [s].

    Returns:
        Power coefficients in the time since the beginning, shape (..., n_joints, 2r) [rad/s^k or m/s^k].
    """
    r = start.shape[-1]
    powers = durations[..., None, None] ** np.arange(2 * r)
    unit = np.concatenate([start * powers[..., :r], end * powers[..., :r]], axis=-1)
    coefficients: Array = (unit @ hermite_matrix(r).T) / powers
    return coefficients


def odd_spline(
    points: Array,
    durations: Array,
    r: int,
    *,
    at_rest: AtRest = (),
    velocities: Mapping[int, Array] | None = None,
    ends: Array | None = None,
    cyclic: bool = False,
) -> PolynomialBatch:
    """The C^(2r-2) spline of degree 2r - 1 through the points, with given states at both ends up to derivative r - 1.

    The free states at the inner points follow from the continuity of derivatives r to 2r - 2 there: a block
    tridiagonal system with blocks of r - 1, eliminated along the points for the whole population at once. Where a
    joint's velocity at an inner point is known, it replaces the continuity of the highest of these derivatives.

    Args:
        points: K points, shape (K, n_joints), or of each motion (B, K, n_joints) [rad or m].
        durations: shape (B, K - 1) [s].
        r: 2 for the cubic, 3 for the quintic, 4 for the septic spline.
        at_rest: joints at rest at inner points.
        velocities: velocities at inner points, shape (n_joints,) each [rad/s or m/s].
        ends: velocity and acceleration at the start, then at the end, shape (4, n_joints); at rest if None.
        cyclic: whether the end meets the start, with all derivatives up to 2r - 2, instead of given states.
    """
    population, segments = durations.shape
    states = np.zeros((population, segments + 1, points.shape[-1], r), dtype=durations.dtype)
    states[..., 0] = points
    if ends is not None:
        for place, (velocity, acceleration) in ((0, ends[:2]), (-1, ends[2:])):
            states[:, place, :, 1] = velocity
            states[:, place, :, 2:3] = 0.5 * acceleration[:, None]  # nowhere in a cubic spline
    known, values = known_velocities(points.shape[-2:], at_rest, velocities or {})
    # A slice for all joints at once, which numpy does not copy.
    groups: list[tuple[Any, list[int]]] = [*alike(known, points.shape[-1])] if known else [(slice(None), [])]
    for joints, at in groups if segments > 1 else []:
        outer = None if ends is None else states[:, [0, -1]][:, :, joints, 1:]
        positions, known_at = points[..., joints], (at, values[at][:, joints])
        if cyclic:
            outer = np.repeat(_state_of_cycle(positions, durations, r, known_at)[:, None], 2, axis=1)
            states[:, 0, joints, 1:] = states[:, -1, joints, 1:] = outer[:, 0]
        states[:, 1:-1, joints, 1:] = _inner_derivatives(positions, durations, r, known_at, outer)
        for point in at:
            states[:, point, joints, 1] = values[point, joints]  # exactly: rounding would carry a joint past the point
    return PolynomialBatch(breaks_of(durations), hermite_segments(states[:, :-1], states[:, 1:], durations))


def _state_of_cycle(positions: Array, durations: Array, r: int, known_at: tuple[list[int], Array]) -> Array:
    """Taylor coefficients 1 to r - 1 with which the end meets the start, shape (B, n_joints, r - 1).

    The spline is linear in them: derivatives r to 2r - 2 jump at the seam as those of the spline at rest there do, plus
    each coefficient times the jumps that it makes alone.
    """
    known, population = np.arange(1, r), len(durations)
    scale = (0.5 * (durations[:, 0] + durations[:, -1]))[:, None] ** known
    at_rest = _jumps_at_seam(positions, durations, r, known_at, np.zeros((population, positions.shape[-1], r - 1)))
    still = np.zeros((positions.shape[-2], 1))
    alone = [
        _jumps_at_seam(still, durations, r, (known_at[0], still[known_at[0]]), (one / scale)[:, None])
        for one in np.eye(r - 1)
    ]
    unit = np.linalg.solve(np.concatenate(alone, axis=2), -at_rest)
    state: Array = np.moveaxis(unit, 1, 2) / scale[:, None]
    return state


def _jumps_at_seam(positions: Array, durations: Array, r: int, known_at: tuple[list[int], Array], end: Array) -> Array:
    """Taylor coefficients r to 2r - 2 at the start minus those at the end, per unit of time, (B, r - 1, n_joints).

    Args:
        positions: as for :func:`_inner_derivatives`, and so the next three.
        durations: shape (B, K - 1) [s].
        r: as there.
        known_at: as there.
        end: Taylor coefficients 1 to r - 1 at both ends, shape (B, n_joints, r - 1).
    """
    inner = _inner_derivatives(positions, durations, r, known_at, np.repeat(end[:, None], 2, axis=1))
    states = np.zeros((len(durations), *positions.shape[-2:], r), dtype=inner.dtype)
    states[..., 0], states[:, 0, :, 1:], states[:, -1, :, 1:], states[:, 1:-1, :, 1:] = positions, end, end, inner
    first, last = (
        hermite_segments(states[:, k], states[:, k + 1], durations[:, k]) for k in (0, positions.shape[-2] - 2)
    )
    powers, orders = np.arange(2 * r), np.arange(r, 2 * r - 1)
    shift = np.array([[comb(power, k) for power in powers] for k in orders], dtype=np.float64)
    time = durations[:, -1, None, None] ** np.maximum(powers - orders[:, None], 0)
    jumps = np.moveaxis(first[..., r : 2 * r - 1], 1, 2) - (shift * time) @ np.moveaxis(last, 1, 2)
    scale: Array = (0.5 * (durations[:, :1] + durations[:, -1:])) ** orders
    return np.asarray(jumps * scale[..., None])


def _inner_derivatives(
    positions: Array, durations: Array, r: int, known_at: tuple[list[int], Array], outer: Array | None
) -> Array:
    """Taylor coefficients 1 to r - 1 at the inner points, shape (B, K - 2, n_joints, r - 1).

    Args:
        positions: of the points, shape (K, n_joints) or (B, K, n_joints).
        durations: shape (B, K - 1) [s].
        r: as for :func:`odd_spline`.
        known_at: P inner points with known velocities, and these, shape (P, n_joints).
        outer: Taylor coefficients 1 to r - 1 at both ends, shape (B, 2, n_joints, r - 1); 0 if None.
    """
    at_start = hermite_matrix(r)[r : 2 * r - 1]
    shift = np.array([[comb(power, k) for power in range(2 * r)] for k in range(r, 2 * r - 1)], dtype=np.float64)
    at_end = shift @ hermite_matrix(r)
    orders, known = np.arange(r, 2 * r - 1), np.arange(1, r)
    # The unit of time at a point is the mean of its two segment times, so that powers of times stay near 1.
    scale = 0.5 * (durations[:, :-1] + durations[:, 1:])
    # Continuity at point i: at_end of the segment before, minus at_start of the one after, is zero.
    before, after = (durations[:, :-1] / scale)[..., None, None], (durations[:, 1:] / scale)[..., None, None]
    rows_before, rows_after = before ** -orders[:, None], after ** -orders[:, None]
    diagonal = rows_before * at_end[:, r + 1 :] * before**known - rows_after * at_start[:, 1:r] * after**known
    left, right = rows_before * at_end[:, 1:r] * before**known, -rows_after * at_start[:, r + 1 :] * after**known
    chord = np.diff(positions, axis=-2)
    # At equal positions all Taylor coefficients above 0 vanish, so only the chords enter: a column times a chord.
    drive = (
        rows_after * at_start[:, r : r + 1] * chord[..., 1:, None, :]
        + rows_before * at_end[:, :1] * chord[..., :-1, None, :]
    )
    if outer is not None:
        states = np.moveaxis(outer, -1, -2)
        for place, side in ((0, left), (-1, right)):
            drive[:, place] -= side[:, place] @ (states[:, place] * scale[:, place, None, None] ** known[:, None])
    left, right = left[:, 1:], right[:, :-1]
    # A neighbouring point has its own unit of time.
    ratio = (scale[:, :-1] / scale[:, 1:])[..., None, None]
    left, right = left * ratio**-known, right * ratio**known
    for inner, velocity in ((point - 1, velocity) for point, velocity in zip(*known_at, strict=True)):
        diagonal[:, inner, -1], drive[:, inner, -1] = np.eye(r - 1)[0], scale[:, inner, None] * velocity
        left[:, inner - 1 : inner, -1] = right[:, inner : inner + 1, -1] = 0.0
    unit = solve_block_tridiagonal(left, diagonal, right, drive)
    return np.moveaxis(unit / (scale[..., None, None] ** known[:, None]), -1, -2)


def solve_block_tridiagonal(left: Array, diagonal: Array, right: Array, drive: Array) -> Array:
    """Block elimination along N; diagonal (B, N, m, m), left and right (B, N - 1, m, m), drive (B, N, m, n)."""
    count = diagonal.shape[1]
    reduced: list[Array] = []
    solution = np.empty_like(drive)
    pivot, load = diagonal[:, 0], drive[:, 0]
    for i in range(count):
        if i > 0:
            pivot = diagonal[:, i] - left[:, i - 1] @ reduced[i - 1]
            load = drive[:, i] - left[:, i - 1] @ solution[:, i - 1]
        if i < count - 1:
            reduced.append(np.asarray(np.linalg.solve(pivot, right[:, i]), drive.dtype))
        solution[:, i] = np.linalg.solve(pivot, load)
    for i in range(count - 2, -1, -1):
        solution[:, i] -= reduced[i] @ solution[:, i + 1]
    return solution
