"""How often a motion is made, and how long the arm rests after each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, final

import numpy as np

from trajevo.base.arrays import real_number
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError

#: Longest time at rest [s], 30 years, and most cycles: what is more is a mistake, and may be beyond all floats.
LONGEST_REST, MOST_CYCLES = 1e9, 10**9


@final
@dataclass(frozen=True)
class Duty:
    """How often a motion is made, and the time at rest after it.

    Attributes:
        dwell: time at rest after each motion, at its end [s].
        cycles: number of cycles from cold on; None if they go on for ever.
    """

    dwell: float = 0.0
    cycles: int | None = None

    __repr__ = brief

    def __str__(self) -> str:
        made = "made for ever" if self.cycles is None else f"made {self.cycles} times"
        return f"{made}, {self.dwell:g} s at rest after each" if self.dwell else f"{made} without rest"


def checked_dwell(given: Any) -> float:
    """A time at rest after a motion [s].

    Raises:
        InvalidInputError: no number from 0 on, or one of more than 30 years.
    """
    dwell = real_number(given)
    if dwell is None or not np.isfinite(dwell) or dwell < 0.0:
        raise InvalidInputError(f"dwell: expected a time from 0 on [s], got {given!r}")
    if dwell > LONGEST_REST:
        raise InvalidInputError(f"dwell: expected at most {LONGEST_REST:g} s, got {given!r}")
    return dwell


def checked_cycles(given: Any, forever: int | None = None) -> int | None:
    """How often a motion is made from cold on, None for ever.

    Args:
        given: what a caller gave.
        forever: what the caller says for "for ever", 0 or None.

    Raises:
        InvalidInputError: no whole number from 1 on, or one of more than a thousand million.
    """
    if given is None if forever is None else real_number(given) == forever and isinstance(given, int | np.integer):
        return None
    whole = isinstance(given, int | np.integer) and not isinstance(given, bool)
    if not whole or given < 1:
        raise InvalidInputError(f"cycles: expected a whole number from 1 on, or {forever} for ever, got {given!r}")
    if given > MOST_CYCLES:
        raise InvalidInputError(f"cycles: expected at most {MOST_CYCLES}, or {forever} for ever, got {given!r}")
    return int(given)
