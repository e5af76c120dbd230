"""The command ``trajevo solve``: a problem by name, or a task."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, final

import numpy as np
import typer

from trajevo.base.files import own_folder, why_not
from trajevo.base.own.code import in_module, looking_in
from trajevo.base.units import pretty
from trajevo.cli import completion
from trajevo.cli.console import Terminal
from trajevo.cli.problem_options import (
    ProblemArgument,
    ProblemOption,
    chosen_problem,
    flag,
    problem_of_run,
    problem_options,
)
from trajevo.cli.results import (
    NO_SOLUTION,
    PLOTS_FOLDER,
    ReportOption,
    RunArgument,
    RunPicturesOption,
    VerboseOption,
    draws,
    front_of,
    reading,
    write_results,
)
from trajevo.cli.screen.tables import Listing
from trajevo.cli.search_options import search_options
from trajevo.errors import InvalidInputError, checked_name
from trajevo.formulation.examples import is_task
from trajevo.formulation.feasibility.check import Feasibility, check
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.front.front import Front
from trajevo.solvers.evolutionary.algorithms import algorithm_for
from trajevo.solvers.gradient.polish import Polished, polish
from trajevo.solvers.optimise import decided, optimise
from trajevo.solvers.run.folder import FRONT_FILE, RunFolder
from trajevo.solvers.run.runs import resume as resume_run

METHODS = ("evolution", "nnc")
_err = Terminal(stderr=True)


@search_options
@problem_options
def solve(
    *,
    problem: ProblemArgument,
    method: Annotated[
        str | None, typer.Option(help="evolution, or nnc: normal constraints and SQP, for two objectives.")
    ] = None,
    tolerance: Annotated[
        float | None, typer.Option(min=1e-6, max=0.99, help="Least significant trade-off of nnc; 0.01 if not given.")
    ] = None,
    sqp_seeds: Annotated[
        int | None, typer.Option(min=2, help="Number of points found by nnc with which the evolution begins.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for the results; runs/PROBLEM or runs/TASK if not given.")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the run that the folder holds.")] = False,
    report: ReportOption = "short",
    pictures: RunPicturesOption = None,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress.")] = False,
    verbose: VerboseOption = False,
    options: dict[str, Any],
    search: dict[str, Any],
) -> None:
    """Solve a problem or a task and write its front and report."""
    how = _Method(method, tolerance, sqp_seeds)
    to_solve, own = chosen_problem(problem, options, others=how.given)
    settings = own.updated(**search)
    folder = out or Path("runs") / _name(problem)
    how.check(search, to_solve)
    algorithm_for(decided(settings, to_solve), to_solve)  # refuses invalid settings before the folder is touched
    _tell(check(to_solve), quiet=quiet)
    _claim(folder, overwrite, pictures=draws(pictures, report))
    seed = settings.seed or 0
    if how.name == "nnc":
        _err.print("warning: the method nnc keeps no checkpoints: SIGINT keeps what was found, SIGKILL nothing")
        front = _nnc(to_solve, seed=seed, tolerance=0.01 if tolerance is None else tolerance)
        RunFolder(folder).clear()
        front.save(folder / FRONT_FILE)
    else:
        initial = None if sqp_seeds is None else _nnc(to_solve, seed=seed, points=sqp_seeds)
        front = optimise(to_solve, settings, initial=initial, out=folder, overwrite=overwrite, progress=not quiet)
    given = problem if in_module(problem) or is_task(problem) else None
    write_results(front, folder, kind=report, pictures=pictures, quiet=quiet, verbose=verbose, problem=given)


def _nnc(problem: TrajectoryProblem, **settings: Any) -> Front:
    """The front by normal constraints, which are imported when they are asked for."""
    from trajevo.solvers.gradient.normal_constraint import solve_nnc

    return solve_nnc(problem, **settings)


def _name(problem: str) -> str:
    """Name of a problem's folder in ``runs``."""
    if in_module(problem):
        return problem.replace(":", ".")
    return Path(problem).stem if is_task(problem) else problem


@final
@dataclass(frozen=True)
class _Method:
    """Method that finds the front, with its options from the command line."""

    method: str | None
    tolerance: float | None
    sqp_seeds: int | None

    @property
    def name(self) -> str:
        """The method."""
        return checked_name("method", self.method or "evolution", METHODS)

    @property
    def given(self) -> dict[str, Any]:
        """The given options by name."""
        return {name: value for name, value in vars(self).items() if value is not None}

    def check(self, search: dict[str, Any], problem: TrajectoryProblem) -> None:
        """Refuse settings that the method does not have, and any use of nnc for problems without two objectives."""
        if self.name == "nnc":
            others = [name for name in search if name != "seed" and (name, search[name]) != ("algorithm", "nsga2")]
            _refuse_given("nnc", others + ([] if self.sqp_seeds is None else ["sqp_seeds"]))
        elif self.tolerance is not None:
            _refuse_given("evolution", ["tolerance"])
        algorithm = search.get("algorithm", "nsga2")
        if algorithm != "nsga2" and self.sqp_seeds is not None:
            _refuse_given(algorithm, ["sqp_seeds"])
        if self.name == "nnc" or self.sqp_seeds is not None:
            from trajevo.solvers.gradient.normal_constraint import needs_two_objectives

            needs_two_objectives(problem)


