"""Which problem a command works on: a name with its arguments, or a task's file, which says all of them itself."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Annotated, Any

import typer

from trajevo.errors import InvalidInputError
from trajevo.formulation.examples import is_task
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.formulation.registry import load_problem
from trajevo.formulation.search import Search
from trajevo.robot.payload import LOAD_MODELS
from trajevo.solvers.optimise import load_task

ProblemArgument = Annotated[
    str, typer.Argument(help="Name in `trajevo list` or `trajevo examples`, or file task.toml.")
]
InterpolantOption = Annotated[str | None, typer.Option(help="Interpolant; the problem's default if not given.")]
PayloadOption = Annotated[float | None, typer.Option(help="Payload [kg].")]
PayloadModelOption = Annotated[str | None, typer.Option(help=f"How the payload acts: {', '.join(LOAD_MODELS)}.")]
ConventionOption = Annotated[str | None, typer.Option(help="Definition of the objectives, if the problem has several.")]
PointsOption = Annotated[
    Path | None, typer.Option(help="CSV file of the points to visit; the problem's own if not given.")
]
PathOption = Annotated[str | None, typer.Option(help="Path to run along: a name, or a CSV file of points.")]
LimitsOption = Annotated[
    str | None, typer.Option(help="How limits hold: sampled or certified; along a path tight, hull or certified.")
]
EncodingOption = Annotated[str | None, typer.Option(help="Decision variables of a path: plain or shape.")]
SetOption = Annotated[
    list[str] | None,
    typer.Option("--set", help="Another argument of the problem, KEY=VALUE, such as velocity='150 mm/s'; repeatable."),
]


def chosen_problem(
    name: str, arguments: dict[str, Any], pairs: list[str] | None, *, others: dict[str, Any] | None = None
) -> tuple[TrajectoryProblem, Search]:
    """The problem of a name or a task, and the settings of its search: those of the task, or seed 1.

    Args:
        name: of a registered problem or of an example, or a task's file.
        arguments: options by name; those that are None were not given.
        pairs: ``KEY=VALUE`` pairs of ``--set``.
        others: further options that a task does not allow, as they were given.

    Raises:
        InvalidInputError: an option that the task's file says, or as for the problem.
    """
    given = {key: value for key, value in arguments.items() if value is not None}
    if not is_task(name):
        return load_problem(name, **_with_settings(given, pairs or [])), Search(seed=1)
    for option in given | (others or {}) | ({} if pairs is None else {"set": pairs}):
        raise InvalidInputError(f"{flag(option)}: a task says this in its file, options are those of the search")
    task = load_task(name)
    return task.problem, task.search


def flag(name: str) -> str:
    """The option of an argument's name."""
    return f"--{name.replace('_', '-')}"


def _with_settings(arguments: dict[str, Any], pairs: list[str]) -> dict[str, Any]:
    """Arguments with ``KEY=VALUE`` pairs added; a value is read as TOML if it is valid TOML, else as text."""
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
