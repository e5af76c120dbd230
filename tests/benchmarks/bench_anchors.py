"""Least times under effort limits where points may move, from several seeds, against SLSQP from 20 random starts.

Two rods in a plane across gravity with 1 N·m at each joint, through five or eight points of which the inner ones may
move. Every row is one run with default settings: least time, that of SLSQP, CPU time of evolution and polish, share of
the hypervolume of the union of all rows, and how many starts agreed. ``bench_anchors.py COUNT LIMITS SEEDS``, as in
``bench_anchors.py 5 sampled 10``, three seeds if nothing is given; of proven limits SLSQP has as many starts.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

from trajevo import ViaPointProblem, load_robot, minimise_weighted, optimise, polish
from trajevo.formulation.problem import Weights
from trajevo.front.hypervolume import hypervolume

STARTS = 20


def rods(count: int, limits: str) -> ViaPointProblem:
    """The problem."""
    data = Path(__file__).parents[1] / "data"
    return ViaPointProblem(
        robot=load_robot(data / "rods.urdf", limits={"acceleration": np.inf, "jerk": np.inf}),
        points=np.column_stack([np.linspace(0.0, 0.522, count), np.full(count, 0.5)]),
        interpolant="cubic",
        duration_bounds=(0.02, 4.0),
        moving=[{"point": k, "joints": [1.0, 1.5]} for k in range(1, count - 1)],
        objectives=["time", "energy"],
        constraints=["effort"],
        limits=limits,
        payload=1.0,
        samples=8,
    )


def main() -> None:
    """Print the table."""
    given = sys.argv[1:] or ["5", "sampled", "3"]
    count, limits, seeds = int(given[0]), given[1], int(given[2])
    problem = rods(count, limits)
    began = time.process_time()
    other = minimise_weighted(problem, Weights((1.0, 0.0)), seed=1, starts=STARTS)
    print(f"SLSQP from {STARTS} starts: {other.cost:.5f} s, CPU time {time.process_time() - began:.1f} s")
    rows = []
    for seed in range(1, seeds + 1):
        began = time.process_time()
        front = optimise(problem, seed=seed, polish=False, progress=False)
        evolution = time.process_time() - began
        rows.append((polish(front), evolution))
    union = np.concatenate([found.front.F for found, _ in rows])
    corner = np.array([15.0, 1.2])
    whole = hypervolume(union, corner)
    for seed, (found, evolution) in enumerate(rows, start=1):
        F, anchor = found.front.F, found.anchors[0]
        print(
            f"seed {seed}: {F[:, 0].min():.5f} s ({100.0 * (F[:, 0].min() / other.cost - 1.0):+.3f} %), CPU time "
            f"{evolution:.1f} + {found.seconds:.1f} s, hypervolume {hypervolume(F, corner) / whole:.4f} of the union, "
            f"residual {anchor.residual:.0e}, {anchor.agreeing} of {anchor.starts} starts agree"
        )


if __name__ == "__main__":
    main()
