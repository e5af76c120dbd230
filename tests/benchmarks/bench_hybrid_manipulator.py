"""Speed of the hybrid manipulator, as ratios measured in one run: `make bench`.

1. Evaluation of 100 candidates with 60 force samples each: ours, against the same problem written one candidate at a
   time with a scipy CubicSpline per joint, a Python loop of pin.rnea, and peaks at the samples.
2. A whole NSGA-II run through `optimise`, against pymoo's NSGA-II on an ElementwiseProblem of that evaluation.
3. The capacity of the motion of Table 7 in closed form, against a bisection of 20 steps at the same samples, as users
   write it and in batches.
Every pair is interleaved and the medians of CPU time are compared, so that a slow machine slows both.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
from compare import compare
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.problem import ElementwiseProblem
from pymoo.operators.crossover.sbx import SBX
from pymoo.operators.mutation.pm import PM
from pymoo.optimize import minimize
from scipy.interpolate import CubicSpline

from problems import HybridManipulator
from problems.hybrid_manipulator import paper_solution
from trajevo import optimise
from trajevo.capacity import SAMPLES as CAPACITY_SAMPLES
from trajevo.capacity import dlcc
from trajevo.dynamics import Dynamics, Rollout
from trajevo.gauss_lobatto import lobatto
from trajevo.robot import Robot

CANDIDATES, SAMPLES = 100, 5
STEPS, HEAVIEST = 20, 40.0  # of the bisection; the mass it begins from [kg]
ROUNDS, RUNS, CAPACITIES = 15, 3, 10
SPAN = 0.42  # between the first two screws [m]


class Elementwise(ElementwiseProblem):
    """The problem of Guo 2016 as users write it: one candidate, one joint, one instant at a time."""

    def __init__(self, like: HybridManipulator) -> None:
        super().__init__(n_var=like.n_var, n_obj=like.n_obj, n_ieq_constr=like.n_ieq_constr, xl=like.xl, xu=like.xu)
        self.points, self.limits = like.interpolant.points.positions, like.robot.limits
        self.nodes, self.weights = lobatto(like.dynamics.samples)
        self.attach(like.robot, like.dynamics.payload.mass)

    def attach(self, robot: Robot, mass: float) -> None:
        """Make the model that carries a point mass [kg]."""
        self.model = robot.model.copy()
        tool = self.model.frames[self.model.getFrameId(robot.tool)]
        payload = pin.Inertia(mass, np.zeros(3), np.zeros((3, 3)))
        self.model.appendBodyToJoint(tool.parentJoint, payload, tool.placement)
        self.data = self.model.createData()

    def _evaluate(self, x: np.ndarray, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        out["F"], out["G"] = self.values(x)

    def values(self, h: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Objectives z1 to z4 and the constraints of one candidate."""
        knots, limits = self.knots(h), self.limits
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

    def knots(self, h: np.ndarray) -> np.ndarray:
        """The 13 knots: accelerations by the tridiagonal conditions, then the two virtual knots from them."""
        known = np.insert(self.points, (1, len(self.points) - 1), (self.points[0], self.points[-1]), axis=0)
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

    def effort(self, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
        """Screw forces and joint torques, by the transmission's formulas around a loop of pin.rnea."""
        u, du, ddu = (values[:, 1] - values[:, 0] for values in (q, v, a))
        spread = SPAN**2 + u**2
        swivel = np.arctan(u / SPAN), SPAN * du / spread, SPAN * ddu / spread - 2.0 * SPAN * u * du**2 / spread**2
        psi, dpsi, ddpsi = (
            np.column_stack([0.5 * (values[:, 0] + values[:, 1]), turned, values[:, 2:]])
            for values, turned in zip((q, v, a), swivel, strict=True)
        )
        torque = np.empty_like(q)
        for i in range(len(q)):
            torque[i] = pin.rnea(self.model, self.data, psi[i], dpsi[i], ddpsi[i])
        half, turning = 0.5 * torque[:, 0], torque[:, 1] * SPAN / spread
        return np.column_stack([half - turning, half + turning, torque[:, 2:]])


def bisection(rollout: Rollout) -> float:
    """The largest payload [kg] by halving an interval: one batched effort per step, at the samples of `dlcc`."""
    robot, payload = rollout.robot, rollout.dynamics.payload
    q, v, a = (rollout.trajectory.at_shares(lobatto(CAPACITY_SAMPLES)[0], order) for order in range(3))
    low, high = 0.0, HEAVIEST
    for _ in range(STEPS):
        mass = 0.5 * (low + high)
        effort = Dynamics(robot, payload.with_mass(mass)).effort(q, v, a)
        low, high = (mass, high) if (np.abs(effort) <= robot.limits.effort).all() else (low, mass)
    return low


def users_bisection(users: Elementwise, rollout: Rollout) -> float:
    """The same as users write it: the payload attached anew at every step, a Python loop of pin.rnea."""
    q, v, a = (rollout.trajectory.at_shares(lobatto(CAPACITY_SAMPLES)[0], order)[0] for order in range(3))
    limit, low, high = rollout.robot.limits.effort, 0.0, HEAVIEST
    for _ in range(STEPS):
        mass = 0.5 * (low + high)
        users.attach(rollout.robot, mass)
        low, high = (mass, high) if (np.abs(users.effort(q, v, a)) <= limit).all() else (low, mass)
    return low


def main() -> None:
    problem = HybridManipulator(samples=SAMPLES)
    users = Elementwise(problem)
    x = np.random.default_rng(0).uniform(0.3, problem.xu, (CANDIDATES, problem.n_var))
    F, G = problem.evaluate(x)
    looped = [users.values(row) for row in x]
    worst_f = np.abs(np.array([f for f, _ in looped]) / F - 1.0).max()
    below = (G - np.array([g for _, g in looped])).max()
    print(f"same problem: objectives agree to {worst_f:.1e}; sampled peaks are up to {below:.1e} of the limit too low")
    title = f"evaluation of {CANDIDATES} candidates x {SAMPLES * problem.n_var} force samples"
    mine, other = compare(title, lambda: problem.evaluate(x), lambda: [users.values(row) for row in x], ROUNDS)
    print(f"RATIO element-wise scipy and pin.rnea / ours: {other / mine:.1f} (at least 12 is promised)")

    own = problem.evolution
    crossover = SBX(prob=own.crossover_probability, eta=own.crossover_index)
    mutation = PM(prob=1.0, prob_var=own.mutation_probability, eta=own.mutation_index)
    solver = NSGA2(pop_size=own.population, crossover=crossover, mutation=mutation)
    mine, other = compare(
        f"NSGA-II {own.population} x {own.generations}, nothing scaled",
        lambda: optimise(problem, seed=1, starts="random", polish=False, progress=False),
        lambda: minimize(users, solver, ("n_gen", own.generations), seed=1),
        RUNS,
    )
    print(f"RATIO pymoo with the element-wise problem / ours: {other / mine:.1f} (at least 7 is promised)")

    rollout = problem.rollout(paper_solution())
    by_bisection = bisection(rollout), users_bisection(users, rollout)
    print(f"same capacity: {dlcc(rollout).mass:.6f} kg in closed form, {by_bisection[0]:.6f}, {by_bisection[1]:.6f} kg")
    for title, slow, promise in (
        ("as users write it", lambda: users_bisection(users, rollout), "at least 15 is promised"),
        ("in batches", lambda: bisection(rollout), "20 batches against 2 cannot exceed 10"),
    ):
        mine, other = compare(
            f"{CAPACITIES} capacities, {CAPACITY_SAMPLES * problem.n_var} instants each",
            lambda: [dlcc(rollout) for _ in range(CAPACITIES)],
            lambda slow=slow: [slow() for _ in range(CAPACITIES)],
            ROUNDS,
        )
        print(f"RATIO {STEPS}-step bisection {title} / closed form: {other / mine:.1f} ({promise})")


if __name__ == "__main__":
    main()
