"""Lines of the keys of a TOML file: its parser in the standard library does not tell them."""

from __future__ import annotations

import re

_TABLE = re.compile(r"\s*(\[\[?)\s*([^\[\]]+?)\s*\]\]?\s*(#.*)?$")
_KEY = re.compile(r"""\s*((?:[A-Za-z0-9_-]+|"[^"]*"|'[^']*')(?:\s*\.\s*(?:[A-Za-z0-9_-]+|"[^"]*"|'[^']*'))*)\s*=""")
_PART = re.compile(r"""[A-Za-z0-9_-]+|"[^"]*"|'[^']*'""")

Place = tuple[str | int, ...]


def key_lines(text: str) -> dict[Place, int]:
    """Line of every key that begins one, and of every table, by its path; entries of arrays of tables are numbered."""
    lines: dict[Place, int] = {}
    table: Place = ()
    counts: dict[Place, int] = {}
    depth = 0
    for number, line in enumerate(text.splitlines(), start=1):
        header = _TABLE.match(line) if depth == 0 else None
        if header:
            table = _parts(header[2])
            if header[1] == "[[":
                counts[table] = counts.get(table, -1) + 1
                lines.setdefault(table, number)
                table = (*table, counts[table])
            lines[table] = number
            continue
        key = _KEY.match(line) if depth == 0 else None
        if key:
            lines[(*table, *_parts(key[1]))] = number
        depth = max(0, depth + _opened(line[key.end() :] if key else line))
    return lines


def line_of(lines: dict[Place, int], place: Place) -> int | None:
    """Line of a key, or of the nearest key around it."""
    for end in range(len(place), 0, -1):
        if place[:end] in lines:
            return lines[place[:end]]
    return None


def _parts(dotted: str) -> Place:
    return tuple(part.strip("\"'") for part in _PART.findall(dotted))


def _opened(text: str) -> int:
    """Brackets that a line opens and does not close, outside of strings and comments."""
    bare = re.sub(r""""(?:[^"\\]|\\.)*"|'[^']*'""", "", text).partition("#")[0]
    return sum(bare.count(opening) - bare.count(closing) for opening, closing in ("[]", "{}"))
