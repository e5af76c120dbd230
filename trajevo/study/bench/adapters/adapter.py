"""What every rival is asked for: whether it can be set on a problem, and to try decision vectors until time is up."""

from __future__ import annotations

import importlib
import importlib.util
import inspect
import pkgutil
from abc import ABC, abstractmethod
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import ClassVar

from trajevo.base.own.code import imported, in_module, looking_in
from trajevo.errors import InvalidInputError, checked_name
from trajevo.study.bench.contest import Contest

#: Where rivals that are not installed are installed from.
EXTRA = "pip install 'trajevo[bench]'"


class BenchRival(ABC):
    """A rival: a few lines that set it on a problem.

    Attributes:
        name: its name in tables.
        says: how it is set on a problem, and what has to be known to read its numbers; one sentence.
        module: module that must be installed; none if empty.
        distribution: name of its package, whose version is recorded.
        install: how it is installed.
        plain: whether it needs the plain statement, which not every problem has.
        carries: whether it can tell what given motions can carry, instead of looking for motions.
    """

    name: ClassVar[str]
    says: ClassVar[str]
    module: ClassVar[str] = ""
    distribution: ClassVar[str] = "trajevo"
    plain: ClassVar[bool] = False
    carries: ClassVar[bool] = False
    install: ClassVar[str] = EXTRA

    @property
    def installed(self) -> bool:
        """Whether its module is there."""
        return not self.module or importlib.util.find_spec(self.module) is not None

    @property
    def version(self) -> str:
        """Version of its package; empty if it has none."""
        try:
            return version(self.distribution)
        except PackageNotFoundError:
            return ""

    def refuses(self, contest: Contest) -> str:
        """Why it cannot be set on a problem, one clause; empty if it can."""
        if contest.motions_given is not None and not self.carries:
            return "it looks for motions, the problem asks what given ones can carry"
        return contest.unstated if self.plain else ""

    def prepare(self) -> None:
        """Import what it needs, before the clock starts."""
        if self.module:
            importlib.import_module(self.module)

    @abstractmethod
    def solve(self, contest: Contest) -> None:
        """Try decision vectors until nothing can be improved, or an evaluation raises ``OutOfTimeError``.

        Args:
            contest: evaluates rows, in the plain form or in trajevo's, and notes what was tried and when.
        """


def adapters() -> dict[str, BenchRival]:
    """All rivals by name: trajevo, then the others in alphabetical order."""
    own = str(Path(__file__).parent)
    found: list[BenchRival] = []
    for file in pkgutil.iter_modules([own]):
        module = importlib.import_module(f"{__package__}.{file.name}")
        found += [kind() for kind in vars(module).values() if _is_adapter(kind) and kind.__module__ == module.__name__]
    return {one.name: one for one in sorted(found, key=lambda one: (one.name != "trajevo", one.name))}


def adapter(name: str) -> BenchRival:
    """A rival by its name, or one of the user's own by its place in Python, ``module:Class``.

    Raises:
        UnknownNameError: no such rival.
        InvalidInputError: what is at the place is no class of :class:`BenchRival`.
    """
    if not in_module(name):
        known = adapters()
        return known[checked_name("rival", name, known)]
    with looking_in("."):
        kind = imported(name, "rival")
    if not _is_adapter(kind):
        raise InvalidInputError(f"rival: {name}: expected a class of trajevo.study.bench.adapters.adapter.BenchRival")
    made: BenchRival = kind()
    return made


def _is_adapter(kind: object) -> bool:
    return isinstance(kind, type) and issubclass(kind, BenchRival) and not inspect.isabstract(kind)
