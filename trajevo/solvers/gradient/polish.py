"""Polish a front: find the anchors exactly, refine members by gradients, and fill the gaps between them.

Evolution spreads a front, gradients converge. A few members that dominate most of what the front dominates are refined,
each along its own direction (:mod:`trajevo.solvers.gradient.batch_sqp`). Points between and beyond refined neighbours
are then nearly optimal, since the decision vectors of neighbours lie on a smooth surface. :func:`polish` refines a
finished front, :func:`seeds` and :func:`polished_between` give refined members to an evolution; all are steps of a
:class:`~trajevo.solvers.gradient.refinement.Refinement`.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, final
from weakref import WeakSet

import numpy as np

from trajevo.base.arrays import Array, one_blas_thread
from trajevo.base.shown.bar import Steps
from trajevo.base.shown.brief import brief
from trajevo.base.signals import Stopping
from trajevo.errors import InvalidInputError, NoSolutionError, TrajevoError
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.front.covering import covering
from trajevo.front.front import Front
from trajevo.solvers.gradient.optimality import Anchor
from trajevo.solvers.gradient.refinement import Refinement

#: Members that are refined in a round unless another number is given.
_MEMBERS = 10

#: How often gaps are filled in every round.
_FILLINGS = 2

#: The same in a short polish, which no round follows: it takes little and brings a front to 99 % of what it can be.
_FILLINGS_BETWEEN = 4

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
        anchors: the least of every objective, and how near it is to an optimum.
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
    anchors: tuple[Anchor, ...] = ()

    __repr__ = brief

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
    members: int = _MEMBERS,
    rounds: int = 2,
    seed: int | None = None,
    evaluations: int | None = None,
    cpu_time: float | None = None,
    progress: bool = True,
) -> Polished:
    """Refine a front by gradients; a member is lost only if a new point dominates it.

    In every round the members that cover most of the reference box are refined, each so that all its objectives fall by
    the same factor (:mod:`trajevo.solvers.gradient.batch_sqp`). The first round also seeks the minimum of each
    objective, and of the paper's weighted sum if there is one, from the member with the least value. Then gaps are
    filled by points on the lines through neighbours. Members whose refinement fails stay as they are.

    An interrupt from the keyboard or SIGTERM ends polishing before the next step: what was found by then is kept, and
    the front is marked as interrupted. A second one aborts.

    Args:
        front: front of a problem with gradients.
        members: number of members refined in every round.
        rounds: number of rounds.
        seed: seed of the sample points with which shares of the box are estimated; the seed of the run if None.
        evaluations: number of evaluations, a gradient counted as one per variable, after which no further step is
            begun; no limit if None.
        cpu_time: CPU time after which no further step is begun [s]; no limit if None.
        progress: show the steps in a notebook, in the output of the cell; nothing is shown elsewhere.

    Returns:
        The polished front, the original and the gain. The polished front's history has one entry more than the
        original's; its settings describe the gain under ``"polish"``.

    Raises:
        InvalidInputError: a problem without gradients, or numbers that cannot be used.
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
        shown = Steps(rounds * (1 + _FILLINGS), enabled=progress)
        for number in range(rounds):
            work.refine(members, number, anchors=number == 0)
            shown.step(f"steps of polishing, {len(work.archive.F)} members")
            for _ in range(_FILLINGS):
                work.fill()
                shown.step(f"steps of polishing, {len(work.archive.F)} members")
        before = work.box.hypervolume(front.F)
        # The archive dominates all that the front does; only rounding could tell a smaller volume.
        after = max(before, work.box.hypervolume(work.archive.F))
        shown.end(f"steps of polishing, hypervolume {before:.5f} -> {after:.5f}, {len(work.archive.F)} members")
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
    told["anchors"] = [anchor.settings for anchor in work.anchors]
    polished = _booked(work, front, told, time.perf_counter() - clock, stopping.asked_by)
    return Polished(polished, front, **counts, anchors=tuple(work.anchors))


def seeds(front: Front, *, seed: int, most: int) -> tuple[Array, int]:
    """New members of a front, found by refining a few members, with which an evolution can continue.

    Args:
        front: a front that is not empty, of a problem with gradients.
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


def polished_between(
    front: Front, *, seed: int, cpu_time: float, stop: Callable[[], bool] = lambda: False
) -> tuple[Array, Array, Array, int]:
    """What a short polish adds to a front while its evolution waits: one round, whose anchors need not be exact.

    The least of a single objective is sought to the end, in other valleys too: there is no front beside it to gain.

    Args:
        front: a front that is not empty, of a problem with gradients.
        seed: seed of the sample points with which shares of the box are estimated.
        cpu_time: CPU time after which no further step is begun [s].
        stop: called before every step; no further one is begun if it returns True.

    Returns:
        Decision vectors (N, n_var), objectives (N, n_obj) and constraints (N, n_constr) of members that are new, and
        the number of evaluations, a gradient counted as one per variable.
    """
    began = time.process_time()
    work = Refinement(
        front, seed, lambda cost, share: stop() or time.process_time() - began >= share * cpu_time, early=True
    )
    work.refine(_MEMBERS, 0, anchors=True, exact=front.problem.n_obj == 1)
    for _ in range(_FILLINGS_BETWEEN):
        work.fill()
    new = work.news()
    return work.archive.X[new], work.archive.F[new], work.archive.G[new], max(work.cost, 1)


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
        InvalidInputError: it has no gradients.
    """
    if problem in _polishable:
        return
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
