"""Constraints: pure functions of a rollout, at most 0 where feasible, divided by the limit, every column named.

A value of 0.05 means that the limit is exceeded by 5 %. Limits that are ``inf`` have no column.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from typing import Any

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
    """Exact extremes of every joint inside its range; the excess is divided by half the range.

    Where one end is infinite it is divided by the size of the other, or by 1 rad or m where that is 0.
    """
    kept = _bounded(robot)
    return Constraint(_names("position", robot, kept), robot.reference, _position_excess)


def velocity_limits(robot: Robot) -> Constraint:
    """Exact peak of |v| of every joint, divided by its limit, minus 1."""
    return _peak_limits(robot, 1)


def acceleration_limits(robot: Robot) -> Constraint:
    """Exact peak of |a| of every joint, divided by its limit, minus 1."""
    return _peak_limits(robot, 2)


def jerk_limits(robot: Robot) -> Constraint:
    """Exact peak of |j| of every joint, divided by its limit, minus 1."""
    return _peak_limits(robot, 3)


def kinematic_limits(robot: Robot) -> tuple[Constraint, ...]:
    """Position, velocity, acceleration and jerk limits of a robot."""
    return position_limits(robot), velocity_limits(robot), acceleration_limits(robot), jerk_limits(robot)


def effort_limits(robot: Robot) -> Constraint:
    """Greatest |effort| of every joint at the samples, divided by its limit, minus 1."""
    kept = np.flatnonzero(np.isfinite(robot.limits.effort))
    return Constraint(_names("effort", robot, kept), robot.reference, _effort_excess)


def _effort_excess(rollout: Rollout) -> Array:
    limit = rollout.robot.limits.effort
    kept = np.isfinite(limit)
    peak = np.maximum(rollout.effort.max(axis=1), -rollout.effort.min(axis=1))
    excess: Array = peak[:, kept] / limit[kept] - 1.0
    return excess


def _peak_limits(robot: Robot, derivative: int) -> Constraint:
    kept = np.flatnonzero(np.isfinite(_limit(robot, derivative)))
    names = _names(DERIVATIVES[derivative], robot, kept)
    return Constraint(names, robot.reference, partial(_peak_excess, derivative=derivative))


def _position_excess(rollout: Rollout) -> Array:
    kept = _bounded(rollout.robot)
    lower, upper = rollout.robot.limits.lower[kept], rollout.robot.limits.upper[kept]
    least, greatest = (bound[:, kept] for bound in rollout.trajectory.extremes(0))
    finite = np.where(np.isfinite(lower), lower, upper)
    one_sided = np.where(finite != 0.0, np.abs(finite), 1.0)
    both = np.isfinite(lower) & np.isfinite(upper)
    size = np.where(both, 0.5 * (np.where(both, upper, 0.0) - np.where(both, lower, 0.0)), one_sided)
    excess: Array = np.maximum(greatest - upper, lower - least) / size
    return excess


def _peak_excess(rollout: Rollout, *, derivative: int) -> Array:
    limit = _limit(rollout.robot, derivative)
    kept = np.isfinite(limit)
    excess: Array = rollout.trajectory.peak(derivative)[:, kept] / limit[kept] - 1.0
    return excess


def _bounded(robot: Robot) -> np.ndarray[Any, np.dtype[np.intp]]:
    return np.flatnonzero(np.isfinite(robot.limits.lower) | np.isfinite(robot.limits.upper))


def _limit(robot: Robot, derivative: int) -> Array:
    limit: Array = getattr(robot.limits, DERIVATIVES[derivative])
    return limit


def _names(quantity: str, robot: Robot, kept: Iterable[int]) -> tuple[str, ...]:
    return tuple(f"{quantity} of {robot.joint_names[joint]}" for joint in kept)
