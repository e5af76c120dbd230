"""Runs in folders: resume them with the same results to the bit, read them while they go on, polish their fronts."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from trajevo.base import jit
from trajevo.base.files import removed
from trajevo.errors import InvalidInputError
from trajevo.formulation.feasibility.check import check
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.front.front import Front
from trajevo.front.records import FORMULAS, ProblemRecord, installed_versions
from trajevo.solvers.evolutionary.algorithm_state import algorithm_of
from trajevo.solvers.evolutionary.seeded_tournaments import seeded
from trajevo.solvers.gradient.polish import polish
from trajevo.solvers.gradient.restoration import restored
from trajevo.solvers.run.evolution import evolve, front_so_far, nothing_searched
from trajevo.solvers.run.folder import Manifest, RunFolder

#: Algorithms that adapt to the planned number of generations, so that a finished run cannot be made longer.
_PLANNED = ("RVEA",)

#: Least CPU time for polishing, if the evolution has used up all of it [s].
_LEAST_CPU_TIME = 1e-3

#: Individuals of a run that are evaluated again where other formulas computed them, and share by which they may differ.
_COMPARED, _SAME = 8, 1e-6


@dataclass(frozen=True)
class Standing:
    """Progress of a run in a folder.

    Attributes:
        generation: number of generations at the latest checkpoint.
        generations: number of generations of the whole run.
        finished: whether the final front has been written.
        not_resumable: why the run cannot be resumed, or empty.
    """

    generation: int
    generations: int
    finished: bool
    not_resumable: str


def polished(front: Front, manifest: Manifest, folder: RunFolder | None, *, progress: bool) -> Front:
    """Polish the front of an evolution if the manifest says so; the folder also keeps the front before polishing.

    Where the evolution has found nothing feasible, gradients seek it from its nearest miss first.
    """
    if manifest.polish and not front.run.interrupted:
        front = restored(front)
    if not manifest.polish or front.run.interrupted or not len(front):
        if folder is not None:
            removed(folder.evolved_file)
        return front
    if folder is not None:
        folder.keep(front, evolved=True)
    seconds = None if manifest.cpu_time is None else max(manifest.cpu_time - front.run.cpu_seconds[-1], _LEAST_CPU_TIME)
    evaluations = None if manifest.evaluations is None else max(manifest.evaluations - front.run.evaluations, 1)
    return polish(front, evaluations=evaluations, cpu_time=seconds, progress=progress).front


def resume(
    folder: str | Path,
    *,
    problem: TrajectoryProblem | None = None,
    generations: int | None = None,
    progress: bool = True,
) -> Front:
    """Continue a run from its latest checkpoint; X and F equal, to the bit, those of a run that was never interrupted.

    Args:
        folder: folder that was passed to :func:`trajevo.solvers.optimise.optimise` as ``out``.
        problem: the problem, if it is not a registered one.
        generations: new total number of generations, to make the run longer.
        progress: show generation, hypervolume, least violation and time left, on standard error or, in a
            notebook, in the output of the cell.

    Returns:
        The front; if the run is finished, it is made again from the evaluated individuals.

    Raises:
        InvalidInputError: the folder holds no run that can be resumed, the problem is not that of the run, other
            formulas of trajevo gave its individuals other numbers, or ``generations`` is less than planned.
    """
    run = RunFolder(folder)
    manifest = run.manifest()
    if manifest.algorithm is None:
        raise InvalidInputError(f"{run.folder}: the run cannot be resumed: {manifest.not_resumable}")
    to_solve = _problem(manifest.problem, problem, run)
    solver = algorithm_of(manifest.algorithm)
    seeded(solver)
    with run.alone(), jit.one_kind(manifest.kernels):
        if generations is not None:
            manifest = _longer(manifest, generations, run)
        _compare_versions(manifest, run)
        _compare_formulas(manifest, to_solve, run)
        impossible = () if run.checkpoint() is not None else check(to_solve).impossible
        if impossible:
            front = nothing_searched(to_solve, manifest, impossible)
        else:
            front = evolve(to_solve, solver, manifest, folder=run, progress=progress)
            front = polished(front, manifest, run, progress=progress)
        run.keep(front)
    return front


def read_run(folder: str | Path, *, problem: TrajectoryProblem | None = None) -> Front:
    """The front of a run, finished or not; one that is not finished is marked as interrupted.

    Args:
        folder: the run's folder.
        problem: the problem, if it is not a registered one.

    Raises:
        InvalidInputError: the folder holds no run, or one that has not finished its first generation.
    """
    run = RunFolder(folder)
    if run.front_file.exists():
        front = Front.load(run.front_file, problem=problem)
        if not front.run.interrupted or front.run.generations == _counted(run):
            return front
    manifest = run.manifest()
    return front_so_far(_problem(manifest.problem, problem, run), manifest, run)


def standing(folder: str | Path) -> Standing:
    """Progress of a run, without reading its individuals.

    Raises:
        InvalidInputError: the folder holds no run, or a damaged one.
    """
    run = RunFolder(folder)
    manifest = run.manifest()
    counted = _counted(run)
    finished = run.front_file.exists() and not Front.load(run.front_file).run.interrupted
    return Standing(counted, manifest.generations, finished, manifest.not_resumable)


def _counted(run: RunFolder) -> int:
    """Number of generations at the latest checkpoint."""
    checkpoint = run.checkpoint()
    return 0 if checkpoint is None else len(checkpoint.get("books.evaluations", ()))


def _problem(record: ProblemRecord, given: TrajectoryProblem | None, run: RunFolder) -> TrajectoryProblem:
    if given is None:
        given = record.make()
    difference = record.difference(given)
    if difference:
        raise InvalidInputError(
            f"{run.folder}: the problem at hand differs from the one that this run was begun with: {difference}"
        )
    return given


def _longer(manifest: Manifest, generations: Any, run: RunFolder) -> Manifest:
    if not isinstance(generations, int) or isinstance(generations, bool) or generations < manifest.generations:
        raise InvalidInputError(
            f"generations: expected at least the {manifest.generations} that were planned, got {generations!r}"
        )
    if generations > manifest.generations and manifest.algorithm_name in _PLANNED:
        raise InvalidInputError(
            f"generations: {manifest.algorithm_name} adapts to the planned number, {manifest.generations}, from the "
            "first generation on; begin a new run for more"
        )
    longer = manifest.model_copy(
        update={"generations": generations, "settings": manifest.settings | {"generations": generations}}
    )
    run.replace_manifest(longer)
    return longer


def _compare_formulas(manifest: Manifest, problem: TrajectoryProblem, run: RunFolder) -> None:
    """Refuse to go on with numbers that formulas of another version of trajevo computed, if they differ here."""
    name, here = FORMULAS
    then = manifest.versions.get(name, "unknown")
    if then == here or run.checkpoint() is None:
        return
    for block in run.blocks(1):
        known = np.flatnonzero(np.isfinite(block.F).all(axis=1))[:_COMPARED]
        if not len(known):
            continue
        found = problem.evaluate(block.X[known], return_values_of=["F"])
        apart = np.abs(found - block.F[known]) > _SAME * np.abs(block.F[known]).max(axis=0, initial=0.0)
        for row, k in np.argwhere(apart)[:1]:
            objective, recorded = problem.objectives[k], block.F[known][row, k]
            raise InvalidInputError(
                f"{run.folder}: begun with formulas {then} of trajevo, here they are {here}: {objective.name} of an "
                f"individual on record is {recorded:.6g} {objective.unit}, here {found[row, k]:.6g}; one front cannot "
                "hold both. Its individuals can begin a new run: optimise(problem, initial=read_run(folder).X, ...)"
            )


def _compare_versions(manifest: Manifest, run: RunFolder) -> None:
    then, now = manifest.versions, installed_versions()
    pairs = {name: (then.get(name, "none"), now.get(name, "none")) for name in {**then, **now}}
    others = [f"{name} {was} -> {is_now}" for name, (was, is_now) in pairs.items() if was != is_now]
    if others:
        warnings.warn(
            f"{run.folder}: begun with other versions ({', '.join(others)}); what follows may differ from a run that "
            "was never interrupted",
            stacklevel=3,
        )
