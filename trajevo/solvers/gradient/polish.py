"""Memetic refinement of a front: anchors found exactly, members refined by gradients, gaps filled between them.

The evolution spreads, gradients converge: a few members that cover most of what the front dominates go to the limit
along directions of their own (:mod:`trajevo.lockstep`), and points between and beyond those that are there already
are all but optimal, since the decision vectors of neighbours lie on a smooth sheet.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np

from trajevo.arrays import Array, one_blas_thread
from trajevo.covering import covering
from trajevo.errors import InvalidInputError, NoSolutionError, TrajevoError
from trajevo.front import Front
from trajevo.problem import TrajectoryProblem
from trajevo.refinement import Refinement
from trajevo.stopping import Stopping

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
    same factor (:mod:`trajevo.lockstep`); in the first one the least of each objective, and of the paper's weighted sum
    where there is one, is sought with them, from the member that has the least. Then gaps are filled by points on the
    lines through neighbours. Members whose refinement fails stay as they are. An interrupt from the keyboard or SIGTERM
    ends it before the next step: what was found by then counts, and the front is marked as interrupted; a second one
    aborts.

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
