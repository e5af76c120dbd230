"""The least of a / z + b z + c z² over speeds z: what a place of the path contributes to a lower bound."""

from __future__ import annotations

import numpy as np

from trajevo.base.arrays import Array

#: Steps of Newton's method, and the least speed that is looked at, as a share of the greatest.
_STEPS, _SLOWEST = 40, 1e-6

#: Share of the sum of magnitudes by which a value is lowered for rounding.
_ROUNDING = 1e-14

#: The least of a / z + c z² is this times the cube root of a² c.
_OF_TWO = 3.0 / 2.0 ** (2.0 / 3.0)


def least(a: Array, b: Array, c: Array, fastest: Array) -> tuple[Array, Array]:
    """A lower bound of min a / z + b z + c z² over 0 < z <= fastest, and the speed where it is nearly attained.

    The minimum is concave in (a, b, c) together and rises with each of them. The bound holds for any z that Newton's
    method ends with: the function is convex where c >= 0, and the tangent there lies below it. Where c < 0, c z² is
    replaced by its chord, which lies below it.

    Args:
        a: not negative, shape (...).
        b: of any sign, the same shape.
        c: of any sign, the same shape.
        fastest: greatest speed, the same shape; inf for none.

    Returns:
        Bounds and speeds, each of that shape; -inf where no speed is the greatest and b or c is negative.
    """
    free = np.isinf(fastest)
    if free.any():
        bounded, speeds = least(a, b, c, np.where(free, 1.0, fastest))
        anywhere, at = _without_end(a, b, c)
        return np.where(free, anywhere, bounded), np.where(free, at, speeds)
    b, c = b + np.minimum(c, 0.0) * fastest, np.maximum(c, 0.0)
    z = _stationary(a, b, c, fastest)
    terms = a / z, b * z, c * z * z
    slope = b + 2.0 * c * z - a / (z * z)
    # On the way to the greatest speed the tangent falls by at most its slope times the way, and likewise to zero.
    falls = np.maximum(-slope, 0.0) * (fastest - z) + np.maximum(slope, 0.0) * z
    size = np.abs(terms[0]) + np.abs(terms[1]) + np.abs(terms[2])
    return terms[0] + terms[1] + terms[2] - falls - _ROUNDING * size, z


def _stationary(a: Array, b: Array, c: Array, fastest: Array) -> Array:
    """Where 2 c z³ + b z² = a, or the nearest speed within the range; bisection in the logarithm, then Newton."""
    low, high = np.log(_SLOWEST * fastest), np.log(fastest)
    for _ in range(_STEPS):
        middle = 0.5 * (low + high)
        z = np.exp(middle)
        falling = (2.0 * c * z + b) * z * z < a
        low, high = np.where(falling, middle, low), np.where(falling, high, middle)
    z = np.exp(0.5 * (low + high))
    for _ in range(2):
        slope = 6.0 * c * z * z + 2.0 * b * z
        step = ((2.0 * c * z + b) * z * z - a) / np.where(slope > 0.0, slope, np.inf)
        z = np.clip(z - step, _SLOWEST * fastest, fastest)
    # Where the function still falls at the end of the range, its least value is there.
    return np.where((2.0 * c * fastest + b) * fastest * fastest <= a, fastest, z)


def _without_end(a: Array, b: Array, c: Array) -> tuple[Array, Array]:
    """The same for all speeds; b z, where it is not negative, is left out."""
    square = np.maximum(c, 0.0)
    value = _OF_TWO * np.cbrt(a * a * square) * (1.0 - _ROUNDING)
    with np.errstate(divide="ignore", invalid="ignore"):
        at = np.cbrt(a / (2.0 * square))
    return np.where((b >= 0.0) & (c >= 0.0), value, -np.inf), np.where(np.isfinite(at), at, 1.0)
