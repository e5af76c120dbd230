"""The command ``trajevo solve``: a problem by name, or a task."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from trajevo.cli.results import PLOTS_FOLDER, PicturesOption, ReportOption, RunArgument, front_of, write_results
from trajevo.errors import InvalidInputError, checked_name
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.formulation.registry import load_problem
from trajevo.robot.payload import LOAD_MODELS
from trajevo.solvers.evolutionary.algorithms import ALGORITHMS, algorithm_settings
from trajevo.solvers.evolutionary.first_population import DEFAULT_STARTS, STARTS
from trajevo.solvers.gradient.normal_constraint import needs_two_objectives, solve_nnc
from trajevo.solvers.gradient.polish import Polished, polish
from trajevo.solvers.optimise import load_task, optimise
from trajevo.solvers.run.folder import FRONT_FILE, RunFolder
from trajevo.solvers.run.runs import resume as resume_run

METHODS = ("evolution", "nnc")
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
    limits: Annotated[
        str | None, typer.Option(help="How limits hold: sampled or certified; along a path tight, hull or certified.")
    ] = None,
    encoding: Annotated[str | None, typer.Option(help="What a path's decision variables are: plain or shape.")] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", help="Another argument of the problem, KEY=VALUE, as velocity='150 mm/s'; repeatable."),
    ] = None,
    starts: Annotated[
        str | None, typer.Option(help=f"The first population, random if not given: {', '.join(STARTS)}.")
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
    evaluations: Annotated[
        int | None, typer.Option(min=1, help="Individuals that the run may evaluate, half of them for polishing.")
    ] = None,
    cpu_time: Annotated[
        float | None, typer.Option(help="CPU time that the run may take, half of it for polishing [s].")
    ] = None,
    polish: Annotated[
        bool | None,
        typer.Option(
            "--polish/--no-polish", help="Refine the front by gradients at the end; where possible if not said."
        ),
    ] = None,
    polish_every: Annotated[
        int | None, typer.Option(min=1, help="Refine some members after every so many generations too.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for the results; runs/PROBLEM or runs/TASK if not given.")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the run that the folder holds.")] = False,
    report: ReportOption = "short",
    pictures: PicturesOption = True,
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
    of_run: dict[str, Any] = {
        "starts": starts,
        "evaluations": evaluations,
        "cpu_time": cpu_time,
        "polish": polish,
        "polish_every": polish_every,
    }
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
            **of_run,
        )
    else:
        arguments = _with_settings({key: value for key, value in given.items() if value is not None}, set_ or [])
        to_solve, folder = load_problem(problem, **arguments), out or Path("runs") / problem
        checked_name("starts", starts or DEFAULT_STARTS, STARTS)
        _refuse_together(search, own | of_run | {"generations": generations, "time_limit": time_limit}, to_solve)
        settings = algorithm_settings(algorithm or "nsga2", own | of_run, to_solve)
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
    write_results(front, folder, kind=report, pictures=pictures)


def resume(
    run: Annotated[Path, typer.Argument(help="Folder of a run that was interrupted or killed.")],
    generations: Annotated[int | None, typer.Option(min=1, help="Make the run longer, to so many generations.")] = None,
    report: ReportOption = "short",
    pictures: PicturesOption = True,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress.")] = False,
) -> None:
    """Go on with a run, as if it had never stopped, and write its front, pictures and report."""
    front = resume_run(run, generations=generations, progress=not quiet)
    write_results(front, run, kind=report, pictures=pictures)


def _refuse_together(search: dict[str, Any], own: dict[str, Any], to_solve: TrajectoryProblem) -> None:
    """Refuse settings that the method does not have, and methods for two objectives of a problem with others."""
    method = checked_name("method", search["--method"] or "evolution", METHODS)
    algorithm = search["--algorithm"] or "nsga2"
    evolution = {f"--{key.replace('_', '-')}": value for key, value in own.items()} | {
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


_out = Console(soft_wrap=True, highlight=False)


def polish_run(
    run: RunArgument,
    members: Annotated[int, typer.Option(help="Members that are refined in every round.")] = 10,
    rounds: Annotated[int, typer.Option(help="Rounds of refining members and filling gaps.")] = 2,
    seed: Annotated[int | None, typer.Option(help="Seed of all randomness; the run's own if not given.")] = None,
    cpu_time: Annotated[float | None, typer.Option(help="CPU time after which no step is begun [s].")] = None,
    out: Annotated[Path | None, typer.Option(help="File for the polished front; the run then stays as it is.")] = None,
    report: ReportOption = "short",
    pictures: PicturesOption = True,
) -> None:
    """Refine a run's front by gradients; the front as it was stays beside it, in evolved.json."""
    front, own = front_of(run), run / FRONT_FILE if run.is_dir() else run
    if not run.is_dir() and out is None:
        raise InvalidInputError(f"out: {run} is a front's file, not a run's folder; say where the polished front goes")
    if out is not None and out.resolve() == own.resolve():
        raise InvalidInputError(f"out: {out} is the front itself, which is kept; choose another file")
    found = polish(front, members=members, rounds=rounds, seed=seed, cpu_time=cpu_time)
    _out.print(_table(found))
    _out.print(f"polished: {found}")
    if out is not None:
        found.front.save(out)
        _out.print(f"written: {out}")
        return
    folder = RunFolder(run)
    with folder.alone():
        if not folder.evolved_file.exists():
            found.original.save(folder.evolved_file)
        found.front.save(own)
    write_results(found.front, run, kind=report, pictures=pictures)


def _table(found: Polished) -> Table:
    """The least of every objective before and after."""
    table = Table("least", "before", "after", "unit", box=SIMPLE)
    before, after = found.original.F.min(axis=0), found.front.F.min(axis=0)
    for objective, was, now in zip(found.front.record.objectives, before, after, strict=True):
        table.add_row(objective.name, f"{was:.6g}", f"{now:.6g}", objective.unit)
    return table
