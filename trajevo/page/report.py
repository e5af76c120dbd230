"""The page of a run as one self-contained HTML file: the front and its motions to explore, and tables to read."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from trajevo.base.files import named_file
from trajevo.capacity.payload_studies import Carried
from trajevo.errors import checked_name
from trajevo.front.exchange_rates import ExchangeRates
from trajevo.front.front import Front, Solution
from trajevo.front.notebook import small_pictures, told_base
from trajevo.front.thinning import told_share
from trajevo.page.explorer import explorer
from trajevo.page.facts import brief, known_values, objective_headers, run_facts, visit_rows
from trajevo.page.parts import THEME, figure, folded, static, table, viewer_licence
from trajevo.plots.analyses import analyse
from trajevo.plots.pictures import PAYLOAD_FIGURES, Picture, draw_all, written
from trajevo.verification.certificate import Certificate
from trajevo.verification.front_bound import FrontBound
from trajevo.verification.shares import shares_used

if TYPE_CHECKING:
    from trajevo.solvers.rivals import Rival

#: Of which solutions a page holds certificates and files.
FILES = ("knee", "choices")

#: Share by which limits and objectives are relaxed in the table of what they would buy.
_RELAXED = 0.05


def report(
    front: Front,
    file: str | Path,
    *,
    analyses: Mapping[str, Any] | None = None,
    pictures: Sequence[Picture] | None = None,
    files: Literal["knee", "choices"] = "choices",
    run: str | None = None,
    problem: str | None = None,
    live: Mapping[str, Any] | None = None,
) -> Path:
    """Write the page of a front: HTML that opens from disk, without network.

    With scripts it shows the front in every pair of objectives, in space and as parallel coordinates, the motion of any
    solution against its limits, and the robot moving along it; solutions can be pinned and compared. Without scripts
    tables and pictures remain.

    Args:
        front: the front. Of a large one, the page has as many solutions as it has room for, spread over it.
        file: HTML to write.
        analyses: analyses of the front from :func:`~trajevo.plots.analyses.analyse`; if None, all are computed now.
        pictures: pictures of the front from :func:`~trajevo.plots.pictures.draw_all`; drawn if None, none if empty.
        files: of which solutions the page holds certificate and files (CSV, JSON, ROS 2) to save: ``"knee"`` alone, or
            all ``"choices"``.
        run: what the commands that the page names call the run; the folder of the file if None.
        problem: what these commands need as ``--problem``, for a problem that was made in Python; if None, the page
            says what to put there.
        live: of a page that is served, see :mod:`trajevo.page.server`: what it needs to follow its run.

    Raises:
        UnknownNameError: another word for ``files``.
        InvalidInputError: the file cannot be written.
    """
    checked_name("files", files, FILES)
    target = named_file(file)
    facts = table(("", ""), [(label, escape(text)) for label, text in run_facts(front)])
    top, scripts = "", ""
    if len(front):
        found = analyse(front) if analyses is None else analyses
        choices = front.choices()
        held = choices[:1] if files == "knee" else choices
        drawn = draw_all(front, found) if pictures is None else pictures
        taken = sum(4 * len(picture.png) // 3 for picture in drawn)
        named = run or str(target.parent)
        part = explorer(front, found, run=named, choices=held, taken=taken, problem=problem, live=live)
        shown = f'<p class="note live-only">Here are {part.share}.</p>' if part.share else ""
        top, scripts = shown + part.body, part.scripts
        body = _sections(choices, found, drawn)
    else:
        body = [f'<p class="alert">The front is empty: {escape(str(front.blocking))}.</p>']
    text = Template(static("page.html")).substitute(
        title=escape(front.record.title),
        subtitle=escape(f"{front.record.robot}; {front.run.algorithm}, seed {front.run.seed}, {len(front)} solutions"),
        style=static("page.css"),
        theme=THEME if scripts else "",
        connect="'self' " if live else "",
        licence=escape(viewer_licence()) if scripts else "",
        explorer=top,
        body="\n".join([*body, *_failed(front), folded("Run", [facts])]),
        scripts=scripts,
    )
    return written(target, text.encode())


def _sections(choices: Sequence[Solution], found: Mapping[str, Any], pictures: Sequence[Picture]) -> list[str]:
    """Sections about a front that is not empty, without what was not computed or drawn.

    Args:
        choices: the front's choices, the knee first.
        found: analyses of the front.
        pictures: pictures of the front.
    """
    front = choices[0].front
    drawn = {picture.stem: figure(picture.caption, picture.png, wide=picture.wide) for picture in pictures}
    about_payload = [drawn.pop(stem) for stem in PAYLOAD_FIGURES if stem in drawn]
    wide = drawn.pop("front", "")
    notes = [f"<p>Note: {escape(note)}.</p>" for note in front.problem.notes]
    sections = ["<h2>Solutions</h2>", *notes, _choices_table(choices)]
    headers, visits = visit_rows(choices[0])
    if visits:
        cells = [tuple(map(escape, row)) for row in visits]
        sections += ["<h2>Points as the knee visits them</h2>", table(headers, cells, numbers=3)]
    if choices[0].base is not None:
        least = found.get("base_map")
        lines = [f"The knee stands at {choices[0].base}.", *([] if least is None else [f"Of the map: {least}."])]
        where = [f"<p>{escape(line)}</p>" for line in lines]
        sections += ["<h2>Where the robot stands</h2>", *where, drawn.pop("base_map", "")]
    if about_payload or found.get("carried"):
        sections += ["<h2>Payload</h2>", _payload(found.get("carried") or ()), _grid(about_payload)]
    sections += ["<h2>Limits at the knee</h2>", _limits_table(choices[0])]
    if found.get("exchange_rates"):
        sections += ["<h2>What holds the knee back</h2>", *_exchange_rates(found["exchange_rates"])]
    if found.get("certificate"):
        sections += ["<h2>Certificate of the knee</h2>", *_certificate(found["certificate"])]
    if found.get("bound"):
        sections += ["<h2>How good the front is at best</h2>", *_bound(found["bound"])]
    sections += _rivals(found.get("rivals") or ())
    if not pictures:
        sections.append(f"<noscript><h2>Front and knee</h2>{small_pictures(front)}</noscript>")
    else:
        share = told_share(front.thinned(), front)
        told = f"<p>Pictures show {share}.</p>" if share else ""
        sections.append(folded("Pictures", [told, wide, _grid(drawn.values())]))
    return sections


def _bound(bound: FrontBound) -> list[str]:
    """What no motion of the front's kind can be better than."""
    told = [f"<p>{escape(bound.told.capitalize())}.</p>", f"<p>Of {escape(bound.kind)}.</p>"]
    if bound.left_out:
        told.append(f"<p>Limits not used, with which the front misses less: {escape(', '.join(bound.left_out))}.</p>")
    rows = [tuple(map(escape, row)) for row in bound.rows]
    return [*told, table(("objective", "no motion is below", "least known"), rows)]


