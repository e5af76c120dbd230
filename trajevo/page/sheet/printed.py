"""A sheet as one page of HTML: for a screen, light or dark, and for A4."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from html import escape
from importlib import resources
from string import Template

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown import html
from trajevo.base.units import pretty
from trajevo.page.sheet.load_data import LoadData
from trajevo.page.sheet.sheet import PayloadSheet
from trajevo.page.sheet.verdicts import OPEN, OVERLOADED, Axis, Verdict

#: Who signs.
_SIGNED = ("Made by", "Checked by", "Approved by")


def sheet_html(sheet: PayloadSheet) -> str:
    """The whole page, which needs no network."""
    title = f"Payload sheet: {sheet.robot}"
    return Template(_file("sheet.html")).substitute(
        title=escape(title),
        style=_file("sheet.css"),
        subtitle=escape(f"{sheet.title}; {sheet.motion}"),
        badge=_badge(sheet.verdict),
        about=_facts(_about(sheet)),
        load=_load(sheet),
        duty=_facts(_duty(sheet)),
        verdicts="\n".join(_verdict(name, verdict) for name, verdict in _named(sheet)[:2]),
        drives=_drives(sheet.duty),
        margins=_facts(_margins(sheet)),
        controllers=_table(("controller", "load data", "convention"), sheet.load.for_controllers()),
        hash=f"{sheet.certificate_hash}",
        signed="".join(f"<div><span>{one}</span><span>date</span><span>signature</span></div>" for one in _SIGNED),
    )


def shown_in_notebook(sheet: PayloadSheet) -> str:
    """What a notebook shows of a sheet."""
    rows = [(name, verdict.word, _binding(verdict)) for name, verdict in _named(sheet)]
    headers = ("verdict", "", "binding")
    return html.shown(f"Payload sheet: {sheet.verdict}", html.sentence(str(sheet)), html.table(headers, rows))


def _file(name: str) -> str:
    return (resources.files("trajevo.page.sheet") / name).read_text(encoding="utf-8")


def _named(sheet: PayloadSheet) -> list[tuple[str, Verdict]]:
    return [("Static", sheet.static), ("Dynamic", sheet.dynamic), *(("Drives", one) for one in sheet.duty)]


def _about(sheet: PayloadSheet) -> list[tuple[str, str]]:
    return [
        ("created by", sheet.creator or "\N{NO-BREAK SPACE}"),
        ("date", sheet.made_on),
        ("program", f"trajevo {sheet.version}"),
        ("robot", sheet.robot),
        ("frame of the load", sheet.tool),
    ]


def _load(sheet: PayloadSheet) -> str:
    """Load data at the tool and on the arm, as one table with a column for each load."""
    loads = [(f"at {sheet.tool}", sheet.load), *((f"on {one.joint}", one.data) for one in sheet.supplementary)]
    told: tuple[tuple[str, Callable[[LoadData], str]], ...] = (
        ("mass [kg]", lambda load: f"{load.mass:.4g}"),
        ("centre X, Y, Z [mm]", lambda load: _numbers(1e3 * load.com)),
        ("inertia about it Ixx, Iyy, Izz [kg·m²]", lambda load: _numbers(np.diagonal(load.inertia))),
        ("Ixy, Ixz, Iyz [kg·m²]", lambda load: _numbers(load.inertia[[0, 0, 1], [1, 2, 2]])),
        ("principal moments [kg·m²]", lambda load: _numbers(load.principal)),
        ("their axes A, B, C about Z, Y, X [°]", lambda load: _numbers(np.degrees(load.angles))),
    )
    rows = [(name, *(value(load) for _, load in loads)) for name, value in told]
    notes = [f"Acts as: {sheet.load_model}."] if sheet.load_model != "rigid" else []
    notes += [f"Carried: {sheet.carried}."] if sheet.carried else []
    notes += [] if sheet.supplementary else ["No supplementary loads on the arm."]
    return _table(("", *(name for name, _ in loads)), rows) + f'<p class="note">{escape(" ".join(notes))}</p>'


def _numbers(values: Array) -> str:
    return ", ".join(f"{value + 0.0:.4g}" for value in values)


def _duty(sheet: PayloadSheet) -> list[tuple[str, str]]:
    return [
        ("cycle", f"{sheet.duration + sheet.dwell:.3f} s: motion {sheet.duration:.3f} s, at rest {sheet.dwell:.3f} s"),
        ("cycles per hour", f"{sheet.cycles_per_hour:.1f}"),
        ("drives", "see their verdicts" if sheet.duty else "not known: neither heat nor RMS torque is judged"),
    ]


def _margins(sheet: PayloadSheet) -> list[tuple[str, str]]:
    told = [
        ("largest payload", str(sheet.capacity) if sheet.capacity is not None else f"not told: {sheet.capacity_note}")
    ]
    if sheet.drive_capacity is not None:
        told.append(("by the drives", str(sheet.drive_capacity)))
    if sheet.margin is not None:
        told.append(("margin of the load", f"{100.0 * sheet.margin:+.1f} % of its mass"))
    if sheet.kept < 1.0:
        told.append(("limits", f"efforts are judged by {100.0 * sheet.kept:.4g} % of the robot's limits"))
    return [*told, ("certificate", str(sheet.certificate))]


def _verdict(name: str, verdict: Verdict) -> str:
    sure = "proven at every instant" if verdict.proven else "at instants that were looked at"
    rows = "".join(map(_axis, verdict.axes))
    heads = ("axis", "greatest", "limit", "share", "", "at [s]")
    head = "".join(f"<th>{one}</th>" for one in heads)
    return (
        f"<section><h2>{name} {_badge(verdict.word)}</h2>"
        f'<p class="note">{escape(verdict.about)}; {sure}. <strong>{escape(_binding(verdict))}</strong></p>'
        f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></section>"
    )


def _axis(axis: Axis) -> str:
    limit = "–" if axis.limit is None else f"{axis.limit:.4g}"
    share, bar = "–", ""
    if axis.share is not None:
        share = f"{100.0 * axis.share:.1f} %"
        over = " over" if axis.share > 1.0 else ""
        bar = f'<span class="bar{over}"><i style="width:{100.0 * min(axis.share, 1.0):.1f}%"></i></span>'
    instant = "–" if axis.instant is None else f"{axis.instant:.3f}"
    value = f"{_shown(axis)} {pretty(axis.unit)}"
    cells = (escape(axis.joint), value, limit, share, bar, instant)
    return f"<tr>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>"


def _shown(axis: Axis) -> str:
    """A value; one that is mere rounding is 0."""
    rounding = axis.limit is not None and axis.value < 1e-9 * axis.limit
    return "0" if rounding else f"{axis.value:.4g}"


def _drives(duty: Sequence[Verdict]) -> str:
    """Verdicts of the drives as one table, a row for each joint; nothing without drives."""
    if not duty:
        return ""
    joints = list(dict.fromkeys(axis.joint for verdict in duty for axis in verdict.axes))
    by_joint = [{axis.joint: axis for axis in verdict.axes} for verdict in duty]
    rows = "".join(
        f"<tr><td>{escape(joint)}</td>{''.join(_driven(axes.get(joint)) for axes in by_joint)}</tr>" for joint in joints
    )
    heads = "".join(
        f"<th>{escape(verdict.about)} {_badge(verdict.word)}<br>{escape(_binding(verdict))}</th>" for verdict in duty
    )
    head = f"<thead><tr><th>axis</th>{heads}</tr></thead>"
    return f"<section><h2>Drives</h2><table>{head}<tbody>{rows}</tbody></table></section>"


def _driven(axis: Axis | None) -> str:
    """One cell of the table of drives."""
    if axis is None or axis.share is None:
        return "<td>–</td>"
    over = ' class="bad"' if axis.share > 1.0 else ""
    return f"<td><b{over}>{100.0 * axis.share:.1f} %</b> {_shown(axis)} {pretty(axis.unit)}</td>"


def _binding(verdict: Verdict) -> str:
    if verdict.binding is None or verdict.binding.share is None:
        return "No axis has a limit."
    return f"Binding: {verdict.binding.joint}, {100.0 * verdict.binding.share:.1f} %."


def _badge(word: str) -> str:
    kind = {OVERLOADED: "bad", OPEN: "open"}.get(word, "good")
    return f'<span class="badge {kind}">{word}</span>'


def _facts(rows: Iterable[tuple[str, str]]) -> str:
    return "<dl>" + "".join(f"<dt>{escape(name)}</dt><dd>{escape(text)}</dd>" for name, text in rows) + "</dl>"


def _table(headers: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    head = "".join(f"<th>{escape(one)}</th>" for one in headers)
    body = "".join(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
