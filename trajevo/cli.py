"""The command ``trajevo``: list, solve, show, report, export, animate, capacity, verify."""

from __future__ import annotations

import io
import sys
import tomllib
from pathlib import Path
from typing import Annotated, Any

import matplotlib as mpl
import typer
from pymoo.algorithms.moo.sms import SMSEMOA
from pymoo.algorithms.moo.spea2 import SPEA2
from pymoo.core.algorithm import Algorithm
from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from trajevo.animation import animate
from trajevo.capacity import dlcc, dlcc_iterative
from trajevo.errors import InvalidInputError, TrajevoError, checked_name
from trajevo.export import FORMATS, is_exported
from trajevo.export import export as write_motion
from trajevo.front import Front
from trajevo.nnc import needs_two_objectives, solve_nnc
from trajevo.optimise import optimise
from trajevo.payload import LOAD_MODELS
from trajevo.registry import load_problem
from trajevo.report import FIGURES, save_figures
from trajevo.report import report as write_report
from trajevo.terminal import print_list, print_run, print_verifications
from trajevo.verify import verify, verify_all

FRONT_FILE, REPORT_FILE, PLOTS_FOLDER = "front.json", "report.html", "plots"

METHODS = ("evolution", "nnc")

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
    print_list(_out)


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
    path: Annotated[str | None, typer.Option(help="Path to run along: a name, or a CSV file of points.")] = None,
    limits: Annotated[str | None, typer.Option(help="How limits along a path are bounded: tight or hull.")] = None,
    encoding: Annotated[str | None, typer.Option(help="What a path's decision variables are: plain or shape.")] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", help="Another argument of the problem, KEY=VALUE, as velocity='150 mm/s'; repeatable."),
    ] = None,
    method: Annotated[
        str, typer.Option(help="evolution, or nnc: normal constraints and SQP, for two objectives.")
    ] = "evolution",
    tolerance: Annotated[
        float | None, typer.Option(min=1e-6, max=0.99, help="Least significant trade-off of nnc, 0.01.")
    ] = None,
    sqp_seeds: Annotated[
        int | None, typer.Option(min=2, help="Begin the evolution with as many points found by nnc.")
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
        "path": path,
        "limits": limits,
        "encoding": encoding,
    }
    arguments = _with_settings({key: value for key, value in given.items() if value is not None}, set_ or [])
    to_solve = load_problem(problem, **arguments)
    folder = out or Path("runs") / problem
    checked_name("method", method, METHODS)
    evolution = {
        "--generations": generations,
        "--population": population,
        "--offsprings": offsprings,
        "--sqp-seeds": sqp_seeds,
        "--algorithm": None if algorithm == "nsga2" else algorithm,
    }
    _refuse_given(method, {"--tolerance": tolerance} if method == "evolution" else evolution)
    if algorithm != "nsga2":
        _refuse_given(algorithm, {"--sqp-seeds": sqp_seeds})
    if method == "nnc" or sqp_seeds is not None:
        needs_two_objectives(to_solve)
    settings = _algorithm_settings(algorithm, population, offsprings, to_solve.evolution.population)
    _claim(folder, overwrite)
    if method == "nnc":
        front = solve_nnc(to_solve, seed=seed, tolerance=0.01 if tolerance is None else tolerance)
    else:
        if sqp_seeds is not None:
            settings["initial"] = solve_nnc(to_solve, seed=seed, points=sqp_seeds)
        front = optimise(to_solve, seed=seed, generations=generations, progress=not quiet, **settings)
    front.save(folder / FRONT_FILE)
    _clear_stale(folder)
    print_run(_out, front, None)
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
    print_run(_out, Front.load(_front_file(run)), angle)


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
    format: Annotated[str, typer.Option(help=f"{', '.join(FORMATS)}.")] = "csv",
    step: Annotated[float, typer.Option(help="Time between samples, or of a block [s].")] = 0.01,
    angle: Annotated[str, typer.Option(help="Unit of angles: rad or deg.")] = "rad",
    out: Annotated[Path | None, typer.Option(help="File; SOLUTION.FORMAT beside the front if not given.")] = None,
) -> None:
    """Write the motion of one solution for a controller or a spreadsheet."""
    file = _front_file(run)
    chosen = Front.load(file).pick(solution)
    checked_name("export format", format, FORMATS)
    target = out or file.with_name(f"{solution}.{format}")
    _out.print(f"written: {write_motion(chosen, target, format=format, step=step, angle=angle)}")


@app.command("animate")
def animate_motion(
    run: _RunArgument,
    solution: Annotated[str, typer.Option(help="knee, utopia, weighted, least_OBJECTIVE or a row.")] = "knee",
    rate: Annotated[float, typer.Option(help="Frames per second.")] = 25.0,
    out: Annotated[Path | None, typer.Option(help="HTML file; SOLUTION.html beside the front if not given.")] = None,
) -> None:
    """Write the robot along one solution in real time, one HTML file that needs no network."""
    file = _front_file(run)
    chosen = Front.load(file).pick(solution)
    _out.print(f"written: {animate(chosen, out or file.with_name(f'{solution}.html'), rate=rate)}")


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


@app.command("verify")
def verify_motions(
    run: _RunArgument,
    solution: Annotated[str, typer.Option(help="knee, utopia, weighted, least_OBJECTIVE or a row.")] = "knee",
    density: Annotated[int, typer.Option(help="Samples over those of the problem.")] = 20,
    every: Annotated[bool, typer.Option("--all", help="Every solution of the front.")] = False,
) -> None:
    """Check a motion between its samples against every limit; exit code 1 if one is exceeded."""
    front = Front.load(_front_file(run))
    found = verify_all(front, density=density) if every else (verify(front.pick(solution), density=density),)
    print_verifications(_out, found)
    if not all(verification.passed for verification in found):
        raise typer.Exit(1)


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


def _with_settings(arguments: dict[str, Any], pairs: list[str]) -> dict[str, Any]:
    """Arguments with ``KEY=VALUE`` pairs added; a value is read as TOML where it is that, else as text."""
    for pair in pairs:
        key, sign, text = pair.partition("=")
        key = key.strip()
        if not sign or not key.isidentifier():
            raise InvalidInputError(f"--set: expected KEY=VALUE, got {pair!r}")
        if key in arguments:
            raise InvalidInputError(f"--set: {key!r} is given twice")
        try:
            arguments[key] = tomllib.loads(f"value = {text}")["value"]
        except tomllib.TOMLDecodeError:
            arguments[key] = text
    return arguments


def _refuse_given(method: str, options: dict[str, Any]) -> None:
    """Refuse options that a method does not have."""
    for name, value in options.items():
        if value is not None:
            raise InvalidInputError(f"{name}: the method {method!r} has no such setting")


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
