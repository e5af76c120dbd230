"""The pointing mechanism as users write it: SciPy's BPoly and PPoly, one candidate at a time, extremes at samples."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import BPoly, PPoly

from trajevo.problems import PointingMechanism

SAMPLES = 200  # of a segment


def values(problem: PointingMechanism, durations: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """One candidate of the smooth hybrid: BPoly for the septics, PPoly for the quartics, extremes at samples."""
    p, limits = problem.interpolant.points.positions, problem.robot.limits
    t = np.concatenate([[0.0], np.cumsum(durations)])
    slope = np.zeros_like(p)
    slope[1:-1] = (p[2:] - p[:-2]) / (t[2:] - t[:-2])[:, None]
    rms, low, high = (np.zeros((4, 2)) for _ in range(3))
    for joint in range(2):
        curves = []
        for i in range(4):
            ends = [[p[k, joint], slope[k, joint], 0.0, 0.0] for k in (i, i + 1)]
            if i in (0, 3):
                curves.append(PPoly.from_bernstein_basis(BPoly.from_derivatives(t[i : i + 2], ends)))
            else:
                curves.append(quartic_pieces(t[i], t[i + 1], ends))
        for order in range(4):
            derivatives = [curve.derivative(order) for curve in curves]
            values = np.concatenate(
                [
                    curve(np.linspace(left, right, SAMPLES))
                    for curve in derivatives
                    for left, right in zip(curve.x[:-1], curve.x[1:], strict=True)
                ]
            )
            low[order, joint], high[order, joint] = values.min(), values.max()
            rms[order, joint] = np.sqrt(sum(integral_of_square(curve) for curve in derivatives) / t[-1])
    position = np.maximum(high[0] - limits.upper, limits.lower - low[0]) / (0.5 * (limits.upper - limits.lower))
    bounds = np.stack([limits.velocity, limits.acceleration, limits.jerk])
    peaks = np.maximum(high, -low)[1:] / bounds - 1.0
    return np.array([t[-1], rms[2].sum(), rms[3].sum()]), np.concatenate([position, peaks.ravel()])


def quartic_pieces(left: float, right: float, ends: list[list[float]]) -> PPoly:
    """Four C3 quartic pieces between two states with zero acceleration and jerk, from the uniform B-spline matrix."""
    basis = np.array(
        [[1, 11, 11, 1, 0], [-4, -12, 12, 4, 0], [6, -6, -6, 6, 0], [-4, 12, -12, 4, 0], [1, -4, 6, -4, 1]]
    )
    offsets = np.array([-3.0, -1.0, 1.0, 3.0]) / 8.0 * (right - left)
    controls = np.concatenate([end[0] + offsets * end[1] for end in ends])
    width = (right - left) / 4.0
    columns = [(basis @ controls[k : k + 5] / 24.0) / width ** np.arange(5) for k in range(4)]
    return PPoly(np.array(columns).T[::-1], np.linspace(left, right, 5))


def integral_of_square(curve: PPoly) -> float:
    """∫ of the square of a piecewise polynomial, exact, by polynomial multiplication."""
    squares = [np.convolve(column, column) for column in curve.c.T]
    return float(PPoly(np.array(squares).T, curve.x).integrate(curve.x[0], curve.x[-1]))
