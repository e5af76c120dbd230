"""NSGA-II with its population in arrays: the same individuals as pymoo's NSGA-II to the bit, without loops over them.

:class:`Individuals` holds the arrays and converts them to and from pymoo's populations; :class:`ArrayNSGA2` is the
algorithm.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, cast, final

import numpy as np
from pymoo.algorithms.base.genetic import GeneticAlgorithm
from pymoo.core.duplicate import DuplicateElimination
from pymoo.core.evaluator import Evaluator
from pymoo.core.individual import Individual
from pymoo.core.population import Population
from pymoo.operators.crossover.sbx import SBX
from pymoo.operators.mutation.pm import PM
from pymoo.operators.sampling.rnd import FloatRandomSampling
from pymoo.termination.default import DefaultMultiObjectiveTermination
from pymoo.util.display.multi import MultiObjectiveOutput

from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError
from trajevo.solvers.evolutionary.nsga2_ranking import copies, crowding_distances, fronts, winners
from trajevo.solvers.evolutionary.operators import crossed, mutated

#: Tolerance of equality constraints in pymoo.
_EQUAL = 1e-4
_UNRANKED = -1


@final
@dataclass(frozen=True, eq=False)
class Individuals:
    """N evaluated individuals.

    Attributes:
        X: decision vectors, shape (N, n_var).
        F: objectives, shape (N, n_obj).
        G: inequality constraints, shape (N, n_ieq_constr).
        H: equality constraints, shape (N, n_eq_constr).
        violation: Σ max(G, 0) + Σ max(abs(H) - 1e-4, 0), shape (N,).
        rank: number of the non-dominated front at the last ranking, shape (N,); -1 if never ranked.
        crowding: crowding distance in that front, shape (N,).
        born: generation in which each was created, shape (N,).
        notes: name -> further data about each individual, object arrays of shape (N,).
    """

    X: Array
    F: Array
    G: Array
    H: Array
    violation: Array
    rank: Array
    crowding: Array
    born: Array
    notes: Mapping[str, Array]

    @property
    def feasible(self) -> Array:
        """Whether each individual keeps all constraints, shape (N,)."""
        feasible: Array = self.violation <= 0.0
        return feasible

    @classmethod
    def of_evaluation(cls, X: Array, evaluated: Mapping[str, Any], generation: int) -> Individuals:
        """New individuals from decision vectors, shape (N, n_var), and the results of a pymoo problem."""
        size = len(X)
        F, G, H = (_columns(evaluated.get(name), size) for name in "FGH")
        notes = {name: values for name, values in evaluated.items() if name not in "FGH" and values is not None}
        return cls(X, F, G, H, _violation(G, H), *_unranked(size), np.full(size, generation), notes)

    @classmethod
    def of_population(cls, population: Population) -> Individuals:
        """Arrays of a population of pymoo."""
        size = len(population)
        X, F, G, H = (_columns(population.get(name), size) for name in ("X", "F", "G", "H"))
        rank, crowding = _unranked(size)
        born = np.zeros(size, dtype=np.int64)
        own: dict[str, Array] = {}
        for i, one in enumerate(population):
            for key, value in one.data.items():
                if key == "rank":
                    rank[i] = _UNRANKED if value is None else value
                elif key == "crowding":
                    crowding[i] = np.nan if value is None else value
                elif key == "n_gen":
                    born[i] = value
                elif key != "n_iter":
                    own.setdefault(key, np.full(size, None))[i] = value
        violation = np.concatenate([np.reshape(one.CV, -1) for one in population]) if size else np.empty(0)
        return cls(X, F, G, H, violation, rank, crowding, born, own)

    @classmethod
    def joined(cls, one: Individuals, other: Individuals) -> Individuals:
        """All individuals of both, one after the other."""
        keys = {*one.notes, *other.notes}
        notes = {key: np.concatenate([_noted(rows, key) for rows in (one, other)]) for key in keys}
        arrays = {name: np.concatenate([getattr(one, name), getattr(other, name)]) for name in _ARRAYS}
        return cls(**arrays, notes=notes)

    def chosen(self, indices: Array) -> Individuals:
        """The individuals with the given indices."""
        arrays = {name: getattr(self, name).take(indices, axis=0) for name in _ARRAYS}
        return Individuals(**arrays, notes={key: values[indices] for key, values in self.notes.items()})

    def after(self, count: int) -> Individuals:
        """All individuals except the first ``count``, as views of the same arrays."""
        arrays = {name: getattr(self, name)[count:] for name in _ARRAYS}
        return Individuals(**arrays, notes={key: values[count:] for key, values in self.notes.items()})

    def population(self) -> Population:
        """The individuals as a population of pymoo."""
        return Population([self._individual(i) for i in range(len(self.X))])

    def _individual(self, i: int) -> Individual:
        one = Individual(X=self.X[i].copy(), F=self.F[i].copy(), G=self.G[i].copy(), H=self.H[i].copy())
        one.evaluated.update(("F", "G", "H"))
        one.CV = self.violation[i : i + 1].copy()
        one.data = {"n_gen": int(self.born[i]), "n_iter": int(self.born[i])}
        one.data |= {key: values[i] for key, values in self.notes.items() if values[i] is not None}
        if self.rank[i] != _UNRANKED:
            one.data |= {"rank": int(self.rank[i]), "crowding": float(self.crowding[i])}
        return one


_ARRAYS = tuple(field.name for field in fields(Individuals) if field.name != "notes")


def _columns(values: Any, size: int) -> Array:
    """Values of all individuals, shape (N, columns); no columns if the values are None."""
    if values is None:
        return np.empty((size, 0))
    found: Array = np.asarray(values, dtype=np.float64).reshape(size, -1 if size else 0)
    return found


def _violation(G: Array, H: Array) -> Array:
    # In rows: numpy adds columns in another order than the entries of one row, which pymoo adds.
    violation: Array = np.maximum(0.0, np.ascontiguousarray(G)).sum(axis=1)
    return violation + np.maximum(0.0, np.abs(H) - _EQUAL).sum(axis=1) if H.shape[1] else violation


def _unranked(size: int) -> tuple[Array, Array]:
    return np.full(size, _UNRANKED), np.full(size, np.nan)


def _noted(rows: Individuals, key: str) -> Array:
    found = rows.notes.get(key)
    return np.full(len(rows.X), None) if found is None else np.asarray(found, dtype=object)


#: Parts of pymoo's algorithm that :class:`ArrayNSGA2` replaces.
_OWN = ("selection", "survival", "repair", "eliminate_duplicates", "mating", "advance_after_initial_infill")


@final
class ArrayNSGA2(GeneticAlgorithm):
    """NSGA-II with constrained tournaments, for any problem that pymoo evaluates a whole population at a time.

    It draws the same random numbers in the same order as :class:`pymoo.algorithms.moo.nsga2.NSGA2`, so that the same
    seed gives the same individuals. ``pop``, ``off`` and ``opt`` are created when they are read. It is not derived from
    that class, whose module imports SciPy, which takes as long as a third of a small task's search.

    Args:
        pop_size: number of individuals.
        n_offsprings: new individuals in each generation; as many as the population if None.
        sampling: the first population: a sampling of pymoo, a population, or decision vectors, shape (N, n_var).
        crossover: crossover of two parents into two children; SBX with pymoo's settings if None.
        mutation: mutation; PM with pymoo's settings if None.
        **settings: settings of any algorithm of pymoo (``output``, ``callback``, ``archive``, ...).

    Raises:
        InvalidInputError: a crossover with another number of parents or children, or a part of pymoo's algorithm that
            this class replaces.
    """

    def __init__(
        self,
        pop_size: int = 100,
        n_offsprings: int | None = None,
        sampling: Any = None,
        crossover: Any = None,
        mutation: Any = None,
        **settings: Any,
    ) -> None:
        own = next((name for name in _OWN if name in settings), None)
        if own is not None:
            raise InvalidInputError(f"{own}: expected none, ArrayNSGA2 has its own; pass it to pymoo's NSGA2")
        self._rows: Individuals | None = None
        self._offspring: Individuals | None = None
        self._given: dict[str, Population | None] = {}
        super().__init__(
            pop_size=pop_size,
            n_offsprings=n_offsprings,
            sampling=FloatRandomSampling() if sampling is None else sampling,
            crossover=SBX(eta=15, prob=0.9) if crossover is None else crossover,
            mutation=PM(eta=20) if mutation is None else mutation,
            eliminate_duplicates=_FirstOfCopies(),
            advance_after_initial_infill=True,
            **{"output": MultiObjectiveOutput(), **settings},
        )
        self.termination = DefaultMultiObjectiveTermination()
        kind = self.mating.crossover
        if (kind.n_parents, kind.n_offsprings) != (2, 2):
            raise InvalidInputError(
                f"crossover: expected two parents and two children, got {kind.n_parents} and {kind.n_offsprings}"
            )

    @property
    def pop(self) -> Population | None:
        """The population."""
        return self._made("pop", self._rows)

    @pop.setter
    def pop(self, population: Population | None) -> None:
        self._given["pop"] = population
        self._rows = None

    @property
    def off(self) -> Population | None:
        """The individuals that the last generation evaluated."""
        return self._made("off", self._offspring)

    @off.setter
    def off(self, population: Population | None) -> None:
        self._given["off"] = population
        self._offspring = None

    @property
    def opt(self) -> Population | None:
        """The best front, or the individual with the least violation while none is feasible."""
        if "opt" not in self._given and self._rows is not None:
            rows, pop = self._population(), cast(Population, self.pop)
            self._given["opt"] = pop[rows.rank == 0 if rows.feasible.any() else [int(rows.violation.argmin())]]
        return self._given.get("opt")

    @opt.setter
    def opt(self, population: Population | None) -> None:
        self._given["opt"] = population

    def next(self) -> None:
        """Run one generation."""
        X = self._new() if type(self.evaluator) is Evaluator and self.evaluator.callback is None else None
        if X is None:
            super().next()
            return
        if self.is_initialized and not len(X):
            self.termination.force_termination = True
            self.advance()
            return
        evaluated = self.problem.evaluate(
            X, return_values_of=self.evaluator.evaluate_values_of, return_as_dictionary=True, algorithm=self
        )
        self.evaluator.n_eval += len(X)
        rows = Individuals.of_evaluation(X, evaluated, self.n_iter)
        if self.is_initialized:
            self._advance_by(rows)
        else:
            self._begin_with(rows)
        self._post_advance()
        if self.termination.has_terminated():
            self.finalize()
        kept: Any = vars(self)["archive"]
        if kept is not None:
            self.archive = kept.add(self.off)

    def _new(self) -> Array | None:
        """Decision vectors of the next generation; None if pymoo must create the first population."""
        if self.is_initialized:
            return self._children(self._population())
        sampling: Any = self.initialization.sampling
        if type(sampling) is FloatRandomSampling:
            sampling = sampling._do(self.problem, self.pop_size, random_state=self.random_state)
        if type(sampling) is not np.ndarray:
            return None
        self._initialize()
        X: Array = np.atleast_2d(np.array(sampling, dtype=np.float64))
        return X[~copies(X)]

    def _infill(self) -> Population | None:
        X = self._children(self._population())
        if len(X):
            return Population.new(X=X)
        self.termination.force_termination = True
        return None

    def _initialize_advance(self, infills: Population | None = None, **kwargs: Any) -> None:
        self._begin_with(self._population())

    def _begin_with(self, rows: Individuals) -> None:
        self.is_initialized: bool = True
        self._survive(rows, len(rows.X))
        self._remember(rows)

    def _advance(self, infills: Population | None = None, **kwargs: Any) -> None:
        if infills is None:
            self._survive(self._population())
        else:
            self._advance_by(Individuals.of_population(infills))

    def _advance_by(self, offspring: Individuals) -> None:
        rows = self._population()
        both = Individuals.joined(rows, offspring)
        self._survive(both)
        self._remember(both.after(len(rows.X)))

    def _remember(self, offspring: Individuals) -> None:
        """Keep the latest individuals, which have been ranked."""
        self._given.pop("off", None)
        self._offspring = offspring

    def _set_optimum(self, **kwargs: Any) -> None:
        self._given.pop("opt", None)

    def _made(self, name: str, rows: Individuals | None) -> Population | None:
        if name not in self._given and rows is not None:
            self._given[name] = rows.population()
        return self._given.get(name)

    def _population(self) -> Individuals:
        """The population as arrays; pymoo's individuals are read again if they exist, as they may have changed."""
        handed_out = self._given.get("pop")
        if handed_out is not None:
            self._rows = Individuals.of_population(handed_out)
        if self._rows is None:
            raise InvalidInputError("algorithm: expected a population, the algorithm has none")
        return self._rows

    def _children(self, rows: Individuals) -> Array:
        """``n_offsprings`` new decision vectors, or fewer if a hundred rounds of mating give too many duplicates."""
        kept: Array = np.empty((0, self.problem.n_var))
        for _ in range(self.mating.n_max_iterations):
            wanted = self.n_offsprings - len(kept)
            X = self._mated(rows, wanted)
            X = X[~copies(X, rows.X, kept)]
            kept = np.concatenate([kept, X[:wanted]])
            if len(kept) == self.n_offsprings:
                break
        return kept

    def _mated(self, rows: Individuals, wanted: int) -> Array:
        """Children of parents that have won tournaments, at least ``wanted``."""
        random, size, matings = self.random_state, len(rows.X), math.ceil(wanted / 2)
        rounds = math.ceil(4 * matings / size)
        contests = np.concatenate([random.permutation(size) for _ in range(rounds)])[: 4 * matings].reshape(-1, 2)
        parents = winners(contests, rows.violation, rows.F, rows.crowding, random).reshape(-1, 2).T
        children = crossed(self.mating.crossover, self.problem, rows.X.take(parents, axis=0), random)
        return mutated(self.mating.mutation, self.problem, children.reshape(-1, rows.X.shape[1]), random)

    def _survive(self, rows: Individuals, most: int | None = None) -> None:
        """Keep the best individuals: feasible ones by rank and crowding, then those with the least violation."""
        most = min(self.pop_size if most is None else most, len(rows.X))
        constrained = self.problem.has_constraints()
        feasible = np.flatnonzero(rows.feasible) if constrained else np.arange(len(rows.X))
        survivors = self._best(rows, feasible, min(most, len(feasible)))
        if constrained and len(survivors) < most:
            infeasible = np.flatnonzero(~rows.feasible)
            order = infeasible[np.argsort(rows.violation[infeasible])]
            survivors = np.concatenate([survivors, order[: most - len(survivors)]])
        self._rows = rows.chosen(survivors)
        self._given.pop("pop", None)

    def _best(self, rows: Individuals, among: Array, most: int) -> Array:
        F, survivors, left = rows.F[among], [np.empty(0, dtype=np.intp)], most
        for rank, front in enumerate(fronts(F, most)):
            crowding = crowding_distances(F[front])
            members = among[front]
            rows.rank[members], rows.crowding[members] = rank, crowding
            if len(front) > left:
                # Shuffled before they are sorted, so that ties are broken at random.
                shuffled = self.random_state.permutation(len(front))
                members = members[shuffled[crowding[shuffled].argsort()][::-1][:left]]
            survivors.append(members)
            left -= len(members)
        return np.concatenate(survivors)


@final
class _FirstOfCopies(DuplicateElimination):
    """pymoo's elimination of duplicates from a first population, without computing the distances of all pairs."""

    def _do(self, pop: Population, other: Population | None, is_duplicate: Array) -> Array:
        is_duplicate |= copies(pop.get("X"), *([] if other is None else [other.get("X")]))
        return is_duplicate
