"""A solution, or a whole front, as a file for a controller, a spreadsheet or another program."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.files import write_whole
from trajevo.base.units import ANGLE_UNITS, display, per_time
from trajevo.errors import InvalidInputError, checked_name
from trajevo.exporters.controllers import joint_trajectory, replay_table, urscript
from trajevo.exporters.gcode import feed_table, g_code
from trajevo.exporters.netcdf import MAGIC, is_netcdf, netcdf
from trajevo.front.front import Front, Solution
from trajevo.robot.limit_files import write_joint_limits
from trajevo.trajectory.batch import DERIVATIVES
from trajevo.verification.certify import certify

#: Longest table that is written.
MOST_SAMPLES = 10_000_000

#: Formats that can be written.
FORMATS = ("csv", "json", "feed", "gcode", "ros2", "mujoco", "urscript", "moveit", "netcdf")

#: Formats that hold a whole front; the others hold the motion of one solution.
FRONT_FORMATS = ("netcdf",)

#: How the file of a format ends, where not with its name; a replay is a table too, and must not take the motion's name.
_EXTENSIONS = {
    "ros2": "yaml",
    "mujoco": "mujoco.csv",
    "urscript": "script",
    "moveit": "joint_limits.yaml",
    "netcdf": "nc",
}

#: Usual time between samples [s]: MuJoCo's own step, the cycle that every controller with ``servoj`` can run.
_STEPS = {"mujoco": 0.002, "urscript": 0.008}

#: Formats that are SI by definition.
_SI = ("ros2", "mujoco", "urscript", "moveit", "netcdf")

#: How a file of each format begins.
_BEGINNINGS = (b"# problem: {", b'{\n "format": "trajevo motion"', b"; trajevo", b"# trajevo: ")


def export(
    source: Solution | Front, file: str | Path, *, format: str, step: float | None = None, angle: str = "rad"
) -> Path:
    """Write the sampled motion of a solution, or of all of a front, with units, settings, reference and certificate.

    A write that is cut off leaves an older file whole.

    Args:
        source: what to write; a whole front in ``"netcdf"`` alone.
        file: where to.
        format: ``"csv"`` (comment lines with the settings, then one row per instant), ``"json"`` (also the exact
            trajectory, as :func:`motion_schema` says), ``"feed"`` (CSV of straight blocks with their feeds, mm and
            mm/min, for linear axes alone), ``"gcode"`` (the same blocks as G1 lines), ``"ros2"`` (a
            ``trajectory_msgs/JointTrajectory`` as YAML), ``"mujoco"`` (CSV at a fixed rate for a replay),
            ``"urscript"`` (a program that streams six joints to a controller of Universal Robots), ``"moveit"`` (the
            robot's limits as a ``joint_limits.yaml``) or ``"netcdf"`` (everything that a front, or one solution of it,
            holds, as :func:`trajevo.exporters.netcdf.dataset` says).
        step: time between samples [s]; 0.01, for ``"mujoco"`` 0.002 and for ``"urscript"`` 0.008 if None. In
            ``"csv"`` and ``"json"`` the last interval takes 0.5 to 1.5 steps and ends with the motion; in ``"ros2"``
            all are equal and none is shorter; in ``"mujoco"`` and ``"urscript"`` every one is a step and the last
            position is held to the end of the last; in ``"netcdf"`` the longest motion has none that is longer, all
            motions are sampled as often, and 201 times if None.
        angle: ``"rad"`` or ``"deg"``.

    Returns:
        The file.

    Raises:
        UnknownNameError: no such format or angle unit.
        NoSolutionError: the front is empty.
        InvalidInputError: neither a solution nor a front that the format can hold, a step that is not positive, degrees
            where the format is SI, a robot that the format cannot hold, or a file that cannot be written.
    """
    checked_name("export format", format, FORMATS)
    checked_name("angle unit", angle, ANGLE_UNITS)
    if angle != "rad" and format in _SI:
        raise InvalidInputError(f"angle: the format {format!r} is in rad, got {angle!r}")
    if step is not None and (
        isinstance(step, bool) or not (isinstance(step, int | float) and np.isfinite(step) and step > 0.0)
    ):
        raise InvalidInputError(f"step: expected a positive time [s], got {step!r}")
    if format in FRONT_FORMATS:
        _write(Path(file), netcdf(source, step))
    else:
        step = _STEPS.get(format, 0.01) if step is None else float(step)
        _write(Path(file), _motion(source, format, step, angle).encode())
    return Path(file)


def extension(format: str) -> str:
    """How the name of a file of a format ends, after the point: ``"yaml"`` for ``"ros2"``.

    Raises:
        UnknownNameError: no such format.
    """
    return _EXTENSIONS.get(checked_name("export format", format, FORMATS), format)


def is_exported(file: Path) -> bool:
    """Whether a file is one that :func:`export` wrote, by its name and its first bytes."""
    if not (file.is_file() and file.name.endswith(tuple(f".{extension(format)}" for format in FORMATS))):
        return False
    with file.open("rb") as stream:
        beginning = stream.read(64)
    return beginning.startswith(_BEGINNINGS) or (beginning.startswith(MAGIC) and is_netcdf(file))


def motion_schema() -> dict[str, Any]:
    """The JSON Schema (2020-12) of the format ``"json"``."""
    text = (resources.files("trajevo.exporters") / "motion.schema.json").read_text(encoding="utf-8")
    schema: dict[str, Any] = json.loads(text)
    return schema


def _motion(source: Solution | Front, format: str, step: float, angle: str) -> str:
    if not isinstance(source, Solution):
        got = f"a front of {len(source)}" if isinstance(source, Front) else type(source).__name__
        raise InvalidInputError(f"source: the format {format!r} holds one solution, as front.knee(), got {got}")
    duration = float(source.trajectory.duration[0])
    if duration / step > MOST_SAMPLES:
        raise InvalidInputError(f"step: {step:g} s gives over {MOST_SAMPLES} samples of a motion of {duration:.4g} s")
    return _WRITERS[format](source, step, angle)


def _write(file: Path, content: bytes | memoryview) -> None:
    try:
        write_whole(file, content)
    except OSError as error:
        raise InvalidInputError(f"{file}: cannot be written: {error.strerror}") from error


def _instants(duration: float, step: float) -> Array:
    inner = np.arange(0.0, duration, step)
    inner = inner[: 1 + int(np.searchsorted(inner[1:], duration - 0.5 * step, side="right"))]
    return np.append(inner, duration)


def _columns(solution: Solution, step: float, angle: str) -> tuple[list[str], Array]:
    """Headers with units and the table, time first: shape (T, 1 + 5 n_joints), without masses (T, 1 + 4 n_joints)."""
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
    if robot.mass > 0.0:
        effort = rollout.effort_in(*derivatives[:3])
        for joint, (name, unit) in enumerate(zip(robot.joint_names, robot.joint_units, strict=True)):
            headers.append(f"{name} effort [{'N*m' if unit == 'rad' else 'N'}]")
            columns.append(effort[0, :, joint])
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
        "certificate": certify(solution).summary,
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


def _ros2(solution: Solution, step: float, angle: str) -> str:
    del angle
    return _comments(solution) + joint_trajectory(solution, step)


def _mujoco(solution: Solution, step: float, angle: str) -> str:
    del angle
    return _comments(solution) + replay_table(solution, step)


def _urscript(solution: Solution, step: float, angle: str) -> str:
    del angle
    return urscript(solution, step)


def _moveit(solution: Solution, step: float, angle: str) -> str:
    del step, angle
    robot = solution.front.problem.robot
    return _comments(solution) + write_joint_limits(robot.limits, robot.joint_names)


_WRITERS: dict[str, Callable[[Solution, float, str], str]] = {
    "csv": _csv,
    "json": _json,
    "feed": _feed,
    "gcode": _gcode,
    "ros2": _ros2,
    "mujoco": _mujoco,
    "urscript": _urscript,
    "moveit": _moveit,
}
