"""Scales of objectives and decision variables on which the steps of a gradient solver have similar sizes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.formulation.problem import TrajectoryProblem

#: Share of an objective's greatest relevant value that is added before its logarithm is taken, since the objective may
#: become 0 and ratios between much smaller values do not matter.
_OFFSET = 1e-3


@final
@dataclass(frozen=True, eq=False)
class Columns:
    """Scaled columns: objectives and weighted sums of them, on a logarithmic scale if positive, else on a linear one.

    Attributes:
        weights: weights of the objectives in every column, shape (C, n_obj).
        logarithmic: which columns have a logarithmic scale, shape (C,).
        low: value that becomes 0 on a linear scale; on a logarithmic one, the negative of the value that is added
            before the logarithm is taken, shape (C,).
        width: distance from ``low`` to the value that becomes 1 on a linear scale; 1 on a logarithmic one, shape (C,).
    """

    weights: Array
    logarithmic: Array
    low: Array
    width: Array

    @classmethod
    def of(cls, F: Array, weights: Array, corner: Array) -> Columns:
        """Columns for the points of a front (N, n_obj), weights (C, n_obj) and the corner of its box (n_obj,)."""
        sums, greatest = F @ weights.T, np.minimum(F.max(axis=0), corner) @ weights.T
        logarithmic: Array = np.all(sums > 0.0, axis=0)
        low, width = sums.min(axis=0), np.ptp(sums, axis=0)
        return cls(
            weights,
            logarithmic,
            np.where(logarithmic, -_OFFSET * greatest, low),
            np.where(logarithmic | (width <= 0.0), 1.0, width),
        )

    def __call__(self, F: Array) -> Array:
        """Scaled columns (B, C) of objectives (B, n_obj); infinite where a logarithm does not exist."""
        above = (F @ self.weights.T - self.low) / self.width
        exists = np.isfinite(above) & (~self.logarithmic | (above > 0.0))
        scaled = np.where(self.logarithmic, np.log(np.where(exists & (above > 0.0), above, 1.0)), above)
        return np.where(exists, scaled, np.inf)

    def slopes(self, F: Array, dF: Array) -> Array:
        """Derivatives of the columns (B, C, n), from objectives (B, n_obj) and their derivatives (B, n_obj, n)."""
        above = (F @ self.weights.T - self.low) / self.width
        rate = np.where(self.logarithmic, 1.0 / np.where(above > 0.0, above, np.inf), 1.0) / self.width
        slopes: Array = (self.weights @ dF) * rate[..., None]
        return slopes


@final
class Scaled:
    """A problem in scaled variables: logarithms if their bounds are positive, else divided by their range.

    Args:
        problem: the problem, each of its limits split into smooth terms (:meth:`TrajectoryProblem.in_terms`).
        columns: scales of its objectives.
        margin: margin by which limits are tightened, as a share.
        held: mask of the variables that a solver must leave where they are, shape (n_var,), whose slopes are 0; none if
            None.

    Attributes:
        evaluations: points that were evaluated.
        gradients: points whose gradients were evaluated.
    """

    def __init__(
        self, problem: TrajectoryProblem, columns: Columns, margin: float, *, held: Array | None = None
    ) -> None:
        self.columns, self.evaluations, self.gradients = columns, 0, 0
        self._problem, self._margin, self._held = problem, margin, held
        self._logarithmic = problem.xl > 0.0
        self._width = np.where(self._logarithmic, 1.0, problem.xu - problem.xl)
        self.bounds = self.inside(np.stack([problem.xl, problem.xu]))

    def inside(self, x: Array) -> Array:
        """Scaled variables of decision vectors (B, n_var)."""
        return np.where(self._logarithmic, np.log(np.where(self._logarithmic, x, 1.0)), x / self._width)

    def outside(self, y: Array) -> Array:
        """Decision vectors of scaled variables, within the bounds."""
        x = np.where(self._logarithmic, np.exp(np.where(self._logarithmic, y, 0.0)), y * self._width)
        return np.clip(x, self._problem.xl, self._problem.xu)

    def values(self, y: Array) -> tuple[Array, Array]:
        """Columns (B, C) and limits (B, m) at scaled variables (B, n)."""
        self.evaluations += len(y)
        F, G = self._problem.evaluate(self.outside(y), return_values_of=["F", "G"])
        return self.columns(F), G + self._margin

    def slopes(self, y: Array) -> tuple[Array, Array, Array, Array]:
        """Columns (B, C), their derivatives (B, C, n), limits (B, m), their derivatives (B, m, n) at (B, n).

        Where the gradients of a member fail, its values are NaN.
        """
        self.gradients += len(y)
        x = self.outside(y)
        try:
            F, dF, G, dG = self._problem.evaluate_with_gradients(x)
        except Exception:  # noqa: BLE001 - a member whose gradients raise must not stop the others
            F, dF, G, dG = self._each(x)
        stretch = np.where(self._logarithmic, x, self._width)[:, None]
        if self._held is not None:
            stretch = np.where(self._held, 0.0, stretch)
        return self.columns(F), self.columns.slopes(F, dF * stretch), G + self._margin, dG * stretch

    def _each(self, x: Array) -> tuple[Array, Array, Array, Array]:
        problem = self._problem
        sizes = (problem.n_obj, problem.n_ieq_constr)
        shapes = [shape for size in sizes for shape in ((len(x), size), (len(x), size, problem.n_var))]
        F, dF, G, dG = (np.full(shape, np.nan) for shape in shapes)
        for i in range(len(x)):
            try:
                found = problem.evaluate_with_gradients(x[i : i + 1])
            except Exception:  # noqa: BLE001 - its values stay NaN, and the member does not move
                continue
            for whole, row in zip((F, dF, G, dG), found, strict=True):
                whole[i] = row[0]
        return F, dF, G, dG
