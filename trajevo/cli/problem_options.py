"""Which problem a command works on: a name with its options, or a task's file, which says all of them itself."""

from __future__ import annotations

import functools
import inspect
import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from trajevo.base.own.code import allow_module, imported, in_module, is_module, looking_in, told
from trajevo.cli import completion
from trajevo.errors import InvalidInputError
from trajevo.formulation.examples import is_task
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.formulation.registry import load_problem
from trajevo.formulation.search import Search
from trajevo.robot.payload import LOAD_MODELS
from trajevo.solvers.task import load_task

ProblemArgument = Annotated[
    str,
    typer.Argument(
        help="Name in `trajevo list` or `trajevo examples`, file task.toml, or MODULE:NAME of a problem in Python.",
        autocompletion=completion.problems,
    ),
]
#: Option of commands that read a run.
ProblemOption = Annotated[
    str | None,
    typer.Option(
        "--problem",
        metavar="MODULE[:NAME]",
        help="The run's problem if it is not a registered one: NAME in the Python module MODULE, which is the problem "
        "or makes it. For a run with functions of your own: their MODULE, which may then be imported, or TASK.toml.",
    ),
]


def _mass(text: str) -> float | str:
    """A payload as it is written: a number, or text with its unit."""
    try:
        return float(text)
    except ValueError:
        return text


#: Options by name of the problem's argument.
_OPTIONS: dict[str, Any] = {
    "interpolant": Annotated[
        str | None,
        typer.Option(help="Interpolant; the problem's default if not given.", autocompletion=completion.interpolants),
    ],
    "payload": Annotated[
        str | None, typer.Option(parser=_mass, metavar="MASS", help="Payload [kg], or with its unit: '500 g'.")
    ],
    "payload_model": Annotated[str | None, typer.Option(help=f"How the payload acts: {', '.join(LOAD_MODELS)}.")],
    "convention": Annotated[str | None, typer.Option(help="Definition of the objectives, if the problem has several.")],
    "points": Annotated[
        Path | None, typer.Option(help="CSV file of the points to visit; the problem's own if not given.")
    ],
    "path": Annotated[str | None, typer.Option(help="Path to run along: a name, or a CSV file of points.")],
    "limits": Annotated[
        str | None, typer.Option(help="How limits hold: sampled or certified; along a path tight, hull or certified.")
    ],
    "encoding": Annotated[str | None, typer.Option(help="Decision variables of a path: plain or shape.")],
    "set": Annotated[
        list[str] | None,
        typer.Option(
            "--set", help="Another argument of the problem, KEY=VALUE, such as velocity='150 mm/s'; repeatable."
        ),
    ],
}


def problem_options(command: Callable[..., None]) -> Callable[..., None]:
    """A command with the options of a problem, whose given values it receives as one argument ``options``."""

    @functools.wraps(command)
    def with_options(**given: Any) -> None:
        options = {name: given.pop(name) for name in _OPTIONS}
        command(**given, options={name: value for name, value in options.items() if value is not None})

    keyword = inspect.Parameter.KEYWORD_ONLY
    added = [inspect.Parameter(name, keyword, default=None, annotation=kind) for name, kind in _OPTIONS.items()]
    replace_parameter(command, with_options, "options", added)
    return with_options


def replace_parameter(
    command: Callable[..., None], by: Callable[..., None], name: str, added: Sequence[inspect.Parameter]
) -> None:
    """Give a function the signature of a command, with one parameter replaced by others after the first.

    Args:
        command: the command.
        by: the function that is called in its place.
        name: the parameter that ``by`` makes of the others.
        added: the others.
    """
    first, *others = (
        parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY)
        for parameter in inspect.signature(command, eval_str=True).parameters.values()
        if parameter.name != name
    )
    signature = inspect.Signature([first, *added, *others])
    by.__signature__ = signature  # type: ignore[attr-defined]
    by.__annotations__ = {name: parameter.annotation for name, parameter in signature.parameters.items()}


def chosen_problem(
    name: str, options: dict[str, Any], *, others: dict[str, Any] | None = None
) -> tuple[TrajectoryProblem, Search]:
    """The problem of a name or a task, and the settings of its search: those of the task, or seed 1.

    Args:
        name: of a registered problem or of an example, or a task's file.
        options: those of :func:`problem_options` that were given.
        others: further options that a task does not allow, as they were given.

    Raises:
        InvalidInputError: an option that the task's file says, or as for the problem.
    """
    if in_module(name):
        for option in options:
            raise InvalidInputError(f"{flag(option)}: {name} is made in Python, where it takes its arguments")
        return problem_at(name), Search(seed=1)
    if not is_task(name):
        arguments = {key: value for key, value in options.items() if key != "set"}
        with looking_in("."):
            return load_problem(name, **_with_settings(arguments, options.get("set", []))), Search(seed=1)
    for option in options | (others or {}):
        raise InvalidInputError(f"{flag(option)}: a task says this in its file, options are those of the search")
    task = load_task(name)
    return task.problem, task.search


def problem_at(place: str) -> TrajectoryProblem:
    """A problem that was made in Python, or that a class or function there makes without arguments.

    Args:
        place: ``module:name``; the module is also looked for in the current folder.

    Raises:
        InvalidInputError: another form, no such module or name, an error while it is imported or made, or no problem.
    """
    if not in_module(place):
        raise InvalidInputError(f"problem: expected MODULE:NAME, such as my_cell:problem, got {place!r}")
    with looking_in("."):
        found = imported(place, "problem")
    if callable(found) and not isinstance(found, TrajectoryProblem):
        try:
            found = found()
        except Exception as error:
            raise InvalidInputError(f"problem: {place} cannot be made: {told(error)}") from error
    if not isinstance(found, TrajectoryProblem):
        raise InvalidInputError(
            f"problem: {place}: expected a TrajectoryProblem, or a class or function that makes one without arguments, "
            f"got {type(found).__name__}"
        )
    return found


def problem_of_run(given: str | None) -> TrajectoryProblem | None:
    """The problem of a run as ``--problem`` names it, or None if the run's data says what it is.

    Args:
        given: ``module:name`` of a problem, the file of a task, or a module whose functions the run's data may name.

    Raises:
        InvalidInputError: something else, or as for the problem.
    """
    if given is None:
        return None
    if Path(given).suffix == ".toml":
        return load_task(given).problem
    if is_module(given):
        allow_module(given)
        with looking_in("."):
            imported(given, "problem")
        return None
    return problem_at(given)


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
