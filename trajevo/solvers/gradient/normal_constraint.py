"""The normalised normal constraint method with divide and conquer and SQP, for two objectives.

Numbers in brackets are equations of Paing 2021; the method is Messac's (2003), the division that of Hashem (2017).
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from trajevo.base import jit
from trajevo.base.arrays import Array, frozen, one_blas_thread
from trajevo.base.signals import Stopping
from trajevo.errors import InvalidInputError
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.front.books import Books
from trajevo.front.front import Front
from trajevo.solvers.gradient.sqp import MARGIN, WeightedSum, greatest_excess, random_starts

#: SLSQP's tolerance on the logarithm of an objective.
_TOLERANCE = 1e-11
#: Random starts for each anchor; other points start from their neighbours.
_STARTS = 4
#: Share of the range of an objective by which a point may be off its normal constraint.
_OFF = 1e-6
#: Relative difference up to which two minima of an objective count as equal, and relative difference of the other
#: objective from which the minimum counts as attained at more than one point.
_TIED, _SPREAD = 1e-7, 1e-3
#: The interval between neighbours is not divided if they are this close in ω.
_NEAREST = 2.0**-20


def solve_nnc(
    problem: TrajectoryProblem, *, tolerance: float = 0.01, seed: int = 0, points: int | None = None
) -> Front:
    """The front of two objectives by gradients: the minimum of each, then points between with a significant trade-off.

    With the objectives normalised between the ends of the front (31), (32), every point minimises the second objective
    under the normal constraint (34) for a weighting factor ω from 0 to 1. The interval of ω between two neighbours is
    halved as long as both normalised objectives differ by at least the tolerance.

    An interrupt from the keyboard or SIGTERM ends the run after the current point and returns what was found so far; a
    second one aborts.

    Args:
        problem: any problem with two objectives. Its smooth form is solved if it has one. If its complex-step gradients
            turn out to be wrong, finite differences replace them, with a warning.
        tolerance: least trade-off that counts as significant.
        seed: seed of the random starts.
        points: solve for this many evenly spread ω instead, including the ends.

    Returns:
        The front; if solutions stand for curves of another problem's solutions, the front of that problem. The settings
        of its run count the sub-problems that were tried again and those that failed.

    Raises:
        InvalidInputError: not two objectives, or invalid arguments.
    """
    needs_two_objectives(problem)
    if not (isinstance(tolerance, int | float) and 0.0 < tolerance < 1.0):
        raise InvalidInputError(f"tolerance: expected a number between 0 and 1, got {tolerance!r}")
    if not isinstance(seed, int | np.integer) or isinstance(seed, bool) or seed < 0:
        raise InvalidInputError(f"seed: expected a whole number of at least 0, got {seed!r}")
    if points is not None and (not isinstance(points, int) or isinstance(points, bool) or points < 2):
        raise InvalidInputError(f"points: expected a whole number of at least 2, got {points!r}")
    origin = problem if problem.expansion is None else problem.expansion.problem
    import scipy.linalg  # noqa: F401 - its threads are only limited once it is loaded

    began = time.perf_counter()
    with one_blas_thread(), Stopping() as stopping:
        division, books = _Division(origin, int(seed)), Books(origin)
        interrupted = _collect(division, books, tolerance, points, stopping)
    settings = {
        "method": "normalised normal constraint, divide and conquer, SLSQP" if points is None else "evenly spread ω",
        "tolerance": float(tolerance),
        "gradients": division.kind,
        "sub-problems": division.solved,
        "tried again": division.tried_again,
        "failed": division.failed,
    }
    return books.front(
        algorithm="NNC",
        settings=settings if points is None else settings | {"points": points},
        seed=int(seed),
        evaluations=division.evaluations,
        interrupted=interrupted,
        stopped_by=stopping.asked_by if interrupted else "",
        seconds=time.perf_counter() - began,
        kernels=jit.kind(),
    )


def needs_two_objectives(problem: Any) -> None:
    """Refuse a problem that the method cannot solve.

    Raises:
        InvalidInputError: not a :class:`TrajectoryProblem`, or not two objectives.
    """
    if not isinstance(problem, TrajectoryProblem) or problem.n_obj != 2:
        raise InvalidInputError("problem: the normal constraint method needs a TrajectoryProblem of two objectives")


def _collect(division: _Division, books: Books, tolerance: float, points: int | None, stopping: Stopping) -> bool:
    """Record every point as it is found, one generation per level; returns whether a signal ended this."""
    closed, interrupted, began = 0, False, time.process_time()
    for level, point in _found(division, tolerance, points):
        if level > closed + 1:
            books.close(closed := closed + 1, division.evaluations, cpu_seconds=time.process_time() - began)
        X = division.back(point.x[None])
        F, G = division.origin.evaluate(X, return_values_of=["F", "G"])
        books.collect(X, {"F": F, "G": G})
        if stopping:
            interrupted = True
            break
    books.close(closed + 1, division.evaluations, cpu_seconds=time.process_time() - began)
    return interrupted


def weighting_factors(front: Front) -> Array:
    """The ω of the normal constraint (34) on which each point of a two-objective front lies, shape (N,)."""
    if front.F.shape[1] != 2 or len(front) < 2:
        raise InvalidInputError("front: expected at least two points of two objectives")
    normalised = (front.F - front.F.min(axis=0)) / np.ptp(front.F, axis=0)
    return frozen(0.5 * (1.0 + normalised[:, 0] - normalised[:, 1]))


#: Decision vector at which the solver ended, and its objectives.
_End = tuple[Array, Array]


@dataclass(frozen=True, eq=False)
class _Point:
    omega: float
    x: Array
    F: Array


@dataclass(eq=False)
class _Division:
    """The sub-problems of one front, on the smooth form of its problem."""

    origin: TrajectoryProblem
    seed: int
    solved: int = 0
    tried_again: int = 0
    failed: int = 0
    evaluations: int = 0
    kind: str = field(init=False)

    def __post_init__(self) -> None:
        form = self.origin.smooth
        self.smooth = self.origin.in_terms() if form is None else form.problem
        self.margin = MARGIN if form is None else 0.0
        starts = random_starts(self.origin, self.seed, _STARTS)
        self.starts = starts if form is None else form.into(starts)
        self.kind = self.smooth.gradients_by(self.starts[:2])

    def back(self, x: Array) -> Array:
        """Decision vectors of the original problem, from those of the smooth form."""
        return x if self.origin.smooth is None else self.origin.smooth.back(x)

    def anchors(self) -> list[_Point]:
        """The minimum of each objective (30); of several minima, the one with the least other objective."""
        found = []
        for objective, omega in ((0, 0.0), (1, 1.0)):
            ends = [end for start in self.starts if (end := self._end(objective, start, None)) is not None]
            if not ends:
                self.failed += 1
                continue
            best = self._least(objective, ends)
            found.append(_Point(omega, *best))
            self.solved += 1
        return found

    def _least(self, objective: int, ends: list[_End]) -> _End:
        """The end with the least value of one objective; of several, the one with the least other objective."""
        least = min(float(F[objective]) for _, F in ends)
        tied = [end for end in ends if end[1][objective] <= least + _TIED * abs(least)]
        best = min(tied, key=lambda end: float(end[1][1 - objective]))
        worst = max(float(F[1 - objective]) for _, F in tied)
        if worst - float(best[1][1 - objective]) <= _SPREAD * abs(worst) or least == 0.0:
            return best
        ceiling = np.eye(2)[objective] / abs(least), float(np.sign(least)) + _TIED
        again = self._end(1 - objective, best[0], ceiling)
        return again if again is not None and again[1][1 - objective] < best[1][1 - objective] else best

    def between(self, left: _Point, right: _Point, omega: float, low: Array, width: Array) -> _Point | None:
        """The point for a weighting factor (33), (34), or None.

        Starts are tried in turn: the neighbours' mean, each neighbour, random points.
        """
        half_space = np.array([1.0, -1.0]) / width, 2.0 * omega - 1.0 + float((low / width) @ [1.0, -1.0])
        most, least = (left.F[1] - low[1]) / width[1], (right.F[1] - low[1]) / width[1]
        self.solved += 1
        for tries, start in enumerate((0.5 * (left.x + right.x), left.x, right.x, *self.starts)):
            self.tried_again += tries == 1
            end = self._end(1, start, half_space)
            if end is not None and least - _OFF <= (end[1][1] - low[1]) / width[1] <= most + _OFF:
                return _Point(omega, *end)
        self.failed += 1
        return None

    def _end(self, objective: int, start: Array, half_space: tuple[Array, float] | None) -> _End | None:
        """The end of SLSQP from a start, and its objectives; None if it is infeasible."""
        search = WeightedSum(
            self.smooth,
            np.eye(2)[objective],
            half_space=half_space,
            margin=self.margin,
            excess=self._excess,
        )
        x = search.run(start, _TOLERANCE)
        self.evaluations += search.evaluations
        F: Array = self.smooth.evaluate(x[None], return_values_of=["F", "G"])[0][0]
        beneath = half_space is None or float(half_space[0] @ F - half_space[1]) <= _OFF
        return (x, F) if beneath and self._excess(x) <= 0.0 else None

    def _excess(self, x: Array) -> float:
        """The greatest excess over a limit of the original problem, for a decision vector of the smooth form."""
        return greatest_excess(self.origin, self.back(x[None])[0])


def _found(division: _Division, tolerance: float, points: int | None) -> Iterator[tuple[int, _Point]]:
    """Yield every point as it is found, with its level: ends, then their middle, then the quarters, and so on."""
    ends = division.anchors()
    yield from ((1, point) for point in ends)
    if len(ends) < 2:
        return
    low, width = np.minimum(ends[0].F, ends[1].F), np.abs(ends[1].F - ends[0].F)
    if not (width > 0.0).all():
        return
    if points is not None:
        for omega in np.linspace(0.0, 1.0, points)[1:-1].tolist():
            point = division.between(ends[0], ends[1], omega, low, width)
            if point is not None:
                yield 2, point
        return
    gaps, level = [(ends[0], ends[1])], 1
    while gaps:
        level, following = level + 1, []
        for left, right in gaps:
            if (np.abs(right.F - left.F) < tolerance * width).any() or right.omega - left.omega < _NEAREST:
                continue
            middle = division.between(left, right, 0.5 * (left.omega + right.omega), low, width)
            if middle is not None:
                following += [(left, middle), (middle, right)]
                yield level, middle
        gaps = following
