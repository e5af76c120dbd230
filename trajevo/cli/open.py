"""``trajevo open`` and ``trajevo weigh``: a run's page that is served, and what one of its buttons does."""

from __future__ import annotations

import threading
import webbrowser
from typing import Annotated

import numpy as np
import typer

from trajevo.cli.console import Terminal
from trajevo.cli.problem_options import ProblemOption
from trajevo.cli.results import RunArgument, front_of
from trajevo.errors import InvalidInputError
from trajevo.page.server import Served
from trajevo.solvers.gradient.weighing import solve_weighted
from trajevo.solvers.run.folder import FRONT_FILE, RunFolder

_out = Terminal()


def open_run(
    run: RunArgument,
    port: Annotated[int, typer.Option(help="Port of this machine; a free one if 0.", min=0, max=65535)] = 0,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open a browser, or only say where.")] = True,
    problem: ProblemOption = None,
) -> None:
    """Serve a run's page to a browser on this machine: it follows the run, and its buttons go on with it."""
    if not run.is_dir():
        raise InvalidInputError(
            f"run: expected the folder of a run, got {run}; trajevo report {run} makes a page of it"
        )
    front_of(run, problem)  # refuses what cannot be read before anything is served
    with Served(run, port=port, read=lambda: front_of(run, problem)) as served:
        _out.print(f"{run} is at {served.address} until Ctrl-C")
        if browser:
            webbrowser.open(served.address)
        try:
            threading.Event().wait()
        except KeyboardInterrupt:
            _out.print("no longer served")


def weigh(
    run: RunArgument,
    weights: Annotated[list[float], typer.Argument(help="One weight for each objective, in their order.")],
    problem: ProblemOption = None,
) -> None:
    """Solve again for one trade-off: minimise a weighted sum of the objectives, and keep the optimum in the front."""
    if not run.is_dir():
        raise InvalidInputError(f"run: expected the folder of a run, got {run}")
    front = front_of(run, problem)
    folder = RunFolder(run)
    with folder.alone():
        found, optimum = solve_weighted(front, weights)
        if not np.isfinite(optimum.cost):
            _out.print("no start ended at a motion within its limits; the front stays as it is")
            return
        values = ", ".join(f"{name} {value:.6g}" for name, value in optimum.F.items())
        if found is front:
            _out.print(f"the front stays as it is: it has a solution that is as good as the optimum, {values}")
            return
        if not folder.evolved_file.exists():
            front.save(folder.evolved_file)
        found.save(run / FRONT_FILE)
    _out.print(f"new: {values} (SI); the front has {len(found)} solutions")
    _out.written(run / FRONT_FILE, then=f"trajevo report {run}")
