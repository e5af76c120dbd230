"""Run a study: hand its cells to an engine until all are finished or have failed, and tell where it stands."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from trajevo.errors import InvalidInputError
from trajevo.stopping import Stopping
from trajevo.study.cell import Outcome
from trajevo.study.definition import Study
from trajevo.study.engines import POLL, Engine, InProcess
from trajevo.study.folder import STATES, CellStanding, State, StudyFolder
from trajevo.study.jobs import Job
from trajevo.study.progress import CellsShown

#: How long a front that a worker has written may take to be seen here, through a network's file system [s].
_LAG = 60.0


@dataclass(frozen=True)
class StudyStanding:
    """Where a study stands.

    Attributes:
        folder: its folder.
        cells: where every cell stands.
        stopped_by: name of the signal that ended this run of the study, or empty.
    """

    folder: Path
    cells: tuple[CellStanding, ...]
    stopped_by: str = ""

    def __str__(self) -> str:
        counts = [(state, self.count(state)) for state in STATES]
        return f"{len(self.cells)} cells: " + ", ".join(f"{count} {state}" for state, count in counts if count)

    def count(self, state: State) -> int:
        """Cells in a state, see :data:`trajevo.study.folder.STATES`."""
        return sum(cell.state == state for cell in self.cells)

    @property
    def finished(self) -> bool:
        """Whether every cell is finished."""
        return self.count("finished") == len(self.cells)


def run_study(
    study: Study, folder: str | Path, *, engine: Engine | None = None, progress: bool = True
) -> StudyStanding:
    """Run the cells of a study that are not finished; those that were begun go on from their checkpoints.

    A cell that fails is recorded with its traceback and does not stop the others; it is tried again at the next run.
    Another run of the same study at the same time shares the work: each cell is run by one of them. SIGINT and SIGTERM
    let running cells finish their generation and end the run; a second signal aborts it. Either way the next run goes
    on.

    Args:
        study: the study.
        folder: where it is kept: ``study.json``, and a run's folder for every cell in ``cells``. It may hold the same
            study with fewer levels or repeats.
        engine: where cells run; one after the other in this process if None.
        progress: show finished, failed, running and waiting cells and the time left on standard error.

    Returns:
        Where the study stands.

    Raises:
        InvalidInputError: the folder holds another study or cannot be written, or workers cannot run the cells.
    """
    if not isinstance(study, Study):
        raise InvalidInputError(f"study: expected a Study, got {type(study).__name__}")
    engine = InProcess() if engine is None else engine
    if not isinstance(engine, Engine):
        raise InvalidInputError(f"engine: expected InProcess, Processes or DaskCluster, got {engine!r}")
    place = StudyFolder(folder)
    place.keep(study.record)
    # First repeats first: what stands early compares all levels, and a machine that slows down favours none.
    in_turn = sorted(zip(study.cells, study.jobs, strict=True), key=lambda pair: pair[0].repeat)
    waiting = [job for _, job in in_turn if not place.finished(job["cell"])]
    total, before = len(study.jobs), len(study.jobs) - len(waiting)
    shown = CellsShown(total, finished=before, workers=engine.workers, enabled=progress)
    with Stopping() as stopping, shown:
        while waiting and not stopping:
            waiting = _pass(engine, waiting, place, stopping, shown)
    return StudyStanding(place.folder, place.standings(), stopping.asked_by)


def study_standing(folder: str | Path) -> StudyStanding:
    """Where a study stands, while it runs or after.

    Args:
        folder: the study's folder.

    Raises:
        InvalidInputError: the folder holds no study.
    """
    place = StudyFolder(folder)
    return StudyStanding(place.folder, place.standings())


def _pass(engine: Engine, jobs: Sequence[Job], place: StudyFolder, stopping: Stopping, shown: CellsShown) -> list[Job]:
    """Run cells once; those that must be handed out again, as another run of the study holds them."""
    again = []
    by_name = {job["cell"]: job for job in jobs}
    for outcome in engine.run(jobs, str(place.folder), stopping):
        if outcome["state"] in ("held", "interrupted"):
            again.append(by_name[outcome["cell"]])
            continue
        if outcome["state"] == "finished":
            _see(place, outcome)
        shown.update(outcome)
    while again and not stopping and all(place.running(job["cell"]) for job in again):
        time.sleep(POLL)
    finished = [job for job in again if place.finished(job["cell"])]
    for job in finished:
        shown.update(Outcome(cell=job["cell"], state="finished", said=""))
    return [job for job in again if job not in finished]


def _see(place: StudyFolder, outcome: Outcome) -> None:
    """Wait until the front that a worker has written is seen here."""
    until = time.monotonic() + _LAG
    while not place.finished(outcome["cell"]):
        if time.monotonic() > until:
            raise InvalidInputError(
                f"{place.cell(outcome['cell'])}: a worker has finished this cell, and its front is not here; "
                "put the study's folder where all workers and this machine see it"
            )
        time.sleep(POLL)
