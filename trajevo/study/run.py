"""Run a study: an engine runs its cells until all are finished or have failed; show progress and the state of cells."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self, final

from trajevo.base import jit
from trajevo.base.shown import html
from trajevo.base.shown.bar import NotebookBar
from trajevo.base.shown.brief import brief
from trajevo.base.signals import Stopping
from trajevo.errors import InvalidInputError, visible
from trajevo.study.cell import Outcome
from trajevo.study.definition import Study
from trajevo.study.engines import POLL, Engine, InProcess
from trajevo.study.folder import STATES, CellStanding, State, StudyFolder
from trajevo.study.jobs import Job

#: Plain lines per study.
_LINES = 20


@final
class CellsShown:
    """Shows how many cells are finished, failed, running and waiting, and the time left.

    In a notebook this is a bar in the output of the cell, elsewhere it is on standard error.

    Args:
        total: cells of the study.
        finished: those that were finished before.
        workers: cells that run at a time, None where that is not known.
        enabled: whether anything is shown.
    """

    def __init__(self, total: int, *, finished: int, workers: int | None, enabled: bool) -> None:
        from rich.console import Console  # imported where something is shown
        from rich.progress import BarColumn, Progress, TextColumn
        from rich.table import Column

        self._total, self._finished, self._before, self._failed = total, finished, finished, 0
        self._workers, self._enabled = workers, enabled
        self._every = max((total - finished) // _LINES, 1)
        self._began = time.perf_counter()
        self._console = Console(stderr=True)
        columns = (
            TextColumn("{task.completed:.0f}/{task.total:.0f} cells", table_column=Column(no_wrap=True)),
            BarColumn(bar_width=None, table_column=Column(ratio=1)),
            TextColumn("{task.description}", table_column=Column(no_wrap=True)),
        )
        self._bar = Progress(*columns, console=self._console, expand=True) if self._console.is_terminal else None
        self._notebook: NotebookBar | None = None

    def __enter__(self) -> Self:
        self._began = time.perf_counter()
        if self._enabled and self._bar is not None:
            self._task = self._bar.add_task(self._told(), total=self._total, completed=self._finished)
            self._bar.start()
        if self._enabled and self._console.is_jupyter:
            self._notebook = NotebookBar(self._total, self._finished)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._enabled and self._bar is not None:
            self._bar.stop()

    def update(self, outcome: Outcome) -> None:
        """Count a cell that has ended, and show why if it failed."""
        self._finished += outcome["state"] == "finished"
        self._failed += outcome["state"] == "failed"
        if not self._enabled:
            return
        console = self._console if self._bar is None else self._bar.console
        if outcome["state"] == "failed":
            console.print(
                visible(f"failed: {outcome['cell']}: {outcome['said']}"), markup=False, highlight=False, soft_wrap=True
            )
        if self._notebook is not None:
            self._notebook.update(self._finished, f"cells, {self._told()}")
        elif self._bar is not None:
            self._bar.update(self._task, completed=self._finished, description=self._told())
        elif not (self._finished + self._failed - self._before) % self._every or not self._left:
            console.print(f"{self._finished}/{self._total} cells  {self._told()}", highlight=False, soft_wrap=True)

    @property
    def _left(self) -> int:
        return self._total - self._finished - self._failed

    def _told(self) -> str:
        running = self._left if self._workers is None else min(self._workers, self._left)
        parts = [f"{self._failed} failed"] if self._failed else []
        if self._workers is not None:
            parts.append(f"{running} running")
            parts.append(f"{self._left - running} waiting")
        else:
            parts.append(f"{self._left} running or waiting")
        done = self._finished + self._failed - self._before
        if done and self._left:
            seconds = (time.perf_counter() - self._began) / done * self._left
            parts.append(f"{_time(seconds)} left")
        return ", ".join(parts)


def _time(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


#: Greatest time until a front that a worker has written is visible here, through a network file system [s].
_LAG = 60.0


@dataclass(frozen=True)
class StudyStanding:
    """The state of a study.

    Attributes:
        folder: the study's folder.
        cells: state of every cell.
        stopped_by: name of the signal that ended this run of the study, or empty.
    """

    folder: Path
    cells: tuple[CellStanding, ...]
    stopped_by: str = ""

    __repr__ = brief

    def _repr_html_(self) -> str:
        rows = [(cell.cell.name, cell.state, cell.failure.sentence if cell.failure else "") for cell in self.cells]
        rows.sort(key=lambda row: row[1] == "finished")  # stable: what is finished last
        return html.shown(f"Study in {self.folder}", html.sentence(str(self)), html.table(("cell", "state", ""), rows))

    def __str__(self) -> str:
        counts = [(state, self.count(state)) for state in STATES]
        return f"{len(self.cells)} cells: " + ", ".join(f"{count} {state}" for state, count in counts if count)

    def count(self, state: State) -> int:
        """Number of cells in a state, see :data:`trajevo.study.folder.STATES`."""
        return sum(cell.state == state for cell in self.cells)

    @property
    def finished(self) -> bool:
        """Whether every cell is finished."""
        return self.count("finished") == len(self.cells)


def run_study(
    study: Study, folder: str | Path, *, engine: Engine | None = None, progress: bool = True
) -> StudyStanding:
    """Run the cells of a study that are not finished; those that were begun are resumed from their checkpoints.

    If a cell fails, its traceback is recorded and the others continue; the next run tries it again. Several runs of the
    same study at the same time share the work: each cell is run by one of them. After SIGINT or SIGTERM, running cells
    finish their generation and the run ends; a second signal aborts it. In both cases the next run continues.

    Args:
        study: the study.
        folder: folder of the study: ``study.json``, and the run folders of all cells in ``cells``. It may already hold
            the same study with fewer levels or repeats.
        engine: runs the cells; one after the other in this process if None.
        progress: show finished, failed, running and waiting cells and the time left, on standard error or, in a
            notebook, in the output of the cell.

    Returns:
        The state of the study.

    Raises:
        InvalidInputError: the folder holds another study or cannot be written, or workers cannot run the cells.
    """
    if not isinstance(study, Study):
        raise InvalidInputError(f"study: expected a Study, got {type(study).__name__}")
    engine = InProcess() if engine is None else engine
    if not isinstance(engine, Engine):
        raise InvalidInputError(f"engine: expected InProcess, Processes or DaskCluster, got {engine!r}")
    place = StudyFolder(folder)
    place.keep(study.record)
    # First repeats first: early results then compare all levels, and a machine that slows down favours no level.
    in_turn = sorted(zip(study.cells, study.jobs, strict=True), key=lambda pair: pair[0].repeat)
    with jit.one_kind(place.kernels()) as kernels:
        waiting = [Job(**job | {"kernels": kernels}) for _, job in in_turn if not place.finished(job["cell"])]
    total, before = len(study.jobs), len(study.jobs) - len(waiting)
    shown = CellsShown(total, finished=before, workers=engine.workers, enabled=progress)
    with Stopping() as stopping, shown:
        while waiting and not stopping:
            waiting = _pass(engine, waiting, place, stopping, shown)
    return StudyStanding(place.folder, place.standings(), stopping.asked_by)


def study_standing(folder: str | Path) -> StudyStanding:
    """The state of a study, while it runs or afterwards.

    Args:
        folder: the study's folder.

    Raises:
        InvalidInputError: the folder holds no study.
    """
    place = StudyFolder(folder)
    return StudyStanding(place.folder, place.standings())


def _pass(engine: Engine, jobs: Sequence[Job], place: StudyFolder, stopping: Stopping, shown: CellsShown) -> list[Job]:
    """Run cells once; returns those to run again, since another run of the study held them or they were interrupted."""
    again = []
    by_name = {job["cell"]: job for job in jobs}
    for outcome in engine.run(jobs, str(place.folder), stopping):
        if outcome["state"] in ("held", "interrupted"):
            again.append(by_name[outcome["cell"]])
            continue
        if outcome["state"] == "finished":
            _see(place, outcome)
        shown.update(outcome)
    while again and not stopping and all(place.running(job["cell"]) for job in again):
        time.sleep(POLL)
    finished = [job for job in again if place.finished(job["cell"])]
    for job in finished:
        shown.update(Outcome(cell=job["cell"], state="finished", said=""))
    return [job for job in again if job not in finished]


def _see(place: StudyFolder, outcome: Outcome) -> None:
    """Wait until the front that a worker has written is visible here."""
    until = time.monotonic() + _LAG
    while not place.finished(outcome["cell"]):
        if time.monotonic() > until:
            raise InvalidInputError(
                f"{place.cell(outcome['cell'])}: a worker has finished this cell, but its front is not visible here; "
                "put the study's folder where all workers and this machine see it"
            )
        time.sleep(POLL)
