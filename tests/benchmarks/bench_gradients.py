"""Exact gradients of a batch against central finite differences of the same batch: CPU time, and how far they differ.

Run: python tests/benchmarks/bench_gradients.py. Both are of the limits in terms, as gradient solvers ask for them.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from compare import compare
from differences import central_differences

from trajevo import TrajectoryProblem
from trajevo.problems import HybridManipulator
from trajevo.solvers.task import load_task

TASKS = Path(__file__).parents[2] / "problems" / "tasks"

PROBLEMS: dict[str, TrajectoryProblem] = {
    "hybrid": HybridManipulator(),
    "ur5_pick_and_place": load_task(TASKS / "ur5_pick_and_place.toml").problem,
    "xarm7_obstacle": load_task(TASKS / "xarm7_obstacle.toml").problem,
}


def measure(name: str, asked: TrajectoryProblem) -> None:
    """Print the ratio, and how far both are apart."""
    width = asked.xu - asked.xl
    batch = asked.xl + width * np.random.default_rng(2).uniform(0.3, 0.6, (20, asked.n_var))
    exact, rough = asked.evaluate_with_gradients, central_differences(asked)
    title = f"{name}, 20 vectors of {asked.n_var} variables"
    ours, theirs = compare(title, lambda: exact(batch), lambda: rough(batch), 7)
    slopes, numerical = (np.concatenate(of(batch)[1::2], axis=1) for of in (exact, rough))
    size = np.abs(slopes).max(axis=2)
    apart = np.median((np.abs(slopes - numerical).max(axis=2)[size > 0.0]) / size[size > 0.0])
    print(f"RATIO {name}, finite differences / exact gradients: {theirs / ours:.2f}")
    print(f"  differences are off by {apart:.1e} of the slope (median)")


def main() -> None:
    """Print a ratio per problem."""
    for name, problem in PROBLEMS.items():
        measure(name, problem.in_terms())


if __name__ == "__main__":
    main()
