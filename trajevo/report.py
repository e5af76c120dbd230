"""A run as one HTML file that needs nothing else: settings, front, choices, motion of the knee."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterator, Sequence
from html import escape
from pathlib import Path
from string import Template
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

from trajevo import path_plots, plots
from trajevo.composed import ComposedBatch
from trajevo.errors import InvalidInputError
from trajevo.files import write_whole
from trajevo.front import Front, Solution
from trajevo.load_plots import effort_utilisation
from trajevo.payload import LOAD_MODELS
from trajevo.records import Run
from trajevo.rivals import RIVALS_NOTE, plot_rivals, rivals_of, rivals_table
from trajevo.units import display, pretty

#: Figures wider than this scroll sideways on a small screen instead of shrinking [inch].
_WIDE = 10.0

_TEMPLATE = Path(__file__).with_name("report.html")


def objective_headers(front: Front, *, angle: str | None = None) -> list[tuple[str, float]]:
    """Per objective the column header with its unit and the factor from SI."""
    record = front.record
    shown = [
        display(objective.unit, angle=angle or record.angle, length=record.length) for objective in record.objectives
    ]
    return [
        (f"{objective.name} [{pretty(unit)}]", factor)
        for objective, (unit, factor) in zip(front.record.objectives, shown, strict=True)
    ]


def run_facts(front: Front) -> list[tuple[str, str]]:
    """What is to be said of a run, as label and text."""
    run, record = front.run, front.record
    failures = f"{run.failures} of {run.evaluations} evaluations"
    return [
        ("problem", f"{record.title} ({record.name or 'not registered'})"),
        ("robot", f"{record.robot}: {record.robot_reference}"),
        ("problem settings (SI)", _listed(record.settings) or "none"),
        ("payload", f"{record.payload['mass']:g} kg, {LOAD_MODELS[record.payload['model']]}"),
        ("variables", ", ".join(f"{v.name} in [{v.lower:g}, {v.upper:g}] {v.unit}" for v in record.variables)),
        ("algorithm", run.algorithm),
        ("settings", _listed(run.settings)),
        ("seed", str(run.seed)),
        (
            "levels" if run.algorithm == "NNC" else "generations",
            f"{run.generations}{_interruption(run)}",
        ),
        ("evaluations", f"{run.evaluations} in {run.seconds:.2f} s"),
        ("failed evaluations", failures + (f", first: {run.first_failure}" if run.failures else "")),
        ("front", f"{len(front)} non-dominated feasible solutions"),
        ("hypervolume", f"{front.history.hypervolume[-1]:.6f} of the reference box" if len(front) else "0"),
        ("versions", ", ".join(f"{name} {number}" for name, number in run.versions.items())),
    ]


def _interruption(run: Run) -> str:
    """Whether a run was stopped or has been resumed."""
    by = f" by {run.stopped_by}" if run.stopped_by else ""
    told = [f"interrupted{by}"] if run.interrupted else []
    told += [f"resumed after {', '.join(map(str, run.resumed))}"] if run.resumed else []
    return f" ({'; '.join(told)})" if told else ""


#: File stems of all pictures that a run may have.
FIGURES = (
    "front",
    "front_3d",
    "parallel",
    "hypervolume",
    "profiles",
    "path",
    "parameter",
    "tool_path",
    "effort",
    "rivals",
)


def figures(front: Front) -> Iterator[tuple[str, str, Any]]:
    """Every picture of a run, one at a time: file stem, caption, figure."""
    knee = front.knee()
    if front.F.shape[1] > 1:
        yield "front", "The front, every pair of objectives", plots.front(front, mark=knee)[0].figure
    if front.F.shape[1] > 2:
        yield "front_3d", "The front, three objectives", plots.front_3d(front, mark=knee).figure
    yield "parallel", "Trade-offs: one line per solution", plots.parallel_coordinates(front, mark=knee).figure
    yield "hypervolume", "Hypervolume by generation", plots.hypervolume(front).figure
    yield "profiles", "Joint motion of the knee inside its limits (dashed)", plots.profiles(knee)[0].figure
    along = isinstance(knee.trajectory, ComposedBatch)
    if along and knee.trajectory.n_joints == 2:
        yield "path", "The path, its control polygon, and the speed of the knee", path_plots.path(knee).figure
    else:
        yield "tool_path", "Path of the tool at the knee", plots.tool_path(knee).figure
    if along:
        named = {solution.rule: solution for solution in front.choices()}
        yield "parameter", "The path's parameter over time", path_plots.parameter(named).figure
    if np.isfinite(front.problem.robot.limits.effort).any():
        yield "effort", "Effort at the knee as a share of its limits", effort_utilisation(knee).figure
    if front.problem.compares_rivals:
        rivals = plot_rivals(rivals_of(front.problem))[0].figure
        yield "rivals", "Interpolants at their least times under the same limits", rivals


def save_figures(front: Front, folder: Path) -> list[Path]:
    """Write every picture of a run as PNG; an empty front has none.

    Raises:
        InvalidInputError: one cannot be written.
    """
    files = []
    for stem, _, figure in figures(front) if len(front) else ():
        files.append(save_figure(figure, folder / f"{stem}.png"))
    return files


def save_figure(figure: Any, file: Path) -> Path:
    """Write one picture as PNG.

    Raises:
        InvalidInputError: it cannot be written.
    """
    return _written(file, _png(figure, 150))


def report(front: Front, file: str | Path) -> Path:
    """Write the report of a front.

    Raises:
        InvalidInputError: the file cannot be written.
    """
    facts = _table(("", ""), [(label, escape(text)) for label, text in run_facts(front)])
    if len(front):
        pictures = {stem: _picture(caption, figure) for stem, caption, figure in figures(front)}
        wide = pictures.pop("front", "")
        body = [
            "<h2>Solutions</h2>",
            _choices_table(front),
            "<h2>Front</h2>",
            wide,
            '<div class="pictures">' + "".join(pictures.values()) + "</div>",
            "<h2>Limits at the knee</h2>",
            _limits_table(front.knee()),
            *_rivals(front),
        ]
    else:
        body = [f'<p class="alert">The front is empty: {escape(str(front.blocking))}.</p>']
    text = Template(_TEMPLATE.read_text(encoding="utf-8")).substitute(
        title=escape(front.record.title),
        subtitle=escape(f"{front.run.algorithm}, seed {front.run.seed}, {len(front)} solutions"),
        body="\n".join([*body, *_failed(front), "<h2>Run</h2>", facts]),
    )
    return _written(Path(file), text.encode())


def _written(file: Path, content: bytes) -> Path:
    try:
        write_whole(file, content)
    except OSError as error:
        raise InvalidInputError(f"{file}: cannot be written: {error.strerror}") from error
    return file


def _listed(settings: dict[str, Any]) -> str:
    return ", ".join(f"{key} = {_brief(value)}" for key, value in settings.items())


def _brief(value: Any) -> str:
    """Numbers to six digits, in lists too: the file holds all of them."""
    if isinstance(value, list | tuple):
        return "(" + ", ".join(_brief(entry) for entry in value) + ")"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _choices_table(front: Front) -> str:
    headers = objective_headers(front)
    rows = [
        (
            escape(solution.rule),
            *(f"{value * factor:.5g}" for value, (_, factor) in zip(solution.F.values(), headers, strict=True)),
            str(solution.index),
            escape(solution.reason),
        )
        for solution in front.choices()
    ]
    return _table(
        ("solution", *(header for header, _ in headers), "row", "why"), rows, numbers=len(headers) + 1, chosen=0
    )


def _limits_table(solution: Solution) -> str:
    rows = [(escape(name), f"{100.0 * (1.0 + value):.2f} %") for name, value in solution.G.items()]
    return _table(("limit", "used"), rows, numbers=1)


def _rivals(front: Front) -> list[str]:
    if not front.problem.compares_rivals:
        return []
    headers, rows = rivals_table(rivals_of(front.problem))
    cells = [[escape(cell) for cell in row] for row in rows]
    return [
        "<h2>Interpolants at their least times under the same limits</h2>",
        _table(headers, cells, numbers=len(headers) - 1),
        f"<p>{escape(RIVALS_NOTE)}</p>",
    ]


def _failed(front: Front) -> list[str]:
    """Individuals whose evaluation gave no numbers, as far as they are listed."""
    run = front.run
    rows = [(escape(one.said), escape(_brief(list(one.x)))) for one in run.failed]
    counted = f"{run.failures}, the first {len(rows)} of them" if run.failures > len(rows) else str(run.failures)
    return (
        [f"<h2>Failed evaluations: {counted}</h2>", _table(("what happened", "decision vector (SI)"), rows)]
        if rows
        else []
    )


def _table(
    headers: Sequence[str], rows: Sequence[Sequence[str]], *, numbers: int = 0, chosen: int | None = None
) -> str:
    """Rows of HTML cells; the ``numbers`` columns after the first are aligned right."""

    def cell(tag: str, column: int, content: str) -> str:
        kind = ' class="number"' if 0 < column <= numbers else ""
        return f"<{tag}{kind}>{content}</{tag}>"

    head = "".join(cell("th", i, escape(header)) for i, header in enumerate(headers)) if any(headers) else ""
    body = "".join(
        f"<tr{' class=chosen' if k == chosen else ''}>"
        + "".join(cell("td", i, text) for i, text in enumerate(row))
        + "</tr>"
        for k, row in enumerate(rows)
    )
    return f'<div class="scroll"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'


def _picture(caption: str, figure: Any) -> str:
    data = base64.b64encode(_png(figure, 110)).decode("ascii")
    image = f'<img alt="{escape(caption)}" src="data:image/png;base64,{data}">'
    wide = ' class="wide"' if figure.get_figwidth() > _WIDE else ""
    return f"<figure{wide}>{image}<figcaption>{escape(caption)}</figcaption></figure>"


def _png(figure: Any, dpi: int) -> bytes:
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=dpi, bbox_inches="tight")
    plt.close(figure)
    return stream.getvalue()
