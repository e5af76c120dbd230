"""Rows of the table: evaluation of a population, per trajectory."""

from __future__ import annotations

from collections.abc import Iterator

from cases import FAST, PLAIN, Asked, Case, Line
from subjects import SUBJECTS, candidates, ours

TRAJECTORIES = 100
ONE_BY_ONE = "one by one with SciPy"


def lines() -> Iterator[Line]:
    """A hundred candidates of every problem, one by one and at once."""
    for title, (make, one_by_one) in SUBJECTS.items():
        problem = make()
        x = candidates(problem, TRAJECTORIES)
        if one_by_one is None:
            ways = {"trajevo, one by one": lambda problem=problem, x=x: [problem.evaluate(row[None]) for row in x]}
        else:
            values = one_by_one(problem)
            ways = {ONE_BY_ONE: lambda values=values, x=x: [values(row) for row in x]}
        # At most 0.04 and 0.018 of the time one by one.
        asked = (Asked(ONE_BY_ONE, PLAIN, 25.0), Asked(ONE_BY_ONE, FAST, 55.6)) if "13 knots" in title else ()
        ways |= ours(make, lambda problem, x=x: problem.evaluate(x))
        yield from Case(title=f"evaluation, {title}", ways=ways, per=TRAJECTORIES, asked=asked, rounds=9).lines()
