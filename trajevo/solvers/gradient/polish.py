"""Polish a front: find the anchors exactly, refine members by gradients, and fill the gaps between them.

Evolution spreads a front, gradients converge. A few members that dominate most of what the front dominates are refined,
each along its own direction (:mod:`trajevo.solvers.gradient.batch_sqp`). Points between and beyond refined neighbours
are then nearly optimal, since the decision vectors of neighbours lie on a smooth surface. :func:`polish` refines a
finished front, :func:`seeds` gives refined members to an evolution; both are steps of a :class:`Refinement`.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, final
from weakref import WeakSet

import numpy as np

from trajevo.base.arrays import Array, one_blas_thread
from trajevo.base.signals import Stopping
from trajevo.errors import InvalidInputError, NoSolutionError, TrajevoError
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.front.archive import Archive
from trajevo.front.covering import ReferenceBox, between, covering, gaps, neighbours
from trajevo.front.front import Front
from trajevo.solvers.gradient.anchors import ended, slowed
from trajevo.solvers.gradient.batch_sqp import Lockstep
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
    """

    def __init__(self, front: Front, seed: int, stop: Callable[[int, float], bool]) -> None:
        problem, corner = front.problem, front.history.reference_point
        self.box = box = ReferenceBox.of(front.F, None if corner is None else np.array(corner))
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
        if anchors:
            self._end_anchors(run.converged[: f.shape[1]])

    def _end_anchors(self, converged: Array) -> None:
        """Bring anchors to an end that the lockstep left before."""
        size = int(self._problem.n_var)
        for column in np.flatnonzero(~converged):
            best = self._scaled.columns(self.archive.F)[:, column].argmin()
            x = self._scaled.outside(self._inside(self.archive.X[[best]]))[0]
            weights = self._scaled.columns.weights[column]
            end, gradients = ended(
                self._smooth, weights, x, lambda n: self._stop(self.cost + n * size, _UNTIL_ANCHORED)
            )
            self._scaled.gradients += gradients
            if end is not None:
                self._add(slowed(self._scaled, self._smooth, end))

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


#: How often gaps are filled in every round.
_FILLINGS = 2

#: Number of members that are refined each time during an evolution.
_SEEDING_MEMBERS = 8


@final
@dataclass(frozen=True, eq=False)
class Polished:
    """A polished front and the gain.

    Attributes:
        front: non-dominated feasible points of the original front and of those found.
        original: the original front.
        hypervolume_before: share of the front's reference box that the original front dominates.
        hypervolume_after: share that the polished front dominates.
        kept: number of members of the original front that are still non-dominated.
        refined: number of members refined by the gradient solver, anchors included.
        gradients: points at which gradients were evaluated.
        evaluations: points that were evaluated without gradients.
        seconds: CPU time of the process [s].
    """

    front: Front
    original: Front
    hypervolume_before: float
    hypervolume_after: float
    kept: int
    refined: int
    gradients: int
    evaluations: int
    seconds: float

    def __str__(self) -> str:
        return (
            f"hypervolume {self.hypervolume_before:.5f} -> {self.hypervolume_after:.5f}, "
            f"{len(self.original)} -> {len(self.front)} members, of which {self.kept} were there before; "
            f"{self.refined} refined with {self.gradients} gradients, {self.evaluations} evaluations, "
            f"{self.seconds:.2f} s of CPU time"
        )


def polish(
    front: Front,
    *,
    members: int = 10,
    rounds: int = 2,
    seed: int | None = None,
    evaluations: int | None = None,
    cpu_time: float | None = None,
) -> Polished:
    """Refine a front by gradients; a member is lost only if a new point dominates it.

    In every round the members that cover most of the reference box are refined, each so that all its objectives fall by
    the same factor (:mod:`trajevo.solvers.gradient.batch_sqp`). The first round also seeks the minimum of each
    objective, and of the paper's weighted sum if there is one, from the member with the least value. Then gaps are
    filled by points on the lines through neighbours. Members whose refinement fails stay as they are.

    An interrupt from the keyboard or SIGTERM ends polishing before the next step: what was found by then is kept, and
    the front is marked as interrupted. A second one aborts.

    Args:
        front: front of a problem with gradients and at least two objectives.
        members: number of members refined in every round.
        rounds: number of rounds.
        seed: seed of the sample points with which shares of the box are estimated; the seed of the run if None.
        evaluations: number of evaluations, a gradient counted as one per variable, after which no further step is
            begun; no limit if None.
        cpu_time: CPU time after which no further step is begun [s]; no limit if None.

    Returns:
        The polished front, the original and the gain. The polished front's history has one entry more than the
        original's; its settings describe the gain under ``"polish"``.

    Raises:
        InvalidInputError: a problem without gradients or with a single objective, or numbers that cannot be used.
        NoSolutionError: the front is empty.
    """
    if not isinstance(front, Front):
        raise InvalidInputError(f"front: expected a Front, got {type(front).__name__}")
    members, rounds = _whole("members", members, 1), _whole("rounds", rounds, 1)
    seed = front.run.seed if seed is None else _whole("seed", seed, 0)
    seconds = np.inf if cpu_time is None else checked_cpu_time(cpu_time)
    most = np.inf if evaluations is None else _whole("evaluations", evaluations, 1)
    check_polishable(front.problem)
    if not len(front):
        raise NoSolutionError(f"the front is empty: {front.blocking}")
    began, clock = time.process_time(), time.perf_counter()
    with one_blas_thread(), Stopping() as stopping:
        work = Refinement(
            front,
            seed,
            lambda cost, share: (
                bool(stopping) or cost >= share * most or time.process_time() - began >= share * seconds
            ),
        )
        for number in range(rounds):
            work.refine(members, number, anchors=number == 0)
            for _ in range(_FILLINGS):
                work.fill()
        before = work.box.hypervolume(front.F)
        # The archive dominates all that the front does; only rounding could tell a smaller volume.
        after = max(before, work.box.hypervolume(work.archive.F))
    counts: dict[str, Any] = {
        "hypervolume_before": before,
        "hypervolume_after": after,
        "kept": work.kept(),
        "refined": work.refined,
        "gradients": work.gradients,
        "evaluations": work.evaluations,
        "seconds": time.process_time() - began,
    }
    told = {"members": members, "rounds": rounds, "seed": seed, "gradients by": work.kind} | counts
    polished = _booked(work, front, told, time.perf_counter() - clock, stopping.asked_by)
    return Polished(polished, front, **counts)


