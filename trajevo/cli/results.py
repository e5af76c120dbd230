"""What commands write into a run's folder when its front is there: pictures, report, and what to do next."""

from __future__ import annotations

import signal
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from trajevo.cli.terminal import print_run
from trajevo.exporters.export import is_exported
from trajevo.front.front import Front
from trajevo.plots.pictures import FIGURES, draw_all, save_pictures
from trajevo.plots.report import report as write_report
from trajevo.solvers.run.folder import FRONT_FILE, RunFolder
from trajevo.solvers.run.runs import read_run

RunArgument = Annotated[Path, typer.Argument(help="Folder that `trajevo solve` wrote, or a front's file.")]

#: Pictures that commands write beside a front unless told where.
SLOWDOWN_PICTURE, DIAGRAM_PICTURE, CURVE_PICTURE = "slowdown.png", "payload_diagram.png", "payload_time.png"


#: What the name of a curve's picture ends with where it is that of the price of uncertainty.
PRICE_SUFFIX = "_uncertainty"
PICTURES = (SLOWDOWN_PICTURE, DIAGRAM_PICTURE, CURVE_PICTURE, CURVE_PICTURE.replace(".", f"{PRICE_SUFFIX}."))

#: What every command says of how one solution is chosen.
SOLUTION_HELP = "knee, utopia, weighted, least_OBJECTIVE or a row."


def front_of(run: Path) -> Front:
    """Front of a run's folder, finished or not, or of a front's file."""
    return read_run(run) if run.is_dir() else Front.load(run)


def beside(run: Path, name: str) -> Path:
    """A file in a run's folder, or beside a front's file."""
    return run / name if run.is_dir() else run.with_name(name)


REPORT_FILE, PLOTS_FOLDER = "report.html", "plots"


_out = Console(soft_wrap=True, highlight=False)


def write_results(front: Front, folder: Path) -> None:
    """Pictures and report of a run that has ended; of one that was interrupted what to do next, and exit."""
    if not (folder / FRONT_FILE).exists():
        raise typer.Exit(2)
    clear_stale(folder)
    print_run(_out, front, None)
    if front.run.interrupted:
        go_on = f"trajevo resume {folder}" if RunFolder(folder).begun else "begin it again"
        _out.print(
            f"interrupted by {front.run.stopped_by}; next: {go_on}, or trajevo report {folder} for what is there"
        )
        raise typer.Exit(128 + signal.Signals[front.run.stopped_by])
    pictures = draw_all(front)
    save_pictures(pictures, folder / PLOTS_FOLDER)
    write_report(front, folder / REPORT_FILE, pictures=pictures)
    _out.print(
        f"written: {folder / FRONT_FILE}, {folder / REPORT_FILE}, {len(pictures)} pictures in {folder / PLOTS_FOLDER}"
    )


def clear_stale(folder: Path) -> None:
    """Remove what an earlier run left beside the new front: report, pictures, exported solutions; no other file."""
    pictures = (folder / PLOTS_FOLDER / f"{stem}.png" for stem in FIGURES)
    told = (folder / name for name in PICTURES)
    exported = (file for file in folder.glob("*.*") if is_exported(file))
    for file in (folder / REPORT_FILE, *pictures, *told, *exported):
        file.unlink(missing_ok=True)
