"""Points that lie on the limit of a joint: there the joint must turn, so that the motion lets it rest.

Through such a point a motion stays within the limit only if the joint's velocity is exactly 0 there. Of the times of an
interpolant that leaves this velocity open, hardly any fulfil this, and a search would find few motions or none.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.units import pretty
from trajevo.formulation.constraints.constraint import Constraint
from trajevo.path.boxes import CartesianBox, JointBox
from trajevo.path.via_points import OnLimit, ViaPoints
from trajevo.robot.kinematics import ToolKinematics
from trajevo.robot.robot import Robot

#: Height of the tool over its least height at a point below which it counts as equal [m].
_SAME_HEIGHT = 1e-6


def turning(points: ViaPoints, robot: Robot, boxes: Sequence[JointBox | CartesianBox]) -> tuple[OnLimit, ...]:
    """Inner points that lie on a joint's limit and from which the joint cannot move away inside a box.

    Args:
        points: the via points.
        robot: the robot.
        boxes: where points may move.
    """
    free = {(box.point, int(joint)) for box in boxes for joint in _free(box, robot)}
    inner = range(1, len(points) - 1)
    return tuple(at for at in points.on_limits(robot) if at.point in inner and (at.point, at.joint) not in free)


def _free(box: JointBox | CartesianBox, robot: Robot) -> Iterable[int]:
    return range(robot.dof) if isinstance(box, CartesianBox) else np.flatnonzero(box.half_width)


def notes_on_turning(turns: Sequence[OnLimit], robot: Robot, interpolant: str, price: str | None) -> tuple[str, ...]:
    """A sentence for every point on a joint's limit.

    Args:
        turns: the points.
        robot: the robot.
        interpolant: name of the interpolant.
        price: what its rests cost, see :class:`~trajevo.trajectory.interpolants.Interpolant`.
    """
    notes = []
    for at in turns:
        end = (robot.limits.upper if at.upper else robot.limits.lower)[at.joint]
        side, unit = "upper" if at.upper else "lower", pretty(robot.joint_units[at.joint])
        where = f"point {at.point} lies on the {side} limit of {robot.joint_names[at.joint]!r}, {end:g} {unit}"
        if price is not None:
            notes.append(f"{where}: the joint is at rest there, and {price}")
        elif interpolant == "linear_blends":
            notes.append(f"{where}: lines with blends miss the point and stay within the limit")
        else:
            notes.append(
                f"{where}, and {interpolant!r} cannot stop the joint there: nearly all times take it beyond the limit; "
                "move the point off its limit or choose another interpolant"
            )
    return tuple(notes)


def notes_on_height(points: ViaPoints, robot: Robot, constraints: Iterable[Constraint]) -> tuple[str, ...]:
    """A sentence for every inner point at which the tool is at the least height that it may have."""
    notes = []
    for constraint in constraints:
        if constraint.quantity != "tool height" or not isinstance(constraint.limit, float):
            continue
        heights: Array = ToolKinematics.of(robot).pose(points.positions[1:-1])[0][:, 2]
        for place in np.flatnonzero(np.abs(heights - constraint.limit) <= _SAME_HEIGHT):
            notes.append(
                f"point {place + 1} has the tool at its least height, {constraint.limit:g} m: nearly all times take it "
                "below; raise the point or lower the limit a little"
            )
    return tuple(notes)
