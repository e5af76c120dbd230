"""Evaluate a population even if single individuals raise an error, give NaN, hang, or crash the process."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, one_blas_thread
from trajevo.errors import InvalidInputError, TrajevoError

#: Number of time limits after which a worker process whose parent is gone ends itself.
_ORPHAN = 2.0

#: Decision vectors (B, n_var) -> objectives (B, n_obj), constraints (B, n_constr).
Rows = Callable[[Array], tuple[Array, Array]]


class EvaluationError(TrajevoError):
    """An evaluation in a separate process failed; the message says what happened there."""


def evaluate_each(rows: Rows, x: Array, n_obj: int, n_constr: int) -> tuple[Array, Array, list[str]]:
    """Evaluate a population; an individual that raises an error, hangs or gives NaN does not affect the others.

    Args:
        rows: evaluates decision vectors as one batch.
        x: decision vectors, shape (B, n_var).
        n_obj: number of objectives.
        n_constr: number of constraints.

    Returns:
        F (B, n_obj) and G (B, n_constr), infinite for individuals that failed, and the error message of every
        individual, empty for those that did not fail.
    """
    failures = [""] * len(x)
    try:
        F, G = rows(x)
    except Exception:  # noqa: BLE001 - whatever one individual raises must not end the run of the others
        F, G = np.full((len(x), n_obj), np.nan), np.full((len(x), n_constr), np.nan)
        for i in range(len(x)):
            try:
                F[i : i + 1], G[i : i + 1] = rows(x[i : i + 1])
            except Exception as error:  # noqa: BLE001 - as above; the message is kept and reported
                failures[i] = str(error) if isinstance(error, EvaluationError) else _said(error)
    for failed in np.flatnonzero(~(np.isfinite(F).all(axis=1) & np.isfinite(G).all(axis=1))):
        failures[failed] = failures[failed] or "an objective or a constraint is not a finite number"
        F[failed], G[failed] = np.inf, np.inf
    return F, G, failures


def checked_time_limit(seconds: Any) -> float:
    """Check a time limit for the evaluation of one individual [s].

    Raises:
        InvalidInputError: it is not positive, or this process may not start child processes.
    """
    if isinstance(seconds, bool) or not isinstance(seconds, int | float) or not 0.0 < seconds < float("inf"):
        raise InvalidInputError(f"time_limit: expected a positive time [s], got {seconds!r}")
    if multiprocessing.current_process().daemon:
        raise InvalidInputError(
            "time_limit: this worker may not start child processes; start the workers with "
            "distributed.worker.daemon set to false"
        )
    return float(seconds)


@final
class TimeLimited:
    """Evaluates in a separate process, which is killed when it takes too long and started again for the next call.

    Where the system can fork, the process is a copy of this one, so that it knows every objective; elsewhere ``rows``
    must be picklable. The process holds only one batch and its result.

    Args:
        rows: evaluates decision vectors as one batch.
        seconds: greatest time for one call [s]; the individuals of a batch that takes longer should be evaluated again
            one by one.

    Raises:
        InvalidInputError: a time that is not positive, or this process may not start child processes.
    """

    def __init__(self, rows: Rows, seconds: float) -> None:
        self._rows, self._seconds = rows, checked_time_limit(seconds)
        methods = multiprocessing.get_all_start_methods()
        self._context: Any = multiprocessing.get_context("fork" if "fork" in methods else None)
        self._process: BaseProcess | None = None
        self._pipe: Connection | None = None

    def __call__(self, x: Array) -> tuple[Array, Array]:
        """Evaluate decision vectors, shape (B, n_var).

        Raises:
            EvaluationError: the evaluation raised an error or took too long, or the process died.
        """
        pipe = self._started()
        try:
            pipe.send(x)
            if not pipe.poll(self._seconds):
                if self._process is not None:
                    self._process.kill()
                self.close()
                raise EvaluationError(f"took longer than {self._seconds:g} s")
            answer = pipe.recv()
        except (EOFError, OSError) as error:
            code = self.close()
            how = f"signal {signal.Signals(-code).name}" if code is not None and code < 0 else f"exit code {code}"
            raise EvaluationError(f"the process that evaluated it died: {how}") from error
        if isinstance(answer, str):
            raise EvaluationError(answer)
        F, G = answer
        return F, G

    def close(self) -> int | None:
        """End the process, if there is one; returns its exit code if it had ended by itself, else None."""
        process, self._process = self._process, None
        pipe, self._pipe = self._pipe, None
        if pipe is not None:
            pipe.close()
        if process is None:
            return None
        process.join(0.2)
        code = process.exitcode
        if code is None:
            process.kill()
            process.join()
        return code

    def _started(self) -> Connection:
        if self._process is None or self._pipe is None:
            self._pipe, theirs = self._context.Pipe()
            arguments = theirs, self._pipe, self._rows, self._seconds
            self._process = self._context.Process(target=_serve, args=arguments, daemon=True)
            self._process.start()
            theirs.close()
        return self._pipe


def _serve(pipe: Connection, other: Connection, rows: Rows, seconds: float) -> None:
    """Evaluate what comes through the pipe until its other end is closed; the parent process handles interrupts.

    If the parent was killed and an evaluation hangs, an alarm signal ends this process.
    """
    other.close()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    alarm = getattr(signal, "setitimer", None)
    with one_blas_thread(), suppress(EOFError, OSError):
        while True:
            x = pipe.recv()
            if alarm is not None:
                alarm(signal.ITIMER_REAL, _ORPHAN * seconds + 1.0)
            try:
                answer: Any = rows(x)
            except Exception as error:  # noqa: BLE001 - sent to the process that asked
                answer = _said(error)
            if alarm is not None:
                alarm(signal.ITIMER_REAL, 0.0)
            pipe.send(answer)


def _said(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"
