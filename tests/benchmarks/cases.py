"""Cases of the table of `make bench`: ways to the same thing, measured in turn, and the lines that tell of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from compare import Action, in_turn

from trajevo.base.arrays import Array

#: Names of our ways: without numba, as installed by default, and with the optional extra.
PLAIN, FAST = "trajevo", "trajevo [fast]"

COLUMNS = ("measured", "way", "CPU time (quartiles)", f"over {PLAIN}", f"over {FAST}", "asked for")


class Line(NamedTuple):
    """A row of the table, its cells as text."""

    measured: str
    way: str
    time: str = ""
    over_plain: str = ""
    over_fast: str = ""
    asked: str = ""

    def __str__(self) -> str:
        return "| " + " | ".join(self) + " |"


class Asked(NamedTuple):
    """One way must take at least so many times as long as another."""

    theirs: str
    ours: str
    least: float


@dataclass(frozen=True, kw_only=True)
class Case:
    """Ways to the same thing.

    Attributes:
        title: what is measured.
        ways: name -> action; ours are named :data:`PLAIN` and :data:`FAST`.
        per: what the times are divided by.
        rounds: of measurement.
        asked: ratios that must be reached.
        most: name of a way -> what it may take [s].
        missing: packages that would be ways too and are not installed.
    """

    title: str
    ways: dict[str, Action]
    per: int = 1
    rounds: int = 15
    asked: tuple[Asked, ...] = ()
    most: dict[str, float] = field(default_factory=dict)
    missing: tuple[str, ...] = ()

    def lines(self) -> Iterator[Line]:
        """Measure, then one line for each way."""
        names = list(self.ways)
        columns = in_turn(list(self.ways.values()), self.rounds).T / self.per
        seconds = dict(zip(names, columns, strict=True))
        for name in names:
            ratios = {ours: seconds[name] / seconds[ours] for ours in (PLAIN, FAST) if ours in seconds}
            shown = [quartiles(ratios[ours]) if ours in ratios and ours != name else "" for ours in (PLAIN, FAST)]
            judged = [judge(one, ratios) for one in self.asked if one.theirs == name and one.ours in ratios]
            if name in self.most:
                judged.append(f"at most {self.most[name]:g} s: {verdict(np.median(seconds[name]) <= self.most[name])}")
            yield Line(self.title, name, duration(seconds[name]), *shown, "; ".join(judged))
        for name in self.missing:
            yield not_installed(self.title, name)


def judge(asked: Asked, ratios: dict[str, Array]) -> str:
    """What is asked for, and whether the median reaches it."""
    return f"{asked.least:.3g} over {asked.ours}: {verdict(np.median(ratios[asked.ours]) >= asked.least)}"


def verdict(met: bool) -> str:
    """Whether something is as it must be."""
    return "met" if met else "missed"


def not_installed(measured: str, package: str) -> Line:
    """The line in place of a peer that is not there."""
    return Line(measured, package, "not installed")


def duration(seconds: Array) -> str:
    """Median and quartiles with a unit that suits them."""
    unit, factor = next(
        (unit, factor)
        for unit, factor in (("s", 1.0), ("ms", 1e3), ("µs", 1e6), ("ns", 1e9))
        if np.median(seconds) * factor >= 1.0 or unit == "ns"
    )
    return quartiles(factor * seconds, f" {unit}")


def quartiles(values: Array, unit: str = "") -> str:
    """Median, unit and quartiles."""
    low, middle, high = (f"{value:.3g}" for value in np.quantile(values, [0.25, 0.5, 0.75]))
    return f"{middle}{unit} ({low} to {high})"
