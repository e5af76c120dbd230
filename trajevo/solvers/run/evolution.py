"""The generations of a run: evolve, keep the books, and leave a folder from which the run goes on after any end."""

from __future__ import annotations

import copy
import json
import math
import time
import warnings
from collections.abc import Mapping
from typing import Any, final

import numpy as np
from pymoo.core.algorithm import Algorithm
from pymoo.core.evaluator import Evaluator

from trajevo.base.arrays import Array, one_blas_thread
from trajevo.base.signals import Stopping
from trajevo.errors import InvalidInputError
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.front.books import Books
from trajevo.front.front import Front
from trajevo.solvers.evolutionary.algorithm_state import restore, state
from trajevo.solvers.gradient.polish import seeds
from trajevo.solvers.run.folder import Manifest, RunFolder, block_of
from trajevo.solvers.run.progress import reporter

#: Share of the time that checkpoints may take: after one that took 2 ms the next waits for 0.2 s.
_SHARE = 0.01
#: Bytes of evaluated individuals that wait in memory for their block.
_MOST_WAITING = 2**23
#: Time after which writing is tried again where it failed [s].
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
        manifest: how the run was begun.
        folder: where it is kept, the manifest in it already; its latest checkpoint is gone on from. Or None.
        progress: show generation, hypervolume, least violation and time left on standard error.
        cpu_spent: CPU time that has been spent on a run that begins [s].

    Returns:
        The front.

    Raises:
        InvalidInputError: a checkpoint that cannot be gone on from, or too little space for the run.
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
            # RVEA's angle between a point and its own direction, by rounding; NaN wins there as 0 would.
            warnings.filterwarnings("ignore", "invalid value encountered in arccos", RuntimeWarning, r"pymoo\.")
            heard = list(warnings.filters)
            while not keeper.used_up() and solver.has_next() and not stopping:
                polishing = _next(solver, books, manifest)
                if warnings.filters != heard:
                    # pymoo's NSGA-III silences all warnings of Python, ours among them.
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
    )


