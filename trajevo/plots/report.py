"""Report of a run as one self-contained HTML file: settings, front, choices, motion of the knee."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from string import Template
from typing import Any

import numpy as np

from trajevo.base.units import display, known_digits, pretty
from trajevo.capacity.payload_studies import Carried
from trajevo.errors import TrajevoError
from trajevo.front.exchange_rates import ExchangeRates
from trajevo.front.front import Front, Solution
from trajevo.front.records import ProblemRecord, Run
from trajevo.front.thinning import told_share
from trajevo.path.loads import told_loads
from trajevo.plots.analyses import analyse
from trajevo.plots.pictures import PAYLOAD_FIGURES, Picture, draw_all, written
from trajevo.robot.payload import LOAD_MODELS, Payload
from trajevo.solvers.gradient.optimality import anchors_told
from trajevo.solvers.rivals import RIVALS_NOTE, Rival, rivals_table
from trajevo.verification.certificate import Certificate
from trajevo.verification.shares import shares_used

_TEMPLATE = Path(__file__).with_name("report.html")

#: Share by which limits and objectives are relaxed in the table of what they would buy.
_RELAXED = 0.05


def objective_headers(front: Front, *, angle: str | None = None) -> list[tuple[str, float]]:
    """For each objective, the column header with its unit and the factor from SI."""
    record = front.record
    shown = [
        display(objective.unit, angle=angle or record.angle, length=record.length) for objective in record.objectives
    ]
    return [
        (f"{objective.name} [{pretty(unit)}]", factor)
        for objective, (unit, factor) in zip(front.record.objectives, shown, strict=True)
    ]


def known_values(front: Front, rows: Sequence[int], factors: Sequence[float]) -> list[list[str]]:
    """Objectives of rows of a front times factors from SI, with as many digits as are known of them."""
    values, known_to = (array * np.array(factors) for array in (front.F[list(rows)], front.known_to(rows)))
    return [list(map(known_digits, *pair)) for pair in zip(values.tolist(), known_to.tolist(), strict=True)]


def run_facts(front: Front, *, brief: bool = False) -> list[tuple[str, str]]:
    """The facts about a run, as labels and texts.

    Args:
        front: the front of the run.
        brief: leave out points, tables and settings that are off, variables and versions, which may fill a screen.
    """
    run, record = front.run, front.record
    notes = _mass_notes(front)
    failures = f"{run.failures} of {run.evaluations} evaluations"
    settings, of_run = (_short(given) if brief else _told(given) for given in (record.settings, run.settings))
    facts = [
        ("problem", f"{record.title} ({record.name or 'not registered'})"),
        ("robot", f"{record.robot}: {record.robot_reference}"),
        *([("efforts", "; ".join(notes))] if notes else []),
        ("problem settings (SI)", _listed(settings) or "none"),
        ("payload", f"{_carried(record)}, {LOAD_MODELS[record.payload['model']]}"),
        ("variables", ", ".join(f"{v.name} in [{v.lower:g}, {v.upper:g}] {v.unit}" for v in record.variables)),
        ("algorithm", run.algorithm),
        ("settings", _listed(of_run)),
        ("seed", str(run.seed)),
        (
            "levels" if run.algorithm == "NNC" else "generations",
            f"{run.generations}{_interruption(run)}",
        ),
        ("evaluations", f"{run.evaluations} in {run.seconds:.2f} s"),
        ("failed evaluations", failures + (f", first: {run.first_failure}" if run.failures else "")),
        ("front", f"{len(front)} non-dominated feasible solutions"),
        *([("anchors", anchors_told(run.settings))] if anchors_told(run.settings) else []),
        ("hypervolume", f"{front.history.hypervolume[-1]:.6f} of the reference box" if len(front) else "0"),
        ("versions", ", ".join(f"{name} {number}" for name, number in run.versions.items())),
    ]
    left_out = {"variables", "versions", "front", *([] if run.failures else ["failed evaluations"])} if brief else ()
    return [(label, text) for label, text in facts if label not in left_out]


def _told(settings: dict[str, Any]) -> dict[str, Any]:
    """Settings with the length of the text of a robot's URDF in its place."""
    robot = settings.get("robot")
    if not isinstance(robot, dict) or not isinstance(robot.get("urdf"), str):
        return settings
    return settings | {"robot": robot | {"urdf": f"a text of {len(robot['urdf'])} characters"}}


