"""The command ``trajevo``: list, solve, show, report, export, capacity."""

from __future__ import annotations

import io
import sys
from pathlib import Path
from typing import Annotated, Any

import matplotlib as mpl
import numpy as np
import typer
from pymoo.algorithms.moo.sms import SMSEMOA
from pymoo.algorithms.moo.spea2 import SPEA2
from pymoo.core.algorithm import Algorithm
from rich.box import SIMPLE
from rich.console import Console
from rich.markup import escape
from rich.table import Column, Table

from trajevo.capacity import dlcc, dlcc_iterative
from trajevo.errors import InvalidInputError, TrajevoError, checked_name
from trajevo.export import FORMATS, is_exported
from trajevo.export import export as write_motion
from trajevo.front import Front
from trajevo.optimise import optimise
from trajevo.payload import LOAD_MODELS
from trajevo.registry import list_problems, load_problem, problem_class
from trajevo.report import FIGURES, choices, objective_headers, run_facts, save_figures
from trajevo.report import report as write_report
from trajevo.robot import list_robots, load_robot

FRONT_FILE, REPORT_FILE, PLOTS_FOLDER = "front.json", "report.html", "plots"

#: Algorithms besides the default that need nothing but a population size.
ALGORITHMS = {"sms-emoa": SMSEMOA, "spea2": SPEA2}

app = typer.Typer(
    help="Multi-objective trajectory optimisation and payload capacity for robots.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=False,
)
_out = Console(soft_wrap=True, highlight=False)

_RunArgument = Annotated[Path, typer.Argument(help="Folder that `trajevo solve` wrote, or a front's file.")]
_Angle = Annotated[str | None, typer.Option(help="Unit of angles: rad or deg; as the problem has it if not given.")]


@app.command("list")
def list_everything() -> None:
    """List the problems and the robots at hand."""
    problems = Table(
        "problem", "title", Column("registered as", overflow="fold"), title="Problems", title_justify="left"
    )
    for name, point in list_problems().items():
        try:
            title = problem_class(name).title
        except InvalidInputError as error:
            title = escape(f"cannot be used: {error}")
        problems.add_row(name, title, point.value)
    robots = Table("robot", "dof", "limits", "not limited", title="Robots", title_justify="left")
    for name in list_robots():
        robot = load_robot(name)
        limits = {
            "position": np.concatenate([robot.limits.lower, robot.limits.upper]),
            **{kind: getattr(robot.limits, kind) for kind in ("velocity", "acceleration", "jerk", "effort")},
        }
        given = [kind for kind, values in limits.items() if np.isfinite(values).all()]
        missing = [kind for kind in limits if kind not in given]
        robots.add_row(name, str(robot.dof), ", ".join(given), ", ".join(missing))
    _out.print(problems)
    _out.print(robots)


