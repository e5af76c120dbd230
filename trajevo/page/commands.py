"""What the commands that a page names need besides the run: the problem of a run that does not say all of it."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping
from typing import Any

from trajevo.base.own.code import in_module
from trajevo.formulation.registry import list_problems
from trajevo.front.records import ProblemRecord

#: What stands for a problem that was made in Python and whose place there nobody has told.
_PLACE = "MODULE:NAME"


def problem_option(record: ProblemRecord, problem: str | None) -> tuple[str, str]:
    """The option ``--problem`` of a run, with a space before it, and a sentence if its place has to be filled in.

    Args:
        record: the problem as data.
        problem: what ``--problem`` was when the page was made, or the problem's name on the command line.

    Returns:
        Both are empty for a registered problem without functions of the user's own.
    """
    modules = sorted({place.partition(":")[0] for place in _places(record.settings)})
    if record.name in list_problems() and not modules:
        return "", ""
    if problem is not None:
        return f" --problem {shlex.quote(problem)}", ""
    if record.name not in list_problems():
        told = (
            f"{_PLACE} is the place of this problem in Python: NAME in the module MODULE is the problem, or makes it."
        )
        return f" --problem {_PLACE}", told
    if len(modules) == 1:
        return f" --problem {modules[0]}", ""
    return " --problem TASK.toml", f"TASK.toml is the task's file; it uses functions of {', '.join(modules)}."


def _places(settings: Any) -> Iterator[str]:
    """Places in Python that settings name; a title is a text."""
    if isinstance(settings, Mapping):
        for name, value in settings.items():
            if name != "title":
                yield from _places(value)
    elif isinstance(settings, list | tuple):
        for value in settings:
            yield from _places(value)
    elif in_module(settings):
        yield settings
