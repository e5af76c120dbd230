"""Other forms of the fixed-path problem: a smooth form for gradient solvers, and the front of a set of shapes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.formulation.constraints.certified import held
from trajevo.formulation.constraints.constraint import in_terms
from trajevo.formulation.constraints.joint_limits import effort_limits
from trajevo.formulation.constraints.path_limits import smooth_path_limits
from trajevo.formulation.objectives import Objective
from trajevo.formulation.problem import SmoothForm, TrajectoryProblem
from trajevo.solvers.gradient.sqp import WeightedSum
from trajevo.trajectory.interpolants import Reparameterisation, slowness

#: F₂ is inversely proportional to this power of t_f if u(t / t_f) stays the same.
POWER = 5

#: Number of points on the front of a set of shapes, besides the least time of each shape.
ENVELOPE_POINTS = 200


def smooth_form(
    runs: Reparameterisation, dynamics: Dynamics, objectives: tuple[Objective, ...], effort: str | None
) -> SmoothForm:
    """The problem with t_f itself as a variable and every term of the limits as a separate constraint, eq. (28).

    Args:
        runs: decoder of the problem.
        dynamics: the robot and its payload.
        objectives: objectives of the problem.
        effort: how effort limits are checked, see :data:`trajevo.formulation.constraints.certified.HOLDS`, or None if
            effort is not limited.
    """
    plain, seconds, axes = replace(runs, timing="share"), replace(runs, timing="seconds"), dynamics.robot
    forces = () if effort is None else held((effort_limits(axes),), effort)
    if effort == "certified":
        middle = np.array([[0.5 * (variable.lower + variable.upper) for variable in seconds.variables]])
        forces = tuple(in_terms(limit, Rollout(dynamics, seconds(middle))) for limit in forces)
    problem = TrajectoryProblem(
        dynamics=dynamics,
        interpolant=seconds,
        objectives=objectives,
        constraints=(*smooth_path_limits(axes, runs.bound, runs.even_course), *forces),
    )
    return SmoothForm(problem, plain.with_seconds, plain.from_seconds)


def least_time(runs: Reparameterisation, smooth: TrajectoryProblem) -> float:
    """A time in which the path can be run [s]: that of evenly rising control points or, if too long, the least time."""
    even = float(runs.least_durations(runs.even_course)[0])
    if even <= runs.longest_time:
        return even
    wider = TrajectoryProblem(
        dynamics=smooth.dynamics,
        interpolant=replace(runs, timing="seconds", longest_time=2.0 * even),
        objectives=smooth.objectives,
        constraints=smooth.constraints,
    )
    start = np.append(np.ones(runs.n_rises), even)
    found = WeightedSum(wider, np.array([1.0, 0.0])).run(start, 1e-9)
    course = replace(runs, timing="seconds")(found[None]).course
    return float(runs.least_durations(course)[0])


def envelope(X: Array, F: Array, *, longest_time: float) -> tuple[Array, Array]:
    """Lower envelope of the curves t_f⁵ F₂ = constant, t_f ≥ least time, of shapes that do not dominate each other.

    Args:
        X: rises of non-dominated shapes, shape (N, n_rises).
        F: their least times [s] and t_f⁵ F₂, shape (N, 2).
        longest_time: time at which the curves end [s].

    Returns:
        Decision vectors (P, n_rises + 1) and objectives (P, 2) of the plain encoding.
    """
    order = np.argsort(F[:, 0])
    least, constant = F[order].T
    between = np.geomspace(least[0], longest_time, ENVELOPE_POINTS)
    times = np.unique(np.concatenate([least[least <= longest_time], between[1:]]))
    shape = np.searchsorted(least, times, side="right") - 1
    share = slowness(least[shape], times, longest_time)
    return np.column_stack([X[order][shape], share]), np.column_stack([times, constant[shape] / times**POWER])


def rises(X: Array) -> Array:
    """Decision vectors of the plain encoding -> decision vectors of the shape encoding."""
    return X[:, :-1]
