"""What is asked of segments: a tool that moves along a line or an arc, or an axis of the tool that stays upright."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, numbers, read_only
from trajevo.base.shown.brief import brief
from trajevo.base.units import quantity
from trajevo.errors import InvalidInputError, checked_name, known_names

#: How far the tool may be from its line or arc if nothing is said: position [m] and orientation [rad].
TOLERANCE, TURNING = 5e-4, float(np.radians(0.5))

#: Greatest tolerance that is no mistaken unit [m], least one that can be kept and proven [m, rad].
_MOST_TOLERANCE, _LEAST = 0.1, 1e-6

#: Ways of the tool.
WAYS = ("line", "arc")

#: Where the motion rests on a line or an arc, and whether it does at its start and at its end.
RESTS = {"both": (True, True), "start": (True, False), "end": (False, True), "none": (False, False)}

#: Names of the tool's axes.
AXES = {
    f"{sign}{name}": tuple((-1.0 if sign else 1.0) * row)
    for sign in ("", "-")
    for name, row in zip("xyz", np.eye(3), strict=True)
}

#: Keys that are no names in Python, and the attributes for them.
_PLACES = {"from": "from_point", "to": "to_point"}

_KEYS = ("from", "to", "tool", "through", "rest", "tolerance", "turning", "upright", "axis", "direction")


@final
@dataclass(frozen=True, eq=False)
class ToolSegment:
    """What is asked of the motion from one point to another.

    With ``tool`` the tool goes from one point to the other along a line or an arc, its orientation by the shortest
    turn.

    Attributes:
        from_point: number of the point at which it begins, counted from 0.
        to_point: number of the point at which it ends; the next one if None. With ``tool`` it must be the next.
        tool: ``"line"``, ``"arc"``, or None for any way.
        through: position of the tool on the way, for an arc, shape (3,) [m].
        rest: where the motion rests on a line or an arc, one of :data:`RESTS`; elsewhere it passes the point without a
            stop, in the direction of the way.
        tolerance: how far the tool may be from the line or arc at any instant [m].
        turning: how far its orientation may be from the nominal one [rad].
        upright: greatest angle of the tool's axis to the direction at any instant [rad]; None for any.
        axis: axis in the tool's frame, one of :data:`AXES` or shape (3,).
        direction: direction in the base frame, shape (3,); if None the vertical, up or down, whichever is nearer to the
            axis at ``from_point``.

    Raises:
        InvalidInputError: something else, or nothing asked.
    """

    from_point: int
    to_point: int | None = None
    tool: str | None = None
    through: Array | None = None
    rest: str = "both"
    tolerance: float = TOLERANCE
    turning: float = TURNING
    upright: float | None = None
    axis: Any = "z"
    direction: Array | None = None

    __repr__ = brief

    def __post_init__(self) -> None:
        for key, name in _PLACES.items():
            point = getattr(self, name)
            whole = isinstance(point, int | np.integer) and not isinstance(point, bool)
            if not (whole and point >= 0) and not (point is None and key == "to"):
                raise InvalidInputError(f"segments: {key}: expected the number of a point, from 0, got {point!r}")
        object.__setattr__(self, "from_point", int(self.from_point))
        object.__setattr__(self, "to_point", self.from_point + 1 if self.to_point is None else int(self.to_point))
        if self.last <= self.from_point:
            raise InvalidInputError(
                f"segments: to: expected a point after {self.from_point}, where it begins, got {self.to_point}"
            )
        if self.tool is None and self.upright is None:
            raise InvalidInputError(f"{self.name}: expected tool = 'line' or 'arc', or upright, got neither")
        self._check_way()
        self._check_cone()

    @property
    def last(self) -> int:
        """Number of the point at which it ends."""
        return self.from_point + 1 if self.to_point is None else self.to_point

    @property
    def rests(self) -> dict[int, bool]:
        """Whether the motion rests at the ends of its line or arc, by their points; empty without one."""
        ends = (self.from_point, self.last)
        return dict(zip(ends, RESTS[self.rest], strict=True)) if self.tool is not None else {}

    @property
    def name(self) -> str:
        """What messages call it."""
        return f"segments: from {self.from_point} to {self.last}"

    @property
    def label(self) -> str:
        """Its points, for the names of columns."""
        return f"from point {self.from_point} to {self.last}"

    @property
    def settings(self) -> dict[str, Any]:
        """Plain data from which an equal object can be made: what differs from nothing asked."""
        told: dict[str, Any] = {"from": self.from_point, "to": self.last}
        if self.tool is not None:
            told |= {"tool": self.tool, "tolerance": self.tolerance, "turning": self.turning}
            told |= {} if self.rest == "both" else {"rest": self.rest}
            told |= {} if self.through is None else {"through": self.through.tolist()}
        if self.upright is not None:
            told |= {"upright": self.upright, "axis": list(self.axis)}
            told |= {} if self.direction is None else {"direction": self.direction.tolist()}
        return told

    def _check_way(self) -> None:
        if self.tool is not None:
            checked_name(f"tool of a segment ({self.name})", self.tool, WAYS)
            if self.last != self.from_point + 1:
                raise InvalidInputError(
                    f"{self.name}: expected neighbouring points, as the tool moves along one {self.tool} at a time"
                )
        checked_name(f"rest of a segment ({self.name})", self.rest, RESTS)
        if self.rest != "both" and self.tool is None:
            raise InvalidInputError(f"{self.name}: rest: expected it with tool, whose line or arc it is about")
        if (self.through is not None) != (self.tool == "arc"):
            raise InvalidInputError(
                f"{self.name}: through: expected the position of the tool on the way with tool = 'arc', and with it "
                f"alone, got {'none' if self.through is None else f'tool = {self.tool!r}'}"
            )
        if self.through is not None:
            through = numbers(self.through, name=f"{self.name}: through", shape=(3,))
            object.__setattr__(self, "through", read_only(through))
        tolerance = _amount(self.tolerance, "m", f"{self.name}: tolerance")
        if not _LEAST <= tolerance <= _MOST_TOLERANCE:
            likely = f"; {1e-3 * tolerance:g} if it is mm" if tolerance > _MOST_TOLERANCE else ""
            raise InvalidInputError(
                f"{self.name}: tolerance: expected {_LEAST:g} to {_MOST_TOLERANCE:g} m, got {tolerance:g} m{likely}"
            )
        object.__setattr__(self, "tolerance", tolerance)
        object.__setattr__(self, "turning", self._angle("turning", self.turning, _LEAST))

    def _check_cone(self) -> None:
        if self.upright is not None:
            object.__setattr__(self, "upright", self._angle("upright", self.upright, 1e-4))
        axis = self.axis
        if isinstance(axis, str):
            axis = AXES[checked_name(f"axis of the tool ({self.name})", axis, AXES)]
        object.__setattr__(self, "axis", tuple(_unit(axis, f"{self.name}: axis").tolist()))
        if self.direction is not None:
            object.__setattr__(self, "direction", read_only(_unit(self.direction, f"{self.name}: direction")))
            if self.upright is None:
                raise InvalidInputError(f"{self.name}: direction: expected it with upright, which it belongs to")

    def _angle(self, key: str, given: Any, least: float) -> float:
        angle = _amount(given, "rad", f"{self.name}: {key}")
        if not least <= angle < 0.5 * np.pi:
            likely = f'; write "{angle:g} deg" if it is in degrees' if 0.5 * np.pi <= angle <= 90.0 else ""
            raise InvalidInputError(
                f"{self.name}: {key}: expected an angle from {least:g} to below π/2 rad, got {angle:g} rad{likely}"
            )
        return angle


def segments_of(given: Any, count: int) -> tuple[ToolSegment, ...]:
    """What is asked of segments, from any form in which a user may give it.

    Args:
        given: a list of :class:`ToolSegment` or of mappings with ``from``, ``to`` and what is asked there.
        count: number of points.

    Raises:
        InvalidInputError: something else, a point that does not exist, or two ways of the tool for one segment.
    """
    if isinstance(given, Mapping | str) or not isinstance(given, Sequence):
        raise InvalidInputError(f"segments: expected a list, each entry with from and to, its points, got {given!r}")
    found = tuple(one if isinstance(one, ToolSegment) else _of_mapping(k, one) for k, one in enumerate(given))
    for one in found:
        if one.last > count - 1:
            raise InvalidInputError(f"{one.name}: to: expected at most {count - 1}, the last point, got {one.last}")
    for what in ("tool", "upright"):
        places = [(one.from_point, one.last) for one in found if getattr(one, what) is not None]
        for place in places:
            if places.count(place) > 1:
                raise InvalidInputError(
                    f"segments: from {place[0]} to {place[1]}: expected one entry with {what}, got several"
                )
    return found


def _of_mapping(place: int, entry: Any) -> ToolSegment:
    if not isinstance(entry, Mapping) or "from" not in entry:
        raise InvalidInputError(f"segments.{place}: expected from and to, and what is asked there, got {entry!r}")
    for key in entry:
        if key not in _KEYS:
            raise InvalidInputError(f"segments.{place}: unknown key {key!r}; {known_names(str(key), _KEYS)}")
    return ToolSegment(**{_PLACES.get(str(key), str(key)): value for key, value in entry.items()})


def _amount(given: Any, unit: str, name: str) -> float:
    """A number in SI, or a text with its unit."""
    if isinstance(given, str):
        return quantity(given, unit, name=name)
    if isinstance(given, bool):
        raise InvalidInputError(f"{name}: expected a number [{unit}], got {given!r}")
    return float(numbers(given, name=name, shape=()))


def _unit(given: Any, name: str) -> Array:
    vector = numbers(given, name=name, shape=(3,))
    length = float(np.linalg.norm(vector))
    if not length > 0.0:
        raise InvalidInputError(f"{name}: expected a vector that is not 0")
    unit: Array = vector / length
    return unit
