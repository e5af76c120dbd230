"""Slow, obvious implementations that the tests hold trajevo against."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

SUN2020 = json.loads((Path(__file__).parent / "data" / "sun2020.json").read_text())
RAJI2022 = json.loads((Path(__file__).parent / "data" / "raji2022.json").read_text())
TABLE_4_DURATIONS = np.diff(SUN2020["table4_times"])[None]


def extremes_by_roots(coefficients: np.ndarray, order: int) -> tuple[float, float]:
    """Least and greatest value of a derivative of one polynomial (ascending powers) on [0, 1], by numpy's roots."""
    curve = np.polynomial.Polynomial(coefficients).deriv(order) if order else np.polynomial.Polynomial(coefficients)
    slope = np.trim_zeros(curve.deriv().coef, "b") if curve.degree() > 0 else np.empty(0)
    roots = np.polynomial.Polynomial(slope).roots() if len(slope) > 1 else np.empty(0)
    at = [0.0, 1.0, *(root.real for root in roots if abs(root.imag) < 1e-6 and 0.0 < root.real < 1.0)]
    values = [float(curve(u)) for u in at]
    return min(values), max(values)


def septic_by_equation_14(start: list[float], end: list[float], T: float) -> np.ndarray:
    """k₀ to k₇ of Sun 2020, eq. (14), with its lost dots restored; states are q, v, a, j."""
    pos0, vel0, acc0, jerk0 = start
    posf, velf, accf, jerkf = end
    A = jerk0 * T**2 / 2 + acc0 * T + vel0 - velf
    B = (jerk0 - jerkf) / T
    C = acc0 - accf + T * jerk0
    D = jerk0 * T**3 / 6 + acc0 * T**2 / 2 + vel0 * T + pos0 - posf
    return np.array(
        [
            pos0,
            vel0,
            acc0 / 2,
            jerk0 / 6,
            15 * A / T**3 + B / 6 - 5 * C / (2 * T**2) - 35 * D / T**4,
            -(78 * A / T**3 + B - 14 * C / T**2 - 168 * D / T**4) / (2 * T),
            (68 * A / T**3 + B - 13 * C / T**2 - 140 * D / T**4) / (2 * T**2),
            -(60 * A / T**3 + B - 12 * C / T**2 - 120 * D / T**4) / (6 * T**3),
        ]
    )


def improved_spline(p: np.ndarray, i: int, u: float) -> float:
    """Sun 2020, eqs. (17), (20)-(24): the curve from path point i, u from 0 to 4 over its four pieces, one joint."""

    def control(k: int) -> list[float]:
        d = p[k + 1] - p[k]
        return [p[k] - d / 12, p[k] - d / 24, p[k] + d / 24, p[k] + d / 12]

    piece = min(int(u), 3)
    five = (control(i) + control(i + 1))[piece : piece + 5]
    matrix = [[1, 11, 11, 1, 0], [-4, -12, 12, 4, 0], [6, -6, -6, 6, 0], [-4, 12, -12, 4, 0], [1, -4, 6, -4, 1]]
    powers = [(u - piece) ** k for k in range(5)]
    return sum(powers[k] * sum(matrix[k][m] * five[m] for m in range(5)) for k in range(5)) / 24


def non_dominated(F: np.ndarray) -> np.ndarray:
    """Mask of rows that no other row dominates, by comparing every pair."""
    keep = np.ones(len(F), dtype=bool)
    for i in range(len(F)):
        keep[i] = not any((F[k] <= F[i]).all() and (F[k] < F[i]).any() for k in range(len(F)))
    return keep
