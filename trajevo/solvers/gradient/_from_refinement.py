"""A front on its way to the limit: anchors, members refined in lockstep, gaps filled, nothing lost."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, final

import numpy as np

from trajevo.archive import Archive
from trajevo.arrays import Array
from trajevo.covering import Box, covering, gaps, neighbours
from trajevo.front import Front
from trajevo.lockstep import Lockstep
from trajevo.problem import TrajectoryProblem
from trajevo.scaled import Columns, Scaled
from trajevo.sqp import differentiated, random_starts

#: Steps and promised decrease, in units of a logarithm, at which anchors and other members are done.
_ANCHOR_STEPS, _ANCHOR_TOLERANCE = 150, 1e-9
_STEPS, _TOLERANCE = 30, 1e-3
#: Fresh starts of an anchor from its own end.
_ANCHOR_RESTARTS = 4
#: Share of the scaled objectives' sum beside the greatest: of anchors, which it must not move, and of other members.
_ANCHOR_SHARE, _SHARE = 1e-5, 1e-2
#: By how much limits are kept more than asked for, so that rounding does not break them.
_MARGIN = 1e-7
#: Ways back to its start that a member which ended beyond a limit is taken, in turn: before and after the place where
#: it was within them last is tried.
_BACK, _FAR_BACK = (1e-6, 1e-4), (1e-2, 1e-1)
#: Points on the line through two neighbours, beyond both and between, and how many neighbours each member has.
_SHARES, _NEIGHBOURS = (-0.5, 0.5, 1.5), 10
#: Share of what may be spent by when anchors and the members beside them are done, and by when the others are; the
#: rest fills gaps, which brings most.
_UNTIL_ANCHORED, _UNTIL_REFINED = 0.6, 0.75
#: Members between which gaps are filled.
_MEMBERS_OF_GAPS = 60
#: First trust region of members that begin near the front.
_NEAR = 0.2


class _Part(NamedTuple):
    """Members that are refined in the same way: where they begin, and what :class:`Lockstep` is told of them."""

    y: Array
    reference: Array
    share: float
    steps: int
    tolerance: float
    restarts: int


@final
class Refinement:
    """The front on its way: an archive of true points, and what is known of the curvature at those refined.

    Args:
        front: of a problem with gradients, not empty.
        seed: of the points by which shares of the box are counted.
        stop: asked before every step, with the cost so far and the share of what may be spent by then; what was found
            by then counts.

    Attributes:
        archive: every feasible point that nothing dominates, of the front and of those found.
        box: the part of the objectives' space in which the front is measured.
        kind: what the gradients are.
        refined: members that went through the gradient solver.
    """

    def __init__(self, front: Front, seed: int, stop: Callable[[int, float], bool]) -> None:
        problem, corner = front.problem, front.history.reference_point
        self.box = box = Box.of(front.F, None if corner is None else np.array(corner))
        self._original, self._problem, self._seed, self._stop = front, problem, seed, stop
        self.archive = Archive(problem.n_var, problem.n_obj, problem.n_ieq_constr)
        self.archive.add(front.X, front.F, front.G)
        self.refined = self._evaluations = 0
        weights = front.paper_weights
        scales = None if weights is None else np.ones(problem.n_obj) if weights.scales is None else weights.scales
        sums = [] if weights is None else [np.array(weights.weights) / np.array(scales)]
        columns = Columns.of(front.F, np.vstack([np.eye(problem.n_obj), *sums]), box.corner)
        form = problem.smooth
        smooth = problem.in_terms() if form is None else form.problem
        gradients, self.kind = differentiated(
            smooth, _probes(smooth, front.X[:1] if form is None else form.into(front.X[:1]))
        )
        self._scaled = Scaled(smooth, gradients, columns, _MARGIN if form is None else 0.0)
        self._known, self._curvature = np.empty((0, len(columns.weights))), np.empty((0, smooth.n_var, smooth.n_var))

    def refine(self, members: int, number: int, *, anchors: bool = False) -> None:
        """Members that cover most of the box, each along its direction; later in the widest gaps too.

        Args:
            members: how many at most.
            number: of the round, from 0.
            anchors: take with them the members that have the least of every objective and weighted sum, towards that.
        """
        if self._stop(self.cost, _UNTIL_REFINED):
            return
        chosen = covering(self.archive.F, self._probes(number), members)
        y, f = self._inside(self.archive.X[chosen]), self._scaled.columns(self.archive.F[chosen])
        if number and len(chosen) > 1:
            within = self._scaled.columns(np.minimum(self.archive.F[chosen], self.box.corner))
            y = np.concatenate([y, _between(y, gaps(within, members), members)])
            f = np.concatenate([f, self._scaled.values(y[len(f) :])[0]])
        single = np.arange(f.shape[1]) < self._problem.n_obj
        parts = [_Part(y, np.where(single, f, np.inf), _SHARE, _STEPS, _TOLERANCE, 0)]
        if anchors:
            parts.insert(0, self._anchors())
        y, reference = np.concatenate([part.y for part in parts]), np.concatenate([part.reference for part in parts])
        share, steps, tolerance, restarts = (
            np.concatenate([np.full(len(part.y), part[k]) for part in parts]) for k in range(2, 6)
        )
        run = Lockstep(
            self._scaled,
            y,
            reference=reference,
            augmentation=share[:, None] * single,
            curvature=self._curvature[self._nearest(f)] if len(self._known) else None,
            radius=0.5 if number == 0 else _NEAR,
            restarts=restarts,
        )
        run.run(steps, tolerance, lambda: self._stop(self.cost, _UNTIL_ANCHORED if anchors else _UNTIL_REFINED))
        self._finish(run, y)

    def _anchors(self) -> _Part:
        f = self._scaled.columns(self.archive.F)
        reference = np.where(np.eye(f.shape[1], dtype=bool), f.min(axis=0), np.inf)
        y = self._inside(self.archive.X[f.argmin(axis=0)])
        return _Part(y, reference, _ANCHOR_SHARE, _ANCHOR_STEPS, _ANCHOR_TOLERANCE, _ANCHOR_RESTARTS)

    def fill(self) -> None:
        """Points on the lines through neighbours, between and beyond them."""
        chosen = covering(self.archive.F, self._probes(0), _MEMBERS_OF_GAPS)
        if len(chosen) < 2 or self._stop(self.cost, 1.0):
            return
        pairs = neighbours(self._scaled.columns(self.archive.F[chosen]), _NEIGHBOURS)
        y = self._inside(self.archive.X[chosen])
        first, second = y[pairs[:, 0]], y[pairs[:, 1]]
        self._add(np.concatenate([(1.0 - share) * first + share * second for share in _SHARES]))

    @property
    def gradients(self) -> int:
        """Points at which gradients were evaluated."""
        return self._scaled.gradients

    @property
    def evaluations(self) -> int:
        """Points that were evaluated without."""
        return self._scaled.evaluations + self._evaluations

    @property
    def cost(self) -> int:
        """Evaluations of everything, a gradient as many as there are variables."""
        return self.evaluations + self.gradients * int(self._problem.n_var)

    def news(self) -> Array:
        """Rows of the archive that the original does not have."""
        rows = {row.tobytes() for row in np.ascontiguousarray(self._original.X)}
        return np.array([row.tobytes() not in rows for row in np.ascontiguousarray(self.archive.X)], dtype=bool)

    def kept(self) -> int:
        """Members of the original that are in the archive still."""
        return int((~self.news()).sum())

    def _probes(self, number: int) -> Array:
        return self.box.probes(self.archive.F, self._seed + number)

    def _nearest(self, f: Array) -> Array:
        """Of those refined, the one with the nearest objectives."""
        nearest: Array = np.abs(f[:, None] - self._known).max(axis=2).argmin(axis=1)
        return nearest

    def _finish(self, run: Lockstep, starts: Array) -> None:
        """Take what is feasible into the archive; the rest after a way back."""
        self.refined += len(starts)
        feasible = self._add(run.y)
        nearer, farther = ([run.y + share * (starts - run.y) for share in shares] for shares in (_BACK, _FAR_BACK))
        for y in (*nearer, run.safe, *farther):
            left = np.flatnonzero(~feasible)
            if not len(left):
                break
            feasible[left] = self._add(y[left])
        self._known = np.concatenate([self._known, self._scaled.values(run.y)[0]])
        self._curvature = np.concatenate([self._curvature, run.curvature])

    def _add(self, y: Array) -> Array:
        """Evaluate points as those of the problem itself; which are feasible."""
        X = self._outside(np.clip(y, *self._scaled.bounds))
        F, G = self._problem.evaluate(X, return_values_of=["F", "G"])
        self._evaluations += len(X)
        finite = np.isfinite(F).all(axis=1)
        self.archive.add(X[finite], F[finite], G[finite])
        feasible: Array = finite & (G.max(axis=1, initial=-np.inf) <= 0.0)
        return feasible

    def _inside(self, X: Array) -> Array:
        form = self._problem.smooth
        return self._scaled.inside(X if form is None else form.into(X))

    def _outside(self, y: Array) -> Array:
        x, form = self._scaled.outside(y), self._problem.smooth
        return np.clip(x if form is None else form.back(x), self._problem.xl, self._problem.xu)


def _probes(problem: TrajectoryProblem, member: Array) -> Array:
    """Where gradients are compared with finite differences: at a member (1, n), and away from it, since peaks that are
    equally high in two places, as those of symmetric motions, have a kink.
    """
    return np.concatenate([member, 0.9 * member + 0.1 * random_starts(problem, 0, 1)])


def _between(y: Array, pairs: Array, most: int) -> Array:
    """Points evenly spread between the members of each pair: the middle, or more where there are few pairs."""
    parts = 1 + max(1, most // len(pairs))
    shares = (np.arange(1, parts) / parts)[:, None, None]
    points: Array = (1.0 - shares) * y[pairs[:, 0]] + shares * y[pairs[:, 1]]
    return points.reshape(-1, y.shape[1])
