"""Define a study in Python or in ``study.toml``: factors, fixed settings and repeats.

Every combination of factor levels and repeat is a cell: an independent run with its own seed and folder. All problems
of a study are made when it is defined, so that mistakes are found before anything runs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, final

import pydantic

from trajevo.base.plain import plain_data
from trajevo.base.shown import html
from trajevo.base.shown.brief import brief
from trajevo.base.toml import Places, problem_of, read_toml
from trajevo.errors import InvalidInputError, TrajevoError, checked_name
from trajevo.formulation.examples import example_file
from trajevo.formulation.registry import problem_class
from trajevo.solvers.task import load_task
from trajevo.study.jobs import SEARCH, Job, jobs_of
from trajevo.study.record import Cell, StudyRecord, TaskContent, cells_of, digest, levels_of


@final
@dataclass(frozen=True, eq=False, init=False)
class Study:
    """A study, whose problems have all been made once to check them.

    Args:
        problem: name of a registered problem, see ``trajevo list``.
        task: file of a task, or name of an example task, instead of a problem.
        seed: seed from which the seeds of all cells are derived.
        factors: factor -> its levels. A factor is an argument of the problem, a key of the task (``"payload.mass"`` for
            a key in a table), or a setting of the search (``algorithm``, ``population``, ``generations``, ...). A level
            is a value, or a mapping of ``label`` and ``value`` if the value is not a short text.
        fixed: arguments, keys and settings that do not vary.
        repeats: number of runs for each combination of levels, with different seeds.
        folder: folder to which relative paths refer: that of the task, and those of files among the arguments.
        **search: settings of the search for every run, as in :class:`~trajevo.Search`, except the seed.

    Attributes:
        record: the study as data.
        cells: cells of the study.
        jobs: what each cell solves.

    Raises:
        InvalidInputError: neither a problem nor a task, or both; a name that is given twice; repeated levels; a value
            that the problem, task or algorithm refuses. The message begins with the place, such as ``factors.payload``.
        UnknownNameError: no such problem or setting.
    """

    record: StudyRecord
    cells: tuple[Cell, ...]
    jobs: tuple[Job, ...]

    __repr__ = brief

    def _repr_html_(self) -> str:
        record = self.record
        solved = record.problem or "a task"
        levels = [(name, ", ".join(level.label for level in levels)) for name, levels in record.factors.items()]
        told = html.sentence(f"{solved}: {len(self.cells)} cells, repeats: {record.repeats}, seed {record.seed}")
        fixed = {name: str(value) for name, value in record.fixed.items()}
        return html.shown("Study", told, html.table(("factor", "levels"), levels), html.facts(fixed))

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
            "task": None if task is None else _content(example_file("task", task, folder=where)),
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
            place = ".".join(map(str, first["loc"])) or "study"
            raise InvalidInputError(f"{place}: {problem_of(first)}") from error
        self._settle(record)

    @classmethod
    def of(cls, record: StudyRecord) -> Study:
        """Make a study from its record; its problems are made again."""
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
            raise InvalidInputError(f"fixed.{name}: given twice, in this table and outside it")
    return {str(name): plain_data(f"fixed.{name}", value) for name, value in table.items()} | beside


def _content(file: Path) -> TaskContent:
    # Reports mistakes in the task itself with their lines, before a factor changes anything.
    load_task(file)
    content, _ = read_toml(file)
    return TaskContent(content=in_json(content), folder=str(file.resolve().parent))


def in_json(value: Any) -> Any:
    """Data of a TOML file in a form that JSON can hold: infinity becomes the text ``"inf"``, which limits accept."""
    if isinstance(value, dict):
        return {key: in_json(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [in_json(entry) for entry in value]
    return str(value) if value in (float("inf"), -float("inf")) else value


_Whole = Annotated[int, pydantic.Field(strict=True)]


class StudySettings(pydantic.BaseModel):
    """The keys of ``study.toml``, which have the meaning of the arguments of :class:`~trajevo.Study`.

    The settings of a search are keys of the file, too.
    """

    model_config = pydantic.ConfigDict(extra="forbid", frozen=True, defer_build=True)

    format: Literal[1] = pydantic.Field(1, description="Version of this format.")
    problem: str | None = pydantic.Field(None, description="Name of a registered problem; or a task.")
    task: str | None = pydantic.Field(None, description="File of a task, or name of an example; instead of a problem.")
    seed: Annotated[_Whole, pydantic.Field(ge=0)] = pydantic.Field(
        description="Seed from which the seeds of all cells are derived."
    )
    repeats: Annotated[_Whole, pydantic.Field(ge=1)] = pydantic.Field(
        10, description="Number of runs for each combination of levels, with different seeds."
    )
    fixed: dict[str, Any] = pydantic.Field({}, description="Arguments, keys and settings that do not vary, by name.")
    factors: dict[str, Any] = pydantic.Field(
        {},
        description="Factor -> its levels: arguments of the problem, keys of the task, or settings of the search.",
    )


def load_study(file: str | Path) -> Study:
    """Read a study and make all its problems.

    Args:
        file: TOML file, see :class:`StudySettings`; paths in it are relative to its folder. Or the name of an example,
            see ``trajevo examples``.

    Raises:
        UnknownNameError: neither a file nor the name of an example.
        InvalidInputError: the file cannot be read, or a key is missing or unknown or has an invalid value; the message
            names file, line and key.
    """
    path = example_file("study", file)
    content, places = read_toml(path)
    search = {name: content.pop(name) for name in SEARCH if name in content}
    try:
        settings = StudySettings.model_validate(content)
    except pydantic.ValidationError as error:
        raise InvalidInputError(places.told(error.errors()[0], StudySettings, beside=SEARCH)) from error
    given = settings.model_dump(exclude={"format", "factors"})
    try:
        return Study(**given, **search, factors=_flat(settings.factors), folder=path.resolve().parent)
    except TrajevoError as error:
        raise InvalidInputError(_located(str(error), places)) from error


def _flat(table: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Factors by their dotted names; TOML reads the key ``payload.mass`` as a table in a table."""
    found: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, dict) and value:
            found |= _flat(value, f"{prefix}{key}.")
        else:
            found[prefix + key] = value
    return found


def _located(said: str, places: Places) -> str:
    """A message that begins with a place, such as ``factors.payload``, with file and line in front."""
    place, _, rest = said.partition(": ")
    table, _, name = place.partition(".")
    known = [(table, name), (table, *name.split(".")), (name,)] if name else [(table,)]
    for keys in known:
        if keys in places.lines:
            return places.prefix(keys) + rest
    return f"{places.file}: {said}"