def _grid(figures: Iterable[str]) -> str:
    return '<div class="pictures">' + "".join(figures) + "</div>"


def _payload(carried: Sequence[Carried]) -> str:
    """Table of the payloads that the chosen solutions can carry, and of what would allow more."""
    rows = [
        (escape(one.rule), escape(str(one.capacity)), escape(str(one.sensitivity)) if one.sensitivity else "")
        for one in carried
    ]
    return table(("solution", "largest payload", "what would give more"), rows) if rows else ""


def _choices_table(choices: Sequence[Solution]) -> str:
    front = choices[0].front
    headers = objective_headers(front)
    values = known_values(front, [one.index for one in choices], [factor for _, factor in headers])
    bases = [told_base(one) for one in choices]
    orders = [one.visits.told_order if one.order is not None and one.visits is not None else "" for one in choices]
    beside = [("base", bases), ("order", orders)]
    told = [(title, texts) for title, texts in beside if any(texts)]
    rows = [
        (escape(one.rule), *values[k], str(one.index), *(escape(texts[k]) for _, texts in told), escape(one.reason))
        for k, one in enumerate(choices)
    ]
    titles = ("solution", *(header for header, _ in headers), "row", *(title for title, _ in told), "why")
    return table(titles, rows, numbers=len(headers) + 1, chosen=0)


def _limits_table(solution: Solution) -> str:
    rows = [(escape(name), f"{100.0 * share:.2f} %") for name, share in shares_used(solution).items()]
    return table(("limit", "used"), rows, numbers=1)


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
    return [*told, *([table(headers, rows, numbers=2)] if rows else [])]


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
    return [f"<p{alert}>{escape(str(certificate))}</p>", table(headers, rows, numbers=5)]


def _rivals(rivals: Sequence[Rival]) -> list[str]:
    if not rivals:
        return []
    from trajevo.solvers.rivals import RIVALS_NOTE, rivals_table

    headers, rows = rivals_table(rivals)
    cells = [[escape(cell) for cell in row] for row in rows]
    return [
        "<h2>Interpolants at their least times under the same limits</h2>",
        table(headers, cells, numbers=len(headers) - 1),
        f"<p>{escape(RIVALS_NOTE)}</p>",
    ]


def _failed(front: Front) -> list[str]:
    """Individuals whose evaluation failed, as far as the run lists them."""
    run = front.run
    rows = [(escape(one.said), escape(brief(list(one.x)))) for one in run.failed]
    counted = f"{run.failures}, the first {len(rows)} of them" if run.failures > len(rows) else str(run.failures)
    return (
        [f"<h2>Failed evaluations: {counted}</h2>", table(("what happened", "decision vector (SI)"), rows)]
        if rows
        else []
    )
