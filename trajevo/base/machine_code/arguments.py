"""Arguments of loops by their signatures."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple, final


@final
class Argument(NamedTuple):
    """One argument of a loop.

    Attributes:
        code: numpy's code of its numbers.
        axes: number of an array's axes, None for a number.
        written: whether the loop writes to it.
    """

    code: str
    axes: int | None
    written: bool


@cache
def arguments_of(signature: str) -> tuple[Argument, ...]:
    """Arguments in their order.

    Args:
        signature: what is read, an arrow, what is written, such as ``"f8[2], i8 -> f8[1]"``.
    """
    read, _, written = signature.partition("->")
    found = []
    for part, writes in ((read, False), (written, True)):
        for name in filter(None, (word.strip() for word in part.split(","))):
            code, _, axes = name.removesuffix("]").partition("[")
            found.append(Argument(code, int(axes) if axes else None, writes))
    return tuple(found)
