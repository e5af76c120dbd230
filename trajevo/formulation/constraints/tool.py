"""Limits of the tool, at the samples of a rollout."""

from __future__ import annotations

from functools import partial

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.rollout import Rollout
from trajevo.formulation.constraints.constraint import Constraint, LimitKind, LimitParameter, finite, positive
from trajevo.robot.kinematics import ToolKinematics
from trajevo.robot.robot import Robot

#: Divisor of the missing height [m]: if a tenth of this length is missing, the limit is exceeded by 10 %.
HEIGHT_SCALE = 0.1


def tool_speed_limit(robot: Robot, most: float) -> Constraint:
    """Greatest speed of the tool's origin at the samples divided by the greatest allowed [m/s], minus 1.

    Between samples the speed may be a little greater, the less so the more samples a segment has;
    :func:`trajevo.formulation.constraints.certified.certified` gives a limit that is proven at every instant.

    Raises:
        InvalidInputError: not a positive number.
    """
    robot.check_body("a limit of tool speed")
    most = positive("most", most, "m/s")
    function = partial(_speed_excess, kinematics=ToolKinematics.of(robot), most=most)
    reference = f"tool speed of at most {most:g} m/s"
    return Constraint(("tool speed",), reference, function, quantity="tool speed", limit=most)


def keep_out_height(robot: Robot, least: float) -> Constraint:
    """How far the tool's origin is below a least height over the base [m] at the samples, divided by 0.1 m.

    Raises:
        InvalidInputError: not a finite number.
    """
    robot.check_body("a limit of tool height")
    least = finite("least", least, "m")
    function = partial(_height_excess, kinematics=ToolKinematics.of(robot), least=least)
    reference = f"tool at least {least:g} m above the base"
    return Constraint(("tool height",), reference, function, quantity="tool height", limit=least)


def tool_speed(rollout: Rollout, kinematics: ToolKinematics) -> Array:
    """Speed of the tool's origin at the samples, shape (B, T) [m/s]."""
    if not (np.iscomplexobj(rollout.q) or np.iscomplexobj(rollout.v)):
        return np.sqrt(kinematics.squared_speed(rollout.q, rollout.v))
    # Gradients, which are few, keep the digits that they have by the Jacobian.
    velocity = kinematics.twist(rollout.q, rollout.v)[..., :3]
    speed: Array = np.sqrt((velocity * velocity).sum(axis=-1))  # without abs, which would drop complex steps
    return speed


def _speed_excess(rollout: Rollout, *, kinematics: ToolKinematics, most: float) -> Array:
    excess: Array = tool_speed(rollout, kinematics).max(axis=1, keepdims=True) / most - 1.0
    return excess


def _height_excess(rollout: Rollout, *, kinematics: ToolKinematics, least: float) -> Array:
    height = kinematics.pose(rollout.q)[0][..., 2]
    excess: Array = (least - height.min(axis=1, keepdims=True)) / HEIGHT_SCALE
    return excess


TOOL_SPEED = LimitKind(
    "tool_speed",
    "speed of the tool's origin",
    lambda limited, tool_speed: tool_speed_limit(limited.robot, tool_speed),
    (LimitParameter("tool_speed", "m/s", "greatest speed of the tool"),),
)

TOOL_HEIGHT = LimitKind(
    "tool_height",
    "height of the tool's origin over the base, at the samples",
    lambda limited, tool_height: keep_out_height(limited.robot, tool_height),
    (LimitParameter("tool_height", "m", "least z of the tool in the base frame", finite),),
)
