"""The generations of a run: evolve, record the history, and write checkpoints from which the run can be resumed."""

from __future__ import annotations

import copy
import json
import math
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, final

import numpy as np
from pymoo.core.algorithm import Algorithm
from pymoo.core.evaluator import Evaluator

from trajevo.base.arrays import Array, one_blas_thread
from trajevo.base.files import why_not
from trajevo.base.plain import from_json
from trajevo.base.signals import Stopping
from trajevo.errors import InvalidInputError
from trajevo.formulation.feasibility.findings import Finding
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.front.books import Books
from trajevo.front.covering import ReferenceBox, covering
from trajevo.front.front import Front
from trajevo.front.records import Blocking, versions_since
from trajevo.solvers.evolutionary.algorithm_state import restore, state
from trajevo.solvers.gradient.polish import polished_between, seeds
from trajevo.solvers.run.folder import Manifest, RunFolder, block_of
from trajevo.solvers.run.progress import reporter
from trajevo.solvers.run.turns import Turns

#: Share of the time that checkpoints may take: after one that took 2 ms the next waits for 0.2 s.
_SHARE = 0.01
#: Time after which the first checkpoint is due [s]; a run that ends earlier is begun anew in no more time.
_FIRST_DUE = 0.2
#: Bytes of evaluated individuals in memory at which a checkpoint is written even if none is due.
_MOST_WAITING = 2**23
#: Time after which a failed write is tried again [s].
_TRY_AGAIN = 5.0
#: Bytes that a run needs besides its evaluated individuals: front, pictures, report.
_BESIDES = 2**24


def evolve(
    problem: TrajectoryProblem,
    solver: Algorithm,
    manifest: Manifest,
    *,
    folder: RunFolder | None,
    progress: bool,
    cpu_spent: float = 0.0,
) -> Front:
    """Run an algorithm to its end, or to the end of the generation in which a signal asks it to stop.

    Args:
        problem: what to solve.
        solver: an algorithm that was set up as the manifest says and has not run.
        manifest: settings of the run.
        folder: folder of the run, which contains the manifest; the run continues from its latest checkpoint, if there
            is one. None if nothing is to be kept.
        progress: show generation, hypervolume, least violation and time left on standard error.
        cpu_spent: CPU time that a new run has already taken [s].

    Returns:
        The front.

    Raises:
        InvalidInputError: a checkpoint from which the run cannot be resumed, or too little disk space for the run.
    """
    books, evaluator = Books(problem), Evaluator()
    watched = copy.copy(problem) if manifest.time_limit is None else problem.under_time_limit(manifest.time_limit)
    solver.setup(watched, termination=("n_gen", manifest.generations), seed=manifest.seed, evaluator=evaluator)
    keeper = _Keeper(books, solver, manifest, folder, cpu_spent)
    watched.callback = keeper.collect
    keeper.go_on()
    shown = reporter(manifest.generations, enabled=progress, done=len(books.evaluations))
    try:
        with shown, one_blas_thread(), warnings.catch_warnings(), Stopping() as stopping:
            # RVEA's angle between a point and its own direction may be NaN by rounding, with the effect of 0.
            warnings.filterwarnings("ignore", "invalid value encountered in arccos", RuntimeWarning, r"pymoo\.")
            heard = list(warnings.filters)
            while not keeper.used_up() and solver.has_next() and not stopping:
                polishing = _next(solver, books, keeper, stop=lambda: bool(stopping))
                if warnings.filters != heard:
                    # pymoo's NSGA-III silences all warnings of Python, including ours.
                    warnings.filters = list(heard)
                number, cpu_seconds = len(books.evaluations) + 1, keeper.cpu_seconds()
                shown.update(books.close(number, evaluator.n_eval, polishing=polishing, cpu_seconds=cpu_seconds))
                keeper.generation_done()
            keeper.save()
    finally:
        if watched.time_limited is not None:
            watched.time_limited.close()
    return _front(
        books,
        manifest,
        evaluations=evaluator.n_eval,
        interrupted=bool(stopping) and solver.has_next(),
        stopped_by=stopping.asked_by if solver.has_next() else "",
        seconds=keeper.seconds(),
        resumed=keeper.resumed,
        last=True,
    )


