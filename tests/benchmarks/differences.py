"""Gradients by central differences, with which exact ones are compared."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from trajevo import TrajectoryProblem
from trajevo.base.arrays import Array

#: Step as a share of a variable's range.
_STEP = 1e-6

#: Decision vectors (B, n_var) -> F, dF, G, dG as in TrajectoryProblem.evaluate_with_gradients.
Gradients = Callable[[Array], tuple[Array, Array, Array, Array]]


def central_differences(problem: TrajectoryProblem) -> Gradients:
    """Gradients of a problem by central differences in one batch; next to a bound the differences are one-sided.

    Args:
        problem: the problem.
    """

    def gradients(x: Array) -> tuple[Array, Array, Array, Array]:
        steps = _STEP * (problem.xu - problem.xl) * np.eye(problem.n_var)
        above = np.minimum(x[:, None] + steps, problem.xu)
        below = np.maximum(x[:, None] - steps, problem.xl)
        width = np.einsum("bii->bi", above - below)
        rows = np.concatenate([x[:, None], above, below], axis=1)
        flat = problem.evaluate(rows.reshape(-1, problem.n_var), return_values_of=["F", "G"])
        values = [array.reshape(len(x), 1 + 2 * problem.n_var, -1) for array in flat]
        slopes = [
            np.swapaxes((v[:, 1 : 1 + problem.n_var] - v[:, 1 + problem.n_var :]) / width[..., None], 1, 2)
            for v in values
        ]
        return values[0][:, 0], slopes[0], values[1][:, 0], slopes[1]

    return gradients
