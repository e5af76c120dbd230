"""What the numbers of points mean where the order of visits is free, and what they then cannot mean."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError
from trajevo.path.choices.orders import FreeOrder
from trajevo.path.passing import Passing
from trajevo.path.segments import ToolSegment

#: What else is to be done where a number cannot be used.
_INSTEAD = "which is visited at any place of its group; expected a point outside of free"


def check_numbers(
    free: FreeOrder,
    *,
    passing: Sequence[Passing] = (),
    segments: Sequence[ToolSegment] = (),
    carried: Any = None,
    duration_bounds: Array | None = None,
) -> None:
    """Refuse numbers of points in a free group that might mean the point or its place.

    Outside of the groups a point has the place of its number. All points of a group may stop or dwell alike.

    Args:
        free: which points are free.
        passing: how points are passed.
        segments: what is asked of segments.
        carried: settings of loads; others than a list of them have no numbers.
        duration_bounds: bounds of all segments, shape (2,), or of each, shape (K - 1, 2) [s].

    Raises:
        InvalidInputError: such a number, named with what gives it.
    """
    group_of = free.group_of
    for one in passing:
        if one.point in group_of:
            _check_alike(one, free.groups[group_of[one.point]], passing)
    for segment in segments:
        for key, point in (("from", segment.from_point), ("to", segment.last)):
            if point in group_of:
                raise InvalidInputError(f"{segment.name}: {key}: point {point} is free in its order, {_INSTEAD}")
    for place, load in enumerate(carried if isinstance(carried, list) else ()):
        for key in ("from", "to"):
            picked = load.get(key) if isinstance(load, Mapping) else None
            if picked in group_of:
                raise InvalidInputError(f"payload.{place}: {key}: point {picked} is free in its order, {_INSTEAD}")
    if duration_bounds is not None and np.ndim(duration_bounds) == 2:
        _check_durations(free, np.asarray(duration_bounds))


def _check_alike(one: Passing, group: tuple[int, ...], passing: Sequence[Passing]) -> None:
    for key in ("velocity", "acceleration", "window"):
        if getattr(one, key) is not None:
            raise InvalidInputError(f"passing: point {one.point}: {key}: the point is free in its order, {_INSTEAD}")
    alike = {other.point for other in passing if (other.stop, other.dwell) == (one.stop, one.dwell)}
    for point in group:
        if point not in alike:
            asked = f"dwell = {one.dwell:g}" if one.dwell else "stop"
            raise InvalidInputError(
                f"passing: point {one.point}: expected {asked} at all points of its free group, "
                f"{', '.join(map(str, group))}, as each may have any of their places, but not at point {point}"
            )


def _check_durations(free: FreeOrder, bounds: Array) -> None:
    """Bounds of segments at places of a group are those of no two points, so they must agree."""
    for group in free.groups:
        beside = sorted({k for point in group for k in (point - 1, point) if 0 <= k < len(bounds)})
        other = next((k for k in beside if (bounds[k] != bounds[beside[0]]).any()), None)
        if other is not None:
            raise InvalidInputError(
                f"duration_bounds: expected the same for all segments at the places of the free points "
                f"{', '.join(map(str, group))}, got {bounds[beside[0]].tolist()} and {bounds[other].tolist()} s"
            )
