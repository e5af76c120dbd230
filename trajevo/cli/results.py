"""Output of commands once a run has its front: pictures, report, and the next command."""

from __future__ import annotations

import signal
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from trajevo.base.files import no_link, removed
from trajevo.cli import completion
from trajevo.cli.console import Terminal
from trajevo.cli.problem_options import problem_of_run
from trajevo.cli.screen.printed import print_rivals, print_run
from trajevo.cli.screen.waiting import Waiting
from trajevo.errors import InvalidInputError, NotRegisteredError, checked_name, no_such_file
from trajevo.exporters.export import is_exported
from trajevo.front.front import Front
from trajevo.front.thinning import told_share
from trajevo.page.report import report as write_report
from trajevo.plots.analyses import ANALYSES_SUFFIX, KINDS, analyse, analysed
from trajevo.plots.pictures import FIGURES, FORMATS, Picture, draw_all, figures_of, save_pictures
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
RunPicturesOption = Annotated[
    bool | None,
    typer.Option(
        "--pictures/--no-pictures",
        help="Draw pictures as files too; unless told, not with the short report, whose page draws them itself.",
    ),
]
RunArgument = Annotated[
    Path,
    typer.Argument(help="Folder that `trajevo solve` wrote, or a front's file.", autocompletion=completion.runs),
]
VerboseOption = Annotated[bool, typer.Option("--verbose", help="All settings too, with points and tables.")]

#: Pictures that commands write beside a front by default.
SLOWDOWN_PICTURE, DIAGRAM_PICTURE, CURVE_PICTURE = "slowdown.png", "payload_diagram.png", "payload_time.png"
EXCHANGE_PICTURE = "exchange_rates.png"

#: The sheet that ``payload-sheet`` writes beside a front, and its JSON.
SHEET_FILE, SHEET_DATA = "payload_sheet.html", "payload_sheet.json"


#: Suffix of the stem of the picture with the price of uncertainty.
PRICE_SUFFIX = "_uncertainty"
PICTURES = (SLOWDOWN_PICTURE, DIAGRAM_PICTURE, CURVE_PICTURE, CURVE_PICTURE.replace(".", f"{PRICE_SUFFIX}."))
#: Pictures of closed loops, of one motion and of a front.
CLOSED_LOOP_PICTURE, ACHIEVED_PICTURE = "closed_loop.png", "achieved_front.png"

SolutionOption = Annotated[
    str,
    typer.Option(
        help="knee, utopia, weighted, topsis, least_OBJECTIVE or a row.",
        autocompletion=completion.solutions,
    ),
]


def front_of(run: Path, problem: str | None = None) -> Front:
    """Front of a run's folder, finished or not, or of a front's file.

    Args:
        run: the folder or the file.
        problem: the run's problem, see :func:`~trajevo.cli.problem_options.problem_of_run`.

    Raises:
        InvalidInputError: nothing to read, or its problem is not registered and was not given.
    """
    given = problem_of_run(problem)
    with reading(run):
        front = read_run(run, problem=given) if run.is_dir() else Front.load(run, problem=given)
        if given is None:
            front.record.check_registered()
    return front


@contextmanager
def reading(run: Path) -> Iterator[None]:
    """Refuse a run that is not there, and name the option to give for one whose problem is not registered."""
    if not run.exists():
        raise InvalidInputError(no_such_file(run, "run"))
    try:
        yield
    except NotRegisteredError as error:
        raise InvalidInputError(
            f"{run}: {error.said}; give it: --problem MODULE:NAME, where NAME in the Python module MODULE is the "
            "problem, or makes it"
        ) from error


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


def draws(pictures: bool | None, kind: str) -> bool:
    """Whether a run's command draws pictures: as told, else unless it writes the short report, which shows the same."""
    return kind != "short" if pictures is None else pictures


