"""The command ``trajevo path-bound``: what no time law along a run's path can be better than."""

from __future__ import annotations

from typing import Annotated

import typer

from trajevo import plots
from trajevo.cli.console import Terminal
from trajevo.cli.problem_options import ProblemOption
from trajevo.cli.results import RunArgument, beside, front_of
from trajevo.cli.screen.tables import Listing
from trajevo.plots.pictures import save_figure
from trajevo.verification.path_bounds.front_bound import path_front_bound

_out = Terminal()

#: Picture that the command writes beside a front.
BOUND_PICTURE = "path_bound.png"


def bound_path(
    run: RunArgument,
    stations: Annotated[int, typer.Option(help="Cells of the path, 10 to 5000; more bring the bound higher.")] = 100,
    weights: Annotated[int, typer.Option(help="Weights of the squared jerk, 1 to 200, spread over the front.")] = 16,
    problem: ProblemOption = None,
) -> None:
    """Bound a front of time and jerk along a path from below, over all time laws, and draw both."""
    front = front_of(run, problem)
    found = path_front_bound(front, weights=weights, stations=stations)
    table = Listing("objective", "no time law is below", "least of the front")
    for row in found.rows:
        table.add(*row)
    _out.print(table)
    _out.print(f"{found.told}.")
    _out.print(f"proven of {found.kind} ({found.stations} stations, {found.cpu_time:.1f} s of CPU)")
    if found.left_out:
        _out.print(f"limits not used, with which the front misses less: {', '.join(found.left_out)}")
    picture = save_figure(plots.path_bound(found, {"front": front}).figure, beside(run, BOUND_PICTURE))
    _out.written(picture, then=f"trajevo path-bound {run} --stations {2 * stations} brings the bound higher")
