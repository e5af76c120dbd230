"""Speed of the pointing mechanism, as ratios measured in one run: `make bench`.

1. Evaluation of 150 candidates: ours, against the same problem written one candidate at a time with scipy's BPoly and
   PPoly and peaks sampled at 200 instants per segment.
2. A whole NSGA-II run through `optimise`, against pymoo's NSGA-II on a problem of the same shapes whose evaluation is
   free.
Every pair is interleaved and the medians of CPU time are compared, so that a slow machine slows both.
"""

from __future__ import annotations

import numpy as np
from compare import compare
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.problem import Problem
from pymoo.operators.crossover.sbx import SBX
from pymoo.operators.mutation.pm import PM
from pymoo.optimize import minimize
from scipy.interpolate import BPoly, PPoly

from problems import PointingMechanism
from trajevo import optimise

CANDIDATES, GENERATIONS, SAMPLES = 150, 200, 200
ROUNDS, RUNS = 15, 5


def elementwise(problem: PointingMechanism, durations: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
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


class Free(Problem):
    """The shapes of the pointing mechanism, at no cost."""

    def __init__(self, like: PointingMechanism) -> None:
        super().__init__(n_var=like.n_var, n_obj=3, n_ieq_constr=like.n_ieq_constr, xl=like.xl, xu=like.xu)

    def _evaluate(self, x, out, *args, **kwargs):  # type: ignore[no-untyped-def]
        out["F"] = np.stack([x[:, 0], 11.0 - x[:, 0] + x[:, 1], x[:, 2] * x[:, 3]], axis=1)
        out["G"] = np.full((len(x), self.n_ieq_constr), -1.0)


def main() -> None:
    problem = PointingMechanism()
    x = np.random.default_rng(0).uniform(problem.xl, problem.xu, (CANDIDATES, problem.n_var))
    F, G = problem.evaluate(x)
    looped = [elementwise(problem, row) for row in x]
    worst_f = np.abs(np.array([f for f, _ in looped]) / F - 1.0).max()
    below = (G - np.array([g for _, g in looped])).max()
    print(f"same problem: objectives agree to {worst_f:.1e}; sampled peaks are up to {below:.1e} of the limit too low")
    title = f"evaluation of {CANDIDATES} candidates"
    mine, other = compare(title, lambda: problem.evaluate(x), lambda: [elementwise(problem, row) for row in x], ROUNDS)
    print(f"RATIO element-wise scipy / ours: {other / mine:.1f} (at least 10 is promised)")
    for interpolant in ("smooth", "quintic"):
        solved = PointingMechanism(interpolant=interpolant)
        free = Free(solved)
        solver = NSGA2(pop_size=CANDIDATES, crossover=SBX(prob=0.85, eta=15), mutation=PM(prob=0.15, eta=20))
        mine, other = compare(
            f"NSGA-II {CANDIDATES} x {GENERATIONS}, {interpolant}",
            lambda solved=solved: optimise(
                solved, seed=1, generations=GENERATIONS, starts="random", polish=False, progress=False
            ),
            lambda free=free, solver=solver: minimize(free, solver, ("n_gen", GENERATIONS), seed=1),
            RUNS,
        )
        print(f"RATIO ours / pymoo with a free evaluation, {interpolant}: {mine / other:.2f} (at most 3 is promised)")


if __name__ == "__main__":
    main()
