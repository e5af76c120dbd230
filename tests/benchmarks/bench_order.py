"""Whether a search over the order of visits finds the best order, against all orders and over many seeds.

First eight points, of which six are free: the least time of every one of the 720 orders, each by gradients from its own
start, and what the search finds. Then fourteen points, of which twelve are free: what 20 seeds find, and by how much
the worst of them is above the best. Points are random on a cylinder around a UR5.
"""

from __future__ import annotations

import itertools
import sys
import time
from typing import Any

import numpy as np

from trajevo import load_problem, optimise
from trajevo.base.arrays import Array, one_blas_thread
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.solvers.evolutionary.choices import choices_of
from trajevo.solvers.gradient.batch_sqp import Lockstep
from trajevo.solvers.gradient.scaling import Columns, Scaled

SEEDS, POPULATION, GENERATIONS, ROUNDS, STEPS, MARGIN, SLOWER = 20, 100, 100, 25, 60, 1e-7, 0.02


def main() -> None:
    """Print what is found, and the best that is known."""
    few = problem_of(8)
    orders = np.array([[0, *order, 7] for order in itertools.permutations(range(1, 7))])
    begun = time.process_time()
    least = least_times(few, orders)
    spent = time.process_time() - begun
    print(f"8 points: {int(np.isfinite(least).sum())} of {len(orders)} orders have a motion, in {spent:.0f} s of CPU")
    print(f"least time of all orders {least.min():.6f} s, of the tenth best {np.sort(least)[9]:.6f} s")
    for seed in range(3):
        found, order, seconds = searched(few, seed)
        print(f"seed {seed}: {found:.6f} s, {found / least.min() - 1.0:+.2e}, {order}, {seconds:.1f} s of CPU")
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else SEEDS
    many = problem_of(14)
    times = []
    for seed in range(seeds):
        found, order, seconds = searched(many, seed)
        times.append(found)
        print(f"14 points, seed {seed}: {found:.6f} s, {order}, {seconds:.1f} s of CPU")
    if times:
        print(f"{seeds} seeds: least {min(times):.6f} s, greatest {max(times) / min(times) - 1.0:.2e} above it")


def problem_of(count: int) -> TrajectoryProblem:
    """Poses of a UR5's tool, of which all but the ends are visited in any order."""
    random = np.random.default_rng(3)
    turned, height = random.uniform(-1.2, 1.2, count), random.uniform(0.1, 0.4, count)
    points = [
        {"position": [0.45 * np.cos(angle), 0.45 * np.sin(angle), z], "rpy": [np.pi, 0.0, 0.3]}
        for angle, z in zip(turned, height, strict=True)
    ]
    limits = {"acceleration": 14.0, "jerk": 140.0}
    given: dict[str, Any] = {
        "robot": {"name": "ur5", "tool": "tool0", "limits": limits},
        "points": points,
        "order": {"free": list(range(1, count - 1))},
        "duration_bounds": (0.05, 3.0),
        "objectives": ["time", "energy"],
        "constraints": ["position", "velocity", "acceleration", "jerk", "effort"],
    }
    return load_problem("via-points", **given)


def searched(problem: TrajectoryProblem, seed: int) -> tuple[float, list[int], float]:
    """The least time that a search finds [s], its order, and the CPU time that it took [s]."""
    begun = time.process_time()
    front = optimise(problem, seed=seed, population=POPULATION, generations=GENERATIONS, progress=False)
    best = front.pick("least_time")
    return best.F["time"], list(best.order or ()), time.process_time() - begun


def least_times(problem: TrajectoryProblem, orders: Array) -> Array:
    """The least time of every order by gradients, shape (N,) [s]; infinite where none was found."""
    choices = choices_of(problem)
    if choices is None or choices.visits.free is None:
        raise SystemExit("the problem has no order that is free")
    own = np.full((len(orders), len(choices.visits.variables)), 0.5)
    own[:, choices.visits.order_columns] = choices.visits.free.keys(orders)
    X = np.ones((len(orders), problem.n_var))
    X[:, choices.columns] = own
    X = np.clip(X * choices.legs(X), problem.xl, problem.xu)
    X[:, choices.columns] = own
    legs = np.flatnonzero(choices.interpolant.leg_of >= 0)
    X = paced(problem, X, legs)
    X[:, legs] *= 1.0 + SLOWER
    F = problem.evaluate(X, return_values_of=["F", "G"])[0]
    scaled = Scaled(problem.in_terms(), Columns.of(F, np.eye(problem.n_obj), F.max(axis=0)), MARGIN)
    y = scaled.inside(X)
    reference = np.full(F.shape, np.inf)
    reference[:, 0] = scaled.values(y)[0][:, 0]
    run = Lockstep(
        scaled,
        y,
        reference=reference,
        augmentation=np.full(F.shape, 1e-5),
        restarts=2,
        bold=True,
        memory=3,
        stiffest=1.0,
    )
    run.run(np.full(len(y), STEPS), np.full(len(y), MARGIN), lambda: False)
    times = np.full(len(orders), np.inf)
    for end in (run.y, run.y + SLOWER * (y - run.y), run.safe):
        found, excess = problem.evaluate(scaled.outside(end), return_values_of=["F", "G"])
        times = np.where(excess.max(axis=1) <= 0.0, np.minimum(times, found[:, 0]), times)
    return times


def paced(problem: TrajectoryProblem, X: Array, legs: Array) -> Array:
    """The quickest of some motions of each order whose legs take as long as the joints' limits ask for, in turns."""
    limits, best, times = problem.kept_limits, X.copy(), np.full(len(X), np.inf)
    for _ in range(ROUNDS):
        motion = problem.decode(X)
        shares = [
            ((motion.segment_peaks(d) / limit).max(axis=2)) ** (1.0 / d)
            for d, limit in enumerate((limits.velocity, limits.acceleration, limits.jerk), start=1)
        ]
        used = np.maximum.reduce(shares)
        whole = X.copy()
        whole[:, legs] *= used.max(axis=1, keepdims=True)
        better = whole[:, legs].sum(axis=1) < times
        best[better], times[better] = whole[better], whole[better][:, legs].sum(axis=1)
        X = X.copy()
        X[:, legs] = np.clip(X[:, legs] * used**0.6, problem.xl[legs], problem.xu[legs])
    return np.clip(best, problem.xl, problem.xu)


if __name__ == "__main__":
    with one_blas_thread():
        main()
