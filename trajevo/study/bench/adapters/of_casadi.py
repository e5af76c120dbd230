"""CasADi with Ipopt on the plain statement, from random starts: finite differences, a weighted sum of the objectives.

Nothing of the statement is written in CasADi's symbols, so that Ipopt has neither exact derivatives nor sparsity here;
``tests/benchmarks/bench_casadi.py`` compares with problems that are written anew in symbols.
"""

from __future__ import annotations

from typing import Any, final

import numpy as np

from trajevo.study.bench.adapters.adapter import BenchRival
from trajevo.study.bench.adapters.of_scipy import Remembered
from trajevo.study.bench.contest import Contest, OutOfTimeError

#: Options of Ipopt wherever trajevo is compared with it: no limit is relaxed.
STRICT = {"linear_solver": "mumps", "print_level": 0, "sb": "yes", "tol": 1e-8, "bound_relax_factor": 0.0}

#: The same here, with an approximate Hessian.
IPOPT = STRICT | {"max_iter": 300, "hessian_approximation": "limited-memory"}


@final
class CasadiIpopt(BenchRival):
    """Ipopt from random starts; for a front each start has random weights, the first ones one objective each."""

    name = "casadi-ipopt"
    says = "Ipopt from random starts on the plain statement, finite differences; fronts by random weighted sums"
    module, distribution = "casadi", "casadi"
    plain = True

    def solve(self, contest: Contest) -> None:
        """See :meth:`BenchRival.solve`."""
        import casadi

        values, rng, alone = Remembered(contest), contest.random(), list(np.eye(contest.n_obj))
        stated = self._stated(casadi, values, len(contest.lower), contest.n_obj, contest.n_constr)
        x, weights = casadi.MX.sym("x", len(contest.lower)), casadi.MX.sym("weights", contest.n_obj)
        F, G = stated(x)
        nlp = {"x": x, "p": weights, "f": casadi.dot(weights, F), "g": G}
        quiet: dict[str, Any] = dict.fromkeys(
            ("print_time", "show_eval_warnings", "error_on_fail", "calc_lam_p"), False
        )
        solve = casadi.nlpsol("solver", "ipopt", nlp, quiet | {"ipopt": IPOPT})
        while contest.in_time():
            start = contest.random_vectors(1, rng)[0]
            chosen = alone.pop() if alone else rng.dirichlet(np.ones(contest.n_obj))
            solve(x0=start, p=chosen, lbx=contest.lower, ubx=contest.upper, ubg=0.0)

    def _stated(self, casadi: Any, values: Remembered, n_var: int, n_obj: int, n_constr: int) -> Any:
        """The statement as a function of CasADi."""
        sizes = (n_obj, n_constr)

        class Stated(casadi.Callback):  # type: ignore[misc]
            def get_n_out(self) -> int:
                return 2

            def get_sparsity_in(self, i: int) -> Any:
                return casadi.Sparsity.dense(n_var, 1)

            def get_sparsity_out(self, i: int) -> Any:
                return casadi.Sparsity.dense(sizes[i], 1)

            def eval(self, given: Any) -> list[Any]:
                try:
                    return [casadi.DM(part) for part in values(np.array(given[0]).ravel())]
                except OutOfTimeError:  # Ipopt ends where nothing is a number
                    return [casadi.DM.nan(size) for size in sizes]

        self._kept = Stated()  # CasADi keeps no reference
        self._kept.construct("stated", {"enable_fd": True})
        return self._kept
