"""Papers by name: those that come with trajevo and those of other packages, found through their entry points."""

from __future__ import annotations

from typing import Any

from trajevo.base.plugins import loaded, registered
from trajevo.errors import checked_name
from trajevo.reproduction.paper import Paper

#: Entry-point group in which packages register a :class:`trajevo.reproduction.paper.Paper`.
ENTRY_POINT_GROUP = "trajevo.papers"


def paper_names() -> list[str]:
    """Names of all registered papers."""
    return list(registered(ENTRY_POINT_GROUP))


def paper_named(name: str) -> Paper:
    """A registered paper.

    Raises:
        UnknownNameError: no such paper.
        InvalidInputError: what is registered cannot be imported, or is no paper.
    """
    points = registered(ENTRY_POINT_GROUP)
    asked = checked_name("paper", name, points)
    found: Paper = loaded(points[asked], "paper", "a trajevo.reproduction.paper.Paper", _is_paper)
    return found


def _is_paper(found: Any) -> bool:
    return isinstance(found, Paper)
