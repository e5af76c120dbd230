"""Runs along a path as they are written with SciPy: one candidate at a time, BSpline objects, all instants at once."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import BSpline

from trajevo.problems import TimeJerkReparameterisation
from trajevo.trajectory.parameterisation import Course

INTERVALS = 1000  # of the trapezoidal rule


class ScipyLoop:
    """The paper's evaluation of one candidate."""

    def __init__(self, problem: TimeJerkReparameterisation) -> None:
        path, self.limits = problem.path, problem.robot.limits
        self.s = [BSpline(path.knots, path.control_points, path.order - 1).derivative(k) for k in (1, 2, 3)]
        self.peaks = [path.peak(k) for k in (1, 2, 3)]
        self.knots = Course(path, np.linspace(0.0, 1.0, 16)[None]).knots

    def evaluate(self, c: np.ndarray, intervals: int = INTERVALS) -> tuple[float, float]:
        """Least time by (20)-(25) and the jerk integral in unit time, of control points (16,)."""
        u = BSpline(self.knots, c, 5)
        du, ddu, dddu = (u.derivative(k) for k in (1, 2, 3))
        t = np.linspace(0.0, 1.0, intervals + 1)
        at, v, a, j = np.clip(u(t), 0.0, 1.0)[:, None], du(t)[:, None], ddu(t)[:, None], dddu(t)[:, None]
        s1, s2, s3 = (s(at[:, 0]) for s in self.s)
        square = ((s3 * v**3 + 3.0 * s2 * v * a + s1 * j) ** 2).sum(axis=1)
        integral = float((square[:-1] + square[1:]).sum() / (2.0 * intervals))
        return self.least_time(du.c[:15], ddu.c[:14], dddu.c[:13]), integral

    def least_time(self, v: np.ndarray, a: np.ndarray, j: np.ndarray) -> float:
        """The greatest of the times that the terms of (20)-(25) need."""
        needed = 0.0
        (s1, s2, s3), limits = self.peaks, self.limits
        for axis in range(2):
            velocity = s1[axis] * np.abs(v).max()
            acceleration = max((s2[axis] * v[k : k + 14] ** 2 + s1[axis] * np.abs(a)).max() for k in range(2))
            jerk = 0.0
            for k, i in ((0, 0), (1, 0), (1, 1), (2, 1)):
                V, A = np.abs(v[k : k + 13]), np.abs(a[i : i + 13])
                jerk = max(jerk, (s3[axis] * V**3 + 3.0 * s2[axis] * A * V + s1[axis] * np.abs(j)).max())
            needed = max(
                needed,
                velocity / limits.velocity[axis],
                (acceleration / limits.acceleration[axis]) ** 0.5,
                (jerk / limits.jerk[axis]) ** (1.0 / 3.0),
            )
        return needed
