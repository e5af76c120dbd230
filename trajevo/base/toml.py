"""TOML files: their content, the line numbers of their keys (which the parser does not give), and their validation."""

from __future__ import annotations

import json
import math
import re
import reprlib
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, TypeVar, get_args

import pydantic

from trajevo.base.files import read_bytes, why_not
from trajevo.base.plain import from_toml
from trajevo.errors import InvalidInputError, TrajevoError, UnknownNameError, known_names, no_such_file

_TABLE = re.compile(r"\s*(\[\[?)\s*([^\[\]]+?)\s*\]\]?\s*(#.*)?$")
_KEY = re.compile(r"""\s*((?:[A-Za-z0-9_-]+|"[^"]*"|'[^']*')(?:\s*\.\s*(?:[A-Za-z0-9_-]+|"[^"]*"|'[^']*'))*)\s*=""")
_PART = re.compile(r"""[A-Za-z0-9_-]+|"[^"]*"|'[^']*'""")
Place = tuple[str | int, ...]
Model = TypeVar("Model", bound=pydantic.BaseModel)


def key_lines(text: str) -> dict[Place, int]:
    """Line number of every table, and of every key that begins a line, by path; tables in arrays are numbered."""
    lines: dict[Place, int] = {}
    table: Place = ()
    counts: dict[Place, int] = {}
    depth = 0
    for number, line in enumerate(text.splitlines(), start=1):
        header = _TABLE.match(line) if depth == 0 else None
        if header:
            table = _parts(header[2])
            if header[1] == "[[":
                counts[table] = counts.get(table, -1) + 1
                lines.setdefault(table, number)
                table = (*table, counts[table])
            lines[table] = number
            continue
        key = _KEY.match(line) if depth == 0 else None
        if key:
            lines[(*table, *_parts(key[1]))] = number
        depth = max(0, depth + _opened(line[key.end() :] if key else line))
    return lines


def line_of(lines: dict[Place, int], place: Place) -> int | None:
    """Line number of a key, or of the innermost table or key around it."""
    for end in range(len(place), 0, -1):
        if place[:end] in lines:
            return lines[place[:end]]
    return None


def _parts(dotted: str) -> Place:
    return tuple(part.strip("\"'") for part in _PART.findall(dotted))


def _opened(text: str) -> int:
    """Number of brackets that a line opens and does not close, outside strings and comments."""
    bare = re.sub(r""""(?:[^"\\]|\\.)*"|'[^']*'""", "", text).partition("#")[0]
    return sum(bare.count(opening) - bare.count(closing) for opening, closing in ("[]", "{}"))


#: Types of pydantic errors that only say that a value has the wrong type. Every member of a union that does not match
#: reports such an error, so these errors tell least about the mistake.
_OTHER_KIND = ("float_type", "list_type", "dict_type", "string_type", "model_type", "tuple_type")

#: Members of unions, which pydantic adds to the place of an error, besides classes whose names end in Keys.
_MEMBERS = ("float", "int", "bool", "str", "list", "dict", "MovingSettings", "RobotOffer")

#: How the names of other members begin: classes that are not public, and numbers or text with a bound.
_OF_MEMBERS = ("_", "constrained-")

#: How the parser ends its messages.
_AT = re.compile(r" \(at (?:line (\d+), column (\d+)|end of document)\)$")

#: What the parser says -> what a person does about it.
_REMEDIES = (
    (r"Invalid value", "expected a number, true, false, a list in [ ], or text in quotes"),
    (r"Invalid statement", "expected KEY = VALUE or [TABLE]"),
    (r"Cannot overwrite a value", "this key is given twice"),
    (r"Cannot declare .* twice", "this table is given twice"),
    (r"Expected '=' after a key.*", "expected = after the key"),
    (r"Expected newline or end of document after a statement", "expected the end of the line after the value"),
    (r"Unclosed array", "a list is not closed by ]"),
    (r"Unclosed inline table", "a table is not closed by }"),
    (r"Expected ']' at the end of a table declaration", "expected ] after the table's name"),
    (r"Illegal character '\\n'", "a text is not closed by a quotation mark in its line"),
)


def read_toml(file: Path) -> tuple[dict[str, Any], Places]:
    """Content of a TOML file, and the line numbers of its keys.

    Raises:
        InvalidInputError: the file cannot be read, or holds a number that is too large.
    """
    try:
        text = read_bytes(file).decode("utf-8-sig")
    except FileNotFoundError:
        raise InvalidInputError(no_such_file(file)) from None
    except UnicodeDecodeError as error:
        line = error.object.count(b"\n", 0, error.start) + 1
        raise InvalidInputError(f"{file}: line {line}: cannot be read as TOML: is not UTF-8 text") from error
    except OSError as error:
        raise InvalidInputError(f"{file}: cannot be read as TOML: {why_not(error)}") from error
    text = text.replace("\r\n", "\n")
    try:
        return from_toml(text, parse_float=partial(_finite, file=file, text=text)), Places(file, key_lines(text))
    except InvalidInputError:
        raise
    except tomllib.TOMLDecodeError as error:
        raise InvalidInputError(f"{file}: {_told(str(error), text)}") from error
    except ValueError as error:
        raise InvalidInputError(f"{file}: cannot be read as TOML: {why_not(error)}") from error


