"""Whether a problem's times follow a smooth pace, and which."""

from __future__ import annotations

from typing import Any

import numpy as np

from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError
from trajevo.path.via_points import ViaPoints
from trajevo.robot.robot import Robot
from trajevo.trajectory.interpolants.interpolant import Interpolant, PassesNearby
from trajevo.trajectory.pace.paced import Paced, checked_count
from trajevo.trajectory.pace.path_pace import path_pace

#: Number of points above which a smooth pace is taken unless told otherwise, and its number of variables.
MANY, USUAL = 40, 24

#: Least times of a pace as multiples of the least times allowed, so that it can be quicker than the one to begin with.
_ROOM = 1.25


def with_pace(interpolant: Interpolant, points: ViaPoints, robot: Robot, given: Any, *, besides: str) -> Interpolant:
    """An interpolant with a smooth pace, if that is asked for or there are many points; else the interpolant itself.

    Args:
        interpolant: the interpolant through the points.
        points: the points.
        robot: the robot, whose limits say what a fast pace is.
        given: number of variables of the pace, 0 for a time of each segment; None for 24 where there are more than 40
            points and nothing else stands against it.
        besides: what else is asked of the motion that a smooth pace does not know, ``""`` for nothing.

    Raises:
        InvalidInputError: no such number, or a pace is asked for and something stands against it.
    """
    if given is not None and not (isinstance(given, int) and not isinstance(given, bool) and given == 0):
        count = checked_count(given)
    elif given is None and len(points) > MANY:
        count = USUAL
    else:
        return interpolant
    against = _against(interpolant, points, besides)
    if against and given is None:
        return interpolant
    if against:
        raise InvalidInputError(f"pace: expected {against}")
    limits = (robot.limits.sides(key).lesser for key in ("velocity", "acceleration", "jerk"))
    pace = _with_knots(path_pace(points.positions, *limits), type(interpolant).virtual_knots or 0)
    least = np.array([variable.lower for variable in interpolant.variables])
    return Paced(interpolant, np.maximum(pace, _ROOM * least), count)


def notes_on_pace(interpolant: Interpolant, given: Any) -> tuple[str, ...]:
    """One sentence where a smooth pace was taken without being asked for."""
    if given is not None or not isinstance(interpolant, Paced):
        return ()
    return (
        f"the times of {len(interpolant.pace)} segments follow a smooth pace of {interpolant.count} variables, as "
        f"there are more than {MANY} points; pace = 0 takes a variable for each",
    )


def _against(interpolant: Interpolant, points: ViaPoints, besides: str) -> str:
    """What a pace would need instead, ``""`` for nothing."""
    if besides:
        return f"no {besides} with it, whose times it does not know"
    if isinstance(interpolant, PassesNearby):
        return "an interpolant that meets its points, such as quintic_spline"
    variables, times = interpolant.variables, len(points) - 1 + 2 * (type(interpolant).virtual_knots or 0)
    if len(variables) != times or any(variable.unit != "s" for variable in variables):
        return f"a time for each of {times} segments as the variables, got {len(variables)} variables"
    return ""


def _with_knots(pace: Array, knots: int) -> Array:
    """Times between points and the knots that an interpolant has between the first and between the last two."""
    if not knots:
        return pace
    first, last = (np.full(knots + 1, time / (knots + 1)) for time in (pace[0], pace[-1]))
    return np.concatenate([first, pace[1:-1], last])
