"""NSGA-II on arrays against pymoo's, with an evaluation that costs next to nothing: CPU time of 100 x 200, interleaved.

Both draw the same random numbers; that their fronts are equal to the bit is checked on the way.
"""

from __future__ import annotations

import time

import numpy as np
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.problem import Problem
from pymoo.operators.crossover.sbx import SBX
from pymoo.operators.mutation.pm import PM
from pymoo.optimize import minimize

from trajevo.array_nsga2 import ArrayNSGA2

REPEATS = 5


class Free(Problem):
    """Twelve times, four objectives and 20 limits, as the hybrid manipulator has them, for a few microseconds."""

    def __init__(self) -> None:
        super().__init__(n_var=12, n_obj=4, n_ieq_constr=20, xl=0.005, xu=1.5)

    def _evaluate(self, X, out, *args, **kwargs) -> None:  # type: ignore[no-untyped-def]
        total = X.sum(axis=1)
        out["F"] = np.stack([total, 1.0 / total, (1.0 / X).sum(axis=1), np.square(1.0 / X).sum(axis=1)], axis=1)
        out["G"] = np.repeat(0.02 - X[:, :1], 20, axis=1)


def main() -> None:
    """Print the ratio."""
    seconds: dict[type[NSGA2], list[float]] = {NSGA2: [], ArrayNSGA2: []}
    for seed in range(REPEATS):
        fronts = []
        for kind, spent in seconds.items():
            operators = {"crossover": SBX(prob=0.9, eta=10), "mutation": PM(prob_var=0.1, eta=100)}
            began = time.process_time()
            fronts.append(minimize(Free(), kind(pop_size=100, **operators), ("n_gen", 200), seed=seed).F)
            spent.append(time.process_time() - began)
        if not np.array_equal(*fronts):
            raise SystemExit("the fronts differ")
    one, other = (np.median(spent) for spent in seconds.values())
    ratios = np.array(seconds[NSGA2]) / np.array(seconds[ArrayNSGA2])
    print(
        f"NSGA-II, 100 x 200, free evaluation: pymoo {one:.2f} s, arrays {other:.2f} s of CPU time, ratio "
        f"{np.median(ratios):.1f} ({ratios.min():.1f} to {ratios.max():.1f} in {REPEATS} seeds), the same fronts"
    )


if __name__ == "__main__":
    main()
