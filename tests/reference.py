"""Slow, obvious implementations that the tests hold trajevo against."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from scipy.interpolate import BSpline
from scipy.optimize import least_squares

from trajevo.robot.robot import Robot

SUN2020 = json.loads((Path(__file__).parent / "data" / "sun2020.json").read_text())
PAING2021 = json.loads((Path(__file__).parent / "data" / "paing2021.json").read_text())
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


def full_control_points(free) -> np.ndarray:
    """All 16 control points of a u(t) from the ten free ones of Paing 2021, one row."""
    return np.concatenate([np.zeros(3), free, np.ones(3)])[None]


def slow_composition(path, control_points, order, t):
    """s(u(t)) in unit time and its first three derivatives, each (T, n_axes): scipy's BSpline and eqs. (15)-(17)."""
    inner = np.linspace(0.0, 1.0, len(control_points) - order + 2)[1:-1]
    u = BSpline(np.concatenate([np.zeros(order), inner, np.ones(order)]), control_points, order - 1)
    s = BSpline(path.knots, path.control_points, path.order - 1)
    at = np.clip(u(t), 0.0, 1.0)
    s1, s2, s3 = (s(at, k) for k in (1, 2, 3))
    v, a, j = (u(t, k)[:, None] for k in (1, 2, 3))
    return s(at), s1 * v, s2 * v**2 + s1 * a, s3 * v**3 + 3.0 * s2 * v * a + s1 * j


def posture_by_scipy(robot: Robot, position: np.ndarray, rotation: np.ndarray, start: np.ndarray) -> np.ndarray | None:
    """Joint positions to which SciPy's bounded least squares lead from a start; None where they miss the pose."""

    def error(q: np.ndarray) -> np.ndarray:
        there, turned = (values[0] for values in robot.tool_poses(q[None]))
        return np.concatenate([there - position, (turned - rotation).ravel()])

    bounds = robot.limits.lower, robot.limits.upper
    found = least_squares(error, start, bounds=bounds, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    return found.x if np.abs(found.fun).max() < 1e-7 else None
