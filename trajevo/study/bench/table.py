"""The table of a benchmark: a row for each rival on each problem, and where trajevo is behind, it says so."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

import numpy as np

from trajevo.base.files import why_not, write_whole
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError
from trajevo.exporters.exporter import cell
from trajevo.study.bench.record import BenchResults, BenchRun
from trajevo.study.bench.score import SHARES

#: Files of the table.
CSV_FILE, MARKDOWN_FILE = "table.csv", "table.md"

#: Excess over a limit, as a share of it, above which a rival's motions are no solutions, so that none is behind it.
BROKEN = 1e-3

#: Name of our own rows.
OURS = "trajevo"


class Quartiles(NamedTuple):
    """Lower quartile, median and upper quartile of runs, each that of a run; infinite where it never came."""

    low: float
    median: float
    high: float

    @classmethod
    def of(cls, values: Iterable[float]) -> Quartiles:
        """Quartiles of values, some of which may be infinite; NaN without any."""
        given = list(values)
        if not given:
            return cls(np.nan, np.nan, np.nan)
        found = np.quantile(given, (0.25, 0.5, 0.75), method="inverted_cdf")
        return cls(*map(float, found))

    def told(self, factor: float = 1.0, digits: int = 3) -> str:
        """The median, and the quartiles in brackets."""
        low, median, high = (f"{factor * one:.{digits}g}" if np.isfinite(one) else "never" for one in self)
        return median if low == high == median else f"{median} ({low} to {high})"


@dataclass(frozen=True)
class BenchRow:
    """A rival on a problem, over its runs.

    Attributes:
        problem: name of the problem.
        rival: name of the rival.
        runs: number of runs that were scored.
        times: CPU time to every share of :data:`~trajevo.study.bench.score.SHARES` [s].
        share: share of the best known at the end.
        violation: greatest excess over a limit of any member that was looked at, as a share of it; None if none was.
        over: median time over that of trajevo to the same share, the greatest that both reach; None if there is none.
        said: how trajevo stands, or why a rival has no score.
        stated: whether the rival can be set on the problem.
    """

    problem: str
    rival: str
    runs: int
    times: tuple[Quartiles, ...]
    share: Quartiles
    violation: float | None
    over: float | None = None
    said: str = ""
    stated: bool = True

    __repr__ = brief

    @property
    def sound(self) -> bool:
        """Whether it has found anything, and no motion that was looked at breaks a limit between samples."""
        return self.found and (self.violation is None or self.violation <= BROKEN)

    @property
    def found(self) -> bool:
        """Whether it has found anything."""
        return self.runs > 0 and self.share.high > 0.0

    @property
    def rank(self) -> tuple[float, ...]:
        """The less, the better: times to the greatest share first, then what was reached at the end."""
        return (*(one.median for one in reversed(self.times)), -self.share.median)


#: Headers of the table.
HEADERS = (
    "problem",
    "rival",
    "runs",
    *(f"time to {100.0 * share:g} % [s]" for share in SHARES),
    "share of the best known [%]",
    "greatest violation [%]",
    "time / trajevo's",
    "note",
)


def rows_of(results: BenchResults) -> tuple[BenchRow, ...]:
    """The rows of a table: trajevo first, then the others, problem by problem."""
    rows = []
    for _, runs in groupby(results.runs, key=lambda run: run.problem):
        rows += _of_problem([_row(list(own)) for _, own in groupby(runs, key=lambda run: run.rival)])
    return tuple(rows)


def cells_of(row: BenchRow) -> tuple[str, ...]:
    """A row as text, a cell for each of :data:`HEADERS`."""
    if not row.runs:
        return (row.problem, row.rival, "0", *("" for _ in SHARES), "", "", "", row.said)
    over = "" if row.over is None else f"{row.over:.3g}"
    violation = (
        "not looked at" if row.violation is None else f"{100.0 * row.violation:.2g}" if row.violation > 0.0 else "none"
    )
    times = (one.told() for one in row.times)
    return (row.problem, row.rival, str(row.runs), *times, row.share.told(100.0, 4), violation, over, row.said)


def markdown(results: BenchResults) -> str:
    """The table as Markdown, with what has to be known to read it above."""
    lines = [f"{heading(results)}\n", _line(HEADERS), _line(["---"] * len(HEADERS))]
    rows = [_line(cells_of(row)) for row in rows_of(results) if row.stated]
    return "\n".join([*lines, *rows, *(f"\n{told}" for told in left_out(results))]) + "\n"


def left_out(results: BenchResults) -> tuple[str, ...]:
    """Which rivals cannot be set on which problems, and why; a line for those that share both."""
    problems: dict[tuple[str, str], list[str]] = {}
    for row in rows_of(results):
        if not row.stated:
            problems.setdefault((row.rival, row.said), []).append(row.problem)
    rivals: dict[tuple[str, str], list[str]] = {}
    for (rival, why), named in problems.items():
        rivals.setdefault((", ".join(named), why), []).append(rival)
    return tuple(f"{', '.join(those)}: no row for {named}: {why}" for (named, why), those in rivals.items())


def heading(results: BenchResults) -> str:
    """Seeds, CPU time and machines of the runs, one sentence."""
    budgets = sorted({run.budget for run in results.runs})
    machines = sorted({f"{run.machine.processor}, {run.machine.cores} cores" for run in results.runs})
    seeds = len({run.seed for run in results.runs})
    told = " or ".join(f"{budget:g}" for budget in budgets)
    return f"{seeds} seeds, {told} s of CPU time a run, on {' and '.join(machines)}: medians (quartiles)"


def comma_separated(results: BenchResults) -> str:
    """The table as CSV, numbers in columns of their own."""
    stream = io.StringIO()
    writer = csv.writer(stream)
    spread = [f"{name} {which}" for name in HEADERS[3:6] for which in ("lower quartile", "median", "upper quartile")]
    writer.writerow([*HEADERS[:3], *spread, *HEADERS[6:]])
    for row in rows_of(results):
        share = (100.0 * value for value in row.share)
        values = [value for one in row.times for value in one] + list(share)
        numbers = [repr(value) if row.runs and np.isfinite(value) else "" for value in values]
        violation = "" if not row.found else "not looked at" if row.violation is None else repr(100.0 * row.violation)
        over = "" if row.over is None else repr(row.over)
        writer.writerow([cell(row.problem), cell(row.rival), row.runs, *numbers, violation, over, cell(row.said)])
    return stream.getvalue()


def write_table(results: BenchResults, folder: str | Path) -> tuple[Path, ...]:
    """Write the table as CSV and as Markdown.

    Raises:
        InvalidInputError: the folder cannot be written.
    """
    place = Path(folder)
    try:
        place.mkdir(parents=True, exist_ok=True)
        write_whole(place / CSV_FILE, comma_separated(results).encode())
        write_whole(place / MARKDOWN_FILE, markdown(results).encode())
    except OSError as error:
        raise InvalidInputError(f"{folder}: the table cannot be written there: {why_not(error)}") from error
    return place / CSV_FILE, place / MARKDOWN_FILE


def _row(runs: Sequence[BenchRun]) -> BenchRow:
    """A rival on a problem, not yet compared."""
    scored = [run for run in runs if run.end == "scored"]
    # A run that ended early without any error is told by its score; what failed is told in words.
    said = next((run.said for run in runs if run.end != "scored" or run.said.startswith("failed")), "")
    return BenchRow(
        problem=runs[0].problem,
        rival=runs[0].rival,
        runs=len(scored),
        times=tuple(Quartiles.of(run.time_to(share) for run in scored) for share in SHARES),
        share=Quartiles.of(run.share for run in scored),
        violation=max((run.violation for run in scored if run.violation is not None), default=None),
        said=said,
        stated=any(run.end != "not stated" for run in runs),
    )


def _of_problem(rows: Sequence[BenchRow]) -> list[BenchRow]:
    """The rows of a problem with their times over trajevo's, and with what is said of them."""
    ours = next((row for row in rows if row.rival == OURS and row.runs), None)
    return [_compared(row, ours, rows) for row in rows]


