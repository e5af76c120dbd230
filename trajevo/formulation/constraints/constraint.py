"""Constraints: pure functions of a rollout, at most 0 where feasible, divided by the limit, every column named.

A value of 0.05 means that the limit is exceeded by 5 %. Limits that are ``inf`` have no column.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from trajevo.arrays import Array, scaled
from trajevo.composed import ComposedBatch
from trajevo.course import Course
from trajevo.dynamics import Rollout
from trajevo.errors import InvalidInputError
from trajevo.hull import ORDERS
from trajevo.path import ViaPoints
from trajevo.robot import Robot
from trajevo.trajectory import DERIVATIVES, TrajectoryBatch


@dataclass(frozen=True)
class Constraint:
    """Something that must not exceed 0.

    Attributes:
        names: one name per column.
        reference: where the limits stand.
        function: rollout of B trajectories -> (B, len(names)).
        terms: what the columns are the greatest of, in as many columns as that takes, (B, K); None where the columns
            are smooth themselves. A gradient solver goes astray where a greatest passes from one term to another.
        sampled: the same limit at the samples alone, of one that is proven between them.
    """

    names: tuple[str, ...]
    reference: str
    function: Callable[[Rollout], Array]
    terms: Callable[[Rollout], Array] | None = None
    sampled: Constraint | None = None

    @property
    def at_samples(self) -> Constraint:
        """The limit at the samples alone; itself where nothing more is proven."""
        return self if self.sampled is None else self.sampled


def in_terms(constraint: Constraint, example: Rollout) -> Constraint:
    """A constraint with a column for each of its terms; the same where it has none.

    Args:
        constraint: any.
        example: a rollout like those that it will be asked about, which tells how many terms there are.
    """
    if constraint.terms is None:
        return constraint
    count = constraint.terms(example).shape[1]
    names = tuple(f"term {k} of {constraint.names[0]} and the like" for k in range(count))
    return Constraint(names, constraint.reference, constraint.terms)


def position_limits(robot: Robot) -> Constraint:
    """Exact extremes of every joint inside its range; the excess is divided by half the range.

    Where one end is infinite it is divided by the size of the other, or by 1 rad or m where that is 0.
    """
    kept = _bounded(robot)
    return Constraint(_names("position", robot, kept), robot.reference, _position_excess, _position_terms)


def velocity_limits(robot: Robot) -> Constraint:
    """Peak of |v| of every joint, exact or bounded from above, divided by its limit, minus 1."""
    return _peak_limits(robot, 1)


def acceleration_limits(robot: Robot) -> Constraint:
    """Peak of |a| of every joint, exact or bounded from above, divided by its limit, minus 1."""
    return _peak_limits(robot, 2)


def jerk_limits(robot: Robot) -> Constraint:
    """Peak of |j| of every joint, exact or bounded from above, divided by its limit, minus 1."""
    return _peak_limits(robot, 3)


def kinematic_limits(robot: Robot) -> tuple[Constraint, ...]:
    """Position, velocity, acceleration and jerk limits of a robot."""
    return position_limits(robot), velocity_limits(robot), acceleration_limits(robot), jerk_limits(robot)


def effort_limits(robot: Robot, *, margin: float = 0.0) -> Constraint:
    """Greatest |effort| of every joint at the samples, divided by what is left of its limit, minus 1.

    Args:
        robot: whose limits.
        margin: share of the limit that is kept free, from 0 to below 1.

    Raises:
        InvalidInputError: another margin.
    """
    if isinstance(margin, bool) or not isinstance(margin, int | float) or not 0.0 <= margin < 1.0:
        raise InvalidInputError(f"effort_margin: expected a share from 0 to below 1, got {margin!r}")
    kept = np.flatnonzero(np.isfinite(robot.limits.effort))
    excess, terms = (partial(function, share=1.0 - margin) for function in (_effort_excess, _effort_terms))
    return Constraint(_names("effort", robot, kept), robot.reference, excess, terms)


def mean_velocity_limits(robot: Robot) -> Constraint:
    """Greatest mean velocity of any segment and joint over its limit, minus 1; implied by the velocity limits."""
    return Constraint(("mean velocity",), robot.reference, _mean_velocity_excess)


def _mean_velocity_excess(rollout: Rollout) -> Array:
    q = rollout.q.reshape(len(rollout.trajectory), -1, rollout.dynamics.samples, rollout.robot.dof)
    mean = (q[:, :, -1] - q[:, :, 0]) / rollout.trajectory.segment_durations[:, :, None]
    share = mean * np.sign(mean.real) / rollout.robot.limits.velocity
    worst: Array = share.reshape(len(share), -1).max(axis=1, keepdims=True) - 1.0
    return worst


def overshoot_limit(points: ViaPoints, most: float) -> Constraint:
    """How far any joint leaves the range of the points [rad or m], exact, over what is allowed, minus 1."""
    return Constraint(("overshoot",), "range of the via points", partial(_overshoot_excess, points=points, most=most))


def overshoot(trajectory: TrajectoryBatch, points: ViaPoints) -> Array:
    """How far every joint leaves the range of the points, exact, shape (B, n_joints) [rad or m]."""
    least, greatest = trajectory.extremes(0)
    beyond: Array = np.maximum(points.positions.min(axis=0) - least, greatest - points.positions.max(axis=0))
    return np.maximum(beyond, 0.0)


def _overshoot_excess(rollout: Rollout, *, points: ViaPoints, most: float) -> Array:
    worst: Array = overshoot(rollout.trajectory, points).max(axis=1, keepdims=True) / most - 1.0
    return worst


def hull_limits(robot: Robot) -> tuple[Constraint, ...]:
    """Velocity, acceleration and jerk along a path, bounded by (20)-(25) of Paing 2021, over their limits, minus 1."""
    return tuple(
        Constraint(
            _names(DERIVATIVES[order], robot, _kept(robot, order)),
            robot.reference,
            partial(_hull_excess, derivative=order),
        )
        for order in ORDERS
    )


def smooth_path_limits(robot: Robot, bound: str, like: Course) -> tuple[Constraint, ...]:
    """The limits along a path in many columns that a gradient solver can differentiate; nothing to show people.

    Args:
        robot: whose limits.
        bound: ``"hull"``, every term of (20)-(25), or ``"tight"``, the extremes within every span of u(t).
        like: a course of the same make as those that will be limited.
    """
    constraints = []
    for order in ORDERS:
        count = _terms(like, order, bound).shape[2]
        names = _names(DERIVATIVES[order], robot, _kept(robot, order))
        columns = tuple(f"{name}, term {k}" for name in names for k in range(count))
        excess = partial(_smooth_excess, derivative=order, bound=bound)
        constraints.append(Constraint(columns, robot.reference, excess))
    return tuple(constraints)


def time_limit(longest: float) -> Constraint:
    """Duration over the longest one [s], minus 1."""
    return Constraint(("longest time",), "longest time allowed", partial(_time_excess, longest=longest))


def is_robot_limit(constraint: Constraint) -> bool:
    """Whether a constraint holds a joint to a limit of its robot, rather than to something of the problem's own."""
    function = constraint.at_samples.function
    function = function.func if isinstance(function, partial) else function
    return function in (_position_excess, _peak_excess, _effort_excess, _hull_excess, _smooth_excess)


