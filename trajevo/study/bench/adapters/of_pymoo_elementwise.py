"""pymoo's NSGA-II on the plain statement, one candidate at a time, as most users write it."""

from __future__ import annotations

from typing import Any, final

from trajevo.base.arrays import Array
from trajevo.study.bench.adapters.adapter import BenchRival
from trajevo.study.bench.adapters.of_pymoo_batched import POPULATION
from trajevo.study.bench.contest import Contest


@final
class PymooElementwise(BenchRival):
    """NSGA-II on an ``ElementwiseProblem``."""

    name = "pymoo-elementwise"
    says = "NSGA-II of 100 individuals on the plain statement, one candidate at a time"
    module, distribution = "pymoo", "pymoo"
    plain = True

    def solve(self, contest: Contest) -> None:
        """See :meth:`BenchRival.solve`."""
        from pymoo.algorithms.moo.nsga2 import NSGA2
        from pymoo.core.problem import ElementwiseProblem
        from pymoo.optimize import minimize
        from pymoo.termination.max_gen import MaximumGenerationTermination

        class OneByOne(ElementwiseProblem):  # type: ignore[misc]
            def __init__(self) -> None:
                sizes = {"n_obj": contest.n_obj, "n_ieq_constr": contest.n_constr}
                super().__init__(n_var=len(contest.lower), xl=contest.lower, xu=contest.upper, **sizes)

            def _evaluate(self, x: Array, out: dict[str, Any], *arguments: Any, **options: Any) -> None:
                out["F"], out["G"] = contest.one(x)

        endless = MaximumGenerationTermination(10**9)
        minimize(OneByOne(), NSGA2(pop_size=POPULATION), endless, seed=contest.seed, copy_algorithm=False)
