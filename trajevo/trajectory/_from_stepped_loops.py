"""Loops over polynomial segments of complex numbers, whose imaginary parts are steps: exact to first order in those.

As in :mod:`trajevo.piecewise_loops`, compiled by numba. Real and imaginary parts are handled apart, as two numbers.
"""

from __future__ import annotations

import math

import numpy as np

from trajevo.arrays import Array
from trajevo.compiled import fast
from trajevo.piecewise_loops import climb, differentiate, inside, square_integrals, value_at

__all__ = ["extremes", "samples", "square_integrals"]


@fast
def samples(coefficients: Array, steps: Array, shares: Array, first: int, out: Array) -> None:
    """As :func:`trajevo.piecewise_loops.samples`; coefficients, steps and what is written are complex."""
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
    """A cubic and its first two derivatives at shares of a segment; entries of ``out`` lie so many apart."""
    c0, c1, c2, c3 = coefficients
    a, b, c, d, e, f, g, h = c0.real, c1.real, c2.real, c3.real, c0.imag, c1.imag, c2.imag, c3.imag
    for u in range(len(shares)):
        t, step, w = shares[u] * length.real, shares[u] * length.imag, u * apart
        v, x = (3.0 * d * t + 2.0 * c) * t + b, 6.0 * d * t + 2.0 * c
        out[0, w] = complex(((d * t + c) * t + b) * t + a, ((h * t + g) * t + f) * t + e + v * step)
        out[1, w] = complex(v, (3.0 * h * t + 2.0 * g) * t + f + x * step)
        out[2, w] = complex(x, 6.0 * h * t + 2.0 * g + 6.0 * d * step)


@fast
def extremes(coefficients: Array, steps: Array, least: Array, greatest: Array, lowest: Array, highest: Array) -> None:
    """As :func:`trajevo.piecewise_loops.extremes`; all arrays are complex.

    A stationary point that moves does not change the value to first order, so that the imaginary part is that at the
    place of the real one. Of equal values the least and greatest imaginary part count, as with numpy.
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
                    _of_cubic(unit, bounds)
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
def _of_cubic(unit: Array, bounds: Array) -> None:
    """Bounds of a cubic and its derivatives; 0 stands in for a stationary point that does not exist."""
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
    """Bounds of a derivative at some places."""
    size = unit.shape[1] - 1 - order
    differentiate(unit[0], order, room[0])
    differentiate(unit[1], order, room[1])
    found = (room[0, 0], room[1, 0], room[0, 0], room[1, 0])
    for i in range(1, len(places)):
        found = _wider(found, value_at(room[0], size, places[i]), value_at(room[1], size, places[i]))
    bounds[0], bounds[1], bounds[2], bounds[3] = found


@fast
def _wider(bounds: tuple[float, float, float, float], value: float, step: float) -> tuple[float, float, float, float]:
    """Real and imaginary part of the least and of the greatest value, after another one."""
    below, under, above, over = bounds
    if value < below or (value == below and step < under):
        below, under = value, step
    if value > above or (value == above and step > over):
        above, over = value, step
    return below, under, above, over
