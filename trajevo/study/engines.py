"""Engines, which run the cells of a study: in this process, or in several processes of this machine."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from multiprocessing.connection import wait as wait_for
from types import FrameType
from typing import Any, TypeVar, final

from trajevo.base.signals import Stopping
from trajevo.errors import InvalidInputError, TrajevoError, checked_name
from trajevo.study.cell import Outcome, lost_cell, run_cell, run_cell_in_worker
from trajevo.study.jobs import Job

Item = TypeVar("Item")
Result = TypeVar("Result")

START_METHODS = ("spawn", "forkserver", "fork")

#: Interval at which signals are checked while cells run [s].
POLL = 0.1

#: Message for workers that die as they start.
DYING = "workers: the processes die as they start; a script that starts a study needs if __name__ == '__main__':"

#: How often workers may die as they start, before the study ends.
_STARTS = 2

#: How often the process of a cell may die while the cell runs alone, before the cell counts as failed.
_DEATHS = 2


class _DyingError(TrajevoError):
    """Workers die as they start."""


class Engine(ABC):
    """Runs cells; all engines run the same function on the same data, so that fronts do not depend on the engine."""

    @property
    @abstractmethod
    def workers(self) -> int | None:
        """Number of cells that run at a time; None if it is not known."""

    @abstractmethod
    def run(self, jobs: Sequence[Job], folder: str, stopping: Stopping) -> Iterator[Outcome]:
        """Run cells and yield the outcome of each when it ends; after a signal, end running cells and start no more.

        Args:
            jobs: the cells.
            folder: the study's folder.
            stopping: tells whether a signal has come.

        Raises:
            InvalidInputError: the workers cannot run the cells.
        """

    @abstractmethod
    def map(self, function: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
        """Compute a function of every item and yield the results in the order of the items.

        Args:
            function: a function of a module, which workers can import.
            items: its arguments, which can be pickled.

        Raises:
            InvalidInputError: the workers cannot compute it, or what the function raises.
        """


@final
class InProcess(Engine):
    """One cell after the other in this process."""

    @property
    def workers(self) -> int:
        """One."""
        return 1

    def run(self, jobs: Sequence[Job], folder: str, stopping: Stopping) -> Iterator[Outcome]:
        """See :meth:`Engine.run`."""
        for job in jobs:
            if stopping:
                return
            yield run_cell(job, folder)

    def map(self, function: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
        """See :meth:`Engine.map`."""
        yield from map(function, items)


@final
class Processes(Engine):
    """Runs cells in parallel processes of this machine, a pool of ``concurrent.futures``.

    If a worker dies, its pool breaks. The cells that were running are then resumed from their checkpoints one at a
    time, to find the one that kills its process; the waiting cells run in a new pool. A worker that dies as it starts
    gets one more try, then its cell fails; if none has ever started, the study ends.

    Args:
        workers: number of processes.
        start_method: how processes are started. ``"spawn"`` starts fresh ones, ``"forkserver"`` copies a fresh one.
            ``"fork"`` copies this process, including everything that was registered by hand, but Pinocchio then has a
            single thread. With the first two, a script that starts a study needs ``if __name__ == "__main__":``.

    Raises:
        InvalidInputError: fewer than one worker.
        UnknownNameError: no such start method.
    """

    def __init__(self, workers: int, *, start_method: str = "spawn") -> None:
        self._workers = checked_workers(workers)
        self._context: Any = multiprocessing.get_context(checked_name("start method", start_method, START_METHODS))

    @property
    def workers(self) -> int:
        """Number of processes."""
        return self._workers

    def run(self, jobs: Sequence[Job], folder: str, stopping: Stopping) -> Iterator[Outcome]:
        """See :meth:`Engine.run`."""
        waiting, begun = deque(jobs), False
        while waiting and not stopping:
            try:
                lost = yield from self._pool(waiting, self._workers, folder, stopping)
            except _DyingError as error:
                if not begun:
                    raise InvalidInputError(DYING) from error
                yield lost_cell(waiting.popleft(), folder, str(error))
                continue
            begun = True
            for job in lost:
                yield from self._alone(job, folder, stopping)

    def map(self, function: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
        """See :meth:`Engine.map`."""
        try:
            pool = self._started(self._workers, self._context.SimpleQueue())
        except _DyingError as error:
            raise InvalidInputError(DYING) from error
        try:
            yield from pool.map(function, items)
        except BrokenProcessPool as error:
            raise InvalidInputError("workers: a process died, for example because memory ran out") from error
        finally:
            pool.shutdown(cancel_futures=True)

    def _alone(self, job: Job, folder: str, stopping: Stopping) -> Iterator[Outcome]:
        """Run a cell alone in a pool, after a process of its former pool has died."""
        said = f"its process died {1 + _DEATHS} times, for example because memory ran out"
        for _ in range(_DEATHS):
            try:
                lost = yield from self._pool(deque([job]), 1, folder, stopping)
            except _DyingError as error:
                said = str(error)
                break
            if not lost or stopping:
                return
        yield lost_cell(job, folder, said)

    def _started(self, workers: int, begun: Any) -> ProcessPoolExecutor:
        """A pool whose first worker has begun; one that dies while it starts, killed for its memory, is started again.

        Raises:
            _DyingError: workers die as they start, again and again.
        """
        for _ in range(_STARTS):
            pool = ProcessPoolExecutor(workers, mp_context=self._context, initializer=_begin_worker, initargs=(begun,))
            try:
                pool.submit(os.getpid).result()
            except BrokenProcessPool:
                pool.shutdown(cancel_futures=True)
                continue
            return pool
        raise _DyingError(f"the process that was to run it died {_STARTS} times as it started")

    def _pool(
        self, waiting: deque[Job], workers: int, folder: str, stopping: Stopping
    ) -> Generator[Outcome, None, list[Job]]:
        """Run waiting cells in one pool; returns the cells that were running if it broke."""
        begun, running = self._context.SimpleQueue(), dict[Future[Outcome], Job]()
        pool = self._started(workers, begun)
        pids: list[int] = []
        ended = False
        try:
            while running or (waiting and not stopping):
                # Submit no more than can run, since cells that wait inside a pool are lost if it breaks.
                while waiting and len(running) < workers and not stopping:
                    future = pool.submit(run_cell_in_worker, waiting[0], folder)
                    running[future] = waiting.popleft()
                if stopping:
                    # Sent repeatedly, since a signal that arrives before a run has begun is ignored.
                    _signal(begun, pids, signal.SIGTERM)
                for future in wait(running, timeout=POLL, return_when=FIRST_COMPLETED).done:
                    yield future.result()
                    del running[future]
            ended = True
        except BrokenProcessPool:
            pass
        finally:
            if not ended:
                # A run treats SIGTERM, by which a broken pool ends its workers, as a request to finish its generation.
                _signal(begun, pids, signal.SIGKILL)
            pool.shutdown(cancel_futures=True)
        return [] if stopping else list(running.values())


def checked_workers(workers: object) -> int:
    """Check a number of workers.

    Raises:
        InvalidInputError: not a whole number of at least one.
    """
    if not isinstance(workers, int) or isinstance(workers, bool) or workers < 1:
        raise InvalidInputError(f"workers: expected a whole number of at least 1, got {workers!r}")
    return workers


def _begin_worker(begun: Any) -> None:
    """Set up a worker: it obeys signals from the main process only, while a cell runs, and ends with that process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _unheard)
    begun.put(os.getpid())
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _unheard(number: int, frame: FrameType | None) -> None:
    """Ignore a signal between cells; not ``SIG_IGN``, since a run would then ignore the signal, too."""


def _end_with(sentinel: int) -> None:
    wait_for([sentinel])
    os._exit(1)


def _signal(begun: Any, pids: list[int], number: signal.Signals) -> None:
    """Send a signal to all workers that have begun."""
    while not begun.empty():
        pids.append(begun.get())
    for pid in pids:
        with suppress(ProcessLookupError):
            os.kill(pid, number)