def resume(
    run: Annotated[
        Path,
        typer.Argument(help="Folder of a run that was interrupted or killed.", autocompletion=completion.runs),
    ],
    generations: Annotated[
        int | None, typer.Option(min=1, help="Extend the run to this number of generations.")
    ] = None,
    report: ReportOption = "short",
    pictures: RunPicturesOption = None,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress.")] = False,
    verbose: VerboseOption = False,
    problem: ProblemOption = None,
) -> None:
    """Continue a run as if it had never stopped, and write its front and report."""
    with reading(run), looking_in("."):
        given = problem_of_run(problem)
        front = resume_run(run, problem=given, generations=generations, progress=not quiet)
    write_results(front, run, kind=report, pictures=pictures, quiet=quiet, verbose=verbose, problem=problem)


def _tell(found: Feasibility, *, quiet: bool) -> None:
    """Print what was found before the search; exit if no motion is possible, since a search would only take time."""
    for finding in found.impossible if quiet else found.findings:
        _err.print(f"{finding.severity}: {finding}")
    for note in found.notes:
        _err.print(f"note: {note}")
    if found.impossible:
        _err.print(f"nothing was searched: {found.verdict}")
        raise typer.Exit(NO_SOLUTION)


def _refuse_given(method: str, names: list[str]) -> None:
    """Refuse options that a method does not have."""
    for name in names:
        raise InvalidInputError(f"{flag(name)}: the method {method!r} has no such setting")


def _claim(folder: Path, overwrite: bool, *, pictures: bool) -> None:
    """Make sure that results can be written before hours are spent on them."""
    run = RunFolder(folder)
    if run.holds_run and not overwrite:
        go_on = f", or go on with it: trajevo resume {folder}" if run.begun else ""
        raise InvalidInputError(f"{folder} already holds a run; choose another --out or add --overwrite{go_on}")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for place in (folder, *([own_folder(folder / PLOTS_FOLDER)] if pictures else [])):
            tempfile.TemporaryFile(dir=place).close()
    except OSError as error:
        raise InvalidInputError(f"{folder}: the output folder cannot be written: {why_not(error)}") from error


_out = Terminal()


def polish_run(
    run: RunArgument,
    members: Annotated[int, typer.Option(help="Members refined in every round.")] = 10,
    rounds: Annotated[int, typer.Option(help="Rounds of refining members and filling gaps.")] = 2,
    seed: Annotated[int | None, typer.Option(help="Seed of all randomness; the run's own if not given.")] = None,
    cpu_time: Annotated[float | None, typer.Option(help="CPU time after which no step is started [s].")] = None,
    out: Annotated[Path | None, typer.Option(help="File for the polished front; the run then stays as it is.")] = None,
    report: ReportOption = "short",
    pictures: RunPicturesOption = None,
    problem: ProblemOption = None,
) -> None:
    """Refine a run's front by gradients; the original front is kept beside it in evolved.json."""
    front, own = front_of(run, problem), run / FRONT_FILE if run.is_dir() else run
    if not run.is_dir() and out is None:
        raise InvalidInputError(f"out: {run} is a front's file, not a run's folder; say where the polished front goes")
    if out is not None and out.resolve() == own.resolve():
        raise InvalidInputError(f"out: {out} is the front itself, which is kept; choose another file")
    found = polish(front, members=members, rounds=rounds, seed=seed, cpu_time=cpu_time)
    _out.print(_table(found))
    _out.print(f"polished: {found}")
    if out is not None:
        found.front.save(out)
        _out.written(out, then=f"trajevo show {out}")
        return
    folder = RunFolder(run)
    with folder.alone():
        if not folder.evolved_file.exists():
            found.original.save(folder.evolved_file)
        found.front.save(own)
    write_results(found.front, run, kind=report, pictures=pictures, problem=problem)


def _table(found: Polished) -> Listing:
    """Table of the least value of every objective before and after."""
    table = Listing("least", "before", "after", "unit")
    before, after = found.original.F.min(axis=0), found.front.F.min(axis=0)
    for objective, was, now in zip(found.front.record.objectives, before, after, strict=True):
        table.add(objective.name, f"{was:.6g}", f"{now:.6g}", pretty(objective.unit))
    return table


def weigh(
    run: RunArgument,
    weights: Annotated[list[float], typer.Argument(help="One weight for each objective, in their order.")],
    problem: ProblemOption = None,
) -> None:
    """Solve again for one trade-off: minimise a weighted sum of the objectives, and keep the optimum in the front."""
    if not run.is_dir():
        raise InvalidInputError(f"run: expected the folder of a run, got {run}")
    front = front_of(run, problem)
    folder = RunFolder(run)
    with folder.alone():
        from trajevo.solvers.gradient.weighing import solve_weighted

        found, optimum = solve_weighted(front, weights)
        if not np.isfinite(optimum.cost):
            _out.print("no start ended at a motion within its limits; the front stays as it is")
            return
        values = ", ".join(f"{name} {value:.6g}" for name, value in optimum.F.items())
        if found is front:
            _out.print(f"the front stays as it is: it has a solution that is as good as the optimum, {values}")
            return
        if not folder.evolved_file.exists():
            front.save(folder.evolved_file)
        found.save(run / FRONT_FILE)
    _out.print(f"new: {values} (SI); the front has {len(found)} solutions")
    _out.written(run / FRONT_FILE, then=f"trajevo report {run}")
