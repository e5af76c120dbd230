"""Progress of a run: a bar on a terminal or in a notebook, a few plain lines on standard error elsewhere."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from types import TracebackType
from typing import TYPE_CHECKING, Self, final

from trajevo.base.shown.bar import NotebookBar
from trajevo.front.books import Generation

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import TaskID

#: Plain lines per run.
_LINES = 10

#: Greatest number of times per second that the bar and its text are updated.
_REFRESHED = 4


class Reporter(ABC):
    """Shows the generations of a run; a context manager."""

    @abstractmethod
    def __enter__(self) -> Self: ...

    @abstractmethod
    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

    @abstractmethod
    def update(self, generation: Generation) -> None:
        """Show a finished generation."""


def reporter(total: int, *, enabled: bool, done: int = 0) -> Reporter:
    """The reporter that fits: a bar on a terminal or in a notebook, plain lines otherwise, nothing when disabled.

    Args:
        total: generations of the whole run.
        enabled: whether anything is shown.
        done: generations that were finished before.
    """
    if not enabled:
        return _Silent()
    from rich.console import Console  # imported where something is shown

    console = Console(stderr=True)
    if console.is_jupyter:
        return _InNotebook(total, done)
    return _Bar(total, console, done) if console.is_terminal else _Lines(total, console, done)


@final
class _Silent(Reporter):
    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        return

    def update(self, generation: Generation) -> None:
        return


@final
class _Bar(Reporter):
    def __init__(self, total: int, console: Console, done: int = 0) -> None:
        from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
        from rich.table import Column

        self._progress = Progress(
            TextColumn("{task.completed:.0f}/{task.total:.0f}", table_column=Column(no_wrap=True)),
            BarColumn(bar_width=None, table_column=Column(ratio=1)),
            TimeRemainingColumn(compact=True, table_column=Column(no_wrap=True)),
            TextColumn("left{task.description}", table_column=Column(no_wrap=True)),
            console=console,
            expand=True,
            refresh_per_second=_REFRESHED,
        )
        self._task: TaskID = self._progress.add_task("", total=total, completed=done)
        self._total, self._due = total, 0.0

    def __enter__(self) -> Self:
        self._progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.stop()

    def update(self, generation: Generation) -> None:
        now, said = time.perf_counter(), None
        if now >= self._due or generation.number == self._total:
            self._due, said = now + 1.0 / _REFRESHED, f", {generation.brief}"
        self._progress.update(self._task, completed=generation.number, description=said)


@final
class _InNotebook(Reporter):
    def __init__(self, total: int, done: int = 0) -> None:
        self._total, self._done = total, done
        self._began = time.perf_counter()
        self._latest: Generation | None = None

    def __enter__(self) -> Self:
        self._began = time.perf_counter()
        self._bar = NotebookBar(self._total, self._done)
        return self

    def __exit__(self, *_: object) -> None:
        if self._latest is not None:
            self._bar.update(self._latest.number, f"generations, {self._latest.brief}")

    def update(self, generation: Generation) -> None:
        self._latest = generation
        if self._bar.due(generation.number):
            left = _left(self._began, generation.number - self._done, self._total - generation.number)
            self._bar.update(generation.number, f"generations, {left:.0f} s left, {generation.brief}")


@final
class _Lines(Reporter):
    def __init__(self, total: int, console: Console, done: int = 0) -> None:
        self._total, self._done, self._console = total, done, console
        self._every = max(total // _LINES, 1)
        self._began = time.perf_counter()

    def __enter__(self) -> Self:
        self._began = time.perf_counter()
        return self

    def __exit__(self, *_: object) -> None:
        return

    def update(self, generation: Generation) -> None:
        if generation.number % self._every and generation.number != self._total:
            return
        left = _left(self._began, generation.number - self._done, self._total - generation.number)
        self._console.print(
            f"generation {generation.number}/{self._total}  {generation}  {left:.0f} s left",
            highlight=False,
            soft_wrap=True,
        )


def _left(began: float, finished: int, missing: int) -> float:
    """Time until the missing generations are finished, if they take as long as those finished since [s]."""
    return (time.perf_counter() - began) / finished * missing
