"""Collect what the cells of a study have found, and make their hypervolumes comparable."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from trajevo.base.arrays import Array, frozen, read_only
from trajevo.errors import InvalidInputError
from trajevo.front.archive import Archive
from trajevo.front.front import Front
from trajevo.solvers.run.folder import RunFolder
from trajevo.study.folder import StudyFolder
from trajevo.study.record import Cell
from trajevo.study.results import CellResult, StudyBox, StudyResults


def collect(folder: str | Path) -> StudyResults:
    """Collect what the finished cells of a study have found.

    All hypervolumes refer to the same box, so that they can be compared. If all runs have the same box, it is that one.
    Otherwise it is a box that contains the fronts of all cells, and the histories are computed again from the runs'
    individuals.

    Args:
        folder: the study's folder.

    Raises:
        InvalidInputError: no study, no finished cell, a cell that holds a run of another study, or cells with different
            objectives.
    """
    place = StudyFolder(folder)
    standings = place.standings()
    finished = [standing.cell for standing in standings if standing.state == "finished"]
    if not finished:
        raise InvalidInputError(f"{place.folder}: no cell of the study is finished")
    fronts = [_front(place, cell) for cell in finished]
    _same_objectives(finished, fronts)
    box = common_box(fronts)
    return StudyResults(
        folder=place.folder,
        record=place.record(),
        unfinished=len(standings) - len(finished),
        objectives=fronts[0].record.objectives,
        angle=fronts[0].record.angle,
        length=fronts[0].record.length,
        box=box,
        cells=tuple(
            _result(cell, front, RunFolder(place.cell(cell.name)), box)
            for cell, front in zip(finished, fronts, strict=True)
        ),
    )


def common_box(fronts: Sequence[Front]) -> StudyBox | None:
    """One box for the hypervolumes of several fronts; None if all are empty.

    Args:
        fronts: fronts with the same objectives.
    """
    own = {front.history.reference_point for front in fronts if len(front) or front.history.reference_point}
    if len(own) == 1 and None not in own:
        upper = np.array(own.pop(), dtype=np.float64)
        return StudyBox(frozen(np.zeros(len(upper))), frozen(upper), "the reference point of all runs")
    points = [front.F for front in fronts if len(front)]
    if not points:
        return None
    F = np.concatenate(points)
    best, worst = F.min(axis=0), F.max(axis=0)
    if (best > 0.0).all():
        return StudyBox(
            frozen(np.zeros(len(worst))), frozen(1.1 * worst), "a tenth beyond the worst points of all fronts"
        )
    width = np.where(worst > best, worst - best, np.maximum(np.abs(worst), 1.0))
    return StudyBox(
        read_only(best), frozen(worst + 0.1 * width), "from the best points of all fronts to a tenth beyond the worst"
    )


def _front(place: StudyFolder, cell: Cell) -> Front:
    front = Front.load(RunFolder(place.cell(cell.name)).front_file)
    if front.run.seed != cell.seed:
        raise InvalidInputError(
            f"{place.cell(cell.name)} holds another run than this cell's: seed {front.run.seed}, not {cell.seed}"
        )
    return front


def _same_objectives(cells: Sequence[Cell], fronts: Sequence[Front]) -> None:
    said = [[f"{one.name} [{one.unit}]" for one in front.record.objectives] for front in fronts]
    for cell, objectives in zip(cells, said, strict=True):
        if objectives != said[0]:
            raise InvalidInputError(
                f"cells with different objectives cannot be compared: {cells[0].name} has {', '.join(said[0])}, "
                f"{cell.name} has {', '.join(objectives)}"
            )


def _result(cell: Cell, front: Front, run: RunFolder, box: StudyBox | None) -> CellResult:
    volumes = np.zeros(len(front.history.evaluations))
    if box is not None:
        same = front.history.reference_point == tuple(box.upper.tolist()) and not box.lower.any()
        volumes = np.array(front.history.hypervolume) if same else _history(front, run, box)
    return CellResult(
        cell=cell,
        F=front.F,
        knee=read_only(list(front.knee().F.values()) if len(front) else np.full(front.F.shape[1], np.nan)),
        evaluations=read_only(front.history.evaluations),
        hypervolume=frozen(volumes),
        generations=front.run.generations,
        seconds=front.run.seconds,
        cpu_seconds=front.run.cpu_seconds[-1],
        failures=front.run.failures,
    )


def _history(front: Front, run: RunFolder, box: StudyBox) -> Array:
    """Hypervolume by generation in a box other than that of the run, computed from all individuals of the run."""
    volumes = np.full(len(front.history.evaluations), np.nan)
    if run.begun:
        problem = run.manifest().problem.make()
        archive = Archive(problem.n_var, problem.n_obj, problem.n_ieq_constr)
        for block in run.blocks(front.run.generations):
            for generation in np.unique(block.generation):
                rows = block.generation == generation
                archive.add(block.X[rows], block.F[rows], block.G[rows])
                F = archive.F
                if problem.expansion is not None and len(F):
                    _, F = problem.expansion.points(archive.X, F)
                volumes[int(generation) - 1] = box.share(F)
    volumes[-1] = box.share(front.F)
    return volumes
