"""Compare robots at one task: a study whose factor is the robot, and one front over all of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import moocore
import numpy as np
import pydantic

from trajevo.base import jit
from trajevo.base.arrays import Array, frozen
from trajevo.base.toml import problem_of
from trajevo.errors import InvalidInputError, checked_name
from trajevo.formulation.objectives import UNUSED_PAYLOAD
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.front.front import Front
from trajevo.front.records import ObjectiveRecord
from trajevo.solvers.run.folder import RunFolder
from trajevo.study.definition import Study
from trajevo.study.engines import Engine, InProcess
from trajevo.study.folder import StudyFolder
from trajevo.study.jobs import SEARCH, Job
from trajevo.study.record import Level, StudyRecord, TaskContent
from trajevo.study.robots.ability import Ability, abilities
from trajevo.study.robots.asked import OF_ROBOTS, RobotTask, asked_of
from trajevo.study.robots.choice import ComparedRobot, RobotChoice, State, beaten
from trajevo.study.robots.largest import RobotPayload, largest_payloads
from trajevo.study.run import StudyStanding, run_study

#: The factor of such a study.
FACTOR = "robot"


def choose_robot(
    task: str | Path | Mapping[str, Any],
    robots: Any = None,
    *,
    seed: int | None = None,
    engine: Engine | None = None,
    out: str | Path | None = None,
    payload: bool = True,
    within: float | None = None,
    progress: bool = True,
    **search: Any,
) -> RobotChoice:
    """Solve one task for several robots, and tell which of them is worth having: one front over all.

    Each robot's front is searched by itself, a cell of a study with a seed of its own; a motion stays in the common
    front if no motion of any robot beats it. Robots that no motion can let do the task are not searched, see
    :func:`trajevo.check`, and told with what stops them. A cell that fails stops no other.

    Args:
        task: file of a task, name of an example, or the keys of a task as a mapping; its points are poses of the tool,
            and ``robots`` stands in it in place of ``robot``. Its objectives may be ``price`` and ``mass`` too, which
            the catalogue tells.
        robots: in place of those of the task: names, files, :class:`~trajevo.Robot` or tables with the keys of
            ``[[robots]]``, or the path of a catalogue; a name that the task gives one of its own robots means that one.
        seed: seed from which those of all robots are derived; the task's if None.
        engine: runs the searches, such as ``Processes(2)`` or ``DaskCluster(2)``; one after the other in this process
            if None. The fronts are the same to the bit.
        out: folder of the study, in which finished searches stay finished and those that were begun go on; robots may
            be added there later. Nothing is kept if None.
        payload: also find the largest payload of each robot that can do the task, by
            :func:`~trajevo.largest_payload`.
        within: longest time of the motions of largest payload [s]; what the task allows if None.
        progress: show how many robots are done.
        **search: settings of the search, as in :class:`~trajevo.Search`; they take precedence over the task's.

    Raises:
        UnknownNameError: no such task, robot or setting.
        InvalidInputError: a key that is unknown or belongs to one robot, no robots or two of one name, a robot that
            lacks limits, a value that no robot can use, or a folder that holds another study.
    """
    engine = InProcess() if engine is None else engine
    if not isinstance(engine, Engine):
        raise InvalidInputError(f"engine: expected InProcess, Processes or DaskCluster, got {engine!r}")
    _check_within(within)
    for name in search:
        checked_name("setting of a search", name, SEARCH)
    asked = asked_of(task, robots)
    known = abilities(asked)
    study = _study(asked, known, seed, search)
    with ExitStack() as stack:
        folder = Path(out) if out is not None else Path(stack.enter_context(TemporaryDirectory()))
        standing = None if study is None else run_study(study, folder, engine=engine, progress=progress)
        carried = {} if study is None or not payload else _carried(study, folder, standing, within, engine)
        fronts = {} if study is None else _fronts(study, folder)
        found = _compared(asked, known, study, standing, fronts, carried, within)
        return replace(found, folder=None if out is None else folder)


def _check_within(within: float | None) -> None:
    if within is not None and (isinstance(within, bool) or not isinstance(within, int | float) or not within > 0.0):
        raise InvalidInputError(f"within: expected a positive time [s], got {within!r}")


def _study(asked: RobotTask, known: Sequence[Ability], seed: int | None, search: Mapping[str, Any]) -> Study | None:
    """The study of all robots that may be able to do the task; None if there are none."""
    able = [one.candidate for one in known if one.problem is not None and not one.stopped_by]
    if not able:
        return None
    given = {name: value for name, value in search.items() if value is not None}
    try:
        record = StudyRecord(
            task=TaskContent(content=dict(asked.content), folder=str(asked.folder)),
            seed=asked.content.get("seed", 1) if seed is None else seed,
            repeats=1,
            fixed=given,
            factors={FACTOR: tuple(Level(label=one.name, value=dict(one.robot)) for one in able)},
            folder=str(asked.folder),
        )
    except pydantic.ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"])) or "study"
        raise InvalidInputError(f"{place}: {problem_of(first)}") from error
    return Study.of(record)


def _jobs(study: Study) -> dict[str, Job]:
    """The job of each robot, by its name."""
    pairs = zip(study.cells, study.jobs, strict=True)
    return {cell.labels[FACTOR]: job for cell, job in pairs}


def _fronts(study: Study, folder: Path) -> dict[str, Front]:
    """The fronts of the robots whose searches are finished, by their names."""
    place, found = StudyFolder(folder), {}
    for name, job in _jobs(study).items():
        if place.finished(job["cell"]):
            front = Front.load(RunFolder(place.cell(job["cell"])).front_file)
            if front.run.seed != job["seed"]:
                raise InvalidInputError(
                    f"{place.cell(job['cell'])} holds another run than this robot's: seed {front.run.seed}, not "
                    f"{job['seed']}"
                )
            found[name] = front
    return found


def _carried(
    study: Study, folder: Path, standing: StudyStanding | None, within: float | None, engine: Engine
) -> dict[str, RobotPayload]:
    """The largest payloads of the robots, by their names; none of an interrupted study."""
    if standing is None or standing.stopped_by:
        return {}
    place = StudyFolder(folder)
    with jit.one_kind(place.kernels()) as kernels:
        jobs = {name: Job(**job | {"kernels": kernels}) for name, job in _jobs(study).items()}
    ended = {name: job for name, job in jobs.items() if place.finished(job["cell"])}
    found = largest_payloads(list(ended.values()), place.folder, within=within, engine=engine)
    return {name: found[job["cell"]] for name, job in ended.items()}


def _compared(
    asked: RobotTask,
    known: Sequence[Ability],
    study: Study | None,
    standing: StudyStanding | None,
    fronts: Mapping[str, Front],
    carried: Mapping[str, RobotPayload],
    within: float | None,
) -> RobotChoice:
    """All that is known of the robots, put together."""
    first = next((one.problem for one in known if one.problem is not None), None)
    objectives = _objectives(asked, first)
    heaviest, notes = _heaviest(known, asked)
    values = {one.candidate.name: _values(one, fronts.get(one.candidate.name), asked, heaviest) for one in known}
    best, by = non_dominated(values)
    failures = {} if standing is None else {one.cell.labels[FACTOR]: one for one in standing.cells}
    cells = {} if study is None else {cell.labels[FACTOR]: cell for cell in study.cells}
    robots = []
    for one in known:
        name = one.candidate.name
        front = fronts.get(name)
        state, stopped, reason = _state(one, front, failures.get(name), by[name], best[name])
        robots.append(
            ComparedRobot(
                candidate=one.candidate,
                state=state,
                stopped_by=stopped,
                reason=reason,
                misses=one.misses,
                front=front,
                F=frozen(values[name]),
                best=frozen(best[name]),
                beaten_by=by[name],
                carried=carried.get(name),
                seed=cells[name].seed if name in cells else 0,
                cell=cells[name].name if name in cells else "",
            )
        )
    unknown = [f"{name}: largest payload not known: {one.said}" for name, one in carried.items() if one.said]
    stopped_by = "" if standing is None else standing.stopped_by
    return RobotChoice(asked.title, objectives, tuple(robots), within, (*notes, *unknown), None, stopped_by)


def _state(known: Ability, front: Front | None, cell: Any, by: tuple[str, ...], best: Array) -> tuple[State, str, str]:
    """State of a robot, what stops it, and why."""
    if known.stopped_by:
        return "impossible", known.stopped_by, known.reason
    if front is None:
        failure = None if cell is None else cell.failure
        return ("not finished", "", "run the same again") if failure is None else ("failed", "", failure.sentence)
    if not len(front):
        blocking = front.blocking
        exceeded = [] if blocking is None else list(blocking.violations)
        return "nothing found", exceeded[0] if exceeded else "", str(blocking)
    return ("best", "", "") if best.any() else ("beaten", "", beaten(by))


def _objectives(asked: RobotTask, problem: TrajectoryProblem | None) -> tuple[ObjectiveRecord, ...]:
    """Records of all objectives in the order of the task; without a unit where no problem could be made."""
    of_motions = iter(() if problem is None else problem.objectives)
    units = {"price": asked.currency or "1", "mass": "kg"}
    found = []
    for name in asked.objectives:
        one = None if name in OF_ROBOTS else next(of_motions, None)
        if one is not None:
            found.append(ObjectiveRecord(name=one.name, unit=one.unit, reference=one.reference))
        else:
            source = f"catalogue: {OF_ROBOTS[name]}" if name in OF_ROBOTS else ""
            found.append(ObjectiveRecord(name=name, unit=units.get(name, "1"), reference=source))
    return tuple(found)


def _heaviest(known: Sequence[Ability], asked: RobotTask) -> tuple[Mapping[str, float], tuple[str, ...]]:
    """By how much each robot's unused payload counts from the greatest mass of all robots [kg], and a note on it.

    Each robot's own is measured from the greatest mass that it can hold itself, and so cannot be compared.
    """
    if UNUSED_PAYLOAD not in asked.objectives:
        return {}, ()
    most = {
        one.candidate.name: one.problem.payload_range[1]
        for one in known
        if one.problem is not None and one.problem.payload_range is not None
    }
    if not most:
        return {}, ()
    greatest = max(most.values())
    note = f"unused payload counts from {greatest:.4g} kg, the most that any of these robots may carry"
    alike = min(most.values()) == greatest
    return {name: greatest - mass for name, mass in most.items()}, () if alike else (note,)


def _values(known: Ability, front: Front | None, asked: RobotTask, heaviest: Mapping[str, float]) -> Array:
    """All objectives of a robot's front, shape (N, n_obj), N = 0 without one."""
    if front is None or not len(front):
        return np.empty((0, len(asked.objectives)))
    columns, own = [], iter(front.F.T)
    for name in asked.objectives:
        if name in OF_ROBOTS:
            columns.append(np.full(len(front), getattr(known.candidate, name)))
        else:
            shift = heaviest.get(known.candidate.name, 0.0) if name == UNUSED_PAYLOAD else 0.0
            columns.append(next(own) + shift)
    return np.stack(columns, axis=1)


