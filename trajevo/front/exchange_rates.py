"""What holds a solution back, and what a little more of it would buy: multipliers as exchange rates.

At a solution that is optimal among its neighbours, the slopes of its objectives and of the limits on which it lies
balance. The weights of this balance, the multipliers of Karush, Kuhn and Tucker, are rates of exchange: by how much an
objective falls if a limit is relaxed or another objective may be larger (Nocedal and Wright 2006, section 12.8). They
are found by non-negative least squares; what does not balance tells how far from optimal the solution is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, final

import numpy as np

from trajevo.base.arrays import Array, real_number
from trajevo.base.shown.brief import brief
from trajevo.base.solving.least_squares import non_negative
from trajevo.errors import InvalidInputError, checked_name
from trajevo.front.quantities import with_unit

if TYPE_CHECKING:
    from trajevo.formulation.problem import TrajectoryProblem
    from trajevo.front.front import Front

#: What can be exchanged for an objective.
Kind = Literal["limit", "objective", "variable"]

#: How far below a limit, as a share of it, a solution may stay and yet count as being on it: gradient solvers stop a
#: little before. The same for a variable, as a share of its range.
ON_LIMIT, _ON_BOUND = 1e-3, 1e-6

#: Share of the greatest gain below which none is told, and least value of another objective that has shares.
_TOLD, _LEAST = 1e-3, 1e-12

#: How often each column may be set free in the search for a balance.
_MOST = 30

#: How many of the exchanges are told in one line, and the imbalance above which that is told with them.
_BEST, _UNBALANCED = 2, 0.1


@final
@dataclass(frozen=True)
class Exchange:
    """Something on which a solution lies.

    Attributes:
        name: name of the limit, of the other objective or of the variable.
        kind: ``"limit"``, ``"objective"`` or ``"variable"``.
        gain: by how much the objective falls for each unit of relaxation, to first order: for a limit and another
            objective per share of it that it is raised (of a least distance, lowered), for a variable per share of its
            range [unit of the objective].
        segments: numbers of the segments in which the limit is touched, as far as its terms tell; else empty.
    """

    name: str
    kind: Kind
    gain: float
    segments: tuple[int, ...] = ()


@final
@dataclass(frozen=True)
class ExchangeRates:
    """What holds an objective of a solution back, and what it would cost.

    Attributes:
        row: number of the solution on its front.
        objective: name of the objective.
        value: its value [unit].
        unit: its SI unit.
        imbalance: share of the objective's slope that nothing balances: 0 at an optimum, 1 where the objective can be
            lowered freely. The gains are as good as this is small.
        exchanges: what the solution lies on, the greatest gain first.
    """

    row: int
    objective: str
    value: float
    unit: str
    imbalance: float
    exchanges: tuple[Exchange, ...]

    __repr__ = brief

    def buys(self, share: float = 0.05) -> dict[str, float]:
        """By how much the objective falls if one thing alone is relaxed by a share, to first order.

        Args:
            share: share by which a limit or another objective is relaxed, 0.05 for 5 %.

        Returns:
            Name -> decrease of the objective [unit], of limits and objectives, the greatest first.

        Raises:
            InvalidInputError: a share that is not above 0 and at most 1.
        """
        checked = real_number(share)
        if checked is None or not 0.0 < checked <= 1.0:
            likely = f"; {0.01 * checked:g} if it is percent" if checked is not None and 1.0 < checked <= 100.0 else ""
            raise InvalidInputError(f"share: expected a number above 0 and at most 1, got {share!r}{likely}")
        return {each.name: checked * each.gain for each in self.exchanges if each.kind != "variable"}

    def table(self, share: float = 0.05) -> list[tuple[str, str, str]]:
        """What is relaxed, the segments in which it is touched, and by how much the objective changes, as texts.

        Args:
            share: share by which a limit or another objective is relaxed.

        Raises:
            InvalidInputError: as :meth:`buys`.
        """
        bought = self.buys(share)
        return [
            (each.name, ", ".join(map(str, each.segments)), with_unit(f"-{bought[each.name]:.3g}", self.unit))
            for each in self.exchanges
            if each.kind != "variable"
        ]

    @property
    def ends(self) -> tuple[str, ...]:
        """Variables at an end of their range that hold the objective back."""
        return tuple(each.name for each in self.exchanges if each.kind == "variable")

    @property
    def told(self) -> str:
        """The objective, its value, and how near the solution is to an optimum."""
        head = f"{self.objective} {with_unit(f'{self.value:.5g}', self.unit)} of row {self.row}"
        return f"{head}, optimal to first order but for {100.0 * self.imbalance:.2g} % of its slope"

    @property
    def short(self) -> str:
        """What buys most of the objective, in one line."""
        rows = [f"{name} relaxed by 5 % buys {change[1:]}" for name, _, change in self.table()[:_BEST]]
        held = rows or [f"{', '.join(self.ends)} at an end of its range" if self.ends else "held by nothing"]
        doubt = f", but for {100.0 * self.imbalance:.2g} % of its slope" if self.imbalance > _UNBALANCED else ""
        return f"{self.objective}: {'; '.join(held)}{doubt}"

    def __str__(self) -> str:
        lines = [self.told]
        for name, gain in self.buys().items():
            lines.append(f"  {name} relaxed by 5 % buys {with_unit(f'{gain:.3g}', self.unit)}")
        if self.ends:
            lines.append(f"  at an end of its range: {', '.join(self.ends)}")
        return "\n".join(lines)


def exchange_rates(
    front: Front, rows: Sequence[int], objective: str | None = None, *, within: float = ON_LIMIT
) -> tuple[ExchangeRates, ...]:
    """What holds an objective of some solutions of a front back, in one batch of gradients.

    Args:
        front: the front.
        rows: numbers of the solutions.
        objective: name of the objective that should fall; the first one if None.
        within: share of a limit below it that counts as being on it.

    Returns:
        For each solution the rates of exchange with all limits on which it lies, with the other objectives unless no
        solution of the front has less of this one, and the variables at an end of their range.

    Raises:
        UnknownNameError: no such objective.
        InvalidInputError: ``within`` is not a number from 0 to 1.
    """
    names = list(front.objective_names)
    wanted = names.index(checked_name("objective", names[0] if objective is None else objective, names))
    near = real_number(within)
    if near is None or not 0.0 <= near <= 1.0:
        raise InvalidInputError(f"within: expected a share from 0 to 1, got {within!r}")
    limits, slopes = _slopes(front, list(rows))
    return tuple(_rates(front, row, wanted, near, limits, *each) for row, each in zip(rows, slopes, strict=True))


def exchange_rates_of_all(front: Front, row: int) -> tuple[ExchangeRates, ...]:
    """What holds each objective of one solution back, by its gradients evaluated once."""
    limits, slopes = _slopes(front, [row])
    return tuple(_rates(front, row, wanted, ON_LIMIT, limits, *slopes[0]) for wanted in range(front.F.shape[1]))


def _slopes(front: Front, rows: list[int]) -> tuple[_Limits, list[tuple[Array, Array, Array]]]:
    """The limits in terms; and for each solution slopes of objectives, values and slopes of these terms."""
    limits = _Limits.of(front.problem)
    _, of_objectives, G, of_limits = limits.in_terms.evaluate_with_gradients(front.X[rows])
    return limits, list(zip(of_objectives, G, of_limits, strict=True))


def _rates(
    front: Front, row: int, wanted: int, near: float, limits: _Limits, of_objectives: Array, G: Array, of_limits: Array
) -> ExchangeRates:
    """The rates of one solution, from slopes of objectives and limits, (n_obj, n_var) and (terms, n_var)."""
    problem, values, x = front.problem, front.F[row], front.X[row]
    width = problem.xu - problem.xl
    balance = _Balance(of_objectives[wanted] * width)
    held = front.F[:, wanted].min() < values[wanted]  # the least of all is not held by other objectives
    for other, name in enumerate(front.objective_names):
        if held and other != wanted:
            balance.add(name, "objective", of_objectives[other] * width / max(abs(values[other]), _LEAST))
    for term in np.flatnonzero(-near < G).tolist():
        balance.add(limits.names[term], "limit", of_limits[term] * width, limits.segments[term])
    shares = (x - problem.xl) / np.where(width > 0.0, width, 1.0)
    for place, variable in enumerate(problem.variables):
        for end, side in ((0.0, -1.0), (1.0, 1.0)):
            if width[place] > 0.0 and abs(shares[place] - end) <= _ON_BOUND:
                balance.add(variable.name, "variable", side * np.eye(len(width))[place])
    exchanges, imbalance = balance.solved()
    name = front.objective_names[wanted]
    return ExchangeRates(row, name, float(values[wanted]), front.record.objectives[wanted].unit, imbalance, exchanges)


@final
@dataclass(frozen=True, eq=False)
class _Limits:
    """The limits of a problem in terms.

    Attributes:
        in_terms: the problem with a column for each term.
        names: the limit to which each term belongs.
        segments: the segment of each term, None where terms are not in the order of the segments.
    """

    in_terms: TrajectoryProblem
    names: list[str]
    segments: list[int | None]

    @classmethod
    def of(cls, problem: TrajectoryProblem) -> _Limits:
        in_terms = problem.in_terms()
        count = problem.decode(0.5 * (problem.xl + problem.xu)[None]).breaks.shape[1] - 1
        names: list[str] = []
        segments: list[int | None] = []
        for own, each in zip(problem.constraints, in_terms.constraints, strict=True):
            terms = range(len(each.names))
            names += [own.names[own.column_of_term(term)] for term in terms]
            rows, rest = divmod(len(terms), max(own.term_period, 1))
            told = own.terms is not None and not rest and not rows % count
            segments += [term // own.term_period // (rows // count) if told else None for term in terms]
        return cls(in_terms, names, segments)


@final
class _Balance:
    """What balances the slope of an objective, shape (n_var,), per share of the variables' ranges."""

    def __init__(self, slope: Array) -> None:
        self._slope, self._columns = slope, list[tuple[str, Kind, int | None, Array]]()

    def add(self, name: str, kind: Kind, slope: Array, segment: int | None = None) -> None:
        """Take in something whose relaxation by a share has this slope; without one it has no influence."""
        if np.linalg.norm(slope) > 0.0:
            self._columns.append((name, kind, segment, slope))

    def solved(self) -> tuple[tuple[Exchange, ...], float]:
        """The exchange rates, the greatest first, and the share of the slope that is not balanced."""
        size = float(np.linalg.norm(self._slope))
        if not self._columns or not size:
            return (), float(size > 0.0)
        sizes = np.array([np.linalg.norm(slope) for *_, slope in self._columns])
        matrix = np.stack([slope for *_, slope in self._columns], axis=1) / sizes
        wanted = -self._slope / size
        weights = non_negative(matrix, wanted, _MOST * matrix.shape[1])
        left = np.linalg.norm(matrix @ weights - wanted)
        gains = size * weights / sizes
        found: dict[tuple[str, Kind], tuple[float, set[int]]] = {}
        for (name, kind, segment, _), gain in zip(self._columns, gains.tolist(), strict=True):
            total, where = found.setdefault((name, kind), (0.0, set()))
            if gain > 0.0 and segment is not None:
                where.add(segment)
            found[name, kind] = total + gain, where
        listed = [Exchange(*key, gain, tuple(sorted(where))) for key, (gain, where) in found.items()]
        told = [each for each in listed if each.gain > _TOLD * max(gains.max(initial=0.0), _LEAST)]
        return tuple(sorted(told, key=lambda each: -each.gain)), float(left)
