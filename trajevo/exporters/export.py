"""A solution, or a whole front, as a file for a controller, a spreadsheet or another program."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from trajevo.base.files import write_whole
from trajevo.base.plugins import Registry
from trajevo.base.units import ANGLE_UNITS
from trajevo.errors import InvalidInputError, checked_name
from trajevo.exporters.controllers import MOVEIT, MUJOCO, ROS2, URSCRIPT
from trajevo.exporters.exporter import Exporter
from trajevo.exporters.gcode import FEED, GCODE
from trajevo.exporters.netcdf import NETCDF
from trajevo.exporters.samples import CSV, JSON
from trajevo.front.front import Front, Solution

#: Longest table that is written.
MOST_SAMPLES = 10_000_000

#: Formats by name. To add one, write a file with its function and its record, and name that here.
EXPORTERS: dict[str, Exporter] = {
    exporter.name: exporter for exporter in (CSV, JSON, FEED, GCODE, ROS2, MUJOCO, URSCRIPT, MOVEIT, NETCDF)
}

#: Formats by name, with those of other packages.
NAMED_EXPORTERS: Registry[Exporter] = Registry(
    kind="export format",
    group="trajevo.exporters",
    own=EXPORTERS,
    expected="a trajevo.Exporter",
    fits=lambda found: isinstance(found, Exporter),
)

#: As many bytes as tell a format.
_FIRST = 64


def export(
    source: Solution | Front, file: str | Path, *, format: str, step: float | None = None, angle: str = "rad"
) -> Path:
    """Write the sampled motion of a solution, or of all of a front, with units, settings, reference and certificate.

    A write that is cut off leaves an older file whole.

    Args:
        source: what to write; a whole front in a format that holds one, as ``"netcdf"``.
        file: where to.
        format: a name of :data:`EXPORTERS`, whose records say what is in the file, or of another package's:
            ``"csv"``, ``"json"``, ``"ros2"`` and so on, as ``trajevo list`` tells.
        step: time between samples [s]; that of the format if None. In ``"csv"`` and ``"json"`` the last interval takes
            0.5 to 1.5 steps and ends with the motion; in ``"ros2"`` all are equal and none is shorter; in ``"mujoco"``
            and ``"urscript"`` every one is a step and the last position is held to the end of the last; in
            ``"netcdf"`` the longest motion has none that is longer, all motions are sampled as often, and 201 times if
            None.
        angle: ``"rad"`` or ``"deg"``.

    Returns:
        The file.

    Raises:
        UnknownNameError: no such format or angle unit.
        NoSolutionError: the front is empty.
        InvalidInputError: neither a solution nor a front that the format can hold, a step that is not positive, degrees
            where the format is SI, a robot that the format cannot hold, or a file that cannot be written.
    """
    exporter = NAMED_EXPORTERS.find(format)
    checked_name("angle unit", angle, ANGLE_UNITS)
    if angle != "rad" and exporter.si:
        raise InvalidInputError(f"angle: the format {format!r} is in rad, got {angle!r}")
    if step is not None and (
        isinstance(step, bool) or not (isinstance(step, int | float) and np.isfinite(step) and step > 0.0)
    ):
        raise InvalidInputError(f"step: expected a positive time [s], got {step!r}")
    step = exporter.step if step is None else step if exporter.step is None else float(step)
    if exporter.holds == "motion":
        _check_motion(source, format, step)
    content = exporter.function(source, step, angle)
    _write(Path(file), content.encode() if isinstance(content, str) else content)
    return Path(file)


def extension(format: str) -> str:
    """How the name of a file of a format ends, after the point: ``"yaml"`` for ``"ros2"``.

    Raises:
        UnknownNameError: no such format.
    """
    return NAMED_EXPORTERS.find(format).ending


def is_exported(file: Path) -> bool:
    """Whether a file is one that :func:`export` wrote, by its name and its first bytes."""
    if not file.is_file():
        return False
    with file.open("rb") as stream:
        first = stream.read(_FIRST)
    return any(exporter.wrote(file, first) for exporter in NAMED_EXPORTERS.all().values())


def _check_motion(source: Solution | Front, format: str, step: float | None) -> None:
    """Refuse what is no solution, and a table that nobody could read."""
    if not isinstance(source, Solution):
        got = f"a front of {len(source)}" if isinstance(source, Front) else type(source).__name__
        raise InvalidInputError(f"source: the format {format!r} holds one solution, as front.knee(), got {got}")
    duration = float(source.trajectory.duration[0])
    if step is not None and duration / step > MOST_SAMPLES:
        raise InvalidInputError(f"step: {step:g} s gives over {MOST_SAMPLES} samples of a motion of {duration:.4g} s")


def _write(file: Path, content: bytes | memoryview) -> None:
    try:
        write_whole(file, content)
    except OSError as error:
        raise InvalidInputError(f"{file}: cannot be written: {error.strerror}") from error
