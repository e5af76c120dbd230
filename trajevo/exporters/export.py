"""A solution, or a whole front, as a file for a controller, a spreadsheet or another program."""

from __future__ import annotations

from pathlib import Path

from trajevo.base.files import named_file, why_not, write_whole
from trajevo.base.plugins import Registry
from trajevo.base.units import ANGLE_UNITS
from trajevo.errors import InvalidInputError, checked_name
from trajevo.exporters.controllers import MOVEIT, MUJOCO, ROS2, URSCRIPT
from trajevo.exporters.exporter import Exporter
from trajevo.exporters.gcode import FEED, GCODE
from trajevo.exporters.netcdf import NETCDF
from trajevo.exporters.point_programs import FANUC, KRL, RAPID
from trajevo.exporters.samples import CSV, JSON
from trajevo.front.front import Front, Solution
from trajevo.front.motion_table import check_length, checked_step

#: Formats by name. To add one, write a file with its function and its :class:`Exporter`, and add that here.
EXPORTERS: dict[str, Exporter] = {
    exporter.name: exporter
    for exporter in (CSV, JSON, FEED, GCODE, ROS2, MUJOCO, URSCRIPT, RAPID, KRL, FANUC, MOVEIT, NETCDF)
}

#: Formats by name, with those of other packages.
NAMED_EXPORTERS: Registry[Exporter] = Registry(
    kind="export format",
    group="trajevo.exporters",
    own=EXPORTERS,
    expected="a trajevo.Exporter",
    fits=lambda found: isinstance(found, Exporter),
)

#: Number of first bytes of a file by which its format is recognised.
_FIRST = 64


def export(
    source: Solution | Front, file: str | Path, *, format: str, step: float | None = None, angle: str = "rad"
) -> Path:
    """Write the sampled motion of a solution, or of all of a front, with units, settings, reference and certificate.

    If writing is interrupted, an existing file stays unchanged.

    Args:
        source: the solution to write, or a whole front if the format can hold one, such as ``"netcdf"``.
        file: path of the file.
        format: a name in :data:`EXPORTERS`, whose records describe the files, or a format of another package:
            ``"csv"``, ``"json"``, ``"ros2"`` and so on, as listed by ``trajevo list``.
        step: time between samples [s]; the default of the format if None. In ``"csv"`` and ``"json"`` the last interval
            takes 0.5 to 1.5 steps and ends with the motion. In ``"ros2"`` all intervals are equal and none is shorter
            than the step. In ``"mujoco"`` and ``"urscript"`` every interval is one step, and the last position is held
            to the end of the last interval. In ``"netcdf"`` all motions have the same number of samples, 201 if None,
            and no interval is longer than the step.
        angle: ``"rad"`` or ``"deg"``.

    Returns:
        Path of the file.

    Raises:
        UnknownNameError: no such format or angle unit.
        NoSolutionError: the front is empty.
        InvalidInputError: neither a solution nor a front that the format can hold, a step that is not positive, degrees
            where the format is SI, a robot that the format cannot hold, or a file that cannot be written.
    """
    exporter, target = NAMED_EXPORTERS.find(format), named_file(file)
    checked_name("angle unit", angle, ANGLE_UNITS)
    if angle != "rad" and exporter.si:
        raise InvalidInputError(f"angle: the format {format!r} is in rad, got {angle!r}")
    if step is not None:
        checked_step(step)
    step = exporter.step if step is None else step if exporter.step is None else float(step)
    if exporter.holds == "motion":
        _check_motion(source, format, step)
    content = exporter.function(source, step, angle)
    _write(target, content.encode() if isinstance(content, str) else content)
    return target


def extension(format: str) -> str:
    """Ending of the file names of a format, after the dot: ``"yaml"`` for ``"ros2"``.

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
    """Refuse a source that is not a solution, and a table that is too long."""
    if not isinstance(source, Solution):
        got = f"a front of {len(source)}" if isinstance(source, Front) else type(source).__name__
        raise InvalidInputError(f"source: the format {format!r} holds one solution, as front.knee(), got {got}")
    if step is not None:
        check_length(source, step)


def _write(file: Path, content: bytes | memoryview) -> None:
    try:
        write_whole(file, content)
    except OSError as error:
        raise InvalidInputError(f"{file}: cannot be written: {why_not(error)}") from error
