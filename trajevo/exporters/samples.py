"""A motion at samples: a table in CSV, and JSON with the samples and the exact trajectory."""

from __future__ import annotations

import csv
import io
import json
from importlib import resources
from typing import Any

from trajevo.exporters.exporter import Exporter, about, cell, comments
from trajevo.front.front import Solution
from trajevo.front.motion_table import motion_columns


def motion_schema() -> dict[str, Any]:
    """The JSON Schema (2020-12) of the format ``"json"``."""
    return _schema("motion")


def proof_schema() -> dict[str, Any]:
    """The JSON Schema (2020-12) of the proof files that :meth:`Certificate.write_proof` writes."""
    return _schema("proof")


def _schema(name: str) -> dict[str, Any]:
    text = (resources.files("trajevo.exporters") / f"{name}.schema.json").read_text(encoding="utf-8")
    schema: dict[str, Any] = json.loads(text)
    return schema


def sample_table(solution: Solution, step: float, angle: str) -> str:
    """Comments, then a table of the motion in CSV.

    Args:
        solution: the solution to write.
        step: time between samples [s]; the last interval takes 0.5 to 1.5 steps and ends with the motion.
        angle: ``"rad"`` or ``"deg"``.
    """
    headers, table = motion_columns(solution, step, angle)
    stream = io.StringIO()
    stream.write(comments(solution))
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(map(cell, headers))
    writer.writerows(table.tolist())  # numbers by their repr
    return stream.getvalue()


def motion_json(solution: Solution, step: float, angle: str) -> str:
    """The exact trajectory and its samples by :func:`motion_schema`; arguments as for :func:`sample_table`."""
    headers, table = motion_columns(solution, step, angle)
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
    return _indented(content)


def _indented(value: Any, depth: int = 0) -> str:
    """The text of ``json.dumps(value, indent=1, allow_nan=False)``, which takes ten times as long for many numbers."""
    inner, outer = "\n" + " " * (depth + 1), "\n" + " " * depth
    if isinstance(value, dict) and value:
        items = (f"{json.dumps(key)}: {_indented(each, depth + 1)}" for key, each in value.items())
        return f"{{{inner}{f',{inner}'.join(items)}{outer}}}"
    if not isinstance(value, list | tuple) or not value:
        return json.dumps(value, allow_nan=False)
    if any(isinstance(each, dict | list | tuple) for each in value):
        written = f",{inner}".join(_indented(each, depth + 1) for each in value)
    else:
        written = json.dumps(value, separators=(f",{inner}", ": "), allow_nan=False)[1:-1]
    return f"[{inner}{written}{outer}]"


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
