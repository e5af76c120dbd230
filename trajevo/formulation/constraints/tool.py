"""Objectives and constraints that look at the tool instead of the joints, at the samples of a rollout."""

from __future__ import annotations

from functools import partial

import numpy as np

from trajevo.arrays import Array
from trajevo.constraints import Constraint
from trajevo.dynamics import Rollout
from trajevo.errors import InvalidInputError
from trajevo.kinematics import ToolKinematics
from trajevo.robot import Robot

#: Length that a height below the least one is divided by [m]: a tenth of it exceeds the limit by 10 %.
HEIGHT_SCALE = 0.1


def tool_speed_limit(robot: Robot, most: float) -> Constraint:
    """Greatest speed of the tool's origin at the samples over what is allowed [m/s], minus 1.

    Between samples the speed may be a little greater; more samples per segment narrow that, and
    :func:`trajevo.certified.certified` proves that it is not.

    Raises:
        InvalidInputError: no positive number.
    """
    _check(most, "most", positive=True)
    function = partial(_speed_excess, kinematics=ToolKinematics.of(robot), most=float(most))
    return Constraint(("tool speed",), f"tool speed of at most {most:g} m/s", function)


def most_tool_speed(constraint: Constraint) -> float | None:
    """The speed [m/s] that :func:`tool_speed_limit` allows; None of any other constraint."""
    function = constraint.at_samples.function
    if isinstance(function, partial) and function.func is _speed_excess:
        return float(function.keywords["most"])
    return None


def keep_out_height(robot: Robot, least: float) -> Constraint:
    """How far the tool's origin sinks at the samples below a height over the base [m], divided by 0.1 m.

    Raises:
        InvalidInputError: no finite number.
    """
    _check(least, "least", positive=False)
    function = partial(_height_excess, kinematics=ToolKinematics.of(robot), least=float(least))
    return Constraint(("tool height",), f"tool at least {least:g} m above the base", function)


def tool_path_length(rollout: Rollout) -> Array:
    """∫ |velocity of the tool's origin| dt by Gauss-Lobatto quadrature, shape (B,) [m].

    Where the tool turns sharply the speed has a kink, and few samples per segment are only close.
    """
    speed = tool_speed(rollout, ToolKinematics.of(rollout.robot))
    length: Array = (speed * rollout.quadrature).sum(axis=1)
    return length


def tool_speed(rollout: Rollout, kinematics: ToolKinematics) -> Array:
    """Speed of the tool's origin at the samples, shape (B, T) [m/s]."""
    velocity = kinematics.twist(rollout.q, rollout.v)[..., :3]
    speed: Array = np.sqrt((velocity * velocity).sum(axis=-1))  # no abs, which would drop what a complex step carries
    return speed


def _speed_excess(rollout: Rollout, *, kinematics: ToolKinematics, most: float) -> Array:
    excess: Array = tool_speed(rollout, kinematics).max(axis=1, keepdims=True) / most - 1.0
    return excess


def _height_excess(rollout: Rollout, *, kinematics: ToolKinematics, least: float) -> Array:
    height = kinematics.pose(rollout.q)[0][..., 2]
    excess: Array = (least - height.min(axis=1, keepdims=True)) / HEIGHT_SCALE
    return excess


def _check(value: float, name: str, *, positive: bool) -> None:
    number = isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)
    if not number or not np.isfinite(value) or (positive and value <= 0.0):
        raise InvalidInputError(f"{name}: expected a {'positive' if positive else 'finite'} number, got {value!r}")
