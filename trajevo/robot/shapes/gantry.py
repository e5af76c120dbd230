"""A robot on a carriage: more joints move its base, so that whatever is computed for joints is so for the base."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from trajevo.base.arrays import Array
from trajevo.robot.joints import JointLimits
from trajevo.robot.payload import on_carriage
from trajevo.robot.robot import Robot
from trajevo.robot.transmission import Mimicking

#: Names of the joints of a carriage, in their order: three that slide along the axes of the cell, and one that turns
#: about the vertical axis through the origin of the base.
CARRIAGE = ("carriage x", "carriage y", "carriage z", "carriage yaw")

#: Names of two more, by which a base is tilted: they turn about the axes y and x that are carried by those before.
TILTING = ("carriage pitch", "carriage roll")


def on_gantry(robot: Robot, origin: Array, *, tilts: bool = False) -> Robot:
    """The same robot with four more joints at its base, the first ones; where they are at 0 it is where it was.

    Where the base tilts, there are six, by which it turns as by roll, pitch and yaw about the fixed axes of the cell.

    Args:
        robot: a robot whose actuators drive its joints directly, of which some may follow others.
        origin: origin of its base, through which the axes of the last of them go, shape (3,) [m].
        tilts: whether the base tilts.
    """
    names = (*CARRIAGE, *TILTING) if tilts else CARRIAGE
    model = on_carriage(robot.model, names, origin)
    far, limits = np.full(len(names), np.inf), robot.limits
    return replace(
        robot,
        model=model,
        transmission=_transmission(robot, model),
        limits=JointLimits(
            lower=np.append(-far, limits.lower),
            upper=np.append(far, limits.upper),
            **{name: np.append(far, getattr(limits, name)) for name in ("velocity", "acceleration", "jerk", "effort")},
        ),
        joint_names=(*names, *robot.joint_names),
        joint_units=(*["m"] * 3, *["rad"] * (len(names) - 3), *robot.joint_units),
    )


class Carriage(NamedTuple):
    """What carries the base of a robot on a gantry.

    Attributes:
        joint: number of the joint of the model.
        place: placement of the base's frame in that of the joint, of Pinocchio.
    """

    joint: int
    place: Any


def carriage_of(robot: Robot) -> Carriage | None:
    """What carries the base of a robot on a gantry; None for any other robot."""
    if robot.joint_names[: len(CARRIAGE)] != CARRIAGE:
        return None
    frame = robot.model.frames[robot.model.getFrameId("carriage")]
    return Carriage(int(frame.parentJoint), frame.placement)


def _transmission(robot: Robot, model: Any) -> Any:
    if not isinstance(robot.transmission, Mimicking):
        return robot.transmission
    return Mimicking.of(list(model.names)[1:], robot.followers)
