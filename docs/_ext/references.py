"""Where the references of docstrings lead, and docstrings as Sphinx understands them."""

from __future__ import annotations

import importlib
import re
import sys
from functools import cache
from typing import Any

import api

#: What is between two pairs of backquotes, and bars outside of them, which would name a substitution.
_BARS = re.compile(r"``.*?``|\|", re.DOTALL)


@cache
def places() -> dict[str, str]:
    """Where references lead: the place of each entry by the module that defines it, and by its bare name."""
    found: dict[str, str] = {}
    for entries in api.groups().values():
        for entry in entries:
            if entry.kind != "data":
                found[f"{entry.value.__module__}.{entry.value.__qualname__}"] = entry.place
            found.setdefault(entry.name, entry.place)
    return found


def target_of(reference: str) -> str | None:
    """The dotted name on the site that a reference means, or None.

    Args:
        reference: as it is written in a docstring: ``load_robot``, ``Front.save``, ``trajevo.robot.robot.load_robot``.
    """
    parts = reference.lstrip("~.").split(".")
    for end in range(len(parts), 0, -1):
        place = places().get(".".join(parts[:end]))
        if place is not None:
            return ".".join([place, *parts[end:]])
    return _from_room(".".join(parts))


def _from_room(reference: str) -> str | None:
    """The place of something that another module than its own names, such as ``trajevo.robot.Robot``."""
    value = value_of(reference)
    home = getattr(value, "__module__", None), getattr(value, "__qualname__", None)
    return places().get(f"{home[0]}.{home[1]}")


def exists(reference: str, page: str) -> bool:
    """Whether what a reference means is in the code, though it has no page: by its module, or seen from a page's class.

    Args:
        reference: as it is written.
        page: place of the entry whose page it is on.
    """
    module = next((m for m, place in places().items() if place == page and "." in m), "").rpartition(".")[0]
    if module in sys.modules and _attribute(sys.modules[module], reference) is not None:
        return True
    owner = value_of(page)
    return value_of(reference) is not None or has_member(owner, reference)


def has_member(owner: Any, name: str) -> bool:
    """Whether a class has an attribute, also one that is only annotated or described."""
    described = re.search(rf"^\s*{re.escape(name)}\b.*:", getattr(owner, "__doc__", "") or "", re.MULTILINE)
    return hasattr(owner, name) or described is not None


@cache
def value_of(reference: str) -> Any:
    """What a dotted name means, or None."""
    parts = reference.split(".")
    if parts[0] not in ("trajevo", "problems"):
        return None
    for end in range(len(parts), 0, -1):
        try:
            module = importlib.import_module(".".join(parts[:end]))
        except ImportError:
            continue
        return _attribute(module, ".".join(parts[end:])) if parts[end:] else module
    return None


def _attribute(value: Any, dotted: str) -> Any:
    for part in dotted.split("."):
        value = getattr(value, part, None)
    return value


def readable(what: str, lines: list[str]) -> None:
    """Change a docstring in place: bars are bars, and a property's colon comes after no type.

    Args:
        what: kind of the documented thing in the words of Sphinx.
        lines: its docstring.
    """
    text = _BARS.sub(lambda found: r"\|" if found[0] == "|" else found[0], "\n".join(lines))
    lines[:] = ["\\ ", *text.splitlines()] if what in ("property", "attribute", "data") else text.splitlines()
