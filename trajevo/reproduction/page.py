"""What was made of a paper, as a page in Markdown and as tables of numbers."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence

from trajevo.base.units import pretty
from trajevo.reproduction.paper import Item, NumberTable, Paper, PrintedNumber, Shown

#: Rows of a table that a page shows; its file has them all.
_MOST_ROWS = 30

_COLUMNS = ("item", "of", "unit", "printed", "ours", "difference", "within", "verdict", "why")


def table_file(table: NumberTable) -> str:
    """A table as CSV, numbers with all their digits."""
    return _csv(table.headers, table.rows)


def number_files(numbers: Iterable[tuple[Item, PrintedNumber]]) -> dict[str, str]:
    """Printed numbers beside ours by the name of the file: CSV for people, JSON for programs."""
    rows = [_row(item, number) for item, number in numbers]
    text = json.dumps([dict(zip(_COLUMNS, map(_plain, row), strict=True)) for row in rows], indent=1)
    return {"numbers.csv": _csv(_COLUMNS, rows), "numbers.json": f"{text}\n"}


def page_of(paper: Paper, shown: Mapping[Item, Shown], *, short: bool) -> str:
    """A page of what was made of a paper, to be read beside it."""
    return "\n".join(_lines(paper, shown, short)).rstrip() + "\n"


def shown_number(value: float | None) -> str:
    """A number for readers: six significant digits, a dash for none."""
    return "–" if value is None or math.isnan(value) else f"{value:.6g}"


def _lines(paper: Paper, shown: Mapping[Item, Shown], short: bool) -> Iterator[str]:
    yield f"Made by `trajevo reproduce {paper.name}`."
    if short:
        yield "Searches were short: numbers that come from them are not those of the whole run."
    for item, found in shown.items():
        yield from ("", f"### {item}: {item.title}", "")
        if found.figure is not None:
            yield from (f"![{item}: {item.title}]({item.stem}.png)", "")
        yield from _paragraphs(found.said)
        if found.numbers:
            yield from (*_numbers(found.numbers), "")
        if found.table is not None:
            yield from _table(item, found.table)
    if paper.left_out:
        yield from ("", "### What cannot be made again", "", *_markdown(("what", "shows", "why"), _reasons(paper)))


def _paragraphs(said: Sequence[str]) -> Iterator[str]:
    for sentence in said:
        yield from (sentence, "")


def _reasons(paper: Paper) -> list[tuple[str, str, str]]:
    return [(one.what, one.title, one.why) for one in paper.left_out]


def _numbers(numbers: Sequence[PrintedNumber]) -> Iterator[str]:
    rows = [
        (
            one.of if one.unit == "1" else f"{one.of} [{pretty(one.unit)}]",
            one.printed,
            shown_number(one.ours),
            one.verdict if not one.why else f"{one.verdict}: {one.why}",
        )
        for one in numbers
    ]
    yield from _markdown(("quantity", "the paper prints", "here", ""), rows)


def _table(item: Item, table: NumberTable) -> Iterator[str]:
    if item.kind == "table" and len(table.rows) <= _MOST_ROWS:
        yield from (*_markdown(table.headers, table.rows), "")
    yield from (f"Its {'rows' if item.kind == 'table' else 'points'}: [{item.stem}.csv]({item.stem}.csv).", "")


def _markdown(headers: Sequence[str], rows: Sequence[Sequence[str | float]]) -> Iterator[str]:
    for cells in (headers, ["---"] * len(headers), *rows):
        yield f"| {' | '.join(_cell(cell) for cell in cells)} |"


def _cell(cell: str | float) -> str:
    return cell.replace("|", "\\|") if isinstance(cell, str) else shown_number(float(cell))


def _row(item: Item, number: PrintedNumber) -> tuple[str | float | None, ...]:
    return (
        str(item),
        number.of,
        number.unit,
        number.printed,
        number.ours,
        None if number.ours is None else number.difference,
        number.tolerance,
        number.verdict,
        number.why,
    )


def _plain(cell: str | float | None) -> str | float | None:
    return cell if cell is None or isinstance(cell, str) else float(cell)


def _csv(headers: Sequence[str], rows: Iterable[Sequence[str | float | None]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(headers)
    writer.writerows([repr(float(cell)) if isinstance(cell, int | float) else cell for cell in row] for row in rows)
    return text.getvalue()
