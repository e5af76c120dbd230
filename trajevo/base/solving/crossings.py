"""Where polynomials change their sign, one at a time, in loops that numba (the optional extra ``fast``) compiles.

They replace loops of :mod:`trajevo.base.polynomials` over whole arrays, with the same arithmetic in the same order.
"""

from __future__ import annotations

from trajevo.base.arrays import Array
from trajevo.base.jit import fast

#: As in :mod:`trajevo.base.polynomials`: length of the last step towards a root, and greatest number of steps.
_STEP_TOLERANCE, _MAX_STEPS = 1e-10, 60


@fast("f8[2], f8[1], f8[1] -> f8[1], b1[1]")
def crossings(coefficients: Array, left: Array, right: Array, roots: Array, changes: Array) -> None:
    """Roots of polynomials with at most one change of their sign between left and right; right if there is none.

    Args:
        coefficients: in ascending powers, shape (degree + 1, M).
        left: shape (M,).
        right: shape (M,).
        roots: output, shape (M,).
        changes: output, whether there is a change, shape (M,).
    """
    for m in range(len(left)):
        start, end = left[m], right[m]
        before, after = value_of(coefficients, m, start), value_of(coefficients, m, end)
        changes[m] = before * after < 0.0
        if not changes[m]:
            roots[m] = end
            continue
        root = start + (end - start) * before / (before - after)
        last_step = end - start
        for _ in range(_MAX_STEPS):
            value = value_of(coefficients, m, root)
            if (value > 0.0) == (after > 0.0):
                end = root
            else:
                start = root
            newton = root - value / slope_of(coefficients, m, root)
            if start <= newton <= end and abs(newton - root) <= 0.5 * last_step:
                following = newton
            else:
                following = 0.5 * (start + end)
            last_step = abs(following - root)
            root = following
            if last_step <= _STEP_TOLERANCE:
                break
        roots[m] = root


@fast
def value_of(coefficients: Array, m: int, u: float) -> float:
    """The value of one polynomial by Horner's rule."""
    value: float = coefficients[-1, m]
    for k in range(len(coefficients) - 2, -1, -1):
        value = value * u + coefficients[k, m]
    return value


@fast
def slope_of(coefficients: Array, m: int, u: float) -> float:
    """Its derivative."""
    last = len(coefficients) - 1
    if last < 1:
        return 0.0
    slope: float = coefficients[last, m] * last
    for k in range(last - 1, 0, -1):
        slope = slope * u + coefficients[k, m] * k
    return slope
