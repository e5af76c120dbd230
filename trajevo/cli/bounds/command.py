"""The command ``trajevo bound``: what no motion of a run's kind can be better than."""

from __future__ import annotations

import signal
from typing import Annotated, Any

import typer

from trajevo.base.files import removed
from trajevo.base.signals import Stopping
from trajevo.cli.console import Terminal
from trajevo.cli.problem_options import ProblemOption
from trajevo.cli.results import PLOTS_FOLDER, RunArgument, analyses_of, beside, front_of
from trajevo.cli.screen.tables import Listing
from trajevo.plots.analyses import ANALYSES_SUFFIX
from trajevo.plots.analyses_file import read_analyses, write_analyses
from trajevo.verification.bound_front import BOUND_SUFFIX, bound_front
from trajevo.verification.front_bound import FrontBound

_out, _err = Terminal(), Terminal(stderr=True)

#: Why a search ended, as it is told.
_ENDED = {
    "gap": "the gap is as small as was asked for",
    "missing": "the front misses more than the gap that was asked for, by motions that were found",
    "cpu-time": "its CPU time is over; with more, the same command goes on from here",
    "stopped": "it was interrupted; the same command goes on from here",
    "nothing left": "nothing is left that would make it smaller",
}


def bound(
    run: RunArgument,
    gap: Annotated[
        float, typer.Option(help="Share of the hypervolume's box at which the search ends, 0.0001 to 1.")
    ] = 0.01,
    cpu_time: Annotated[
        float, typer.Option(help="CPU time after which it ends, earlier parts of it included [s].")
    ] = 600.0,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress.")] = False,
    problem: ProblemOption = None,
) -> None:
    """Bound a run's front from below: what no motion of its kind can be better than; it goes on where it stopped."""
    front, kept = front_of(run, problem), analyses_of(run)
    state = kept.with_name(kept.name.removesuffix(ANALYSES_SUFFIX) + BOUND_SUFFIX)
    with Stopping() as stopping:
        found = bound_front(front, gap=gap, cpu_time=cpu_time, file=state, tell=None if quiet else _err.print)
    write_analyses(kept, front, read_analyses(kept, front) | {"bound": found})
    removed(beside(run, PLOTS_FOLDER) / "front_bound.png")  # of an earlier bound
    print_bound(_out, found)
    _out.print(f"it ended since {_ENDED[found.ended]} ({found.cells} cells, {found.cpu_time:.1f} s of CPU)")
    _out.written(kept, then=f"trajevo report {run} shows it with the front")
    if stopping:
        raise typer.Exit(128 + signal.Signals[stopping.asked_by])


def print_bound(out: Any, found: FrontBound) -> None:
    """Print what is proven, of which motions, and between which values the least of each objective lies."""
    table = Listing("objective", "no motion is below", "least known")
    for row in found.rows:
        table.add(*row)
    out.print(table)
    out.print(f"{found.told}.")
    out.print(f"proven of {found.kind}")
    if found.left_out:
        out.print(f"limits not used, with which the front misses less: {', '.join(found.left_out)}")
