"""Run one cell of a study from plain data, with the same code in this process, in a process pool and on a cluster."""

from __future__ import annotations

import platform
import traceback
from contextlib import suppress
from pathlib import Path
from typing import Literal, TypedDict

from threadpoolctl import threadpool_limits

from trajevo.base import jit
from trajevo.base.own.code import looking_in
from trajevo.errors import InvalidInputError, TrajevoError
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.formulation.registry import load_problem
from trajevo.formulation.search import Search
from trajevo.front.front import Front
from trajevo.solvers.optimise import optimise
from trajevo.solvers.run.folder import RunFolder
from trajevo.solvers.run.runs import resume
from trajevo.study.folder import Failure, StudyFolder
from trajevo.study.jobs import Job
from trajevo.study.record import canonical


class Outcome(TypedDict):
    """The outcome of a cell that an engine was given.

    Attributes:
        cell: name of the cell.
        state: ``held`` if another process runs it, ``interrupted`` if a signal stopped it.
        said: why it failed, or name of the signal; else empty.
    """

    cell: str
    state: Literal["finished", "failed", "held", "interrupted"]
    said: str


def run_cell(job: Job, folder: str) -> Outcome:
    """Run a cell; resume it if it was begun, and do nothing if it is finished or another process runs it.

    Errors of the run are not raised, but recorded in the cell's folder and returned.

    Args:
        job: the cell as plain data.
        folder: the study's folder.

    Raises:
        InvalidInputError: the study is not in this folder, for example on a machine that does not see the folder.
    """
    study, name = StudyFolder(folder), job["cell"]
    if not study.study_file.exists():
        raise InvalidInputError(
            f"{folder}: the machine {platform.node()} does not see the study there; put it where all workers see it"
        )
    try:
        with study.claimed(name) as mine:
            if not mine:
                return Outcome(cell=name, state="held", said="")
            if study.finished(name):
                return Outcome(cell=name, state="finished", said="")
            front = _run(job, study.cell(name))
            study.forgive(name)
            if front.run.interrupted:
                return Outcome(cell=name, state="interrupted", said=front.run.stopped_by)
            if not study.finished(name):
                raise InvalidInputError(f"{study.cell(name)}: the front could not be written there")
            return Outcome(cell=name, state="finished", said="")
    except Exception as error:  # noqa: BLE001 - whatever one cell raises must not end the others
        said = str(error) if isinstance(error, TrajevoError) else f"{type(error).__name__}: {error}"
        return _failed(study, name, said, traceback.format_exc())


def run_cell_in_worker(job: Job, folder: str) -> Outcome:
    """Run a cell in a worker process, which uses a single BLAS thread from now on.

    A limit for each cell would not work: two cells in threads of one process would undo each other's limit.

    Args:
        job: as for :func:`run_cell`.
        folder: as for :func:`run_cell`.

    Raises:
        InvalidInputError: as for :func:`run_cell`.
    """
    threadpool_limits(limits=1, user_api="blas")
    return run_cell(job, folder)


def lost_cell(job: Job, folder: str, said: str) -> Outcome:
    """Record the failure of a cell whose process could not record it.

    Args:
        job: the cell.
        folder: the study's folder.
        said: what happened to it.
    """
    return _failed(StudyFolder(folder), job["cell"], said, "")


def _failed(study: StudyFolder, name: str, said: str, trace: str) -> Outcome:
    with suppress(OSError):
        study.fail(name, Failure(sentence=said, traceback=trace, host=platform.node()))
    return Outcome(cell=name, state="failed", said=said)


def _run(job: Job, folder: Path) -> Front:
    run = RunFolder(folder)
    if run.begun:
        manifest = run.manifest()
        if manifest.seed != job["seed"] or canonical(manifest.problem.settings) != canonical(job["arguments"]):
            raise InvalidInputError(f"{folder} holds another run than this cell's; remove it")
        return resume(folder, problem=_problem(job), progress=False)
    run.clear()
    problem = _problem(job)
    with jit.one_kind(job.get("kernels")):
        return optimise(problem, Search.of(**job["search"], seed=job["seed"]), out=folder, progress=False)


def _problem(job: Job) -> TrajectoryProblem:
    with looking_in(job.get("folder", ".")):
        return load_problem(job["problem"], **job["arguments"])
