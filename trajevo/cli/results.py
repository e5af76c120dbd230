"""What commands write into a run's folder when its front is there: pictures, report, and what to do next."""

from __future__ import annotations

import signal
from pathlib import Path

import typer
from rich.console import Console

from trajevo.cli_files import PICTURES
from trajevo.export import is_exported
from trajevo.front import Front
from trajevo.pictures import FIGURES, draw_all, save_pictures
from trajevo.report import report as write_report
from trajevo.run_folder import FRONT_FILE, RunFolder
from trajevo.terminal import print_run

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