def nothing_searched(problem: TrajectoryProblem, manifest: Manifest, reasons: Sequence[Finding]) -> Front:
    """The empty front of a problem for which no motion is possible, with the reasons; its history has one entry."""
    books = Books(problem)
    books.close(1, 0, cpu_seconds=0.0)
    front = _front(books, manifest, evaluations=0, interrupted=False, seconds=0.0)
    return replace(
        front,
        run=front.run.model_copy(update={"generations": 0}),
        blocking=Blocking(x=(), violations={}, impossible=tuple(map(str, reasons))),
    )


def front_so_far(problem: TrajectoryProblem, manifest: Manifest, folder: RunFolder) -> Front:
    """Front of a run at its latest checkpoint, without continuing the run.

    Raises:
        InvalidInputError: a file of the folder is damaged, or there is no checkpoint yet.
    """
    checkpoint = folder.checkpoint()
    if checkpoint is None:
        raise InvalidInputError(f"{folder.folder}: the run has not finished its first generation")
    books = Books(problem)
    seconds, resumed = _reopen(books, checkpoint, folder)
    return _front(
        books,
        manifest,
        evaluations=books.evaluations[-1],
        interrupted=len(books.evaluations) < manifest.generations,
        seconds=seconds,
        resumed=resumed,
    )


def _front(books: Books, manifest: Manifest, **how: Any) -> Front:
    """The front recorded so far, with algorithm, settings and seed from the manifest."""
    taken = Turns(books, manifest).taken
    named: dict[str, Any] = {
        "algorithm": manifest.algorithm_name,
        "settings": manifest.settings | ({"polished before": list(taken)} if taken else {}),
        "seed": manifest.seed,
        "versions": versions_since(manifest.versions),
        "kernels": manifest.kernels,
    }
    return books.front(**named, **how)


