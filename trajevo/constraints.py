"""Constraints: pure functions of a rollout, at most 0 where feasible, divided by the limit, every column named.

A value of 0.05 means that the limit is exceeded by 5 %. Limits that are ``inf`` have no column.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from trajevo.arrays import Array
from trajevo.dynamics import Rollout
from trajevo.robot import Robot
from trajevo.trajectory import DERIVATIVES


@dataclass(frozen=True)
class Constraint:
    """Something that must not exceed 0.

    Attributes:
        names: one name per column.
        reference: where the limits stand.
        function: rollout of B trajectories -> (B, len(names)).
    """

    names: tuple[str, ...]
    reference: str
    function: Callable[[Rollout], Array]


def position_limits(robot: Robot) -> Constraint:
    """Exact extremes of every joint inside its range; the excess is divided by half the range."""
    lower, upper = robot.limits.lower, robot.limits.upper
    kept = np.flatnonzero(np.isfinite(lower) & np.isfinite(upper))
    half = 0.5 * (upper - lower)[kept]

    def excess(rollout: Rollout) -> Array:
        least, greatest = rollout.trajectory.extremes(0)
        over = np.maximum(greatest[:, kept] - upper[kept], lower[kept] - least[:, kept])
        return over / half

    return Constraint(_names("position", robot, kept), robot.reference, excess)


def velocity_limits(robot: Robot) -> Constraint:
    """Exact peak of |v| of every joint, divided by its limit, minus 1."""
    return _peak_limits(robot, 1, robot.limits.velocity)


def acceleration_limits(robot: Robot) -> Constraint:
    """Exact peak of |a| of every joint, divided by its limit, minus 1."""
    return _peak_limits(robot, 2, robot.limits.acceleration)


def jerk_limits(robot: Robot) -> Constraint:
    """Exact peak of |j| of every joint, divided by its limit, minus 1."""
    return _peak_limits(robot, 3, robot.limits.jerk)


def kinematic_limits(robot: Robot) -> tuple[Constraint, ...]:
    """Position, velocity, acceleration and jerk limits of a robot."""
    return position_limits(robot), velocity_limits(robot), acceleration_limits(robot), jerk_limits(robot)


def _peak_limits(robot: Robot, derivative: int, limit: Array) -> Constraint:
    kept = np.flatnonzero(np.isfinite(limit))

    def excess(rollout: Rollout) -> Array:
        return rollout.trajectory.peak(derivative)[:, kept] / limit[kept] - 1.0

    return Constraint(_names(DERIVATIVES[derivative], robot, kept), robot.reference, excess)


def _names(quantity: str, robot: Robot, kept: Iterable[int]) -> tuple[str, ...]:
    return tuple(f"{quantity} of {robot.joint_names[joint]}" for joint in kept)
