"""What the cells of a study solve: every distinct problem is made once, before anything runs."""

from __future__ import annotations

import copy
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NotRequired, TypedDict

from trajevo.base.jit import Kind
from trajevo.base.own.code import looking_in
from trajevo.base.toml import Places, validated
from trajevo.errors import InvalidInputError, TrajevoError, checked_name
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.formulation.registry import load_problem
from trajevo.formulation.search import Search
from trajevo.formulation.task import task_problem
from trajevo.formulation.task_file import task_model
from trajevo.solvers.evolutionary.algorithms import algorithm_for
from trajevo.solvers.optimise import decided
from trajevo.study.record import Cell, StudyRecord, canonical

#: Settings of the search; they can be factors, like arguments of the problem.
SEARCH = tuple(name for name in Search.model_fields if name != "seed")

#: Keys of a task that cannot be factors: every cell has its own seed, and settings of the search are factors by name.
_NOT_IN_TASKS = ("seed", "format", "algorithm")


class Job(TypedDict):
    """A cell as plain data, everything that a worker needs.

    Attributes:
        cell: name of the cell.
        problem: name of the registered problem.
        arguments: arguments of the problem, with files read and units converted.
        search: settings of the search by name.
        seed: seed of the run.
        kernels: what computes it, the same for all cells; whatever is ready if it is not given.
        folder: where the modules of the user's own functions are, beside the study's task or the study itself.
    """

    cell: str
    problem: str
    arguments: dict[str, Any]
    search: dict[str, Any]
    seed: int
    kernels: NotRequired[Kind]
    folder: NotRequired[str]


def jobs_of(record: StudyRecord, cells: Sequence[Cell]) -> tuple[Job, ...]:
    """What every cell of a study solves, in the order of the cells.

    Raises:
        InvalidInputError: an argument that the problem does not take or a value that it refuses, or a setting of the
            search that the algorithm does not have; the message begins with its place, such as ``factors.payload``.
    """
    problems: dict[str, TrajectoryProblem] = {}
    searches: dict[str, dict[str, Any]] = {}
    jobs: list[Job] = []
    for cell in cells:
        given = record.fixed | dict(cell.values)
        arguments = {name: value for name, value in given.items() if name not in SEARCH}
        search = {name: value for name, value in given.items() if name in SEARCH}
        one, key = canonical(arguments), canonical(given)
        try:
            if one not in problems:
                problems[one] = _problem(record, arguments)
            if key not in searches:
                searches[key] = _search(record, search, problems[one])
        except TrajevoError as error:
            raise InvalidInputError(_blamed(str(error), record, cell)) from error
        problem = problems[one]
        jobs.append(
            Job(
                cell=cell.name,
                problem=problem.registered_name,
                arguments=problem.settings,
                search=searches[key],
                seed=cell.seed,
                folder=_folder(record),
            )
        )
    return tuple(jobs)


def _problem(record: StudyRecord, arguments: dict[str, Any]) -> TrajectoryProblem:
    if record.task is None:
        folder = Path(record.folder)
        resolved = {name: _beside(folder, value) for name, value in arguments.items()}
        with looking_in(folder):
            return load_problem(record.problem or "", **resolved)
    content = copy.deepcopy(record.task.content)
    for name, value in arguments.items():
        _put(content, name, value)
    # No lines, since values from factors are not in the task's file.
    places = Places(Path(record.task.folder) / "task.toml", {})
    try:
        return task_problem(validated(task_model(), content, places), places)
    except TrajevoError as error:
        raise InvalidInputError(str(error).removeprefix(places.prefix(()))) from error


def _folder(record: StudyRecord) -> str:
    return str(Path(record.folder if record.task is None else record.task.folder).resolve())


def _search(record: StudyRecord, given: dict[str, Any], problem: TrajectoryProblem) -> dict[str, Any]:
    usual = {} if record.task is None else dict(record.task.content.get("algorithm", {}))
    if "name" in usual:
        usual["algorithm"] = usual.pop("name")
    search = usual | given
    settings = decided(Search.of(**search, seed=0), problem)
    algorithm_for(settings, problem)
    return search


def _beside(folder: Path, value: Any) -> Any:
    """The path of a file or robot folder that a text names, relative to the study's file; other values unchanged."""
    if not isinstance(value, str) or not value or "\0" in value:
        return value
    place = folder / value
    return str(place) if (place.suffix and os.path.isfile(place)) or os.path.isfile(place / "robot.toml") else value


def _put(content: dict[str, Any], name: str, value: Any) -> None:
    """Set a key of a task; a dotted key such as ``payload.mass`` or ``payload.0.mass`` is set in its table."""
    keys = name.split(".")
    if keys[0] in _NOT_IN_TASKS:
        raise InvalidInputError(
            f"{name}: this key of a task cannot vary in a study; settings of the search are {', '.join(SEARCH)}"
        )
    checked_name(
        "key of a task", keys[0], [key for key in task_model().model_fields if key not in (*_NOT_IN_TASKS, "robots")]
    )
    if keys[0] == "robot":  # in place of those to choose from
        content.pop("robots", None)
    table: Any = content
    for depth, key in enumerate(keys[:-1], start=1):
        if isinstance(table, list):
            table = table[int(key)] if key.isdigit() and int(key) < len(table) else None
        else:
            table = table.setdefault(key, {})
        if not isinstance(table, dict | list) or (isinstance(table, list) and depth == len(keys) - 1):
            raise InvalidInputError(f"{name}: {'.'.join(keys[:depth])} is no table in this task, but {table!r}")
    table[keys[-1]] = value


def _blamed(said: str, record: StudyRecord, cell: Cell) -> str:
    """A message with the place of the factor or fixed argument that caused it in front, if that can be found."""
    begins = said.split(":")[0]
    places = {f"factors.{name}": (name, cell.values[name]) for name in cell.values}
    places |= {f"fixed.{name}": (name, value) for name, value in record.fixed.items()}
    for place, (name, _) in places.items():
        if begins == name or begins.split(".")[0] == name.split(".")[0]:
            return f"{place}: {said.removeprefix(f'{begins}: ')}"
    for place, (name, value) in places.items():
        if f"no {name!r}" in said or f"key of a task {name.split('.')[0]!r}" in said:
            return f"{place}: {said}; the search: {', '.join(SEARCH)}"
        if isinstance(value, str) and repr(value) in said:
            return f"{place}: {said}"
    return f"{cell.combination}: {said}" if cell.combination else said