def front_so_far(problem: TrajectoryProblem, manifest: Manifest, folder: RunFolder) -> Front:
    """Front of the generations that the latest checkpoint counts; the run is not gone on with.

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
    """The front that the books hold so far, named as the run was begun."""
    named: dict[str, Any] = {
        "algorithm": manifest.algorithm_name,
        "settings": manifest.settings,
        "seed": manifest.seed,
    }
    return books.front(**named, **how)


def _next(solver: Algorithm, books: Books, manifest: Manifest) -> int:
    """One generation; some of its individuals are refined members of the front where it is time for that.

    Returns:
        Evaluations that refining them took, or finding the first population.
    """
    done, every = len(books.evaluations), manifest.polish_every
    found, cost = np.empty((0, 0)), 0 if done else int(manifest.settings.get("starts_evaluations", 0))
    if every is not None and done and done % every == 0 and len(books.archive.F):
        front = _front(books, manifest, evaluations=books.evaluations[-1], interrupted=False, seconds=0.0)
        found, cost = seeds(front, seed=manifest.seed + done, most=max(1, len(solver.pop) // 2))
        found = found if books.problem.expansion is None else books.problem.expansion.fold(found)
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
    """Collects what is evaluated, for the books and for the next block, and writes checkpoints when they are due."""

    def __init__(
        self, books: Books, solver: Algorithm, manifest: Manifest, folder: RunFolder | None, cpu_spent: float
    ) -> None:
        self.resumed: tuple[int, ...] = ()
        self._books, self._solver, self._manifest, self._folder = books, solver, manifest, folder
        self._waiting: list[tuple[int, _Populations]] = []
        self._bytes, self._saved = 0, 0
        self._due = self._began = time.perf_counter()
        self._cpu_began = time.process_time() - cpu_spent
        self._complained = False

    def seconds(self) -> float:
        """Time that the run has taken so far, that before it was resumed included [s]."""
        return time.perf_counter() - self._began

    def cpu_seconds(self) -> float:
        """CPU time of the process for the run so far, that before it was resumed included [s]."""
        return time.process_time() - self._cpu_began

    def used_up(self) -> bool:
        """Whether the evolution has had its share of evaluations and CPU time, the first generation in any case."""
        share = 0.5 if self._manifest.polish else 1.0
        evaluations, cpu_time = self._manifest.evaluations, self._manifest.cpu_time
        done = sum(self._books.evaluations[-1:]) + sum(self._books.polishing)
        enough = evaluations is not None and done >= share * evaluations
        if cpu_time is None:
            return enough
        # What the books say, so that a run that is gone on with later ends after the same generation.
        used = (self._books.cpu_seconds or [self.cpu_seconds()])[-1] / (share * cpu_time)
        if used < 1.0:
            self._plan(used)
        return enough or (used >= 1.0 and bool(self._books.evaluations))

    def _plan(self, used: float) -> None:
        """Tell the algorithm how many generations a share of its CPU time lets expect: some plan with their number."""
        done, termination = len(self._books.evaluations), self._solver.termination
        expected = min(math.ceil(done / used), self._manifest.generations) if used > 0.0 else self._manifest.generations
        termination.n_max_gen = max(expected, done + 1) if done < self._manifest.generations else done
        if done:
            termination.perc = done / termination.n_max_gen

    def collect(self, X: Array, out: dict[str, Any]) -> None:
        """Callback of pymoo's problem: the arrays of every evaluation."""
        self._books.collect(X, out)
        if self._folder is None:
            return
        x, F, G = (np.array(np.atleast_2d(values), dtype=np.float64) for values in (X, out["F"], out["G"]))
        said = np.array([str(text) for text in np.atleast_1d(out.get("failure", [""] * len(x)))])
        self._waiting.append((len(self._books.evaluations) + 1, (x, F, G, said)))
        self._bytes += x.nbytes + F.nbytes + G.nbytes

    def go_on(self) -> None:
        """Put books and algorithm into the state of the latest checkpoint, if there is one."""
        if self._folder is None:
            return
        checkpoint = self._folder.checkpoint()
        if checkpoint is not None:
            seconds, resumed = _reopen(self._books, checkpoint, self._folder)
            try:
                restore(self._solver, _part(checkpoint, "solver."))
            except (KeyError, TypeError, ValueError) as error:
                raise InvalidInputError(
                    f"{self._folder.folder}: the checkpoint cannot be gone on from: {error}"
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
        """Write what has not been written; where that fails, say so, keep it in memory and try again later."""
        if self._folder is None or self._saved == len(self._books.evaluations):
            return
        self._books.measured()  # before the clock runs by which checkpoints are made rarer
        began = time.perf_counter()
        try:
            numbers, parts = zip(*self._waiting, strict=True) if self._waiting else ((), ())
            self._folder.write(block_of(numbers, parts) if parts else None, self._checkpoint())
        except OSError as error:
            self._due = began + _TRY_AGAIN
            if not self._complained:
                warnings.warn(
                    f"{self._folder.folder}: no checkpoint can be written: {error.strerror}; the run goes on in memory "
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
        solver = state(self._solver) if self._manifest.algorithm is not None else {}
        return {
            "story": np.array(json.dumps(story)),
            **{f"books.{name}": array for name, array in self._books.arrays().items()},
            **{f"solver.{name}": array for name, array in solver.items()},
        }

    def _needs_space(self, folder: RunFolder) -> None:
        """Refuse a run that the disk has no room for, before hours are spent on it."""
        problem = self._books.problem
        size = getattr(self._solver, "n_offsprings", None) or getattr(self._solver, "pop_size", None) or 0
        columns = problem.n_var + problem.n_obj + problem.n_ieq_constr + 1
        needed = _BESIDES + 8 * columns * size * (self._manifest.generations - self._saved)
        free = folder.free()
        if free < needed:
            about = f"about {needed / 1e6:.0f} MB, {free / 1e6:.0f} MB are free"
            raise InvalidInputError(f"{folder.folder}: the run needs {about}")


#: X, F, G of an evaluated population and what those that failed said.
_Populations = tuple[Array, Array, Array, Array]


def _reopen(books: Books, checkpoint: Mapping[str, Array], folder: RunFolder) -> tuple[float, tuple[int, ...]]:
    """Books as a checkpoint left them, every individual collected again; time so far [s] and earlier resumptions."""
    try:
        story = json.loads(str(checkpoint["story"]))
        books.reopen(_part(checkpoint, "books."))
        rows = 0
        for block in folder.blocks(len(books.evaluations)):
            books.collect(block.X, {"F": block.F, "G": block.G, "failure": block.said})
            rows += len(block.X)
        seconds, resumed = float(story["seconds"]), tuple(int(number) for number in story["resumed"])
    except (KeyError, IndexError, TypeError, ValueError) as error:
        if isinstance(error, InvalidInputError):
            raise
        raise InvalidInputError(f"{folder.folder}: the checkpoint is damaged: {error!r}") from error
    if not books.evaluations or rows != books.evaluations[-1]:
        raise InvalidInputError(f"{folder.folder}: the blocks hold {rows} individuals, the checkpoint counts others")
    return seconds, resumed


def _part(arrays: Mapping[str, Array], prefix: str) -> dict[str, Array]:
    return {name.removeprefix(prefix): array for name, array in arrays.items() if name.startswith(prefix)}
