"""The command ``trajevo solve``: a problem by name, or a task."""

from __future__ import annotations

import signal
import tomllib
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from trajevo.algorithms import ALGORITHMS, algorithm_settings
from trajevo.cli_files import PICTURES
from trajevo.errors import InvalidInputError, checked_name
from trajevo.export import is_exported
from trajevo.front import Front
from trajevo.nnc import needs_two_objectives, solve_nnc
from trajevo.optimise import optimise
from trajevo.payload import LOAD_MODELS
from trajevo.pictures import FIGURES, draw_all, save_pictures
from trajevo.problem import TrajectoryProblem
from trajevo.registry import load_problem
from trajevo.report import report as write_report
from trajevo.run_folder import FRONT_FILE, RunFolder
from trajevo.runs import resume as resume_run
from trajevo.task import load_task
from trajevo.terminal import print_run

REPORT_FILE, PLOTS_FOLDER = "report.html", "plots"

METHODS = ("evolution", "nnc")

_out = Console(soft_wrap=True, highlight=False)
_err = Console(soft_wrap=True, highlight=False, stderr=True)


def solve(
    problem: Annotated[str, typer.Argument(help="Name of a problem, see `trajevo list`, or a file task.toml.")],
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of all randomness; the task's, or 1.")] = None,
    generations: Annotated[int | None, typer.Option(min=1, help="Generations; the paper's if not given.")] = None,
    population: Annotated[int | None, typer.Option(min=4, help="Individuals; the paper's if not given.")] = None,
    offsprings: Annotated[
        int | None, typer.Option(min=1, help="New individuals per generation; as many as the population.")
    ] = None,
    algorithm: Annotated[str | None, typer.Option(help=f"nsga2 if not given, {', '.join(ALGORITHMS)}.")] = None,
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
        str | None, typer.Option(help="evolution, or nnc: normal constraints and SQP, for two objectives.")
    ] = None,
    tolerance: Annotated[
        float | None, typer.Option(min=1e-6, max=0.99, help="Least significant trade-off of nnc, 0.01.")
    ] = None,
    sqp_seeds: Annotated[
        int | None, typer.Option(min=2, help="Begin the evolution with as many points found by nnc.")
    ] = None,
    time_limit: Annotated[
        float | None, typer.Option(help="Time that evaluating one individual may take [s]; longer counts as failed.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for the results; runs/PROBLEM or runs/TASK if not given.")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the run that the folder holds.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress.")] = False,
) -> None:
    """Solve a problem or a task and write its front, pictures and report."""
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
    own = {"population": population, "offsprings": offsprings}
    search = {"--algorithm": algorithm, "--method": method, "--tolerance": tolerance, "--sqp-seeds": sqp_seeds}
    if Path(problem).suffix == ".toml":
        options = {f"--{key.replace('_', '-')}": value for key, value in given.items()}
        _refuse_task_options(options | search | {"--set": set_, "--offsprings": offsprings})
        task, folder = load_task(problem), out or Path("runs") / Path(problem).stem
        _claim(folder, overwrite)
        front = task.solve(
            seed=seed,
            generations=generations,
            population=population,
            time_limit=time_limit,
            out=folder,
            overwrite=overwrite,
            progress=not quiet,
        )
    else:
        arguments = _with_settings({key: value for key, value in given.items() if value is not None}, set_ or [])
        to_solve, folder = load_problem(problem, **arguments), out or Path("runs") / problem
        _refuse_together(search, own | {"generations": generations, "time-limit": time_limit}, to_solve)
        settings = algorithm_settings(algorithm or "nsga2", own, to_solve)
        _claim(folder, overwrite)
        seed = 1 if seed is None else seed
        if method == "nnc":
            _err.print("warning: the method nnc keeps no checkpoints: SIGINT keeps what was found, SIGKILL nothing")
            front = solve_nnc(to_solve, seed=seed, tolerance=0.01 if tolerance is None else tolerance)
            RunFolder(folder).clear()
            front.save(folder / FRONT_FILE)
        else:
            if sqp_seeds is not None:
                settings["initial"] = solve_nnc(to_solve, seed=seed, points=sqp_seeds)
            front = optimise(
                to_solve,
                seed=seed,
                generations=generations,
                time_limit=time_limit,
                out=folder,
                overwrite=overwrite,
                progress=not quiet,
                **settings,
            )
    _write(front, folder)


def resume(
    run: Annotated[Path, typer.Argument(help="Folder of a run that was interrupted or killed.")],
    generations: Annotated[int | None, typer.Option(min=1, help="Make the run longer, to so many generations.")] = None,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress.")] = False,
) -> None:
    """Go on with a run, as if it had never stopped, and write its front, pictures and report."""
    _write(resume_run(run, generations=generations, progress=not quiet), run)


def _write(front: Front, folder: Path) -> None:
    """Pictures and report of a run that has ended; of one that was interrupted what to do next, and exit."""
    if not (folder / FRONT_FILE).exists():
        raise typer.Exit(2)
    _clear_stale(folder)
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


def _refuse_together(search: dict[str, Any], own: dict[str, Any], to_solve: TrajectoryProblem) -> None:
    """Refuse settings that the method does not have, and methods for two objectives of a problem with others."""
    method = checked_name("method", search["--method"] or "evolution", METHODS)
    algorithm = search["--algorithm"] or "nsga2"
    evolution = {f"--{key}": value for key, value in own.items()} | {
        "--sqp-seeds": search["--sqp-seeds"],
        "--algorithm": None if algorithm == "nsga2" else algorithm,
    }
    _refuse_given(method, {"--tolerance": search["--tolerance"]} if method == "evolution" else evolution)
    if algorithm != "nsga2":
        _refuse_given(algorithm, {"--sqp-seeds": search["--sqp-seeds"]})
    if method == "nnc" or search["--sqp-seeds"] is not None:
        needs_two_objectives(to_solve)


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


def _refuse_task_options(options: dict[str, Any]) -> None:
    """Refuse what a task's file decides."""
    for name, value in options.items():
        if value is not None:
            raise InvalidInputError(f"{name}: a task says this in its file, options are --seed and sizes alone")


def _refuse_given(method: str, options: dict[str, Any]) -> None:
    """Refuse options that a method does not have."""
    for name, value in options.items():
        if value is not None:
            raise InvalidInputError(f"{name}: the method {method!r} has no such setting")


def _claim(folder: Path, overwrite: bool) -> None:
    """Make sure that results can be written, before hours are spent on them."""
    run = RunFolder(folder)
    if run.holds_run and not overwrite:
        go_on = f", or go on with it: trajevo resume {folder}" if run.begun else ""
        raise InvalidInputError(f"{folder} already holds a run; choose another --out or add --overwrite{go_on}")
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
    told = (folder / name for name in PICTURES)
    exported = (file for file in folder.glob("*.*") if is_exported(file))
    for file in (folder / REPORT_FILE, *pictures, *told, *exported):
        file.unlink(missing_ok=True)
