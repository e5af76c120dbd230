"""What a study shows while its cells run: a bar on a terminal, a line now and then elsewhere."""

from __future__ import annotations

import time
from types import TracebackType
from typing import Self, final

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn
from rich.table import Column

from trajevo.study.cell import Outcome

#: Plain lines per study.
_LINES = 20


@final
class CellsShown:
    """Shows on standard error how many cells are finished, failed, running and waiting, and the time left.

    Args:
        total: cells of the study.
        finished: those that were finished before.
        workers: cells that run at a time, None where that is not known.
        enabled: whether anything is shown.
    """

    def __init__(self, total: int, *, finished: int, workers: int | None, enabled: bool) -> None:
        self._total, self._finished, self._before, self._failed = total, finished, finished, 0
        self._workers, self._enabled = workers, enabled
        self._every = max((total - finished) // _LINES, 1)
        self._began = time.perf_counter()
        self._console = Console(stderr=True)
        columns = (
            TextColumn("{task.completed:.0f}/{task.total:.0f} cells", table_column=Column(no_wrap=True)),
            TextColumn("{task.description}", table_column=Column(no_wrap=True)),
            BarColumn(bar_width=None, table_column=Column(ratio=1)),
        )
        self._bar = Progress(*columns, console=self._console, expand=True) if self._console.is_terminal else None

    def __enter__(self) -> Self:
        self._began = time.perf_counter()
        if self._enabled and self._bar is not None:
            self._task = self._bar.add_task(self._told(), total=self._total, completed=self._finished)
            self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._enabled and self._bar is not None:
            self._bar.stop()

    def update(self, outcome: Outcome) -> None:
        """Count a cell that has ended, and say why where it failed."""
        self._finished += outcome["state"] == "finished"
        self._failed += outcome["state"] == "failed"
        if not self._enabled:
            return
        console = self._console if self._bar is None else self._bar.console
        if outcome["state"] == "failed":
            console.print(
                f"failed: {outcome['cell']}: {outcome['said']}", markup=False, highlight=False, soft_wrap=True
            )
        if self._bar is not None:
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
