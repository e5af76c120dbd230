"""Mistakes on the command line, told in one sentence like all others."""

from __future__ import annotations

import re
from typing import Any

import typer

from trajevo.errors import known_names, nearest_names

#: What the command line's parser raises: an option, an argument or a command that it does not understand.
UsageError: Any = typer.BadParameter.__base__

#: Kinds of the parser's complaints about a value -> what is expected in its place.
_EXPECTED = {
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
    "float_parsing": "a number",
    "finite_number": "a finite number",
    "greater_than_equal": "at least {ge}",
    "less_than_equal": "at most {le}",
}


def told(error: Any) -> str:
    """One sentence about a mistake on the command line: the command, the option, what was expected and what was given.

    Args:
        error: an error of the parser, a :data:`UsageError`.
    """
    if error.ctx is None:
        return _without_value(error)
    return f"{error.ctx.command_path}: {_what(error)}; see {error.ctx.command_path} --help"


def is_help(error: Any) -> bool:
    """Whether an error of the parser is no mistake, but a command without arguments, which shows its help."""
    return error.ctx is not None and error.message == error.ctx.get_help()


def _what(error: Any) -> str:
    command, said = error.ctx.command, error.message
    if getattr(error, "option_name", None) and said.startswith("No such option"):
        return _unknown_option(error.option_name, command)
    unknown = re.match(r"No such command '(.*?)'", said)
    if unknown:
        return f"unknown command {unknown[1]!r}; {known_names(unknown[1], command.commands)}"
    parameter = getattr(error, "param", None)
    if parameter is None:
        extra = re.fullmatch(r"Got unexpected extra argument\S* \((.*)\)", said)
        return f"expected nothing more, got {extra[1]!r}" if extra else _sentence(error.format_message())
    name = parameter.opts[0] if parameter.param_type_name == "option" else parameter.name.upper()
    if error.format_message().startswith("Missing"):
        return f"{name} is missing: {_sentence(parameter.help or 'expected a value')}"
    return f"{name}: {_expected(error)}"


def _unknown_option(given: str, command: Any) -> str:
    """A sentence about an option that a command does not have, with those that may be meant."""
    options = [name for one in command.params for name in (*one.opts, *one.secondary_opts) if name.startswith("--")]
    meant = [name for name in options if name.startswith(given)] or nearest_names(given, options)
    return f"unknown option {given!r}" + (f"; did you mean {' or '.join(map(repr, meant))}?" if meant else "")


def _without_value(error: Any) -> str:
    """A sentence about an option at the end of the command line, or another mistake that the parser does not place."""
    missing = re.fullmatch(r"Option '(.*)' requires (an|\d+) arguments?\.?", error.message)
    if not missing:
        return _sentence(error.format_message())
    return f"{missing[1]}: expected {'a value' if missing[2] == 'an' else f'{missing[2]} values'} after it"


def _expected(error: Any) -> str:
    """What is expected of a value and what was given, as far as the parser tells."""
    found: dict[str, Any] = next(iter(getattr(error.__cause__ or error.__context__, "errors", list)()), {})
    if found.get("type") not in _EXPECTED:
        return _sentence(error.message)
    return f"expected {_EXPECTED[found['type']].format(**found.get('ctx', {}))}, got {found['input']!r}"


def _sentence(said: str) -> str:
    """A message on one line, without a capital at its beginning or a full stop at its end."""
    text = " ".join(said.split()).rstrip(".")
    return text[:1].lower() + text[1:]
