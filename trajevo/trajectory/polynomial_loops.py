"""Loops over polynomial segments, one number at a time, which numba (the optional extra ``fast``) compiles.

With numba installed they replace :mod:`trajevo.base.polynomials`. The arithmetic is the same, so that results agree up
to rounding. :func:`samples` and :func:`extremes` take real numbers; :func:`complex_samples` and
:func:`complex_extremes` take complex ones, whose imaginary parts carry derivatives.
"""

from __future__ import annotations

import math

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.jit import fast

#: As in :mod:`trajevo.base.polynomials`: length of the last step towards a root, and greatest number of steps.
_STEP_TOLERANCE, _MAX_STEPS = 1e-10, 60


@fast("f8[4], f8[2], f8[1], i8 -> f8[4]")
def samples(coefficients: Array, steps: Array, shares: Array, first: int, out: Array) -> None:
    """Values of derivatives at shares of every segment.

    Args:
        coefficients: shape (B, S, n, degree + 1), ascending powers of the time since the segment began.
        steps: lengths of the segments, shape (B, S).
        shares: from 0 to 1, shape (U,).
        first: order of the first derivative to write.
        out: output, derivatives from ``first`` on, shape (derivatives, B, S, U n).
    """
    orders, batch, segments, _ = out.shape
    joints, count = coefficients.shape[2:]
    current = np.empty(count)
    for b in range(batch):
        for s in range(segments):
            for j in range(joints):
                if count == 4 and first == 0 and orders == 3:
                    c0, c1, c2, c3 = coefficients[b, s, j]
                    for u in range(len(shares)):
                        t, w = shares[u] * steps[b, s], u * joints + j
                        out[0, b, s, w] = ((c3 * t + c2) * t + c1) * t + c0
                        out[1, b, s, w] = (3.0 * c3 * t + 2.0 * c2) * t + c1
                        out[2, b, s, w] = 6.0 * c3 * t + 2.0 * c2
                    continue
                for k in range(orders):
                    size = count - 1 - first - k
                    differentiate(coefficients[b, s, j], first + k, current)
                    for u in range(len(shares)):
                        value = value_at(current, size, shares[u] * steps[b, s]) if size >= 0 else 0.0
                        out[k, b, s, u * joints + j] = value


@fast("f8[4], f8[2], i8, f8[2], f8[1] -> f8[2]", "c16[4], c16[2], i8, f8[2], f8[1] -> c16[2]")
def square_integrals(coefficients: Array, steps: Array, order: int, powers: Array, weights: Array, out: Array) -> None:
    """Integrals of a derivative's square over all segments, by quadrature in each; also for complex numbers.

    Args:
        coefficients: shape (B, S, n, degree + 1), ascending powers of the time since the segment began.
        steps: lengths of the segments, shape (B, S).
        order: which derivative.
        powers: matrix from coefficients on the unit interval to the derivative's values at the nodes, shape
            (nodes, degree + 1).
        weights: weights of the nodes, shape (nodes,).
        out: output, shape (B, n).
    """
    batch, segments, joints, count = coefficients.shape
    unit = np.empty(count, out.dtype)
    for b in range(batch):
        for j in range(joints):
            out[b, j] = 0.0
        for s in range(segments):
            step = steps[b, s]
            factor = step / step ** (2 * order)
            for j in range(joints):
                power = 1.0
                for k in range(count):
                    unit[k] = coefficients[b, s, j, k] * power
                    power *= step
                integral = 0.0
                for node in range(len(weights)):
                    value = 0.0
                    for k in range(order, count):
                        value += powers[node, k] * unit[k]
                    integral += value * value * weights[node]
                out[b, j] += integral * factor


