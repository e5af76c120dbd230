"""The refinement of a front: anchors, members, and points in the gaps between them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.front.archive import Archive
from trajevo.front.covering import ReferenceBox, between, covering, gaps, neighbours
from trajevo.front.front import Front
from trajevo.solvers.gradient.anchors import AnchorSearch, Found, many_valleys, slowed
from trajevo.solvers.gradient.batch_sqp import Lockstep
from trajevo.solvers.gradient.minimax import in_terms_alone, least_of_terms
from trajevo.solvers.gradient.optimality import Anchor, residual
from trajevo.solvers.gradient.scaling import Columns, Scaled

#: Greatest number of steps of an anchor, and promised decrease (of a logarithm) below which it is done.
_ANCHOR_STEPS, _ANCHOR_TOLERANCE = 150, 1e-9

#: The same for other members.
_STEPS, _TOLERANCE = 30, 1e-3

#: Steps after which members are added on their way, where what is good counts early.
_NOTED = 4

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

#: Where there are many valleys: merits before that bold steps are compared with, and greatest curvature of directions
#: that no step has gone along.
_MEMORY, _STIFFEST = 3, 1.0

#: Members all over the front from which the least of a column is sought there; shares of them that take steps, and how
#: many, one after another; difference of values that count as the same optimum.
_SPREAD, _STAGES, _SAME = 12, ((1.0, 20), (0.5, 30), (0.25, 40)), 1e-3

#: Middles of gaps that are refined when gaps are filled there, with so many steps, unless they exceed a limit by more
#: than this share of it.
_MIDDLES, _FEW_STEPS, _BEYOND = 20, 5, 0.5


class _Part(NamedTuple):
    """Members that are refined in the same way: starting points, their columns, and arguments of :class:`Lockstep`."""

    y: Array
    f: Array
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
        early: add what is good to the archive as soon as it is found, at some more cost.

    Attributes:
        archive: non-dominated feasible points of the front and of the refinement.
        box: the box in objective space in which the hypervolume is measured.
        kind: how gradients are computed, see :meth:`TrajectoryProblem.gradients_by`.
        refined: number of members refined by the gradient solver.
        anchors: the least of every objective and weighted sum, and how near it is to an optimum.
    """

    def __init__(self, front: Front, seed: int, stop: Callable[[int, float], bool], *, early: bool = False) -> None:
        problem, corner = front.problem, front.history.reference_point
        self.box = box = ReferenceBox.of(front.F, None if corner is None else np.array(corner))
        self._original, self._problem, self._seed, self._stop = front, problem, seed, stop
        self.archive = Archive(problem.n_var, problem.n_obj, problem.n_ieq_constr)
        self.archive.add(front.X, front.F, front.G)
        self.refined = self._evaluations = self._steps = 0
        self.anchors: list[Anchor] = []
        self._early, self._many_valleys, self._slower = early, False, np.empty((0, 0))
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

    def refine(self, members: int, number: int, *, anchors: bool = False, exact: bool = True) -> None:
        """Refine the members that cover most of the box; after the first round also points in the widest gaps.

        Args:
            members: greatest number of members.
            number: number of the round, from 0.
            anchors: also seek the minimum of every objective and weighted sum, from the member with the least value.
            exact: seek minima in other valleys too, and to the end; else no further than other members are refined.
        """
        if self._stop(self.cost, _UNTIL_REFINED) or (self._early and anchors and exact and self._descended_in_terms()):
            return
        elsewhere = self._explored() if anchors and exact else {}
        y, f = self._starts(members, number)
        single = np.arange(f.shape[1]) < self._problem.n_obj
        parts = [_Part(y, f, np.where(single, f, np.inf), _SHARE, _STEPS, _TOLERANCE, 0)]
        if anchors:
            parts.insert(0, self._anchors(exact=exact))
        y, f, reference = (np.concatenate([part[k] for part in parts]) for k in range(3))
        share, steps, tolerance, restarts = (
            np.concatenate([np.full(len(part.y), part[k]) for part in parts]) for k in range(3, 7)
        )
        steps[list(elsewhere)] = 0
        run = self._lockstep(
            y,
            reference,
            share,
            curvature=self._curvature[self._nearest(f)] if len(self._known) else None,
            radius=0.5 if number == 0 else _NEAR,
            restarts=restarts + self._many_valleys,
        )
        until = _UNTIL_ANCHORED if anchors else _UNTIL_REFINED
        run.run(steps, tolerance, lambda: self._noted(run) or self._stop(self.cost, until))
        self._finish(run, y)
        if anchors and exact:
            self._end_anchors(run.converged[: f.shape[1]], elsewhere)

    def _noted(self, run: Lockstep) -> bool:
        """Where what is good counts early, add what every few steps have come to; never a reason to stop."""
        self._steps += 1
        if self._early and self._steps % _NOTED == 0:
            self._add(run.safe)
        return False

    def _descended_in_terms(self) -> bool:
        """Descend to the least of a single objective that is a maximum; whether that came to its end.

        Then there is nothing to refine: the front is one member.
        """
        if not in_terms_alone(self._problem):
            return False
        found = least_of_terms(
            self._problem,
            self.archive.X[0],
            float(self.archive.F[0, 0]),
            _MARGIN,
            tell=lambda X: self._add(self._inside(X)),
            stop=lambda g, e: self._stop(self.cost + g * int(self._problem.n_var) + e, _UNTIL_ANCHORED),
        )
        self._scaled.gradients += found.gradients
        self._evaluations += found.evaluations
        return found.converged

    def _starts(self, members: int, number: int) -> tuple[Array, Array]:
        """Members and points of gaps to be refined in a round, in scaled variables (M, n_var), and their columns."""
        chosen = covering(self.archive.F, self._probes(number), members)
        y, f = self._inside(self.archive.X[chosen]), self._scaled.columns(self.archive.F[chosen])
        if number and len(chosen) > 1:
            y = np.concatenate([y, between(y, self._gaps(chosen, members), members)])
            f = np.concatenate([f, self._scaled.values(y[len(f) :])[0]])
        if len(self._slower):
            y = np.concatenate([y, self._slower])
            f = np.concatenate([f, self._scaled.values(self._slower)[0]])
            self._slower = self._slower[:0]
        return y, f

    def _gaps(self, chosen: Array, most: int) -> Array:
        """The widest gaps between members, as pairs of them, (pairs, 2)."""
        return gaps(self._scaled.columns(np.minimum(self.archive.F[chosen], self._reach.corner)), most)

    def _lockstep(
        self,
        y: Array,
        reference: Array,
        share: Array,
        *,
        curvature: Array | None = None,
        radius: float = 0.5,
        restarts: Array | int = 0,
    ) -> Lockstep:
        single = np.arange(reference.shape[1]) < self._problem.n_obj
        return Lockstep(
            self._scaled,
            y,
            reference=reference,
            augmentation=share[:, None] * single,
            curvature=curvature,
            radius=radius,
            restarts=restarts,
            bold=self._many_valleys,
            memory=_MEMORY,
            stiffest=_STIFFEST if self._many_valleys else np.inf,
        )

    def _explored(self) -> dict[int, Found]:
        """What was found for times sought from many starts, since the front's ends may lie in the wrong valley.

        Where there are such, they come first, then all other columns from them: a front that begins elsewhere is not
        worth refining.
        """
        least = self._scaled.columns(self.archive.F).argmin(axis=0)
        pairs = zip(self._scaled.columns.weights, self.archive.X[least], strict=True)
        times = [k for k, (weights, x) in enumerate(pairs) if self._of_time(weights) and many_valleys(self._problem, x)]
        self._many_valleys = bool(times)
        found = {column: self._sought(column, explore=True) for column in times}
        others = [k for k in range(len(least)) if k not in found] if found else []
        return found | {column: self._descended(column) for column in others}

    def _descended(self, column: int) -> Found:
        """Descend to the least of a column from members all over the front; the worse half is given up twice."""
        best = self._scaled.columns(self.archive.F)[:, column].argmin()
        chosen = np.array(sorted({int(best), *map(int, covering(self.archive.F, self._probes(0), _SPREAD))}))
        y, f = self._inside(self.archive.X[chosen]), self._scaled.columns(self.archive.F[chosen])
        reference = np.where(np.arange(f.shape[1]) == column, f, np.inf)
        run = self._lockstep(y, reference, np.full(len(y), _ANCHOR_SHARE), restarts=_ANCHOR_RESTARTS)
        tolerance = np.full(len(y), _ANCHOR_TOLERANCE)
        for share, steps in _STAGES:
            rank = (run.merit + f[:, column]).argsort(kind="stable").argsort(kind="stable")
            going = np.where(rank < share * len(y), steps, 0)
            run.run(going, tolerance, lambda: self._stop(self.cost, _UNTIL_ANCHORED))
        self._finish(run, y)
        merit = run.merit + f[:, column]
        return Found(None, len(y), int((merit <= merit.min() + _SAME).sum()), 0, 0, self.archive.X[:0])

    def _end_anchors(self, converged: Array, elsewhere: Mapping[int, Found]) -> None:
        """End anchors that the lockstep left before, and judge all of them."""
        for column in range(len(converged)):
            found = elsewhere.get(column, Found(None, 1, 1, 0, 0, self.archive.X[:0]))
            if column not in elsewhere and not converged[column]:
                found = self._sought(column, explore=False)
            least = self._scaled.columns(self.archive.F)[:, column].argmin()
            self.anchors.append(self._judged(column, self.archive.X[least], found))

    def _of_time(self, weights: Array) -> bool:
        """Whether weights (n_obj,) are those of a time alone, which is cheap to evaluate and has many valleys."""
        units = [each.unit for each, weight in zip(self._problem.objectives, weights, strict=True) if weight]
        return self._problem.smooth is None and units == ["s"]

    def _sought(self, column: int, *, explore: bool) -> Found:
        """Search for an anchor from members, the best first, and add what is found with slower copies."""
        weights = self._scaled.columns.weights[column]
        members = self.archive.X[self._scaled.columns(self.archive.F)[:, column].argsort(kind="stable")]
        plain = self._problem.smooth is None
        problem, size = self._problem if plain else self._smooth, int(self._problem.n_var)
        search = AnchorSearch(
            problem,
            weights,
            self._seed,
            lambda g, e: self._stop(self.cost + g * size + e, _UNTIL_ANCHORED),
            early=(lambda x: self._add(slowed(self._scaled, self._smooth, x))) if self._early else None,
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
        for x in found.valleys:
            self._add(slowed(self._scaled, self._smooth, x))
        return found

    def _judged(self, column: int, x: Array, found: Found) -> Anchor:
        """How near the best point of a column is to an optimum."""
        weights = self._scaled.columns.weights[column]
        names = [each.name for each, weight in zip(self._problem.objectives, weights, strict=True) if weight]
        y = self._inside(x[None])
        left = residual(self._scaled, y[0], column)
        F = self._problem.evaluate(x[None], return_values_of=["F"])[0]
        return Anchor(" + ".join(names), float(F @ weights), left, found.starts, found.agreeing)

    def _anchors(self, *, exact: bool) -> _Part:
        f = self._scaled.columns(self.archive.F)
        reference = np.where(np.eye(f.shape[1], dtype=bool), f.min(axis=0), np.inf)
        least = f.argmin(axis=0)
        how = (_ANCHOR_STEPS, _ANCHOR_TOLERANCE, _ANCHOR_RESTARTS) if exact else (_STEPS, _TOLERANCE, 0)
        return _Part(self._inside(self.archive.X[least]), f[least], reference, _ANCHOR_SHARE, *how)

    def fill(self) -> None:
        """Evaluate points on the lines through neighbours, between and beyond them."""
        chosen = covering(self.archive.F, self._probes(0), _MEMBERS_OF_GAPS)
        if len(chosen) < 2 or self._stop(self.cost, 1.0):
            return
        pairs = neighbours(self._scaled.columns(self.archive.F[chosen]), _NEIGHBOURS)
        y = self._inside(self.archive.X[chosen])
        first, second = y[pairs[:, 0]], y[pairs[:, 1]]
        self._add(np.concatenate([(1.0 - share) * first + share * second for share in _SHARES]))
        if self._many_valleys:
            self._bridge()

    def _bridge(self) -> None:
        """Refine middles of the widest gaps by a few steps, since lines leave limits that bind all over."""
        chosen = covering(self.archive.F, self._probes(0), _MEMBERS_OF_GAPS)
        if len(chosen) < 2 or self._stop(self.cost, 1.0):
            return
        y, pairs = self._inside(self.archive.X[chosen]), self._gaps(chosen, _MIDDLES)
        y = 0.5 * (y[pairs[:, 0]] + y[pairs[:, 1]])
        f, g = self._scaled.values(y)
        near = g.max(axis=1, initial=0.0) < _BEYOND
        if not near.any() or not len(self._known):
            return
        y, f = y[near], f[near]
        single = np.arange(f.shape[1]) < self._problem.n_obj
        reference, share = np.where(single, f, np.inf), np.full(len(y), _SHARE)
        run = self._lockstep(y, reference, share, curvature=self._curvature[self._nearest(f)], radius=_NEAR)
        steps, tolerance = np.full(len(y), _FEW_STEPS), np.full(len(y), _TOLERANCE)
        run.run(steps, tolerance, lambda: self._stop(self.cost, 1.0))
        self._finish(run, y)

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
        return self._reach.probes(self.archive.F, self._seed + number)

    @property
    def _reach(self) -> ReferenceBox:
        """The box in which members are chosen: beyond that of an evolved front whose valley was left, most gaps are."""
        return ReferenceBox.of(self.archive.F, None) if self._many_valleys else self.box

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
