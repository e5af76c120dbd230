"""Limits of the motion as a whole: mean velocities, overshoot beyond the via points, distance from them, duration."""

from __future__ import annotations

from functools import partial

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.rollout import Rollout
from trajevo.formulation.constraints.constraint import Constraint, LimitKind, LimitParameter
from trajevo.path.via_points import ViaPoints
from trajevo.robot.robot import Robot
from trajevo.trajectory.batch import TrajectoryBatch
from trajevo.trajectory.interpolants import Interpolant
from trajevo.trajectory.interpolants.interpolant import PassesNearby


def mean_velocity_limits(robot: Robot) -> Constraint:
    """Greatest ratio of a joint's mean velocity in a segment to its limit, minus 1; implied by the velocity limits."""
    return Constraint(
        ("mean velocity",), robot.reference, _mean_velocity_excess, quantity="mean velocity", proof="extremes"
    )


def _mean_velocity_excess(rollout: Rollout) -> Array:
    q = rollout.q.reshape(len(rollout.trajectory), -1, rollout.dynamics.samples, rollout.robot.dof)
    mean = (q[:, :, -1] - q[:, :, 0]) / rollout.trajectory.segment_durations[:, :, None]
    share = mean * np.sign(mean.real) / rollout.robot.limits.sides("velocity").toward(mean)
    worst: Array = share.reshape(len(share), -1).max(axis=1, keepdims=True) - 1.0
    return worst


def overshoot_limit(points: ViaPoints, most: float) -> Constraint:
    """Exact overshoot of any joint beyond the range of the points over the limit ``most`` [rad or m], minus 1."""
    excess = partial(_overshoot_excess, points=points, most=most)
    return Constraint(
        ("overshoot",),
        "range of the via points",
        excess,
        quantity="overshoot",
        limit=most,
        unit="rad or m",
        proof="extremes",
    )


def overshoot(trajectory: TrajectoryBatch, points: ViaPoints) -> Array:
    """How far every joint leaves the range of the points, exact, shape (B, n_joints) [rad or m]."""
    least, greatest = trajectory.extremes(0)
    beyond: Array = np.maximum(points.positions.min(axis=0) - least, greatest - points.positions.max(axis=0))
    return np.maximum(beyond, 0.0)


def _overshoot_excess(rollout: Rollout, *, points: ViaPoints, most: float) -> Array:
    worst: Array = overshoot(rollout.trajectory, points).max(axis=1, keepdims=True) / most - 1.0
    return worst


def via_error_limit(interpolant: Interpolant, most: float) -> Constraint:
    """Greatest distance of any joint from an inner point when it is passed, over ``most`` [rad or m], minus 1."""
    excess = partial(_via_error_excess, interpolant=interpolant, most=most)
    return Constraint(
        ("via error",), "via points", excess, quantity="via error", limit=most, unit="rad or m", proof="extremes"
    )


def via_errors(interpolant: Interpolant, trajectory: TrajectoryBatch) -> Array:
    """How far motions pass their points, shape (B, n_points, n_joints) [rad or m]; no points if all are met."""
    if not isinstance(interpolant, PassesNearby):
        return np.zeros((len(trajectory), 0, trajectory.n_joints))
    return interpolant.via_errors(trajectory)


def _via_error_excess(rollout: Rollout, *, interpolant: Interpolant, most: float) -> Array:
    apart = via_errors(interpolant, rollout.trajectory).reshape(len(rollout.trajectory), -1)
    none = np.zeros((len(apart), 1), dtype=apart.dtype)
    excess: Array = np.concatenate([none, apart], axis=1).max(axis=1, keepdims=True) / most - 1.0
    return excess


def time_limit(longest: float) -> Constraint:
    """Duration divided by the longest duration allowed [s], minus 1."""
    excess = partial(_time_excess, longest=longest)
    return Constraint(
        ("longest time",),
        "longest time allowed",
        excess,
        quantity="duration",
        limit=longest,
        unit="s",
        proof="extremes",
    )


def _time_excess(rollout: Rollout, *, longest: float) -> Array:
    excess: Array = rollout.trajectory.duration[:, None] / longest - 1.0
    return excess


MEAN_VELOCITY = LimitKind(
    "mean_velocity",
    "mean velocities of the joints over every segment",
    lambda limited: mean_velocity_limits(limited.robot),
)

OVERSHOOT = LimitKind(
    "overshoot",
    "how far a joint leaves the range of the via points, at every instant",
    lambda limited, overshoot: overshoot_limit(limited.points, overshoot),
    (LimitParameter("overshoot", "rad or m", "how far a joint may leave the range of the points"),),
)

VIA_ERROR = LimitKind(
    "via_error",
    "how far inner points are passed by interpolants that do not meet them, as lines with blends",
    lambda limited, via_error: via_error_limit(limited.interpolant, via_error),
    (LimitParameter("via_error", "rad or m", "how far a joint may pass an inner point"),),
)

LONGEST_TIME = LimitKind(
    "longest_time",
    "duration of the motion",
    lambda limited, longest_time: time_limit(longest_time),
    (LimitParameter("longest_time", "s", "greatest duration"),),
)