@fast("f8[4], f8[2] -> f8[4], f8[4], f8[3], f8[3]")
def extremes(coefficients: Array, steps: Array, least: Array, greatest: Array, lowest: Array, highest: Array) -> None:
    """Exact least and greatest values of the first derivatives, see :func:`trajevo.base.polynomials.extremes`.

    Args:
        coefficients: shape (B, S, n, degree + 1), ascending powers of the time since the segment began.
        steps: lengths of the segments, shape (B, S).
        least: output, least values of every segment, shape (derivatives, B, S, n).
        greatest: output, greatest values of every segment, the same shape.
        lowest: output, least values over all segments, shape (derivatives, B, n).
        highest: output, greatest values over all segments, the same shape.
    """
    orders, batch, segments, joints = least.shape
    degree = coefficients.shape[3] - 1
    unit, low, high = np.empty(degree + 1), np.zeros(orders), np.zeros(orders)
    places, counts, room = np.empty((orders, degree + 2)), np.zeros(orders, np.intp), np.empty((4, degree + 2))
    for b in range(batch):
        for s in range(segments):
            for j in range(joints):
                power = 1.0
                for k in range(degree + 1):
                    unit[k] = coefficients[b, s, j, k] * power
                    power *= steps[b, s]
                if degree == 3 and orders == 4:
                    _of_cubic(unit, low, high)
                else:
                    climb(unit, low, high, places, counts, room)
                scale = 1.0
                for order in range(orders):
                    least[order, b, s, j], greatest[order, b, s, j] = low[order] * scale, high[order] * scale
                    if s == 0:
                        lowest[order, b, j], highest[order, b, j] = np.inf, -np.inf
                    lowest[order, b, j] = min(lowest[order, b, j], least[order, b, s, j])
                    highest[order, b, j] = max(highest[order, b, j], greatest[order, b, s, j])
                    scale /= steps[b, s]


@fast
def _of_cubic(c: Array, low: Array, high: Array) -> None:
    """Closed forms without branches; any point of [0, 1] may replace a stationary point that does not exist."""
    half = -(c[2] + math.copysign(math.sqrt(max(c[2] * c[2] - 3.0 * c[3] * c[1], 0.0)), c[2]))
    first, second, turn = inside(half / (3.0 * c[3])), inside(c[1] / half), inside(-c[2] / (3.0 * c[3]))
    end = c[0] + c[1] + c[2] + c[3]
    one = ((c[3] * first + c[2]) * first + c[1]) * first + c[0]
    other = ((c[3] * second + c[2]) * second + c[1]) * second + c[0]
    low[0], high[0] = min(min(c[0], end), min(one, other)), max(max(c[0], end), max(one, other))
    end = c[1] + 2.0 * c[2] + 3.0 * c[3]
    one = (3.0 * c[3] * turn + 2.0 * c[2]) * turn + c[1]
    low[1], high[1] = min(min(c[1], end), one), max(max(c[1], end), one)
    start, end = 2.0 * c[2], 2.0 * c[2] + 6.0 * c[3]
    low[2], high[2] = min(start, end), max(start, end)
    low[3] = high[3] = 6.0 * c[3]


@fast
def inside(u: float) -> float:
    """The nearest point of [0, 1]; 0 for NaN."""
    return min(u, 1.0) if u > 0.0 else 0.0


@fast
def climb(unit: Array, low: Array, high: Array, places: Array, counts: Array, room: Array) -> None:
    """Extremes of all derivatives, from the constant one on: the roots of each are the stationary points of the next.

    The ends and stationary points of every derivative are written into ``places``, their number into ``counts``.
    """
    degree, current, values, count = len(unit) - 1, room[0], room[1], 2
    nodes, roots = room[2], room[3]
    nodes[0], nodes[1] = 0.0, 1.0
    for order in range(degree, -1, -1):
        size = degree - order
        differentiate(unit, order, current)
        for i in range(count):
            values[i] = value_at(current, size, nodes[i])
        if order < len(low):
            low[order] = high[order] = values[0]
            counts[order] = count
            for i in range(count):
                low[order], high[order] = min(low[order], values[i]), max(high[order], values[i])
                places[order, i] = nodes[i]
        if order == 0 or size == 0:
            continue
        roots[0], found = 0.0, 1
        for i in range(count - 1):
            if (values[i] < 0.0 < values[i + 1]) or (values[i] > 0.0 > values[i + 1]):
                roots[found] = _root(current, size, nodes[i], nodes[i + 1], values[i], values[i + 1])
                found += 1
        roots[found] = 1.0
        nodes, roots, count = roots, nodes, found + 1


