"""The largest payload of each robot through the same points in the same time, one run for each, kept in its folder."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TypedDict

from trajevo.base import jit
from trajevo.base.files import read_text, write_whole
from trajevo.base.own.code import looking_in
from trajevo.capacity.payload_time import largest_payload
from trajevo.errors import TrajevoError
from trajevo.formulation.registry import load_problem
from trajevo.front.records import Record
from trajevo.study.engines import Engine
from trajevo.study.folder import StudyFolder
from trajevo.study.jobs import Job

#: File of a cell's largest payload.
PAYLOAD_FILE = "largest_payload.json"


class RobotPayload(Record):
    """The largest payload of one robot at the task.

    Attributes:
        mass: its mass [kg]; None if it is not known.
        time: duration of the motion that carries it [s]; None if it is not known.
        at_rest: greatest mass that the robot holds at rest at the first and the last point [kg]; None if not known.
        said: why it is not known; else empty.
        within: the longest time of the motion [s]; None for what the task allows.
        seed: seed of the search.
    """

    mass: float | None = None
    time: float | None = None
    at_rest: float | None = None
    said: str = ""
    within: float | None = None
    seed: int

    def __str__(self) -> str:
        return "not known" if self.mass is None else f"{self.mass:.3f}"


class PayloadJob(TypedDict):
    """What a worker needs to find the largest payload of a robot: its cell, the study's folder, and a time [s]."""

    job: Job
    folder: str
    within: float | None


def largest_payloads(
    jobs: Sequence[Job], folder: Path, *, within: float | None, engine: Engine
) -> dict[str, RobotPayload]:
    """The largest payload of the robot of each cell, by the cell's name; what is in the folder is not computed again.

    Args:
        jobs: the cells.
        folder: the study's folder.
        within: the longest time of the motions [s]; None for what the task allows.
        engine: what computes them.
    """
    found = {job["cell"]: known for job in jobs if (known := _kept(job, folder, within)) is not None}
    missing = [PayloadJob(job=job, folder=str(folder), within=within) for job in jobs if job["cell"] not in found]
    for asking, one in zip(missing, engine.map(carried_by, missing) if missing else (), strict=True):
        found[asking["job"]["cell"]] = one
    return found


def carried_by(asking: PayloadJob) -> RobotPayload:
    """The largest payload of one robot, also written to the folder of its cell; what is refused is told in it.

    Args:
        asking: the cell.
    """
    job, within = asking["job"], asking["within"]
    try:
        with looking_in(job.get("folder", ".")), jit.one_kind(job.get("kernels")):
            problem = load_problem(job["problem"], **job["arguments"])
            largest = largest_payload(problem, within=within, seed=job["seed"])
        at_rest = largest.at_rest if math.isfinite(largest.at_rest) else None
        found = RobotPayload(mass=largest.mass, time=largest.time, at_rest=at_rest, within=within, seed=job["seed"])
    except TrajevoError as error:
        found = RobotPayload(said=str(error), within=within, seed=job["seed"])
    file = _file(job, Path(asking["folder"]))
    with suppress(OSError):  # it is computed again
        write_whole(file, found.model_dump_json(indent=1).encode())
    return found


def _file(job: Job, folder: Path) -> Path:
    return StudyFolder(folder).cell(job["cell"]) / PAYLOAD_FILE


def _kept(job: Job, folder: Path, within: float | None) -> RobotPayload | None:
    try:
        found = RobotPayload.model_validate_json(read_text(_file(job, folder)))
    except (OSError, ValueError):
        return None
    return found if (found.within, found.seed, found.said) == (within, job["seed"], "") else None
