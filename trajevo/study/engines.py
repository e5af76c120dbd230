"""Where the cells of a study run: in this process, in processes of this machine."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from multiprocessing.connection import wait as wait_for
from types import FrameType
from typing import Any, final

from trajevo.base.signals import Stopping
from trajevo.errors import InvalidInputError, checked_name
from trajevo.study.cell import Outcome, lost_cell, run_cell, run_cell_in_worker
from trajevo.study.jobs import Job

START_METHODS = ("spawn", "forkserver", "fork")

#: How often a signal is looked for while cells run [s].
POLL = 0.1

#: What is said of workers that never come up.
DYING = "workers: the processes die as they start; a script that starts a study needs if __name__ == '__main__':"

#: Times that the process of a cell may die without another cell beside it before the cell counts as failed.
_DEATHS = 2


class Engine(ABC):
    """Runs cells; all engines run the same function on the same data, so that fronts do not depend on the engine."""

    @property
    @abstractmethod
    def workers(self) -> int | None:
        """Cells that run at a time; None where others decide."""

    @abstractmethod
    def run(self, jobs: Sequence[Job], folder: str, stopping: Stopping) -> Iterator[Outcome]:
        """Run cells and tell of each as it ends; when a signal asks to stop, end those that run and hand out no more.

        Args:
            jobs: the cells.
            folder: the study's folder.
            stopping: tells whether a signal has come.

        Raises:
            InvalidInputError: the workers cannot run the cells.
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


@final
class Processes(Engine):
    """Cells side by side in processes of this machine, a pool of ``concurrent.futures``.

    A worker that dies takes its pool with it: the cells that were running go on from their checkpoints one at a time,
    so that the one that kills its process is found, and the others in a new pool.

    Args:
        workers: processes.
        start_method: how they are started. ``"spawn"`` starts afresh, ``"forkserver"`` copies a process that did;
            ``"fork"`` copies this one, with everything that was registered by hand; Pinocchio has one thread there.
            With the first two a script that starts a study needs ``if __name__ == "__main__":``.

    Raises:
        InvalidInputError: no worker.
        UnknownNameError: no such way to start.
    """

    def __init__(self, workers: int, *, start_method: str = "spawn") -> None:
        self._workers = checked_workers(workers)
        self._context: Any = multiprocessing.get_context(checked_name("start method", start_method, START_METHODS))

    @property
    def workers(self) -> int:
        """Processes."""
        return self._workers

    def run(self, jobs: Sequence[Job], folder: str, stopping: Stopping) -> Iterator[Outcome]:
        """See :meth:`Engine.run`."""
        waiting = deque(jobs)
        while waiting and not stopping:
            for job in (yield from self._pool(waiting, self._workers, folder, stopping)):
                yield from self._alone(job, folder, stopping)

    def _alone(self, job: Job, folder: str, stopping: Stopping) -> Iterator[Outcome]:
        """Run a cell in whose pool a process died in a pool of its own."""
        for _ in range(_DEATHS):
            lost = yield from self._pool(deque([job]), 1, folder, stopping)
            if not lost or stopping:
                return
        said = f"its process died {1 + _DEATHS} times, as when memory runs out"
        yield lost_cell(job, folder, said)

    def _pool(
        self, waiting: deque[Job], workers: int, folder: str, stopping: Stopping
    ) -> Generator[Outcome, None, list[Job]]:
        """Run what waits in one pool; the cells that ran when it broke, if it did."""
        begun, running = self._context.SimpleQueue(), dict[Future[Outcome], Job]()
        pool = ProcessPoolExecutor(workers, mp_context=self._context, initializer=_begin_worker, initargs=(begun,))
        pids: list[int] = []
        ended = False
        try:
            _check(pool)
            while running or (waiting and not stopping):
                # No more than can run: those that wait in a pool are lost with it.
                while waiting and len(running) < workers and not stopping:
                    future = pool.submit(run_cell_in_worker, waiting[0], folder)
                    running[future] = waiting.popleft()
                if stopping:
                    # Again and again, as one that comes before a run has begun is not heard.
                    _signal(begun, pids, signal.SIGTERM)
                for future in wait(running, timeout=POLL, return_when=FIRST_COMPLETED).done:
                    yield future.result()
                    del running[future]
            ended = True
        except BrokenProcessPool:
            pass
        finally:
            if not ended:
                # A run takes the signal by which a broken pool ends its workers for one to finish its generation.
                _signal(begun, pids, signal.SIGKILL)
            pool.shutdown(cancel_futures=True)
        return [] if stopping else list(running.values())


def checked_workers(workers: object) -> int:
    """A number of workers.

    Raises:
        InvalidInputError: no whole number of at least one.
    """
    if not isinstance(workers, int) or isinstance(workers, bool) or workers < 1:
        raise InvalidInputError(f"workers: expected a whole number of at least 1, got {workers!r}")
    return workers


def _check(pool: ProcessPoolExecutor) -> None:
    try:
        pool.submit(os.getpid).result()
    except BrokenProcessPool as error:
        raise InvalidInputError(DYING) from error


def _begin_worker(begun: Any) -> None:
    """Take signals from the process that hands out the cells alone, only while a cell runs, and end with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _unheard)
    begun.put(os.getpid())
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _unheard(number: int, frame: FrameType | None) -> None:
    """Between cells there is nothing to finish; not ``SIG_IGN``, which a run would respect."""


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