@fast
def differentiate(unit: Array, order: int, current: Array) -> None:
    """Coefficients of a derivative."""
    for i in range(len(unit) - order):
        current[i] = unit[i + order]
        for k in range(order):
            current[i] *= i + order - k


@fast
def value_at(coefficients: Array, degree: int, u: float) -> float:
    """Value of a polynomial."""
    value: float = coefficients[degree]
    for k in range(degree - 1, -1, -1):
        value = value * u + coefficients[k]
    return value


@fast
def _root(c: Array, degree: int, left: float, right: float, from_value: float, to_value: float) -> float:
    """The root between two neighbouring stationary points with values of opposite signs."""
    root: float = -c[0] / c[1]
    if degree == 2:
        half = -0.5 * (c[1] + math.copysign(math.sqrt(max(c[1] * c[1] - 4.0 * c[2] * c[0], 0.0)), c[1]))
        root = half / c[2]
        if not left <= root <= right:
            root = c[0] / half
    if degree <= 2:
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


@fast("c16[4], c16[2], f8[1], i8 -> c16[4]")
def complex_samples(coefficients: Array, steps: Array, shares: Array, first: int, out: Array) -> None:
    """As :func:`samples`; coefficients, steps and output are complex."""
    orders, batch, segments, _ = out.shape
    joints, count = coefficients.shape[2:]
    factors = np.ones((orders, count))
    for order in range(orders):
        for k in range(count):
            for power in range(k, k - first - order, -1):
                factors[order, k] *= power
    for b in range(batch):
        for s in range(segments):
            for j in range(joints):
                if count == 4 and first == 0 and orders == 3:
                    _of_cubic_at(coefficients[b, s, j], shares, steps[b, s], out[:, b, s, j:], joints)
                    continue
                for order in range(orders):
                    for u in range(len(shares)):
                        t, step = shares[u] * steps[b, s].real, shares[u] * steps[b, s].imag
                        value = slope = 0.0
                        for k in range(count - 1, first + order - 1, -1):
                            entry = coefficients[b, s, j, k]
                            slope = slope * t + value * step + factors[order, k] * entry.imag
                            value = value * t + factors[order, k] * entry.real
                        out[order, b, s, u * joints + j] = complex(value, slope)


@fast
def _of_cubic_at(coefficients: Array, shares: Array, length: complex, out: Array, apart: int) -> None:
    """A cubic and its first two derivatives at shares of a segment, written to every ``apart``-th entry of ``out``."""
    c0, c1, c2, c3 = coefficients
    a, b, c, d, e, f, g, h = c0.real, c1.real, c2.real, c3.real, c0.imag, c1.imag, c2.imag, c3.imag
    for u in range(len(shares)):
        t, step, w = shares[u] * length.real, shares[u] * length.imag, u * apart
        v, x = (3.0 * d * t + 2.0 * c) * t + b, 6.0 * d * t + 2.0 * c
        out[0, w] = complex(((d * t + c) * t + b) * t + a, ((h * t + g) * t + f) * t + e + v * step)
        out[1, w] = complex(v, (3.0 * h * t + 2.0 * g) * t + f + x * step)
        out[2, w] = complex(x, 6.0 * h * t + 2.0 * g + 6.0 * d * step)


