"""A bar on a terminal while a command computes or draws; nothing where nobody watches."""

from __future__ import annotations

from collections.abc import Sequence
from types import TracebackType
from typing import Any, Self, final

from trajevo.cli.console import Terminal


@final
class Waiting:
    """Shows on standard error which of several steps is taken, if that is a terminal; a context manager.

    Args:
        what: what is done, such as ``"drawing"``.
        steps: names of all steps in their order.
        quiet: show nothing on a terminal either.
        lines: elsewhere than on a terminal, a line for each step, for what takes minutes.
    """

    def __init__(self, what: str, steps: Sequence[str], *, quiet: bool = False, lines: bool = False) -> None:
        from rich.progress import BarColumn, Progress, TextColumn  # imported where something is shown
        from rich.table import Column

        self._what, self._steps = what, tuple(steps)
        self._console = Terminal(stderr=True)
        self._lines = lines and not quiet and not self._console.is_terminal
        one_line = Column(no_wrap=True)
        self._bar = Progress(
            TextColumn("{task.description}", table_column=one_line, markup=False),
            BarColumn(bar_width=None, table_column=Column(ratio=1)),
            TextColumn("{task.completed:.0f}/{task.total:.0f}", table_column=one_line),
            console=self._console,
            expand=True,
            transient=True,
            redirect_stdout=False,  # what a command prints is no part of the bar
            disable=quiet or not self._steps or not self._console.is_terminal,
        )
        self._task: Any = self._bar.add_task(what, total=len(self._steps))

    def __enter__(self) -> Self:
        self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self._bar.update(self._task, completed=len(self._steps))
        self._bar.stop()

    def begin(self, step: str) -> None:
        """Show the step that begins now; those before it are finished."""
        said = f"{self._what}: {step.replace('_', ' ')}"
        self._bar.update(self._task, completed=self._steps.index(step), description=said, refresh=True)
        if self._lines:
            self._console.print(said)
