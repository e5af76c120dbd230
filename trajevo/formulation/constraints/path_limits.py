"""Limits of motions along a path by the bounds (20)-(25) of Paing 2021, as maxima or term by term."""

from __future__ import annotations

from functools import partial

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.formulation.constraints.constraint import Constraint
from trajevo.formulation.constraints.joint_limits import (
    limit_names,
    limit_of,
    limited_joints,
)
from trajevo.robot.robot import Robot
from trajevo.trajectory.along_path import ComposedBatch
from trajevo.trajectory.batch import DERIVATIVES
from trajevo.trajectory.parameterisation import ORDERS, Course


def hull_limits(robot: Robot) -> tuple[Constraint, ...]:
    """Bounds (20)-(25) of Paing 2021 of velocity, acceleration and jerk along a path, over the limits, minus 1.

    They bound magnitudes: of a limit that differs by direction the lesser counts.
    """
    return tuple(
        Constraint(
            limit_names(DERIVATIVES[order], robot, limited_joints(robot, order)),
            robot.reference,
            partial(_hull_excess, derivative=order),
            quantity=DERIVATIVES[order],
            limit=tuple(limit_of(robot, order).lesser[limited_joints(robot, order)].tolist()),
            share=1.0,
            proof="bound",
        )
        for order in ORDERS
    )


def smooth_path_limits(robot: Robot, bound: str, like: Course) -> tuple[Constraint, ...]:
    """The limits along a path in many smooth columns, for gradient solvers; not meant for display.

    Args:
        robot: the robot.
        bound: ``"hull"``, every term of (20)-(25), or ``"tight"``, the extremes within every span of u(t).
        like: a course of the same structure as those to be limited.
    """
    constraints = []
    for order in ORDERS:
        count = _terms(like, order, bound).shape[2]
        names = limit_names(DERIVATIVES[order], robot, limited_joints(robot, order))
        columns = tuple(f"{name}, term {k}" for name in names for k in range(count))
        excess = partial(_smooth_excess, derivative=order, bound=bound)
        constraints.append(
            Constraint(columns, robot.reference, excess, quantity=DERIVATIVES[order], share=1.0, proof="bound")
        )
    return tuple(constraints)


def _hull_excess(rollout: Rollout, *, derivative: int) -> Array:
    limit = limit_of(rollout.robot, derivative).lesser
    kept = np.isfinite(limit)
    excess: Array = along_path(rollout).hull_peak(derivative)[:, kept] / limit[kept] - 1.0
    return excess


def _smooth_excess(rollout: Rollout, *, derivative: int, bound: str) -> Array:
    limit = limit_of(rollout.robot, derivative).lesser
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
        InvalidInputError: the trajectories are of another kind.
    """
    if not isinstance(rollout.trajectory, ComposedBatch):
        raise InvalidInputError("trajectory: expected runs along a path, got " + type(rollout.trajectory).__name__)
    return rollout.trajectory
