"""Speed of studies, as ratios of wall times measured in one run: `make bench-more`.

First what a cell of each problem costs alone; then the same 24 cells one after the other in this process; on a Dask
cluster of two workers of this machine, its start and end included; and so again with one worker killed half-way. All
fronts are compared to the bit. The ratios mean something on two idle cores; the load that others put on the machine is
printed.
"""

from __future__ import annotations

import hashlib
import multiprocessing
import os
import signal
import tempfile
import threading
import time
from pathlib import Path

from trajevo import Front
from trajevo.study.cluster import DaskCluster
from trajevo.study.definition import Study
from trajevo.study.engines import Engine, InProcess
from trajevo.study.folder import StudyFolder
from trajevo.study.run import run_study

STUDY = {
    "problem": "hybrid",
    "seed": 1,
    "factors": {"payload": [0, 5, 10], "convention": ["continuous", "printed"]},
    "repeats": 4,
    "generations": 200,
    "population": 100,
}


#: Problems of the cells that are measured one by one, and their sizes: generations and individuals.
PROBLEMS, SIZES = ("pointing", "hybrid", "reparam", "pick-place"), ((20, 40), (200, 100))

#: CPU time of a cell with which two idle cores run four a second [s].
ASKED = 0.5


def each_cell() -> None:
    """Print the CPU time of a cell of every problem, without and with polish; mean of three after one that warms up."""
    print(f"CPU seconds of a cell; with at most {ASKED:g} s two idle cores run four a second")
    print(
        f"{'generations x population':26s}"
        + "".join(f"{f'{g} x {p}{end}':>20s}" for g, p in SIZES for end in ("", ", polished"))
    )
    for problem in PROBLEMS:
        spent = [cost(problem, size, polish=polish) for size in SIZES for polish in (False, True)]
        print(f"{problem:26s}" + "".join(f"{seconds:20.2f}" for seconds in spent), flush=True)


def cost(problem: str, size: tuple[int, int], *, polish: bool, repeats: int = 3) -> float:
    """CPU time of a cell of a study in this process [s]."""
    given = dict(zip(("generations", "population"), size, strict=True))
    with tempfile.TemporaryDirectory() as scratch:
        for name, count in (("warm", 1), ("measured", repeats)):
            study = Study(problem, seed=1, repeats=count, fixed={"polish": polish}, **given)
            began = time.process_time()
            run_study(study, Path(scratch) / name, engine=InProcess(), progress=False)
    return (time.process_time() - began) / repeats


def timed(title: str, study: Study, folder: Path, engine: Engine) -> float:
    """Wall time of a study [s]; CPU time is printed beside it, as it tells a busy machine from a slow engine."""
    began, before = time.perf_counter(), os.times()
    stands = run_study(study, folder, engine=engine, progress=False)
    spent, after = time.perf_counter() - began, os.times()
    if not stands.finished:
        raise SystemExit(f"{stands}")
    print(f"{title}: {spent:.1f} s wall, {sum(after[:4]) - sum(before[:4]):.1f} s CPU, load {os.getloadavg()[0]:.2f}")
    return spent


def kill_half_way(study: Study, folder: Path) -> None:
    """Kill one of the worker processes once half of the cells are finished."""
    place = StudyFolder(folder)
    while sum(place.finished(cell.name) for cell in study.cells) < len(study.cells) // 2:
        time.sleep(0.2)
    worker = next(child for child in multiprocessing.active_children() if "Worker" in child.name)
    os.kill(worker.pid or 0, signal.SIGKILL)
    print(f"killed {worker.name}")


def hash_of(study: Study, folder: Path) -> str:
    found = hashlib.sha256()
    for cell in study.cells:
        front = Front.load(StudyFolder(folder).cell(cell.name) / "front.json")
        found.update(front.X.tobytes() + front.F.tobytes() + front.G.tobytes())
    return found.hexdigest()[:16]


def main() -> None:
    each_cell()
    study = Study(**STUDY)
    print(f"{len(study.cells)} cells, {os.cpu_count()} cores, load before: {os.getloadavg()[0]:.2f}")
    with tempfile.TemporaryDirectory() as scratch:
        folders = [Path(scratch) / name for name in ("serial", "cluster", "killed")]
        serial = timed("serial", study, folders[0], InProcess())
        cluster = timed("cluster of 2 workers", study, folders[1], DaskCluster(2))
        killer = threading.Thread(target=kill_half_way, args=(study, folders[2]))
        killer.start()
        killed = timed("one of them killed half-way", study, folders[2], DaskCluster(2))
        killer.join()
        hashes = {hash_of(study, folder) for folder in folders}
    print(f"one hash of all fronts: {len(hashes) == 1}")
    print(f"RATIO cluster of 2 workers / serial: {cluster / serial:.2f} (at most 0.65 is promised on two idle cores)")
    print(f"RATIO the same, one worker killed half-way: {killed / serial:.2f}")


if __name__ == "__main__":
    main()
