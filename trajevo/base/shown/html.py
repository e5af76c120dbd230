"""Pieces of HTML for notebooks: sentences, tables and small pictures, without scripts and in the colours of the page.

Every text is escaped here, so that a name from a file stays text. Colours are those of the page, dark or light.
"""

from __future__ import annotations

import html
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import cut

#: Greatest number of rows of a table, and of characters of a cell or a sentence.
ROWS, _CELL, _SENTENCE = 12, 120, 800

#: Greatest number of dots of a cloud and of instants of a line.
DOTS, _INSTANTS = 400, 80

#: Sizes of a cloud and of a line in a table [px], and the room around a cloud for its texts.
_CLOUD, _LINE = (300, 200), (130, 26)
_LEFT, _RIGHT, _TOP, _BOTTOM = 12, 12, 20, 34

#: Share of the greatest value by which a line may vary and still be flat.
_ROUNDING = 1e-9

#: A cell that stands right: a number, with a unit or without.
_NUMBER = re.compile(r"(?:[<>≤≥±+\-−]\s*)?(?:\d|inf\b|∞|none$|–$|$).*")

_TABLE = "border-collapse:collapse;margin:0.4em 0;color:inherit;font-size:inherit"
_SMALL = "margin:0.2em 0;color:inherit"


@final
class Piece(str):
    """HTML that is made here: everything else is text, and is escaped."""

    __slots__ = ()


def shown(title: str, *pieces: Piece) -> str:
    """What a notebook shows of an object: what it is, and pieces below each other; empty pieces are left out."""
    return f'<div style="color:inherit"><div><b>{_text(title, _CELL)}</b></div>{"".join(filter(None, pieces))}</div>'


def sentence(text: str) -> Piece:
    """A paragraph; none of an empty text."""
    return Piece(f'<p style="{_SMALL}">{_text(text, _SENTENCE)}</p>' if text else "")


def table(headers: Sequence[str], rows: Iterable[Sequence[str]], *, most: int = ROWS) -> Piece:
    """A table of texts and pictures; of many rows the first ones, and how many there are more.

    Args:
        headers: texts above the columns, each with its unit if it has one.
        rows: a cell for each header.
        most: greatest number of rows.
    """
    every = [tuple(row) for row in rows]
    if not every:
        return Piece("")
    kept = every[:most]
    right = [all(not isinstance(row[k], Piece) and _NUMBER.match(row[k]) for row in kept) for k in range(len(headers))]
    head = "".join(_cell("th", text, stands) for text, stands in zip(headers, right, strict=True))
    body = "".join(
        f"<tr>{''.join(_cell('td', text, stands) for text, stands in zip(row, right, strict=True))}</tr>"
        for row in kept
    )
    left = len(every) - len(kept)
    more = f'<tr><td colspan="{len(headers)}" style="text-align:left">and {left} more</td></tr>' if left else ""
    top = f"<thead><tr>{head}</tr></thead>" if any(headers) else ""
    return Piece(f'<table style="{_TABLE}">{top}<tbody>{body}{more}</tbody></table>')


def facts(told: Mapping[str, str]) -> Piece:
    """A table of names and values; empty values are left out."""
    return table(("", ""), [(name, value) for name, value in told.items() if value], most=len(told))


def cloud(points: Array, labels: tuple[str, str], marks: Mapping[str, Array]) -> Piece:
    """Points in a plane, such as a front.

    Args:
        points: finite values, shape (N, 2); of many, as many as can be told apart are drawn.
        labels: names of both axes with their units.
        marks: name of a marked point -> its values, shape (2,).
    """
    if not len(points):
        return Piece("")
    few = points[_some(len(points), DOTS)]
    every = np.vstack([few, *(np.reshape(mark, (1, 2)) for mark in marks.values())])
    low, high = every.min(axis=0), every.max(axis=0)
    (width, height), room = _CLOUD, np.array([_LEFT, _TOP])
    wide = np.array([width - _LEFT - _RIGHT, height - _TOP - _BOTTOM], dtype=np.float64)

    def placed(values: Array) -> Array:
        """Places of values in the picture, shape (N, 2) [px]."""
        share = (values - low) / np.where(high > low, high - low, 1.0)
        return np.asarray(room + wide * np.stack([share[:, 0], 1.0 - share[:, 1]], axis=1))

    dots = "".join(f"M{x:.1f} {y:.1f}h0" for x, y in placed(few))
    parts = [
        f'<rect x="{_LEFT}" y="{_TOP}" width="{wide[0]:g}" height="{wide[1]:g}" fill="none" stroke="currentColor" '
        'stroke-opacity="0.35"/>',
        f'<path d="{dots}" fill="none" stroke="currentColor" stroke-width="3.5" stroke-linecap="round" '
        'stroke-opacity="0.55"/>',
        *_marked(marks, placed),
        _word(_LEFT, _TOP - 7, f"↑ {labels[1]}: {low[1]:.5g} to {high[1]:.5g}"),
        _word(_LEFT, height - _BOTTOM + 16, f"→ {labels[0]}: {low[0]:.5g} to {high[0]:.5g}"),
    ]
    return _picture(_CLOUD, f"{labels[1]} against {labels[0]} of {len(points)} points", parts)


