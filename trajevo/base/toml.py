"""TOML files: their content, the line numbers of their keys (which the parser does not give), and their validation."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar, get_args

import pydantic

from trajevo.base.files import read_text, why_not
from trajevo.base.plain import from_toml
from trajevo.errors import InvalidInputError, TrajevoError, known_names

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


def read_toml(file: Path) -> tuple[dict[str, Any], Places]:
    """Content of a TOML file, and the line numbers of its keys.

    Raises:
        InvalidInputError: the file cannot be read.
    """
    try:
        text = read_text(file)
        return from_toml(text), Places(file, key_lines(text))
    except InvalidInputError:
        raise
    except (OSError, ValueError) as error:
        raise InvalidInputError(f"{file}: cannot be read as TOML: {why_not(error)}") from error


def validated(model: type[Model], content: dict[str, Any], places: Places) -> Model:
    """The content of a file, checked against a model.

    Raises:
        InvalidInputError: a key is missing, unknown or of the wrong type; the message names it.
    """
    try:
        return model.model_validate(content)
    except pydantic.ValidationError as error:
        raise InvalidInputError(places.told(_deepest(error), model)) from error


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
        line = line_of(self.lines, place)
        at = f"{self.file}: line {line}: " if line else f"{self.file}: "
        return at + ".".join(map(str, place)) + (": " if place else "")

    def told(self, error: Any, model: type[pydantic.BaseModel], beside: Iterable[str] = ()) -> str:
        """An error of pydantic as one sentence; for an unknown key it lists the keys that are allowed there.

        Args:
            error: one error that pydantic found.
            model: the model that the file must match.
            beside: keys that are allowed at the top of the file besides those of the model.
        """
        # pydantic adds the names of a union's members to the place; only keys of the file are kept.
        place = tuple(p for p in error["loc"] if isinstance(p, int) or (p.isidentifier() and not p.startswith("_")))
        place = tuple(p for p in place if p not in ("float", "str", "list", "dict", "MovingSettings"))
        if error["type"] == "extra_forbidden":
            known = [*_keys_at(model, error["loc"]), *(beside if len(place) == 1 else ())]
            return f"{self.prefix(place)}unknown key; {known_names(str(place[-1]), known)}"
        got = "" if error["type"] in ("missing", "value_error") else f", got {error['input']!r}"
        return self.prefix(place) + str(error["msg"]).removeprefix("Value error, ") + got

    @contextmanager
    def at(self, *place: str) -> Iterator[None]:
        """A context whose errors, raised while the value of a key is used, begin with the file, line and key."""
        try:
            yield
        except TrajevoError as error:
            raise InvalidInputError(self.prefix(place) + str(error).removeprefix(f"{place[-1]}: ")) from error

    def guess(self, error: TrajevoError) -> str:
        """Message of an error that begins with an argument's name, with the line of that name's key if there is one."""
        said = str(error).split(":")[0].split(".")[0]
        name = {"boxes": "moving"}.get(said, said)
        place = next((place for place in self.lines if place[-1] == name), ())
        return self.prefix(place) + (str(error).removeprefix(f"{said}: ") if place else str(error))


def _deepest(error: pydantic.ValidationError) -> Any:
    """The most informative error: for a union, that of the member that matched furthest."""
    return max(error.errors(), key=lambda found: (found["type"] not in _OTHER_KIND, len(found["loc"])))


def _keys_at(model: type[pydantic.BaseModel], place: Place) -> list[str]:
    """The keys that a model allows at the place of an unknown one."""
    models = [model]
    for part in place[:-1]:
        inside = [field for found in models for name, field in found.model_fields.items() if name == part]
        named = [found for found in models if found.__name__ == part]  # a member of a union, by its class
        models = [found for field in inside for found in _models_in(field.annotation)] or named or models
    return [field.alias or name for found in models for name, field in found.model_fields.items()]


def _models_in(annotation: Any) -> list[type[pydantic.BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, pydantic.BaseModel):
        return [annotation]
    return [found for part in get_args(annotation) for found in _models_in(part)]
