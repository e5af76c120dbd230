"""Time and jerk along a path: what the ways to a front reach. The times of evaluation are in the table of `make bench`.

1. Errors of the quadratures, ours and 1000 trapezoids, against a million trapezoids.
2. What 10,000 evaluations of NSGA-II reach with each encoding, as a share of the hypervolume of 100 points by SQP. The
   paper's own 17 variables are kept as a negative result: not one feasible individual.
3. The whole front by normal constraints, divide and conquer and SQP: how long it takes, and its share.
"""

from __future__ import annotations

from typing import Any

import moocore
import numpy as np
from elementwise_path import INTERVALS, ScipyLoop
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.problem import Problem
from pymoo.operators.crossover.sbx import SBX
from pymoo.operators.mutation.pm import PM
from pymoo.optimize import minimize

from trajevo import optimise
from trajevo.front.front import Front
from trajevo.problems import TimeJerkReparameterisation
from trajevo.solvers.gradient.normal_constraint import solve_nnc
from trajevo.trajectory.along_path import ComposedBatch
from trajevo.trajectory.parameterisation import Course

FINE = 1_000_000  # trapezoids
POPULATION, GENERATIONS, SEED = 100, 100, 1


class Raw(Problem):
    """The paper's own 17 variables with (18) as equalities and the rest of (28) as inequalities."""

    def __init__(self, like: TimeJerkReparameterisation) -> None:
        self.like, self.ordered = like, 0
        super().__init__(
            n_var=17,
            n_obj=2,
            n_ieq_constr=15 + 6,
            n_eq_constr=6,
            xl=np.r_[np.zeros(16), 0.1],
            xu=np.r_[np.ones(16), 8.0],
        )

    def _evaluate(self, x: np.ndarray, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        c, tf = x[:, :16], x[:, 16]
        steps = np.diff(c, axis=1)
        ends = np.stack([c[:, 0], 1.0 - c[:, -1], steps[:, 0], steps[:, -1], steps[:, 1], steps[:, -2]], axis=1)
        jerk, excess = np.full(len(x), 1e6), np.ones((len(x), 6))
        good = (np.abs(ends) <= 1e-4).all(axis=1) & (steps >= 0.0).all(axis=1)
        self.ordered += int(good.sum())
        for row in np.flatnonzero(good):
            batch = ComposedBatch(
                Course(self.like.path, np.clip((c[row] - c[row, 0]) / (c[row, -1] - c[row, 0]), 0.0, 1.0)[None]),
                tf[row : row + 1],
            )
            limits = self.like.robot.limits
            jerk[row] = batch.integral_of_square(3).sum()
            excess[row] = np.concatenate(
                [
                    batch.hull_peak(k)[0] / limit - 1.0
                    for k, limit in zip((1, 2, 3), (limits.velocity, limits.acceleration, limits.jerk), strict=True)
                ]
            )
        out["F"], out["H"] = np.stack([tf, jerk], axis=1), ends
        out["G"] = np.concatenate([-steps, excess], axis=1)


def share(front: Front, dense: Front) -> float:
    """Hypervolume of a front over that of the dense one, in the box of the dense one's ends."""
    low, high = dense.F.min(axis=0), dense.F.max(axis=0)
    volumes = [moocore.hypervolume((F - low) / (high - low), ref=[1.0, 1.0]) for F in (front.F, dense.F)]
    return float(volumes[0] / volumes[1])


def quadratures(random: np.random.Generator) -> None:
    """Part 1."""
    problem = TimeJerkReparameterisation(limits="hull")
    course = problem.decode(random.uniform(size=(10, 12))).course
    loop, exact = ScipyLoop(problem), course.integral_of_square(3).sum(axis=1)
    fine, coarse = (np.array([loop.evaluate(row, n)[1] for row in course.control_points]) for n in (FINE, INTERVALS))
    ours, theirs = (np.abs(values / fine - 1.0).max() for values in (exact, coarse))
    print(f"greatest error of our quadrature {ours:.1e} (1e-6 is promised), of {INTERVALS} trapezoids {theirs:.1e}")


def encodings() -> None:
    """Parts 2 and 3."""
    for limits in ("hull", "tight"):
        plain = TimeJerkReparameterisation(limits=limits)
        dense = solve_nnc(plain, points=100)
        found = solve_nnc(plain)
        reached = f"{share(found, dense):.4f} with {len(found)} points in {found.run.seconds:.1f} s"
        print(f"{limits}: NNC with divide and conquer: {reached} (at least 0.993 is promised)")
        for encoding, promise in (("plain", 0.975), ("shape", 0.99)):
            for seeds in (None, 5):
                problem = TimeJerkReparameterisation(limits=limits, encoding=encoding)
                initial = None if seeds is None else solve_nnc(problem, points=seeds)
                front = optimise(
                    problem,
                    seed=SEED,
                    generations=GENERATIONS,
                    initial=initial,
                    starts="random",
                    polish=False,
                    progress=False,
                )
                how = f" (at least {promise} is promised)" if seeds is None else f", begun with {seeds} points by SQP"
                reached = f"{share(front, dense):.4f} in {front.run.seconds:.1f} s"
                print(f"{limits}: NSGA-II, {encoding} encoding: {reached}{how}")
    raw = Raw(TimeJerkReparameterisation(limits="hull"))
    solver = NSGA2(pop_size=POPULATION, crossover=SBX(prob=0.9, eta=15), mutation=PM(prob_var=1.0 / 17.0, eta=20))
    result = minimize(raw, solver, ("n_gen", GENERATIONS), seed=SEED)
    feasible = 0 if result.F is None else len(np.atleast_2d(result.F))
    print(f"hull: NSGA-II, the paper's 17 variables: {feasible} feasible points, {raw.ordered} individuals keep (18)")


if __name__ == "__main__":
    quadratures(np.random.default_rng(0))
    encodings()
