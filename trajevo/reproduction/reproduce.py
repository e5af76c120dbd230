"""Make figures and tables of a paper again, and write each as soon as it is made."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import final

from trajevo.base.files import own_folder, write_whole
from trajevo.reproduction.page import number_files, page_of, table_file
from trajevo.reproduction.paper import Desk, Item, Paper, PrintedNumber, Shown

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
    """

    paper: Paper
    shown: Mapping[Item, Shown]
    folder: Path
    short: bool

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
    (``numbers.csv``, ``numbers.json``) and a page of all in Markdown (``page.md``).

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
    items = paper.chosen(figures=figures, tables=tables)
    place = own_folder(Path(folder))
    desk = Desk(seed=seed, short=short, say=say)
    shown = {}
    for item in items:
        if begin is not None:
            begin(item)
        shown[item] = item.make(desk)
        _write(item, shown[item], place)
    made = Reproduction(paper=paper, shown=shown, folder=place, short=short)
    for name, content in {**number_files(made.numbers), "page.md": page_of(paper, shown, short=short)}.items():
        write_whole(place / name, content.encode())
    return made


def _write(item: Item, shown: Shown, folder: Path) -> None:
    if shown.table is not None:
        write_whole(folder / f"{item.stem}.csv", table_file(shown.table).encode())
    if shown.figure is not None:
        import matplotlib.pyplot as plt  # imported where something is drawn

        content = io.BytesIO()
        shown.figure.savefig(content, format="png", dpi=_RESOLUTION)
        plt.close(shown.figure)
        write_whole(folder / f"{item.stem}.png", content.getbuffer())
