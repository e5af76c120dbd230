"""Write what `trajevo study collect` produces: a page, a table, a dataset, comparisons of levels, and plots."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt

from trajevo.base.files import own_folder, why_not, write_whole
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError
from trajevo.exporters.exporter import cell
from trajevo.study.page import PAGE_FILE, study_page
from trajevo.study.plots import attainments, hypervolume_bands, hypervolume_boxes
from trajevo.study.results import StudyResults
from trajevo.study.statistics import Comparison, compare_levels

COMPARISONS_FILE, PLOTS_FOLDER = "comparisons.csv", "plots"


@dataclass(frozen=True)
class StudyReport:
    """What was written about a study.

    Attributes:
        files: files that were written.
        comparisons: comparisons of every pair of levels of every factor.
        notes: what could not be compared or drawn, one sentence each.
    """

    files: tuple[Path, ...]
    comparisons: tuple[Comparison, ...]
    notes: tuple[str, ...]

    __repr__ = brief


def write_study(results: StudyResults, folder: str | Path | None = None) -> StudyReport:
    """Write the page, the table, the dataset, the comparisons and the plots of a study.

    The page, ``study.html``, opens from disk without network: fronts of all cells over one another, cells as lines from
    their levels to what they found, tables that sort, and the plots.

    Args:
        results: results of :func:`trajevo.study.collection.collect`.
        folder: folder to write to; the study's folder if None.

    Raises:
        InvalidInputError: the folder cannot be written.
    """
    place = results.folder if folder is None else Path(folder)
    files = list(results.save(place))
    comparisons: list[Comparison] = []
    notes: list[str] = []
    for factor in results.record.factors:
        try:
            comparisons += compare_levels(results, factor)
        except InvalidInputError as error:
            notes.append(f"not compared: {error}")
    try:
        write_whole(place / COMPARISONS_FILE, _table(comparisons).encode())
        drawn = _pictures(results, place / PLOTS_FOLDER, notes)
        shown = {_caption(file): file.read_bytes() for file in drawn}
        write_whole(place / PAGE_FILE, study_page(results, place / PAGE_FILE, comparisons=comparisons, pictures=shown))
        files += [place / COMPARISONS_FILE, *drawn, place / PAGE_FILE]
    except OSError as error:
        raise InvalidInputError(f"{place}: the results cannot be written there: {why_not(error)}") from error
    return StudyReport(tuple(files), tuple(comparisons), tuple(notes))


def _table(comparisons: list[Comparison]) -> str:
    stream = io.StringIO()
    writer = csv.writer(stream)
    writer.writerow([field.name for field in fields(Comparison)])
    for comparison in comparisons:
        writer.writerow(cell(value) if isinstance(value, str) else value for value in astuple(comparison))
    return stream.getvalue()


def _caption(file: Path) -> str:
    """What a picture shows, by its name, such as ``"hypervolume by payload"``."""
    what, _, factor = file.stem.partition("_")
    return f"{what} of all cells" if factor == "all" else f"{what} by {factor}"


def _pictures(results: StudyResults, folder: Path, notes: list[str]) -> list[Path]:
    own_folder(folder)
    drawings: dict[str, Callable[[StudyResults, str | None], Any]] = {
        "hypervolume": hypervolume_boxes,
        "generations": hypervolume_bands,
        "attainment": lambda results, factor: attainments(results, factor)[0],
    }
    factors: list[str | None] = [*results.record.factors]
    written = []
    for factor in factors or [None]:
        for name, draw in drawings.items():
            file = folder / f"{name}_{factor or 'all'}.png"
            try:
                figure = draw(results, factor).figure
            except InvalidInputError as error:
                notes.append(f"not drawn: {file.name}: {error}")
                continue
            stream = io.BytesIO()
            figure.savefig(stream, format="png", dpi=150)
            plt.close(figure)
            write_whole(file, stream.getbuffer())
            written.append(file)
    return written
