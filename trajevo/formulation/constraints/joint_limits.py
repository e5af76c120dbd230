"""Joint limits: positions and their derivatives by the exact extremes of a motion, effort at its samples."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from typing import Any

import numpy as np

from trajevo.base.arrays import Array, scaled
from trajevo.dynamics.rollout import Rollout
from trajevo.formulation.constraints.constraint import Constraint, LimitKind, LimitParameter, share_kept_free
from trajevo.path.via_points import ViaPoints
from trajevo.robot.joints import JointLimits, Sides
from trajevo.robot.robot import Robot
from trajevo.trajectory.batch import DERIVATIVES
from trajevo.trajectory.polynomial import PolynomialBatch

#: Quantity of a constraint -> field of :class:`~trajevo.robot.joints.JointLimits` of which it keeps a share.
LIMITED_BY = {
    "velocity": "velocity",
    "acceleration": "acceleration",
    "jerk": "jerk",
    "effort": "effort",
    "effort of every payload": "effort",
}

#: Share of a joint's range or position by which rounding may take it beyond a limit on which a point lies.
_ROUNDING = 1e-12

#: The same for the terms that gradient solvers see. Whatever the times, such a joint touches its limit, so that the
#: margin of 1e-7 by which these solvers tighten limits would be broken everywhere.
_TOUCHING = 1.01e-7


def position_limits(robot: Robot, points: ViaPoints | None = None) -> Constraint:
    """How far the exact extremes of every joint leave its range, divided by half the range.

    If one end of the range is infinite, the divisor is the magnitude of the other, or 1 rad or m if that is 0. A joint
    with a point on its limit may leave its range by the rounding of a motion that touches the limit: 1e-12 of half the
    range or of the limit, whichever is more.

    Args:
        robot: the robot.
        points: the points that it visits, if known.
    """
    kept = _bounded(robot)
    slack = _slack(robot, points)[kept]
    excess = partial(_position_excess, slack=slack)
    terms = partial(_position_terms, slack=np.where(slack > 0.0, _TOUCHING, 0.0))
    return Constraint(
        limit_names("position", robot, kept),
        robot.reference,
        excess,
        terms,
        quantity="position",
        share=1.0,
        proof="extremes",
    )


def velocity_limits(robot: Robot) -> Constraint:
    """Peak of |v| of every joint, exact or bounded from above, divided by its limit, minus 1.

    If the limit differs by direction, each direction is measured by its own; so with the other limits.
    """
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
    """Greatest |effort| of every joint at the samples, divided by the usable share of its limit, minus 1.

    Args:
        robot: the robot.
        margin: share of the limit that is kept free, from 0 to below 1.

    Raises:
        InvalidInputError: a margin outside this range, or a robot without masses, see
            :meth:`~trajevo.robot.robot.Robot.check_masses`.
    """
    robot.check_body("a limit of effort")
    sides = robot.limits.sides("effort")
    kept = np.flatnonzero(sides.limited)
    if len(kept):
        robot.check_masses("a limit of effort")
    share = 1.0 - share_kept_free("effort_margin", margin, "1")
    excess, terms = (partial(function, share=share) for function in (_effort_excess, _effort_terms))
    return Constraint(
        limit_names("effort", robot, kept),
        robot.reference,
        excess,
        terms,
        quantity="effort",
        limit=tuple((sides.lesser * share)[kept].tolist()),
        share=share,
    )


def kept_limits(robot: Robot, constraints: Iterable[Constraint]) -> JointLimits:
    """The robot's limits, each times the least share of it that a constraint lets a motion use.

    A limit that no constraint keeps is the robot's own, since it holds for the robot in any case.
    """
    shares: dict[str, float] = {}
    for constraint in constraints:
        field = LIMITED_BY.get(constraint.quantity)
        if field is not None and constraint.share is not None:
            shares[field] = min(constraint.share, shares.get(field, 1.0))
    changed = {field: share for field, share in shares.items() if share < 1.0}
    return robot.limits.scaled(changed) if changed else robot.limits


def _effort_excess(rollout: Rollout, *, share: float) -> Array:
    limit = rollout.robot.limits.sides("effort").times(share)
    kept = limit.limited
    if not kept.any():
        return np.empty((len(rollout.trajectory), 0))
    effort = np.ascontiguousarray(np.moveaxis(rollout.effort, 1, 0))  # numpy's extremes are fast along the first axis
    greatest, least = effort.max(axis=0), effort.min(axis=0)
    if not limit.agree:
        return limit[kept].share_between(least[:, kept], greatest[:, kept]) - 1.0
    peak = np.maximum(greatest, -least)
    excess: Array = peak[:, kept] / limit.forward[kept] - 1.0
    return excess


def _effort_terms(rollout: Rollout, *, share: float) -> Array:
    limit = rollout.robot.limits.sides("effort").times(share)
    kept = limit.limited
    if not kept.any():
        return np.empty((len(rollout.trajectory), 0))
    effort = rollout.effort if kept.all() else rollout.effort[..., kept]
    excess = scaled(effort, np.sign(effort.real) / limit[kept].toward(effort)) - 1.0
    return excess.reshape(len(excess), -1)


def _peak_limits(robot: Robot, derivative: int) -> Constraint:
    kept = limited_joints(robot, derivative)
    names = limit_names(DERIVATIVES[derivative], robot, kept)
    excess, terms = (partial(function, derivative=derivative) for function in (_peak_excess, _peak_terms))
    return Constraint(
        names,
        robot.reference,
        excess,
        terms,
        quantity=DERIVATIVES[derivative],
        limit=tuple(limit_of(robot, derivative).lesser[kept].tolist()),
        share=1.0,
        proof="extremes",
    )


def _position_excess(rollout: Rollout, *, slack: Array) -> Array:
    return _outside(rollout.robot, *rollout.trajectory.extremes(0)) - slack


def _position_terms(rollout: Rollout, *, slack: Array) -> Array:
    outside = _outside(rollout.robot, *rollout.trajectory.segment_extremes(0)) - slack
    return outside.reshape(len(outside), -1)


def _slack(robot: Robot, points: ViaPoints | None) -> Array:
    """Share of half its range by which rounding may take every joint beyond a limit, shape (n_joints,)."""
    slack = np.zeros(robot.dof)
    for at in () if points is None else points.on_limits(robot):
        end = (robot.limits.upper if at.upper else robot.limits.lower)[at.joint]
        size = _size(robot.limits.lower[at.joint], robot.limits.upper[at.joint])
        slack[at.joint] = max(slack[at.joint], _ROUNDING * max(1.0, abs(end) / size))
    return slack


def _outside(robot: Robot, least: Array, greatest: Array) -> Array:
    """Normalised excess of least and greatest positions (..., n_joints) over the ranges of joints that have one."""
    kept = _bounded(robot)
    lower, upper = robot.limits.lower[kept], robot.limits.upper[kept]
    excess: Array = np.maximum(greatest[..., kept] - upper, lower - least[..., kept]) / _size(lower, upper)
    return excess


def _size(lower: Array, upper: Array) -> Array:
    """What an excess over an end of a range is divided by [rad or m]."""
    finite = np.where(np.isfinite(lower), lower, upper)
    one_sided = np.where(finite != 0.0, np.abs(finite), 1.0)
    both = np.isfinite(lower) & np.isfinite(upper)
    return np.where(both, 0.5 * (np.where(both, upper, 0.0) - np.where(both, lower, 0.0)), one_sided)


def _peak_excess(rollout: Rollout, *, derivative: int) -> Array:
    limit, trajectory = limit_of(rollout.robot, derivative), rollout.trajectory
    kept = limit.limited
    if not limit.agree:
        least, greatest = trajectory.extremes(derivative)
        return limit[kept].share_between(least[:, kept], greatest[:, kept]) - 1.0
    excess: Array = trajectory.peak(derivative)[:, kept] / limit.forward[kept] - 1.0
    return excess


def _peak_terms(rollout: Rollout, *, derivative: int) -> Array:
    limit, trajectory = limit_of(rollout.robot, derivative), rollout.trajectory
    kept = limit.limited
    if isinstance(trajectory, PolynomialBatch) and trajectory.degree == derivative + 1:
        # A peak would pass from one end of a segment to the other where both are equal, as at the fastest motions.
        ends = trajectory.at_shares(np.array([0.0, 1.0]), derivative)[..., kept]
        excess = scaled(ends, np.sign(ends.real) / limit[kept].toward(ends)) - 1.0
    elif limit.agree:
        excess = scaled(trajectory.segment_peaks(derivative)[..., kept], 1.0 / limit.forward[kept]) - 1.0
    else:
        least, greatest = trajectory.segment_extremes(derivative)
        excess = limit[kept].share_between(least[..., kept], greatest[..., kept]) - 1.0
    return excess.reshape(len(excess), -1)


def _bounded(robot: Robot) -> np.ndarray[Any, np.dtype[np.intp]]:
    return np.flatnonzero(np.isfinite(robot.limits.lower) | np.isfinite(robot.limits.upper))


def limited_joints(robot: Robot, derivative: int) -> np.ndarray[Any, np.dtype[np.intp]]:
    """Indices of the joints whose derivative of this order is limited."""
    return np.flatnonzero(limit_of(robot, derivative).limited)


def limit_of(robot: Robot, derivative: int) -> Sides:
    """Limits of a derivative of every joint."""
    return robot.limits.sides(DERIVATIVES[derivative])


def limit_names(quantity: str, robot: Robot, kept: Iterable[int]) -> tuple[str, ...]:
    """Names of a constraint's columns, one for each joint that is limited."""
    return tuple(f"{quantity} of {robot.joint_names[joint]}" for joint in kept)


POSITION = LimitKind(
    "position",
    "joints stay in their ranges, at every instant",
    lambda limited: position_limits(limited.robot, limited.points),
)

VELOCITY = LimitKind(
    "velocity", "velocities of the joints, at every instant", lambda limited: velocity_limits(limited.robot)
)

ACCELERATION = LimitKind(
    "acceleration", "accelerations of the joints, at every instant", lambda limited: acceleration_limits(limited.robot)
)

JERK = LimitKind("jerk", "jerks of the joints, at every instant", lambda limited: jerk_limits(limited.robot))

EFFORT = LimitKind(
    "effort",
    "torques and forces of the actuators, payload included",
    lambda limited, effort_margin: effort_limits(limited.robot, margin=effort_margin),
    (
        LimitParameter(
            "effort_margin", "1", "share of the effort limits that is kept free", share_kept_free, default=0.0
        ),
    ),
)
