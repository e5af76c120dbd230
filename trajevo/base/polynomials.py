"""Many polynomials at once on the unit interval: values, and exact extremes of every derivative.

Coefficients are in ascending powers along the **first** axis, so that Horner's rule runs over whole arrays. Complex
coefficients are real ones with a complex step in a parameter: the real parts alone determine where roots and extremes
lie, and the values there are complex, so that imaginary parts are exact derivatives (the shift of an extreme does not
change its value to first order).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from trajevo.base import jit
from trajevo.base.arrays import Array
from trajevo.base.solving.crossings import crossings

# An error d of a stationary point changes the value there by about d²: with this step values are exact to rounding.
_STEP_TOLERANCE = 1e-10
# Newton needs 3 to 6 steps; bisection alone, the worst case, 34.
_MAX_STEPS = 60
# Longest step from a cubic's stationary point to that of a polynomial next to it.
_STEP_NEAR = 0.1


def derivative(coefficients: Array, order: int = 1) -> Array:
    """Coefficients of the ``order``-th derivative, shape (degree + 1 - order, ...); one zero row beyond the degree."""
    result = coefficients
    for _ in range(order):
        if len(result) == 1:
            return np.zeros_like(result)
        powers = np.arange(1, len(result), dtype=np.float64)
        result = result[1:] * powers.reshape((-1,) + (1,) * (result.ndim - 1))
    return result


def values(coefficients: Array, u: Array) -> Array:
    """Values at u by Horner's rule; ``u`` broadcasts against ``coefficients[0]``."""
    if len(coefficients) == 1:
        constant: Array = coefficients[0] + np.zeros_like(u)
        return constant
    result: Array = coefficients[-1] * u
    result += coefficients[-2]
    for row in coefficients[-3::-1]:
        result *= u
        result += row
    return result


def shifted(coefficients: Array, by: Array) -> Array:
    """Coefficients in powers of u - by, the same polynomial; ``by`` broadcasts against ``coefficients[0]``."""
    result: Array = coefficients + np.zeros_like(by, dtype=np.result_type(coefficients, by))
    for k in range(len(result) - 1):
        for i in range(len(result) - 2, k - 1, -1):
            result[i] += by * result[i + 1]
    return result


def cubic(value: Array, slope: Array, last: Array, last_slope: Array) -> Array:
    """Coefficients (4, M) of cubics on [0, 1] from values and slopes at 0, and at 1, each of shape (M,)."""
    rise = last - value
    return np.stack([value, slope, 3.0 * rise - 2.0 * slope - last_slope, slope + last_slope - 2.0 * rise])


def quintic(start: tuple[Array, Array, Array], end: tuple[Array, Array, Array]) -> Array:
    """Coefficients (6, M) of quintics on [0, 1] from values, slopes and second derivatives at 0, and at 1."""
    (value, slope, bend), (last, last_slope, last_bend) = start, end
    # What the parabola with the given start leaves to be reached at the end.
    rise, steeper, rounder = last - value - slope - 0.5 * bend, last_slope - slope - bend, 0.5 * (last_bend - bend)
    return np.stack(
        [
            *(value, slope, 0.5 * bend),
            10.0 * rise - 4.0 * steeper + rounder,
            7.0 * steeper - 15.0 * rise - 2.0 * rounder,
            6.0 * rise - 3.0 * steeper + rounder,
        ]
    )


def root_of_rising(coefficients: Array) -> Array:
    """Roots of polynomials that increase on [0, 1] from below to above 0; one end of [0, 1] if there is no sign change.

    Args:
        coefficients: shape (degree + 1, M); if they are complex, the imaginary part of a root is its derivative.

    Returns:
        Shape (M,).
    """
    real = np.ascontiguousarray(coefficients.real)
    left, right = np.zeros(real.shape[1]), np.ones(real.shape[1])
    with np.errstate(divide="ignore", invalid="ignore"):
        chord = -real[0] / real[1:].sum(axis=0)
    guess = np.where((chord >= 0.0) & (chord <= 1.0), chord, 0.5)
    roots: Array = _bracketed_newton(real, left, right, guess, np.ones(real.shape[1], dtype=bool))
    return _with_derivative(coefficients, roots)


