"""A solution as a file for a controller, a spreadsheet or another program."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from trajevo.arrays import Array
from trajevo.errors import InvalidInputError, checked_name
from trajevo.feed import feed_table, g_code
from trajevo.front import Solution
from trajevo.trajectory import DERIVATIVES
from trajevo.units import display, per_time

#: Longest table that is written.
MOST_SAMPLES = 10_000_000

#: Formats that can be written.
FORMATS = ("csv", "json", "feed", "gcode")

#: How a file of each format begins.
_BEGINNINGS = (b"# problem: {", b'{\n "format": "trajevo motion"', b"; trajevo")


def export(solution: Solution, file: str | Path, *, format: str, step: float = 0.01, angle: str = "rad") -> Path:
    """Write the sampled motion of a solution, with units, settings and reference inside.

    Args:
        solution: what to write.
        file: where to.
        format: ``"csv"`` (comment lines with the settings, then one row per instant), ``"json"`` (also the exact
            trajectory), ``"feed"`` (CSV of straight blocks with their feeds, mm and mm/min, for linear axes alone) or
            ``"gcode"`` (the same blocks as G1 lines).
        step: time between samples [s]; the last sample is the end of the motion.
        angle: ``"rad"`` or ``"deg"``.

    Returns:
        The file.

    Raises:
        UnknownNameError: no such format or angle unit.
        InvalidInputError: a step that is not positive, or a file that cannot be written.
    """
    checked_name("export format", format, FORMATS)
    if not (isinstance(step, int | float) and np.isfinite(step) and step > 0.0):
        raise InvalidInputError(f"step: expected a positive time [s], got {step!r}")
    duration = solution.F.get("time", float(solution.trajectory.duration[0]))
    if duration / step > MOST_SAMPLES:
        raise InvalidInputError(f"step: {step:g} s gives over {MOST_SAMPLES} samples of a motion of {duration:.4g} s")
    content = _WRITERS[format](solution, step, angle)
    try:
        Path(file).write_text(content, encoding="utf-8")
    except OSError as error:
        raise InvalidInputError(f"{file}: cannot be written: {error.strerror}") from error
    return Path(file)


def is_exported(file: Path) -> bool:
    """Whether a file is one that :func:`export` wrote, by its first bytes."""
    if not (file.is_file() and file.suffix.removeprefix(".") in FORMATS):
        return False
    with file.open("rb") as stream:
        return stream.read(64).startswith(_BEGINNINGS)


def _instants(duration: float, step: float) -> Array:
    inner = np.arange(0.0, duration, step)
    return np.append(inner[inner < duration - 1e-9 * duration], duration)


def _columns(solution: Solution, step: float, angle: str) -> tuple[list[str], Array]:
    """Headers with units and the table, time first: shape (T, 1 + 4 n_joints)."""
    rollout = solution.rollout
    t = _instants(float(rollout.trajectory.duration[0]), step)
    headers, columns = ["time [s]"], [t]
    for order, quantity in enumerate(DERIVATIVES):
        values = rollout.trajectory.evaluate(t, order)[0]
        for joint, (name, unit) in enumerate(zip(rollout.robot.joint_names, rollout.robot.joint_units, strict=True)):
            shown, factor = display(per_time(unit, order), angle=angle)
            headers.append(f"{name} {quantity} [{shown}]")
            columns.append(values[:, joint] * factor)
    return headers, np.stack(columns, axis=1)


def _about(solution: Solution) -> dict[str, Any]:
    """What a stranger needs to know about the motion, as plain data."""
    front = solution.front
    return {
        "problem": front.record.model_dump(mode="json"),
        "run": front.run.model_dump(mode="json"),
        "solution": {
            "row": solution.index,
            "rule": solution.rule,
            "reason": solution.reason,
            "x": solution.x.tolist(),
            "objectives": solution.F,
            "constraints": solution.G,
        },
    }


def _comments(solution: Solution) -> str:
    return "".join(f"# {key}: {json.dumps(value)}\n" for key, value in _about(solution).items())


def _csv(solution: Solution, step: float, angle: str) -> str:
    headers, table = _columns(solution, step, angle)
    stream = io.StringIO()
    stream.write(_comments(solution))
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(headers)
    writer.writerows([[repr(value) for value in row] for row in table.tolist()])
    return stream.getvalue()


def _json(solution: Solution, step: float, angle: str) -> str:
    headers, table = _columns(solution, step, angle)
    trajectory, robot = solution.trajectory, solution.front.problem.robot
    content = {
        "format": "trajevo motion",
        "version": 1,
        **_about(solution),
        "trajectory": {
            "joints": robot.joint_names,
            "units": robot.joint_units,
            **trajectory.definition(0),
        },
        "samples": {header: column.tolist() for header, column in zip(headers, table.T, strict=True)},
    }
    return json.dumps(content, indent=1, allow_nan=False)


def _feed(solution: Solution, step: float, angle: str) -> str:
    del angle
    return _comments(solution) + feed_table(solution, step)


def _gcode(solution: Solution, step: float, angle: str) -> str:
    del angle
    return g_code(solution, step)


_WRITERS: dict[str, Callable[[Solution, float, str], str]] = {
    "csv": _csv,
    "json": _json,
    "feed": _feed,
    "gcode": _gcode,
}
