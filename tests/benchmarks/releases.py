"""Speed of this version against another one, in one run: `make bench-release AGAINST=v0.1.0`.

Both versions are installed side by side into folders of their own, with the packages that are here. A process of each
takes the cases in turn, so that whatever else the machine does meets both; the table gives medians of CPU time and the
ratio of the other version's to this one's, which is above 1 where this one is faster.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]

#: Ratio below which a case counts as slower than in the other version.
SLOWER = 0.9

_UR5 = "p = load_task('ur5_pick_and_place').problem"
_FRONT = f"{_UR5}\nf = optimise(p, seed=1, population=40, generations=20, polish=False, progress=False)"

#: What both versions run: title -> (lines before, what is measured). Only what every version has is used.
CASES: dict[str, tuple[str, str]] = {
    "import of optimise, in a new process": ("", "in_new_process('-c', 'from trajevo import optimise')"),
    "trajevo --help, in a new process": ("", "in_new_process('-m', 'trajevo', '--help')"),
    "robot and problem of the UR5 task": ("", _UR5),
    "evaluation, 500 individuals, UR5 task": (f"{_UR5}\nx = drawn(p, 500)", "p.evaluate(x)"),
    "evaluation, 500 individuals, hybrid manipulator": ("p = HybridManipulator()\nx = drawn(p, 500)", "p.evaluate(x)"),
    "evaluation, 100 individuals, xArm7 with its obstacle": (
        "p = load_task('xarm7_obstacle').problem\nx = drawn(p, 100)",
        "p.evaluate(x)",
    ),
    "gradients, 50 individuals, UR5 task": (f"{_UR5}\nx = drawn(p, 50)", "p.evaluate_with_gradients(x)"),
    "evolution, 100 x 50, hybrid manipulator": (
        "p = HybridManipulator()",
        "optimise(p, seed=1, population=100, generations=50, polish=False, progress=False)",
    ),
    "run with polish, 60 x 30, UR5 task": (
        _UR5,
        "optimise(p, seed=1, population=60, generations=30, progress=False)",
    ),
    "certificate of a knee, UR5 task": (_FRONT, "certify(f.pick('knee'))"),
    "largest payload of a knee, UR5 task": (_FRONT, "dlcc(f.pick('knee'))"),
}

#: Program of a version's process: it reads numbers of cases, one a line, and answers with CPU seconds.
CHILD = """
import dataclasses, json, resource, subprocess, sys, time
import numpy as np
import trajevo
from trajevo import certify, dlcc, load_task, optimise
from trajevo.problems import HybridManipulator

def spent():
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime

def in_new_process(*arguments):
    subprocess.run([sys.executable, *arguments], check=True, stdout=subprocess.DEVNULL)

def drawn(problem, count):
    lower = problem.xl + 0.3 * (problem.xu - problem.xl)
    return np.random.default_rng(0).uniform(lower, problem.xu, (count, problem.n_var))

print(json.dumps(trajevo.__file__), flush=True)
cases, known = json.loads(sys.argv[1]), {}
for line in sys.stdin:
    title = json.loads(line)
    before, measured = cases[title]
    try:
        if title not in known:
            known[title] = dict(globals())
            exec(before, known[title])
            exec(measured, known[title])
        began = spent()
        exec(measured, known[title])
        print(json.dumps(spent() - began), flush=True)
    except Exception as error:
        print(json.dumps(f"{type(error).__name__}: {error}"), flush=True)
"""


class Version:
    """A process that measures one version."""

    def __init__(self, folder: Path) -> None:
        environment = os.environ | {"PYTHONPATH": str(folder), "PYTHONSAFEPATH": "1", "TRAJEVO_KERNELS": "compiled"}
        self._process = subprocess.Popen(
            [sys.executable, "-c", CHILD, json.dumps(CASES)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=environment,
            cwd=folder,
        )
        used = Path(self._answer())
        if not used.is_relative_to(folder):
            raise SystemExit(f"expected trajevo of {folder}, got {used}")

    def measure(self, title: str) -> float | str:
        """CPU time of a case [s], or why it fails."""
        if self._process.stdin is not None:
            self._process.stdin.write(json.dumps(title) + "\n")
            self._process.stdin.flush()
        return self._answer()

    def _answer(self) -> Any:
        line = "" if self._process.stdout is None else self._process.stdout.readline()
        if not line:
            raise SystemExit("a version's process ended; its message is above")
        return json.loads(line)


def installed(source: str, folder: Path) -> Path:
    """A version in a folder of its own: a commit or tag of this project, or what pip installs, as `trajevo==0.1.0`."""
    known = subprocess.run(
        ["git", "rev-parse", "--verify", "--quiet", f"{source}^{{commit}}"], cwd=ROOT, capture_output=True, text=True
    )
    wanted = source
    if known.returncode == 0:
        copy = folder / "source"
        subprocess.run(["git", "worktree", "add", "--detach", "--quiet", str(copy), source], cwd=ROOT, check=True)
        wanted = str(copy)
    elif source == ".":
        wanted = str(ROOT)
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps"]
    try:
        subprocess.run([*pip, "--target", str(folder / "packages"), wanted], check=True)
    finally:
        if known.returncode == 0:
            subprocess.run(["git", "worktree", "remove", "--force", str(folder / "source")], cwd=ROOT, check=True)
    return folder / "packages"


def line(title: str, ours: list[float | str], theirs: list[float | str]) -> str:
    """A line of the table, from the measurements of both versions."""
    for whose, found in (("here", ours), ("there", theirs)):
        failed = [one for one in found if isinstance(one, str)]
        if failed:
            return f"{title:58s} fails {whose}: {failed[0]}"
    mine, other = (statistics.median(map(float, found)) for found in (ours, theirs))
    ratio = other / mine
    return f"{title:58s}{1e3 * mine:11.1f}{1e3 * other:11.1f}{ratio:8.2f}{'  slower' if ratio < SLOWER else ''}"


def main() -> None:
    """Install both versions and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("against", help="commit or tag of this project, or what pip installs, such as trajevo==0.1.0")
    parser.add_argument("--rounds", type=int, default=5, help="measurements of every case")
    told = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        places = [Path(folder) / name for name in ("here", "there")]
        for place in places:
            place.mkdir()
        here, there = (Version(installed(*pair)) for pair in zip((".", told.against), places, strict=True))
        print(f"CPU time in ms, medians of {told.rounds}, in turn; ratio: {told.against} / this version")
        print(f"{'case':58s}{'here':>11s}{'there':>11s}{'ratio':>8s}")
        for title in CASES:
            pairs = [(here.measure(title), there.measure(title)) for _ in range(told.rounds)]
            print(line(title, *map(list, zip(*pairs, strict=True))), flush=True)


if __name__ == "__main__":
    main()
