"""Studies as plain data: levels of factors, the cells that they give, and the seed and name of every cell."""

from __future__ import annotations

import hashlib
import json
import math
import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Annotated, Any, Literal

import numpy as np
import pydantic

from trajevo.base.plain import plain_data
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError
from trajevo.front.records import Line, Record, Settings

#: Greatest number of cells: each has a folder of its own.
MOST_CELLS = 100_000

#: Longest name of a cell's folder; file systems allow 255 bytes.
_LONGEST_NAME = 120
_LONGEST_LABEL = 60

#: Names of columns and dimensions that tables and datasets already have.
_RESERVED = ("cell", "repeat", "seed", "generation", "point", "objective")

_FACTOR_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*(\.([A-Za-z_][A-Za-z0-9_]*|[0-9]{1,4}))*")


class Level(Record):
    """A value that a factor takes, and the short text that stands for it in names, tables and pictures."""

    label: Line
    value: Annotated[Any, pydantic.BeforeValidator(partial(plain_data, "value"))]


class TaskContent(Record):
    """A task's file: its content, and the folder to which relative paths in it refer."""

    content: Settings
    folder: str


class StudyRecord(Record):
    """A study as data, the content of ``study.json``.

    Attributes:
        problem: name of the registered problem, None with a task.
        task: the task, None with a problem.
        seed: seed from which the seeds of all cells are derived.
        repeats: number of runs for each combination of levels.
        fixed: arguments of the problem and settings of the search that do not vary.
        factors: factor -> its levels.
        folder: folder to which relative paths among the arguments refer.
        problems: combination of levels -> digest of the problem, its arguments and the search.
    """

    format: Literal["trajevo study"] = "trajevo study"
    version: Literal[1] = 1
    problem: str | None = None
    task: TaskContent | None = None
    seed: Annotated[int, pydantic.Field(strict=True, ge=0)]
    repeats: Annotated[int, pydantic.Field(strict=True, ge=1, le=MOST_CELLS)]
    fixed: Settings
    factors: dict[str, tuple[Level, ...]]
    folder: str = "."
    problems: dict[str, str] = pydantic.Field(default_factory=dict)

    @pydantic.model_validator(mode="after")
    def _few_enough_cells(self) -> StudyRecord:
        count = math.prod(map(len, self.factors.values())) * self.repeats
        if count > MOST_CELLS:
            raise ValueError(f"expected at most {MOST_CELLS} cells, got {count}")
        for factor, levels in self.factors.items():
            levels_of(factor, levels)
        return self


@dataclass(frozen=True)
class Cell:
    """One run of a study.

    Attributes:
        name: name of its folder.
        combination: its levels, as written in the name; empty for a study without factors.
        labels: factor -> label of its level.
        values: factor -> value of its level.
        repeat: number of the repeat, from 1.
        seed: seed of the run.
    """

    name: str
    combination: str
    labels: Mapping[str, str]
    values: Mapping[str, Any]
    repeat: int
    seed: int

    __repr__ = brief


def cells_of(record: StudyRecord) -> tuple[Cell, ...]:
    """All cells of a study: every combination of the levels of its factors, with all repeats."""
    names = list(record.factors)
    made = []
    for levels in product(*record.factors.values()):
        labels = {name: level.label for name, level in zip(names, levels, strict=True)}
        values = {name: level.value for name, level in zip(names, levels, strict=True)}
        combination = _folder_name(labels)
        for repeat in range(1, record.repeats + 1):
            name = ",".join(filter(None, (combination, f"repeat={repeat:02d}")))
            made.append(Cell(name, combination, labels, values, repeat, cell_seed(record.seed, values, repeat)))
    return tuple(made)


def cell_seed(seed: int, values: Mapping[str, Any], repeat: int) -> int:
    """Seed of a cell, which depends only on the study's seed and on the cell's own levels and repeat.

    Other levels or repeats of the study and the order of its factors do not matter. So existing cells do not change
    when a study is extended.

    Args:
        seed: seed of the study.
        values: factor -> value of its level.
        repeat: number of the repeat.
    """
    own = int.from_bytes(hashlib.sha256(canonical(values).encode()).digest()[:16])
    sequence = np.random.SeedSequence(seed, spawn_key=(own, repeat))
    return int(sequence.generate_state(1, np.uint32)[0])


def canonical(value: Any) -> str:
    """A text that is the same for equal data: keys are sorted, and ``5`` and ``5.0`` are written alike."""
    return json.dumps(_plain(value), sort_keys=True, separators=(",", ":"), allow_nan=False)


def digest(value: Any) -> str:
    """Hash of data, sixteen hexadecimal digits."""
    return hashlib.sha256(canonical(value).encode()).hexdigest()[:16]


def levels_of(factor: str, given: Any) -> tuple[Level, ...]:
    """Levels of a factor as users write them: values, or mappings of ``label`` and ``value``.

    Raises:
        InvalidInputError: not a list of at least one level, a level that is not plain data, a table without a label, or
            repeated levels or labels.
    """
    place = f"factors.{factor}"
    if not _FACTOR_NAME.fullmatch(factor):
        raise InvalidInputError(f"{place}: expected the name of an argument, got {factor!r}")
    if factor in _RESERVED:
        raise InvalidInputError(f"{place}: this name has a meaning of its own in studies")
    if not isinstance(given, list | tuple) or not given:
        raise InvalidInputError(f"{place}: expected a list of at least one level, got {given!r}")
    levels = tuple(_level(place, value) for value in given)
    for what, keys in (
        ("level", [canonical(level.value) for level in levels]),
        # Case is ignored, since some file systems do not distinguish names by case.
        ("label", [level.label.casefold() for level in levels]),
    ):
        counts = Counter(keys)
        twice = next((level for level, key in zip(levels, keys, strict=True) if counts[key] > 1), None)
        if twice is not None:
            raise InvalidInputError(f"{place}: the {what} {twice.label!r} is given twice")
    return levels


def _level(place: str, given: Any) -> Level:
    value = given.model_dump() if isinstance(given, Level) else plain_data(place, given)
    if isinstance(value, dict):
        if set(value) != {"label", "value"} or not isinstance(value["label"], str):
            raise InvalidInputError(
                f"{place}: a table needs a label, {{ label = ..., value = ... }}, got {_shortened(value)}"
            )
        label, value = value["label"], value["value"]
    else:
        label = _label(value)
    if not label.strip() or len(label) > _LONGEST_LABEL or not label.isprintable():
        raise InvalidInputError(
            f"{place}: expected labels of one line with at most {_LONGEST_LABEL} characters, "
            f"got {_shortened(label)}; give the level a label: {{ label = ..., value = ... }}"
        )
    return Level(label=label, value=value)


def _label(value: Any) -> str:
    if isinstance(value, list):
        return "+".join(_label(entry) for entry in value)
    return value if isinstance(value, str) else json.dumps(_plain(value), sort_keys=True)


def _folder_name(labels: Mapping[str, str]) -> str:
    """Levels as part of a folder's name; a digest is added where characters had to be replaced or left out."""
    written = ",".join(f"{name}={label}" for name, label in labels.items())
    safe = ",".join(f"{name}={re.sub(r'[^A-Za-z0-9._+-]', '-', label)}" for name, label in labels.items())
    if safe == written and len(safe) <= _LONGEST_NAME:
        return safe
    return f"{safe[: _LONGEST_NAME - 9]}-{digest(dict(labels))[:8]}"


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    return int(value) if isinstance(value, float) and value.is_integer() else value


def _shortened(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 2 * _LONGEST_LABEL else text[: 2 * _LONGEST_LABEL] + "…"
