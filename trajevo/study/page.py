"""The page of a study: one HTML file with the fronts of all cells to compare, and tables to read."""

from __future__ import annotations

import os
import shlex
from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from html import escape
from pathlib import Path
from string import Template
from typing import Any
from urllib.parse import quote

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.units import pretty
from trajevo.front.thinning import thinned
from trajevo.page.packing import Packed
from trajevo.page.parts import THEME, figure, folded, scripts_of, static, table
from trajevo.study.results import CellResult, StudyResults
from trajevo.study.statistics import Comparison

PAGE_FILE = "study.html"

#: The page of a run, in the folder of its cell, if there is one.
_RUN_PAGE = "report.html"

#: Scripts in the order in which they need each other.
_SCRIPTS = ("data.js", "canvas.js", "clock.js", "front.js", "study.js")

#: Greatest number of cells, greatest size of all points and of all pictures [byte], least number of points of a cell.
_CELLS, _ROOM, _PICTURES, _POINTS = 2000, 1_200_000, 1_200_000, 20

#: Greatest number of instants of the course of a run.
_INSTANTS = 60

_QUARTERS = (0.25, 0.5, 0.75)


def study_page(
    results: StudyResults,
    file: Path,
    *,
    comparisons: Sequence[Comparison] = (),
    pictures: Mapping[str, bytes] | None = None,
    sections: Sequence[str] = (),
    title: str | None = None,
) -> bytes:
    """The page of a study's results.

    With scripts it shows the fronts of all cells over one another, in colours of the levels of a factor, and every cell
    as a line from its levels to what it found; levels can be left out, and a click chooses a cell. Without scripts
    tables and pictures remain.

    Args:
        results: results of :func:`trajevo.study.collection.collect`.
        file: where the page will be, from which it links to the pages and folders of the cells.
        comparisons: comparisons of levels to show.
        pictures: caption -> picture as PNG, as many as there is room for.
        sections: HTML that stands before the tables.
        title: what it is called; by the problem or the task if None.
    """
    cells = _shown(results)
    pack, few = Packed(), _points(results, cells)
    data = _about(results, cells, file) | {
        "arm": None,
        "F": pack.add(np.concatenate([result.F[rows] for result, rows in zip(cells, few, strict=True)]), "f8"),
        "cell": pack.add(np.repeat(np.arange(len(cells)), [len(rows) for rows in few]), "u2"),
        "knee": [_knee(result, rows) for result, rows in zip(cells, few, strict=True)],
        "course": _course(cells, pack),
        "columns": _columns(results),
        "values": pack.add(_values(results, cells), "f8"),
    }
    record, origin = results.record, results.origin
    task = None if record.task is None else record.task.content.get("title")
    title = title or f"Study of {record.problem or task or 'a task'}"
    unfinished = f", {results.unfinished} not finished" if results.unfinished else ""
    text = Template(static("page.html")).substitute(
        title=escape(title),
        subtitle=escape(f"{results.folder.name}: {len(results.cells)} cells{unfinished}; seed {record.seed}; {origin}"),
        style=static("page.css"),
        theme=THEME,
        connect="",
        licence="",
        explorer=_told(results, cells, few) + static("study.html"),
        body="\n".join([*sections, *_sections(results, cells, file, comparisons, pictures or {})]),
        scripts=scripts_of(_SCRIPTS, data, pack, ""),
    )
    return text.encode()


def _shown(results: StudyResults) -> list[CellResult]:
    """The cells that the page has: all, or as many as it can, spread over the study."""
    count = min(len(results.cells), _CELLS)
    return [results.cells[k] for k in np.linspace(0, len(results.cells) - 1, count).round().astype(int)]


def _points(results: StudyResults, cells: Sequence[CellResult]) -> list[Array]:
    """Rows of the front of every cell that the page has, the knee and the ends of every objective among them."""
    width = len(results.objectives)
    sizes = np.array([len(result.F) for result in cells])
    room = int(_ROOM / (8 * width + 2))
    most = int(sizes.max(initial=0))
    if sizes.sum() > room:  # small fronts stay whole, all others get the same number of points
        fits = bisect_right(range(1, most + 1), room, key=lambda size: int(np.minimum(sizes, size).sum()))
        most = max(_POINTS, 2 * width + 2, fits)
    return [thinned(result.F, most, kept=_row_of(result)) for result in cells]


