"""The commands ``trajevo study``: run, status, collect."""

from __future__ import annotations

import signal
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from trajevo.cli import completion
from trajevo.cli.console import Terminal
from trajevo.cli.screen.tables import Listing
from trajevo.cli.screen.waiting import Waiting
from trajevo.errors import InvalidInputError
from trajevo.solvers.run.folder import RunFolder
from trajevo.solvers.run.runs import standing
from trajevo.study.cluster import DaskCluster
from trajevo.study.definition import Study, load_study
from trajevo.study.engines import START_METHODS, Engine, InProcess, Processes
from trajevo.study.folder import STATES, StudyFolder
from trajevo.study.run import StudyStanding, run_study, study_standing

if TYPE_CHECKING:
    from trajevo.study.report import StudyReport
    from trajevo.study.results import StudyResults

app = typer.Typer(help="Many runs: the product of factors, on one machine or a cluster.", no_args_is_help=True)
_out = Terminal()

_Folder = Annotated[Path, typer.Argument(help="Folder of a study.", autocompletion=completion.study_folders)]


@app.command()
def run(
    study: Annotated[
        Path,
        typer.Argument(
            help="File study.toml, name in `trajevo examples`, or a study's folder.", autocompletion=completion.studies
        ),
    ],
    out: Annotated[Path | None, typer.Option(help="Folder of the study; runs/STUDY if not given.")] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Cells at a time, each in a process; with --dask all cores if not given.")
    ] = None,
    start_method: Annotated[
        str | None, typer.Option(help=f"How processes are started: {', '.join(START_METHODS)}.")
    ] = None,
    dask: Annotated[bool, typer.Option("--dask", help="On a Dask cluster of this machine.")] = False,
    scheduler: Annotated[
        str | None, typer.Option(help="On the Dask cluster with this scheduler, such as tcp://host:8786.")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress.")] = False,
) -> None:
    """Run the cells of a study that are not finished; exit code 1 if a cell has failed."""
    engine = engine_of(workers, start_method, dask, scheduler)
    if study.is_dir():
        if out is not None:
            raise InvalidInputError("--out: a study that is gone on with stays in its folder")
        to_run, folder = Study.of(StudyFolder(study).record()), study
    else:
        to_run, folder = load_study(study), out or Path("runs") / study.stem
    stands = run_study(to_run, folder, engine=engine, progress=not quiet)
    _print_standing(stands, folder)
    if stands.stopped_by:
        _out.print(f"stopped by {stands.stopped_by}; next: trajevo study run {folder}")
        raise typer.Exit(128 + signal.Signals[stands.stopped_by])
    if not stands.finished:
        _out.print(f"next: trajevo study run {folder} tries the failed cells again")
        raise typer.Exit(1)
    _out.print(f"next: trajevo study collect {folder}")


@app.command()
def status(folder: _Folder) -> None:
    """Show the progress of a study, while it runs or afterwards."""
    _print_standing(study_standing(folder), folder)


@app.command()
def collect(
    folder: _Folder,
    out: Annotated[Path | None, typer.Option(help="Folder for the results; the study's if not given.")] = None,
) -> None:
    """Write the page, tables, comparisons and pictures of a study's results so far."""
    # Imported where pictures are drawn, since that takes long.
    from trajevo.study.collection import collect as collect_results
    from trajevo.study.report import write_study

    with Waiting("collecting", ["cells", "page, tables and pictures"]) as shown:
        shown.begin("cells")
        results = collect_results(folder)
        shown.begin("page, tables and pictures")
        report = write_study(results, out)
    _print_results(results, report)


def engine_of(workers: int | None, start_method: str | None, dask: bool, scheduler: str | None) -> Engine:
    """What runs cells, from the options of a command.

    Args:
        workers: cells at a time; one, or with a cluster all cores, if None.
        start_method: how processes are started.
        dask: whether on a Dask cluster of this machine.
        scheduler: address of the scheduler of a running cluster.

    Raises:
        InvalidInputError: options that exclude each other, or as for the engine.
    """
    if dask or scheduler is not None:
        if start_method is not None:
            raise InvalidInputError("--start-method: Dask starts its workers itself")
        if dask and scheduler is not None:
            raise InvalidInputError("--dask: makes a cluster of its own; leave it out with --scheduler")
        return DaskCluster(workers, scheduler=scheduler)
    if start_method is None and (workers or 1) == 1:
        return InProcess()
    return Processes(workers or 1, start_method=start_method or START_METHODS[0])


def _print_standing(stands: StudyStanding, folder: Path) -> None:
    table = Listing("state", "cells")
    for state in STATES:
        if stands.count(state):
            table.add(state, str(stands.count(state)))
    table.add("all", str(len(stands.cells)))
    _out.print(table)
    place = StudyFolder(folder)
    for one in stands.cells:
        if one.state in ("running", "stopped") and RunFolder(place.cell(one.cell.name)).begun:
            at = standing(place.cell(one.cell.name))
            _out.print(f"{one.state}: {one.cell.name}: generation {at.generation} of {at.generations}")
        elif one.failure is not None:
            _out.print(f"failed: {one.cell.name}: {one.failure.sentence}")
    if stands.count("failed"):
        _out.print(f"tracebacks: {place.cell('CELL') / 'failure.json'}")


def _print_results(results: StudyResults, report: StudyReport) -> None:
    _out.print(f"{len(results.cells)} cells finished, {results.unfinished} not")
    _out.print(results.origin)
    frame = results.table()
    for factor in results.record.factors:
        table = Listing(factor, "runs", "median hypervolume", "quartiles", "time of a run [s]")
        for level in results.levels(factor):
            own = frame[frame[factor] == level]
            if len(own):
                low, middle, high = own["hypervolume"].quantile([0.25, 0.5, 0.75])
                seconds = f"{own['seconds'].median():.2f}"
                table.add(_shown(level), str(len(own)), f"{middle:.5f}", f"{low:.5f}, {high:.5f}", seconds)
        _out.print(table)
    if report.comparisons:
        table = Listing("factor", "levels", "pairs", "difference", "effect", "p", "p, Holm")
        for one in report.comparisons:
            cells = f"{one.difference:.3g}", f"{one.effect:.2f}", f"{one.p:.3g}", f"{one.p_holm:.3g}"
            table.add(one.factor, f"{_shown(one.first)} - {_shown(one.second)}", str(one.pairs), *cells)
        _out.print("Wilcoxon signed-rank tests over matched cells, p values corrected by Holm's method:")
        _out.print(table)
    for note in report.notes:
        _out.print(note)
    unfinished = f"trajevo study run {results.folder} for the rest; " if results.unfinished else ""
    _out.written(*report.files, then=f"{unfinished}open {report.files[-1]} in a browser")


def _shown(level: object) -> str:
    return f"{level:g}" if isinstance(level, int | float) else str(level)
