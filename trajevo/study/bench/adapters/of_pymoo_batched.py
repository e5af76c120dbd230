"""pymoo's NSGA-II on trajevo's batched problem: trajevo's algorithm without its loops and gradients."""

from __future__ import annotations

from typing import Any, final

from trajevo.base.arrays import Array
from trajevo.study.bench.adapters.adapter import BenchRival
from trajevo.study.bench.contest import Contest

#: Individuals; pymoo's own default.
POPULATION = 100


@final
class PymooBatched(BenchRival):
    """NSGA-II, a population evaluated in one call of trajevo's batched problem."""

    name = "pymoo-batched"
    says = "NSGA-II of 100 individuals on trajevo's batched problem"
    module, distribution = "pymoo", "pymoo"

    def solve(self, contest: Contest) -> None:
        """See :meth:`BenchRival.solve`."""
        from pymoo.algorithms.moo.nsga2 import NSGA2
        from pymoo.core.problem import Problem
        from pymoo.optimize import minimize
        from pymoo.termination.max_gen import MaximumGenerationTermination

        class Batched(Problem):  # type: ignore[misc]
            def __init__(self) -> None:
                sizes = {"n_obj": contest.n_obj, "n_ieq_constr": contest.problem.n_ieq_constr}
                super().__init__(n_var=len(contest.lower), xl=contest.lower, xu=contest.upper, **sizes)

            def _evaluate(self, X: Array, out: dict[str, Any], *arguments: Any, **options: Any) -> None:
                out["F"], out["G"] = contest.many(X)

        endless = MaximumGenerationTermination(10**9)
        minimize(Batched(), NSGA2(pop_size=POPULATION), endless, seed=contest.seed, copy_algorithm=False)
