"""SciPy's SLSQP on the plain statement, from random starts: finite differences, a weighted sum of the objectives."""

from __future__ import annotations

from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.study.bench.adapters.adapter import BenchRival
from trajevo.study.bench.contest import Contest

#: What stands for a value that is not finite, for finite differences.
_HUGE = 1e6


class Remembered:
    """Objectives scaled to their box, and constraints, of the last row: both are asked for one after the other.

    Args:
        contest: evaluates rows.
    """

    def __init__(self, contest: Contest) -> None:
        reference = contest.benchmark.reference
        self._contest, self._ideal = contest, reference.ideal
        self._range = reference.reference_point - reference.ideal
        self._at, self._found = np.full(len(contest.lower), np.nan), (np.empty(0), np.empty(0))

    def __call__(self, x: Array) -> tuple[Array, Array]:
        """Objectives (objectives,), 0 to 1 within the box, and constraints (constraints,)."""
        if not np.array_equal(x, self._at):
            F, G = self._contest.one(x)
            self._at = np.array(x)
            self._found = np.nan_to_num((F - self._ideal) / self._range, nan=_HUGE, posinf=_HUGE), np.nan_to_num(G)
        return self._found


@final
class ScipySlsqp(BenchRival):
    """SLSQP from random starts; for a front each start has random weights, the first ones one objective each."""

    name = "scipy-slsqp"
    says = "SLSQP from random starts on the plain statement, finite differences; fronts by random weighted sums"
    module, distribution = "scipy", "scipy"
    plain = True

    def solve(self, contest: Contest) -> None:
        """See :meth:`BenchRival.solve`."""
        from scipy.optimize import Bounds, minimize

        rng, values = contest.random(), Remembered(contest)
        kept = {"type": "ineq", "fun": lambda x: -values(x)[1]}
        bounds = Bounds(contest.lower, contest.upper, keep_feasible=True)
        alone = list(np.eye(contest.n_obj))
        while True:
            weights = alone.pop() if alone else rng.dirichlet(np.ones(contest.n_obj))
            start = contest.random_vectors(1, rng)[0]

            def total(x: Array, weights: Array = weights) -> float:
                return float(values(x)[0] @ weights)

            options = {"maxiter": 200, "ftol": 1e-9}
            minimize(total, start, method="SLSQP", bounds=bounds, constraints=[kept], options=options)
