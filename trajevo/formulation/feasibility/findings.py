"""Findings about a problem before its search, and how their numbers are written."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, final

from trajevo.base.shown.brief import brief
from trajevo.robot.robot import Robot

#: Share by which a limit must be exceeded to rule a motion out, so that rounding never does.
ROUNDING = 1e-6

#: Share of a limit above which a finding warns.
CLOSE = 0.95

#: ``"impossible"`` if no motion of the problem can be feasible, ``"warning"`` if little is left, else ``"note"``.
Severity = Literal["impossible", "warning", "note"]


@final
@dataclass(frozen=True)
class Finding:
    """Something about a point or a time that a user should know before a search.

    Attributes:
        kind: ``"effort"``, ``"payload"``, ``"clearance"``, ``"tool height"``, ``"manipulability"``,
            ``"least singular value"`` or ``"duration"``.
        point: number of the point, from 0; None if no single point is meant.
        joint: name of the joint; empty if no single joint is meant.
        needed: what is needed [unit].
        available: what there is [unit].
        unit: SI unit of both.
        severity: whether it rules every motion out.
        sentence: the finding in one sentence, without a full stop.
        remedy: what helps, without a full stop; empty if nothing is known.
    """

    kind: str
    point: int | None
    joint: str
    needed: float
    available: float
    unit: str
    severity: Severity
    sentence: str
    remedy: str = ""

    __repr__ = brief

    @property
    def impossible(self) -> bool:
        """Whether no motion of the problem can be feasible."""
        return self.severity == "impossible"

    def __str__(self) -> str:
        return f"{self.sentence}; {self.remedy}" if self.remedy else self.sentence


def effort_unit(robot: Robot, joint: int) -> str:
    """Unit of the effort of a joint."""
    return "N" if robot.joint_units[joint] == "m" else "N·m"


def number(value: float) -> str:
    """A number to three digits, or all digits before the point: 9.32, 1934."""
    return f"{value:.0f}" if 1000.0 <= abs(value) < 1e9 else f"{value:.3g}"


def of(needed: float, available: float, unit: str) -> str:
    """Needed of available, such as "9.32 of 8 N·m", with as many digits as tell them apart."""
    written = number(needed), number(available)
    if written[0] == written[1]:
        written = next(
            (pair for pair in ((f"{needed:.{n}g}", f"{available:.{n}g}") for n in range(4, 10)) if pair[0] != pair[1]),
            written,
        )
    return f"{written[0]} of {written[1]} {unit}"


def at_least(value: float) -> str:
    """A number to three digits, rounded up, so that what is written suffices."""
    return _rounded(value, math.ceil)


def at_most(value: float) -> str:
    """A number to three digits, rounded down, so that what is written is not too much."""
    return _rounded(value, math.floor)


def _rounded(value: float, rounding: Callable[[float], int]) -> str:
    if value == 0.0 or not math.isfinite(value):
        return f"{value:g}"
    step = 10.0 ** (math.floor(math.log10(abs(value))) - 2)
    return number(rounding(value / step) * step)
