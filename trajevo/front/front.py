"""Fronts, which are the non-dominated feasible points of a run."""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.base.files import MOST_DATA, named_file, why_not, write_whole
from trajevo.base.shown.brief import cut
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError, NoSolutionError, TrajevoError, UnknownNameError
from trajevo.formulation.problem import TrajectoryProblem, Weights
from trajevo.formulation.registry import problem_class
from trajevo.front import selection
from trajevo.front.checked import RecordCheck
from trajevo.front.exchange_rates import ExchangeRates, exchange_rates
from trajevo.front.notebook import front_frame, front_html
from trajevo.front.quantities import with_unit
from trajevo.front.records import Blocking, FrontFile, History, ProblemRecord, Run, read_front
from trajevo.front.selection import Choice, by_hand, rows_of
from trajevo.front.solution import Solution as Solution
from trajevo.front.thinning import MOST_SHOWN, thinned
from trajevo.front.weighing.stability import WeightRule, WeightStability, stability
from trajevo.front.weighing.weights import GivenWeights, in_order

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False)
class Front:
    """Non-dominated feasible points, sorted by the first objective; equal when everything that is stored is equal.

    Attributes:
        X: decision vectors, shape (N, n_var), units in ``record.variables``.
        F: objective values, shape (N, n_obj), SI, units in ``record.objectives``.
        G: constraint values, shape (N, n_constr), at most 0, as a share of the limit.
        record: record of the problem.
        run: record of the run: algorithm, settings, seed, versions, wall time.
        history: hypervolume and least violation by generation.
        blocking: why the front is empty, or None.
    """

    X: Array
    F: Array
    G: Array
    record: ProblemRecord
    run: Run
    history: History
    blocking: Blocking | None
    _problem: TrajectoryProblem | None = field(default=None, kw_only=True, repr=False)
    _check: RecordCheck | None = field(default=None, init=False, repr=False)

    def __post_init__(self) -> None:
        sizes = (len(self.record.variables), len(self.record.objectives), len(self.record.constraints))
        order = np.lexsort(np.asarray(self.F).T[::-1]) if len(self.F) else np.arange(0)
        in_order = bool((order == np.arange(len(order))).all())
        for name, size in zip("XFG", sizes, strict=True):
            values = np.asarray(getattr(self, name), dtype=np.float64).reshape(len(self.F), -1 if len(self.F) else size)
            if values.shape[1] != size:
                raise InvalidInputError(f"front: expected {size} columns in {name}, got {values.shape[1]}")
            # What is in order and cannot change is not copied: the largest fronts are half of a run's memory.
            own = not values.flags.writeable and in_order
            object.__setattr__(self, name, values if own else frozen(values.take(order, axis=0)))

    def __len__(self) -> int:
        return len(self.F)

    @overload
    def __getitem__(self, row: int | np.integer[Any]) -> Solution: ...
    @overload
    def __getitem__(self, row: slice | Sequence[int] | Array) -> Front: ...
    def __getitem__(self, row: int | np.integer[Any] | slice | Sequence[int] | Array) -> Solution | Front:
        """``front[0]`` is a solution, ``front[2:5]`` a front of these rows.

        Args:
            row: a row, negative ones from the end; or a slice, several rows, or a mask of shape (N,), for the front of
                these rows, with the same record, run and history. It is sorted as every front is, and holds each row
                once.

        Raises:
            NoSuchRowError: no such row.
            InvalidInputError: neither rows nor a mask of as many entries as there are solutions.
        """
        found = rows_of(row, len(self))
        if isinstance(found, int):
            return self._solution(by_hand(found))
        self._compare(found.tolist())
        problem = self.__dict__.get("_made", self._problem)
        return replace(self, X=self.X[found], F=self.F[found], G=self.G[found], _problem=problem)

    def __iter__(self) -> Iterator[Solution]:
        self._compare(range(len(self)))
        return (self[row] for row in range(len(self)))

    def __repr__(self) -> str:
        return cut(str(self))

    def _repr_html_(self) -> str:
        return front_html(self)

    def to_dataframe(self) -> pd.DataFrame:
        """One row per solution: objectives, variables, the share of each limit that is used, and rules that choose it.

        Headers have the units: those in which the problem shows angles and lengths, where :attr:`F`, :attr:`X` and
        :attr:`G` are in SI.
        """
        return front_frame(self)

    def __str__(self) -> str:
        if not len(self):
            return f"Front({self.record.title}, empty)"
        ends = zip(self.record.objectives, self.F.min(axis=0), self.F.max(axis=0), strict=True)
        ranges = (f"{one.name} {with_unit(f'{low:.5g} to {high:.5g}', one.unit)}" for one, low, high in ends)
        return f"Front({self.record.title}, {len(self)} solutions: {', '.join(ranges)})"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Front) and self._file() == other._file()

    __hash__ = None  # type: ignore[assignment]

    @property
    def objective_names(self) -> tuple[str, ...]:
        """Names of the columns of F."""
        return tuple(objective.name for objective in self.record.objectives)

    def known_to(self, rows: Sequence[int]) -> Array:
        """How far objectives are known: how much they change when segments have twice as many samples.

        Args:
            rows: R rows of the front.

        Returns:
            Shape (R, n_obj), SI, units in ``record.objectives``.
        """
        problem = self.problem
        rollout = problem.rollout(self.X[list(rows)])
        finer = replace(rollout, dynamics=rollout.dynamics.sampled(2 * rollout.dynamics.samples))
        changes = [np.abs(one.function(finer) - one.function(rollout)) for one in problem.objectives]
        return np.stack(changes, axis=1)

    @cached_property
    def problem(self) -> TrajectoryProblem:
        """The problem, made or checked once; a front read from a file makes its registered problem again.

        A few rows of a front that was read are compared with what the problem computes for their decision vectors.

        Raises:
            InvalidInputError: the problem is not registered and was not passed to :meth:`load`, a different problem was
                passed, or a number of the file is not that of its decision vector.
        """
        if self._check is not None:
            self._check.compare(self._made, self._shown_first)
        return self._made

    @cached_property
    def _shown_first(self) -> tuple[int, ...]:
        """Rows of a front that was read which are compared together: some of all, and those worth choosing."""
        few = () if self._check is None else self._check.few
        return (*few, *(choice.index for choice in self.best)) if len(self) else ()

    @cached_property
    def _made(self) -> TrajectoryProblem:
        problem = self._problem
        if problem is None:
            problem = self.record.make()
        difference = self.record.difference(problem)
        if difference:
            raise InvalidInputError(
                f"front: the problem at hand differs from the one that made this front: {difference}"
            )
        return problem

    @cached_property
    def rollouts(self) -> Rollout:
        """The robot on the trajectories of all solutions, row by row; made once."""
        self._compare(range(len(self)))
        return self.problem.rollout(self.X)

    def rollouts_of(self, rows: Array) -> Rollout:
        """The robot on the trajectories of some solutions, numbers of rows, shape (R,), as those of :meth:`thinned`."""
        if len(rows) == len(self):
            return self.rollouts
        self._compare(rows.tolist())
        return self.problem.rollout(self.X[rows])

    @cached_property
    def digest(self) -> str:
        """Identifier of this front: SHA-256 of the problem's record and of all numbers of the solutions."""
        content = hashlib.sha256(self.record.model_dump_json().encode())
        for values in (self.X, self.F, self.G):
            content.update(np.ascontiguousarray(values).tobytes())
        return content.hexdigest()

    @property
    def paper_weights(self) -> Weights | None:
        """Weights of the paper's weighted sum over these objectives; None if the problem has none."""
        if self._problem is None and not self.record.name:
            return None
        weights = (self._problem or problem_class(self.record.name)).paper_weights
        return weights if weights is not None and len(weights.weights) == len(self.record.objectives) else None

    def knee(self) -> Solution:
        """The point that bulges furthest towards the ideal, see :func:`trajevo.front.selection.knee`."""
        return self._solution(selection.knee(self._points()))

    def utopia(self) -> Solution:
        """The point nearest to the best values, see :func:`trajevo.front.selection.nearest_to_utopia`."""
        return self._solution(selection.nearest_to_utopia(self._points()))

    def weighted(self, weights: GivenWeights | None = None) -> Solution:
        """The least weighted sum, see :func:`trajevo.front.selection.weighted`; with the paper's weights if None.

        Raises:
            InvalidInputError: weights that cannot be used, or no weights although the problem's paper has none.
        """
        return self._solution(selection.weighted(self._points(), self._weights(weights)))

    def pseudo_weights(self, weights: GivenWeights) -> Solution:
        """The point whose pseudo-weights fit, see :func:`trajevo.front.selection.pseudo_weights`."""
        return self._solution(selection.pseudo_weights(self._points(), self._weights(weights)))

    def topsis(self, weights: GivenWeights | None = None) -> Solution:
        """The point near the best and far from the worst values, see :func:`trajevo.front.selection.topsis`."""
        return self._solution(selection.topsis(self._points(), self._weights(weights)))

    def stability(self, weights: GivenWeights | None = None, *, rule: WeightRule = "weighted") -> WeightStability:
        """Which share of all weights makes the same choice; see :func:`trajevo.front.weighing.stability.stability`.

        Args:
            weights: as for :meth:`weighted`.
            rule: ``"weighted"`` or ``"topsis"``.
        """
        return stability(self._points(), self._weights(weights), rule=rule)

    def least(self, objective: str) -> Solution:
        """The point with the least value of a named objective."""
        if objective not in self.objective_names:
            raise UnknownNameError("objective", objective, self.objective_names)
        return self._solution(selection.least(self._points(), self.objective_names.index(objective), objective))

    def pick(self, rule: str | int) -> Solution:
        """A solution by ``knee``, ``utopia``, ``weighted``, ``topsis`` (the paper's), ``least_<objective>`` or a row.

        Raises:
            UnknownNameError: no such rule.
            NoSolutionError: the front is empty.
        """
        return self._solution(self._choice(str(rule)))

    def choices(self) -> tuple[Solution, ...]:
        """The solutions worth comparing: knee, utopia, the paper's weighted best, and the least of each objective.

        Raises:
            NoSolutionError: the front is empty.
        """
        return tuple(map(self._solution, self.best))

    def sensitivities(self, objective: str | None = None, *, most: int = 24) -> tuple[ExchangeRates, ...]:
        """What holds an objective back along the front.

        Args:
            objective: name of the objective that should fall; the first one if None.
            most: greatest number of solutions, spread evenly over the front, with its choices and extremes.

        Returns:
            Rates of exchange by ascending value of the objective.

        Raises:
            UnknownNameError: no such objective.
        """
        rates = exchange_rates(self, self.thinned(most).tolist(), objective)
        return tuple(sorted(rates, key=lambda each: each.value))

    def thinned(self, most: int = MOST_SHOWN) -> Array:
        """Rows that are spread evenly over a large front, with all its choices and the extremes of its objectives.

        Args:
            most: greatest number of rows; a front with fewer has all of them.

        Returns:
            Ascending numbers of rows, shape (R,).
        """
        return self._standing if most == MOST_SHOWN else self._thinned(most)

    @cached_property
    def _standing(self) -> Array:
        rows = self._thinned(MOST_SHOWN)
        rows.setflags(write=False)
        return rows

    def _thinned(self, most: int) -> Array:
        return thinned(self._points(), most, kept=(choice.index for choice in self.best))

    @cached_property
    def best(self) -> tuple[Choice, ...]:
        """The rows of :meth:`choices`, without their solutions."""
        weighted = () if self.paper_weights is None else ("weighted",)
        rules = ("knee", "utopia", *weighted, *(f"least_{name}" for name in self.objective_names))
        return tuple(map(self._choice, rules))

    def _choice(self, rule: str) -> Choice:
        points, weights = self._points(), self.paper_weights
        named: dict[str, Callable[[], Choice]] = {
            "knee": lambda: selection.knee(points),
            "utopia": lambda: selection.nearest_to_utopia(points),
        }
        if weights is not None:
            named["weighted"] = lambda: selection.weighted(points, weights)
            named["topsis"] = lambda: selection.topsis(points, weights)
        for k, name in enumerate(self.objective_names):
            named[f"least_{name}"] = partial(selection.least, points, k, name)
        if rule in named:
            return named[rule]()
        if rule.isascii() and rule.isdecimal() and int(rule) < len(points):
            return by_hand(int(rule))
        raise UnknownNameError("solution", rule, [*named, f"a row from 0 to {len(self) - 1}"])

    def gap(self, *, gap: float = 0.01, cpu_time: float = 600.0, file: str | Path | None = None) -> Any:
        """What no motion of this kind can be better than, as a :class:`~trajevo.FrontBound`, and what the front misses.

        Args:
            gap: share of the hypervolume's box at which the search ends.
            cpu_time: CPU time after which it ends [s].
            file: where the search is kept; one of this front goes on from there.

        Raises:
            InvalidInputError: as :func:`trajevo.bound_front`.
        """
        proofs = import_module("trajevo.verification.bound_front")
        return proofs.bound_front(self, gap=gap, cpu_time=cpu_time, file=file)

    def open(self, file: str | Path | None = None) -> Path:
        """Write the page of the front and open it in a browser, see :func:`trajevo.report`.

        Args:
            file: HTML to write; in a folder of its own among the system's temporary files if None.

        Returns:
            The page's path.

        Raises:
            InvalidInputError: the file cannot be written.
        """
        # The page stands above the front, which does not know it until somebody asks.
        shown: Path = import_module("trajevo.page.opening").open_page(self, file)
        return shown

    def widget(self, *, height: int = 900) -> Any:
        """The page of the front in a notebook; see :func:`trajevo.page.widget.front_widget`.

        Args:
            height: height of the widget [pixel].

        Raises:
            NoSolutionError: the front is empty.
            InvalidInputError: anywidget is not installed.
        """
        return import_module("trajevo.page.widget").front_widget(self, height=height)

    def save(self, file: str | Path) -> None:
        """Write everything to one self-describing JSON file; if writing is interrupted, the old file stays unchanged.

        Raises:
            InvalidInputError: the file cannot be written.
        """
        target, content = named_file(file), self._file().model_dump_json(indent=1).encode()
        if len(content) > MOST_DATA:
            more = f"{len(content) / 2**20:.0f} MiB, more than the {MOST_DATA / 2**20:g} MiB that are read back"
            warnings.warn(f"{file}: takes {more}; front.thinned() gives fewer solutions", stacklevel=2)
        try:
            write_whole(target, content)
        except OSError as error:
            raise InvalidInputError(f"{file}: cannot be written: {why_not(error)}") from error

    @classmethod
    def load(cls, file: str | Path, *, problem: TrajectoryProblem | None = None) -> Front:
        """Read a front back; the file is enough for its numbers and choices.

        A solution that is chosen, and some others, are compared with what the problem computes for their decision
        vectors; where the problem cannot be made, a warning says that this was not done.

        Args:
            file: file written by :meth:`save`.
            problem: the problem, if it is not a registered one.

        Raises:
            InvalidInputError: the file is missing or is not a front; the message names the entry.
        """
        content = read_front(named_file(file))
        front = cls(
            X=np.array(content.X),
            F=np.array(content.F),
            G=np.array(content.G),
            record=content.problem,
            run=content.run,
            history=content.history,
            blocking=content.blocking,
            _problem=problem,
        )
        object.__setattr__(
            front, "_check", RecordCheck(named_file(file), front.X, front.F, front.G, content.run.versions)
        )
        return front

    def _file(self) -> FrontFile:
        X, F, G = (tuple(map(tuple, values.tolist())) for values in (self.X, self.F, self.G))
        return FrontFile(problem=self.record, run=self.run, history=self.history, blocking=self.blocking, X=X, F=F, G=G)

    def _points(self) -> Array:
        if not len(self.F):
            raise NoSolutionError(f"the front is empty: {self.blocking or 'none of its rows was taken'}")
        return self.F

    def _weights(self, given: GivenWeights | None) -> Sequence[float] | Weights:
        """Weights in the order of the objectives; the paper's if None."""
        found = self.paper_weights if given is None else in_order(given, self.objective_names)
        if found is None:
            each = ", ".join(self.objective_names)
            raise InvalidInputError(f"weights: expected one for each of {each}; the problem's paper gives none")
        return found

    def _compare(self, rows: Iterable[int]) -> None:
        """Compare rows of a front that was read with what their decision vectors give, if its problem can be made."""
        if self._check is None or not self._check.unseen(rows):
            return
        try:
            problem = self._made
        except TrajevoError as error:
            self._check.leave(error)
            return
        self._check.compare(problem, {*rows, *self._shown_first})

    def _solution(self, choice: Choice) -> Solution:
        self._compare([choice.index])
        return Solution(self, choice.index, choice.rule, choice.reason)
