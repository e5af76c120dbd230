"""Where commands print: names from files cannot steer the terminal, whatever they are printed in."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, final

from rich.console import Console
from rich.segment import Segment

from trajevo.errors import visible


@final
class Terminal(Console):
    """A console of rich for standard output, or standard error, that neither cuts lines nor reads markup in them.

    Args:
        stderr: whether it prints on standard error.
    """

    def __init__(self, *, stderr: bool = False) -> None:
        super().__init__(soft_wrap=True, highlight=False, markup=False, stderr=stderr)

    def written(self, *files: object, then: str) -> None:
        """Tell which files were written, and in another line what to do next."""
        self.print(f"written: {', '.join(map(str, files))}")
        self.print(f"next: {then}")

    def render(self, renderable: Any, options: Any = None) -> Iterable[Segment]:
        """Everything that is printed, with signs for control and bidirectional characters of its texts."""
        for segment in super().render(renderable, options):
            yield segment if segment.control else Segment(visible(segment.text), segment.style)
