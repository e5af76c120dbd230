"""Time to 95 and 99 % of the best known, this version against another one: `make bench-anytime AGAINST=COMMIT`.

Both versions are installed side by side and take every seed of every problem in turn, so that whatever else the machine
does meets both. What they try is scored as by `trajevo bench run`, with this version's problems and best known sets:
the other version need not know of either. Times are CPU times from the call of `optimise`; the ratio is this version's
median over the other's.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from releases import installed

from trajevo.study.bench.contest import FEASIBLE, Tried, judged
from trajevo.study.bench.score import SHARES, Measure, Story
from trajevo.study.bench.suite import TASK, BenchmarkProblem, benchmark
from trajevo.study.bench.table import Quartiles

#: Those that issue and documentation name: four objectives, limits that are proven, and points that move.
PROBLEMS = ("hybrid_manipulator", "ur5_pick_and_place", "luus1993")

#: Program of a version's process: a line with file, seed and CPU time; it answers with a file of what was tried.
CHILD = """
import json, sys, time
import moocore
import numpy as np
from trajevo import load_task
import trajevo

FEASIBLE, FOLDER = float(sys.argv[1]), sys.argv[2]

def searched(file, seed, budget):
    task = load_task(file)
    problem, kind, told, paused = task.problem, type(task.problem), [], [0.0]

    class Noted(kind):
        def _evaluate(self, x, out, *arguments, **options):
            super()._evaluate(x, out, *arguments, **options)
            now = time.process_time()
            if self.constraints is problem.constraints:
                inside = ((problem.xl <= x) & (problem.xu >= x)).all(axis=1)
                kept = inside & (out["G"] <= FEASIBLE).all(axis=1) & np.isfinite(out["F"]).all(axis=1)
                rows = np.flatnonzero(kept)
                rows = rows[moocore.is_nondominated(out["F"][rows])] if len(rows) else rows
                told.append((now - began - paused[0], x[rows].copy()))
            paused[0] += time.process_time() - now

    problem.evaluate(np.stack([0.5 * (problem.xl + problem.xu), problem.xu]), return_values_of=["F", "G"])
    problem.__class__ = Noted
    began = time.process_time()
    task.solve(seed=seed, cpu_time=budget, progress=False)
    spent = time.process_time() - began - paused[0]
    problem.__class__ = kind
    return told, spent

print(json.dumps(trajevo.__file__), flush=True)
for number, line in enumerate(sys.stdin):
    told, spent = searched(*json.loads(line))
    place = f"{FOLDER}/{number}.npz"
    rows = np.concatenate([x for _, x in told])
    np.savez(place, cpu=np.repeat([cpu for cpu, _ in told], [len(x) for _, x in told]), X=rows, spent=spent)
    print(json.dumps(place), flush=True)
"""


class Version:
    """A process that searches with one version."""

    def __init__(self, packages: Path, folder: Path) -> None:
        environment = os.environ | {"PYTHONPATH": str(packages), "PYTHONSAFEPATH": "1", "TRAJEVO_KERNELS": "compiled"}
        environment |= dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "1")
        folder.mkdir()
        # Loops that are compiled once are nobody's time.
        subprocess.run([sys.executable, "-m", "trajevo.base.kernels"], env=environment, cwd=folder, check=True)
        arguments = [sys.executable, "-W", "ignore", "-c", CHILD, str(FEASIBLE), str(folder)]
        self._process = subprocess.Popen(
            arguments, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment, cwd=folder
        )
        used = Path(self._answer())
        if not used.is_relative_to(packages):
            raise SystemExit(f"expected trajevo of {packages}, got {used}")

    def searched(self, named: BenchmarkProblem, seed: int, budget: float) -> Story:
        """The course of a run, as this version scores it."""
        if self._process.stdin is not None:
            self._process.stdin.write(json.dumps([str(named.folder / TASK), seed, budget]) + "\n")
            self._process.stdin.flush()
        with np.load(self._answer()) as found:
            tried = [Tried(float(cpu), 0, x[None]) for cpu, x in zip(found["cpu"], found["X"], strict=True)]
        cpu, evaluations, _, F = judged(named.problem(), tried, budget)
        return Story(Measure(named.reference), cpu, evaluations, F, budget=budget)

    def _answer(self) -> Any:
        line = "" if self._process.stdout is None else self._process.stdout.readline()
        if not line:
            raise SystemExit("a version's process ended; its message is above")
        return json.loads(line)


def measured(story: Story) -> list[float]:
    """Times to the shares, infinite where they are never reached, and the share at the end."""
    times = [story.time_to(share) for share in SHARES]
    return [np.inf if one is None else one for one in times] + [story.share]


def main() -> None:
    """Install both versions, let them search in turn, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("against", help="commit or tag of this project, or what pip installs, such as trajevo==0.1.0")
    parser.add_argument("problems", nargs="*", default=PROBLEMS, help="names of problems with a task file")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--budget", type=float, default=6.0, help="CPU time of a run [s]")
    told = parser.parse_intermixed_args()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        pairs = {"here": ".", "there": told.against}
        for name in pairs:
            (folder / name).mkdir()
        here, there = (
            Version(installed(source, folder / name), folder / f"{name}_found") for name, source in pairs.items()
        )
        print(f"CPU time [s], medians (quartiles) of {told.seeds} seeds of {told.budget:g} s each, in turn")
        print(f"{'problem':24s}{'':16s}{'here':>28s}{told.against[:20]:>28s}{'ratio':>8s}")
        for name in told.problems:
            named = benchmark(name)
            for version in (here, there):
                version.searched(named, 0, 0.5)  # what a first call loads is nobody's time
            rows = []
            for seed in range(1, told.seeds + 1):
                turn = (here, there) if seed % 2 else (there, here)
                found = {version: measured(version.searched(named, seed, told.budget)) for version in turn}
                rows.append((found[here], found[there]))
            for k, title in enumerate((*(f"time to {100 * share:g} %" for share in SHARES), "share at the end")):
                ours, theirs = (Quartiles.of(row[which][k] for row in rows) for which in range(2))
                fine = np.isfinite(ours.median) and np.isfinite(theirs.median)
                ratio = f"{ours.median / theirs.median:8.2f}" if fine else "never".rjust(8)
                print(f"{name:24s}{title:16s}{ours.told():>28s}{theirs.told():>28s}{ratio}", flush=True)


if __name__ == "__main__":
    main()
