"""The least integral of squared jerk along a fixed path in a given time: quadratic programs, one by one.

Jerk and limits are linear near a motion, so that a program minimises a sum of squares under linear limits (Gauss and
Newton). A motion that would exceed limits a little is judged by what it costs after it is slowed down.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.solvers.along_path.fastest import TimedShape, even_instants, least_time, moved
from trajevo.solvers.along_path.instants import Instants
from trajevo.solvers.along_path.kinematics import PathDerivatives, PathLimits, derivatives
from trajevo.solvers.along_path.program import Linearised, Program, Quadratic

#: Greatest move of a control point in the first program, the least reach with which programs go on, their greatest
#: number, and the gain as a share of the cost below which there is no need for more.
_REACH, _LEAST_REACH, _PROGRAMS, _GAIN = 0.02, 1e-6, 12, 1e-4

#: Power of the time with which the integral falls if a motion is slowed down, and that by which excess is punished.
_POWER, _PUNISHED = 5, 10


def smoothest(shape: TimedShape, time: float, path: PathDerivatives, limits: Sequence[PathLimits]) -> TimedShape:
    """The shape of u(t) with the least integral of squared jerk in a time.

    Args:
        shape: where the programs begin.
        time: time of the motion [s]; inf for no limits.
        path: the path.
        limits: what is kept.
    """
    pieces = len(path.path.breaks) - 1
    instants = even_instants(len(shape.control_points), shape.order, pieces)
    weights, c, reach = _weights(instants), shape.control_points, _REACH
    unit = _cost(path, instants.states(c), weights)[0] or 1.0
    cost = _judged(c, time, path, limits, instants, weights) / unit
    for _ in range(_PROGRAMS):
        states = instants.states(c)
        near = _limits(states, time, limits)
        _, gradient, curvature = _cost(path, states, weights / unit)
        program = Quadratic(instants.spread(gradient), instants.gram(curvature))
        move, _ = Program(instants, near, np.diff(c), reach, program).solve()
        trial = moved(c, move)
        got = _judged(trial, time, path, limits, instants, weights) / unit
        gain = cost - got
        if gain > 0.0:
            c, cost = trial, got
            reach = min(2.0 * reach, 0.2)
        else:
            reach = 0.3 * min(reach, float(np.abs(move).max()))
        if reach < _LEAST_REACH or 0.0 < gain < _GAIN * cost:
            break
    return TimedShape(frozen(c.copy()), shape.order, least_time(limits, instants.states(c)))


def _judged(
    c: Array,
    time: float,
    path: PathDerivatives,
    limits: Sequence[PathLimits],
    instants: Instants,
    weights: Array,
) -> float:
    """The integral in unit time, punished where the limits need more time."""
    states = instants.states(c)
    cost = _cost(path, states, weights)[0]
    if not np.isfinite(time):
        return cost
    return cost * max(1.0, least_time(limits, states) / time) ** _PUNISHED


def _limits(states: Array, time: float, limits: Sequence[PathLimits]) -> Linearised:
    """The limits at a time, none broken where the programs begin; no limits at all where the time is infinite."""
    if np.isfinite(time):
        near = Linearised.joined([each.linearised(states, time) for each in limits])
        above, below = np.maximum(near.above, 0.0), np.maximum(near.below, 0.0)
        return Linearised(near.slopes, above, below, near.slower_above, near.slower_below)
    none = np.zeros((len(states), 0))
    return Linearised(np.zeros((len(states), 0, states.shape[1])), none, none, none, none)


def _weights(instants: Instants) -> Array:
    """Weights of a sum over the instants that stands for the integral over unit time: trapezoids, shape (K,)."""
    t = (instants.span + instants.share) / (instants.count - instants.order + 1)
    widths = np.diff(t)
    found: Array = 0.5 * (np.append(widths, 0.0) + np.append(0.0, widths))
    return found


def _cost(path: PathDerivatives, states: Array, weights: Array) -> tuple[float, Array, Array]:
    """The integral, its slopes (K, 4), and its curvature without second derivatives of the jerk (K, 4, 4)."""
    jerk, slopes = derivatives(path, states)[2]
    weighted = 2.0 * weights[:, None] * jerk
    gradient = np.matmul(weighted[:, None, :], slopes)[:, 0]
    curvature = np.matmul(np.swapaxes(slopes, 1, 2) * (2.0 * weights[:, None, None]), slopes)
    return float((weights[:, None] * jerk**2).sum()), gradient, curvature
