"""Lines and arcs of the tool in a problem: their curves, and the stops at their ends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from trajevo.errors import InvalidInputError
from trajevo.path.passing import Passing
from trajevo.path.segments import ToolSegment
from trajevo.path.via_points import OnLimit, ViaPoints
from trajevo.robot.robot import Robot
from trajevo.trajectory.interpolants import FixedCurve, curve_along


def curves_of(segments: Sequence[ToolSegment], robot: Robot, points: ViaPoints, kind: str) -> dict[int, FixedCurve]:
    """The curves of all lines and arcs of the tool, by the point at which they begin.

    Raises:
        UnreachableError: a way that the robot does not reach or follow.
        InvalidInputError: a way between one and the same position, or as :func:`curve_along`.
    """
    return {one.from_point: curve_along(one, robot, points, kind=kind) for one in segments if one.tool is not None}


def with_stops(passing: Sequence[Passing], segments: Sequence[ToolSegment], count: int) -> tuple[Passing, ...]:
    """How points are passed, with stops at the ends of lines and arcs of the tool.

    Args:
        passing: how they are passed otherwise, in their order.
        segments: what is asked of segments.
        count: number of points.

    Raises:
        InvalidInputError: a velocity or acceleration where a line or an arc begins or ends, a stop where it does so
            without a rest, or no rest where the whole motion begins or ends or two lines meet.
    """
    found = {one.point: one for one in passing}
    flowing: dict[int, ToolSegment] = {}
    for segment in segments:
        for point, rests in segment.rests.items():
            known = found.get(point)
            _check_passing(known, segment, point, rests)
            if rests and 0 < point < count - 1:
                found[point] = Passing(point, stop=True) if known is None else replace(known, stop=True)
            if not rests:
                _check_flowing(segment, point, count)
                flowing[point] = segment
    for point, segment in flowing.items():
        others = [one for one in segments if point in one.rests and one is not segment]
        if others:
            raise InvalidInputError(
                f"{segment.name}: rest: expected a rest at point {point}, where another {others[0].tool} of the tool "
                "is joined: only free segments can follow its direction and speed"
            )
    return tuple(found[point] for point in sorted(found))


def check_limits(segments: Sequence[ToolSegment], on_limits: Sequence[OnLimit], robot: Robot) -> None:
    """Refuse a way that passes a point on a joint's limit without a rest, since the joint would leave its range.

    Raises:
        InvalidInputError: as said.
    """
    for segment in segments:
        for at in on_limits:
            if segment.rests.get(at.point) is False:
                raise InvalidInputError(
                    f"{segment.name}: rest: expected a rest at point {at.point}, which lies on the "
                    f"{'upper' if at.upper else 'lower'} limit of {robot.joint_names[at.joint]!r}, got {segment.rest!r}"
                )


def _check_passing(known: Passing | None, segment: ToolSegment, point: int, rests: bool) -> None:
    """Refuse what contradicts a line or an arc at one of its ends."""
    begins = "begins" if point == segment.from_point else "ends"
    if known is not None and known.vectors:
        key = next(iter(known.vectors))
        how = "at rest" if rests else "with a velocity of its own"
        raise InvalidInputError(
            f"passing: point {point}: {key}: expected none, as a {segment.tool} of the tool {begins} there {how} "
            f"({segment.name})"
        )
    if known is not None and known.stop and not rests:
        raise InvalidInputError(
            f"passing: point {point}: {'dwell' if known.dwell else 'stop'}: expected none, as a {segment.tool} of the "
            f"tool {begins} there without a rest ({segment.name}, rest = {segment.rest!r})"
        )


def _check_flowing(segment: ToolSegment, point: int, count: int) -> None:
    """Refuse a way without a rest where the whole motion begins or ends."""
    if point in (0, count - 1):
        raise InvalidInputError(
            f"{segment.name}: rest: expected a rest at point {point}, where the whole motion "
            f"{'begins' if point == 0 else 'ends'}, got {segment.rest!r}"
        )