def _short(settings: dict[str, Any]) -> dict[str, Any]:
    """Settings that are on and fit into some words: no tables, and no lists of lists or tables."""
    return {
        name: value
        for name, value in settings.items()
        if value is not None
        and name != "title"
        and not isinstance(value, dict)
        and not (isinstance(value, list | tuple) and (not value or isinstance(value[0], list | tuple | dict)))
    }


def _mass_notes(front: Front) -> tuple[str, ...]:
    """What the efforts of the robot do not cover; nothing if the problem is not at hand."""
    try:
        return front.problem.robot.mass_notes
    except TrajevoError:
        return ()


def _carried(record: ProblemRecord) -> str:
    """The mass of the payload, or its range if it is a variable."""
    variable = next((v for v in record.variables if (v.name, v.unit) == ("payload", "kg")), None)
    loads, mass = record.settings.get("payload"), None if variable is None else (variable.lower, variable.upper)
    if isinstance(loads, list):
        return told_loads(loads, mass)
    if variable is None:
        return f"{Payload.of(record.payload, model=None).mass:g} kg"
    return f"{variable.lower:g} to {variable.upper:g} kg"


def _interruption(run: Run) -> str:
    """Text that says whether a run was stopped or has been resumed."""
    by = f" by {run.stopped_by}" if run.stopped_by else ""
    told = [f"interrupted{by}"] if run.interrupted else []
    told += [f"resumed after {', '.join(map(str, run.resumed))}"] if run.resumed else []
    return f" ({'; '.join(told)})" if told else ""


def report(
    front: Front,
    file: str | Path,
    *,
    analyses: Mapping[str, Any] | None = None,
    pictures: Sequence[Picture] | None = None,
) -> Path:
    """Write the report of a front.

    Args:
        front: the front.
        file: HTML to write.
        analyses: analyses of the front from :func:`~trajevo.plots.analyses.analyse`; if None, all are computed now.
        pictures: pictures of the front from :func:`~trajevo.plots.pictures.draw_all`; drawn if None, none if empty.

    Raises:
        InvalidInputError: the file cannot be written.
    """
    facts = _table(("", ""), [(label, escape(text)) for label, text in run_facts(front)])
    if len(front):
        found = analyse(front) if analyses is None else analyses
        body = _sections(front, found, draw_all(front, found) if pictures is None else pictures)
    else:
        body = [f'<p class="alert">The front is empty: {escape(str(front.blocking))}.</p>']
    text = Template(_TEMPLATE.read_text(encoding="utf-8")).substitute(
        title=escape(front.record.title),
        subtitle=escape(f"{front.run.algorithm}, seed {front.run.seed}, {len(front)} solutions"),
        body="\n".join([*body, *_failed(front), "<h2>Run</h2>", facts]),
    )
    return written(Path(file), text.encode())


def _sections(front: Front, found: Mapping[str, Any], pictures: Sequence[Picture]) -> list[str]:
    """Sections about a front that is not empty, without what was not computed or drawn."""
    drawn = {picture.stem: _figure(picture) for picture in pictures}
    about_payload = [drawn.pop(stem) for stem in PAYLOAD_FIGURES if stem in drawn]
    wide = drawn.pop("front", "")
    notes = [f"<p>Note: {escape(note)}.</p>" for note in front.problem.notes]
    sections = ["<h2>Solutions</h2>", *notes, _choices_table(front)]
    if pictures:
        share = told_share(front.thinned(), front)
        sections += ["<h2>Front</h2>", f"<p>Pictures show {share}.</p>" if share else "", wide, _grid(drawn.values())]
    if about_payload or found.get("carried"):
        sections += ["<h2>Payload</h2>", _payload(found.get("carried") or ()), _grid(about_payload)]
    sections += ["<h2>Limits at the knee</h2>", _limits_table(front.knee())]
    if found.get("exchange_rates"):
        sections += ["<h2>What holds the knee back</h2>", *_exchange_rates(found["exchange_rates"])]
    if found.get("certificate"):
        sections += ["<h2>Certificate of the knee</h2>", *_certificate(found["certificate"])]
    return sections + _rivals(found.get("rivals") or ())


