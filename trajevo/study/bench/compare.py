"""Two files of results side by side: what has become faster, slower, better or worse, beyond the spread of the runs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError
from trajevo.study.bench.record import BenchResults
from trajevo.study.bench.score import SHARES
from trajevo.study.bench.table import BenchRow, Quartiles, rows_of

#: What can be said of two sets of runs: their quartiles overlap, or one is better.
Verdict = Literal["within the quartiles", "faster", "slower", "better", "worse"]


@dataclass(frozen=True)
class Changed:
    """A measure of a rival on a problem, before and after.

    Attributes:
        problem: name of the problem.
        rival: name of the rival.
        measure: what is measured, with its unit.
        before: its quartiles in the first file.
        after: its quartiles in the second, times as the machine of the first file would have taken, by its yardstick;
            wider by as much as the yardsticks themselves vary.
        ratio: median after over median before; None if one of them never came.
        verdict: what it means.
    """

    problem: str
    rival: str
    measure: str
    before: Quartiles
    after: Quartiles
    ratio: float | None
    verdict: Verdict

    __repr__ = brief


def compared(before: BenchResults, after: BenchResults) -> tuple[Changed, ...]:
    """Every measure of what both have run, in the order of the table.

    Raises:
        InvalidInputError: they have no rival on a problem in common.
    """
    speed = pace(before, after) or Quartiles(1.0, 1.0, 1.0)
    known = {(row.problem, row.rival): row for row in rows_of(before) if row.runs}
    pairs = [(known[row.problem, row.rival], row) for row in rows_of(after) if (row.problem, row.rival) in known]
    found = tuple(change for old, new in pairs if new.runs for change in _changes(old, new, speed))
    if not found:
        raise InvalidInputError("results: the two files have no rival on a problem in common")
    return found


def pace(before: BenchResults, after: BenchResults) -> Quartiles | None:
    """CPU time of the machine of the first file over that of the second for the same work, None where one is unknown.

    It is the ratio of their yardsticks, fixed work that is measured beside every run: that of their medians, and the
    least and greatest ratio of values between their quartiles, since CPU times of equal work vary on one machine too.
    """
    first, second = (
        Quartiles.of(run.yardstick for run in results.runs if run.yardstick is not None) for results in (before, after)
    )
    found = Quartiles(first.low / second.high, first.median / second.median, first.high / second.low)
    return found if np.isfinite(found.median) else None


def unlike(before: BenchResults, after: BenchResults) -> tuple[str, ...]:
    """What has to be known to compare CPU times, or keeps them from being compared, one sentence each."""
    told = []
    machines = [sorted({run.machine.processor for run in results.runs}) for results in (before, after)]
    speed = pace(before, after)
    if speed is not None and set(speed) != {1.0}:
        factor = speed.told()
        told.append(f"by the yardstick, times after are multiplied by {factor} to be those of the machine before")
    elif speed is None and machines[0] != machines[1]:
        told.append(f"measured on {' and '.join(machines[0])} and on {' and '.join(machines[1])}: times do not compare")
    budgets = [sorted({run.budget for run in results.runs}) for results in (before, after)]
    if budgets[0] != budgets[1]:
        first, second = (" or ".join(f"{budget:g} s" for budget in one) for one in budgets)
        told.append(f"runs had {first} of CPU time and {second}: shares at the end do not compare")
    return tuple(told)


def _changes(old: BenchRow, new: BenchRow, speed: Quartiles) -> Iterator[Changed]:
    for share, before, measured in zip(SHARES, old.times, new.times, strict=True):
        after = Quartiles(*(factor * value for factor, value in zip(speed, measured, strict=True)))
        measure = f"time to {100.0 * share:g} % [s]"
        verdict: Verdict = "within the quartiles"
        if after.high < before.low:
            verdict = "faster"
        elif before.high < after.low:
            verdict = "slower"
        yield Changed(old.problem, old.rival, measure, before, after, _ratio(before, after), verdict)
    verdict = "within the quartiles"
    if new.share.low > old.share.high:
        verdict = "better"
    elif new.share.high < old.share.low:
        verdict = "worse"
    yield Changed(old.problem, old.rival, "share", old.share, new.share, _ratio(old.share, new.share), verdict)


def _ratio(before: Quartiles, after: Quartiles) -> float | None:
    fine = np.isfinite(before.median) and np.isfinite(after.median) and before.median > 0.0
    return after.median / before.median if fine else None
