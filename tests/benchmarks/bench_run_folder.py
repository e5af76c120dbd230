"""What it costs to keep a run in a folder, as a ratio measured in one run: `make bench-more`.

The hybrid manipulator, 100 x 200: `optimise` with a folder against `optimise` without one, taken in turn, medians of
wall time, since waiting for the disk is what a checkpoint costs.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from pathlib import Path

from trajevo import optimise
from trajevo.problems import HybridManipulator

POPULATION, GENERATIONS, ROUNDS = 100, 200, 7


def main() -> None:
    problem = HybridManipulator(payload=10.0)

    def wall(out: Path | None) -> float:
        began = time.perf_counter()
        optimise(problem, seed=1, population=POPULATION, generations=GENERATIONS, polish=False, progress=False, out=out)
        return time.perf_counter() - began

    with tempfile.TemporaryDirectory() as folder:
        pairs = [(wall(None), wall(Path(folder) / str(number))) for number in range(ROUNDS + 1)][1:]
    without, kept = (statistics.median(column) for column in zip(*pairs, strict=True))
    print(
        f"NSGA-II {POPULATION} x {GENERATIONS}: {without:.3f} s, {kept:.3f} s in a folder (medians of {ROUNDS}, wall)"
    )
    print(f"RATIO kept in a folder / not kept: {kept / without:.3f} (at most 1.05 is promised)")


if __name__ == "__main__":
    main()
