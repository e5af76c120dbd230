"""The text of the pages of the interface, and where its references lead."""

from __future__ import annotations

import re

import api

INTRODUCTION = """Everything users need is in `trajevo`, `trajevo.plots` and `trajevo.problems`. Numbers are in SI units
unless a text says otherwise: m, rad, s, kg, N, N·m. Shapes of arrays are in round brackets, units in square ones:
*shape (B, n_joints) [rad or m]* has a row for each of B motions and a column for each joint.
"""

RECORDS = """Classes that public functions take or return. They are not made by hand, so there is nothing to import."""

#: What a page shows of a class besides its public members.
SPECIAL = ("__call__", "__getitem__")


def pages() -> dict[str, str]:
    """Every page of the interface by its file in `reference/api`: the index, groups, and one for each name."""
    titles = {title: _slug(title) for title in api.groups()}
    index = ["# Python", "", INTRODUCTION]
    for title, entries in api.groups().items():
        index += ["", f"## [{title}]({titles[title]}.md)", "", _linked(entries)]
    index += ["", "```{toctree}", ":hidden:", "", *titles.values(), "```", ""]
    found = {"index.md": "\n".join(index)}
    for title, entries in api.groups().items():
        said = [f"# {title}", ""]
        said += [RECORDS, ""] if title == api.RECORDS else []
        said += ["| name | what it is |", "|---|---|"]
        said += [f"| {_link(entry)} | {_markdown(entry.says)} |" for entry in entries]
        found[f"{titles[title]}.md"] = "\n".join([*said, ""])
        found |= {f"{entry.place}.rst": _page(entry, title, titles[title]) for entry in entries}
    return found


def _page(entry: api.Entry, title: str, group: str) -> str:
    """A page of one name; what it says comes from the docstring.

    It is in no table of contents, which would make every page of the site as long as all names together.
    """
    lines = [":orphan:", "", ".. rst-class:: where", "", f":doc:`Python <index>` › :doc:`{title} <{group}>`", ""]
    lines += [entry.name, "=" * len(entry.name), ""]
    if entry.home in ("trajevo", "trajevo.errors", *api.ROOMS):
        lines += [".. code-block:: python", "", f"   from {entry.home} import {entry.name}", ""]
    if entry.kind == "data":
        return "\n".join(
            [*lines, f".. py:data:: {entry.place}", f"   :value: {entry.value!r}", "", f"   {entry.says}", ""]
        )
    lines.append(f".. auto{entry.kind}:: {entry.place}")
    if entry.kind in ("class", "exception"):
        special = ", ".join(name for name in SPECIAL if name in vars(entry.value))
        lines += ["   :members:", "   :show-inheritance:", *([f"   :special-members: {special}"] if special else [])]
    return "\n".join([*lines, ""])


def _linked(entries: tuple[api.Entry, ...]) -> str:
    return " · ".join(map(_link, entries))


def _link(entry: api.Entry) -> str:
    return f"[`{entry.name}`]({entry.place}.rst)"


def _markdown(says: str) -> str:
    """A sentence of a docstring in Markdown, for a cell of a table."""
    plain = re.sub(r":\w+:`~?(?:[^`<]*\.)?([^`<]+)`", r"`\1`", says).replace("``", "`")
    return plain.replace("|", r"\|")


def _slug(title: str) -> str:
    return re.sub(r"\W+", "_", title.lower())