def toml_text(content: Mapping[str, Any]) -> str:
    """Tables in tables of finite numbers, texts and lists as a TOML file."""
    return "\n\n".join(_tables((), content)) + "\n"


def _tables(place: tuple[str, ...], content: Mapping[str, Any]) -> Iterator[str]:
    """The table at a place, if it has keys of its own, and then those in it."""
    # Numbers, texts and lists are written alike in JSON and TOML.
    own = [f"{json.dumps(key)} = {json.dumps(value)}" for key, value in content.items() if not isinstance(value, dict)]
    if own:
        yield "\n".join([f"[{'.'.join(map(json.dumps, place))}]", *own])
    for key, value in content.items():
        if isinstance(value, dict):
            yield from _tables((*place, key), value)


def _finite(written: str, *, file: Path, text: str) -> float:
    """A number of the file. One that is too large for the machine must not become infinity, which means no limit."""
    value = float(written)
    if math.isinf(value) and "inf" not in written:
        line = next(number for number, one in enumerate(text.splitlines(), start=1) if written in one)
        raise InvalidInputError(
            f"{file}: line {line}: expected a number up to 1.8e308, got {written}; write inf for no limit"
        )
    return value


def _told(said: str, text: str) -> str:
    """A message of the parser with line and column in front, and the line itself."""
    at = _AT.search(said)
    line, column = (int(at[1]), int(at[2])) if at and at[1] else (max(1, len(text.splitlines())), None)
    what = said[: at.start()] if at else said
    remedy = next((remedy for pattern, remedy in _REMEDIES if re.fullmatch(pattern, what)), what)
    place = f"line {line}, column {column}" if column else f"line {line}, the last"
    lines = text.splitlines()
    if column and re.search(r"=\s*[+-]?\d+,$", lines[line - 1][:column]):
        remedy = "expected a decimal point, not a comma"
    shown = f", got {shortened(lines[line - 1].strip())}" if 0 < line <= len(lines) else ""
    return f"{place}: cannot be read as TOML: {remedy}{shown}"


def shortened(value: Any, most: int = 80) -> str:
    """A value as it is shown in a message: text as it is, everything cut to a length."""
    shown = value if isinstance(value, str) else repr(value)
    return shown if len(shown) <= most else f"{shown[: most - 1]}…"


#: What pydantic says of a value -> what trajevo says, by the type of the error; the rest begins "Input should be".
_SAID = {
    "missing": "this key is missing",
    "extra_forbidden": "unknown key",
    "float_type": "expected a number",
    "int_type": "expected a whole number",
    "int_from_float": "expected a whole number",
    "string_type": "expected text in quotes",
    "bool_type": "expected true or false",
    "list_type": "expected a list",
    "tuple_type": "expected a list",
    "dict_type": "expected a table",
    "model_type": "expected a table",
    "finite_number": "expected a finite number",
    "greater_than": "expected a number greater than {gt:g}",
    "greater_than_equal": "expected a number greater than or equal to {ge:g}",
    "less_than_equal": "expected a number up to {le:g}",
    "less_than": "expected a number below {lt}",
    "float_parsing": "expected a number",
    "int_parsing": "expected a whole number",
    "literal_error": "expected {expected}",
    "too_short": "expected at least {min_length} values, got {actual_length}",
    "too_long": "expected at most {max_length} values, got {actual_length}",
}


def problem_of(error: Any) -> str:
    """An error of pydantic in plain words, with the value that was given.

    Args:
        error: one of the errors that pydantic found.
    """
    kind, context = error["type"], error.get("ctx", {})
    if kind == "missing" and isinstance(error["loc"][-1], int):
        said = "this value is missing"
    elif kind in _SAID:
        said = _SAID[kind].format(**context)
    else:
        said = str(error["msg"]).removeprefix("Value error, ").replace("Input should be", "expected")
    if kind in ("missing", "value_error", "too_short", "too_long", "extra_forbidden"):
        return said
    given = error["input"]
    # A list may have millions of entries: only the first ones are turned into text.
    return f"{said}, got {shortened(reprlib.repr(given) if isinstance(given, list | dict | tuple) else repr(given))}"


