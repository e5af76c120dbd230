"""trajevo as users run it: ``optimise`` with the settings of the task and a limit of CPU time, or ``capacities``."""

from __future__ import annotations

from importlib import import_module
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.capacity.dlcc import capacities
from trajevo.solvers.optimise import optimise
from trajevo.study.bench.adapters.adapter import BenchRival
from trajevo.study.bench.contest import Contest

#: Modules that a search imports when it begins, which takes as long as all other imports together.
_IMPORTED = (
    "formulation.feasibility.check",
    "solvers.evolutionary.first_population",
    "solvers.evolutionary.nsga2",
    "solvers.run.evolution",
    "solvers.run.runs",
)


@final
class Trajevo(BenchRival):
    """``optimise`` on the batched problem: evolution, then gradients. Given motions have guaranteed payloads."""

    name = "trajevo"
    says = "optimise with the settings of the task: evolution, then gradients; payloads of given motions by capacities"
    carries = True

    def prepare(self) -> None:
        """See :meth:`BenchRival.prepare`."""
        for module in _IMPORTED:
            import_module(f"trajevo.{module}")

    def solve(self, contest: Contest) -> None:
        """See :meth:`BenchRival.solve`."""
        problem, given = contest.problem, contest.motions_given
        if given is not None:
            contest.many(np.column_stack([given[:, :-1], capacities(problem.rollout(given)).mass]))
            return
        kind: Any = type(problem)

        class Noted(kind):  # type: ignore[misc]
            def _evaluate(self, x: Array, out: dict[str, Any], *arguments: Any, **options: Any) -> None:
                """What the problem says, as ever, and a note of whatever is evaluated; not of forms for gradients."""
                super()._evaluate(x, out, *arguments, **options)
                if self.constraints is problem.constraints:  # copies of the problem too
                    contest.looked_at(x, out["F"], out["G"])

        problem.__class__ = Noted
        try:
            search = contest.search.updated(seed=contest.seed, cpu_time=contest.budget)
            optimise(problem, search, progress=False)
        finally:
            problem.__class__ = kind
