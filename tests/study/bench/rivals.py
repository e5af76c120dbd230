"""Rivals for tests: one that tries a few rows, one that fails, one that never ends."""

from __future__ import annotations

from typing import final

from trajevo.study.bench.adapters.adapter import Adapter
from trajevo.study.bench.contest import Contest


@final
class Few(Adapter):
    """Three batches of random rows."""

    name, says = "few", "three batches of random rows"

    def solve(self, contest: Contest) -> None:
        """See :meth:`Adapter.solve`."""
        rng = contest.random()
        for _ in range(3):
            contest.many(contest.random_vectors(40, rng))


@final
class Failing(Adapter):
    """Raises at once."""

    name, says = "failing", "nothing"

    def solve(self, contest: Contest) -> None:
        """See :meth:`Adapter.solve`."""
        raise ZeroDivisionError("no luck\nat all")


@final
class Endless(Adapter):
    """Tries the slowest motion for ever."""

    name, says = "endless", "the slowest motion, for ever"

    def solve(self, contest: Contest) -> None:
        """See :meth:`Adapter.solve`."""
        while True:
            contest.one(contest.upper)