@fast("c16[4], c16[2] -> c16[4], c16[4], c16[3], c16[3]")
def complex_extremes(
    coefficients: Array, steps: Array, least: Array, greatest: Array, lowest: Array, highest: Array
) -> None:
    """As :func:`extremes`; all arrays are complex.

    The shift of a stationary point does not change the value to first order, so the imaginary part is taken at the
    stationary point of the real parts. Of equal real values the one with the least or greatest imaginary part counts,
    as in numpy.
    """
    orders, batch, segments, joints = least.shape
    degree = coefficients.shape[3] - 1
    unit, places, counts = np.empty((2, degree + 1)), np.zeros((orders, degree + 2)), np.zeros(orders, np.intp)
    room, rough, bounds = np.empty((4, degree + 2)), np.empty((2, orders)), np.zeros((orders, 4))
    for b in range(batch):
        for s in range(segments):
            for j in range(joints):
                power = 1.0 + 0.0j
                for k in range(degree + 1):
                    entry = coefficients[b, s, j, k] * power
                    unit[0, k], unit[1, k] = entry.real, entry.imag
                    power *= steps[b, s]
                if degree == 3 and orders == 4:
                    _complex_of_cubic(unit, bounds)
                else:
                    climb(unit[0], rough[0], rough[1], places, counts, room)
                    for order in range(min(orders, degree + 1)):
                        _at_places(unit, order, places[order, : counts[order]], room, bounds[order])
                scale, shorter = 1.0 + 0.0j, 1.0 / steps[b, s]
                for order in range(orders):
                    factor, step = scale.real, scale.imag
                    below, above = bounds[order, 0] * factor, bounds[order, 2] * factor
                    under, over = bounds[order, 1] * factor, bounds[order, 3] * factor
                    under, over = under + bounds[order, 0] * step, over + bounds[order, 2] * step
                    least[order, b, s, j], greatest[order, b, s, j] = complex(below, under), complex(above, over)
                    lower, higher = lowest[order, b, j], highest[order, b, j]
                    if s == 0 or below < lower.real or (below == lower.real and under < lower.imag):
                        lowest[order, b, j] = complex(below, under)
                    if s == 0 or above > higher.real or (above == higher.real and over > higher.imag):
                        highest[order, b, j] = complex(above, over)
                    scale *= shorter


@fast
def _complex_of_cubic(unit: Array, bounds: Array) -> None:
    """Bounds of a cubic and its derivatives; any point of [0, 1] may replace a stationary point that does not exist."""
    a, b, c, d = unit[0]
    e, f, g, h = unit[1]
    half = -(c + math.copysign(math.sqrt(max(c * c - 3.0 * d * b, 0.0)), c))
    first, second, turn = inside(half / (3.0 * d)), inside(b / half), inside(-c / (3.0 * d))
    found = _wider((a, e, a, e), a + b + c + d, e + f + g + h)
    found = _wider(found, ((d * first + c) * first + b) * first + a, ((h * first + g) * first + f) * first + e)
    found = _wider(found, ((d * second + c) * second + b) * second + a, ((h * second + g) * second + f) * second + e)
    bounds[0, 0], bounds[0, 1], bounds[0, 2], bounds[0, 3] = found
    found = _wider((b, f, b, f), b + 2.0 * c + 3.0 * d, f + 2.0 * g + 3.0 * h)
    found = _wider(found, (3.0 * d * turn + 2.0 * c) * turn + b, (3.0 * h * turn + 2.0 * g) * turn + f)
    bounds[1, 0], bounds[1, 1], bounds[1, 2], bounds[1, 3] = found
    found = _wider((2.0 * c, 2.0 * g, 2.0 * c, 2.0 * g), 2.0 * c + 6.0 * d, 2.0 * g + 6.0 * h)
    bounds[2, 0], bounds[2, 1], bounds[2, 2], bounds[2, 3] = found
    bounds[3, 0] = bounds[3, 2] = 6.0 * d
    bounds[3, 1] = bounds[3, 3] = 6.0 * h


@fast
def _at_places(unit: Array, order: int, places: Array, room: Array, bounds: Array) -> None:
    """Least and greatest value of a derivative at given places."""
    size = unit.shape[1] - 1 - order
    differentiate(unit[0], order, room[0])
    differentiate(unit[1], order, room[1])
    found = (room[0, 0], room[1, 0], room[0, 0], room[1, 0])
    for i in range(1, len(places)):
        found = _wider(found, value_at(room[0], size, places[i]), value_at(room[1], size, places[i]))
    bounds[0], bounds[1], bounds[2], bounds[3] = found


@fast
def _wider(bounds: tuple[float, float, float, float], value: float, step: float) -> tuple[float, float, float, float]:
    """Real and imaginary part of the least and of the greatest value, updated with another value."""
    below, under, above, over = bounds
    if value < below or (value == below and step < under):
        below, under = value, step
    if value > above or (value == above and step > over):
        above, over = value, step
    return below, under, above, over