def write_results(
    front: Front,
    folder: Path,
    *,
    kind: str,
    pictures: bool | None,
    quiet: bool = False,
    verbose: bool = False,
    problem: str | None = None,
) -> None:
    """Print the results of a finished run, write its pictures and report, and exit with 3 if its front is empty.

    After an interruption, print the next command and exit.
    """
    drawn = draws(pictures, kind)
    if not (folder / FRONT_FILE).exists():
        raise typer.Exit(2)
    clear_stale(folder)
    print_run(_out, front, verbose=verbose)
    if front.run.interrupted:
        go_on = f"trajevo resume {folder}" if RunFolder(folder).begun else "begin it again"
        _out.print(
            f"interrupted by {front.run.stopped_by}; next: {go_on}, or trajevo report {folder} for what is there",
        )
        raise typer.Exit(128 + signal.Signals[front.run.stopped_by])
    then = _then(front, folder, kind=kind, pictures=drawn)
    write_report_of(
        front,
        folder,
        kind=kind,
        pictures=drawn,
        views=kind == "full",
        quiet=quiet,
        then=then,
        files="knee",
        problem=problem,
    )
    if not len(front):
        raise typer.Exit(NO_SOLUTION)


def _then(front: Front, folder: Path, *, kind: str, pictures: bool) -> str:
    """What to do after a run: prove its knee, and compute what its report leaves out."""
    if not len(front):
        return "trajevo check with the same problem and options, which tells what rules motions out"
    later = len(analysed(front)) - len(analysed(front, kind))
    drawn = "" if pictures else f"; trajevo pictures {folder} for pictures of a paper's size"
    left_out = ["views in space"] if pictures and kind != "full" else []
    left_out += [f"{later} analyses that take longer"] if later else []
    more = f"; trajevo report {folder} --full for {' and '.join(left_out)}" if left_out else ""
    return f"trajevo certify {folder}{drawn}{more}"


def analyses_shown(front: Front, kind: str, file: Path, *, quiet: bool = False) -> Mapping[str, Any]:
    """Compute or read the analyses of a front, with a bar; elsewhere than on a terminal a full report tells lines."""
    with Waiting("computing", analysed(front, kind), quiet=quiet, lines=kind == "full") as shown:
        return analyse(front, kind, file=file, begin=shown.begin)


def pictures_shown(
    front: Front, found: Mapping[str, Any], folder: Path, *, views: bool, quiet: bool = False
) -> tuple[Picture, ...]:
    """Draw the pictures of a front that a folder does not keep, with a bar."""
    with Waiting("drawing", figures_of(front, found), quiet=quiet) as shown:
        return draw_all(front, found, kept=folder, views=views, begin=shown.begin)


def write_report_of(
    front: Front,
    folder: Path,
    *,
    kind: str,
    pictures: bool,
    views: bool,
    then: str,
    quiet: bool = False,
    files: Literal["knee", "choices"] = "choices",
    problem: str | None = None,
) -> None:
    """Compute or read the analyses of a run, write its pictures and report into the folder, and tell what is next."""
    found = analyses_shown(front, kind, analyses_of(folder), quiet=quiet)
    if found.get("rivals"):
        print_rivals(_out, found["rivals"])
    told, plots = [str(folder / FRONT_FILE)], folder / PLOTS_FOLDER
    drawn = pictures_shown(front, found, plots, views=views, quiet=quiet) if pictures else ()
    save_pictures(drawn, plots)
    if kind != "none":
        file = folder / REPORT_FILE
        write_report(front, file, analyses=found, pictures=drawn, files=files, run=str(folder), problem=problem)
        told.append(str(file))
    share = told_share(front.thinned(), front) if drawn else ""
    if share:
        _out.print(f"note: pictures show {share}")
    if drawn:
        told.append(f"{len(drawn)} pictures in {plots}")
    _out.written(*told, then=then)


def clear_stale(folder: Path) -> None:
    """Remove an earlier run's files beside the new front: report, analyses, pictures, sheet, exported solutions."""
    pictures = (no_link(folder / PLOTS_FOLDER) / f"{stem}.{ending}" for stem in FIGURES for ending in FORMATS)
    drawn = (*PICTURES, CLOSED_LOOP_PICTURE, ACHIEVED_PICTURE)
    told = (folder / name for name in (*drawn, SHEET_FILE, SHEET_DATA))
    exported = (file for file in folder.glob("*.*") if is_exported(file))
    for file in (folder / REPORT_FILE, analyses_of(folder), *pictures, *told, *exported):
        removed(file)