def _next(solver: Algorithm, books: Books, keeper: _Keeper, *, stop: Callable[[], bool]) -> int:
    """Run one generation, some of whose individuals are refined members of the front where the manifest asks for them.

    Returns:
        Evaluations spent on refining members, or on finding the first population.
    """
    manifest, done = keeper.manifest, len(books.evaluations)
    found, cost = np.empty((0, 0)), 0 if done else int(manifest.settings.get("starts_evaluations", 0))
    most = max(1, len(solver.pop) // 2) if done else 0
    if done and manifest.polish_every is not None and done % manifest.polish_every == 0 and len(books.archive.F):
        found, cost = seeds(keeper.front_now(), seed=manifest.seed + done, most=most)
        found = found if books.problem.expansion is None else books.problem.expansion.fold(found)
    elif done and keeper.turns.due:
        found, cost = keeper.polished_between(most, stop=stop)
    if not len(found):
        solver.next()
        return cost
    infills = solver.ask()
    if infills is not None:
        given = min(len(found), len(infills))
        infills[:given].set("X", found[:given])
        solver.evaluator.eval(solver.problem, infills, algorithm=solver)
    solver.tell(infills=infills)
    return cost


@final
class _Keeper:
    """Collects evaluated individuals for history and next block, and writes checkpoints when they are due."""

    def __init__(
        self, books: Books, solver: Algorithm, manifest: Manifest, folder: RunFolder | None, cpu_spent: float
    ) -> None:
        self.resumed: tuple[int, ...] = ()
        self._books, self._solver, self.manifest, self._folder = books, solver, manifest, folder
        self.turns = Turns(books, manifest)
        self._waiting: list[tuple[int, _Populations]] = []
        self._bytes, self._saved = 0, 0
        self._began = time.perf_counter()
        self._due = self._began + _FIRST_DUE
        self._cpu_began = time.process_time() - cpu_spent
        self._complained = False

    def seconds(self) -> float:
        """Wall time of the run so far, including the time before it was resumed [s]."""
        return time.perf_counter() - self._began

    def cpu_seconds(self) -> float:
        """CPU time of the run so far, including the time before it was resumed [s]."""
        return time.process_time() - self._cpu_began

    def used_up(self) -> bool:
        """Whether the evolution has used its share of evaluations or CPU time; never before its first generation."""
        share = self.turns.share
        evaluations, cpu_time = self.manifest.evaluations, self.manifest.cpu_time
        done = sum(self._books.evaluations[-1:]) + sum(self._books.polishing)
        enough = evaluations is not None and done >= share * evaluations
        if cpu_time is None:
            return enough
        # As recorded, so that a resumed run ends after the same generation.
        used = (self._books.cpu_seconds or [self.cpu_seconds()])[-1] / (share * cpu_time)
        if used < 1.0:
            self._plan(used)
        return enough or (used >= 1.0 and bool(self._books.evaluations))

    def front_now(self) -> Front:
        """The front of all individuals so far."""
        evaluations = self._books.evaluations[-1]
        return _front(self._books, self.manifest, evaluations=evaluations, interrupted=False, seconds=0.0)

    def polished_between(self, most: int, *, stop: Callable[[], bool]) -> tuple[Array, int]:
        """Polish the front for a short time and collect what is found, as if it were of the next generation.

        Args:
            most: greatest number of new members for the next generation; those that cover most of the box are chosen.
            stop: whether the run is to end.

        Returns:
            Decision vectors for the next generation, shape (N, n_var), and the number of evaluations.
        """
        front, seed = self.front_now(), self.manifest.seed + len(self._books.evaluations)
        X, F, G, cost = polished_between(front, seed=seed, cpu_time=self.turns.left, stop=stop)
        if not len(X):
            return X, cost
        box = ReferenceBox.of(F, self._books.reference_point)
        expansion, chosen = self._books.problem.expansion, covering(F, box.probes(F, seed), most)
        if expansion is not None:
            return expansion.fold(X[chosen]), cost
        self.collect(X, {"F": F, "G": G})
        # Those that are collected count as evaluated here, not as spent on finding them.
        self._solver.evaluator.n_eval += len(X)
        return X[chosen], max(cost - len(X), 1)

    def _plan(self, used: float) -> None:
        """Tell the algorithm how many generations to expect from the CPU time used; some adapt to their number."""
        done, termination = len(self._books.evaluations), self._solver.termination
        expected = min(math.ceil(done / used), self.manifest.generations) if used > 0.0 else self.manifest.generations
        termination.n_max_gen = max(expected, done + 1) if done < self.manifest.generations else done
        if done:
            termination.perc = done / termination.n_max_gen

    def collect(self, X: Array, out: dict[str, Any]) -> None:
        """Collect evaluated individuals; pymoo's problem calls this after every evaluation."""
        self._books.collect(X, out)
        if self._folder is None:
            return
        x, F, G = (np.array(np.atleast_2d(values), dtype=np.float64) for values in (X, out["F"], out["G"]))
        said = np.array([str(text) for text in np.atleast_1d(out.get("failure", [""] * len(x)))])
        self._waiting.append((len(self._books.evaluations) + 1, (x, F, G, said)))
        self._bytes += x.nbytes + F.nbytes + G.nbytes

    def go_on(self) -> None:
        """Restore history and algorithm from the latest checkpoint, if there is one."""
        if self._folder is None:
            return
        checkpoint = self._folder.checkpoint()
        if checkpoint is not None:
            seconds, resumed = _reopen(self._books, checkpoint, self._folder)
            try:
                restore(self._solver, _part(checkpoint, "solver."))
            except (LookupError, TypeError, ValueError, ArithmeticError, AttributeError) as error:
                raise InvalidInputError(
                    f"{self._folder.folder}: the run cannot be resumed from its checkpoint: {error}"
                ) from error
            self._saved = len(self._books.evaluations)
            self.resumed = (*resumed, self._saved) if self._solver.has_next() else resumed
            self._began -= seconds
            self._cpu_began = time.process_time() - self._books.cpu_seconds[-1]
        self._folder.forget_after(self._saved)
        self._needs_space(self._folder)

    def generation_done(self) -> None:
        """Write a checkpoint if one is due."""
        if time.perf_counter() >= self._due or self._bytes > _MOST_WAITING:
            self.save()

    def save(self) -> None:
        """Write what has not been written; if that fails, warn, keep it in memory and try again later."""
        if self._folder is None or self._saved == len(self._books.evaluations):
            return
        self._books.measured()  # computed first, so that it does not count as time for the checkpoint
        began = time.perf_counter()
        try:
            numbers, parts = zip(*self._waiting, strict=True) if self._waiting else ((), ())
            self._folder.write(block_of(numbers, parts) if parts else None, self._checkpoint())
        except OSError as error:
            self._due = began + _TRY_AGAIN
            if not self._complained:
                warnings.warn(
                    f"{self._folder.folder}: no checkpoint can be written: {why_not(error)}; the run goes on in memory "
                    f"and tries again every {_TRY_AGAIN:g} s",
                    stacklevel=3,
                )
            self._complained = True
            return
        self._waiting, self._bytes, self._saved, self._complained = [], 0, len(self._books.evaluations), False
        ended = time.perf_counter()
        self._due = ended + (ended - began) / _SHARE

    def _checkpoint(self) -> dict[str, Array]:
        story = {"seconds": self.seconds(), "resumed": self.resumed}
        solver = state(self._solver) if self.manifest.algorithm is not None else {}
        return {
            "story": np.array(json.dumps(story)),
            **{f"books.{name}": array for name, array in self._books.arrays().items()},
            **{f"solver.{name}": array for name, array in solver.items()},
        }

    def _needs_space(self, folder: RunFolder) -> None:
        """Refuse a run for which the disk has too little space, before hours are spent on it."""
        problem = self._books.problem
        size = getattr(self._solver, "n_offsprings", None) or getattr(self._solver, "pop_size", None) or 0
        columns = problem.n_var + problem.n_obj + problem.n_ieq_constr + 1
        needed = _BESIDES + 8 * columns * size * (self.manifest.generations - self._saved)
        free = folder.free()
        if free < needed:
            about = f"about {needed / 1e6:.0f} MB, {free / 1e6:.0f} MB are free"
            raise InvalidInputError(f"{folder.folder}: the run needs {about}")


#: X, F, G and error messages of an evaluated population.
_Populations = tuple[Array, Array, Array, Array]


def _reopen(books: Books, checkpoint: Mapping[str, Array], folder: RunFolder) -> tuple[float, tuple[int, ...]]:
    """Restore the history from a checkpoint and collect all individuals again.

    Returns:
        Wall time so far [s], and the generations after which the run was resumed.
    """
    try:
        story = from_json(str(checkpoint["story"]))
        books.reopen(_part(checkpoint, "books."))
        rows = 0
        for block in folder.blocks(len(books.evaluations)):
            books.collect(block.X, {"F": block.F, "G": block.G, "failure": block.said})
            rows += len(block.X)
        seconds, resumed = float(story["seconds"]), tuple(int(number) for number in story["resumed"])
    except (KeyError, IndexError, TypeError, ValueError, OverflowError) as error:
        if isinstance(error, InvalidInputError):
            raise
        raise InvalidInputError(f"{folder.folder}: the checkpoint is damaged: {error!r}") from error
    if not books.evaluations or rows != books.evaluations[-1]:
        raise InvalidInputError(
            f"{folder.folder}: the blocks hold {rows} individuals, but the checkpoint counts another number"
        )
    return seconds, resumed


def _part(arrays: Mapping[str, Array], prefix: str) -> dict[str, Array]:
    return {name.removeprefix(prefix): array for name, array in arrays.items() if name.startswith(prefix)}