def effort_share(constraint: Constraint) -> float | None:
    """The share of the effort limits that :func:`effort_limits` leaves a motion; None of any other constraint."""
    function = constraint.at_samples.function
    if isinstance(function, partial) and function.func is _effort_excess:
        return float(function.keywords["share"])
    return None


def _time_excess(rollout: Rollout, *, longest: float) -> Array:
    excess: Array = rollout.trajectory.duration[:, None] / longest - 1.0
    return excess


def _hull_excess(rollout: Rollout, *, derivative: int) -> Array:
    limit = _limit(rollout.robot, derivative)
    kept = np.isfinite(limit)
    excess: Array = along_path(rollout).hull_peak(derivative)[:, kept] / limit[kept] - 1.0
    return excess


def _smooth_excess(rollout: Rollout, *, derivative: int, bound: str) -> Array:
    limit = _limit(rollout.robot, derivative)
    kept, batch = np.isfinite(limit), along_path(rollout)
    terms = _terms(batch.course, derivative, bound)[:, kept]
    scale = batch.durations ** float(-derivative)
    excess: Array = terms * scale[:, None, None] / limit[kept][:, None] - 1.0
    return excess.reshape(len(excess), -1)


def _terms(course: Course, derivative: int, bound: str) -> Array:
    return course.hull_terms(derivative) if bound == "hull" else course.local_terms(derivative)


