"""Run the cells of a study on a Dask cluster: a local one, or a running one given by its scheduler's address."""

from __future__ import annotations

import logging
import os
import signal
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack
from importlib.metadata import version
from pathlib import Path
from typing import Any, final

from trajevo.base.files import MOST_DATA, read_bytes
from trajevo.base.signals import Stopping
from trajevo.errors import InvalidInputError
from trajevo.study.cell import Outcome, lost_cell, run_cell_in_worker
from trajevo.study.engines import DYING, POLL, Engine, Item, Result, checked_workers
from trajevo.study.folder import STUDY_FILE
from trajevo.study.jobs import Job

#: Address at which a local cluster listens: only this machine reaches it.
_LOOPBACK = "127.0.0.1"

#: Greatest time to wait for a scheduler and its first worker [s].
_PATIENCE = 30.0


@final
class DaskCluster(Engine):
    """Runs cells on a cluster of ``dask.distributed``; if a worker dies, its cell continues on another one.

    Args:
        workers: number of workers of a local cluster, which is started for the study and closed after it; as many as
            there are cores if None. A script that uses it needs ``if __name__ == "__main__":``.
        scheduler: address of a running cluster, such as ``"tcp://host:8786"``, instead of workers. All its workers need
            the same version of trajevo and must see the study's folder.

    Raises:
        InvalidInputError: ``distributed`` is not installed, fewer than one worker, or both workers and a scheduler.
    """

    def __init__(self, workers: int | None = None, *, scheduler: str | None = None) -> None:
        _distributed()
        if scheduler is not None and workers is not None:
            raise InvalidInputError("workers: the cluster behind a scheduler has workers of its own")
        if scheduler is not None and not isinstance(scheduler, str):
            raise InvalidInputError(f"scheduler: expected an address such as 'tcp://host:8786', got {scheduler!r}")
        self._scheduler = scheduler
        self._workers = None if scheduler else checked_workers(os.cpu_count() if workers is None else workers)

    @property
    def workers(self) -> int | None:
        """Number of workers of a local cluster; None for a running cluster, whose workers come and go."""
        return self._workers

    def run(self, jobs: Sequence[Job], folder: str, stopping: Stopping) -> Iterator[Outcome]:
        """See :meth:`Engine.run`. Cells on a running cluster are not stopped: they run to their end there."""
        with ExitStack() as stack:
            client = self._client(stack, any("time_limit" in job["search"] for job in jobs))
            _check(client, folder)
            waiting = {client.submit(run_cell_in_worker, job, folder, pure=False): job for job in jobs}
            stack.callback(_cancel, client, waiting)
            ended = _distributed().as_completed(list(waiting))
            while waiting and not stopping:
                for future in ended.next_batch(block=False):
                    yield _outcome(future, waiting.pop(future), folder)
                time.sleep(POLL / 2.0)

    def map(self, function: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
        """See :meth:`Engine.map`; the function and its items travel to the workers."""
        with ExitStack() as stack:
            client = self._client(stack, processes=False)
            yield from client.gather(client.map(function, list(items), pure=False))

    def _client(self, stack: ExitStack, processes: bool) -> Any:
        distributed = _distributed()
        if self._workers is not None:
            own: AbstractContextManager[Any] = _own_cluster(stack, self._workers, processes)
            return stack.enter_context(distributed.Client(stack.enter_context(own)))
        try:
            client = stack.enter_context(distributed.Client(self._scheduler, timeout=_PATIENCE))
        except (OSError, ValueError, TypeError) as error:
            raise InvalidInputError(f"scheduler: no answer from {self._scheduler!r}: {error}") from error
        try:
            client.wait_for_workers(1, timeout=_PATIENCE)
        except TimeoutError as error:
            raise InvalidInputError(f"scheduler: {self._scheduler} has no workers") from error
        return client


def _own_cluster(stack: ExitStack, workers: int, processes: bool) -> Any:
    import dask

    settings: dict[str, Any] = {
        # Dask's setting makes the allocator return every freed block to the system, which costs 8 to 16 % of the time.
        "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": None,
        # Imports what cells need, and ignores interrupts from the keyboard, which the main process handles.
        "distributed.worker.preload": [__name__],
    }
    if processes:
        settings["distributed.worker.daemon"] = False
    stack.enter_context(dask.config.set(settings))
    try:
        return _distributed().LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            # Nobody else on the network may give these workers anything to run, or watch them.
            host=_LOOPBACK,
            # Any free port, as several clusters may run on a machine.
            dashboard_address=f"{_LOOPBACK}:0",
            # The outcomes of cells tell what happens to the workers.
            silence_logs=logging.CRITICAL,
        )
    except RuntimeError as error:
        raise InvalidInputError(DYING) from error


def dask_setup(worker: Any) -> None:
    """Make a worker of a local cluster ignore interrupts from the keyboard; Dask calls this when the worker starts.

    Args:
        worker: the worker.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _check(client: Any, folder: str) -> None:
    """Make sure that every worker sees the study and has the same version of trajevo."""
    content = read_bytes(Path(folder) / STUDY_FILE, most=MOST_DATA)
    for worker, seen in client.run(_seen, folder, on_error="return").items():
        if isinstance(seen, Exception):
            raise InvalidInputError(f"worker {worker}: cannot use trajevo: {type(seen).__name__}: {seen}")
        if seen[0] != version("trajevo"):
            raise InvalidInputError(f"worker {worker}: has trajevo {seen[0]}, this is {version('trajevo')}")
        if seen[1] != content:
            raise InvalidInputError(
                f"worker {worker}: does not see the study's folder {folder}; put it where all workers see it"
            )


def _seen(folder: str) -> tuple[str, bytes | None]:
    file = Path(folder) / STUDY_FILE
    return version("trajevo"), read_bytes(file, most=MOST_DATA) if file.is_file() else None


def _outcome(future: Any, job: Job, folder: str) -> Outcome:
    error = future.exception()
    if error is None:
        outcome: Outcome = future.result()
        return outcome
    if isinstance(error, InvalidInputError):
        raise error
    if isinstance(error, _distributed().scheduler.KilledWorker):
        return lost_cell(job, folder, "the workers that ran it died, for example because memory ran out")
    return lost_cell(job, folder, f"{type(error).__name__}: {error}")


def _cancel(client: Any, waiting: dict[Any, Job]) -> None:
    if waiting:
        client.cancel(list(waiting))


def _distributed() -> Any:
    try:
        import distributed
    except ImportError as error:
        raise InvalidInputError(
            "a Dask cluster needs the package distributed: pip install 'trajevo[cluster]'"
        ) from error
    return distributed
