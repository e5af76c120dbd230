"""What a paper shows, and what becomes of it here: its items, the numbers that it prints, and ours."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeVar, final

from trajevo.errors import InvalidInputError, TrajevoError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

T = TypeVar("T")

#: What an item is.
Kind = Literal["figure", "table"]

#: What comes of a printed number.
Verdict = Literal["as printed", "differs", "unexpected"]


@final
@dataclass(frozen=True, kw_only=True)
class PrintedNumber:
    """A number that a paper prints, beside ours.

    Attributes:
        of: the quantity, such as ``"least time"``.
        unit: its unit; ``"1"`` for none.
        printed: the number as it is printed, with all its digits.
        ours: the number that comes out here; None if none can be computed.
        within: the greatest difference under which the two are the same [unit]; half of the last printed digit if None.
        why: why ours differs by more than that, or why a wider ``within`` is right. Empty where they agree.
        differs: whether the two are known to differ, for the reason that ``why`` tells.

    Raises:
        InvalidInputError: ``printed`` is no number, or a difference or a width is not explained.
    """

    of: str
    unit: str
    printed: str
    ours: float | None
    within: float | None = None
    why: str = ""
    differs: bool = False

    def __post_init__(self) -> None:
        try:
            float(self.printed)
        except ValueError:
            raise InvalidInputError(
                f"{self.of}: printed: expected a number as text, such as '4.52', got {self.printed!r}"
            ) from None
        if (self.differs or self.within is not None or self.ours is None) and not self.why:
            raise InvalidInputError(f"{self.of}: why: expected a reason for what differs, or for a width")

    @property
    def value(self) -> float:
        """The printed number [unit]."""
        return float(self.printed)

    @property
    def tolerance(self) -> float:
        """The greatest difference under which ours is the printed number [unit]."""
        if self.within is not None:
            return self.within
        digits, _, exponent = self.printed.lower().partition("e")
        decimals = len(digits.partition(".")[2])
        # A number may have been rounded or cut off; floats of the limit itself are inside.
        return 0.5000001 * 10.0 ** (int(exponent or 0) - decimals)

    @property
    def difference(self) -> float:
        """Ours less the printed number [unit]; NaN if there is none."""
        return math.nan if self.ours is None else self.ours - self.value

    @property
    def verdict(self) -> Verdict:
        """``"as printed"``, ``"differs"`` for a known reason, or ``"unexpected"``: neither of what is said of it."""
        same = abs(self.difference) <= self.tolerance
        if self.differs or self.ours is None:
            return "unexpected" if same else "differs"
        return "as printed" if same else "unexpected"


@final
@dataclass(frozen=True)
class NumberTable:
    """Rows of a table or the points of a figure, which are written as CSV.

    Attributes:
        headers: names of the columns, each with its unit in brackets if it has one.
        rows: cells, texts or numbers, as many in each row as there are headers.

    Raises:
        InvalidInputError: a row has another number of cells.
    """

    headers: Sequence[str]
    rows: Sequence[Sequence[str | float]]

    def __post_init__(self) -> None:
        for number, row in enumerate(self.rows):
            if len(row) != len(self.headers):
                raise InvalidInputError(
                    f"rows[{number}]: expected {len(self.headers)} cells, one for each header, got {len(row)}"
                )


@final
@dataclass(frozen=True, kw_only=True)
class Shown:
    """What was made of one figure or table.

    Attributes:
        numbers: the numbers that the paper prints there, each beside ours.
        table: its rows or the points of its curves.
        figure: the picture of a figure.
        said: sentences about it for readers.
    """

    numbers: Sequence[PrintedNumber] = ()
    table: NumberTable | None = None
    figure: Figure | None = None
    said: Sequence[str] = ()


@final
class InterruptedSearchError(TrajevoError):
    """A computation was asked to stop, so that what it came to is not that of a whole one."""


@final
class Desk:
    """What the items of one paper share: a seed, how long searches are, and what has been computed already.

    Args:
        seed: seed of all searches.
        short: whether searches are short, for a first look; numbers that depend on them then differ.
        say: is told what is computed, a few words.
        stopped: whether computations were asked to stop, which searches do with what they have found so far.
    """

    def __init__(
        self,
        *,
        seed: int = 1,
        short: bool = False,
        say: Callable[[str], None] | None = None,
        stopped: Callable[[], bool] = lambda: False,
    ) -> None:
        self.seed, self.short = seed, short
        self._say, self._stopped = say, stopped
        self._known: dict[str, Any] = {}

    def once(self, what: str, make: Callable[[], T]) -> T:
        """The result of a computation that several items need, made when the first asks for it.

        Args:
            what: names it, and tells people what is computed, such as ``"front of the smooth curve"``.
            make: computes it.

        Raises:
            InterruptedSearchError: it was asked to stop.
        """
        if what not in self._known:
            if self._say is not None:
                self._say(what)
            found = make()
            if self._stopped():
                raise InterruptedSearchError(f"{what}: asked to stop")
            self._known[what] = found
        known: T = self._known[what]
        return known


@final
@dataclass(frozen=True)
class Item:
    """One figure or table of a paper that can be made again.

    Attributes:
        kind: ``"figure"`` or ``"table"``.
        number: its number in the paper, such as ``"10"``.
        title: what it shows, a few words.
        make: makes it.
        searches: whether its numbers are those of a search, so that a short one has others.
    """

    kind: Kind
    number: str
    title: str
    make: Callable[[Desk], Shown]
    searches: bool = False

    @property
    def stem(self) -> str:
        """Its name in files, such as ``figure_03``."""
        digits = self.number.rstrip("abcdefghijklmnopqrstuvwxyz")
        return f"{self.kind}_{digits.zfill(2)}{self.number[len(digits) :]}"

    def __str__(self) -> str:
        return f"{self.kind.capitalize()} {self.number}"


@final
@dataclass(frozen=True)
class LeftOut:
    """A figure, a table or a number of a paper that cannot be made again.

    Attributes:
        what: what it is, such as ``"Figure 13"``.
        title: what it shows, a few words.
        why: the reason, measured where it can be.
    """

    what: str
    title: str
    why: str


@final
@dataclass(frozen=True, kw_only=True)
class Paper:
    """A paper and what can be made again of it.

    Attributes:
        name: its name on the command line, such as ``"sun2020"``.
        citation: authors, title, journal, year.
        doi: its digital object identifier; empty if it has none.
        items: figures and tables in the order of the paper.
        left_out: what cannot be made again, and why.

    Raises:
        InvalidInputError: two items have the same kind and number.
    """

    name: str
    citation: str
    doi: str
    items: Sequence[Item]
    left_out: Sequence[LeftOut] = ()

    def __post_init__(self) -> None:
        seen = [str(item) for item in self.items]
        twice = sorted({name for name in seen if seen.count(name) > 1})
        if twice:
            raise InvalidInputError(f"{self.name}: expected one item of each kind and number, got {twice[0]} twice")

    def chosen(self, *, figures: Sequence[str] = (), tables: Sequence[str] = ()) -> list[Item]:
        """Items with some numbers in the order of the paper; all if none are given.

        Raises:
            InvalidInputError: the paper has no such item that can be made again; the message says why.
        """
        if not figures and not tables:
            return list(self.items)
        wanted = [("figure", number) for number in figures] + [("table", number) for number in tables]
        known = {(item.kind, item.number): item for item in self.items}
        for kind, number in wanted:
            if (kind, number) not in known:
                raise InvalidInputError(self._unknown(kind, number))
        return [item for item in self.items if (item.kind, item.number) in wanted]

    def _unknown(self, kind: str, number: str) -> str:
        name = f"{kind.capitalize()} {number}"
        for one in self.left_out:
            if one.what == name:
                return f"{self.name}: {name}, {one.title}, cannot be made again: {one.why}"
        made = ", ".join(item.number for item in self.items if item.kind == kind)
        expected = f"expected one of {made}" if made else f"there is no {kind} of this paper"
        return f"{self.name}: --{kind}: {expected}, got {number!r}"
