"""Lines and arcs of the tool in a problem: their curves, and the stops at their ends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from trajevo.errors import InvalidInputError
from trajevo.path.passing import Passing
from trajevo.path.segments import ToolSegment
from trajevo.path.via_points import ViaPoints
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
        InvalidInputError: a velocity or acceleration where a line or an arc begins or ends.
    """
    found = {one.point: one for one in passing}
    for segment in segments:
        for point in (segment.from_point, segment.last) if segment.tool is not None else ():
            known = found.get(point)
            if known is not None and known.vectors:
                key = next(iter(known.vectors))
                begins = "begins" if point == segment.from_point else "ends"
                raise InvalidInputError(
                    f"passing: point {point}: {key}: expected none, as a {segment.tool} of the tool {begins} there at "
                    f"rest ({segment.name})"
                )
            if 0 < point < count - 1:
                found[point] = Passing(point, stop=True) if known is None else replace(known, stop=True)
    return tuple(found[point] for point in sorted(found))
