"""Commands that look at a run: ``show``, ``explain``, ``report``, ``export``, ``animate``, ``verify`` and more."""

from __future__ import annotations

import threading
import webbrowser
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from trajevo import plots
from trajevo.base.files import check_writable, why_not
from trajevo.capacity.dlcc import dlcc, dlcc_iterative
from trajevo.capacity.drives.drive_capacity import drive_capacity
from trajevo.capacity.sensitivity import sensitivity
from trajevo.cli import completion
from trajevo.cli.console import Terminal
from trajevo.cli.problem_options import ProblemOption
from trajevo.cli.results import (
    EXCHANGE_PICTURE,
    PLOTS_FOLDER,
    REPORT_FILE,
    PicturesOption,
    RunArgument,
    SolutionOption,
    VerboseOption,
    analyses_of,
    analyses_shown,
    beside,
    front_of,
    pictures_shown,
    write_report_of,
)
from trajevo.cli.screen.limits import in_metres, print_full_capacity
from trajevo.cli.screen.printed import known_problem, print_mass_notes, print_rivals, print_run, print_verifications
from trajevo.cli.screen.tables import Listing
from trajevo.cli.screen.waiting import Waiting
from trajevo.cli.screen.weighed import print_weighed
from trajevo.errors import InvalidInputError
from trajevo.exporters.export import NAMED_EXPORTERS
from trajevo.exporters.export import export as write
from trajevo.page.animation import animate
from trajevo.page.report import report as write_report
from trajevo.page.server import Served
from trajevo.plots.analyses import kept_kind
from trajevo.plots.analyses_file import read_analyses
from trajevo.plots.pictures import FORMATS, draw_files, figures_of
from trajevo.verification.certificate import Certificate
from trajevo.verification.certify import certify, certify_all
from trajevo.verification.verify import verify, verify_all

_out = Terminal()
_Angle = Annotated[str | None, typer.Option(help="Unit of angles: rad or deg; the problem's unit if not given.")]


def show(
    run: RunArgument,
    angle: _Angle = None,
    weights: Annotated[
        str | None,
        typer.Option(
            help="What these weights choose, and how stably: OBJECTIVE=NUMBER,... for all objectives, equal, entropy, "
            "paper, or a CSV file of comparisons in pairs.",
            autocompletion=completion.weights,
        ),
    ] = None,
    verbose: VerboseOption = False,
    problem: ProblemOption = None,
) -> None:
    """Show a run in the terminal."""
    front = front_of(run, problem)
    if weights is not None:
        print_weighed(_out, front, weights, angle=angle)
        return
    print_run(_out, front, angle=angle, verbose=verbose)
    if len(front) and not known_problem(front):
        _out.print(f"limits and motions need the problem: trajevo show {run} --problem MODULE")
        return
    for note in front.problem.notes if len(front) else ():
        _out.print(f"note: {note}")
    kept = read_analyses(analyses_of(run), front) if len(front) else {}
    if len(front) and front.problem.compares_rivals:
        if kept.get("rivals"):
            print_rivals(_out, kept["rivals"])
        else:
            _out.print(f"not compared with other interpolants yet; trajevo report {run} --full does that")
    for rates in kept.get("exchange_rates", ()):
        _out.print(f"knee: {rates.short}")
    if kept.get("bound"):
        _out.print(f"bound: {kept['bound'].told}")
    if not verbose:
        _out.print(f"all settings: trajevo show {run} --verbose")


