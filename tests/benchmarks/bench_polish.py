"""What polishing a front brings and costs: hypervolumes, and CPU time over that of the evolution before it.

Every row is one evolution with the problem's own settings and its polish in the same process, medians of three seeds,
beside the evolution from random starts; for the hybrid manipulator also the trade-off between hypervolume and CPU time
over members and rounds.
`bench_polish.py PICTURE` draws the hybrid manipulator's front before and after.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from itertools import combinations

import matplotlib as mpl
import numpy as np

from trajevo import Front, TrajectoryProblem, optimise
from trajevo.problems import HybridManipulator, PickAndPlace, PointingMechanism, TimeJerkReparameterisation
from trajevo.solvers.gradient.polish import Polished, polish

SEEDS = (1, 2, 3)

PROBLEMS: dict[str, Callable[[], TrajectoryProblem]] = {
    "hybrid, printed": lambda: HybridManipulator(convention="printed"),
    "hybrid, continuous": HybridManipulator,
    "pointing, smooth": PointingMechanism,
    "pointing, quintic": lambda: PointingMechanism(interpolant="quintic"),
    "pick-place": PickAndPlace,
    "reparam": TimeJerkReparameterisation,
}


def evolved(problem: TrajectoryProblem, seed: int, starts: str = "spread") -> tuple[Front, float]:
    """A front and the CPU time it took [s]."""
    began = time.process_time()
    front = optimise(problem, seed=seed, starts=starts, progress=False, polish=False)
    return front, time.process_time() - began


def draw(found: Polished, file: str) -> None:
    """Before and after for every pair of objectives, inside the reference box."""
    mpl.use("Agg")
    from matplotlib import pyplot as plt

    objectives, corner = found.front.record.objectives, found.front.history.reference_point
    figure, axes = plt.subplots(2, 3, figsize=(12.0, 7.0), layout="constrained")
    for ax, (i, j) in zip(axes.flat, combinations(range(len(objectives)), 2), strict=True):
        for F, colour, label in ((found.front.F, "tab:blue", "after"), (found.original.F, "tab:orange", "before")):
            inside = F[(corner > F).all(axis=1)]
            ax.scatter(inside[:, i], inside[:, j], s=7, color=colour, label=label, alpha=0.7, linewidths=0)
        ax.set(
            xlabel=f"{objectives[i].name} [{objectives[i].unit}]", ylabel=f"{objectives[j].name} [{objectives[j].unit}]"
        )
        ax.set(xscale="log", yscale="log")
    axes[0, 0].legend(markerscale=3)
    figure.suptitle(f"hypervolume {found.hypervolume_before:.3f} before, {found.hypervolume_after:.3f} after")
    figure.savefig(file, dpi=110)


def main() -> None:
    """Print the table, or draw."""
    if len(sys.argv) > 1:
        front, _ = evolved(HybridManipulator(convention="printed"), 1)
        draw(polish(front), sys.argv[1])
        return
    for name, make in PROBLEMS.items():
        rows = []
        for seed in SEEDS:
            front, seconds = evolved(make(), seed)
            found = polish(front)
            random, _ = evolved(make(), seed, "random")
            volumes = random.history.hypervolume[-1], found.hypervolume_before, found.hypervolume_after
            rows.append((*volumes, found.seconds / seconds))
        random, before, after, ratio = np.median(rows, axis=0)
        print(
            f"{name}: hypervolume {random:.4f} from random starts, {before:.4f} from good ones, {after:.4f} polished; "
            f"polish / evolution CPU time {ratio:.2f}"
        )
    front, seconds = evolved(HybridManipulator(convention="printed"), 1)
    for members, rounds in ((5, 1), (10, 1), (10, 2), (20, 1), (20, 2), (20, 3), (40, 2), (40, 3)):
        found = polish(front, members=members, rounds=rounds)
        print(f"  {members} members, {rounds} rounds: {found.hypervolume_after:.4f} at {found.seconds / seconds:.2f}")


if __name__ == "__main__":
    main()
