"""Which points may be visited in any order, and which of them come after others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError, checked_name

#: Greatest number of points whose order is free.
MOST_FREE = 200


@final
@dataclass(frozen=True, eq=False)
class FreeOrder:
    """Groups of points that are visited in any order; made by :meth:`of`.

    Each group has the places that its points have in the list of points: of the points 0 to 5 with a free group 1, 2, 4
    point 0 comes first, then two of the group, then point 3, the third of the group, and point 5.

    Attributes:
        count: number of points K.
        groups: numbers of the points of each group, in ascending order.
        after: for each point that has any, the points that come before it.
    """

    count: int
    groups: tuple[tuple[int, ...], ...]
    after: Mapping[int, tuple[int, ...]]

    __repr__ = brief

    @classmethod
    def of(cls, given: Any, count: int, *, cyclic: bool = False) -> FreeOrder | None:
        """The free order that a user asks for.

        Args:
            given: None; ``"free"`` for all points but the first and the last; or a mapping with ``free``, numbers of
                points from 0 on, ``"all"``, or a list of such groups, and ``after``, a mapping of points to the point
                or the points that come before each.
            count: number of points.
            cyclic: whether the last point is the first, which no group may then have.

        Raises:
            UnknownNameError: another key.
            InvalidInputError: no points, points that do not exist or are named twice, a group of one, or points that
                come after each other or after later places.
        """
        if given is None:
            return None
        if isinstance(given, str):
            checked_name("order", given, ("free",))
            given = {"free": "all"}
        if not isinstance(given, Mapping):
            raise InvalidInputError(f"order: expected 'free', or a table with free and after, got {given!r}")
        for key in given:
            checked_name("key of order", key, ("free", "after"))
        groups = _groups(given.get("free"), count)
        if cyclic:
            for end in (0, count - 1):
                if any(end in group for group in groups):
                    raise InvalidInputError(
                        f"order: free: point {end} is an end of a cycle, whose last point is the first: expected others"
                    )
        found = cls(count, groups, _after(given.get("after"), count))
        found._check_precedence()
        return found

    @property
    def settings(self) -> dict[str, Any]:
        """Plain data from which :meth:`of` makes an equal order."""
        groups = [list(group) for group in self.groups]
        free: dict[str, Any] = {"free": groups[0] if len(groups) == 1 else groups}
        return free | (
            {"after": {str(point): list(first) for point, first in self.after.items()}} if self.after else {}
        )

    @cached_property
    def free(self) -> tuple[int, ...]:
        """All points of the groups, group by group; there is one key for each."""
        return tuple(point for group in self.groups for point in group)

    @cached_property
    def group_of(self) -> dict[int, int]:
        """Group of each free point; it is also that of the place with the same number."""
        return {point: g for g, group in enumerate(self.groups) for point in group}

    @cached_property
    def before(self) -> Array:
        """Whether a point comes before another one of its group, shape (K, K): ``before[first, then]``."""
        found = np.zeros((self.count, self.count), dtype=bool)
        for then, firsts in self.after.items():
            for first in firsts:
                found[first, then] = first in self.group_of and self.group_of.get(first) == self.group_of.get(then)
        return found

    def decoded(self, keys: Array) -> Array:
        """Orders from keys: of the points of its group that may come next, each place takes the one of the least key.

        So every order keeps the precedence, whatever the keys.

        Args:
            keys: one for each of :attr:`free`, shape (B, number of free points).

        Returns:
            Number of the point at each place, shape (B, K).
        """
        rows, waiting = np.arange(len(keys)), np.full((len(keys), self.count), np.inf)
        waiting[:, list(self.free)] = keys
        orders = np.tile(np.arange(self.count), (len(keys), 1))
        for place in range(self.count):
            group = self.group_of.get(place)
            if group is None:
                continue
            members = np.array(self.groups[group])
            left = np.isfinite(waiting[:, members])
            barred = (left[:, :, None] & self.before[np.ix_(members, members)]).any(axis=1)
            # Of keys that are not numbers, as no search has them, the first one counts.
            next_one = members[np.where(left & ~barred, waiting[:, members], np.inf).argmin(axis=1)]
            orders[:, place] = next_one
            waiting[rows, next_one] = np.inf
        return orders

    def keys(self, orders: Array) -> Array:
        """The keys of orders, evenly spaced from 0 to 1 in each group: (B, K) -> (B, number of free points)."""
        places = np.empty(orders.shape, dtype=np.int64)
        np.put_along_axis(places, orders, np.arange(self.count)[None], axis=1)
        found = np.empty((len(orders), len(self.free)))
        column = 0
        for group in self.groups:
            ranks = np.searchsorted(group, places[:, list(group)])
            found[:, column : column + len(group)] = (ranks + 0.5) / len(group)
            column += len(group)
        return found

    def keeps(self, orders: Array) -> Array:
        """Whether orders visit every point once, in the places of its group, with precedence kept, shape (B,)."""
        whole = (np.sort(orders, axis=1) == np.arange(self.count)).all(axis=1)
        group = np.array([self.group_of.get(k, -1 - k) for k in range(self.count)])
        fits = (group[orders] == group).all(axis=1)
        places = np.argsort(orders, axis=1, kind="stable")
        kept = np.ones(len(orders), dtype=bool)
        for then, firsts in self.after.items():
            for first in firsts:
                kept &= places[:, first] < places[:, then]
        return np.asarray(whole & fits & kept)

    def _check_precedence(self) -> None:
        """Refuse points that come after each other, or that the places of their groups keep from coming after."""
        cycle = _cycle(self.after)
        if cycle:
            told = " after ".join(str(point) for point in cycle)
            raise InvalidInputError(f"order: after: expected points that can come one after another, got {told}")
        for then, firsts in self.after.items():
            for first in firsts:
                mine, others = self._places(then), self._places(first)
                same = self.group_of.get(then, -1) == self.group_of.get(first, -2)
                if not same and max(others) > min(mine):
                    raise InvalidInputError(
                        f"order: after: point {then} cannot always come after point {first}, which has "
                        f"{_told_places(others)}, and itself {_told_places(mine)}: put both into one free group"
                    )

    def _places(self, point: int) -> tuple[int, ...]:
        group = self.group_of.get(point)
        return (point,) if group is None else self.groups[group]


def _told_places(places: Sequence[int]) -> str:
    return f"place {places[0]}" if len(places) == 1 else f"one of the places {', '.join(map(str, places))}"


def _groups(given: Any, count: int) -> tuple[tuple[int, ...], ...]:
    if given is None:
        raise InvalidInputError("order: expected free, the numbers of the points that are visited in any order")
    if isinstance(given, str):
        checked_name("order: free", given, ("all",))
        if count < 4:
            raise InvalidInputError(
                f"order: free: expected at least 2 points between the ends, got {max(count - 2, 0)}"
            )
        return (tuple(range(1, count - 1)),)
    if not _is_list(given) or not len(given):
        raise InvalidInputError(f"order: free: expected numbers of points or lists of them, got {given!r}")
    lists = [_is_list(one) for one in given]
    if any(lists) and not all(lists):
        raise InvalidInputError(f"order: free: expected numbers of points or lists of them, got both, {list(given)!r}")
    found = [_group(one, count) for one in (given if all(lists) else [given])]
    taken: set[int] = set()
    for group in found:
        twice = sorted(taken.intersection(group))
        if twice:
            raise InvalidInputError(f"order: free: expected every point in one group, got point {twice[0]} in two")
        taken.update(group)
    if len(taken) > MOST_FREE:
        raise InvalidInputError(f"order: free: expected at most {MOST_FREE} points, got {len(taken)}")
    return tuple(found)


def _is_list(given: Any) -> bool:
    return (isinstance(given, Sequence) and not isinstance(given, str)) or (
        isinstance(given, np.ndarray) and given.ndim > 0
    )


def _group(given: Sequence[Any], count: int) -> tuple[int, ...]:
    numbers = [_point(one, count, "free") for one in given]
    for point in numbers:
        if numbers.count(point) > 1:
            raise InvalidInputError(f"order: free: expected every point once, got point {point} twice")
    if len(numbers) < 2:
        raise InvalidInputError(f"order: free: expected at least 2 points in a group, got {numbers}")
    return tuple(sorted(numbers))


def _point(given: Any, count: int, key: str) -> int:
    if isinstance(given, bool) or not isinstance(given, int | np.integer) or not 0 <= given < count:
        raise InvalidInputError(f"order: {key}: expected numbers of points from 0 to {count - 1}, got {given!r}")
    return int(given)


def _after(given: Any, count: int) -> dict[int, tuple[int, ...]]:
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        raise InvalidInputError(f"order: after: expected a table of points, as {{ 4 = [2] }}, got {given!r}")
    found: dict[int, tuple[int, ...]] = {}
    for key, firsts in given.items():
        # Keys of TOML and JSON are text.
        number = int(key) if isinstance(key, str) and key.isdecimal() else key
        then = _point(number, count, "after")
        if then in found:  # 1 and "1", or 1 and 01
            raise InvalidInputError(f"order: after: expected every point once, got point {then} twice")
        listed = firsts if _is_list(firsts) else [firsts]
        found[then] = tuple(sorted({_point(first, count, "after") for first in listed}))
    return {then: firsts for then, firsts in sorted(found.items()) if firsts}


def _cycle(after: Mapping[int, tuple[int, ...]]) -> list[int]:
    """Points each of which comes after the next one, the first again at the end; empty if there are none."""
    done: set[int] = set()

    def walked(point: int, way: list[int]) -> list[int]:
        if point in way:
            return [*way[way.index(point) :], point]
        if point in done:
            return []
        for first in after.get(point, ()):
            found = walked(first, [*way, point])
            if found:
                return found
        done.add(point)
        return []

    return next((found for found in (walked(point, []) for point in after) if found), [])