def crossing(coefficients: Array, left: Array, right: Array) -> Array:
    """Where each polynomial changes its sign between left and right; right if its values there have the same sign.

    Args:
        coefficients: shape (degree + 1, M), M polynomials with at most one sign change there; if they are complex, the
            imaginary part of what is found is its derivative.
        left: shape (M,).
        right: shape (M,).

    Returns:
        Shape (M,).
    """
    real, lower, upper = coefficients.real, left.real, right.real
    found = right.astype(np.result_type(coefficients, left, right))
    if jit.can_compile():
        roots, changes = np.empty(len(lower)), np.empty(len(lower), dtype=bool)
        crossings(real, lower, upper, roots, changes)
        found[changes] = _with_derivative(coefficients[:, changes], roots[changes])
        return found
    at_left, at_right = values(real, lower), values(real, upper)
    changes = at_left * at_right < 0.0
    if changes.any():
        real, start, end = real[:, changes], lower[changes], upper[changes]
        before, after = at_left[changes], at_right[changes]
        chord = start + (end - start) * before / (before - after)
        roots = _bracketed_newton(real, start, end, chord, after > 0.0)
        found[changes] = _with_derivative(coefficients[:, changes], roots)
    return found


def of_one_sign(coefficients: Array, left: Array, right: Array) -> tuple[Array, Array, Array]:
    """Parts of intervals in which polynomials keep their sign.

    Args:
        coefficients: as in :func:`crossing`, but with up to two sign changes between left and right.
        left: where the intervals begin, shape (M,).
        right: where they end.

    Returns:
        Number of the polynomial of each part, where it begins and where it ends, each of shape (L,). A part that would
        be empty is left out, unless it is the only one.
    """
    turn = crossing(derivative(coefficients), left, right)
    bends = np.flatnonzero(turn.real < right.real)
    first, last = crossing(coefficients, left, turn), crossing(coefficients[:, bends], turn[bends], right[bends])
    numbers = np.arange(len(left))
    which = np.concatenate([numbers, numbers, bends, bends])
    lower = np.concatenate([left, first, turn[bends], last])
    upper = np.concatenate([first, turn, last, right[bends]])
    kept = lower.real < upper.real
    kept[: len(numbers)] |= left.real == right.real
    return which[kept], lower[kept], upper[kept]


def _with_derivative(coefficients: Array, roots: Array) -> Array:
    """Roots (M,) whose imaginary parts are their derivatives, if the polynomials have complex coefficients."""
    if not np.iscomplexobj(coefficients):
        return roots
    slope, value = values(derivative(coefficients.real), roots), values(coefficients, roots)
    moved = np.divide(-value.imag, slope, out=np.zeros_like(slope), where=slope != 0.0)
    stepped: Array = roots + 1j * moved
    return stepped


def extremes(coefficients: Array, orders: int) -> tuple[Array, Array]:
    """Least and greatest value on [0, 1] of polynomials and their first derivatives.

    The stationary points of one derivative are the roots of the next. The computation starts at the constant
    derivative and climbs to the polynomial itself: between two neighbouring stationary points a polynomial is monotone,
    so each root is bracketed and found by Newton's method kept inside its bracket, until values are exact to rounding.
    One climb serves all derivatives. Cubics have closed forms.

    Args:
        coefficients: shape (degree + 1, M), M polynomials.
        orders: how many derivatives, from the polynomial itself (order 0) on.

    Returns:
        Least and greatest values, each of shape (orders, M).
    """
    if len(coefficients) == 4 and orders <= 4:
        return _extremes_of_cubics(coefficients, orders)
    count = coefficients.shape[1]
    lower, upper = (np.zeros((orders, count), dtype=coefficients.dtype) for _ in range(2))
    nodes = np.concatenate([np.zeros((1, count)), np.ones((1, count))])
    for order in range(len(coefficients) - 1, -1, -1):
        current = derivative(coefficients, order)
        at_nodes = values(current[:, None, :], nodes)
        if order < orders:
            lower[order], upper[order] = at_nodes.min(axis=0), at_nodes.max(axis=0)
        if order > 0 and len(current) > 1:
            nodes = _roots_between(current.real, nodes, at_nodes.real)
    return lower, upper


def _extremes_of_cubics(coefficients: Array, orders: int) -> tuple[Array, Array]:
    """As :func:`extremes`; any point of [0, 1] may replace a stationary point that does not exist."""
    real = coefficients.real
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        inner = [_stationary_of_cubics(real), [-real[2] / (3.0 * real[3])], [], []]
    lower, upper = (np.empty((orders, coefficients.shape[1]), dtype=coefficients.dtype) for _ in range(2))
    for order, places in enumerate(inner[:orders]):
        current = derivative(coefficients, order)
        end = current.sum(axis=0)
        np.minimum(current[0], end, out=lower[order])
        np.maximum(current[0], end, out=upper[order])
        for place in places:
            # Given a number and NaN, fmax and fmin return the number.
            at_place = values(current, np.fmin(np.fmax(place, 0.0), 1.0))
            np.minimum(lower[order], at_place, out=lower[order])
            np.maximum(upper[order], at_place, out=upper[order])
    return lower, upper


