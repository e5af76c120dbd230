"""Evaluate a population even if single individuals raise an error, give NaN, hang, or crash the process.

An objective or a constraint that fails for every individual, or whose result has a wrong shape, is refused at once.
"""

from __future__ import annotations

import multiprocessing
import signal
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any, final

import numpy as np

from trajevo.base import jit
from trajevo.base.arrays import Array, one_blas_thread
from trajevo.base.complex_step import unstepped
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError, TrajevoError

#: Number of time limits after which a worker process whose parent is gone ends itself.
_ORPHAN = 2.0

#: Random individuals that are tried before a function that has failed for every individual is refused.
_TRIED = 8

#: Decision vectors (B, n_var) -> objectives (B, n_obj), constraints (B, n_constr).
Rows = Callable[[Array], tuple[Array, Array]]


class EvaluationError(TrajevoError):
    """An evaluation in a separate process failed; the message says what happened there."""


class WrongResultError(InvalidInputError):
    """An objective or a constraint returned something else than one number for each trajectory and column."""


class FailedFunctionError(EvaluationError):
    """An objective, a constraint or an interpolant raised an error.

    Attributes:
        what: what raised it, such as ``"objective 'time'"``.
        said: type and message of the error.
        where: line and file where it was raised, empty if unknown.
    """

    def __init__(self, what: str, said: str, where: str) -> None:
        super().__init__(what, said, where)
        self.what, self.said, self.where = what, said, where

    def __str__(self) -> str:
        return self.said

    @classmethod
    def of(cls, what: str, error: Exception) -> FailedFunctionError:
        """The failure that an error tells of, with the last line in the file of the function that raised it."""
        frames = traceback.extract_tb(error.__traceback__)[1:]
        own = [frame for frame in frames if frame.filename == frames[0].filename]
        where = f"line {own[-1].lineno} of {own[-1].filename}" if own else ""
        return cls(what, _said(error), where)

    @property
    def always(self) -> InvalidInputError:
        """The error for a function that fails for every individual."""
        where = f" ({self.where})" if self.where else ""
        return InvalidInputError(f"{self.what}: fails for every individual, first with {self.said}{where}")


@dataclass(frozen=True, eq=False)
class Part:
    """An objective or a constraint of a problem as columns of numbers.

    Attributes:
        what: what it is, for messages, such as ``"objective 'time'"``.
        function: rollout of B trajectories -> (B,) for an objective, (B, columns) for a constraint.
        columns: number of columns of a constraint, or of an objective in terms; None for an objective.
    """

    what: str
    function: Callable[[Rollout], Array]
    columns: int | None = None

    def __call__(self, rollout: Rollout) -> Array:
        """Its values, shape (B, columns), or (B, 1) for an objective; complex if the rollout takes complex steps.

        Raises:
            WrongResultError: its result has a wrong shape, or does not consist of numbers.
            FailedFunctionError: it raised an error.
        """
        try:
            found = self.function(rollout)
        except Exception as error:
            raise FailedFunctionError.of(self.what, error) from error
        try:
            values = np.asarray(unstepped(found))
        except ValueError:  # rows of different lengths
            values = np.empty((), dtype=object)
        count = len(rollout.trajectory)
        wanted = (count,) if self.columns is None else (count, self.columns)
        if values.dtype.kind not in "biufc":
            raise WrongResultError(f"{self.what}: expected numbers of shape {wanted}, got {type(found).__name__}")
        if values.shape != wanted:
            axes = "(B,)" if self.columns is None else f"(B, {self.columns})"
            raise WrongResultError(
                f"{self.what}: expected shape {axes} for B trajectories, here {wanted}, got {values.shape}"
            )
        return values.reshape(count, 1 if self.columns is None else self.columns)

    def real(self, rollout: Rollout) -> Array:
        """Its values for a rollout without complex steps, as :meth:`__call__`; complex numbers are refused too."""
        values = self(rollout)
        if np.iscomplexobj(values):
            raise WrongResultError(f"{self.what}: expected real numbers, got complex ones")
        return values