def report(
    run: RunArgument,
    out: Annotated[
        Path | None,
        typer.Option(help="HTML file; report.html beside the front if not given, and pictures in a run's folder."),
    ] = None,
    full: Annotated[
        bool,
        typer.Option("--full", help="With views in space, payload studies and rivals; what is not kept is computed."),
    ] = False,
    pictures: PicturesOption = True,
    problem: ProblemOption = None,
) -> None:
    """Write a run's report of what is kept of it, one HTML file that needs no network."""
    front = front_of(run, problem)
    kind = "full" if full else kept_kind(front, analyses_of(run))
    if run.is_dir() and out is None:
        then = f"open {run / REPORT_FILE} in a browser"
        write_report_of(front, run, kind=kind, pictures=pictures, views=full, then=then, problem=problem)
        return
    found = analyses_shown(front, kind, analyses_of(run))
    drawn = pictures_shown(front, found, beside(run, PLOTS_FOLDER), views=full) if pictures else ()
    target = out or beside(run, REPORT_FILE)
    file = write_report(front, target, analyses=found, pictures=drawn, run=str(run), problem=problem)
    _out.written(file, then="open it in a browser")


def pictures(
    run: RunArgument,
    format: Annotated[
        str,
        typer.Option(help=f"{', '.join(FORMATS)}.", autocompletion=completion.picture_formats),
    ] = "pdf",
    width: Annotated[
        str | None,
        typer.Option(help="column (85 mm), page (170 mm) or millimetres; what suits each picture if not given."),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder; plots beside the front if not given.")] = None,
    problem: ProblemOption = None,
) -> None:
    """Draw all pictures of what is kept of a run for a paper: text of 8 pt at the width of a column or a page."""
    front = front_of(run, problem)
    found = analyses_shown(front, kept_kind(front, analyses_of(run)), analyses_of(run))
    folder, wide = out or beside(run, PLOTS_FOLDER), _width(width)
    with Waiting("drawing", figures_of(front, found)) as shown:
        files = draw_files(front, folder, found, format=format, width=wide, begin=shown.begin)
    _out.written(f"{len(files)} pictures in {folder}", then="put them into a paper as they are, at their own size")


def _width(given: str | None) -> Any:
    """A width by its name, or a number of millimetres."""
    try:
        return given if given is None else float(given)
    except ValueError:
        return given


def export(
    run: RunArgument,
    solution: Annotated[
        str | None,
        typer.Option(
            help="knee, utopia, weighted, topsis, least_OBJECTIVE or a row; if not given, the knee or, in netcdf, all.",
            autocompletion=completion.solutions,
        ),
    ] = None,
    format: Annotated[
        str, typer.Option(help=f"{', '.join(NAMED_EXPORTERS.names())}.", autocompletion=completion.formats)
    ] = "csv",
    step: Annotated[
        float | None, typer.Option(help="Time between samples, or of a block [s]; the format's default if not given.")
    ] = None,
    angle: Annotated[str, typer.Option(help="Unit of angles: rad or deg.")] = "rad",
    out: Annotated[
        Path | None, typer.Option(help="File; SOLUTION.EXTENSION or front.nc beside the front if not given.")
    ] = None,
    problem: ProblemOption = None,
) -> None:
    """Write the motion of one solution for a controller or a spreadsheet, or the whole front for other programs."""
    exporter, front = NAMED_EXPORTERS.find(format), front_of(run, problem)
    if solution is None and exporter.holds == "motion":
        solution = "knee"
    target = out or beside(run, f"{solution or 'front'}.{exporter.ending}")
    source = front if solution is None else front.pick(solution)
    file = write(source, target, format=format, step=step, angle=angle)
    proof = f"trajevo certify {run} {'--all' if solution is None else f'--solution {solution}'}"
    _out.written(file, then=f"{proof} proves at every instant that limits are kept")


def animate_motion(
    run: RunArgument,
    solution: SolutionOption = "knee",
    rate: Annotated[float | None, typer.Option(help="Frames per second of a film, 25 if not given.")] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="HTML file, or film that ends in .gif or .mp4; SOLUTION.html beside the front if not given."),
    ] = None,
    problem: ProblemOption = None,
) -> None:
    """Write an animation of one solution in real time: one HTML file that needs no network, or a film."""
    chosen = front_of(run, problem).pick(solution)
    with Waiting("drawing", ["animation"]) as shown:
        shown.begin("animation")
        file = animate(chosen, out or beside(run, f"{solution}.html"), rate=rate)
    _out.written(file, then="open it in a browser")


