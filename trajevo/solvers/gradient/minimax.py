"""The least of an objective that is a maximum, such as a peak, from the terms of the maximum.

At its least a maximum has a kink: several terms are equal there. Steps by the slope of the greatest term alone jump
from one side of the kink to the other, and curvature that is built up across it says nothing. With a row for each term
in the quadratic program of a step, as many terms as there are variables meet after a few steps.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from trajevo.base.arrays import Array
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.solvers.gradient.batch_sqp import Lockstep
from trajevo.solvers.gradient.scaling import Columns, Scaled

#: Greatest number of steps, promised decrease of the maximum's logarithm that ends them, and restarts.
_STEPS, _TOLERANCE, _RESTARTS = 40, 1e-7, 1

#: Share of the start's maximum that is added before the logarithm of a term is taken, since those that are far below
#: the greatest may become 0.
_OFFSET = 0.3

#: Shares of the way from a point back to the last one within all limits that are told of: a step along a bent limit
#: ends a little beyond it.
_BACK = np.array([0.0, 1e-6, 1e-4, 1e-3, 1e-2, 0.03, 0.1, 0.3])


class Descended(NamedTuple):
    """How a descent has ended: whether it has come to an end, and what it has cost."""

    converged: bool
    gradients: int
    evaluations: int


def in_terms_alone(problem: TrajectoryProblem) -> bool:
    """Whether a problem has a single objective, which is a maximum of terms that are known."""
    return problem.n_obj == 1 and problem.smooth is None and problem.objectives[0].terms is not None


def least_of_terms(
    problem: TrajectoryProblem,
    x: Array,
    top: float,
    margin: float,
    *,
    tell: Callable[[Array], object],
    stop: Callable[[int, int], bool],
) -> Descended:
    """Descend to the least of an objective that is a maximum of terms (:func:`in_terms_alone`).

    Args:
        problem: what to solve.
        x: where to begin, within all limits, shape (n_var,).
        top: the objective there.
        margin: margin by which limits are tightened, as a share.
        tell: called after every step with decision vectors (N, n_var), which may exceed limits: where it has led, and
            points on the way back.
        stop: called before every step with the number of gradients and of other evaluations so far; the descent ends if
            it returns True.
    """
    terms = problem.in_terms(objectives=True)
    count = int(terms.n_obj)
    low = np.full(count, -_OFFSET * top)
    scaled = Scaled(terms, Columns(np.eye(count), np.full(count, True), low, np.ones(count)), margin)
    none = np.zeros((1, count))
    run = Lockstep(scaled, scaled.inside(x[None]), reference=none, augmentation=none, restarts=_RESTARTS)

    def told() -> bool:
        tell(scaled.outside(run.y + _BACK[:, None] * (run.safe - run.y)))
        return stop(scaled.gradients, scaled.evaluations)

    run.run(np.array([_STEPS]), np.array([_TOLERANCE]), told)
    tell(scaled.outside(run.y + _BACK[:, None] * (run.safe - run.y)))
    return Descended(bool(run.converged[0]), scaled.gradients, scaled.evaluations)
