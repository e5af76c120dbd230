"""What first populations bring: share of feasible individuals, and hypervolume as the generations go by.

Every row is the median of five seeds with the problem's own settings and 200 generations; the CPU time is that of
finding the first population, and the evaluations are those that come on top of the run's. `bench_starts.py NAME ...`
measures only problems that begin so.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from trajevo import TrajectoryProblem, optimise
from trajevo.problems import (
    HybridManipulator,
    PickAndPlace,
    PointingMechanism,
    TimeJerkReparameterisation,
    ViaPointProblem,
)
from trajevo.solvers.evolutionary.first_population import first_population
from trajevo.solvers.task import load_task

SEEDS = (1, 2, 3, 4, 5)
GENERATIONS = (1, 10, 50, 200)
STARTS = ("random", "stretched", "fastest", "spread")
TASKS = Path(__file__).parents[2] / "problems" / "tasks"


def of_task(name: str, reference_point: list[float]) -> TrajectoryProblem:
    """A worked task, its hypervolumes measured in one box."""
    settings = load_task(TASKS / f"{name}.toml").problem.settings
    return ViaPointProblem(**(settings | {"reference_point": reference_point}))


PROBLEMS: dict[str, Callable[[], TrajectoryProblem]] = {
    "hybrid, printed": lambda: HybridManipulator(convention="printed"),
    "pointing, smooth": PointingMechanism,
    "pick-place": PickAndPlace,
    "reparam": TimeJerkReparameterisation,
    "ur5 task": lambda: of_task("ur5_pick_and_place", [6.0, 150.0, 60.0]),
}


def measured(problem: TrajectoryProblem, starts: str, seed: int) -> list[float]:
    """Share of feasible individuals, hypervolumes, evaluations and CPU time [s] of the first population."""
    began = time.process_time()
    first = first_population(problem, problem.evolution.population, starts=starts, seed=seed)
    seconds = time.process_time() - began
    G = problem.evaluate(first.X, return_values_of=["F", "G"])[1]
    front = optimise(problem, seed=seed, starts=starts, generations=max(GENERATIONS), polish=False, progress=False)
    volumes = [front.history.hypervolume[generation - 1] for generation in GENERATIONS]
    return [float((G <= 0.0).all(axis=1).mean()), *volumes, first.evaluations, seconds]


def main() -> None:
    """Print the table."""
    for name, make in PROBLEMS.items():
        if len(sys.argv) > 1 and not name.startswith(tuple(sys.argv[1:])):
            continue
        for starts in STARTS:
            feasible, *volumes, evaluations, seconds = np.median(
                [measured(make(), starts, seed) for seed in SEEDS], axis=0
            )
            shown = " ".join(f"{volume:.4f}" for volume in volumes)
            print(
                f"{name}, {starts}: {100.0 * feasible:.0f} % feasible, hypervolume after {GENERATIONS} generations "
                f"{shown}; {evaluations:.0f} evaluations, {seconds:.2f} s",
                flush=True,
            )


if __name__ == "__main__":
    main()
