"""Via-point problems as users write them: one candidate, one joint, one instant at a time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio as pin
from pymoo.core.problem import ElementwiseProblem, Problem
from scipy.interpolate import CubicSpline

from trajevo import Robot, TrajectoryProblem
from trajevo.base.arrays import Array
from trajevo.dynamics.integrals.nodes import lobatto

SPAN = 0.42  # between the first two screws of the hybrid manipulator [m]

Values = Callable[[Array], tuple[Array, Array]]


class Elementwise(ElementwiseProblem):
    """A problem of pymoo that evaluates one candidate at a time."""

    def __init__(self, like: TrajectoryProblem, values: Values) -> None:
        super().__init__(n_var=like.n_var, n_obj=like.n_obj, n_ieq_constr=like.n_ieq_constr, xl=like.xl, xu=like.xu)
        self.values = values

    def _evaluate(self, x: Array, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        out["F"], out["G"] = self.values(x)


class Free(Problem):
    """As many variables, objectives and limits as another problem has, for a few microseconds."""

    def __init__(self, like: TrajectoryProblem) -> None:
        super().__init__(n_var=like.n_var, n_obj=like.n_obj, n_ieq_constr=like.n_ieq_constr, xl=like.xl, xu=like.xu)

    def _evaluate(self, X: Array, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        share = 0.005 + (X - self.xl) / (self.xu - self.xl)
        total, inverse = share.sum(axis=1), 1.0 / share
        found = [total, 1.0 / total, inverse.sum(axis=1), np.square(inverse).sum(axis=1)]
        out["F"] = np.stack(found[: self.n_obj], axis=1)
        out["G"] = np.repeat(0.02 - X[:, :1], self.n_ieq_constr, axis=1)


class SplineLoop:
    """Cubic splines with two virtual knots: a CubicSpline for each joint, a loop of `pin.rnea`, peaks at the samples.

    The objectives are time and the integrals of the squares of power, jerk and acceleration; the limits those of
    positions, velocities, accelerations, jerks, effort and mean velocities.
    """

    def __init__(self, like: TrajectoryProblem) -> None:
        self.points, self.robot = like.interpolant.points.positions, like.robot
        self.nodes, self.weights = lobatto(like.dynamics.samples)
        self.attach(self.robot, like.dynamics.payload.mass)

    def attach(self, robot: Robot, mass: float) -> None:
        """Make the model that carries a point mass [kg]."""
        self.model = robot.model.copy()
        tool = self.model.frames[self.model.getFrameId(robot.tool)]
        payload = pin.Inertia(mass, np.zeros(3), np.zeros((3, 3)))
        self.model.appendBodyToJoint(tool.parentJoint, payload, tool.placement)
        self.data = self.model.createData()

    def values(self, h: Array) -> tuple[Array, Array]:
        """Objectives and constraints of one candidate."""
        knots, limits = virtual_knots(self.points, h), self.robot.limits
        breaks = np.concatenate([[0.0], np.cumsum(h)])
        t = (breaks[:-1, None] + h[:, None] * self.nodes).ravel()
        splines = [CubicSpline(breaks, column, bc_type="natural") for column in knots.T]
        q, v, a, j = (np.column_stack([spline(t, order) for spline in splines]) for order in range(4))
        effort = self.effort(q, v, a)
        weights = (h[:, None] * self.weights).ravel()
        energy, acceleration = (weights @ (values**2).sum(axis=1) for values in (effort * v, a))
        jerk = h @ (j[:: len(self.nodes)] ** 2).sum(axis=1)  # at a break the interval that begins there counts
        position = np.maximum(q.max(axis=0) - limits.upper, limits.lower - q.min(axis=0))
        peaks = [
            np.abs(values).max(axis=0) / limit - 1.0
            for values, limit in ((v, limits.velocity), (a, limits.acceleration), (j, limits.jerk))
        ]
        mean = np.abs(np.diff(knots, axis=0)) / h[:, None] / limits.velocity
        used = np.abs(effort).max(axis=0) / limits.effort - 1.0
        excess = [position / (0.5 * (limits.upper - limits.lower)), *peaks, used, [mean.max() - 1.0]]
        return np.array([breaks[-1], energy, jerk, acceleration]), np.concatenate(excess)

    def effort(self, q: Array, v: Array, a: Array) -> Array:
        """Torques of the joints, shapes (T, n_joints)."""
        torque = np.empty_like(q)
        for i in range(len(q)):
            torque[i] = pin.rnea(self.model, self.data, q[i], v[i], a[i])
        return torque


class HybridLoop(SplineLoop):
    """The problem of Guo 2016, whose first two joints are driven by a pair of screws."""

    def effort(self, q: Array, v: Array, a: Array) -> Array:
        """Screw forces and joint torques, by the transmission's formulas around a loop of `pin.rnea`."""
        u, du, ddu = (values[:, 1] - values[:, 0] for values in (q, v, a))
        spread = SPAN**2 + u**2
        swivel = np.arctan(u / SPAN), SPAN * du / spread, SPAN * ddu / spread - 2.0 * SPAN * u * du**2 / spread**2
        states = (
            np.column_stack([0.5 * (values[:, 0] + values[:, 1]), turned, values[:, 2:]])
            for values, turned in zip((q, v, a), swivel, strict=True)
        )
        torque = super().effort(*states)
        half, turning = 0.5 * torque[:, 0], torque[:, 1] * SPAN / spread
        return np.column_stack([half - turning, half + turning, torque[:, 2:]])


def virtual_knots(points: Array, h: Array) -> Array:
    """All knots of one candidate: accelerations by the tridiagonal conditions, then the two virtual knots from them."""
    known = np.insert(points, (1, len(points) - 1), (points[0], points[-1]), axis=0)
    share = np.zeros(len(known))
    share[1], share[-2] = h[0] ** 2 / 6.0, h[-1] ** 2 / 6.0
    before, after = h[:-1], h[1:]
    matrix = (
        np.diag(2.0 * (before + after) + 6.0 * share[1:-1] * (1.0 / before + 1.0 / after))
        + np.diag((before - 6.0 * share[:-2] / before)[1:], -1)
        + np.diag((after - 6.0 * share[2:] / after)[:-1], 1)
    )
    slopes = np.diff(known, axis=0) / h[:, None]
    known[1:-1] += share[1:-1, None] * np.linalg.solve(matrix, 6.0 * np.diff(slopes, axis=0))
    return known
