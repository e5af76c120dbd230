"""The bounds of velocity, acceleration and jerk along a path of Paing 2021, eqs. (20)-(25).

With S the greatest magnitudes of the path's derivatives in u, and V, A, J the coefficients (10), (12), (14) of the
derivatives of u(t) that belong together, they are S₁ V, S₂ V² + S₁ |A| and S₃ V³ + 3 S₂ |A| V + S₁ |J|. For velocity
and acceleration they are rigorous; for jerk the paper does not prove it, since a product of two sums comes in.
"""

from __future__ import annotations

from functools import reduce

import numpy as np

from trajevo.arrays import Array
from trajevo.curve import GeometricPath

#: Velocity, acceleration, jerk.
ORDERS = (1, 2, 3)

#: Which coefficients of velocity and acceleration, counted from that of the jerk, meet in the terms of (25).
_MEETING = ((0, 0), (1, 0), (1, 1), (2, 1))


def derived_coefficients(control_points: Array, knots: Array, order: int) -> list[Array]:
    """Coefficients (10), (12), (14) of the derivatives of u(t) in unit time, each (B, n_control_points - order)."""
    c, found = control_points, []
    for taken in ORDERS:
        last = c.shape[1] - 1
        c = (order - taken) * np.diff(c, axis=1) / (knots[order : order + last] - knots[taken : taken + last])
        found.append(c)
    return found


def peaks(path: GeometricPath, derived: list[Array]) -> list[Array]:
    """The three bounds, each (B, n_axes)."""
    v, a, j = derived
    a, j = a * np.sign(a.real), j * np.sign(j.real)
    return [reduce(np.maximum, _terms(path, order, v, a, j)).max(axis=2).T for order in ORDERS]


def signed_terms(path: GeometricPath, derived: list[Array], derivative: int) -> Array:
    """Terms with a bound as their greatest, with A and J of both signs, so that each is smooth; (B, n_axes, K)."""
    v, a, j = derived
    signs = [((1, 1),), ((1, 1), (-1, 1)), ((1, 1), (1, -1), (-1, 1), (-1, -1))][derivative - 1]
    terms = [term for turn, sign in signs for term in _terms(path, derivative, v, turn * a, sign * j)]
    return np.swapaxes(np.concatenate(terms, axis=2), 0, 1)


def _terms(path: GeometricPath, derivative: int, v: Array, a: Array, j: Array) -> list[Array]:
    """Terms of (21), (23) or (25), each (n_axes, B, K); v is never negative."""
    s1, s2, s3 = (path.peak(order)[:, None, None] for order in ORDERS)
    if derivative == 1:
        return [s1 * v]
    size = (v, a, j)[derivative - 1].shape[1]
    speed = [v[:, k : k + size] for k in range(derivative)]
    if derivative == 2:
        rest = s1 * a
        return [s2 * some**2 + rest for some in speed]
    rest = s1 * j
    return [s3 * speed[k] ** 3 + s2 * (3.0 * a[:, i : i + size] * speed[k]) + rest for k, i in _MEETING]
