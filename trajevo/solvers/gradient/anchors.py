"""Anchors: the least of one objective or weighted sum, sought from many starts where one is not enough.

Under limits of effort a motion whose points may move has many local optima, and a search from the fastest evolved
member ends in a poor one, or fails. So many starts take bold steps together (:class:`Lockstep`), the worse half of them
is given up twice, the best are kicked out of their valleys, and SLSQP ends them. Limits that are proven between
samples are kept at the samples until then, and exchanged at the end (:mod:`trajevo.solvers.gradient.exchange`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.sampling import sobol
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.solvers.gradient.batch_sqp import Lockstep
from trajevo.solvers.gradient.exchange import at_samples, exchanged, proves, slower, stretching_times
from trajevo.solvers.gradient.passings import Passings
from trajevo.solvers.gradient.scaling import Columns, Scaled
from trajevo.solvers.gradient.sqp import MARGIN, OutOfEvaluations, WeightedSum, greatest_excess, with_objectives

#: Points that SLSQP evaluates for an anchor and variable, and its tolerance on the logarithm of the value.
_MOST, _TOLERANCE = 40, 1e-6

#: Factor of all times from one slower copy of an anchor to the next, and number of copies.
_SLOWER, _COPIES = 1.07, 16

#: Starts of a search: anywhere on the scales of the variables, anywhere between the bounds but nearer to the middle of
#: those that are no times, and members of the front.
_ANYWHERE, _NEARER, _FROM_FRONT = 8, 4, 3

#: Rise of the time's logarithm that mends an excess over a limit, as a share of it: efforts fall with the square of the
#: time. On the way members are compared by what they would come to; a heavy penalty would compare their excesses.
_PRICE = 0.5

#: Shares of the starts that take steps, and how many steps, one after another; promised decrease that ends them.
_STAGES, _SETTLED = ((1.0, 20), (0.5, 30), (0.25, 40)), 1e-6

#: Times that the best are kicked at most, and in vain; fall of the merit that is none.
_KICKS, _IN_VAIN, _GAIN = 8, 4, 1e-4

#: Copies of those that are kicked, the best first, their least distance on the scales of the variables, and how many
#: are looked at.
_COPIES_KICKED, _APART, _MOST_VALLEYS = (6, 4, 3, 3), 0.3, 8

#: Valleys that are told, the best among them.
_TOLD_VALLEYS = 12

#: Stages of what was kicked; where no point is put elsewhere, spread of all variables on their scales, and how many are
#: drawn anew at most.
_KICKED_STAGES, _SHAKEN, _DRAWN_ANEW = ((1.0, 12), (0.5, 20), (0.25, 40)), 0.05, 3

#: Valleys from which SLSQP is started in turn, until it ends where the steps did; what a proof may cost.
_ENDED, _PROVEN = 3, 1e-2

#: Margins of limits, of which the next is tried where SLSQP ends beyond a limit by rounding.
_ENDED_MARGINS = (MARGIN, 100.0 * MARGIN)

#: Margin by which limits are tightened on the way, and restarts of every member.
_MARGIN, _RESTARTS = 1e-7, 4

#: Difference of logarithms of values that count as the same optimum.
_SAME = 1e-3


@final
@dataclass(frozen=True, eq=False)
class Found:
    """What a search for an anchor came to.

    Attributes:
        x: the best decision vector within all limits, shape (n_var,), or None.
        starts: number of starts.
        agreeing: how many of them ended at most a thousandth above the best.
        gradients: points at which gradients were evaluated.
        evaluations: points that were evaluated without gradients.
        valleys: ends in other valleys than the best, shape (V, n_var), which may exceed limits a little: slower, one of
            them may be best in another objective.
    """

    x: Array | None
    starts: int
    agreeing: int
    gradients: int
    evaluations: int
    valleys: Array


def many_valleys(problem: TrajectoryProblem, x: Array) -> bool:
    """Whether a fast decision vector (n_var,) is likely to lie in one of many valleys.

    Its points may move, and of all limits it comes nearest to those of effort. Where speeds, accelerations or jerks
    bind, the least time of a path has one valley.
    """
    if all(variable.unit in ("s", "kg", "1") for variable in problem.variables):
        return False
    G = problem.evaluate(x[None], return_values_of=["F", "G"])[1][0]
    ends = np.cumsum([len(constraint.names) for constraint in problem.constraints])
    shares = [share.max(initial=-np.inf) for share in np.split(G, ends[:-1])]
    efforts = [share for share, limit in zip(shares, problem.constraints, strict=True) if limit.quantity == "effort"]
    return bool(efforts) and max(efforts) == max(shares)


@final
class AnchorSearch:
    """A search for the least of a weighted sum.

    Args:
        problem: what to solve, with its limits as they are.
        weights: weights of the objectives, shape (n_obj,).
        seed: seed of starts and kicks.
        stop: called before every step with the number of gradients and of other evaluations so far; the search ends if
            it returns True.
        early: called with the end of the best start before anything is kicked, shape (n_var,): often it is the least
            already, and to look for a better one takes most of the time. Before that it is called with what leads
            there, slowed down until it keeps the limits. If None, nothing is ended for it.
    """

    def __init__(
        self,
        problem: TrajectoryProblem,
        weights: Array,
        seed: int,
        stop: Callable[[int, int], bool],
        *,
        early: Callable[[Array], object] | None = None,
    ) -> None:
        self._problem, self._weights, self._early = problem, weights, early
        self._random = np.random.default_rng(seed)
        self._stop, self._gradients = stop, 0
        played = weights != 0.0
        self._at_samples = with_objectives(at_samples(problem), played)
        columns = Columns(weights[played][None], np.full(1, True), np.zeros(1), np.ones(1))
        self._scaled = Scaled(self._at_samples.in_terms(), columns, _MARGIN)
        self._rates = weights[played]
        self._passings = Passings.of(problem)
        # Valleys, and which points have not been put elsewhere in them.
        self._untried: list[tuple[Array, list[list[int]]]] = []

    def run(self, best: Array, front: Array, *, explore: bool) -> Found:
        """Seek the least from the best decision vector so far.

        Args:
            best: shape (n_var,).
            front: members of the front, those with the least values first, shape (N, n_var).
            explore: begin from many other starts too.
        """
        if not explore:
            return self._found(self._ended(best), 1, 1, best[None][:0])
        y, merit = self._explored(best, front)
        ends: list[Array] = []
        values: list[float] = []
        for k in self._valleys(y, merit, _ENDED):
            end = self._ended(self._scaled.outside(y[k : k + 1])[0])
            if end is not None:
                ends, values = [*ends, end], [*values, float(np.log(self._cost(end)))]
                if values[-1] <= merit[k] + (_PROVEN if proves(self._problem) else _GAIN):
                    break
        found = ends[int(np.argmin(values))] if ends else slower(self._problem, self._scaled.outside(y[:1])[0])
        found = self._ended(best) if found is None else found
        others = self._scaled.outside(y[self._valleys(y, merit, _TOLD_VALLEYS)[1:]])
        return self._found(found, len(y), int((merit <= merit[0] + _SAME).sum()), others)

    def _found(self, x: Array | None, starts: int, agreeing: int, valleys: Array) -> Found:
        gradients = self._gradients + self._scaled.gradients
        return Found(x, starts, agreeing, gradients, self._scaled.evaluations, valleys)

    def _cost(self, x: Array) -> float:
        return float(self._at_samples.evaluate(x[None], return_values_of=["F"])[0] @ self._rates)

    def _explored(self, best: Array, front: Array) -> tuple[Array, Array]:
        """Ends of many starts in scaled variables, the best first, (S, n_var), and their merits (S,)."""
        y, merit = self._descended(self._starts(best, front), _STAGES)
        end = None if self._early is None else self._ended(self._scaled.outside(y[:1])[0])
        if self._early is not None and end is not None:
            self._early(end)
        vain = 0
        for _ in range(_KICKS):
            if self._stop(self._scaled.gradients, self._scaled.evaluations):
                break
            before = merit[0]
            kicked, others = self._descended(self._kicked(y, merit), _KICKED_STAGES)
            y, merit = np.concatenate([y, kicked]), np.concatenate([merit, others])
            order = merit.argsort(kind="stable")
            y, merit = y[order], merit[order]
            vain = 0 if merit[0] < before - _GAIN else vain + 1
            if vain == _IN_VAIN:
                break
        return y, merit

    def _starts(self, best: Array, front: Array) -> Array:
        bounds, problem = self._scaled.bounds, self._problem
        drawn = sobol(problem.n_var, _ANYWHERE, self._random)
        anywhere = bounds[0] + drawn * (bounds[1] - bounds[0])
        drawn = sobol(problem.n_var, _NEARER, self._random)
        path = ~(problem.xl > 0.0)
        nearer = problem.xl + np.where(path, 0.25 + 0.5 * drawn, drawn) * (problem.xu - problem.xl)
        spread = np.linspace(0, len(front) - 1, min(_FROM_FRONT, len(front))).astype(np.intp)
        known = self._scaled.inside(np.concatenate([best[None], front[spread], nearer]))
        return np.concatenate([known, anywhere])

    @staticmethod
    def _valleys(y: Array, merit: Array, most: int) -> list[int]:
        """Indices of the best of ends (S, n_var) with merits (S,) in different valleys, the best first."""
        valleys = [0]
        for k, end in enumerate(y):
            apart = np.abs(end - y[valleys]).max(axis=1).min() > _APART
            if len(valleys) < most and apart and np.abs(merit[k] - merit[valleys]).min() > _GAIN:
                valleys.append(k)
        return valleys

    def _kicked(self, y: Array, merit: Array) -> Array:
        """Copies of the best of ends (S, n_var), each with a point put elsewhere; as far as there are few, shaken."""
        kicked, shares = [], list(_COPIES_KICKED)
        for k in self._valleys(y, merit, _MOST_VALLEYS):
            others = self._elsewhere(y[k], shares[0])
            if len(others):
                kicked.append(others)
                shares.pop(0)
            if not shares:
                break
        for k, count in zip(self._valleys(y, merit, len(shares)), shares, strict=False):
            kicked.append(self._shaken(y[k], count))
        within: Array = np.clip(np.concatenate(kicked), *self._scaled.bounds)
        return within

    def _elsewhere(self, y: Array, count: int) -> Array:
        """At most so many copies of an end (n_var,), in each of which a point is put elsewhere, (N, n_var)."""
        if self._passings is None:
            return y[None][:0]
        left = next((left for end, left in self._untried if np.abs(end - y).max() <= _APART), None)
        if left is None:
            left = self._random.permutation(self._passings.moves).tolist()
            self._untried.append((y, left))
        now, left[:count] = left[:count], []
        x = self._passings.moved(self._scaled.outside(y[None])[0], now, self._random)
        return self._scaled.inside(np.clip(x, self._problem.xl, self._problem.xu))

    def _shaken(self, y: Array, count: int) -> Array:
        """Copies of an end (n_var,) with a few variables drawn anew, (count, n_var)."""
        copies = y + _SHAKEN * self._random.standard_normal((count, len(y)))
        for row in copies:
            anew = self._random.integers(len(row), size=self._random.integers(1, _DRAWN_ANEW + 1))
            row[anew] = self._random.uniform(*self._scaled.bounds[:, anew])
        return copies

    def _descended(self, y: Array, stages: tuple[tuple[float, int], ...]) -> tuple[Array, Array]:
        """The ends of starts (S, n_var) in scaled variables, the best first, and their merits (S,)."""
        count = len(y)
        run = Lockstep(
            self._scaled,
            y,
            reference=np.zeros((count, 1)),
            augmentation=np.zeros((count, 1)),
            restarts=_RESTARTS,
            bold=True,
        )
        for share, steps in stages:
            rank = run.merit_at(_PRICE).argsort(kind="stable").argsort(kind="stable")
            going = np.where(rank < share * count, steps, 0)
            run.run(
                going, np.full(count, _SETTLED), lambda: self._stop(self._scaled.gradients, self._scaled.evaluations)
            )
            self._tell(self._scaled.outside(run.y[[run.merit_at(_PRICE).argmin()]])[0])
        order = run.merit.argsort(kind="stable")
        return run.y[order], run.merit[order]

    def _ended(self, x: Array) -> Array | None:
        """The end of SLSQP from a point, or the best point within all limits on its way, or None."""
        end = None
        for margin in _ENDED_MARGINS:
            end = self._ended_at_samples(x, margin) if end is None else end
        if end is None or not proves(self._problem) or greatest_excess(self._problem, end) <= 0.0:
            return end
        self._tell(end)
        try:
            return exchanged(self._problem, self._weights, end, _TOLERANCE, stop=self._stopped)
        except OutOfEvaluations:
            return None

    def _ended_at_samples(self, x: Array, margin: float) -> Array | None:
        search = WeightedSum(
            self._at_samples.in_terms(),
            self._rates,
            margin=margin,
            excess=lambda at: greatest_excess(self._at_samples, at),
            most=_MOST * int(self._problem.n_var),
            stop=self._stopped,
        )
        try:
            end: Array | None = search.run(x, _TOLERANCE)
        except OutOfEvaluations:
            end = None
        for at in (end, search.best):
            if at is not None and greatest_excess(self._at_samples, at) <= 0.0:
                return at
        return None

    def _tell(self, x: Array) -> None:
        """Tell early of a point near an end, which may exceed a limit: on the same path, as slow as it must be."""
        slow = None if self._early is None else slower(self._problem, x)
        if self._early is not None and slow is not None:
            self._early(slow)

    def _stopped(self, _: int) -> bool:
        if self._stop(self._scaled.gradients + self._gradients, self._scaled.evaluations):
            return True
        self._gradients += 1
        return False


def slowed(scaled: Scaled, problem: TrajectoryProblem, x: Array) -> Array:
    """A decision vector (n_var,) and slower ones on its path, in scaled variables (N, n_var).

    The end of an anchor may lie far from the front that evolution has found; its slower copies begin to fill the gap.
    """
    times = stretching_times(problem)
    later = np.where(times, np.log(_SLOWER), 0.0) * np.arange(_COPIES + 1 if times.any() else 1)[:, None]
    return np.clip(scaled.inside(x[None]) + later, *scaled.bounds)
