"""Sequential quadratic programming on a trajectory problem: SLSQP on logarithmic scales, and its gradients."""

from __future__ import annotations

import warnings
from collections.abc import Callable

import numpy as np
from scipy.optimize import minimize

from trajevo.base.arrays import Array
from trajevo.formulation.problem import TrajectoryProblem

#: Decision vectors (B, n_var) -> F, dF, G, dG as in TrajectoryProblem.evaluate_with_gradients.
Gradients = Callable[[Array], tuple[Array, Array, Array, Array]]

#: Excess, as a share of a limit, up to which a result of the solver counts as feasible.
FEASIBLE = 1e-6

#: Greatest number of times that SLSQP is started. It stops early if its approximation of the curvature is wrong; when
#: it is started again from that point, it continues.
_RESTARTS = 6
#: Change of the cost or its logarithm between two starts that counts as none.
_SETTLED = 1e-7

#: Step of finite differences as a share of a variable's range, and tolerance for exact gradients to agree with them.
_STEP, _AGREEMENT = 1e-6, 1e-3


class WeightedSum:
    """Minimises a weighted sum of objectives under the problem's limits, and optionally within a half-space of them.

    Values and gradients of the last point are cached, since the solver asks for them one after another.

    Args:
        problem: what to solve.
        weights: weights of the objectives, shape (n_obj,).
        gradients: gradients of the problem; by complex step if None.
        half_space: normal (n_obj,) and offset: normal · F may not exceed the offset.
        margin: margin by which every limit is tightened, as a share of it.

    Attributes:
        evaluations: number of points at which values and gradients were evaluated.
    """

    def __init__(
        self,
        problem: TrajectoryProblem,
        weights: Array,
        *,
        gradients: Gradients | None = None,
        half_space: tuple[Array, float] | None = None,
        margin: float = 0.0,
    ) -> None:
        self.problem, self.weights, self.tame = problem, weights, True
        self.gradients = gradients or problem.evaluate_with_gradients
        self.half_space, self.margin, self.evaluations = half_space, margin, 0
        self.logarithmic = problem.xl > 0.0
        self.bounds = np.stack([self._inside(problem.xl), self._inside(problem.xu)], axis=1)
        self._at: Array | None = None
        self._values: tuple[float, Array, Array, Array] = (0.0, np.empty(0), np.empty(0), np.empty(0))

    def run(self, start: Array, tolerance: float) -> Array:
        """The end of SLSQP on the logarithm of the cost, or on the cost itself if that end is infeasible."""
        y = self._inside(np.clip(start, self.problem.xl, self.problem.xu))
        for self.tame in (True, False):
            self._at = None
            end, feasible = self._settled(y, tolerance)
            if feasible:
                break
        return np.clip(self._outside(end), self.problem.xl, self.problem.xu)

    def _settled(self, y: Array, tolerance: float) -> tuple[Array, bool]:
        """Start SLSQP again from its own end until that changes nothing; returns the end and whether it is feasible."""
        last, worst, feasible = np.inf, np.inf, False
        for _ in range(_RESTARTS):
            y = np.clip(self._once(y, tolerance), self.bounds[:, 0], self.bounds[:, 1])
            value, _, G, dG = self._look(y)
            excess = float(G.max(initial=-np.inf))
            feasible = excess <= FEASIBLE
            if feasible and abs(last - value) <= _SETTLED:
                break
            # Give up if the last start has not reduced the excess, or no small step can.
            if not feasible and (excess >= worst or not dG[G > FEASIBLE].any()):
                break
            last, worst = (value, np.inf) if feasible else (np.inf, excess)
        return y, feasible

    def _once(self, y: Array, tolerance: float) -> Array:
        limits = {"type": "ineq", "fun": lambda y: -self._look(y)[2], "jac": lambda y: -self._look(y)[3]}
        limited = self.problem.n_ieq_constr or self.half_space is not None
        found = minimize(
            lambda y: self._look(y)[:2],
            y,
            jac=True,
            method="SLSQP",
            bounds=self.bounds,
            constraints=[limits] if limited else [],
            options={"maxiter": 500, "ftol": tolerance},
        )
        end: Array = found.x if np.isfinite(found.x).all() else y
        return end

    def _look(self, y: Array) -> tuple[float, Array, Array, Array]:
        if self._at is None or not np.array_equal(self._at, y):
            x = self._outside(y)
            self.evaluations += 1
            F, dF, G, dG = (values[0] for values in self.gradients(x[None]))
            G = G + self.margin
            if self.half_space is not None:
                normal, offset = self.half_space
                G, dG = np.append(G, normal @ F - offset), np.vstack([dG, normal @ dF])
            stretch = np.where(self.logarithmic, x, 1.0)
            cost, slope = float(F @ self.weights), (self.weights @ dF) * stretch
            # Costs of poor starts are many orders of magnitude above the optimum; their logarithm varies much less.
            value = (np.log(cost), slope / cost) if self.tame and cost > 0.0 else (cost, slope)
            self._values = float(value[0]), value[1], G, dG * stretch
            self._at = y.copy()
        return self._values

    def _inside(self, x: Array) -> Array:
        return np.where(self.logarithmic, np.log(np.where(self.logarithmic, x, 1.0)), x)

    def _outside(self, y: Array) -> Array:
        return np.where(self.logarithmic, np.exp(np.where(self.logarithmic, y, 0.0)), y)


def random_starts(problem: TrajectoryProblem, seed: int, count: int) -> Array:
    """Decision vectors uniform between the bounds, shape (count, n_var)."""
    drawn = np.random.default_rng(seed).uniform(problem.xl, problem.xu, (count, problem.n_var))
    return np.asarray(drawn, dtype=np.float64)


def differentiated(problem: TrajectoryProblem, probes: Array) -> tuple[Gradients, str]:
    """Gradients of a problem and their kind: by complex step if that is right, else by finite differences.

    The complex step is silently wrong if an objective of the user drops imaginary parts. So it is compared with finite
    differences, and a warning names the objectives and constraints that do not agree.

    Args:
        problem: the problem.
        probes: decision vectors at which to compare, shape (B, n_var).
    """
    rough, probes = central_differences(problem), np.clip(probes, problem.xl, problem.xu)
    F, dF, G, dG = rough(probes)
    numerical = np.concatenate([dF, dG], axis=1)
    try:
        exact = np.concatenate(problem.evaluate_with_gradients(probes)[1::2], axis=1)
    except Exception as error:  # noqa: BLE001 - whatever an objective of the user's raises on complex numbers
        blame = f"complex numbers raise {type(error).__name__}: {error}"
    else:
        scale = np.abs(numerical).max(axis=2) + _AGREEMENT * np.concatenate([np.abs(F), 1.0 + np.abs(G)], axis=1)
        off = (np.abs(exact - numerical).max(axis=2) > _AGREEMENT * scale).all(axis=0)
        if not off.any():
            return problem.evaluate_with_gradients, "complex step"
        names = problem.objective_names + problem.constraint_names
        blame = f"the complex step disagrees for {', '.join(names[i] for i in np.flatnonzero(off)[:3])}"
    warnings.warn(f"{problem.title}: gradients by finite differences, since {blame}", stacklevel=3)
    return rough, "finite differences"


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
