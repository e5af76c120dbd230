"""Output of commands once a run has its front: pictures, report, and the next command."""

from __future__ import annotations

import signal
from pathlib import Path
from typing import Annotated

import typer

from trajevo.cli.console import Terminal
from trajevo.cli.terminal import print_rivals, print_run
from trajevo.errors import checked_name
from trajevo.exporters.export import is_exported
from trajevo.front.front import Front
from trajevo.front.thinning import told_share
from trajevo.plots.analyses import ANALYSES_SUFFIX, KINDS, analyse, analysed
from trajevo.plots.pictures import FIGURES, draw_all, save_pictures
from trajevo.plots.report import report as write_report
from trajevo.solvers.run.folder import FRONT_FILE, RunFolder
from trajevo.solvers.run.runs import read_run

ReportOption = Annotated[
    str,
    typer.Option(
        callback=lambda kind: checked_name("report", kind, KINDS),
        help="Report: none, short (front, the knee's motion, its certificate and payload) or full "
        "(also views in space, payload studies and rivals, which optimises again).",
    ),
]
PicturesOption = Annotated[bool, typer.Option("--pictures/--no-pictures", help="Draw pictures, or write tables only.")]
RunArgument = Annotated[Path, typer.Argument(help="Folder that `trajevo solve` wrote, or a front's file.")]

#: Pictures that commands write beside a front by default.
SLOWDOWN_PICTURE, DIAGRAM_PICTURE, CURVE_PICTURE = "slowdown.png", "payload_diagram.png", "payload_time.png"


#: Suffix of the stem of the picture with the price of uncertainty.
PRICE_SUFFIX = "_uncertainty"
PICTURES = (SLOWDOWN_PICTURE, DIAGRAM_PICTURE, CURVE_PICTURE, CURVE_PICTURE.replace(".", f"{PRICE_SUFFIX}."))

#: Help of every command's option that chooses a solution.
SOLUTION_HELP = "knee, utopia, weighted, least_OBJECTIVE or a row."


def front_of(run: Path) -> Front:
    """Front of a run's folder, finished or not, or of a front's file."""
    return read_run(run) if run.is_dir() else Front.load(run)


def beside(run: Path, name: str) -> Path:
    """A file in a run's folder, or beside a front's file."""
    return run / name if run.is_dir() else run.with_name(name)


def analyses_of(run: Path) -> Path:
    """File that keeps the analyses of a run's front, or of a front's file, beside it."""
    return (run / FRONT_FILE if run.is_dir() else run).with_suffix(ANALYSES_SUFFIX)


#: Exit code of a command that finds no feasible motion, or is given a front without one.
NO_SOLUTION = 3

REPORT_FILE, PLOTS_FOLDER = "report.html", "plots"


_out = Terminal()
_err = Terminal(stderr=True)


def write_results(front: Front, folder: Path, *, kind: str, pictures: bool) -> None:
    """Write pictures and report of a finished run, and exit with 3 if its front is empty.

    After an interruption, print the next command and exit.
    """
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
    write_report_of(front, folder, kind=kind, pictures=pictures, views=kind == "full")
    later = len(analysed(front)) - len(analysed(front, kind))
    left_out = ["views in space"] if len(front) and pictures and kind != "full" else []
    left_out += [f"{later} analyses that take longer"] if later else []
    if left_out:
        _out.print(f"next: trajevo report {folder} --full for {' and '.join(left_out)}")
    if not len(front):
        raise typer.Exit(NO_SOLUTION)


def told_before(analysis: str) -> None:
    """Tell on standard error what is computed now, since some analyses take minutes."""
    _err.print(f"computing: {analysis.replace('_', ' ')}", markup=False)


def write_report_of(front: Front, folder: Path, *, kind: str, pictures: bool, views: bool) -> None:
    """Compute or read the analyses of a run, then write its pictures and report into the folder."""
    found = analyse(front, kind, file=analyses_of(folder), begin=told_before if kind == "full" else None)
    if found.get("rivals"):
        print_rivals(_out, found["rivals"])
    told = [str(folder / FRONT_FILE)]
    drawn = draw_all(front, found, kept=folder / PLOTS_FOLDER, views=views) if pictures else ()
    save_pictures(drawn, folder / PLOTS_FOLDER)
    if kind != "none":
        told.append(str(write_report(front, folder / REPORT_FILE, analyses=found, pictures=drawn)))
    share = told_share(front.thinned(), front) if drawn else ""
    if share:
        _out.print(f"note: pictures show {share}")
    if drawn or kind != "none":
        told.append(f"{len(drawn)} pictures in {folder / PLOTS_FOLDER}")
    _out.print(f"written: {', '.join(told)}")


def clear_stale(folder: Path) -> None:
    """Remove an earlier run's files beside the new front: report, analyses, pictures, exported solutions; no others."""
    pictures = (folder / PLOTS_FOLDER / f"{stem}.png" for stem in FIGURES)
    told = (folder / name for name in PICTURES)
    exported = (file for file in folder.glob("*.*") if is_exported(file))
    for file in (folder / REPORT_FILE, analyses_of(folder), *pictures, *told, *exported):
        file.unlink(missing_ok=True)