def _stationary_of_cubics(real: Array) -> list[Array]:
    """Both roots of the slopes of real cubics (4, M), each (M,); where there are none, any numbers or NaN."""
    half = -(real[2] + np.copysign(np.sqrt(np.maximum(real[2] * real[2] - 3.0 * real[3] * real[1], 0.0)), real[2]))
    return [half / (3.0 * real[3]), real[1] / half]


def extremes_near_cubics(coefficients: Array, cubics: Array) -> Array:
    """Values on [0, 1] among which are the extremes of polynomials, sought from those of cubics next to them.

    A step of Newton's method leads from a cubic's stationary points to the polynomial's, faster than the climb of
    :func:`extremes`. What it leaves out is of the fourth order in the distance of the two curves' slopes.

    Args:
        coefficients: of M polynomials, shape (degree + 1, M).
        cubics: of M cubics, shape (4, M).

    Returns:
        Values at both ends and at up to four places, shape (6, M).
    """
    slopes = derivative(coefficients.real)
    bends = derivative(slopes)
    found = [coefficients[0], coefficients.sum(axis=0)]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for place in _stationary_of_cubics(cubics.real):
            start = np.fmin(np.fmax(place, 0.0), 1.0)
            # Given a number and NaN, fmax and fmin return the number.
            step = np.fmin(np.fmax(-values(slopes, start) / values(bends, start), -_STEP_NEAR), _STEP_NEAR)
            found += [values(coefficients, at) for at in (start, np.clip(start + step, 0.0, 1.0))]
    return np.stack(found)


def _roots_between(coefficients: Array, nodes: Array, at_nodes: Array) -> Array:
    """Nodes 0, the root of every interval, and 1, sorted along axis 0, shape (intervals + 2, M).

    An interval without a sign change has no root inside; its right node, which is also a point of [0, 1], replaces it.
    """
    count, inner = nodes.shape[1], nodes[1:].copy()
    below, above = at_nodes < 0.0, at_nodes > 0.0
    found = np.flatnonzero((below[:-1] & above[1:]) | (above[:-1] & below[1:]))
    if len(found):
        # Places in flat arrays: numpy takes them several times as fast as by two indices or by a mask.
        left, right = nodes.take(found), nodes.take(found + count)
        active = coefficients.take(found % count, axis=1)
        if len(coefficients) <= 3:
            roots = _closed_form(active, left, right)
        else:
            from_value, to_value = at_nodes.take(found), at_nodes.take(found + count)
            # Between two stationary points the curve resembles the cubic 3t² - 2t³, whose inverse is in closed form.
            share = from_value / (from_value - to_value)
            guess = left + (right - left) * (0.5 - np.sin(np.arcsin(1.0 - 2.0 * share) / 3.0))
            roots = _bracketed_newton(active, left, right, guess, to_value > 0.0)
        inner.put(found, roots)
    return np.concatenate([nodes[:1], inner, nodes[-1:]])


def _closed_form(coefficients: Array, left: Array, right: Array) -> Array:
    """The root inside [left, right] of linear or quadratic polynomials that change sign there."""
    if len(coefficients) == 2:
        linear: Array = np.clip(-coefficients[0] / coefficients[1], left, right)
        return linear
    c, b, a = coefficients
    half = -0.5 * (b + np.copysign(np.sqrt(np.maximum(b * b - 4.0 * a * c, 0.0)), b))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        first, second = half / a, c / half
    quadratic: Array = np.clip(np.where((first >= left) & (first <= right), first, second), left, right)
    return quadratic


def _bracketed_newton(
    coefficients: Array, left: Array, right: Array, guess: Array, rising: np.ndarray[Any, np.dtype[np.bool_]]
) -> Array:
    """The root of each polynomial that is monotone on [left, right] with a sign change there, from a guess."""
    slopes = derivative(coefficients)
    roots, active = guess.copy(), np.arange(len(guess))
    root, last_step = guess, right - left
    for _ in range(_MAX_STEPS):
        value = values(coefficients, root)
        beyond = (value > 0.0) == rising
        right = np.where(beyond, root, right)
        left = np.where(beyond, left, root)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            newton = root - value / values(slopes, root)
        inside = (newton >= left) & (newton <= right) & (np.abs(newton - root) <= 0.5 * last_step)
        following = np.where(inside, newton, 0.5 * (left + right))
        last_step = np.abs(following - root)
        root = following
        going = np.flatnonzero(last_step > _STEP_TOLERANCE)
        if len(going) < len(root):
            roots[active] = root
            if not len(going):
                break
            coefficients, slopes = coefficients.take(going, axis=1), slopes.take(going, axis=1)
            left, right, root, last_step = (each.take(going) for each in (left, right, root, last_step))
            rising, active = rising[going], active[going]
    roots[active] = root
    return roots