def evaluate_each(
    rows: Rows, x: Array, n_obj: int, n_constr: int
) -> tuple[Array, Array, list[str], FailedFunctionError | None]:
    """Evaluate a population; an individual that raises an error, hangs or gives NaN does not affect the others.

    Args:
        rows: evaluates decision vectors as one batch.
        x: decision vectors, shape (B, n_var).
        n_obj: number of objectives.
        n_constr: number of constraints.

    Returns:
        F (B, n_obj) and G (B, n_constr), infinite for individuals that failed; the error message of every individual,
        empty for those that did not fail; and the first failure if the same function raised for every individual.

    Raises:
        WrongResultError: the result of an objective or a constraint has a wrong shape, whatever the individual.
    """
    failures, errors = [""] * len(x), []
    try:
        F, G = rows(x)
    except WrongResultError:
        raise
    except Exception:  # noqa: BLE001 - whatever one individual raises must not end the run of the others
        F, G = np.full((len(x), n_obj), np.nan), np.full((len(x), n_constr), np.nan)
        for i in range(len(x)):
            try:
                F[i : i + 1], G[i : i + 1] = rows(x[i : i + 1])
            except WrongResultError:
                raise
            except Exception as error:  # noqa: BLE001 - as above; the message is kept and reported
                failures[i] = str(error) if isinstance(error, EvaluationError) else _said(error)
                errors.append(error)
    for failed in np.flatnonzero(~(np.isfinite(F).all(axis=1) & np.isfinite(G).all(axis=1))):
        failures[failed] = failures[failed] or "an objective or a constraint is not a finite number"
        F[failed], G[failed] = np.inf, np.inf
    return F, G, failures, _common(errors) if len(errors) == len(x) else None


def refuse_if_broken(rows: Rows, failed: FailedFunctionError, bounds: tuple[Array, Array]) -> None:
    """Refuse a problem with a function that failed for every individual so far and fails for random ones too.

    Args:
        rows: evaluates decision vectors as one batch.
        failed: the first failure.
        bounds: least and greatest decision variables, shapes (n_var,).

    Raises:
        InvalidInputError: the function failed for all random individuals; the message has its first error.
    """
    for x in np.random.default_rng(0).uniform(*bounds, (_TRIED, len(bounds[0]))):
        try:
            rows(x[None])
        except FailedFunctionError as error:
            if error.what != failed.what:
                return
        except Exception:  # noqa: BLE001 - something else is wrong with this individual
            return
        else:
            return
    raise failed.always


def _common(errors: Sequence[Exception]) -> FailedFunctionError | None:
    """The first of the errors, if all are failures of the same function."""
    found = [error for error in errors if isinstance(error, FailedFunctionError)]
    return found[0] if found and len(found) == len(errors) and len({one.what for one in found}) == 1 else None


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
            WrongResultError: the result of an objective or a constraint has a wrong shape.
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
        if isinstance(answer, Exception):
            raise answer
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
            arguments = theirs, self._pipe, self._rows, self._seconds, jit.kind()
            self._process = self._context.Process(target=_serve, args=arguments, daemon=True)
            self._process.start()
            theirs.close()
        return self._pipe


def _serve(pipe: Connection, other: Connection, rows: Rows, seconds: float, kind: jit.Kind) -> None:
    """Evaluate what comes through the pipe until its other end is closed; the parent process handles interrupts.

    If the parent was killed and an evaluation hangs, an alarm signal ends this process.
    """
    other.close()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    alarm = getattr(signal, "setitimer", None)
    with jit.one_kind(kind), one_blas_thread(), suppress(EOFError, OSError):
        while True:
            x = pipe.recv()
            if alarm is not None:
                alarm(signal.ITIMER_REAL, _ORPHAN * seconds + 1.0)
            try:
                answer: Any = rows(x)
            except (FailedFunctionError, WrongResultError) as error:
                answer = error
            except Exception as error:  # noqa: BLE001 - sent to the process that asked
                answer = EvaluationError(_said(error))
            if alarm is not None:
                alarm(signal.ITIMER_REAL, 0.0)
            pipe.send(answer)


def _said(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"
