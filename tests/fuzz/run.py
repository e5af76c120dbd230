"""Read thousands of mutated files of every kind that strangers may send, and tell what none of them may do.

    make fuzz
    make fuzz FUZZ="--inputs 2000 --seed 7 --kinds front task"

Two processes, each with bounded memory, share the work. What an input must not do: raise anything but trajevo's own
errors, take more than 10 s or 1 GiB, change a file outside its folder, start a program, open a connection or listen
beyond this machine, print past the console, or end the process. Inputs with findings are kept in build/fuzz.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter, deque
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
KEPT = ROOT / "build" / "fuzz"

KINDS = (
    "front", "manifest", "checkpoint", "blocks", "study.json", "task", "study.toml", "URDF", "MJCF", "robot.toml",
    "joint limits", "points", "proof file", "netCDF", "mesh as stl", "mesh as obj", "mesh as dae", "analyses", "scene",
)  # fmt: skip

#: Inputs of a kind that one process reads, and time after which it hangs outside Python [s].
_CHUNK, _PATIENCE = 640, 20.0


@dataclass
class Count:
    """What was found so far, by all processes.

    Attributes:
        inputs: inputs read, by kind of file.
        findings: inputs that did what none may do, by what they did.
        told: findings that were printed: the first of those that are alike.
    """

    inputs: Counter[str] = field(default_factory=Counter)
    findings: Counter[str] = field(default_factory=Counter)
    told: set[str] = field(default_factory=set)
    lock: threading.Lock = field(default_factory=threading.Lock)

    def stop(self, said: str, kind: str = "crash") -> None:
        """Count what a process did without a single input to blame."""
        with self.lock:
            self.findings[kind] += 1
            sys.stdout.write(f"{said}\n")

    def add(self, found: dict[str, Any], current: Path) -> None:
        """Count a finding, keep its input, and print it if it is the first of its like."""
        with self.lock:
            self.findings[found["kind"]] += 1
            kind, number = found["input"]
            KEPT.mkdir(parents=True, exist_ok=True)
            shutil.copy(current, KEPT / f"{kind.replace(' ', '_')}-{number}")
            last = "\n".join(found["said"].strip().splitlines()[-1:])
            if (key := f"{kind} {found['kind']} {last[:80]}") not in self.told:
                self.told.add(key)
                sys.stdout.write(f"{kind} {number}: {found['kind']}\n{found['said']}\n")


def run_chunk(kind: str, seed: int, numbers: range, count: Count) -> None:
    """Read inputs in processes of their own: in a new one from the next input on whenever one dies."""
    while numbers:
        with tempfile.TemporaryDirectory(prefix="trajevo-fuzz-") as name:
            folder = Path(name)
            done, ended = _read(folder, kind, seed, numbers, count)
            if done:
                count.inputs[kind] += done
                printed = (folder / "errors").read_text(errors="replace").splitlines()
                if printed:
                    count.stop(f"{kind}: {len(printed)} lines on standard error, the first: {printed[0]}", "printed")
                return
            if not (folder / "current").exists():
                said = (folder / "errors").read_text().strip().splitlines()[-1:]
                count.stop(f"{kind}: the process ended with {ended} before its first input: {said}")
                return
            number = int((folder / "current").read_bytes().split(b"\n", 2)[1])
            what = "hang" if ended == -signal.SIGKILL else "crash"
            found = {"input": [kind, number], "kind": what, "said": f"the process ended with {ended}"}
            count.add(found, folder / "current")
            count.inputs[kind] += number + 1 - numbers[0]
            numbers = range(number + 1, numbers[-1] + 1)


def _read(folder: Path, kind: str, seed: int, numbers: range, count: Count) -> tuple[int, int]:
    """Read inputs in one process; returns how many, 0 if it died, and its exit code."""
    given = (folder, seed, numbers[0], len(numbers), kind)
    command = [sys.executable, "-m", "tests.fuzz.worker", *map(str, given)]
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "MPLBACKEND": "Agg", "PYTHONPATH": str(ROOT)}
    done = 0
    with (
        (folder / "errors").open("w") as errors,
        subprocess.Popen(
            command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, stderr=errors, text=True
        ) as worker,
    ):
        threading.Thread(target=_watch, args=(worker, folder / "current"), daemon=True).start()
        for line in worker.stdout or ():
            found = json.loads(line)
            done = found.get("done", 0)
            if not done:
                count.add(found, folder / "current")
    return done, worker.returncode


def _watch(worker: subprocess.Popen[str], current: Path) -> None:
    """Kill a process whose input takes too long where Python cannot interrupt it."""
    while worker.poll() is None:
        time.sleep(1.0)
        with contextlib.suppress(FileNotFoundError):
            if time.time() - current.stat().st_mtime > _PATIENCE:
                worker.kill()


def main() -> int:
    """Read all inputs, and print what was found; 1 if anything was."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--inputs", type=int, default=20_000, help="number of inputs of all kinds together")
    parser.add_argument("--seed", type=int, default=int(time.time()), help="seed of all inputs; the time if not given")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS))
    asked = parser.parse_args()
    each = -(-asked.inputs // len(asked.kinds))
    chunks = deque(
        (kind, range(first, min(first + _CHUNK, each))) for first in range(0, each, _CHUNK) for kind in asked.kinds
    )
    count, began = Count(), time.perf_counter()

    def share() -> None:
        while chunks:
            kind, numbers = chunks.popleft()
            run_chunk(kind, asked.seed, numbers, count)

    threads = [threading.Thread(target=share) for _ in range(asked.processes)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    sys.stdout.write("".join(f"{kind:13} {count.inputs[kind]:6} inputs\n" for kind in asked.kinds))
    named = ("traceback", "hang", "memory", "crash", "write", "start", "socket", "printed")
    found = ", ".join(f"{count.findings[name]} {name}" for name in named)
    total, seconds = sum(count.inputs.values()), time.perf_counter() - began
    sys.stdout.write(f"seed {asked.seed}: {total} inputs in {seconds:.0f} s: {found}\n")
    return int(bool(count.findings) or total < asked.inputs)


if __name__ == "__main__":
    sys.exit(main())