@app.command()
def solve(
    problem: Annotated[str, typer.Argument(help="Name of a problem, see `trajevo list`.")],
    seed: Annotated[int, typer.Option(min=0, help="Seed of all randomness.")] = 1,
    generations: Annotated[int | None, typer.Option(min=1, help="Generations; the paper's if not given.")] = None,
    population: Annotated[int | None, typer.Option(min=4, help="Individuals; the paper's if not given.")] = None,
    offsprings: Annotated[
        int | None, typer.Option(min=1, help="New individuals per generation; as many as the population.")
    ] = None,
    algorithm: Annotated[str, typer.Option(help=f"nsga2, {', '.join(ALGORITHMS)}.")] = "nsga2",
    interpolant: Annotated[str | None, typer.Option(help="Interpolant; the problem's default if not given.")] = None,
    payload: Annotated[float | None, typer.Option(help="Payload [kg].")] = None,
    payload_model: Annotated[str | None, typer.Option(help=f"How it acts: {', '.join(LOAD_MODELS)}.")] = None,
    convention: Annotated[str | None, typer.Option(help="Which of several definitions of the objectives.")] = None,
    points: Annotated[
        Path | None, typer.Option(help="CSV file of the points to visit; the problem's own if not given.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for the results; runs/PROBLEM if not given.")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the run that the folder holds.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress.")] = False,
) -> None:
    """Solve a problem and write its front, pictures and report."""
    given: dict[str, Any] = {
        "interpolant": interpolant,
        "payload": payload,
        "payload_model": payload_model,
        "convention": convention,
        "points": points,
    }
    to_solve = load_problem(problem, **{key: value for key, value in given.items() if value is not None})
    folder = out or Path("runs") / problem
    settings = _algorithm_settings(algorithm, population, offsprings, to_solve.evolution.population)
    _claim(folder, overwrite)
    front = optimise(to_solve, seed=seed, generations=generations, progress=not quiet, **settings)
    front.save(folder / FRONT_FILE)
    _clear_stale(folder)
    _print_run(front, None)
    pictures = save_figures(front, folder / PLOTS_FOLDER)
    write_report(front, folder / REPORT_FILE)
    _out.print(
        f"written: {folder / FRONT_FILE}, {folder / REPORT_FILE}, {len(pictures)} pictures in {folder / PLOTS_FOLDER}"
    )
    if front.run.interrupted:
        raise typer.Exit(130)


@app.command()
def show(run: _RunArgument, angle: _Angle = None) -> None:
    """Show a run in the terminal."""
    _print_run(Front.load(_front_file(run)), angle)


@app.command()
def report(
    run: _RunArgument,
    out: Annotated[Path | None, typer.Option(help="HTML file; report.html beside the front if not given.")] = None,
) -> None:
    """Write a run's report, one HTML file that needs no network."""
    file = _front_file(run)
    _out.print(f"written: {write_report(Front.load(file), out or file.with_name(REPORT_FILE))}")


@app.command()
def export(
    run: _RunArgument,
    solution: Annotated[str, typer.Option(help="knee, utopia, weighted, least_OBJECTIVE or a row.")] = "knee",
    format: Annotated[str, typer.Option(help="csv or json.")] = "csv",
    step: Annotated[float, typer.Option(help="Time between samples [s].")] = 0.01,
    angle: Annotated[str, typer.Option(help="Unit of angles: rad or deg.")] = "rad",
    out: Annotated[Path | None, typer.Option(help="File; SOLUTION.FORMAT beside the front if not given.")] = None,
) -> None:
    """Write the motion of one solution for a controller or a spreadsheet."""
    file = _front_file(run)
    chosen = Front.load(file).pick(solution)
    checked_name("export format", format, FORMATS)
    target = out or file.with_name(f"{solution}.{format}")
    _out.print(f"written: {write_motion(chosen, target, format=format, step=step, angle=angle)}")


@app.command()
def capacity(
    run: _RunArgument,
    solution: Annotated[str, typer.Option(help="knee, utopia, weighted, least_OBJECTIVE or a row.")] = "knee",
    iterative: Annotated[
        bool, typer.Option("--iterative", help="By the paper's iteration, not in closed form.")
    ] = False,
    step: Annotated[float, typer.Option(help="Payload added at each iteration [kg].")] = 0.05,
) -> None:
    """Tell what a motion can carry, which actuator limits it and when."""
    file = _front_file(run)
    chosen = Front.load(file).pick(solution)
    found = dlcc_iterative(chosen, step=step) if iterative else dlcc(chosen)
    _out.print(f"{chosen.rule} (row {chosen.index}), time {chosen.F.get('time', float('nan')):.4f} s")
    _out.print(f"capacity: {found}")
    table = Table("joint", "alone it could carry [kg]", "effort limit left", box=SIMPLE)
    for name, alone, margin in zip(chosen.front.problem.robot.joint_names, found.per_joint, found.margin, strict=True):
        table.add_row(name, f"{alone:.6g}", f"{100.0 * margin:.2f} %")
    _out.print(table)


def main() -> None:
    """Entry point: one sentence and exit code 2 for bad input."""
    mpl.use("Agg")
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    try:
        app()
    except TrajevoError as error:
        Console(stderr=True, soft_wrap=True, highlight=False).print(f"error: {error}", markup=False)
        sys.exit(2)


def _algorithm_settings(name: str, population: int | None, offsprings: int | None, usual: int) -> dict[str, Any]:
    """Arguments of :func:`optimise` for an algorithm by name."""
    if name == "nsga2":
        return {"population": population, "offsprings": offsprings}
    checked_name("algorithm", name, ["nsga2", *ALGORITHMS])
    size = population or usual
    solver: Algorithm = ALGORITHMS[name](pop_size=size, n_offsprings=offsprings or size)
    return {"algorithm": solver}


def _claim(folder: Path, overwrite: bool) -> None:
    """Make sure that results can be written, before hours are spent on them."""
    if (folder / FRONT_FILE).exists() and not overwrite:
        raise InvalidInputError(f"{folder} already holds a run; choose another --out or add --overwrite")
    try:
        (folder / PLOTS_FOLDER).mkdir(parents=True, exist_ok=True)
        for place in (folder, folder / PLOTS_FOLDER):
            probe = place / ".writable"
            probe.touch()
            probe.unlink()
    except OSError as error:
        raise InvalidInputError(f"{folder}: the output folder cannot be written: {error.strerror}") from error


def _clear_stale(folder: Path) -> None:
    """Remove what an earlier run left beside the new front: report, pictures, exported solutions; no other file."""
    pictures = (folder / PLOTS_FOLDER / f"{stem}.png" for stem in FIGURES)
    exported = (file for file in folder.glob("*.*") if is_exported(file))
    for file in (folder / REPORT_FILE, *pictures, *exported):
        file.unlink(missing_ok=True)


def _front_file(run: Path) -> Path:
    return run / FRONT_FILE if run.is_dir() else run


def _print_run(front: Front, angle: str | None) -> None:
    facts = Table.grid(padding=(0, 2))
    for label, text in run_facts(front):
        facts.add_row(label, escape(text))
    _out.print(facts)
    if not len(front):
        _out.print(f"The front is empty: {front.blocking}.")
        return
    headers = objective_headers(front, angle=angle)
    table = Table(Column("solution", no_wrap=True), box=SIMPLE, pad_edge=False, padding=(0, 1, 0, 0))
    for header, _ in headers:
        table.add_column(escape(header), min_width=max(map(len, header.split())))
    table.add_column("closest limit", no_wrap=True)
    for solution in choices(front):
        values = [f"{value * factor:.5g}" for value, (_, factor) in zip(solution.F.values(), headers, strict=True)]
        closest = max(solution.G, key=lambda name: solution.G[name], default="")
        share = f"{100.0 * (1.0 + solution.G[closest]):.1f} % {closest}" if closest else "none"
        table.add_row(solution.rule, *values, share)
    _out.print(table)