def _row_of(result: CellResult) -> list[int]:
    """The row of a cell's knee, if its front is not empty."""
    return [int(k) for k in np.flatnonzero(np.equal(result.F, result.knee).all(axis=1))[:1]]


def _knee(result: CellResult, rows: Array) -> int | None:
    """The place of a cell's knee among its points."""
    return next((int(np.searchsorted(rows, row)) for row in _row_of(result)), None)


def _about(results: StudyResults, cells: Sequence[CellResult], file: Path) -> dict[str, Any]:
    """What the page tells of the objectives, the factors and the cells."""
    shown = [results.display(k) for k in range(len(results.objectives))]
    labels = {factor: [level.label for level in levels] for factor, levels in results.record.factors.items()}
    return {
        "objectives": [
            {"name": name, "unit": _unit(unit), "factor": factor, "title": _titled(name, unit)}
            for name, unit, factor in shown
        ],
        "factors": [{"name": name, "levels": levels} for name, levels in labels.items()],
        "cells": [
            {
                "name": result.cell.name,
                "levels": [labels[factor].index(label) for factor, label in result.cell.labels.items()],
                "repeat": result.cell.repeat,
                "seed": result.cell.seed,
                "size": len(result.F),
                "failures": result.failures,
                "run": shlex.quote(str(results.folder / "cells" / result.cell.name)),
                "link": _link(results, result, file),
            }
            for result in cells
        ],
    }


def _course(cells: Sequence[CellResult], pack: Packed) -> dict[str, Any]:
    """Hypervolumes of the cells against individuals evaluated, at instants that are spread over each run."""
    few = [
        np.unique(np.linspace(0, len(result.hypervolume) - 1, min(len(result.hypervolume), _INSTANTS)).astype(int))
        for result in cells
    ]
    return {
        "begins": pack.add(np.cumsum([0, *map(len, few)]), "u4"),
        "evaluated": pack.add(_joined([result.evaluations[k] for result, k in zip(cells, few, strict=True)]), "f4"),
        "volumes": pack.add(_joined([result.hypervolume[k] for result, k in zip(cells, few, strict=True)]), "f4"),
    }


def _joined(arrays: Sequence[Array]) -> Array:
    return np.concatenate([np.asarray(one, dtype=np.float64) for one in arrays])


def _columns(results: StudyResults) -> list[dict[str, Any]]:
    """The axes of the lines of all cells: factors, then what the cells found; knees are told, and not drawn."""
    factors = [
        {"title": name, "levels": [level.label for level in levels], "drawn": len(levels) > 1}
        for name, levels in results.record.factors.items()
    ]
    found = [("hypervolume", "1", True), ("generations", "1", False), ("evaluations", "1", False), ("time", "s", False)]
    shown = [results.display(k) for k in range(len(results.objectives))]
    found += [(f"least {name}", unit, True) for name, unit, _ in shown]
    found += [(f"knee {name}", unit, False) for name, unit, _ in shown]
    told = {"time": "time of the run [s]"}
    return factors + [
        {"title": told.get(name, _titled(name, unit)), "levels": None, "drawn": drawn} for name, unit, drawn in found
    ]


def _values(results: StudyResults, cells: Sequence[CellResult]) -> Array:
    """Values of the columns in the units that are shown, shape (cells, columns); NaN where nothing was found."""
    by = np.array([results.display(k)[2] for k in range(len(results.objectives))])
    labels = [[level.label for level in levels] for levels in results.record.factors.values()]
    rows = []
    for result in cells:
        levels = [own.index(label) for own, label in zip(labels, result.cell.labels.values(), strict=True)]
        least = result.F.min(axis=0) if len(result.F) else np.full(len(by), np.nan)
        found = [result.hypervolume[-1], result.generations, result.evaluations[-1], result.seconds]
        rows.append([*levels, *found, *(least * by), *(result.knee * by)])
    return np.array(rows, dtype=np.float64)


def _link(results: StudyResults, result: CellResult, file: Path) -> dict[str, str]:
    """Where a browser finds the page of a cell, or its folder where it has none."""
    folder = results.folder / "cells" / result.cell.name
    page = folder / _RUN_PAGE
    place = page if page.is_file() else folder
    relative = os.path.relpath(place, file.parent.absolute()).replace(os.sep, "/")
    return {"to": quote(relative) + ("" if place == page else "/"), "text": "page" if place == page else "folder"}


