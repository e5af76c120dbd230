"""A run of a rival on a benchmark problem: what it may ask, its clock, and what it has tried."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, final

import moocore
import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError

if TYPE_CHECKING:
    from trajevo.study.bench.suite import BenchmarkProblem

#: Excess over a limit, as a share of it, up to which a decision vector counts as feasible, whoever found it.
FEASIBLE = 1e-6

#: A limit that the problem proves has no such excess: nothing is proven of a motion whose samples exceed it at all.
_PROVEN = 0.0

#: The same by a plain statement, which samples where trajevo may prove: what exceeds more is not looked at again.
_NEARLY = 1e-2

#: Rows that are judged together.
_ROWS = 2048


class OutOfTimeError(RuntimeError):
    """The CPU time or the evaluations of a run are used up; an adapter lets it pass."""


@dataclass(frozen=True, eq=False)
class Tried:
    """Decision vectors that a rival has tried at one time.

    Attributes:
        cpu: CPU time of the rival so far [s].
        evaluations: rows evaluated so far.
        X: decision vectors, shape (N, variables).
    """

    cpu: float
    evaluations: int
    X: Array

    __repr__ = brief


class Moved(NamedTuple):
    """A motion that no decision vector stands for, such as one along a path by another parameterisation.

    Attributes:
        cpu: CPU time of the rival so far [s].
        value: value of the first objective [SI].
        violation: greatest excess over a limit, as a share of it, at as many instants as others are looked at.
    """

    cpu: float
    value: float
    violation: float


@final
class Contest:
    """A run of a rival: the problem in two forms, the seed, and the CPU time that is left.

    Whatever a rival evaluates is noted with the CPU time that it has spent, so that every rival has a history of the
    same kind, and none can hide what it tries. When the time is used up, the next evaluation raises.

    Args:
        benchmark: the problem.
        seed: seed of all randomness.
        budget: CPU time of this process that the rival may spend [s].
        most: number of evaluations after which it ends, which does not depend on the machine; no limit if None.

    Attributes:
        benchmark: the problem.
        problem: trajevo's batched form, a pymoo problem.
        search: the settings of a search that the problem comes with.
        statement: the plain form, one row at a time; None if there is none.
        unstated: why there is none.
        motions_given: decision vectors of the motions whose greatest payloads are asked for, with a payload of 0 kg as
            their last variable, shape (K, variables); None where motions themselves are looked for.
        seed: seed of all randomness.
        budget: CPU time that the rival may spend [s].
        lower: least decision variables, shape (variables,).
        upper: greatest decision variables, shape (variables,).
        n_obj: number of objectives.
        n_constr: number of constraints of the plain form.
        tried: what was tried, in the order of time.
        motions: motions that were found without decision vectors, in the order of time.
    """

    def __init__(self, benchmark: BenchmarkProblem, *, seed: int, budget: float, most: int | None = None) -> None:
        self.benchmark, self.seed, self.budget = benchmark, seed, budget
        self._most = np.inf if most is None else most
        self.problem: Any = benchmark.problem()
        self.search = benchmark.search
        self.statement, self.unstated = _statement_of(benchmark)
        self.motions_given: Any = _motions_of(benchmark)
        self.lower, self.upper = frozen(np.array(self.problem.xl)), frozen(np.array(self.problem.xu))
        self.n_obj = int(self.problem.n_obj)
        self.tried: list[Tried] = []
        self.motions: list[Moved] = []
        self.evaluations = 0
        self._evaluate = self.problem.evaluate
        self._most_excess = most_excess(self.problem)
        self._ended: float | None
        middle = 0.5 * (self.lower + self.upper)
        # Whatever is compiled or loaded by a first evaluation is nobody's time.
        self._evaluate(np.stack([middle, self.upper]), return_values_of=["F", "G"])
        self.n_constr = 0 if self.statement is None else len(self.statement.evaluate(middle)[1])
        self.start()

    def start(self) -> None:
        """Start the clock."""
        self._began, self._paused, self._ended = time.process_time(), 0.0, None

    def stop(self) -> None:
        """Stop the clock for good."""
        self._ended = self.spent

    @property
    def spent(self) -> float:
        """CPU time of the rival so far [s]."""
        if self._ended is not None:
            return self._ended
        return time.process_time() - self._began - self._paused

    @property
    def left(self) -> float:
        """CPU time that is left [s], at least 0."""
        return max(self.budget - self.spent, 0.0)

    def in_time(self) -> bool:
        """Whether there is time for another evaluation."""
        return self.left > 0.0 and self.evaluations < self._most

    def random(self) -> np.random.Generator:
        """A generator of random numbers from the seed."""
        return np.random.default_rng(self.seed)

    def random_vectors(self, count: int, rng: np.random.Generator) -> Array:
        """Decision vectors uniform between the bounds, shape (count, variables)."""
        return rng.uniform(self.lower, self.upper, (count, len(self.lower)))

    def one(self, x: Array) -> tuple[Array, Array]:
        """Objectives and constraints of one row by the plain form.

        Args:
            x: decision vector, shape (variables,) [SI].

        Returns:
            Objectives, shape (objectives,) [SI], and constraints, shape (constraints,), at most 0 where kept [1].

        Raises:
            OutOfTimeError: the time is used up.
        """
        x = np.clip(np.asarray(x, dtype=np.float64), self.lower, self.upper)
        F, G = self.statement.evaluate(x)
        self.evaluations += 1
        may_count = np.isfinite(F).all() and np.max(G, initial=-np.inf) <= _NEARLY
        self._note(x[None] if may_count else x[None][:0])
        return F, G

    def many(self, X: Array) -> tuple[Array, Array]:
        """Objectives and constraints of rows by trajevo's batched form.

        Args:
            X: decision vectors, shape (N, variables) [SI].

        Returns:
            Objectives, shape (N, objectives) [SI], and constraints, shape (N, constraints), at most 0 where kept [1].

        Raises:
            OutOfTimeError: the time is used up.
        """
        F, G = self._evaluate(X, return_values_of=["F", "G"])
        self.looked_at(X, F, G)
        return F, G

    def looked_at(self, X: Array, F: Array, G: Array) -> None:
        """Note rows that trajevo's problem has evaluated, with what it said; those that cannot count are left out.

        Starts that are only looked at may be outside their bounds.

        Args:
            X: decision vectors, shape (N, variables) [SI].
            F: their objectives, shape (N, objectives) [SI].
            G: their constraints, shape (N, constraints), at most 0 where kept [1].

        Raises:
            OutOfTimeError: the time is used up.
        """
        self.evaluations += len(X)
        before = time.process_time()
        inside = ((self.lower <= X) & (self.upper >= X)).all(axis=1)
        kept = np.flatnonzero(inside & (self._most_excess >= G).all(axis=1) & np.isfinite(F).all(axis=1))
        if len(kept) and self.motions_given is None:  # each of several given motions counts
            kept = kept[moocore.is_nondominated(F[kept])]
        self._paused += time.process_time() - before
        self._note(X[kept])

    def found(self, value: float, violation: Callable[[], float]) -> None:
        """Note a motion that no decision vector stands for.

        Args:
            value: value of the first objective [SI].
            violation: computes its greatest excess over a limit, as a share of it, while the clock stands.

        Raises:
            OutOfTimeError: the time is used up.
        """
        cpu = self.spent
        if cpu <= self.budget:
            self.motions.append(Moved(cpu, float(value), float(violation())))
        self.evaluations += 1
        self._paused += self.spent - cpu
        self._in_time(cpu)

    def _note(self, X: Array) -> None:
        cpu = self.spent
        if len(X):
            self.tried.append(Tried(cpu, self.evaluations, np.array(X)))
        self._paused += self.spent - cpu
        self._in_time(cpu)

    def _in_time(self, cpu: float) -> None:
        if cpu > self.budget or self.evaluations >= self._most:
            raise OutOfTimeError(f"{cpu:g} s of CPU time and {self.evaluations} evaluations are used up")


def _motions_of(benchmark: BenchmarkProblem) -> Array | None:
    """Decision vectors of given motions without payload, shape (K, variables); None if none are given."""
    if benchmark.told.kind != "capacity":
        return None
    motions = np.array(benchmark.told.variables)
    motions[:, -1] = 0.0
    return frozen(motions)


def _statement_of(benchmark: BenchmarkProblem) -> tuple[Any, str]:
    """The plain form of a problem, or why there is none."""
    try:
        return benchmark.statement(), ""
    except InvalidInputError as error:
        return None, str(error)


def most_excess(problem: Any) -> Array:
    """Excess over every limit up to which a decision vector counts as feasible, as a share of it, (constraints,)."""
    columns = [(_PROVEN if limit.sampled is not None else FEASIBLE, limit.names) for limit in problem.constraints]
    return np.array([most for most, names in columns for _ in names])


def judged(problem: Any, tried: Iterable[Tried], until: float) -> tuple[Array, Array, Array, Array]:
    """What is feasible of all that was tried in time, as trajevo's problem sees it, whoever tried it.

    Args:
        problem: trajevo's form of the problem.
        tried: what was tried.
        until: CPU time after which nothing counts [s].

    Returns:
        CPU times (N,) [s], evaluations (N,), decision vectors (N, variables), objectives (N, objectives) [SI].
    """
    in_time = [one for one in tried if one.cpu <= until]
    width = problem.n_var
    X = np.concatenate([np.empty((0, width)), *(one.X for one in in_time)])
    counts = [len(one.X) for one in in_time]
    cpu = np.repeat([one.cpu for one in in_time], counts)
    evaluations = np.repeat(np.array([one.evaluations for one in in_time], dtype=np.int64), counts)
    F, G = np.empty((len(X), problem.n_obj)), np.empty((len(X), problem.n_ieq_constr))
    for begin in range(0, len(X), _ROWS):
        rows = slice(begin, begin + _ROWS)
        F[rows], G[rows] = problem.evaluate(X[rows], return_values_of=["F", "G"])
    kept = np.flatnonzero((most_excess(problem) >= G).all(axis=1) & np.isfinite(F).all(axis=1))
    return cpu[kept], evaluations[kept], X[kept], F[kept]
