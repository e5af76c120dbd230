"""Least times under effort limits where points may move, from several seeds, against SLSQP from 20 random starts.

Arms whose inner points may move, see :mod:`arms`. Every row is one run with default settings: least time, that of
SLSQP, CPU time of evolution and polish, share of the hypervolume of the union of all rows, and how many starts agreed.
``bench_anchors.py ARM COUNT LIMITS SEEDS``, as in ``bench_anchors.py rods 8 sampled 10``, ``rods 5 sampled 3`` if
nothing is given; of proven limits SLSQP has as many starts.
"""

from __future__ import annotations

import sys
import time

import numpy as np
from arms import ARMS, CORNERS

from trajevo import minimise_weighted, optimise, polish
from trajevo.formulation.problem import Weights
from trajevo.front.hypervolume import hypervolume

STARTS = 20


def main() -> None:
    """Print the table."""
    arm, count, limits, seeds = sys.argv[1:] or ["rods", "5", "sampled", "3"]
    problem, corner = ARMS[arm](int(count), limits), np.array(CORNERS[arm])
    began = time.process_time()
    other = minimise_weighted(problem, Weights((1.0, 0.0)), seed=1, starts=STARTS)
    print(f"SLSQP from {STARTS} starts: {other.cost:.5f} s, CPU time {time.process_time() - began:.1f} s")
    rows = []
    for seed in range(1, int(seeds) + 1):
        began = time.process_time()
        front = optimise(problem, seed=seed, polish=False, progress=False)
        evolution = time.process_time() - began
        rows.append((polish(front), evolution))
    union = np.concatenate([found.front.F for found, _ in rows])
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
