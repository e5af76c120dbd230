"""The page of a large front: its size, the CPU time that it takes to make, and how soon it answers a click.

``python tests/benchmarks/bench_page.py`` makes the pages of 4,000 solutions of a UR5 past an obstacle and of the
pointing mechanism; they lie between the members of a searched front and need not be non-dominated. Where Chromium and
playwright are installed (``make test-browser`` installs them) every page is clicked 40 times: the time until all that
follows a choice is computed and drawn, in the page's own thread, and until the browser has shown the next frame, which
without a graphics card includes drawing the robot by software.
"""

from __future__ import annotations

import os
import shutil
import statistics
import tempfile
import time
from pathlib import Path

import numpy as np

from trajevo import Front, ViaPointProblem, load_problem, optimise, report

MEMBERS, CLICKS = 4000, 40

_CLICKS = """async (clicks) => {
  const {state} = trajevo, script = [], frame = [];
  for (let k = 0; k < clicks; k += 1) {
    const begin = performance.now();
    state.choose((state.chosen + 97) % state.count);
    script.push(performance.now() - begin);
    await new Promise((done) => requestAnimationFrame(() => { done(); }));
    const drawn = performance.now();
    frame.push(drawn - begin);
    await new Promise((done) => setTimeout(done, 30));
  }
  return [script, frame];
}"""

_DRAWING = """() => {
  const {state} = trajevo, parts = [...state.views.filter(({canvas}) => canvas.clientWidth), ...state.profiles];
  const begin = performance.now();
  for (const part of parts) part.drawNow();
  const drawn = performance.now();
  if (state.arm) { state.arm.renewPaths(); state.arm.drawNow(); }
  return [drawn - begin, performance.now() - drawn];
}"""


def fronts() -> dict[str, Front]:
    """Name -> a front of so many rows."""
    arm = ViaPointProblem(
        robot={"name": "ur5", "tool": "tool0", "limits": {"acceleration": 10.0, "jerk": 100.0}},
        points=[
            [0.0, -1.5, 1.5, -1.5, -1.5, 0.0],
            [0.8, -1.2, 1.4, -1.7, -1.5, 0.0],
            [0.4, -1.0, 1.0, -1.0, -1.0, 0.3],
        ],
        objectives=("time", "jerk", "energy"),
        scene={"obstacles": [{"name": "ball", "shape": "sphere", "radius": 0.1, "position": [-0.8, 0.5, 0.4]}]},
    )
    return {"UR5 past an obstacle": large(arm), "pointing mechanism": large(load_problem("pointing"))}


def large(problem) -> Front:  # type: ignore[no-untyped-def]
    """A front with rows between its members."""
    front = optimise(problem, population=40, generations=20, polish=False, progress=False, seed=1)
    rng = np.random.default_rng(1)
    one, other = rng.integers(len(front), size=(2, MEMBERS))
    share = rng.uniform(size=(MEMBERS, 1))
    X = share * front.X[one] + (1.0 - share) * front.X[other]
    found = problem.evaluate(X, return_values_of=["F", "G"], return_as_dictionary=True)
    return Front(X, found["F"], found["G"], front.record, front.run, front.history, None, _problem=problem)


def clicked(file: Path) -> str:
    """How soon a page answers, in words."""
    chromium = shutil.which("chromium")
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        chromium = None
    if chromium is None:
        return "not clicked: make test-browser installs Chromium and playwright"
    with sync_playwright() as running:
        given = ["--no-sandbox"] if os.getuid() == 0 else []
        browser = running.chromium.launch(executable_path=chromium, args=[*given, "--enable-unsafe-swiftshader"])
        page = browser.new_page(viewport={"width": 1300, "height": 1000})
        page.goto(f"file://{file}")
        while not page.evaluate("Boolean(window.trajevo)"):
            page.wait_for_timeout(50)
        page.wait_for_timeout(1000)
        script, frame = page.evaluate(_CLICKS, CLICKS)
        drawing = [page.evaluate(_DRAWING) for _ in range(10)]
        shown = page.evaluate("trajevo.state.count")
        browser.close()
    curves, robot = (statistics.median(one[k] for one in drawing) for k in (0, 1))
    told = f"{shown} shown; a click: {statistics.median(script):.1f} ms to choose, {curves:.1f} ms to draw curves, "
    return told + f"{robot:.1f} ms the robot; next frame in {statistics.median(frame):.0f} ms, at most {max(frame):.0f}"


def main() -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory() as folder:
        for name, front in fronts().items():
            began = time.process_time()
            file = report(front, Path(folder) / f"{len(front)}.html", analyses={}, pictures=[])
            spent = time.process_time() - began
            print(f"{name}: {len(front)} solutions, {file.stat().st_size / 1e6:.2f} MB, {spent:.2f} s of CPU")
            print(f"  {clicked(file)}", flush=True)


if __name__ == "__main__":
    main()
