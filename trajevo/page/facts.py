"""The facts about a run as texts, for its page and for the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from trajevo.base.units import display, known_digits, pretty
from trajevo.errors import TrajevoError
from trajevo.front.front import Front
from trajevo.front.records import ProblemRecord, Run
from trajevo.front.solution import Solution
from trajevo.path.loads import told_loads
from trajevo.robot.payload import LOAD_MODELS, Payload
from trajevo.solvers.gradient.optimality import anchors_told


def objective_headers(front: Front, *, angle: str | None = None) -> list[tuple[str, float]]:
    """For each objective, the column header with its unit and the factor from SI."""
    record = front.record
    shown = [
        display(objective.unit, angle=angle or record.angle, length=record.length) for objective in record.objectives
    ]
    return [
        (f"{objective.name} [{pretty(unit)}]", factor)
        for objective, (unit, factor) in zip(front.record.objectives, shown, strict=True)
    ]


def known_values(front: Front, rows: Sequence[int], factors: Sequence[float]) -> list[list[str]]:
    """Objectives of rows of a front times factors from SI, with as many digits as are known of them."""
    values, known_to = (array * np.array(factors) for array in (front.F[list(rows)], front.known_to(rows)))
    return [list(map(known_digits, *pair)) for pair in zip(values.tolist(), known_to.tolist(), strict=True)]


def visit_rows(solution: Solution) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Headers and rows of a table of the points as a solution visits them; no rows if nothing of that is chosen."""
    found, front = solution.visits, solution.front
    if found is None:
        return (), []
    times = front.problem.via_times(solution.x)[0]
    rows = zip(range(len(times)), found.order, times.tolist(), found.postures, strict=True)
    headers = ("place", "point", "at [s]", "posture")
    return headers, [(str(k), str(point), f"{time:.4f}", posture or "as given") for k, point, time, posture in rows]


def run_facts(front: Front, *, brief: bool = False) -> list[tuple[str, str]]:
    """The facts about a run, as labels and texts.

    Args:
        front: the front of the run.
        brief: leave out points, tables and settings that are off, variables and versions, which may fill a screen.
    """
    run, record = front.run, front.record
    notes = _mass_notes(front)
    failures = f"{run.failures} of {run.evaluations} evaluations"
    settings, of_run = (_short(given) if brief else _told(given) for given in (record.settings, run.settings))
    facts = [
        ("problem", f"{record.title} ({record.name or 'not registered'})"),
        ("robot", f"{record.robot}: {record.robot_reference}"),
        *([("efforts", "; ".join(notes))] if notes else []),
        ("problem settings (SI)", _listed(settings) or "none"),
        ("payload", f"{_carried(record)}, {LOAD_MODELS[record.payload['model']]}"),
        ("variables", ", ".join(f"{v.name} in [{v.lower:g}, {v.upper:g}] {v.unit}" for v in record.variables)),
        ("algorithm", run.algorithm),
        ("settings", _listed(of_run)),
        ("seed", str(run.seed)),
        (
            "levels" if run.algorithm == "NNC" else "generations",
            f"{run.generations}{_interruption(run)}",
        ),
        ("evaluations", f"{run.evaluations} in {run.seconds:.2f} s"),
        ("failed evaluations", failures + (f", first: {run.first_failure}" if run.failures else "")),
        ("front", f"{len(front)} non-dominated feasible solutions"),
        *([("anchors", anchors_told(run.settings))] if anchors_told(run.settings) else []),
        ("hypervolume", f"{front.history.hypervolume[-1]:.6f} of the reference box" if len(front) else "0"),
        ("versions", ", ".join(f"{name} {number}" for name, number in run.versions.items())),
    ]
    left_out = {"variables", "versions", "front", *([] if run.failures else ["failed evaluations"])} if brief else ()
    return [(label, text) for label, text in facts if label not in left_out]


def _told(settings: dict[str, Any]) -> dict[str, Any]:
    """Settings with the length of the text of a robot's URDF in its place."""
    robot = settings.get("robot")
    if not isinstance(robot, dict) or not isinstance(robot.get("urdf"), str):
        return settings
    return settings | {"robot": robot | {"urdf": f"a text of {len(robot['urdf'])} characters"}}


def _short(settings: dict[str, Any]) -> dict[str, Any]:
    """Settings that are on and fit into some words: no tables, and no lists of lists or tables."""
    return {
        name: value
        for name, value in settings.items()
        if value is not None
        and name != "title"
        and not isinstance(value, dict)
        and not (isinstance(value, list | tuple) and (not value or isinstance(value[0], list | tuple | dict)))
    }


def _mass_notes(front: Front) -> tuple[str, ...]:
    """What the efforts of the robot do not cover; nothing if the problem is not at hand."""
    try:
        return front.problem.robot.mass_notes
    except TrajevoError:
        return ()


def _carried(record: ProblemRecord) -> str:
    """The mass of the payload, or its range if it is a variable."""
    variable = next((v for v in record.variables if (v.name, v.unit) == ("payload", "kg")), None)
    loads, mass = record.settings.get("payload"), None if variable is None else (variable.lower, variable.upper)
    if isinstance(loads, list):
        return told_loads(loads, mass)
    if variable is None:
        return f"{Payload.of(record.payload, model=None).mass:g} kg"
    return f"{variable.lower:g} to {variable.upper:g} kg"


def _interruption(run: Run) -> str:
    """Text that says whether a run was stopped or has been resumed."""
    by = f" by {run.stopped_by}" if run.stopped_by else ""
    told = [f"interrupted{by}"] if run.interrupted else []
    told += [f"resumed after {', '.join(map(str, run.resumed))}"] if run.resumed else []
    return f" ({'; '.join(told)})" if told else ""


def _listed(settings: dict[str, Any]) -> str:
    return ", ".join(f"{key} = {brief(value)}" for key, value in settings.items())


def brief(value: Any) -> str:
    """Numbers to six digits, in lists too; the front's file holds all digits."""
    if isinstance(value, list | tuple):
        return "(" + ", ".join(brief(entry) for entry in value) + ")"
    return f"{value:.6g}" if isinstance(value, float) else str(value)
