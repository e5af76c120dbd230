"""How points are passed: with a stop, after which the motion may wait, with a given velocity, or at a given time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, numbers, read_only
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError, known_names

#: Greatest dwell that is not taken for milliseconds [s].
_MOST_DWELL = 1000.0


@final
@dataclass(frozen=True, eq=False)
class Passing:
    """How one point is passed.

    Attributes:
        point: index of the point, from 0.
        stop: whether the motion rests there, without velocity and acceleration, as at its ends; only at an inner point.
        dwell: how long it stays there [s]; a dwell is a stop.
        velocity: velocities of the joints there, shape (n_joints,) [rad/s or m/s]; None leaves those of an inner point
            open, and is rest at the first and the last one.
        acceleration: the same at the first or the last point, shape (n_joints,) [rad/s² or m/s²]; None is 0.
        window: earliest and latest instant at which the point is passed, or reached if the motion dwells there [s];
            None for any.

    Raises:
        InvalidInputError: something else, or a point that is passed in two ways.
    """

    point: int
    stop: bool | None = None
    dwell: float = 0.0
    velocity: Array | None = None
    acceleration: Array | None = None
    window: tuple[float, float] | None = None

    __repr__ = brief

    def __post_init__(self) -> None:
        if isinstance(self.point, bool) or not isinstance(self.point, int | np.integer) or self.point < 0:
            raise InvalidInputError(f"passing: point: expected the number of a point, from 0, got {self.point!r}")
        where = f"passing: point {self.point}"
        if not isinstance(self.stop, bool | None):
            raise InvalidInputError(f"{where}: stop: expected true or false, got {self.stop!r}")
        if isinstance(self.dwell, bool):
            raise InvalidInputError(f"{where}: dwell: expected a time [s], got {self.dwell!r}")
        dwell = numbers(self.dwell, name=f"{where}: dwell", shape=()).item()
        if not 0.0 <= dwell <= _MOST_DWELL:
            remedy = f", {1e-3 * dwell:g} if it is ms" if dwell > 0.0 else ""
            raise InvalidInputError(f"{where}: dwell: expected 0 to {_MOST_DWELL:g} s, got {dwell:g} s{remedy}")
        if dwell and self.stop is False:
            raise InvalidInputError(f"{where}: stop: expected true, as a dwell of {dwell:g} s is a stop, got false")
        object.__setattr__(self, "dwell", dwell)
        object.__setattr__(self, "stop", bool(self.stop or dwell))
        for name in ("velocity", "acceleration"):
            given = getattr(self, name)
            if given is not None:
                object.__setattr__(self, name, read_only(numbers(given, name=f"{where}: {name}", shape=("n_joints",))))
                if self.stop:
                    raise InvalidInputError(
                        f"{where}: expected stop or {name}, got both: the motion rests where it stops"
                    )
        if self.window is not None:
            low, high = numbers(self.window, name=f"{where}: window", shape=(2,)).tolist()
            if not 0.0 <= low < high:
                raise InvalidInputError(
                    f"{where}: window: expected an earliest and a later latest instant [s], got {low:g} and {high:g}"
                )
            object.__setattr__(self, "window", (low, high))

    @property
    def vectors(self) -> dict[str, Array]:
        """The given velocity and acceleration, by key, shape (n_joints,) each [rad/s or m/s, and per s more]."""
        return {key: values for key in ("velocity", "acceleration") if (values := getattr(self, key)) is not None}

    def with_more_columns(self, count: int) -> Passing:
        """The same for points with further columns, whose given velocities and accelerations are 0."""
        more: dict[str, Any] = {key: np.append(values, np.zeros(count)) for key, values in self.vectors.items()}
        return replace(self, **more)

    @property
    def settings(self) -> dict[str, Any]:
        """Plain data from which an equal object can be made: what differs from passing freely."""
        told = {"stop": self.stop or None, "dwell": self.dwell or None, "window": self.window}
        told |= {key: values.tolist() for key, values in self.vectors.items()}
        return {"point": int(self.point)} | {
            key: list(value) if isinstance(value, tuple) else value for key, value in told.items() if value is not None
        }


def passings_of(given: Any, count: int, names: Sequence[str]) -> tuple[Passing, ...]:
    """How points are passed, from any form in which a user may give it, in the order of the points.

    Args:
        given: a list of :class:`Passing` or of mappings with ``point`` and what is given there.
        count: number of points.
        names: names of the joints.

    Raises:
        InvalidInputError: something else, a point that does not exist or is told twice, a stop at the first or the
            last point, an acceleration at an inner one, a window of the first, or another number of joints.
    """
    if isinstance(given, Mapping | str) or not isinstance(given, Sequence):
        raise InvalidInputError(f"passing: expected a list, each entry with the number of its point, got {given!r}")
    found: dict[int, Passing] = {}
    for place, entry in enumerate(given):
        one = entry if isinstance(entry, Passing) else _of_mapping(place, entry)
        if one.point in found:
            raise InvalidInputError(f"passing: expected one entry for each point, got two for point {one.point}")
        _check_at(one, count, names)
        found[one.point] = one
    return tuple(found[point] for point in sorted(found))


def _of_mapping(place: int, entry: Any) -> Passing:
    known = [attribute.name for attribute in fields(Passing)]
    if not isinstance(entry, Mapping) or "point" not in entry:
        raise InvalidInputError(f"passing.{place}: expected point and how it is passed, got {entry!r}")
    for key in entry:
        if key not in known:
            raise InvalidInputError(f"passing.{place}: unknown key {key!r}; {known_names(str(key), known)}")
    return Passing(**entry)


def _check_at(one: Passing, count: int, names: Sequence[str]) -> None:
    """Refuse what cannot be at a place among the points."""
    where, last = f"passing: point {one.point}", count - 1
    if one.point > last:
        raise InvalidInputError(f"passing: point: expected 0 to {last}, got {one.point}")
    end = {0: "first", last: "last"}.get(one.point)
    if end and one.stop:
        rest = "begins" if one.point == 0 else "ends"
        raise InvalidInputError(
            f"{where}: {'dwell' if one.dwell else 'stop'}: expected an inner point, 1 to {last - 1}, got the {end}, "
            f"where the motion {rest} at rest anyway"
        )
    if one.acceleration is not None and not end:
        raise InvalidInputError(
            f"{where}: acceleration: expected one at the first or the last point alone, 0 or {last}"
        )
    if one.window is not None and one.point == 0:
        raise InvalidInputError(f"{where}: window: expected a later point, as the motion begins there at 0 s")
    for key in ("velocity", "acceleration"):
        values = getattr(one, key)
        if values is not None and len(values) != len(names):
            raise InvalidInputError(
                f"{where}: {key}: expected {len(names)} numbers, one for each of {', '.join(names)}, got {len(values)}"
            )
