"""A motion at samples: a table in CSV, and JSON with the samples and the exact trajectory."""

from __future__ import annotations

import csv
import io
import json
from importlib import resources
from typing import Any

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.units import display, per_time
from trajevo.exporters.exporter import Exporter, about, cell, comments
from trajevo.front.front import Solution
from trajevo.trajectory.batch import DERIVATIVES


def motion_schema() -> dict[str, Any]:
    """The JSON Schema (2020-12) of the format ``"json"``."""
    text = (resources.files("trajevo.exporters") / "motion.schema.json").read_text(encoding="utf-8")
    schema: dict[str, Any] = json.loads(text)
    return schema


def sample_table(solution: Solution, step: float, angle: str) -> str:
    """Comments, then a table of the motion in CSV.

    Args:
        solution: the solution to write.
        step: time between samples [s]; the last interval takes 0.5 to 1.5 steps and ends with the motion.
        angle: ``"rad"`` or ``"deg"``.
    """
    headers, table = _columns(solution, step, angle)
    stream = io.StringIO()
    stream.write(comments(solution))
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(map(cell, headers))
    writer.writerows([[repr(value) for value in row] for row in table.tolist()])
    return stream.getvalue()


def motion_json(solution: Solution, step: float, angle: str) -> str:
    """The exact trajectory and its samples by :func:`motion_schema`; arguments as for :func:`sample_table`."""
    headers, table = _columns(solution, step, angle)
    trajectory, robot = solution.trajectory, solution.front.problem.robot
    content = {
        "format": "trajevo motion",
        "version": 1,
        **about(solution),
        "trajectory": {
            "joints": robot.joint_names,
            "units": robot.joint_units,
            **trajectory.definition(0),
        },
        "samples": {header: column.tolist() for header, column in zip(headers, table.T, strict=True)},
    }
    return json.dumps(content, indent=1, allow_nan=False)


def _instants(duration: float, step: float) -> Array:
    inner = np.arange(0.0, duration, step)
    inner = inner[: 1 + int(np.searchsorted(inner[1:], duration - 0.5 * step, side="right"))]
    return np.append(inner, duration)


def _columns(solution: Solution, step: float, angle: str) -> tuple[list[str], Array]:
    """Headers with units, and the table, time first: (T, 1 + 5 n_joints) or, without masses, (T, 1 + 4 n_joints)."""
    rollout = solution.rollout
    robot = rollout.robot
    t = _instants(float(rollout.trajectory.duration[0]), step)
    derivatives = [rollout.trajectory.evaluate(t, order) for order in range(len(DERIVATIVES))]
    headers, columns = ["time [s]"], [t]
    for order, quantity in enumerate(DERIVATIVES):
        for joint, (name, unit) in enumerate(zip(robot.joint_names, robot.joint_units, strict=True)):
            shown, factor = display(per_time(unit, order), angle=angle)
            headers.append(f"{name} {quantity} [{shown}]")
            columns.append(derivatives[order][0, :, joint] * factor)
    if robot.gives_effort:
        effort = rollout.effort_in(derivatives[0], derivatives[1], derivatives[2], t)
        for joint, (name, unit) in enumerate(zip(robot.joint_names, robot.joint_units, strict=True)):
            headers.append(f"{name} effort [{'N*m' if unit == 'rad' else 'N'}]")
            columns.append(effort[0, :, joint])
    return headers, np.stack(columns, axis=1)


CSV = Exporter(
    "csv",
    "csv",
    "comment lines with the settings, then one row per instant: position, velocity, acceleration, jerk and effort",
    sample_table,
)

JSON = Exporter(
    "json",
    "json",
    "the settings, the exact trajectory and its samples, as its JSON Schema says",
    motion_json,
    beginning=b'{\n "format": "trajevo motion"',
)
