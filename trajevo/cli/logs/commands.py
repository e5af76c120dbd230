"""``trajevo identify-payload`` and ``trajevo fit-drives``: what a log of a moving robot tells, with error bars."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from trajevo.base.files import write_whole
from trajevo.base.toml import toml_text
from trajevo.base.units import pretty
from trajevo.capacity.drives.fitting import fit_drives
from trajevo.capacity.identification.found import HEADERS
from trajevo.capacity.identification.identify import identify_payload
from trajevo.cli.console import Terminal
from trajevo.cli.robots import MasslessOption, RobotArgument
from trajevo.cli.screen.tables import Listing
from trajevo.robot.payload import Payload
from trajevo.robot.robot import Robot, load_robot

LogArgument = Annotated[
    Path,
    typer.Argument(
        help="Table of a log with units: time [s], JOINT position [rad] of all joints, and JOINT effort [N*m] or "
        "JOINT current [A]."
    ),
]
ToolOption = Annotated[str | None, typer.Option(help="Frame at the end effector.")]

_out = Terminal()


def identify(
    log: LogArgument,
    robot: RobotArgument,
    empty: Annotated[
        Path | None,
        typer.Option(help="Log of the same motion without payload, which is taken off instead of the robot's model."),
    ] = None,
    mass: Annotated[float | None, typer.Option(help="Mass of the payload if it is known, as from scales [kg].")] = None,
    friction: Annotated[bool, typer.Option("--friction", help="Find friction of every joint too.")] = False,
    tool: ToolOption = None,
    allow_massless: MasslessOption = False,
    out: Annotated[
        Path | None, typer.Option(help="TOML file for the [payload] that was found, to put into a task.")
    ] = None,
) -> None:
    """Find mass, centre of mass and inertia of a payload from a log of torques or currents, with error bars."""
    found = identify_payload(log, _loaded(robot, tool, allow_massless), empty=empty, mass=mass, friction=friction)
    _out.print(str(found))
    table = Listing(*HEADERS)
    for row in found.rows:
        table.add(*row)
    _out.print(table)
    then = "in Python, robust_problem(problem, **found.intervals()) plans for all that it may be"
    if out is None:
        _out.print(f"next: {then}")
        return
    one = found.payload
    told = {"mass": one.mass, "com": one.com} | ({} if one.inertia is None else {"inertia": one.inertia})
    write_whole(out, toml_text({"payload": told}).encode())
    _out.written(out, then=f"put it into a task; {then}")


def fit(
    log: LogArgument,
    robot: RobotArgument,
    payload: Annotated[float, typer.Option(help="Mass at the tool's origin that the robot carries [kg].")] = 0.0,
    smoothing: Annotated[float, typer.Option(help="Time over which positions are smoothed [s].")] = 0.1,
    tool: ToolOption = None,
    allow_massless: MasslessOption = False,
    out: Annotated[Path | None, typer.Option(help="TOML file for what was found, to put into a task.")] = None,
) -> None:
    """Fit torque constants, friction, winding losses and standby to a log of currents or power, with error bars."""
    loaded = _loaded(robot, tool, allow_massless)
    found = fit_drives(log, loaded, payload=Payload(payload), smoothing=smoothing)
    _out.print(f"{log}: {found.samples} instants")
    table = Listing("joint", "parameter", "value ± (95 %)", "unit")
    for one in found.parameters:
        table.add(one.joint, one.name, one.with_error, pretty(one.unit))
    _out.print(table)
    for sentence in found.unknown:
        _out.print(sentence)
    if out is not None:
        write_whole(out, toml_text({"robot": found.settings}).encode())
        _out.written(out, then=f"put it into a task with the robot {loaded.name}")


def _loaded(robot: str, tool: str | None, allow_massless: bool) -> Robot:
    unlimited = {"acceleration": np.inf, "jerk": np.inf}  # not used here, and missing in a URDF
    return load_robot(robot, tool=tool, limits=unlimited, allow_massless=allow_massless or None)