def non_dominated(values: Mapping[str, Array]) -> tuple[dict[str, Array], dict[str, tuple[str, ...]]]:
    """What of several fronts is left when they are put together, and who beats those of whom nothing is left.

    Args:
        values: name -> objective values, shape (N, n_obj), where less is better. Equal rows of two names both stay.

    Returns:
        Name -> mask of its rows that no row of any name dominates, shape (N,); and name -> names of the others that
        together beat all of its rows, the one that beats most first, none for those that keep a row.
    """
    sizes = {name: len(F) for name, F in values.items()}
    every = np.concatenate(list(values.values()))
    owner = np.repeat(np.arange(len(values)), list(sizes.values()))
    kept = moocore.is_nondominated(every, keep_weakly=True) if len(every) else np.zeros(0, dtype=bool)
    masks = {name: kept[owner == k] for k, name in enumerate(values)}
    by: dict[str, tuple[str, ...]] = dict.fromkeys(values, ())
    for name, F in values.items():
        if len(F) and not masks[name].any():
            others = {other: values[other][masks[other]] for other in values if other != name and masks[other].any()}
            by[name] = _fewest({other: _dominated(F, best) for other, best in others.items()})
    return masks, by


def _dominated(F: Array, by: Array) -> Array:
    """Which rows of F some row of others dominates, shape (N,)."""
    found = np.zeros(len(F), dtype=bool)
    for row in range(0, len(F), 256):  # in blocks, as the comparison takes N x M x n_obj
        mine = F[row : row + 256, None]
        found[row : row + 256] = _dominates(by, mine).any(axis=1)
    return found


def _dominates(these: Array, those: Array) -> Array:
    """Whether rows dominate others along the last axis, the other axes broadcast."""
    found: Array = np.all(these <= those, axis=-1) & np.any(these < those, axis=-1)
    return found


def _fewest(covered: Mapping[str, Array]) -> tuple[str, ...]:
    """Names whose rows together cover all, the one that covers most of what is left first."""
    left = np.ones(len(next(iter(covered.values()))), dtype=bool)
    chosen: list[str] = []
    while left.any():
        name = max(covered, key=lambda other: int((covered[other] & left).sum()))
        chosen.append(name)
        left &= ~covered[name]
    return tuple(chosen)
