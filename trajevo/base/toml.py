"""TOML files: their content, the lines of their keys, which the parser does not tell, and the models they must fit."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import pydantic

from trajevo.errors import InvalidInputError, TrajevoError

_TABLE = re.compile(r"\s*(\[\[?)\s*([^\[\]]+?)\s*\]\]?\s*(#.*)?$")
_KEY = re.compile(r"""\s*((?:[A-Za-z0-9_-]+|"[^"]*"|'[^']*')(?:\s*\.\s*(?:[A-Za-z0-9_-]+|"[^"]*"|'[^']*'))*)\s*=""")
_PART = re.compile(r"""[A-Za-z0-9_-]+|"[^"]*"|'[^']*'""")
Place = tuple[str | int, ...]
Model = TypeVar("Model", bound=pydantic.BaseModel)


def key_lines(text: str) -> dict[Place, int]:
    """Line of every key that begins one, and of every table, by its path; entries of arrays of tables are numbered."""
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
    """Line of a key, or of the nearest key around it."""
    for end in range(len(place), 0, -1):
        if place[:end] in lines:
            return lines[place[:end]]
    return None


def _parts(dotted: str) -> Place:
    return tuple(part.strip("\"'") for part in _PART.findall(dotted))


def _opened(text: str) -> int:
    """Brackets that a line opens and does not close, outside of strings and comments."""
    bare = re.sub(r""""(?:[^"\\]|\\.)*"|'[^']*'""", "", text).partition("#")[0]
    return sum(bare.count(opening) - bare.count(closing) for opening, closing in ("[]", "{}"))


#: Types of pydantic errors that only say that a value has the wrong type. Every member of a union that does not match
#: reports such an error, so these errors tell least about the mistake.
_OTHER_KIND = ("float_type", "list_type", "dict_type", "string_type", "model_type", "tuple_type")


def read_toml(file: Path) -> tuple[dict[str, Any], Places]:
    """Content of a TOML file, and the lines of its keys.

    Raises:
        InvalidInputError: it cannot be read.
    """
    try:
        text = file.read_text(encoding="utf-8")
        return tomllib.loads(text), Places(file, key_lines(text))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise InvalidInputError(f"{file}: cannot be read as TOML: {why}") from error


def validated(model: type[Model], content: dict[str, Any], places: Places) -> Model:
    """The content of a file as the keys that a model declares.

    Raises:
        InvalidInputError: a key is missing, unknown or of another kind; the message names it.
    """
    try:
        return model.model_validate(content)
    except pydantic.ValidationError as error:
        raise InvalidInputError(places.told(_deepest(error))) from error


@dataclass(frozen=True)
class Places:
    """Lines of the keys of a file, for messages.

    Attributes:
        file: the file.
        lines: path of a key -> its line.
    """

    file: Path
    lines: dict[Place, int]

    def prefix(self, place: Place) -> str:
        """File, line and key, as messages begin."""
        line = line_of(self.lines, place)
        at = f"{self.file}: line {line}: " if line else f"{self.file}: "
        return at + ".".join(map(str, place)) + (": " if place else "")

    def told(self, error: Any) -> str:
        """An error of pydantic as one sentence."""
        # Unions put the names of their members into the place; keys of the file are left.
        place = tuple(p for p in error["loc"] if isinstance(p, int) or (p.isidentifier() and not p.startswith("_")))
        place = tuple(p for p in place if p not in ("float", "str", "list", "dict", "MovingSettings"))
        got = "" if error["type"] in ("missing", "value_error") else f", got {error['input']!r}"
        return self.prefix(place) + str(error["msg"]).removeprefix("Value error, ") + got

    @contextmanager
    def at(self, *place: str) -> Iterator[None]:
        """Errors of what is made of a key name its line."""
        try:
            yield
        except TrajevoError as error:
            raise InvalidInputError(self.prefix(place) + str(error).removeprefix(f"{place[-1]}: ")) from error

    def guess(self, error: TrajevoError) -> str:
        """An error of the problem, which begins with the argument's name: the key's, here or in a table."""
        said = str(error).split(":")[0].split(".")[0]
        name = {"boxes": "moving"}.get(said, said)
        place = next((place for place in self.lines if place[-1] == name), ())
        return self.prefix(place) + (str(error).removeprefix(f"{said}: ") if place else str(error))


def _deepest(error: pydantic.ValidationError) -> Any:
    """The most telling of the errors: in a union that of the member that got furthest."""
    return max(error.errors(), key=lambda found: (found["type"] not in _OTHER_KIND, len(found["loc"])))
