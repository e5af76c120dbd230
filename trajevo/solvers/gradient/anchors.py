"""Anchors: the least of one objective or weighted sum, sought from many starts where one is not enough.

Under limits of effort a motion whose points may move has many local optima, and a search from the fastest evolved
member ends in a poor one, or fails. So many starts take bold steps together (:class:`Lockstep`), the worse half of them
is given up twice, the best is kicked out of its valley a few times, and SLSQP ends it. Limits that are proven between
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
from trajevo.solvers.gradient.exchange import at_samples, exchanged, proves
from trajevo.solvers.gradient.scaling import Columns, Scaled
from trajevo.solvers.gradient.sqp import OutOfEvaluations, WeightedSum, greatest_excess, with_objectives

#: Points that SLSQP evaluates for an anchor and variable, and its tolerance on the logarithm of the value.
_MOST, _TOLERANCE = 40, 1e-6

#: Factor of all times from one slower copy of an anchor to the next, and number of copies.
_SLOWER, _COPIES = 1.045, 16

#: Starts of a search: anywhere on the scales of the variables, anywhere between the bounds but nearer to the middle of
#: those that are no times, and members of the front.
_ANYWHERE, _NEARER, _FROM_FRONT = 16, 8, 4

#: Shares of the starts that take steps, and how many steps, one after another; promised decrease that ends them.
_STAGES, _SETTLED = ((1.0, 30), (0.5, 40), (0.25, 40)), 1e-6

#: Times that the best are kicked, their number, their least distance on the scales of the variables, copies of each.
_KICKS, _KICKED, _APART, _COPIES_KICKED = 2, 3, 0.3, 8

#: Stages of what was kicked, spread of all its variables on their scales, and how many are drawn anew at most.
_KICKED_STAGES, _SHAKEN, _DRAWN_ANEW = ((1.0, 30), (0.5, 30), (0.25, 40)), 0.05, 3

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
    """

    x: Array | None
    starts: int
    agreeing: int
    gradients: int
    evaluations: int


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
    """

    def __init__(self, problem: TrajectoryProblem, weights: Array, seed: int, stop: Callable[[int, int], bool]) -> None:
        self._problem, self._weights = problem, weights
        self._random = np.random.default_rng(seed)
        self._stop, self._gradients = stop, 0
        played = weights != 0.0
        self._at_samples = with_objectives(at_samples(problem), played)
        columns = Columns(weights[played][None], np.full(1, True), np.zeros(1), np.ones(1))
        self._scaled = Scaled(self._at_samples.in_terms(), columns, _MARGIN)
        self._rates = weights[played]

    def run(self, best: Array, front: Array, *, explore: bool) -> Found:
        """Seek the least from the best decision vector so far.

        Args:
            best: shape (n_var,).
            front: members of the front, those with the least values first, shape (N, n_var).
            explore: begin from many other starts too.
        """
        x, starts, agreeing = best, 1, 1
        if explore:
            y, merit = self._explored(best, front)
            x, starts = self._scaled.outside(y[:1])[0], len(y)
            agreeing = int((merit <= merit[0] + _SAME).sum())
        end = self._ended(x)
        if end is None and explore:
            end = self._ended(best)
        return Found(end, starts, agreeing, self._gradients + self._scaled.gradients, self._scaled.evaluations)

    def _explored(self, best: Array, front: Array) -> tuple[Array, Array]:
        """Ends of many starts in scaled variables, the best first, (S, n_var), and their merits (S,)."""
        y, merit = self._descended(self._starts(best, front), _STAGES)
        for _ in range(_KICKS):
            kicked, others = self._descended(self._kicked(y), _KICKED_STAGES)
            y, merit = np.concatenate([y, kicked]), np.concatenate([merit, others])
            order = merit.argsort(kind="stable")
            y, merit = y[order], merit[order]
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

    def _kicked(self, y: Array) -> Array:
        """Copies of the best of ends (S, n_var), in different valleys, with a few variables drawn anew."""
        bounds, valleys = self._scaled.bounds, [y[0]]
        for end in y[1:]:
            if len(valleys) < _KICKED and np.abs(end - valleys).max(axis=1).min() > _APART:
                valleys.append(end)
        copies = np.repeat(np.stack(valleys), _COPIES_KICKED, axis=0)
        copies = copies + _SHAKEN * self._random.standard_normal(copies.shape)
        for row in copies:
            anew = self._random.integers(len(row), size=self._random.integers(1, _DRAWN_ANEW + 1))
            row[anew] = self._random.uniform(*bounds[:, anew])
        within: Array = np.clip(copies, *bounds)
        return within

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
            rank = run.merit.argsort(kind="stable").argsort(kind="stable")
            going = np.where(rank < share * count, steps, 0)
            run.run(
                going, np.full(count, _SETTLED), lambda: self._stop(self._scaled.gradients, self._scaled.evaluations)
            )
        order = run.merit.argsort(kind="stable")
        return run.y[order], run.merit[order]

    def _ended(self, x: Array) -> Array | None:
        """The end of SLSQP from a point, or the best point within all limits on its way, or None."""
        most = _MOST * int(self._problem.n_var)
        terms = self._at_samples.in_terms()
        search = WeightedSum(
            terms, self._rates, excess=lambda at: greatest_excess(self._at_samples, at), most=most, stop=self._stopped
        )
        try:
            end: Array | None = search.run(x, _TOLERANCE)
        except OutOfEvaluations:
            end = search.best
        if end is None or not proves(self._problem) or greatest_excess(self._problem, end) <= 0.0:
            return end
        try:
            return exchanged(self._problem, self._weights, end, _TOLERANCE, stop=self._stopped)
        except OutOfEvaluations:
            return None

    def _stopped(self, _: int) -> bool:
        if self._stop(self._scaled.gradients + self._gradients, self._scaled.evaluations):
            return True
        self._gradients += 1
        return False


def slowed(scaled: Scaled, problem: TrajectoryProblem, x: Array) -> Array:
    """A decision vector (n_var,) and slower ones on its path, in scaled variables (N, n_var).

    The end of an anchor may lie far from the front that evolution has found; its slower copies begin to fill the gap.
    """
    times = np.array([variable.unit == "s" and variable.lower > 0.0 for variable in problem.variables])
    later = np.where(times, np.log(_SLOWER), 0.0) * np.arange(_COPIES + 1 if times.any() else 1)[:, None]
    return np.clip(scaled.inside(x[None]) + later, *scaled.bounds)