def validated(model: type[Model], content: dict[str, Any], places: Places) -> Model:
    """The content of a file, checked against a model.

    Raises:
        InvalidInputError: a key is missing, unknown or of the wrong type; the message names it.
    """
    try:
        return model.model_validate(content)
    except pydantic.ValidationError as error:
        raise InvalidInputError(places.told(_most_telling(error), model)) from error


@dataclass(frozen=True)
class Places:
    """Line numbers of the keys of a file, for messages.

    Attributes:
        file: the file.
        lines: path of a key -> its line number.
    """

    file: Path
    lines: dict[Place, int]

    def prefix(self, place: Place) -> str:
        """Beginning of a message: file, line and key."""
        return self.start(place) + ".".join(map(str, place)) + (": " if place else "")

    def start(self, place: Place) -> str:
        """Beginning of a message that names the key itself: file and line."""
        line = line_of(self.lines, place)
        return f"{self.file}: line {line}: " if line else f"{self.file}: "

    def told(self, error: Any, model: type[pydantic.BaseModel], beside: Iterable[str] = ()) -> str:
        """An error of pydantic as one sentence; for an unknown key it lists the keys that are allowed there.

        Args:
            error: one error that pydantic found.
            model: the model that the file must match.
            beside: keys that are allowed at the top of the file besides those of the model.
        """
        # pydantic adds the names of a union's members to the place; only keys of the file are kept.
        place = tuple(p for p in error["loc"] if isinstance(p, int) or not (p.startswith(_OF_MEMBERS) or "[" in p))
        place = tuple(p for p in place if p not in _MEMBERS and not str(p).endswith("Keys"))
        said = problem_of(error)
        if error["type"] == "extra_forbidden":
            known = [*_keys_at(model, error["loc"]), *(beside if len(place) == 1 else ())]
            said += f"; {known_names(str(place[-1]), known)}"
        return self.prefix(place) + said

    @contextmanager
    def at(self, *place: str) -> Iterator[None]:
        """A context whose errors, raised while the value of a key is used, begin with the file, line and key."""
        try:
            yield
        except TrajevoError as error:
            told = self._at_its_key(error)
            raise InvalidInputError(told or self.prefix(place) + str(error).removeprefix(f"{place[-1]}: ")) from error

    def guess(self, error: TrajevoError) -> str:
        """Message of an error that begins with an argument's name, with the line of that name's key if there is one."""
        said = str(error).split(":")[0].split(".")[0]
        name = {"boxes": "moving", "segments": "segment"}.get(said, said)
        if isinstance(error, UnknownNameError):  # begins with the word unknown, not with an argument
            names = (f"{error.kind}s", error.kind)
            place = next((place for name in names for place in self.lines if place[-1] == name), ())
            return self.prefix(place) + str(error)
        place = next((place for place in self.lines if place[-1] == name), ())
        told = self._at_its_key(error)
        return told or self.prefix(place) + (str(error).removeprefix(f"{said}: ") if place else str(error))

    def _at_its_key(self, error: TrajevoError) -> str:
        """Message of an error about a key in a table, such as ``payload.mass``, or ``""`` if it is about another."""
        head, _, rest = str(error).partition(": ")
        key = error.kind.rpartition(" ")[2] if isinstance(error, UnknownNameError) else head
        parts: Place = tuple(int(part) if part.isdigit() else part for part in key.split("."))
        places = [parts[:end] for end in range(len(parts), 1, -1) if parts[:end] in self.lines]
        if not places:
            return ""
        if isinstance(error, UnknownNameError):
            return self.start(places[0]) + str(error)
        return f"{self.start(places[0])}{key}: {rest}"


def _most_telling(error: pydantic.ValidationError) -> Any:
    """The most informative error: an unknown key before a missing one, which is often the same key misspelled.

    For a union it is that of the member that matched furthest.
    """
    return max(
        error.errors(),
        key=lambda found: (
            found["type"] not in _OTHER_KIND,
            found["type"] == "extra_forbidden",
            len(found["loc"]),
        ),
    )


def _keys_at(model: type[pydantic.BaseModel], place: Place) -> list[str]:
    """The keys that a model allows at the place of an unknown one."""
    models = [model]
    for part in place[:-1]:
        inside = [field for found in models for name, field in found.model_fields.items() if name == part]
        named = [found for found in models if found.__name__ == part]  # a member of a union, by its class
        models = [found for field in inside for found in _models_in(field.annotation)] or named or models
    return list(dict.fromkeys(field.alias or name for found in models for name, field in found.model_fields.items()))


def _models_in(annotation: Any) -> list[type[pydantic.BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, pydantic.BaseModel):
        return [annotation]
    return [found for part in get_args(annotation) for found in _models_in(part)]
