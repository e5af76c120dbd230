"""What a front of 100,000 solutions costs: saved, read, shown, drawn and exported, each command in its own process."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import moocore
import numpy as np

from trajevo import Front, load_task
from trajevo.front.covering import neighbours
from trajevo.front.records import ProblemRecord
from trajevo.front.selection import normalised

TASK = Path(__file__).parents[2] / "problems" / "tasks" / "ur5_pick_and_place.toml"

#: Solutions of the front, and candidates between neighbours that are evaluated at a time until there are as many.
SIZE, CANDIDATES = 100_000, 50_000

#: Greatest CPU time of what is asked for together: shown, drawn and one motion exported [s].
ASKED = 10.0


def main() -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory() as folder:
        run = Path(folder) / "run"
        run.mkdir()
        front = large_front()
        timed(f"save {len(front):,} solutions", lambda: front.save(run / "front.json"))
        timed("read them", lambda: Front.load(run / "front.json"))
        timed("thin them out", lambda: front.thinned())
        asked = [command("show", run), command("report", run), command("export", run, "--format", "csv")]
        command("export", run, "--format", "netcdf")
        total = sum(asked)
        print(
            f"shown, drawn and exported: {total:.1f} s, asked for {ASKED:g} s: {'met' if total <= ASKED else 'missed'}"
        )


def large_front() -> Front:
    """A front whose solutions lie between neighbours of a searched one; what is dominated is left out."""
    task = load_task(TASK)
    problem = type(task.problem)(**task.problem.settings | {"limits": "sampled"})
    front = replace(task.solve(progress=False), record=ProblemRecord.of(problem), _problem=problem)
    pairs, random = neighbours(normalised(front.F), 6), np.random.default_rng(0)
    X, (F, G) = front.X, problem.evaluate(front.X, return_values_of=["F", "G"])
    while len(F) < SIZE:
        chosen, share = pairs[random.integers(len(pairs), size=CANDIDATES)], random.uniform(size=(CANDIDATES, 1))
        more = share * front.X[chosen[:, 0]] + (1.0 - share) * front.X[chosen[:, 1]]
        values = problem.evaluate(more, return_values_of=["F", "G"])
        X, F, G = (np.concatenate(pair) for pair in zip((X, F, G), (more, *values), strict=True))
        kept = (G <= 0.0).all(axis=1)
        kept[kept] = moocore.is_nondominated(F[kept])
        X, F, G = X[kept], F[kept], G[kept]
    rows = np.sort(random.permutation(len(F))[:SIZE])
    return replace(front, X=X[rows], F=F[rows], G=G[rows])


def timed(what: str, function: Callable[[], Any]) -> None:
    """Run a function and print its CPU time."""
    began = time.process_time()
    function()
    print(f"{what:32s} {time.process_time() - began:8.2f} s", flush=True)


def command(*arguments: object) -> float:
    """Run a command of trajevo, print its CPU time, and return it [s]."""
    before = os.times()
    subprocess.run([sys.executable, "-m", "trajevo", *map(str, arguments)], check=True, stdout=subprocess.DEVNULL)
    after = os.times()
    spent = after.children_user + after.children_system - before.children_user - before.children_system
    told = " ".join(["trajevo", *(str(each) for each in arguments if not isinstance(each, Path))])
    print(f"{told:32s} {spent:8.2f} s", flush=True)
    return spent


if __name__ == "__main__":
    main()