def along_path(rollout: Rollout) -> ComposedBatch:
    """The trajectories of a rollout along a path.

    Raises:
        InvalidInputError: they are of another kind.
    """
    if not isinstance(rollout.trajectory, ComposedBatch):
        raise InvalidInputError("trajectory: expected runs along a path, got " + type(rollout.trajectory).__name__)
    return rollout.trajectory


def _effort_excess(rollout: Rollout, *, share: float) -> Array:
    limit = rollout.robot.limits.effort * share
    kept = np.isfinite(limit)
    effort = np.ascontiguousarray(np.moveaxis(rollout.effort, 1, 0))  # numpy's extremes are fast along the first axis
    peak = np.maximum(effort.max(axis=0), -effort.min(axis=0))
    excess: Array = peak[:, kept] / limit[kept] - 1.0
    return excess


def _effort_terms(rollout: Rollout, *, share: float) -> Array:
    limit = rollout.robot.limits.effort * share
    kept = np.isfinite(limit)
    effort = rollout.effort if kept.all() else rollout.effort[..., kept]
    excess = scaled(effort, np.sign(effort.real) / limit[kept]) - 1.0
    return excess.reshape(len(excess), -1)


def _peak_limits(robot: Robot, derivative: int) -> Constraint:
    kept = _kept(robot, derivative)
    names = _names(DERIVATIVES[derivative], robot, kept)
    excess, terms = (partial(function, derivative=derivative) for function in (_peak_excess, _peak_terms))
    return Constraint(names, robot.reference, excess, terms)


def _position_excess(rollout: Rollout) -> Array:
    return _outside(rollout.robot, *rollout.trajectory.extremes(0))


def _position_terms(rollout: Rollout) -> Array:
    outside = _outside(rollout.robot, *rollout.trajectory.segment_extremes(0))
    return outside.reshape(len(outside), -1)


def _outside(robot: Robot, least: Array, greatest: Array) -> Array:
    """How far least and greatest positions (..., n_joints) leave the ranges of the joints that have one."""
    kept = _bounded(robot)
    lower, upper = robot.limits.lower[kept], robot.limits.upper[kept]
    finite = np.where(np.isfinite(lower), lower, upper)
    one_sided = np.where(finite != 0.0, np.abs(finite), 1.0)
    both = np.isfinite(lower) & np.isfinite(upper)
    size = np.where(both, 0.5 * (np.where(both, upper, 0.0) - np.where(both, lower, 0.0)), one_sided)
    excess: Array = np.maximum(greatest[..., kept] - upper, lower - least[..., kept]) / size
    return excess


def _peak_excess(rollout: Rollout, *, derivative: int) -> Array:
    limit = _limit(rollout.robot, derivative)
    kept = np.isfinite(limit)
    excess: Array = rollout.trajectory.peak(derivative)[:, kept] / limit[kept] - 1.0
    return excess


def _peak_terms(rollout: Rollout, *, derivative: int) -> Array:
    limit = _limit(rollout.robot, derivative)
    kept = np.isfinite(limit)
    excess = scaled(rollout.trajectory.segment_peaks(derivative)[..., kept], 1.0 / limit[kept]) - 1.0
    return excess.reshape(len(excess), -1)


def _bounded(robot: Robot) -> np.ndarray[Any, np.dtype[np.intp]]:
    return np.flatnonzero(np.isfinite(robot.limits.lower) | np.isfinite(robot.limits.upper))


def _kept(robot: Robot, derivative: int) -> np.ndarray[Any, np.dtype[np.intp]]:
    return np.flatnonzero(np.isfinite(_limit(robot, derivative)))


def _limit(robot: Robot, derivative: int) -> Array:
    limit: Array = getattr(robot.limits, DERIVATIVES[derivative])
    return limit


def _names(quantity: str, robot: Robot, kept: Iterable[int]) -> tuple[str, ...]:
    return tuple(f"{quantity} of {robot.joint_names[joint]}" for joint in kept)
