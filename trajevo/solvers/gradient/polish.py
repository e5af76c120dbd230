"""Memetic refinement of a front: anchors found exactly, members refined by gradients, gaps filled between them.

The evolution spreads, gradients converge: a few members that cover most of what the front dominates go to the limit
along directions of their own (:mod:`trajevo.solvers.gradient.batch_sqp`), and points between and beyond those that are
there already are all but optimal, since the decision vectors of neighbours lie on a smooth sheet.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, final

import numpy as np

from trajevo.base.arrays import Array, one_blas_thread
from trajevo.base.signals import Stopping
from trajevo.errors import InvalidInputError, NoSolutionError, TrajevoError
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.front.archive import Archive
from trajevo.front.covering import ReferenceBox, covering, gaps, neighbours
from trajevo.front.front import Front
from trajevo.solvers.gradient.batch_sqp import Lockstep
from trajevo.solvers.gradient.scaling import Columns, Scaled
from trajevo.solvers.gradient.sqp import differentiated, random_starts

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


#: How often gaps are filled in every round.
_FILLINGS = 2

#: Members that are refined for the seeds of an evolution.
_SEEDING_MEMBERS = 8


@final
@dataclass(frozen=True, eq=False)
class Polished:
    """A polished front and what that brought.

    Attributes:
        front: every feasible point that nothing dominates, of the original front and of those found.
        original: the front as it was.
        hypervolume_before: share of the front's reference box that the original dominates.
        hypervolume_after: share that the polished one dominates.
        kept: members of the original that nothing dominates still.
        refined: members that went through the gradient solver, anchors included.
        gradients: points at which gradients were evaluated.
        evaluations: points that were evaluated without.
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
    """Refine a front by gradients: none of its members is lost, unless something dominates it.

    In every round the members that cover most of the reference box are refined, each so that all objectives fall by the
    same factor (:mod:`trajevo.solvers.gradient.batch_sqp`); in the first one the least of each objective, and of the
    paper's weighted sum where there is one, is sought with them, from the member that has the least. Then gaps are
    filled by points on the lines through neighbours. Members whose refinement fails stay as they are. An interrupt from
    the keyboard or SIGTERM ends it before the next step: what was found by then counts, and the front is marked as
    interrupted; a second one aborts.

    Args:
        front: of a problem with gradients and two objectives or more.
        members: refined in every round.
        rounds: how many.
        seed: of the points by which shares of the box are counted; the front's own if None.
        evaluations: how many, a gradient counted as one for each variable, after which no further step is begun; no
            limit if None.
        cpu_time: CPU time after which no further step is begun [s]; no limit if None.

    Returns:
        The polished front, the original and the gain. The polished front's history has one entry more than the
        original's; its settings tell of the gain under ``"polish"``.

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
        before, after = work.box.hypervolume(front.F), work.box.hypervolume(work.archive.F)
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
    """New members of a front that a few refined ones bring, for an evolution to go on with.

    Args:
        front: of a problem with gradients and two objectives or more, not empty.
        seed: of the points by which shares of the box are counted.
        most: how many at most; those that cover most of the box.

    Returns:
        Decision vectors, shape (N, n_var), N at most ``most``, and the evaluations that they cost, a gradient as many
        as there are variables.
    """
    work = Refinement(front, seed, lambda cost, share: False)
    work.refine(_SEEDING_MEMBERS, 0)
    work.fill()
    new = work.news()
    chosen = covering(work.archive.F[new], work.box.probes(work.archive.F, seed), most)
    return work.archive.X[new][chosen], work.cost


def _booked(work: Refinement, original: Front, told: dict[str, Any], seconds: float, stopped_by: str) -> Front:
    """The archive as a front, what it cost added to the original's books."""
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
    """A limit of CPU time [s].

    Raises:
        InvalidInputError: no positive number.
    """
    if isinstance(seconds, bool) or not isinstance(seconds, int | float) or not 0.0 < seconds < np.inf:
        raise InvalidInputError(f"cpu_time: expected a positive time [s], got {seconds!r}")
    return float(seconds)


def check_polishable(problem: TrajectoryProblem) -> None:
    """Refuse a problem that cannot be polished.

    Raises:
        InvalidInputError: it has no gradients, or a single objective.
    """
    if problem.n_obj < 2:
        raise InvalidInputError("polish: a front needs two objectives or more; one is for minimise_weighted")
    middle, form = 0.5 * (problem.xl + problem.xu)[None], problem.smooth
    try:
        if form is None:
            problem.evaluate_with_gradients(middle)
        else:
            form.problem.evaluate_with_gradients(form.into(middle))
    except TrajevoError as error:
        raise InvalidInputError(f"polish: needs gradients, and the problem has none: {error}") from error
    except Exception:  # noqa: BLE001 - what complex numbers break, finite differences take the place of
        pass


def _whole(name: str, value: Any, least: int) -> int:
    if not isinstance(value, int | np.integer) or isinstance(value, bool) or value < least:
        raise InvalidInputError(f"{name}: expected a whole number of at least {least}, got {value!r}")
    return int(value)
