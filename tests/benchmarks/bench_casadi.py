"""Least times of trajevo against CasADi with Ipopt on the same vectors, bounds and limits; docs/explanation/optimum.md.

Six problems; every row is one run of ``optimise`` with default settings, and Ipopt (MUMPS) from five starts: the
fastest member that the evolution found, trajevo's own end, which shows whether that is an optimum at all, and three
random ones. Four problems are written anew in symbols of CasADi (``splines_anew.py``), with exact first and second
derivatives; of the other two, values and exact gradients are trajevo's, and the Hessian is approximated with limited
memory. ``bench_casadi.py NUMBERS --seed SEED --random COUNT``, as in ``bench_casadi.py 1 4 --seed 2`` for the first and
the fourth problem; the six with seed 1 if nothing is given, and a seventh on request. Needs casadi: ``pip install
'trajevo[bench]'``.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from cases_of_optima import USUAL, Compared, cases, disagreement, random_vectors

from trajevo import ViaPointProblem, certify, optimise, polish
from trajevo.solvers.gradient.weighted_sum import WeightedOptimum
from trajevo.study.bench.adapters.of_casadi import STRICT

#: Share of a limit by which Ipopt's motion may exceed it and still counts.
EXCESS = 1e-6

#: What is said where CasADi is not installed.
MISSING = "bench_casadi.py: expected CasADi, which is not installed; pip install 'trajevo[bench]'"

#: Options of Ipopt, with exact derivatives and more iterations than in a run of the suite.
IPOPT = STRICT | {"max_iter": 1000}


@dataclass(frozen=True)
class End:
    """Where Ipopt ended from a start.

    Attributes:
        start: name of the start.
        x: decision vector, shape (n_var,).
        least: time of the motion [s].
        share: greatest share of any limit that it uses, by trajevo.
        told: what Ipopt says.
        cpu: CPU time [s].
    """

    start: str
    x: np.ndarray
    least: float
    share: float
    told: str
    cpu: float


def main() -> None:
    """Print the table."""
    try:
        import casadi
    except ImportError:
        print(MISSING)
        return
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("numbers", type=int, nargs="*", help="numbers of the problems; the first six if none is given")
    parser.add_argument("--seed", type=int, default=1, help="of the run and of the random starts")
    parser.add_argument("--random", type=int, default=3, help="number of random starts of Ipopt")
    given = parser.parse_args()
    print(f"casadi {casadi.__version__}, seed {given.seed}; CPU times, Ipopt's of all its starts", flush=True)
    for number, case in enumerate(cases(), start=1):
        if number in (given.numbers or range(1, USUAL + 1)):
            print("\n".join(lines(number, case, given.seed, given.random, casadi)), flush=True)


def lines(number: int, case: Compared, seed: int, random: int, casadi: Any) -> list[str]:
    """What came out where a problem is solved by both."""
    problem, column = case.problem, case.problem.objective_names.index("time")
    began = time.process_time()
    evolved = optimise(problem, seed=seed, polish=False, progress=False)
    evolution = time.process_time() - began
    began = time.process_time()
    front = polish(evolved).front
    polishing = time.process_time() - began
    first, own = (found.X[int(np.argmin(found.F[:, column]))] for found in (evolved, front))
    least = float(front.F[:, column].min())

    began = time.process_time()
    solver = in_symbols(case, casadi) if case.formulation else Gradients(problem).solver(casadi)
    made = time.process_time() - began
    starts = {f"random {k + 1}": x for k, x in enumerate(random_vectors(problem, random, seed))}
    starts = {"evolved": first, "trajevo's": own} | starts
    ends = [end_of(problem, solver, name, x) for name, x in starts.items()]
    spent = made + sum(end.cpu for end in ends)
    written = f"written anew, differs by {disagreement(case):.0e}" if case.formulation else "gradients of trajevo"
    return [
        f"{number}. {case.title}: {problem.n_var} variables, {written}",
        f"   trajevo {least:.6f} s, CPU {evolution:.1f} + {polishing:.1f} s, {proven(problem, own)}; evolved "
        f"{evolved.F[:, column].min():.6f} s",
        *of_ipopt(problem, ends, least, spent),
    ]


def of_ipopt(problem: ViaPointProblem, ends: list[End], least: float, spent: float) -> list[str]:
    """The best of Ipopt's ends within all limits, how many are as good, and how the first of them ended."""
    within = [end for end in ends if end.share <= 1.0 + EXCESS]
    if not within:
        return [f"   Ipopt   nothing within all limits, CPU {spent:.1f} s"]
    best = min(within, key=lambda end: end.least)
    near = sum(end.least <= 1.001 * best.least for end in within)
    told = [f"     {end.start:10} {end.least:.6f} s, share {end.share:.8f}, {end.told}" for end in ends[:5]]
    return [
        f"   Ipopt   {best.least:.6f} s ({100.0 * (best.least / least - 1.0):+.6f} %), CPU {spent:.1f} s, "
        f"from {best.start}, {proven(problem, best.x)}",
        f"     {len(within)} of {len(ends)} ends are within all limits, {near} of them within 0.1 % of the best",
        *told,
    ]