def capacity(
    run: RunArgument,
    solution: SolutionOption = "knee",
    iterative: Annotated[
        bool, typer.Option("--iterative", help="Use the paper's iteration, not the closed form.")
    ] = False,
    step: Annotated[float, typer.Option(help="Payload added in each iteration [kg].")] = 0.05,
    dwell: Annotated[float, typer.Option(help="Time at rest after each motion, for drives [s].")] = 0.0,
    cycles: Annotated[
        int | None, typer.Option(help="How often the motion is made from cold on, for drives; for ever if not given.")
    ] = None,
    deviation: Annotated[
        float | None,
        typer.Option(help="Greatest deviation of the tool as joints give way [mm]; the problem's if not given."),
    ] = None,
    problem: ProblemOption = None,
) -> None:
    """Show the largest payload of a motion, which actuator limits it and when."""
    most = in_metres(deviation)
    chosen = front_of(run, problem).pick(solution)
    robot, by_drives = chosen.rollout.robot, None
    if robot.drives:
        by_drives = drive_capacity(chosen, dwell=dwell, cycles=cycles)
    elif dwell or cycles is not None:
        option = "--dwell" if dwell else "--cycles"
        raise InvalidInputError(f"{option}: expected a robot with drives, {robot.name!r} has none")
    found = dlcc_iterative(chosen, step=step) if iterative else dlcc(chosen)
    _out.print(f"{chosen.rule} (row {chosen.index}), time {chosen.F.get('time', float('nan')):.4f} s")
    _out.print(f"capacity: {found}")
    schedule = chosen.rollout.dynamics.schedule
    if schedule is not None:
        _out.print(f"this is the mass of payload {schedule.varied}, where it is carried; carried: {schedule}")
    print_mass_notes(_out, chosen.front.problem.robot)
    if by_drives is not None:
        _out.print(f"by its drives: {by_drives}")
    print_full_capacity(_out, chosen, most, dwell=dwell, cycles=cycles)
    if found.joint and found.feasible:
        _out.print(f"sensitivity: {sensitivity(chosen)}")
    table = Listing("joint", "alone it could carry [kg]", "effort limit left [%]")
    for name, alone, margin in zip(chosen.front.problem.robot.joint_names, found.per_joint, found.margin, strict=True):
        table.add(name, f"{alone:.6g}", f"{100.0 * margin:.2f}")
    _out.print(table)


def verify_motions(
    run: RunArgument,
    solution: SolutionOption = "knee",
    density: Annotated[int, typer.Option(help="Factor of the problem's number of samples.")] = 20,
    every: Annotated[bool, typer.Option("--all", help="Every solution of the front.")] = False,
    problem: ProblemOption = None,
) -> None:
    """Check a motion between its samples against every limit; exit code 1 if one is exceeded."""
    front = front_of(run, problem)
    if every:
        with Waiting("checking", ["all solutions"]) as shown:
            shown.begin("all solutions")
            found = verify_all(front, density=density)
    else:
        found = (verify(front.pick(solution), density=density),)
    print_verifications(_out, found)
    if not all(verification.passed for verification in found):
        raise typer.Exit(1)


