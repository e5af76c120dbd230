"""Make figures and tables of a paper again, and write each as soon as it is made."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import final

from trajevo.base.files import own_folder, why_not, write_whole
from trajevo.base.signals import Stopping
from trajevo.errors import InvalidInputError
from trajevo.reproduction.page import number_files, page_of, table_file
from trajevo.reproduction.paper import Desk, InterruptedSearchError, Item, Paper, PrintedNumber, Shown

#: Dots per inch of the pictures; of a page wide they have 1,005 of them side by side.
_RESOLUTION = 150


@final
@dataclass(frozen=True, kw_only=True)
class Reproduction:
    """What was made of a paper.

    Attributes:
        paper: the paper.
        shown: what was made of each item, in the order of the paper.
        folder: where its files are.
        short: whether searches were short.
        files: what was written.
        stopped_by: name of the signal that ended it before all was made; empty if none has.
    """

    paper: Paper
    shown: Mapping[Item, Shown]
    folder: Path
    short: bool
    files: Sequence[Path]
    stopped_by: str = ""

    @property
    def numbers(self) -> list[tuple[Item, PrintedNumber]]:
        """All printed numbers, each with its item."""
        return [(item, number) for item, shown in self.shown.items() for number in shown.numbers]

    @property
    def unexpected(self) -> list[tuple[Item, PrintedNumber]]:
        """Numbers that are neither as printed nor known to differ; after short searches, only those without one."""
        return [
            (item, number)
            for item, number in self.numbers
            if number.verdict == "unexpected" and not (self.short and item.searches)
        ]


def reproduce(
    paper: Paper,
    folder: str | Path,
    *,
    figures: Sequence[str] = (),
    tables: Sequence[str] = (),
    seed: int = 1,
    short: bool = False,
    begin: Callable[[Item], None] | None = None,
    say: Callable[[str], None] | None = None,
) -> Reproduction:
    """Make figures and tables of a paper again.

    Each picture (PNG) and each table (CSV) is written when it is made; at the end the printed numbers beside ours
    (``numbers.csv``, ``numbers.json``) and a page of all in Markdown (``page.md``). Of some items alone, or after an
    interrupt (SIGINT or SIGTERM; a second one aborts), these three are written only where no page is there yet. An item
    that was interrupted is not written.

    Args:
        paper: the paper.
        folder: where the files go; those of an earlier time are written over.
        figures: numbers of figures; with ``tables`` all if none are given.
        tables: numbers of tables.
        seed: seed of all searches.
        short: short searches, for a first look.
        begin: is called with each item before it is made.
        say: is told what is computed.

    Raises:
        InvalidInputError: the paper has no such item, or the folder cannot be written.
    """
    items, place = paper.chosen(figures=figures, tables=tables), Path(folder)
    shown, files = {}, []
    with Stopping() as stopping, _told(place):
        own_folder(place)
        desk = Desk(seed=seed, short=short, say=say, stopped=lambda: bool(stopping))
        with suppress(InterruptedSearchError):
            for item in items:
                if begin is not None:
                    begin(item)
                made = item.make(desk)
                if stopping:
                    break
                shown[item] = made
                files += _write(item, made, place)
        whole = not stopping and len(items) == len(paper.items)
        if whole or not (place / "page.md").exists():
            page = page_of(paper, shown, short=short)
            numbers = [(item, number) for item, one in shown.items() for number in one.numbers]
            for name, content in {**number_files(numbers), "page.md": page}.items():
                write_whole(place / name, content.encode())
                files.append(place / name)
    return Reproduction(
        paper=paper, shown=shown, folder=place, short=short, files=tuple(files), stopped_by=stopping.asked_by
    )


@contextmanager
def _told(folder: Path) -> Iterator[None]:
    """Say in a sentence what cannot be written."""
    try:
        yield
    except OSError as error:
        raise InvalidInputError(f"{folder}: the output folder cannot be written: {why_not(error)}") from error


def _write(item: Item, shown: Shown, folder: Path) -> list[Path]:
    written = []
    if shown.table is not None:
        written.append(folder / f"{item.stem}.csv")
        write_whole(written[-1], table_file(shown.table).encode())
    if shown.figure is not None:
        import matplotlib.pyplot as plt  # imported where something is drawn

        content = io.BytesIO()
        shown.figure.savefig(content, format="png", dpi=_RESOLUTION)
        plt.close(shown.figure)
        written.append(folder / f"{item.stem}.png")
        write_whole(written[-1], content.getbuffer())
    return written