def proven(problem: ViaPointProblem, x: np.ndarray) -> str:
    """What trajevo proves of a motion at every instant, limits that are sampled included."""
    F, G = problem.evaluate(x[None], return_values_of=["F", "G"])
    named = [
        dict(zip(names, row[0], strict=True))
        for names, row in ((problem.objective_names, F), (problem.constraint_names, G))
    ]
    certificate = certify(WeightedOptimum(problem, x, 0.0, *named, np.zeros(1), 0.0))
    share, verdict = max(proof.share for proof in certificate.rows), "" if certificate.proven else "not "
    return f"{1.0 + G.max():.8f} of a limit, {verdict}certified: at every instant at most {share:.8f}"


def end_of(problem: ViaPointProblem, solver: tuple[Any, dict[str, Any]], name: str, x: np.ndarray) -> End:
    """Where Ipopt ends from a start, judged by trajevo."""
    solve, limits = solver
    began = time.process_time()
    found = solve(x0=x, lbx=problem.xl, ubx=problem.xu, **limits)
    spent = time.process_time() - began
    end = np.clip(np.array(found["x"]).ravel(), problem.xl, problem.xu)
    F, G = problem.evaluate(end[None], return_values_of=["F", "G"])
    least = float(F[0, problem.objective_names.index("time")])
    return End(name, end, least, 1.0 + float(G.max()), solve.stats()["return_status"], spent)


def in_symbols(case: Compared, casadi: Any) -> tuple[Any, dict[str, Any]]:
    """Ipopt on the problem that is written anew, with exact derivatives, and the bounds of its limits."""
    x = casadi.SX.sym("x", case.problem.n_var)
    took, shares = case.formulation([x[k] for k in range(case.problem.n_var)], casadi)
    nlp = {"x": x, "f": took, "g": casadi.vertcat(*shares)}
    return casadi.nlpsol("solver", "ipopt", nlp, {"ipopt": IPOPT, "print_time": False}), {"lbg": -1.0, "ubg": 1.0}


class Gradients:
    """Time and limits in terms of a problem, with exact gradients, each evaluated once at a point.

    Args:
        problem: the problem; of its objectives only the time is evaluated.
    """

    def __init__(self, problem: ViaPointProblem) -> None:
        self.problem = ViaPointProblem(**dict(problem.settings) | {"objectives": ["time"]}).in_terms()
        self.terms = self.problem.n_ieq_constr
        self._at = np.full(self.problem.n_var, np.nan)
        self._found: tuple[np.ndarray, ...] = ()

    def at(self, x: Any) -> tuple[np.ndarray, ...]:
        """Time (), its gradient (n_var,), excesses (K,) and theirs (K, n_var)."""
        point = np.clip(np.array(x).ravel(), self.problem.xl, self.problem.xu)
        if not np.array_equal(point, self._at):
            F, dF, G, dG = self.problem.evaluate_with_gradients(point[None])
            self._at, self._found = point, (F[0, 0], dF[0, 0], G[0], dG[0])
        return self._found

    def solver(self, casadi: Any) -> tuple[Any, dict[str, Any]]:
        """Ipopt with a Hessian of limited memory, and the bounds of the limits."""
        count, terms, at = self.problem.n_var, self.terms, self.at
        sizes = [(count, 1), (1, 1), (terms, 1)]

        class Slopes(casadi.Callback):
            def __init__(self, name: str, options: dict[str, Any]) -> None:
                super().__init__()
                self.construct(name, options)

            def get_n_in(self) -> int:
                return 3

            def get_n_out(self) -> int:
                return 2

            def get_sparsity_in(self, i: int) -> Any:
                return casadi.Sparsity.dense(*sizes[i])

            def get_sparsity_out(self, i: int) -> Any:
                return casadi.Sparsity.dense(sizes[i + 1][0], count)

            def eval(self, given: Any) -> list[Any]:
                _, slope, _, slopes = at(given[0])
                return [casadi.DM(slope[None]), casadi.DM(slopes)]

        class Values(casadi.Callback):
            def __init__(self) -> None:
                super().__init__()
                self.construct("values", {})

            def get_n_in(self) -> int:
                return 1

            def get_n_out(self) -> int:
                return 2

            def get_sparsity_in(self, i: int) -> Any:
                return casadi.Sparsity.dense(count, 1)

            def get_sparsity_out(self, i: int) -> Any:
                return casadi.Sparsity.dense(*sizes[i + 1])

            def eval(self, given: Any) -> list[Any]:
                value, _, excess, _ = at(given[0])
                return [casadi.DM(float(value)), casadi.DM(excess)]

            def has_jacobian(self) -> bool:
                return True

            def get_jacobian(self, name: str, inputs: Any, outputs: Any, options: dict[str, Any]) -> Any:
                self.slopes = Slopes(name, options)  # CasADi keeps no reference
                return self.slopes

        self._values = Values()
        x = casadi.MX.sym("x", count)
        took, excess = self._values(x)
        options = {"ipopt": IPOPT | {"hessian_approximation": "limited-memory"}, "print_time": False}
        return casadi.nlpsol("solver", "ipopt", {"x": x, "f": took, "g": excess}, options), {"ubg": 0.0}


if __name__ == "__main__":
    main()