def certificate(
    run: RunArgument,
    solution: SolutionOption = "knee",
    tolerance: Annotated[
        float, typer.Option(help="Share of a limit by which bounds may lie above the samples.")
    ] = 0.001,
    tool_speed: Annotated[
        float | None,
        typer.Option(help="Greatest speed of the tool [m/s]; the limit of the run's problem if not given."),
    ] = None,
    power: Annotated[float | None, typer.Option(help="Greatest mechanical power of every joint [W].")] = None,
    every: Annotated[bool, typer.Option("--all", help="Every solution of the front.")] = False,
    proof: Annotated[
        Path | None,
        typer.Option(help="Proof file to write, JSON, which `trajevo check-proof` checks; of one solution."),
    ] = None,
    problem: ProblemOption = None,
) -> None:
    """Prove that a motion keeps every limit at every instant; exit code 1 if one is broken or not decided."""
    if every and proof is not None:
        raise InvalidInputError("--proof: expected one solution, chosen by --solution, got --all")
    if proof is not None:
        try:
            check_writable(proof)
        except OSError as error:
            raise InvalidInputError(f"--proof: {proof}: cannot be written: {why_not(error)}") from error
    front = front_of(run, problem)
    if every:
        with Waiting("proving", ["all solutions"]) as shown:
            shown.begin("all solutions")
            found: Sequence[Certificate] = certify_all(front, tolerance=tolerance, tool_speed=tool_speed, power=power)
    else:
        found = [certify(front.pick(solution), tolerance=tolerance, tool_speed=tool_speed, power=power)]
        _out.print(_table(found[0]))
    for each in found:
        if not (every and each.proven):
            _out.print(str(each))
    if proof is not None:
        _out.written(found[0].write_proof(proof), then=f"trajevo check-proof {proof}")
    kept = sum(each.proven for each in found)
    if every:
        _out.print(f"{kept} of {len(found)} solutions are proven to keep every limit at every instant.")
    if kept < len(found):
        raise typer.Exit(1)


def explain(
    run: RunArgument,
    solution: SolutionOption = "knee",
    objective: Annotated[
        str | None, typer.Option(help="Objective that should be less; the first one if not given.")
    ] = None,
    relaxed: Annotated[float, typer.Option(help="Share by which a limit or another objective is relaxed.")] = 0.05,
    out: Annotated[Path | None, typer.Option(help="Picture; exchange_rates.png beside the front if not given.")] = None,
    pictures: PicturesOption = True,
    problem: ProblemOption = None,
) -> None:
    """Show what holds a solution back, what a little more of each limit would buy, and draw both along the front."""
    front = front_of(run, problem)
    chosen = front.pick(solution)
    rates = chosen.sensitivity(objective)
    rows = rates.table(relaxed)
    table = Listing(f"relaxed by {100.0 * relaxed:g} %", "in segments", f"change of {rates.objective}")
    for row in rows:
        table.add(*row)
    _out.print(f"{chosen.rule}: {rates.told}")
    if rows:
        _out.print(table)
    if rates.ends:
        _out.print(f"at an end of its range: {', '.join(rates.ends)}")
    if not rates.exchanges:
        _out.print("nothing holds it: it lies on no limit, and no other objective is against it")
    if pictures:
        target = out or beside(run, EXCHANGE_PICTURE)
        with Waiting("drawing", [target.name]) as shown:
            shown.begin(target.name)
            file = plots.save_figure(plots.exchange_rates(front.sensitivities(objective)).figure, target)
        _out.written(file, then=f"trajevo certify {run} proves the limits on which it lies")


def _table(certificate: Certificate) -> Listing:
    """Table of each quantity's row nearest to its limit, of all other rows not proven, and of what is not covered."""
    table = Listing("quantity", "nearest sample", "at [s]", "proven", "limit", "proven share [%]")
    for row in certificate.rows:
        if row not in certificate.by_quantity and row.proven:
            continue
        limited = bool(np.isfinite(row.limit))
        share = f"{100.0 * row.share:.3f}" if limited and not row.least else ""
        at = row.at.removesuffix(" s")
        cells = (row.name, row.shown(row.exhibited), at, row.bound_shown, row.limit_shown, share)
        table.add(*cells, style="bold red" if row.violated else "green" if limited else "")
    for one in certificate.uncovered:
        cells = (one.name, f"{100.0 * one.share:.3f} %" if one.samples else "", "", "not covered", "", "")
        table.add(*cells, style="bold red" if one.violated else "yellow")
    return table


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
    with Served(run, port=port, read=lambda: front_of(run, problem), problem=problem) as served:
        _out.print(f"{run} is at {served.address} until Ctrl-C")
        if browser:
            webbrowser.open(served.address)
        try:
            threading.Event().wait()
        except KeyboardInterrupt:
            _out.print("no longer served")
