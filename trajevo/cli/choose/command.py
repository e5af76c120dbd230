"""``trajevo choose-robot``: one task for several robots, and which of them is worth having."""

from __future__ import annotations

import signal
from pathlib import Path
from typing import Annotated, Any

import typer

from trajevo.base.own.code import looking_in
from trajevo.base.units import pretty
from trajevo.cli import completion
from trajevo.cli.console import Terminal
from trajevo.cli.results import NO_SOLUTION
from trajevo.cli.screen.tables import Listing
from trajevo.cli.search_options import search_options
from trajevo.cli.study import engine_of
from trajevo.errors import InvalidInputError
from trajevo.formulation.examples import example_file
from trajevo.study.engines import START_METHODS
from trajevo.study.robots.ability import abilities
from trajevo.study.robots.asked import asked_of
from trajevo.study.robots.choice import TOLD, RobotChoice
from trajevo.study.robots.choose import choose_robot

_out = Terminal()

#: Exit code where the run of a robot failed.
_FAILED = 1


@search_options
def choose(
    *,
    task: Annotated[
        str, typer.Argument(help="File of a task, or name in `trajevo examples`.", autocompletion=completion.problems)
    ],
    robots: Annotated[
        str | None,
        typer.Option(
            help="In place of the task's: names or files with commas between them, or the path of a catalogue; a name "
            "that the task gives one of its own robots means that one."
        ),
    ] = None,
    only_check: Annotated[
        bool, typer.Option("--only-check", help="Tell who can do the task and what stops the others; search nothing.")
    ] = False,
    out: Annotated[Path | None, typer.Option(help="Folder of the study; runs/TASK if not given.")] = None,
    within: Annotated[
        float | None, typer.Option(help="Longest time of the largest payloads; what the task allows if not given [s].")
    ] = None,
    payload: Annotated[bool, typer.Option("--payload/--no-payload", help="Find each robot's largest payload.")] = True,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Robots at a time, each in a process; with --dask all cores if not given.")
    ] = None,
    start_method: Annotated[
        str | None, typer.Option(help=f"How processes are started: {', '.join(START_METHODS)}.")
    ] = None,
    dask: Annotated[bool, typer.Option("--dask", help="On a Dask cluster of this machine.")] = False,
    scheduler: Annotated[
        str | None, typer.Option(help="On the Dask cluster with this scheduler, such as tcp://host:8786.")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress.")] = False,
    search: dict[str, Any],
) -> None:
    """Solve a task for several robots: one front over all, who is never the best, and what stops the others."""
    chosen = _robots(robots)
    engine = engine_of(workers, start_method, dask, scheduler)
    with looking_in("."):
        if only_check:
            _print_abilities(task, chosen)
            return
        folder = out or Path("runs") / example_file("task", task).stem
        found = choose_robot(
            task, chosen, engine=engine, out=folder, payload=payload, within=within, progress=not quiet, **search
        )
    _print_choice(found)
    again = f"trajevo choose-robot {task} --out {folder}"
    if found.stopped_by:
        _out.print(f"stopped by {found.stopped_by}; next: {again}")
        raise typer.Exit(128 + signal.Signals[found.stopped_by])
    files = found.save(folder)
    best = next((one for one in found.robots if len(found) and one.name == found.knee().robot), None)
    then = f"trajevo choose-robot {task} --only-check" if best is None else f"trajevo show {folder}/cells/{best.cell}"
    _out.written(*files, then=then)
    if found.of("failed"):
        _out.print(f"next: {again} tries the failed ones again")
        raise typer.Exit(_FAILED)
    if not len(found):
        raise typer.Exit(NO_SOLUTION)


def _robots(given: str | None) -> Any:
    """A list of names with commas between them, or the path of a catalogue."""
    if given is None:
        return None
    if not given.replace(",", "").strip():
        raise InvalidInputError(
            "--robots: expected names and files of robots with commas between them, or the folder of a catalogue, got "
            f"{given!r}; known robots: trajevo list robots"
        )
    place = Path(given)
    if given.endswith("/") or place.suffix == ".toml" or (place.is_dir() and not (place / "robot.toml").is_file()):
        return given
    return [name.strip() for name in given.split(",") if name.strip()]


def _print_abilities(task: str, robots: Any) -> None:
    known = abilities(asked_of(task, robots))
    table = Listing("robot", "at this task", "stopped by", "why")
    for one in known:
        table.add(one.candidate.name, TOLD["impossible"] if one.stopped_by else "may", one.stopped_by, one.reason)
    _out.print(table)
    if all(one.stopped_by for one in known):
        raise typer.Exit(NO_SOLUTION)


def _print_choice(found: RobotChoice) -> None:
    table = Listing(*found.columns)
    for row in found.rows:
        table.add(*row)
    _out.print(table)
    for sentence in found.sentences:
        _out.print(sentence)
    if not len(found):
        _out.print("no robot can do the task")
        return
    F, robots = found.F, found.robot
    for column in range(len(found.objectives)):
        name, unit, factor = found.shown(column)
        k = int(F[:, column].argmin())
        _out.print(f"least {name}: {robots[k]}, {F[k, column] * factor:.5g} {pretty(unit)}")
    knee = found.knee()
    _out.print(f"knee of the common front: {knee.robot}, row {knee.solution.index} of its own front")
