"""What ``trajevo`` says about payloads beyond ``capacity``: slower along the same path, and over the workspace."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from trajevo import capacity_plots
from trajevo.capacity import dlcc
from trajevo.cli_files import SLOWDOWN_PICTURE, SOLUTION_HELP, RunArgument, beside, front_of
from trajevo.errors import InvalidInputError
from trajevo.inverse_kinematics import Pose
from trajevo.pictures import save_figure
from trajevo.robot import load_robot
from trajevo.sensitivity import sensitivity
from trajevo.slowdown import slowdown_for
from trajevo.slowdown_curve import SlowdownCurve, slowdown_curve
from trajevo.workspace_capacity import PLANES, ToolPlane, workspace_capacity

_out = Console(soft_wrap=True, highlight=False)

#: Rows of the table of a curve.
_ROWS = 12


def slowdown(
    run: RunArgument,
    solution: Annotated[str, typer.Option(help=SOLUTION_HELP)] = "knee",
    payload: Annotated[
        float | None, typer.Option(help="Mass [kg] of the shape of the run's payload; the run's own.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Picture; slowdown.png beside the front if not given.")] = None,
) -> None:
    """Tell how long one motion's path takes with another payload, and draw payload against time."""
    chosen = front_of(run).pick(solution)
    rollout = chosen.rollout
    own = rollout.dynamics.payload.mass if rollout.masses is None else float(rollout.masses[0])
    found = slowdown_for(chosen, own if payload is None else payload)
    _out.print(f"{chosen.rule} (row {chosen.index}), time {float(rollout.trajectory.duration[0]):.4f} s")
    _out.print(f"slowdown: {found}")
    capacity = dlcc(chosen)
    _out.print(f"capacity as it is: {capacity}")
    if not capacity.joint:
        return
    if capacity.feasible:
        _out.print(f"sensitivity: {sensitivity(chosen)}")
    curve = slowdown_curve(chosen)
    _out.print(_table(curve))
    figure = capacity_plots.slowdown_curve(curve).figure
    _out.print(f"written: {save_figure(figure, out or beside(run, SLOWDOWN_PICTURE))}")


def workspace(
    robot: Annotated[str, typer.Argument(help="Name, folder with robot.toml, or URDF.")],
    position: Annotated[tuple[float, float, float], typer.Option(help="Middle of the plane in the base frame [m].")],
    rpy: Annotated[
        tuple[float, float, float] | None,
        typer.Option(help="Roll, pitch and yaw of the tool [rad]; any orientation if not given."),
    ] = None,
    plane: Annotated[str, typer.Option(help=f"{', '.join(PLANES)}: axes of the base frame.")] = "xz",
    reach: Annotated[float, typer.Option(help="From the middle to the sides [m].")] = 0.5,
    cells: Annotated[int, typer.Option(help="Cells along each side.")] = 21,
    acceleration: Annotated[
        tuple[float, float, float], typer.Option(help="Of the tool from rest, in the base frame [m/s²].")
    ] = (0.0, 0.0, 0.0),
    lock: Annotated[
        list[str] | None, typer.Option(help="JOINT=POSITION [rad or m] that is held still; may be repeated.")
    ] = None,
    tool: Annotated[str | None, typer.Option(help="Frame at the end effector.")] = None,
    show: Annotated[str, typer.Option(help="mass, or joint: the one that binds.")] = "mass",
    out: Annotated[Path, typer.Option(help="Picture.")] = Path("workspace.png"),
) -> None:
    """Draw what a robot can hold, or accelerate, in its best posture at every tool position of a plane."""
    unlimited = {"acceleration": float("inf"), "jerk": float("inf")}  # no part of this, and missing in a URDF
    loaded = load_robot(robot, lock=_locked(lock or ()), tool=tool, limits=unlimited)
    given: dict[str, Any] = {"position": position} | ({} if rpy is None else {"rpy": rpy})
    square = ToolPlane.around(Pose.of(given), plane, reach=reach, cells=cells)
    found = workspace_capacity(loaded, square, acceleration=acceleration)
    _out.print(f"{loaded.name}: {found}")
    if found.reached.any():
        counts = found.postures[found.reached]
        _out.print(f"postures found per cell: {counts.min()} to {counts.max()}, of which the best was taken")
    table = Table("binding joint", "cells", box=SIMPLE)
    for k, name in enumerate(found.joint_names):
        if (found.joint == k).any():
            table.add_row(name, str(int((found.joint == k).sum())))
    _out.print(table)
    _out.print(f"written: {save_figure(capacity_plots.workspace_capacity(found, show=show).figure, out)}")


def _table(curve: SlowdownCurve) -> Table:
    table = Table("payload [kg]", "least time [s]", "change", "limit", "joint", box=SIMPLE)
    step = -(-len(curve.payloads) // _ROWS)
    for k in range(len(curve.payloads) - 1, -1, -step)[::-1]:
        change = f"{100.0 * (curve.factors[k] - 1.0):+.2f} %"
        cells = (f"{curve.payloads[k]:.4g}", f"{curve.durations[k]:.4f}", change, curve.limits[k], curve.joints[k])
        table.add_row(*cells)
    table.add_row(f"{curve.static_bound:.4g}", "at rest", "", "", "")
    return table


def _locked(given: Sequence[str]) -> dict[str, float]:
    """Joints and positions of ``JOINT=POSITION``."""
    locked = {}
    for text in given:
        name, _, value = text.partition("=")
        try:
            locked[name] = float(value)
        except ValueError:
            raise InvalidInputError(f"lock: expected JOINT=POSITION [rad or m], got {text!r}") from None
    return locked
