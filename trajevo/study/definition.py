"""Studies: the product of factors, each cell an independent run with a seed and a folder of its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, final

import pydantic

from trajevo.base.toml import Places, read_toml
from trajevo.errors import InvalidInputError, TrajevoError, checked_name
from trajevo.formulation.registry import problem_class
from trajevo.solvers.optimise import load_task
from trajevo.study.jobs import SEARCH, Job, jobs_of
from trajevo.study.record import Cell, StudyRecord, TaskContent, cells_of, digest, levels_of, plain_data


@final
@dataclass(frozen=True, eq=False, init=False)
class Study:
    """A study whose problems have all been made, and so can be.

    Args:
        problem: name of a registered problem, see ``trajevo list``.
        task: file of a task, in place of a problem.
        seed: seed from which those of all cells are derived.
        factors: name of an argument of the problem, of a key of the task (``"payload.mass"`` inside a table), or of a
            setting of the search (``algorithm``, ``population``, ``generations``, ``offsprings``, ...) -> its levels:
            values, or mappings of ``label`` and ``value`` where the value is no short text.
        fixed: arguments, keys and settings that do not vary.
        repeats: runs for each combination of levels, with different seeds.
        folder: from where relative paths count: that of the task, and of files among the arguments.
        **search: settings of every run's search, as :class:`~trajevo.Search` has them but for the seed.

    Attributes:
        record: the study as data.
        cells: its cells.
        jobs: what each of them solves.

    Raises:
        InvalidInputError: no problem or task, or both; a name that is given twice; levels that repeat; a value that the
            problem, task or algorithm refuses. The message begins with the place, as ``factors.payload``.
        UnknownNameError: no such problem.
    """

    record: StudyRecord
    cells: tuple[Cell, ...]
    jobs: tuple[Job, ...]

    def __init__(
        self,
        problem: str | None = None,
        *,
        task: str | Path | None = None,
        seed: int,
        factors: Mapping[str, Sequence[Any]] | None = None,
        fixed: Mapping[str, Any] | None = None,
        repeats: int = 10,
        folder: str | Path = ".",
        **search: Any,
    ) -> None:
        if (problem is None) == (task is None):
            raise InvalidInputError("study: expected either a problem, by its name, or a task, by its file")
        if problem is not None:
            problem_class(problem)
        for name in search:
            checked_name("setting of a study", name, SEARCH)
        where = Path(folder).resolve()
        given: dict[str, Any] = {
            "problem": problem,
            "task": None if task is None else _content(where / task),
            "seed": seed,
            "repeats": repeats,
            "factors": {str(name): levels_of(str(name), levels) for name, levels in (factors or {}).items()},
            "fixed": _fixed(fixed or {}, {name: value for name, value in search.items() if value is not None}),
            "folder": str(where),
        }
        for name in given["factors"]:
            if name in given["fixed"]:
                raise InvalidInputError(f"factors.{name}: the argument is fixed and cannot vary")
        try:
            record = StudyRecord(**given)
        except pydantic.ValidationError as error:
            first = error.errors()[0]
            place = ".".join(map(str, first["loc"]))
            raise InvalidInputError(f"{place}: {first['msg']}, got {first['input']!r}") from error
        self._settle(record)

    @classmethod
    def of(cls, record: StudyRecord) -> Study:
        """The study of a record, its problems made again."""
        study = cls.__new__(cls)
        study._settle(record)
        return study

    def _settle(self, record: StudyRecord) -> None:
        cells = cells_of(record)
        jobs = jobs_of(record, cells)
        problems = {
            cell.combination: digest([job["problem"], job["arguments"], job["search"]])
            for cell, job in zip(cells, jobs, strict=True)
        }
        object.__setattr__(self, "record", record.model_copy(update={"problems": problems}))
        object.__setattr__(self, "cells", cells)
        object.__setattr__(self, "jobs", jobs)


def _fixed(table: Mapping[str, Any], beside: dict[str, Any]) -> dict[str, Any]:
    for name in table:
        if name in beside:
            raise InvalidInputError(f"fixed.{name}: given twice, here and beside the table")
    return {str(name): plain_data(f"fixed.{name}", value) for name, value in table.items()} | beside


def _content(file: Path) -> TaskContent:
    # Faults of the task itself are told with their lines, before a factor changes anything.
    load_task(file)
    content, _ = read_toml(file)
    return TaskContent(content=_finite(content), folder=str(file.resolve().parent))


def _finite(value: Any) -> Any:
    """Data of a TOML file as JSON has it: ``inf`` is a text, which limits know."""
    if isinstance(value, dict):
        return {key: _finite(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_finite(entry) for entry in value]
    return str(value) if value in (float("inf"), -float("inf")) else value


_Whole = Annotated[int, pydantic.Field(strict=True)]


class StudySettings(pydantic.BaseModel):
    """The keys of ``study.toml``; they mean what the arguments of :class:`~trajevo.Study` do.

    Beside these there are the settings of a search.
    """

    model_config = pydantic.ConfigDict(extra="forbid", frozen=True)

    format: Literal[1] = 1
    problem: str | None = None
    task: str | None = None
    seed: Annotated[_Whole, pydantic.Field(ge=0)]
    repeats: Annotated[_Whole, pydantic.Field(ge=1)] = 10
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
    search = {name: content.pop(name) for name in SEARCH if name in content}
    try:
        settings = StudySettings.model_validate(content)
    except pydantic.ValidationError as error:
        raise InvalidInputError(places.told(error.errors()[0])) from error
    given = settings.model_dump(exclude={"format", "factors"})
    try:
        return Study(**given, **search, factors=_flat(settings.factors), folder=Path(file).resolve().parent)
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
    known = [(table, name), (table, *name.split(".")), (name,)] if name else [(table,)]
    for keys in known:
        if keys in places.lines:
            return places.prefix(keys) + rest
    return f"{places.file}: {said}"
