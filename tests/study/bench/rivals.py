"""Rivals for tests: one that tries a few rows, one that fails, one that never ends."""

from __future__ import annotations

from typing import final

from trajevo.study.bench.adapters.adapter import BenchRival
from trajevo.study.bench.contest import Contest


@final
class Few(BenchRival):
    """Three batches of random rows."""

    name, says = "few", "three batches of random rows"

    def solve(self, contest: Contest) -> None:
        """See :meth:`BenchRival.solve`."""
        rng = contest.random()
        for _ in range(3):
            contest.many(contest.random_vectors(40, rng))


@final
class Failing(BenchRival):
    """Raises at once."""

    name, says = "failing", "nothing"

    def solve(self, contest: Contest) -> None:
        """See :meth:`BenchRival.solve`."""
        raise ZeroDivisionError("no luck\nat all")


@final
class Endless(BenchRival):
    """Tries the slowest motion for ever."""

    name, says = "endless", "the slowest motion, for ever"

    def solve(self, contest: Contest) -> None:
        """See :meth:`BenchRival.solve`."""
        while True:
            contest.one(contest.upper)
