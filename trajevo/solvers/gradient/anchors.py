"""Anchors that the lockstep leaves before they are optima, brought to an end one by one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from trajevo.base.arrays import Array
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.solvers.gradient.scaling import Scaled
from trajevo.solvers.gradient.sqp import OutOfEvaluations, WeightedSum

#: Points that SLSQP evaluates for an anchor and variable, and its tolerance on the logarithm of the value.
_MOST, _TOLERANCE = 40, 1e-6

#: Factor of all times from one slower copy of an anchor to the next, and number of copies.
_SLOWER, _COPIES = 1.045, 16


def ended(
    problem: TrajectoryProblem, weights: Array, start: Array, stop: Callable[[int], bool]
) -> tuple[Array | None, int]:
    """The end of SLSQP from a point at which the steps of the lockstep were in vain.

    All members of a lockstep have the same merit function, which lets no step pass that breaks limits a little, so that
    the least time of many variables is often out of its reach. SLSQP takes such steps.

    Args:
        problem: what to solve, each of its limits split into smooth terms.
        weights: weights of the objectives, shape (n_obj,).
        start: decision vector, shape (n_var,).
        stop: called before every gradient with the number of those before; if it returns True, no more are evaluated.

    Returns:
        The end, or the best point within all limits where there is no end soon enough, shape (n_var,), None if there is
        neither; and the number of points at which gradients were evaluated.
    """
    search = WeightedSum(problem, weights, most=_MOST * int(problem.n_var), stop=stop)
    try:
        return search.run(start, _TOLERANCE), search.evaluations
    except OutOfEvaluations:
        return search.best, search.evaluations


def slowed(scaled: Scaled, problem: TrajectoryProblem, x: Array) -> Array:
    """A decision vector (n_var,) and slower ones on its path, in scaled variables (N, n_var).

    The end of an anchor may lie far from the front that evolution has found; its slower copies begin to fill the gap.
    """
    times = np.array([variable.unit == "s" and variable.lower > 0.0 for variable in problem.variables])
    later = np.where(times, np.log(_SLOWER), 0.0) * np.arange(_COPIES + 1 if times.any() else 1)[:, None]
    return np.clip(scaled.inside(x[None]) + later, *scaled.bounds)