def _compared(row: BenchRow, ours: BenchRow | None, rows: Sequence[BenchRow]) -> BenchRow:
    said = row.said
    if row is ours and row.sound:
        said = "; ".join(filter(None, (_stands(row, rows), said)))
    elif row.runs and not row.found:
        said = said or "found nothing that keeps the limits"
    elif row.runs and not row.sound:
        said = "; ".join(filter(None, ("breaks limits between its samples", said)))
    return BenchRow(**{**vars(row), "over": _over(row, ours), "said": said})


def _over(row: BenchRow, ours: BenchRow | None) -> float | None:
    """Median time over trajevo's to the greatest share that both reach."""
    if ours is None or row is ours or not row.runs:
        return None
    for theirs, own in zip(reversed(row.times), reversed(ours.times), strict=True):
        if np.isfinite(theirs.median) and np.isfinite(own.median) and own.median > 0.0:
            return theirs.median / own.median
    return None


def _stands(ours: BenchRow, rows: Sequence[BenchRow]) -> str:
    """How trajevo stands among the rivals of a problem."""
    others = [row for row in rows if row is not ours and row.sound]
    better = [row for row in others if row.rank < ours.rank]
    if better:
        return "behind " + ", ".join(row.rival for row in sorted(better, key=lambda row: row.rank))
    return "ahead" if others else ""


def _line(cells: Iterable[str]) -> str:
    return "| " + " | ".join(text.replace("|", "\\|") for text in cells) + " |"
