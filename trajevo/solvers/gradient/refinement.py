"""The refinement of a front: anchors, members, and points in the gaps between them."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.front.archive import Archive
from trajevo.front.covering import ReferenceBox, between, covering, gaps, neighbours
from trajevo.front.front import Front
from trajevo.solvers.gradient.anchors import AnchorSearch, Found, many_valleys, slowed
from trajevo.solvers.gradient.batch_sqp import Lockstep
from trajevo.solvers.gradient.optimality import Anchor, residual
from trajevo.solvers.gradient.scaling import Columns, Scaled

#: Greatest number of steps of an anchor, and promised decrease (of a logarithm) below which it is done.
_ANCHOR_STEPS, _ANCHOR_TOLERANCE = 150, 1e-9

#: The same for other members.
_STEPS, _TOLERANCE = 30, 1e-3

#: How often an anchor is started again from its own end.
_ANCHOR_RESTARTS = 4

#: Share of the scaled objectives' sum that is added to their maximum: for anchors, which it must not move, and for
#: other members.
_ANCHOR_SHARE, _SHARE = 1e-5, 1e-2

#: Margin by which limits are tightened, so that rounding does not break them.
_MARGIN = 1e-7

#: Shares of the way back to its start that are tried in turn for a member that ended infeasible: before its last
#: feasible point is tried, and after.
_BACK, _FAR_BACK = (1e-6, 1e-4), (1e-2, 1e-1)

#: Points on the line through two neighbours, beyond both and between them, and number of neighbours of each member.
_SHARES, _NEIGHBOURS = (-0.5, 0.5, 1.5), 10

#: Shares of the budget at which the round with the anchors ends, and at which later rounds end; the rest is for filling
#: gaps, which gains most.
_UNTIL_ANCHORED, _UNTIL_REFINED = 0.6, 0.75

#: Greatest number of members between which gaps are filled.
_MEMBERS_OF_GAPS = 60

#: Initial trust region of members that begin near the front.
_NEAR = 0.2


class _Part(NamedTuple):
    """Members that are refined in the same way: their starting points, and arguments of :class:`Lockstep`."""

    y: Array
    reference: Array
    share: float
    steps: int
    tolerance: float
    restarts: int


@final
class Refinement:
    """The refinement of a front: an archive of evaluated points, and the curvature at refined members.

    Args:
        front: a front that is not empty, of a problem with gradients.
        seed: seed of the sample points with which shares of the box are estimated.
        stop: called before every step with the cost so far and the share of the budget that may be spent by then; if
            it returns True, the refinement ends and keeps what it has found.

    Attributes:
        archive: non-dominated feasible points of the front and of the refinement.
        box: the box in objective space in which the hypervolume is measured.
        kind: how gradients are computed, see :meth:`TrajectoryProblem.gradients_by`.
        refined: number of members refined by the gradient solver.
        anchors: the least of every objective and weighted sum, and how near it is to an optimum.
    """

    def __init__(self, front: Front, seed: int, stop: Callable[[int, float], bool]) -> None:
        problem, corner = front.problem, front.history.reference_point
        self.box = box = ReferenceBox.of(front.F, None if corner is None else np.array(corner))
        self._original, self._problem, self._seed, self._stop = front, problem, seed, stop
        self.archive = Archive(problem.n_var, problem.n_obj, problem.n_ieq_constr)
        self.archive.add(front.X, front.F, front.G)
        self.refined = self._evaluations = 0
        self.anchors: list[Anchor] = []
        self._many_valleys, self._slower = False, np.empty((0, 0))
        weights = front.paper_weights
        scales = None if weights is None else np.ones(problem.n_obj) if weights.scales is None else weights.scales
        sums = [] if weights is None else [np.array(weights.weights) / np.array(scales)]
        columns = Columns.of(front.F, np.vstack([np.eye(problem.n_obj), *sums]), box.corner)
        form = problem.smooth
        smooth = problem.in_terms() if form is None else form.problem
        self._smooth = smooth
        self.kind = smooth.gradients_by(front.X[:1] if form is None else form.into(front.X[:1]))
        self._scaled = Scaled(smooth, columns, _MARGIN if form is None else 0.0)
        self._known, self._curvature = np.empty((0, len(columns.weights))), np.empty((0, smooth.n_var, smooth.n_var))

    def refine(self, members: int, number: int, *, anchors: bool = False) -> None:
        """Refine the members that cover most of the box; after the first round also points in the widest gaps.

        Args:
            members: greatest number of members.
            number: number of the round, from 0.
            anchors: also seek the minimum of every objective and weighted sum, from the member with the least value.
        """
        if self._stop(self.cost, _UNTIL_REFINED):
            return
        chosen = covering(self.archive.F, self._probes(number), members)
        y, f = self._inside(self.archive.X[chosen]), self._scaled.columns(self.archive.F[chosen])
        if number and len(chosen) > 1:
            within = self._scaled.columns(np.minimum(self.archive.F[chosen], self.box.corner))
            y = np.concatenate([y, between(y, gaps(within, members), members)])
            f = np.concatenate([f, self._scaled.values(y[len(f) :])[0]])
        if len(self._slower):
            y = np.concatenate([y, self._slower])
            f = np.concatenate([f, self._scaled.values(self._slower)[0]])
            self._slower = self._slower[:0]
        single = np.arange(f.shape[1]) < self._problem.n_obj
        parts = [_Part(y, np.where(single, f, np.inf), _SHARE, _STEPS, _TOLERANCE, 0)]
        elsewhere = self._explored_columns() if anchors else np.zeros(0, dtype=bool)
        if anchors:
            parts.insert(0, self._anchors())
        y, reference = np.concatenate([part.y for part in parts]), np.concatenate([part.reference for part in parts])
        share, steps, tolerance, restarts = (
            np.concatenate([np.full(len(part.y), part[k]) for part in parts]) for k in range(2, 6)
        )
        steps[: len(elsewhere)][elsewhere] = 0
        run = Lockstep(
            self._scaled,
            y,
            reference=reference,
            augmentation=share[:, None] * single,
            curvature=self._curvature[self._nearest(f)] if len(self._known) else None,
            radius=0.5 if number == 0 else _NEAR,
            restarts=restarts + self._many_valleys,
            bold=self._many_valleys,
        )
        run.run(steps, tolerance, lambda: self._stop(self.cost, _UNTIL_ANCHORED if anchors else _UNTIL_REFINED))
        self._finish(run, y)
        if anchors:
            self._end_anchors(run.converged[: f.shape[1]], elsewhere)

    def _explored_columns(self) -> Array:
        """Which anchors are sought from many starts, since the front's ends may lie in the wrong valley."""
        least = self._scaled.columns(self.archive.F).argmin(axis=0)
        pairs = zip(self._scaled.columns.weights, self.archive.X[least], strict=True)
        return np.array([self._of_time(weights) and many_valleys(self._problem, x) for weights, x in pairs])

    def _end_anchors(self, converged: Array, elsewhere: Array) -> None:
        """End anchors that the lockstep left before, or that may lie in the wrong valley, and judge all of them."""
        for column in range(len(converged)):
            weights = self._scaled.columns.weights[column]
            order = self._scaled.columns(self.archive.F)[:, column].argsort(kind="stable")
            found = Found(None, 1, 1, 0, 0)
            explore = bool(elsewhere[column])
            self._many_valleys |= explore
            if explore or not converged[column]:
                found = self._sought(weights, self.archive.X[order], explore=explore)
            least = self._scaled.columns(self.archive.F)[:, column].argmin()
            self.anchors.append(self._judged(column, self.archive.X[least], found))

    def _of_time(self, weights: Array) -> bool:
        """Whether weights (n_obj,) are those of a time alone, which is cheap to evaluate and has many valleys."""
        units = [each.unit for each, weight in zip(self._problem.objectives, weights, strict=True) if weight]
        return self._problem.smooth is None and units == ["s"]

    def _sought(self, weights: Array, members: Array, *, explore: bool) -> Found:
        """Search for an anchor from members, the best first, and add what is found with slower copies."""
        plain = self._problem.smooth is None
        problem, size = self._problem if plain else self._smooth, int(self._problem.n_var)
        search = AnchorSearch(
            problem, weights, self._seed, lambda g, e: self._stop(self.cost + g * size + e, _UNTIL_ANCHORED)
        )
        inside = self._inside(members)
        found = search.run(self._scaled.outside(inside[:1])[0], self._scaled.outside(inside), explore=explore)
        self._scaled.gradients += found.gradients
        self._evaluations += found.evaluations
        if found.x is not None:
            copies = slowed(self._scaled, self._smooth, found.x)
            self._add(copies)
            if explore:
                self._slower = copies[1:]
        return found

    def _judged(self, column: int, x: Array, found: Found) -> Anchor:
        """How near the best point of a column is to an optimum."""
        weights = self._scaled.columns.weights[column]
        names = [each.name for each, weight in zip(self._problem.objectives, weights, strict=True) if weight]
        y = self._inside(x[None])
        left = residual(self._scaled, y[0], column)
        F = self._problem.evaluate(x[None], return_values_of=["F"])[0]
        return Anchor(" + ".join(names), float(F @ weights), left, found.starts, found.agreeing)

    def _anchors(self) -> _Part:
        f = self._scaled.columns(self.archive.F)
        reference = np.where(np.eye(f.shape[1], dtype=bool), f.min(axis=0), np.inf)
        y = self._inside(self.archive.X[f.argmin(axis=0)])
        return _Part(y, reference, _ANCHOR_SHARE, _ANCHOR_STEPS, _ANCHOR_TOLERANCE, _ANCHOR_RESTARTS)

    def fill(self) -> None:
        """Evaluate points on the lines through neighbours, between and beyond them."""
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
        """Points that were evaluated without gradients."""
        return self._scaled.evaluations + self._evaluations

    @property
    def cost(self) -> int:
        """Number of evaluations, a gradient counted as one per variable."""
        return self.evaluations + self.gradients * int(self._problem.n_var)

    def news(self) -> Array:
        """Mask of the archive's rows that the original front does not have, shape (N,)."""
        rows = {row.tobytes() for row in np.ascontiguousarray(self._original.X)}
        return np.array([row.tobytes() not in rows for row in np.ascontiguousarray(self.archive.X)], dtype=bool)

    def kept(self) -> int:
        """Number of members of the original front that are still in the archive."""
        return int((~self.news()).sum())

    def _probes(self, number: int) -> Array:
        return self.box.probes(self.archive.F, self._seed + number)

    def _nearest(self, f: Array) -> Array:
        """Index of the refined member with the nearest scaled objectives, for each row of f."""
        nearest: Array = np.abs(f[:, None] - self._known).max(axis=2).argmin(axis=1)
        return nearest

    def _finish(self, run: Lockstep, starts: Array) -> None:
        """Add feasible ends to the archive; move infeasible ones back towards their starts first."""
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
        """Evaluate points with the original problem and add them to the archive; returns which are feasible."""
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
