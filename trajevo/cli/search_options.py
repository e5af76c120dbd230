"""Settings of a search as options of a command, made from the record that declares them."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Annotated, Any, get_args, get_type_hints

import typer

from trajevo.cli import completion
from trajevo.cli.problem_options import flag, replace_parameter
from trajevo.errors import InvalidInputError
from trajevo.formulation.search import Search
from trajevo.solvers.evolutionary.algorithms import NAMED_ALGORITHMS


def search_options(command: Callable[..., None]) -> Callable[..., None]:
    """A command with ``--population`` and similar options, whose given values it receives as one argument ``search``.

    Values are checked by the record, so that error messages are the same as in Python and in a task.
    """

    @functools.wraps(command)
    def with_options(**given: Any) -> None:
        search = {name: given.pop(name) for name in Search.model_fields}
        search = {name: value for name, value in search.items() if value is not None}
        try:
            Search.of(**search)
        except InvalidInputError as error:
            name, _, rest = str(error).partition(": ")
            raise InvalidInputError(f"{flag(name)}: {rest}") from error
        command(**given, search=search)

    hints = get_type_hints(Search)
    replace_parameter(command, with_options, "search", [_option(name, hints[name]) for name in Search.model_fields])
    return with_options


def _option(name: str, hint: Any) -> inspect.Parameter:
    field = Search.model_fields[name]
    kinds = set(get_args(hint)) or {hint}
    kind = next(kind for kind in (bool, str, int, float) if kind in kinds)
    says = str(field.description)
    if name == "algorithm":
        says = f"{says} {', '.join(NAMED_ALGORITHMS.names())}."
    flags = [f"{flag(name)}/--no-{flag(name)[2:]}"] if kind is bool else [flag(name)]
    offered = completion.algorithms if name == "algorithm" else None
    annotation = Annotated[kind | None, typer.Option(*flags, help=says, autocompletion=offered)]  # type: ignore[valid-type]
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=annotation)
