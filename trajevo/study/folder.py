"""The folder of a study: ``study.json``, and in ``cells`` the run folder, failure and lock file of every cell."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Literal, final

import pydantic
from pydantic_core import from_json

from trajevo.base.files import (
    MOST_DATA,
    locked,
    no_link,
    opened_lock,
    own_folder,
    read_bytes,
    read_text,
    removed,
    why_not,
    write_whole,
)
from trajevo.base.jit import Kind
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError
from trajevo.front.records import Record, told
from trajevo.solvers.run.folder import RunFolder
from trajevo.study.record import Cell, StudyRecord, canonical, cells_of

STUDY_FILE, CELLS_FOLDER, FAILURE_FILE, CLAIM_FILE = "study.json", "cells", "failure.json", ".claim"

#: States of a cell. A ``stopped`` cell was begun but is not running; it is resumed when the study is run again.
State = Literal["finished", "running", "failed", "stopped", "waiting"]
STATES: tuple[State, ...] = ("finished", "running", "failed", "stopped", "waiting")


class Failure(Record):
    """Why a cell failed: one sentence, the whole traceback, and the machine it ran on."""

    sentence: str
    traceback: str
    host: str


@dataclass(frozen=True)
class CellStanding:
    """The state of a cell.

    Attributes:
        cell: the cell.
        state: one of :data:`STATES`.
        failure: why it failed, or None.
    """

    cell: Cell
    state: State
    failure: Failure | None

    __repr__ = brief


@final
class StudyFolder:
    """Reads and writes the folder of one study.

    Args:
        folder: the folder.
    """

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder).absolute()

    @property
    def study_file(self) -> Path:
        """File of the study as data."""
        return self.folder / STUDY_FILE

    def cell(self, name: str) -> Path:
        """Folder of a cell's run, by the name of the cell."""
        return self.folder / CELLS_FOLDER / name

    def _folder(self, name: str) -> Path:
        """The folder of a cell's run, which may be missing, but is not reached through a link."""
        no_link(self.folder / CELLS_FOLDER)
        return no_link(self.cell(name))

    def record(self) -> StudyRecord:
        """The study as data.

        Raises:
            InvalidInputError: the folder holds no study, or one of another version of trajevo.
        """
        try:
            return StudyRecord.model_validate_json(read_text(self.study_file, most=MOST_DATA))
        except FileNotFoundError as error:
            raise InvalidInputError(f"{self.folder} holds no study: it has no {STUDY_FILE}") from error
        except (OSError, UnicodeDecodeError) as error:
            raise InvalidInputError(f"{self.study_file}: cannot be read: {why_not(error)}") from error
        except pydantic.ValidationError as error:
            raise InvalidInputError(
                f"{self.study_file}: is no study of this version of trajevo: {told(error)}"
            ) from error

    def keep(self, record: StudyRecord) -> None:
        """Write a study into the folder; a study already there may differ only in having fewer levels or repeats.

        Raises:
            InvalidInputError: the folder holds another study, or cannot be written; the message says what differs.
        """
        if self.study_file.exists():
            difference = _difference(self.record(), record)
            if difference:
                raise InvalidInputError(f"{self.folder} holds another study: {difference}; choose another folder")
        try:
            own_folder(self.folder / CELLS_FOLDER)
            write_whole(self.study_file, record.model_dump_json(indent=1).encode())
        except OSError as error:
            raise InvalidInputError(f"{self.folder}: the study cannot be written there: {why_not(error)}") from error

    def finished(self, name: str) -> bool:
        """Whether the run of a cell is finished."""
        file = RunFolder(self.cell(name)).front_file
        try:
            stands = file.stat()
        except OSError:
            return False
        return _finished(file, stands.st_ino, stands.st_mtime_ns, stands.st_size)

    def failure(self, name: str) -> Failure | None:
        """Why a cell failed when it was last run, or None."""
        try:
            return Failure.model_validate_json(read_text(self.cell(name) / FAILURE_FILE))
        except (OSError, ValueError):
            return None

    def fail(self, name: str, failure: Failure) -> None:
        """Record why a cell failed.

        Raises:
            OSError: it cannot be written.
        """
        write_whole(own_folder(self._folder(name)) / FAILURE_FILE, failure.model_dump_json(indent=1).encode())

    def forgive(self, name: str) -> None:
        """Remove the record of a cell's failure."""
        removed(self._folder(name) / FAILURE_FILE)

    @contextmanager
    def claimed(self, name: str) -> Iterator[bool]:
        """Lock a cell while the context lasts; yields False if another process runs the cell.

        The system releases the lock when this process ends, even if it is killed.

        Raises:
            OSError: the cell's folder cannot be written.
        """
        with opened_lock(own_folder(self._folder(name)) / CLAIM_FILE) as claim:
            yield locked(claim.fileno())

    def running(self, name: str) -> bool:
        """Whether another process runs a cell now."""
        try:
            with opened_lock(self._folder(name) / CLAIM_FILE) as claim:
                return not locked(claim.fileno())
        except OSError:
            return False

    def kernels(self) -> Kind | None:
        """What computes the runs of cells that were begun, compiled loops or numpy; None before the first.

        Raises:
            InvalidInputError: the folder holds no study.
        """
        runs = (RunFolder(self.cell(cell.name)) for cell in cells_of(self.record()))
        return next((run.manifest().kernels for run in runs if run.begun), None)

    def standings(self) -> tuple[CellStanding, ...]:
        """The state of every cell.

        Raises:
            InvalidInputError: the folder holds no study.
        """
        return tuple(self._standing(cell) for cell in cells_of(self.record()))

    def _standing(self, cell: Cell) -> CellStanding:
        if self.finished(cell.name):
            return CellStanding(cell, "finished", None)
        if self.running(cell.name):
            return CellStanding(cell, "running", None)
        failure = self.failure(cell.name)
        if failure is not None:
            return CellStanding(cell, "failed", failure)
        return CellStanding(cell, "stopped" if RunFolder(self.cell(cell.name)).begun else "waiting", None)


@lru_cache(maxsize=4096)
def _finished(file: Path, _node: int, _written: int, _size: int) -> bool:
    """Whether a front file is that of a finished run; a file that has changed is read again."""
    try:
        return not from_json(read_bytes(file, most=MOST_DATA))["run"]["interrupted"]
    except (OSError, ValueError, KeyError, TypeError):
        return False


def _difference(old: StudyRecord, new: StudyRecord) -> str:
    """How a new study differs from the old one in a folder, one clause; empty if the folder can be used for it."""
    tasks = [None if record.task is None else canonical(record.task.content) for record in (old, new)]
    for what, before, now in (
        ("problem", old.problem, new.problem),
        ("task", *tasks),
        ("seed", old.seed, new.seed),
        ("factors", list(old.factors), list(new.factors)),
        ("fixed", canonical(old.fixed), canonical(new.fixed)),
    ):
        if before != now:
            shown = "" if what == "task" else f", {before} there and {now} here"
            return f"its {what} differs{shown}"
    for factor, levels in old.factors.items():
        known = [(level.label, canonical(level.value)) for level in new.factors[factor]]
        lost = [level.label for level in levels if (level.label, canonical(level.value)) not in known]
        if lost:
            return f"its factor {factor} has the level {lost[0]}, which is missing here"
    if new.repeats < old.repeats:
        return f"it has {old.repeats} repeats, more than {new.repeats}"
    changed = [one for one, digest in old.problems.items() if new.problems.get(one) != digest]
    if changed:
        return (
            f"what {changed[0] or 'a cell'} solves is no longer the same "
            "(a file that it reads, or trajevo's version, has changed)"
        )
    return ""
