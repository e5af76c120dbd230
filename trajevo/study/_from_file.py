"""The file ``study.toml``: its keys, and where in it a mistake stands."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import pydantic

from trajevo.errors import InvalidInputError, TrajevoError
from trajevo.study.definition import Study
from trajevo.task_file import Places, read_toml

_Whole = Annotated[int, pydantic.Field(strict=True)]


class StudySettings(pydantic.BaseModel):
    """The keys of ``study.toml``; they mean what the arguments of :class:`~trajevo.study.Study` do."""

    model_config = pydantic.ConfigDict(extra="forbid", frozen=True)

    format: Literal[1] = 1
    problem: str | None = None
    task: str | None = None
    seed: Annotated[_Whole, pydantic.Field(ge=0)]
    repeats: Annotated[_Whole, pydantic.Field(ge=1)] = 10
    generations: Annotated[_Whole, pydantic.Field(ge=1)] | None = None
    population: Annotated[_Whole, pydantic.Field(ge=4)] | None = None
    algorithm: str | None = None
    fixed: dict[str, Any] = {}
    factors: dict[str, Any] = {}


def load_study(file: str | Path) -> Study:
    """Read a study, and make all its problems.

    Args:
        file: TOML, see :class:`StudySettings`; relative paths in it count from its folder.

    Raises:
        InvalidInputError: it cannot be read, or a key is missing, unknown or has a value that cannot be used; the
            message names file, line and key.
    """
    content, places = read_toml(Path(file))
    try:
        settings = StudySettings.model_validate(content)
    except pydantic.ValidationError as error:
        raise InvalidInputError(places.told(error.errors()[0])) from error
    given = settings.model_dump(exclude={"format", "factors"})
    try:
        return Study(**given, factors=_flat(settings.factors), folder=Path(file).resolve().parent)
    except TrajevoError as error:
        raise InvalidInputError(_located(str(error), places)) from error


def _flat(table: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Factors by name: the key ``payload.mass`` is a table in a table to TOML."""
    found: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, dict) and value:
            found |= _flat(value, f"{prefix}{key}.")
        else:
            found[prefix + key] = value
    return found


def _located(said: str, places: Places) -> str:
    """What was said of a place, ``factors.payload``, with file and line in front."""
    place, _, rest = said.partition(": ")
    table, _, name = place.partition(".")
    known = [(table, name), (table, *name.split("."))] if name else [(table,)]
    for keys in known:
        if keys in places.lines:
            return places.prefix(keys) + rest
    return f"{places.file}: {said}"
