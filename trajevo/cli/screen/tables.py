"""Tables that fit the terminal: cells wrap at spaces and within long names, and nothing is cut."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Any, final

from rich.box import SIMPLE
from rich.cells import cell_len
from rich.table import Table
from rich.text import Text

#: Columns between two cells, and where there is little room.
_GAP, _LITTLE = 2, 1

#: Where a cell goes on in its next line: after spaces, and where it must, after underscores and within dotted names.
_SPACE = re.compile(r"(?<=\s)(?=\S)")
_BREAK = re.compile(r"(?<=[\s_])(?=[^\s_])|(?<=[.:])(?=[A-Za-z])")


@final
class Listing:
    """A table of texts for any width; where not even its longest words fit side by side, each row is a block of lines.

    Args:
        *headers: texts above the columns, each with its unit if it has one.
        title: line above the table.
    """

    def __init__(self, *headers: str, title: str = "") -> None:
        self._headers, self._title = headers, title
        self._rows: list[tuple[tuple[str, ...], str]] = []

    def add(self, *cells: str, style: str = "") -> None:
        """Add a row, with a cell for each header, in a style of rich."""
        self._rows.append((tuple(f"{cell}" for _, cell in zip(self._headers, cells, strict=True)), style))

    def __rich_console__(self, console: Any, options: Any) -> Iterator[Any]:
        columns = list(zip(self._headers, *(cells for cells, _ in self._rows), strict=True))
        yield Text()
        if self._title:
            yield Text(self._title)
        for gap in (_GAP, _LITTLE):
            widths = fitted(columns, options.max_width - gap * (len(columns) - 1), names=gap == _LITTLE)
            if widths is not None:
                yield self._table(widths, gap)
                break
        else:
            yield from self._blocks()
        yield Text()

    def _table(self, widths: Sequence[int], gap: int) -> Table:
        table = Table(box=SIMPLE, show_edge=False, pad_edge=False, padding=(0, gap - 1, 0, 0))
        for header, width in zip(self._headers, widths, strict=True):
            table.add_column(Text("\n".join(wrapped(header, width))), width=width, no_wrap=True)
        for cells, style in self._rows:
            lines = (wrapped(cell, width) for cell, width in zip(cells, widths, strict=True))
            table.add_row(*(Text("\n".join(cell)) for cell in lines), style=style or None)
        return table

    def _blocks(self) -> Iterator[Text]:
        for (first, *cells), style in self._rows:
            yield Text(first, style=style)
            for header, cell in zip(self._headers[1:], cells, strict=True):
                yield Text(f"  {header}: {cell}", style=style)


def fitted(columns: Sequence[Sequence[str]], room: int, *, names: bool = True) -> list[int] | None:
    """Widths of columns side by side: headers wrap first, then the widest cells; None if that is not enough.

    Args:
        columns: header and cells of each column.
        room: greatest sum of the widths.
        names: whether names may go on in another line; otherwise only spaces in cells and headers are line ends.
    """
    widths = [max(map(_width, column)) for column in columns]
    if sum(widths) <= room:
        return widths
    words = _BREAK if names else _SPACE
    widths = [max(_longest(header, _BREAK), *map(_width, cells), 0) for header, *cells in columns]
    least = [max(_longest(header, _BREAK), *(_longest(cell, words) for cell in cells), 0) for header, *cells in columns]
    if sum(least) > room:
        return None
    while sum(widths) > room:
        widest = max((k for k, width in enumerate(widths) if width > least[k]), key=widths.__getitem__)
        widths[widest] -= 1
    return widths


def _width(text: str) -> int:
    return max(map(cell_len, text.splitlines()), default=0)


def _longest(text: str, ends: re.Pattern[str]) -> int:
    return max((_width(piece.rstrip()) for piece in ends.split(text)), default=0)


def wrapped(text: str, width: int) -> list[str]:
    """The lines of a cell, each of at most a width if its words allow it; names are broken only where they must be."""
    lines = []
    for whole in text.splitlines() or [""]:
        lines.append("")
        for word in _SPACE.split(whole):
            fits = _width(word.rstrip()) <= width
            for piece in [word] if fits else _BREAK.split(word):
                if lines[-1] and cell_len(lines[-1] + piece.rstrip()) > width:
                    lines.append("")
                lines[-1] += piece
    return [line.rstrip() for line in lines]