def _grid(figures: Iterable[str]) -> str:
    return '<div class="pictures">' + "".join(figures) + "</div>"


def _payload(carried: Sequence[Carried]) -> str:
    """Table of the payloads that the chosen solutions can carry, and of what would allow more."""
    rows = [
        (escape(one.rule), escape(str(one.capacity)), escape(str(one.sensitivity)) if one.sensitivity else "")
        for one in carried
    ]
    return _table(("solution", "largest payload", "what would give more"), rows) if rows else ""


def _listed(settings: dict[str, Any]) -> str:
    return ", ".join(f"{key} = {_brief(value)}" for key, value in settings.items())


def _brief(value: Any) -> str:
    """Numbers to six digits, in lists too; the front's file holds all digits."""
    if isinstance(value, list | tuple):
        return "(" + ", ".join(_brief(entry) for entry in value) + ")"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _choices_table(front: Front) -> str:
    headers = objective_headers(front)
    choices = front.choices()
    values = known_values(front, [one.index for one in choices], [factor for _, factor in headers])
    rows = [
        (escape(one.rule), *texts, str(one.index), escape(one.reason))
        for one, texts in zip(choices, values, strict=True)
    ]
    return _table(
        ("solution", *(header for header, _ in headers), "row", "why"), rows, numbers=len(headers) + 1, chosen=0
    )


def _limits_table(solution: Solution) -> str:
    rows = [(escape(name), f"{100.0 * share:.2f} %") for name, share in shares_used(solution).items()]
    return _table(("limit", "used"), rows, numbers=1)


def _exchange_rates(rates: Sequence[ExchangeRates]) -> list[str]:
    """What a little more of each limit would buy of every objective."""
    rows = [
        (escape(f"{one.objective} by {name}"), escape(segments), escape(change))
        for one in rates
        for name, segments, change in one.table(_RELAXED)
    ]
    told = [f"<p>{escape(one.told)}.</p>" for one in rates]
    ends = {name for one in rates for name in one.ends}
    told += [f"<p>At an end of their range: {escape(', '.join(sorted(ends)))}.</p>"] if ends else []
    headers = (f"relaxed by {100.0 * _RELAXED:g} %", "in segments", "change")
    return [*told, *([_table(headers, rows, numbers=2)] if rows else [])]


def _certificate(certificate: Certificate) -> list[str]:
    """What is proven at every instant, for each quantity's joint that is nearest to its limit."""
    rows = []
    for row in certificate.by_quantity:
        share = f"{100.0 * row.share:.3f} %" if np.isfinite(row.limit) and not row.least else ""
        cells = (row.name, row.shown(row.exhibited), row.at, row.bound_shown, row.limit_shown, share)
        rows.append(tuple(map(escape, cells)))
    for one in certificate.uncovered:
        shown = f"{100.0 * one.share:.3f} %" if one.samples else ""
        rows.append((escape(one.name), shown, "", "not covered", escape(one.reason), ""))
    headers = ("quantity", "nearest sample", "at", "proven", "limit", "proven share")
    alert = "" if certificate.proven else ' class="alert"'
    return [f"<p{alert}>{escape(str(certificate))}</p>", _table(headers, rows, numbers=5)]


def _rivals(rivals: Sequence[Rival]) -> list[str]:
    if not rivals:
        return []
    headers, rows = rivals_table(rivals)
    cells = [[escape(cell) for cell in row] for row in rows]
    return [
        "<h2>Interpolants at their least times under the same limits</h2>",
        _table(headers, cells, numbers=len(headers) - 1),
        f"<p>{escape(RIVALS_NOTE)}</p>",
    ]


def _failed(front: Front) -> list[str]:
    """Individuals whose evaluation failed, as far as the run lists them."""
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


def _figure(picture: Picture) -> str:
    data = base64.b64encode(picture.png).decode("ascii")
    caption = escape(picture.caption)
    wide = ' class="wide"' if picture.wide else ""
    image = f'<img alt="{caption}" src="data:image/png;base64,{data}">'
    return f"<figure{wide}>{image}<figcaption>{caption}</figcaption></figure>"
