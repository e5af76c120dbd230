"""A bar in the output of a notebook's cell, which rewrites itself instead of adding lines."""

from __future__ import annotations

import importlib
import time
from typing import Any, final

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

    def __init__(self, total: int, done: int = 0) -> None:
        display: Any = importlib.import_module("IPython.display").display
        self._total = total
        self._due = 0.0
        self._handle: Any = display(_State(done, total, ""), display_id=True)

    def due(self, done: int) -> bool:
        """Whether to write the bar again: a few times a second, and in the end."""
        return done >= self._total or time.perf_counter() >= self._due

    def update(self, done: int, text: str) -> None:
        """Write how many things are done, and a text."""
        self._due = time.perf_counter() + 1.0 / _REFRESHED
        self._handle.update(_State(done, self._total, text))


@final
class _State:
    """A bar as a notebook shows it, and as text where there is no HTML."""

    def __init__(self, done: int, total: int, text: str) -> None:
        self._done, self._total, self._text = done, total, text

    def __repr__(self) -> str:
        return f"{self._done}/{self._total} {self._text}".rstrip()

    def _repr_html_(self) -> str:
        return html.bar(self._done, self._total, self._text)
