"""A bar in the output of a notebook's cell, which rewrites itself instead of adding lines."""

from __future__ import annotations

import importlib
import sys
import time
from typing import Any, ClassVar, final

from trajevo.base.shown import html

#: Greatest number of times per second that a bar is written again.
_REFRESHED = 4


@final
class NotebookBar:
    """How much is done, in one output of the cell that runs; for kernels of Jupyter, which have IPython.

    Args:
        total: number of things to do.
        done: number of those that were done before.
    """

    _latest: ClassVar[tuple[Any, NotebookBar] | None] = None

    def __init__(self, total: int, done: int = 0) -> None:
        display: Any = importlib.import_module("IPython.display").display
        self._total = total
        self._due = 0.0
        self._handle: Any = display(_State(done, total, ""), display_id=True)
        NotebookBar._latest = _cell(), self

    @classmethod
    def of_cell(cls, total: int) -> NotebookBar:
        """The bar of the cell that runs, begun again for other things to do; a new one if it has none yet."""
        if cls._latest is None or cls._latest[0] != _cell():
            return cls(total)
        bar = cls._latest[1]
        bar._total, bar._due = total, 0.0
        return bar

    def due(self, done: int) -> bool:
        """Whether to write the bar again: a few times a second, and in the end."""
        return done >= self._total or time.perf_counter() >= self._due

    def update(self, done: int, text: str) -> None:
        """Write how many things are done, and a text."""
        self._due = time.perf_counter() + 1.0 / _REFRESHED
        self._handle.update(_State(done, self._total, text))


@final
class Steps:
    """Steps of a computation, in the bar of the cell of a notebook; nothing is shown elsewhere.

    Args:
        total: number of steps.
        enabled: whether anything is shown.
    """

    def __init__(self, total: int, *, enabled: bool = True) -> None:
        self._bar = NotebookBar.of_cell(total) if enabled and _shell() is not None else None
        self._done = 0

    def step(self, text: str) -> None:
        """Show that one more step is done, and a text."""
        self._done += 1
        if self._bar is not None and self._bar.due(self._done):
            self._bar.update(self._done, text)

    def end(self, text: str) -> None:
        """Show a text in the end."""
        if self._bar is not None:
            self._bar.update(self._done, text)


def _shell() -> Any:
    """What runs the cells of a notebook; None elsewhere, as on a terminal."""
    found = sys.modules.get("IPython")
    shell = None if found is None else found.get_ipython()
    return shell if type(shell).__name__ == "ZMQInteractiveShell" else None


def _cell() -> Any:
    """Number of the cell that runs, None outside of notebooks."""
    return getattr(_shell(), "execution_count", None)


@final
class _State:
    """A bar as a notebook shows it, and as text where there is no HTML."""

    def __init__(self, done: int, total: int, text: str) -> None:
        self._done, self._total, self._text = done, total, text

    def __repr__(self) -> str:
        return f"{self._done}/{self._total} {self._text}".rstrip()

    def _repr_html_(self) -> str:
        return html.bar(self._done, self._total, self._text)
