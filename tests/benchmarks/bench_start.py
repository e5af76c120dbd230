"""What a person waits for: CPU time of a first `trajevo solve` by its parts, with empty caches and then with full ones.

`python tests/benchmarks/bench_start.py` takes the task that `trajevo init` writes, and the Panda's and the xArm7's;
`python tests/benchmarks/bench_start.py ur5_pick_and_place` takes one of `trajevo examples`.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

TASKS = ("init", "panda_six_points", "xarm7_obstacle")

#: Parts of a run, in the order in which they begin.
PARTS = (
    *("python", "imports", "kernels", "check", "starts", "evolution", "polish", "certificate", "payload"),
    *("pictures", "report", "rest"),
)

#: Greatest CPU time that is asked for [s]: with empty caches, and with full ones; None where nothing is.
ASKED: dict[str, tuple[float | None, float | None]] = {
    "init": (8.0, 4.0),
    "panda_six_points": (15.0, None),
    "xarm7_obstacle": (15.0, None),
}

#: What is timed beside the runs, so that figures of different days and machines can be compared: the packages that a
#: solve needs in any case, imported in a fresh process; and loops over small arrays and plain numbers in one process.
YARDSTICKS = {
    "imports": "import numpy, pinocchio, pymoo.core.algorithm",
    "loops": """
import time
import numpy
began = time.process_time()
values = numpy.linspace(0.0, 1.0, 60 * 36).reshape(60, 36)
for _ in range(60_000):
    values = numpy.abs(values * 0.5 + 0.25)
total = 0
for k in range(6_000_000):
    total += k % 7
print(time.process_time() - began)
""",
}

PACKAGE = Path(__file__).parents[2] / "trajevo"

#: Times that each yardstick is taken; the least counts.
TIMES = 3

#: Program of the measured process: every part's own time, without that of the parts within it.
CHILD = """
import sys, time
BEGAN = time.process_time()
import builtins, importlib, json

spent, stack = {"python": BEGAN}, [["rest", BEGAN]]

def switch(name):
    now = time.process_time()
    part, since = stack[-1]
    spent[part] = spent.get(part, 0.0) + now - since
    if name is None:
        stack.pop()
        stack[-1][1] = now
    else:
        stack.append([name, now])

def timed(name, function):
    def measured(*arguments, **named):
        switch(name)
        try:
            return function(*arguments, **named)
        finally:
            switch(None)
    return measured

def within(owner, attribute, name):
    setattr(owner, attribute, timed(name, getattr(owner, attribute)))

def compiled_by_numba():
    numba = sys.modules.get("numba.core.dispatcher")
    if numba is not None and not hasattr(numba, "measured"):
        numba.measured = True
        within(numba.Dispatcher, "compile", "kernels")

def importing(original):
    def imported(name, *arguments, **named):
        if stack[-1][0] == "imports" or name in sys.modules:
            return original(name, *arguments, **named)
        found = timed("imports", original)(name, *arguments, **named)
        compiled_by_numba()
        return found
    return imported

builtins.__import__ = importing(builtins.__import__)
importlib.import_module = importing(importlib.import_module)

from trajevo.cli import main, results, solve
from trajevo.plots import analyses
from trajevo.solvers.evolutionary import first_population
from trajevo.solvers.run import evolution, runs

within(solve, "check", "check")
within(first_population, "begin_with", "starts")
within(evolution, "evolve", "evolution")
within(runs, "polished", "polish")
for name in ("certificate", "carried", "effort"):
    analyses.ANALYSES[name] = timed(name if name == "certificate" else "payload", analyses.ANALYSES[name])
within(results, "draw_all", "pictures")
within(results, "save_pictures", "pictures")
within(results, "write_report", "report")

code = 0
try:
    main.main()
except SystemExit as ended:
    code = ended.code or 0
while len(stack) > 1:
    switch(None)
switch("end")
sys.stderr.write("measured: " + json.dumps(spent) + chr(10))
sys.exit(code)
"""


def main() -> None:
    """Print the table."""
    subprocess.run([sys.executable, "-m", "compileall", "-q", str(PACKAGE)], check=True)  # as pip does it
    every = [yardsticks()]
    print(told(every[0]))
    print("CPU seconds; kernels: read from their cache; end: of Python, with processes that the run waits for")
    print("empty: nothing is compiled, the run computes with numpy; full: all loops are compiled")
    print(f"{'task':26s}{''.join(f'{part:>12s}' for part in PARTS)}{'end':>7s}{'all':>8s}{'wall':>7s}  asked for")
    for task in sys.argv[1:] or TASKS:
        with tempfile.TemporaryDirectory() as folder:
            for caches, most in zip(("empty", "full"), ASKED.get(task, (None, None)), strict=True):
                if caches == "full":
                    compile_all(Path(folder))
                print(f"{f'{task}, {caches}':26s}{measured(task, Path(folder), most)}", flush=True)
        every.append(yardsticks())
    print(told({name: min(found[name] for found in every) for name in YARDSTICKS}))


def yardsticks() -> dict[str, float]:
    """CPU time of what this project has no part in, by name [s]."""
    found = {}
    for name, program in YARDSTICKS.items():
        took = []
        for _ in range(TIMES):
            before = children()
            done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
            took.append(float(done.stdout) if done.stdout else children() - before)
        found[name] = min(took)
    return found


def told(found: dict[str, float]) -> str:
    """A line that says how fast this machine is now."""
    return (
        f"yardstick: {found['imports']:.2f} s to import numpy, pinocchio and pymoo.core.algorithm in a fresh process, "
        f"{found['loops']:.2f} s for fixed loops of NumPy and Python; the least of several"
    )


def with_caches(folder: Path) -> dict[str, str]:
    """The environment with all caches in a folder, in which Python keeps what it compiles."""
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    return kept | {name: str(folder / "caches") for name in ("XDG_CACHE_HOME", "NUMBA_CACHE_DIR", "MPLCONFIGDIR")}


def compile_all(folder: Path) -> None:
    """What the process beside a first run does, to its end."""
    command = [sys.executable, "-m", "trajevo.base.kernels"]
    subprocess.run(command, env=with_caches(folder), check=True, stdout=subprocess.DEVNULL)


def measured(task: str, folder: Path, most: float | None) -> str:
    """One line of the table: a run in a process of its own, with its caches in a folder."""
    environment = with_caches(folder)
    if task == "init":
        command = [sys.executable, "-m", "trajevo", "init", "task.toml"]
        if not (folder / "task.toml").exists():
            subprocess.run(command, cwd=folder, env=environment, check=True, stdout=subprocess.DEVNULL)
        task = "task.toml"
    command = [sys.executable, "-c", CHILD, "solve", task, "--out", "run", "--overwrite", "--quiet"]
    began, before = time.perf_counter(), children()
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    wall, every = time.perf_counter() - began, children() - before
    if done.returncode:
        sys.exit(done.stderr)
    spent = json.loads(done.stderr.rpartition("measured: ")[2])
    parts = "".join(f"{spent.get(part, 0.0):12.2f}" for part in PARTS)
    verdict = "" if most is None else f"  {most:g} s: {'met' if every <= most else 'missed'}"
    return f"{parts}{every - sum(spent.values()):7.2f}{every:8.2f}{wall:7.2f}{verdict}"


def children() -> float:
    """CPU time of all processes started so far that have ended [s]."""
    used = os.times()
    return used.children_user + used.children_system


if __name__ == "__main__":
    main()