def _told(results: StudyResults, cells: Sequence[CellResult], few: Sequence[Array]) -> str:
    """A note on what the page leaves out; empty if that is nothing."""
    said = []
    if len(cells) < len(results.cells):
        said.append(f"{len(cells):,} of {len(results.cells):,} cells, spread over the study")
    points, every = sum(map(len, few)), sum(len(result.F) for result in cells)
    if points < every:
        said.append(f"{points:,} of {every:,} points of their fronts, at most {max(map(len, few))} of a cell")
    return f'<p class="note live-only">Here are {"; ".join(said)}.</p>' if said else ""


def _sections(
    results: StudyResults,
    cells: Sequence[CellResult],
    file: Path,
    comparisons: Sequence[Comparison],
    pictures: Mapping[str, bytes],
) -> list[str]:
    sections = ["<h2>Levels</h2>", _levels_table(results), "<h2>Cells</h2>", _cells_table(results, cells, file)]
    if comparisons:
        sections += ["<h2>Levels compared</h2>", _comparisons_table(comparisons)]
        sections.append(
            '<p class="note">Wilcoxon signed-rank tests of hypervolumes over matched cells, p values corrected by '
            "Holm's method.</p>"
        )
    drawn, room = [], _PICTURES
    for caption, png in pictures.items():
        if len(png) <= room:
            room -= len(png)
            drawn.append(figure(caption, png))
    return [*sections, *([folded("Pictures", ['<div class="pictures">', *drawn, "</div>"])] if drawn else [])]


def _levels_table(results: StudyResults) -> str:
    """For every combination of levels, median and quartiles over its runs."""
    factors = list(results.record.factors)
    shown = [results.display(k) for k in range(len(results.objectives))]
    quantities = ["hypervolume", *(f"least {_titled(name, unit)}" for name, unit, _ in shown)]
    headers = [*factors, "runs", *(text for name in quantities for text in (f"{name}, median", "quartiles"))]
    groups: dict[tuple[str, ...], list[CellResult]] = {}
    for result in results.cells:
        groups.setdefault(tuple(result.cell.labels.values()), []).append(result)
    rows = []
    for labels, runs in groups.items():
        columns = [np.array([result.hypervolume[-1] for result in runs])]
        found = np.array([result.F.min(axis=0) for result in runs if len(result.F)]).reshape(-1, len(shown))
        columns += [column * factor for column, (_, _, factor) in zip(found.T, shown, strict=True)]
        rows.append([*map(escape, labels), str(len(runs)), *(text for one in columns for text in _spread(one))])
    return table(headers, rows, numbers=len(headers) - len(factors), after=len(factors), key="levels")


def _spread(values: Array) -> Iterator[str]:
    """Median and quartiles as texts."""
    if not len(values):
        yield from ("none", "")
        return
    low, middle, high = np.quantile(values, _QUARTERS)
    yield f"{middle:.6g}"
    yield f"{low:.6g} to {high:.6g}"


def _cells_table(results: StudyResults, cells: Sequence[CellResult], file: Path) -> str:
    """Every cell with what it found, and where its run is."""
    factors, columns = list(results.record.factors), _columns(results)
    values = _values(results, cells)[:, len(factors) :]
    titles = [column["title"] for column in columns[len(factors) :]]
    headers = [*factors, "repeat", *titles, "solutions", "failed", "run"]
    rows = []
    for result, own in zip(cells, values.tolist(), strict=True):
        link = _link(results, result, file)
        numbers = ["none" if np.isnan(value) else f"{value:.6g}" for value in own]
        counted = [str(len(result.F)), str(result.failures)]
        where = f'<a href="{escape(link["to"])}">{link["text"]}</a>'
        rows.append([*map(escape, result.cell.labels.values()), str(result.cell.repeat), *numbers, *counted, where])
    return table(headers, rows, numbers=len(titles) + 3, after=len(factors), key="cells")


def _comparisons_table(comparisons: Sequence[Comparison]) -> str:
    rows = [
        (
            escape(one.factor),
            escape(f"{one.first} - {one.second}"),
            str(one.pairs),
            f"{one.difference:.3g}",
            f"{one.effect:.2f}",
            f"{one.p:.3g}",
            f"{one.p_holm:.3g}",
        )
        for one in comparisons
    ]
    return table(("factor", "levels", "pairs", "difference", "effect", "p", "p, Holm"), rows, numbers=5, after=2)


def _unit(unit: str) -> str:
    return "" if unit == "1" else pretty(unit)


def _titled(name: str, unit: str) -> str:
    return f"{name} [{_unit(unit)}]" if _unit(unit) else name