def seeds(front: Front, *, seed: int, most: int) -> tuple[Array, int]:
    """New members of a front, found by refining a few members, with which an evolution can continue.

    Args:
        front: a front that is not empty, of a problem with gradients and at least two objectives.
        seed: seed of the sample points with which shares of the box are estimated.
        most: greatest number of new members; those that cover most of the box are chosen.

    Returns:
        Decision vectors, shape (N, n_var) with N at most ``most``, and the number of evaluations, a gradient counted as
        one per variable.
    """
    work = Refinement(front, seed, lambda cost, share: False)
    work.refine(_SEEDING_MEMBERS, 0)
    work.fill()
    new = work.news()
    chosen = covering(work.archive.F[new], work.box.probes(work.archive.F, seed), most)
    return work.archive.X[new][chosen], work.cost


def _booked(work: Refinement, original: Front, told: dict[str, Any], seconds: float, stopped_by: str) -> Front:
    """The archive as a front; the cost of polishing is added to the run and the history of the original front."""
    run, history, archive = original.run, original.history, work.archive
    volume = 0.0 if history.reference_point is None else told["hypervolume_after"]
    spent = run.cpu_seconds[-1] if run.cpu_seconds else 0.0
    return replace(
        original,
        X=archive.X,
        F=archive.F,
        G=archive.G,
        run=run.model_copy(
            update={
                "settings": run.settings | {"polish": told},
                "evaluations": run.evaluations + work.cost,
                "interrupted": run.interrupted or bool(stopped_by),
                "stopped_by": run.stopped_by or stopped_by,
                "seconds": run.seconds + seconds,
                "cpu_seconds": (*run.cpu_seconds, spent + told["seconds"]),
            }
        ),
        history=history.model_copy(
            update={
                "evaluations": (*history.evaluations, history.evaluations[-1] + work.cost),
                "hypervolume": history.hypervolume.followed_by(volume),
                "least_violation": (*history.least_violation, 0.0),
                "front_size": (*history.front_size, len(archive.F)),
            }
        ),
    )


def checked_cpu_time(seconds: Any) -> float:
    """Check a limit of CPU time [s].

    Raises:
        InvalidInputError: not a positive number.
    """
    if isinstance(seconds, bool) or not isinstance(seconds, int | float) or not 0.0 < seconds < np.inf:
        raise InvalidInputError(f"cpu_time: expected a positive time [s], got {seconds!r}")
    return float(seconds)


#: Problems that can be polished, as long as they exist: a run asks several times.
_polishable: WeakSet[TrajectoryProblem] = WeakSet()


def check_polishable(problem: TrajectoryProblem) -> None:
    """Refuse a problem that cannot be polished.

    Raises:
        InvalidInputError: it has no gradients, or a single objective.
    """
    if problem in _polishable:
        return
    if problem.n_obj < 2:
        raise InvalidInputError("polish: a front needs two objectives or more; for one, use minimise_weighted")
    middle, form = 0.5 * (problem.xl + problem.xu)[None], problem.smooth
    try:
        if form is None:
            problem.evaluate_with_gradients(middle)
        else:
            form.problem.evaluate_with_gradients(form.into(middle))
    except TrajevoError as error:
        raise InvalidInputError(f"polish: needs gradients, and the problem has none: {error}") from error
    _polishable.add(problem)


def _whole(name: str, value: Any, least: int) -> int:
    if not isinstance(value, int | np.integer) or isinstance(value, bool) or value < least:
        raise InvalidInputError(f"{name}: expected a whole number of at least {least}, got {value!r}")
    return int(value)