def line(values: Array, label: str) -> Piece:
    """One quantity over time as a line without axes, for a cell of a table.

    Args:
        values: at equal distances, shape (T,); where they are not finite the line is broken.
        label: what is drawn, with its unit, told to those who cannot see it.
    """
    few = np.asarray(values, dtype=np.float64)
    few = few[_some(len(few), _INSTANTS)]
    known = np.isfinite(few)
    if not known.any():
        return Piece("")
    (width, height), low, high = _LINE, few[known].min(), few[known].max()
    flat = high - low <= _ROUNDING * max(abs(low), abs(high))
    x = 2.0 + (width - 4.0) * np.linspace(0.0, 1.0, len(few))
    y = height - 3.0 - (height - 6.0) * (np.full(len(few), 0.5) if flat else (few - low) / (high - low))
    path = "".join(f"{'L' if k and known[k - 1] else 'M'}{x[k]:.1f} {y[k]:.1f}" for k in range(len(few)) if known[k])
    drawn = f'<path d="{path}" fill="none" stroke="currentColor" stroke-width="1.4" stroke-linejoin="round"/>'
    return _picture(_LINE, label, [drawn])


def bar(done: int, total: int, text: str) -> str:
    """A bar that shows how much is done, and a text beside it."""
    told = f"{done}/{total}"
    progress = f'<progress value="{done}" max="{max(total, 1)}" style="width:16em">{told}</progress>'
    return f'<div style="color:inherit">{progress} {told} {_text(text, _SENTENCE)}</div>'


def _marked(marks: Mapping[str, Array], placed: Any) -> Iterable[str]:
    """Rings around marked points, with their names beside them."""
    for name, values in marks.items():
        ((x, y),) = placed(np.reshape(values, (1, 2)))
        before = x > 0.6 * _CLOUD[0]
        yield f'<circle cx="{x:.1f}" cy="{y:.1f}" r="6" fill="none" stroke="currentColor" stroke-width="1.6"/>'
        yield _word(x - 10 if before else x + 10, y - 8, name, anchor="end" if before else "start")


def _word(x: float, y: float, text: str, *, anchor: str = "start") -> str:
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" font-size="11" fill="currentColor" stroke="none" text-anchor="{anchor}">'
        f"{_text(text, _CELL)}</text>"
    )


def _picture(size: tuple[int, int], label: str, parts: Sequence[str]) -> Piece:
    """An inline picture; its label is read aloud and shown under the pointer."""
    width, height = size
    told = _text(label, _CELL)
    return Piece(
        f'<svg role="img" aria-label="{told}" width="{width}" height="{height}" viewBox="0 0 {width} {height}" '
        f'style="max-width:100%;color:inherit"><title>{told}</title>{"".join(parts)}</svg>'
    )


def _cell(tag: str, content: str, right: bool) -> str:
    inside = content if isinstance(content, Piece) else _text(content, _CELL)
    return f'<{tag} style="text-align:{"right" if right else "left"};padding:0.15em 0.7em">{inside}</{tag}>'


def _text(text: str, most: int) -> str:
    """Text on one line, cut where nobody reads on, and escaped."""
    return html.escape(cut(text, most))


def _some(count: int, most: int) -> list[int]:
    """Numbers of rows, evenly spread over all of them."""
    return sorted(set(np.linspace(0, count - 1, min(count, most)).round().astype(int).tolist()))
