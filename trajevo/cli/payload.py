"""``trajevo payload-diagram`` and ``trajevo payload-time``: numbers in the terminal, a picture in a file."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, final

import numpy as np
import typer
from rich.console import Console

from trajevo import plots
from trajevo.capacity.capacity import your_margin
from trajevo.capacity.dlcc import dlcc
from trajevo.capacity.payload_diagram import PayloadDiagram, payload_diagram
from trajevo.capacity.payload_effort import PayloadEffort, payload_effort
from trajevo.capacity.payload_time import PayloadCurve, capacity_front, largest_payload, payloads_up_to
from trajevo.capacity.robust import robust_capacity
from trajevo.capacity.sensitivity import sensitivity
from trajevo.capacity.slowdown import SlowdownCurve, slowdown_curve, slowdown_for
from trajevo.capacity.uncertainty import UncertaintyPrice, price_of_uncertainty
from trajevo.capacity.workspace import PLANES, ToolPlane, workspace_capacity
from trajevo.cli import completion
from trajevo.cli.console import Terminal
from trajevo.cli.problem_options import ProblemOption
from trajevo.cli.results import (
    CURVE_PICTURE,
    DIAGRAM_PICTURE,
    PRICE_SUFFIX,
    SLOWDOWN_PICTURE,
    RunArgument,
    SolutionOption,
    beside,
    front_of,
)
from trajevo.cli.robots import MasslessOption, RobotArgument
from trajevo.cli.screen.printed import print_mass_notes
from trajevo.cli.screen.tables import Listing
from trajevo.cli.screen.waiting import Waiting
from trajevo.errors import InvalidInputError
from trajevo.front.front import Solution
from trajevo.path.inverse_kinematics import Pose
from trajevo.plots.pictures import save_figure
from trajevo.robot.robot import load_robot

_out = Terminal()

#: Number of boxes whose price is computed, including the exactly known payload.
_TOLERANCES = 6

#: Greatest number of rows and columns of the printed table; the picture has all cells.
_SHOWN = 5


@final
@dataclass(frozen=True)
class DiagramOptions:
    """Grid and further options of a payload diagram.

    Attributes:
        offset_xy: greatest distance from the tool's z axis [m].
        offset_z: least and greatest coordinate along this axis [m].
        grid: number of cells along each side.
        direction: direction of the offset [deg], or None for the worst.
        tolerance: tolerance of the payload's centre of mass to either side along every axis [m], for a robust payload;
            None for no robust payload.

    Raises:
        InvalidInputError: an empty range, too few cells, or a negative tolerance.
    """

    offset_xy: float
    offset_z: tuple[float, float]
    grid: int
    direction: float | None
    tolerance: float | None

    def __post_init__(self) -> None:
        if not 0.0 < self.offset_xy < np.inf:
            raise InvalidInputError(f"--offset-xy: expected a positive length [m], got {self.offset_xy}")
        if not -np.inf < self.offset_z[0] < self.offset_z[1] < np.inf:
            raise InvalidInputError(
                f"--offset-z: expected the least place before the greatest [m], got {self.offset_z[0]} and "
                f"{self.offset_z[1]}"
            )
        if self.grid < 2:
            raise InvalidInputError(f"--grid: expected at least 2 cells, got {self.grid}")
        if self.tolerance is not None and not 0.0 <= self.tolerance < np.inf:
            raise InvalidInputError(f"--tolerance: expected a length from 0 on [m], got {self.tolerance}")


def diagram(
    run: RunArgument,
    solution: Annotated[
        list[str] | None,
        typer.Option(
            help="knee, utopia, weighted, topsis, least_OBJECTIVE or a row; the knee if not given; "
            "several are overlaid.",
            autocompletion=completion.solutions,
        ),
    ] = None,
    offset_xy: Annotated[float, typer.Option(help="Greatest distance from the tool's z axis [m].")] = 0.3,
    offset_z: Annotated[tuple[float, float], typer.Option(help="Range along the tool's z axis [m].")] = (0.0, 0.3),
    grid: Annotated[int, typer.Option(help="Cells along each side.")] = 61,
    direction: Annotated[
        float | None, typer.Option(help="Angle of the offset from the tool's x axis [deg]; the worst if not given.")
    ] = None,
    tolerance: Annotated[
        float | None,
        typer.Option(help="Also show the payload for a centre of mass with this tolerance along every axis [m]."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="PNG, PDF or SVG file; payload_diagram.png beside the front if not given.")
    ] = None,
    problem: ProblemOption = None,
) -> None:
    """Show and draw the largest payload of a motion by the offset of its centre of mass from the tool."""
    options = DiagramOptions(offset_xy, offset_z, grid, direction, tolerance)
    front, rules = front_of(run, problem), solution or ["knee"]
    chosen = {rule: front.pick(rule) for rule in rules}
    efforts = {rule: payload_effort(solution) for rule, solution in chosen.items()}
    xy = np.linspace(0.0, options.offset_xy, options.grid)
    z = np.linspace(*options.offset_z, options.grid)
    turn = None if options.direction is None else float(np.radians(options.direction))
    diagrams = {rule: payload_diagram(effort, xy, z, direction=turn) for rule, effort in efforts.items()}
    for rule, picked in chosen.items():
        _out.print(f"{picked.rule} (row {picked.index}), time {picked.F.get('time', float('nan')):.4f} s")
        _print_diagram(_out, diagrams[rule])
        if options.tolerance is not None:
            _print_robust(_out, efforts[rule], front.problem.dynamics.payload.com, options.tolerance)
    file = _drawn(lambda: plots.payload_contours(_labelled(chosen, diagrams)), out or beside(run, DIAGRAM_PICTURE))
    _out.written(
        file, then=f"trajevo slowdown {run} --payload MASS tells how long the same path takes with another one"
    )


def payload_time(
    run: RunArgument,
    payload: Annotated[
        list[float] | None, typer.Option(help="Mass [kg]; repeatable; eight up to the largest payload if not given.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the random starts.")] = 1,
    starts: Annotated[int, typer.Option(min=1, help="Random starts for each payload.")] = 2,
    tolerance: Annotated[
        float | None,
        typer.Option(help="Also show the price in time of this tolerance of the centre of mass along every axis [m]."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="PNG, PDF or SVG file; payload_time.png beside the front if not given.")
    ] = None,
    problem: ProblemOption = None,
) -> None:
    """Optimise the motion again for each payload: show and draw the least times and the largest payload."""
    if tolerance is not None and not 0.0 < tolerance < np.inf:
        raise InvalidInputError(f"--tolerance: expected a positive length [m], got {tolerance}")
    carried = front_of(run, problem).problem
    steps = ["largest payload", "least times", *([] if tolerance is None else ["price of the tolerance"])]
    with Waiting("computing", steps) as shown:
        shown.begin(steps[0])
        largest = largest_payload(carried, seed=seed, starts=starts)
        masses, refusal = (payload, "") if payload else payloads_up_to(carried, largest.mass)
        shown.begin(steps[1])
        curve = capacity_front(carried, masses, seed=seed, starts=starts)
        if tolerance is not None:
            shown.begin(steps[2])
            price = price_of_uncertainty(
                carried, np.linspace(0.0, tolerance, _TOLERANCES).tolist(), seed=seed, starts=starts
            )
    _out.print(f"largest payload of any motion found: {largest}")
    if refusal:
        _out.print(f"heavier ones left out: {refusal}")
    _out.print(_least_times(curve))
    target = out or beside(run, CURVE_PICTURE)
    files = [_drawn(lambda: plots.payload_curve(curve, at_rest=largest.at_rest), target)]
    if tolerance is not None:
        _out.print(_prices(price))
        beside_it = target.with_stem(target.stem + PRICE_SUFFIX)
        files.append(_drawn(lambda: plots.uncertainty_price(price), beside_it))
    _out.written(*files, then=f"trajevo report {run} --full has this and what else is known about payloads")


def _drawn(draw: Callable[[], Any], file: Path) -> Path:
    """Write a picture, given by what gives its axes, with a bar while it is drawn."""
    with Waiting("drawing", [file.name]) as shown:
        shown.begin(file.name)
        return save_figure(draw().figure, file)


def _least_times(curve: PayloadCurve) -> Listing:
    full, headings = curve.at_full_limits, ["payload [kg]", "least time [s]"]
    title = f"with {your_margin(curve.effort_margin)}" if curve.effort_margin else ""
    table = Listing(*headings, *(["at full limits [s]"] if full else []), title=title)
    for k, mass in enumerate(curve.payloads):
        times = [curve.times[k], *([full.times[k]] if full else [])]
        table.add(f"{mass:.4g}", *(f"{least:.4f}" if np.isfinite(least) else "none found" for least in times))
    return table


def _prices(price: UncertaintyPrice) -> Listing:
    """The price in time of tolerances of the payload's centre of mass."""
    table = Listing("centre of mass known to ± [mm]", "least time [s]", "price [%]")
    for width, least, share in zip(price.tolerances, price.times, price.price, strict=True):
        found = (f"{least:.4f}", f"{100.0 * share:+.2f}") if np.isfinite(least) else ("none found", "")
        table.add(f"{1e3 * width:.4g}", *found)
    return table


def _labelled(
    chosen: Mapping[str, Solution], diagrams: Mapping[str, PayloadDiagram]
) -> PayloadDiagram | dict[str, PayloadDiagram]:
    if len(diagrams) == 1:
        return next(iter(diagrams.values()))
    times = {rule: solution.F.get("time") for rule, solution in chosen.items()}
    return {
        rule if times[rule] is None else f"{rule}, {times[rule]:.3g} s": diagram for rule, diagram in diagrams.items()
    }


def _print_diagram(out: Console, diagram: PayloadDiagram) -> None:
    """Print some cells, with the first and last: the greatest mass, and the least if it is above 0."""
    rows, columns = (
        np.unique(np.linspace(0, count - 1, min(count, _SHOWN)).round().astype(int)) for count in diagram.mass.shape
    )
    angle = np.degrees(diagram.direction.flat[0])
    where = "in the worst direction" if diagram.worst else f"at {angle:g}° from the tool's x axis"
    title = f"largest payload [kg] ({diagram.payload_model}), L_xy {where}"
    offsets = (f"L_xy {1e3 * diagram.offset_xy[column]:.4g} mm" for column in columns)
    table = Listing("L_z [mm]", *offsets, title=title)
    for row in rows[::-1]:
        cells = [_cell(diagram, row, column) for column in columns]
        table.add(f"{1e3 * diagram.offset_z[row]:.4g}", *cells)
    out.print(table)


def _cell(diagram: PayloadDiagram, row: int, column: int) -> str:
    mass, least, joint = (float(grid[row, column]) for grid in (diagram.mass, diagram.least, diagram.joint))
    if np.isnan(mass):
        return "none"
    masses = f"{mass:.3f}" if least == 0.0 else f"{least:.3f} to {mass:.3f}"
    return "unlimited" if joint < 0 and least == 0.0 else f"{masses}\n{diagram.joint_names[int(joint)]}"


def _print_robust(out: Console, effort: PayloadEffort, com: tuple[float, float, float], tolerance: float) -> None:
    at = np.array(com)
    exact, robust = (robust_capacity(effort, com=np.stack([at - by, at + by])) for by in (0.0, tolerance))
    place = ", ".join(f"{1e3 * x:g}" for x in com)
    if np.isnan(robust.upper):
        out.print(f"no mass is feasible wherever within {1e3 * tolerance:g} mm of ({place}) mm its centre is")
        return
    out.print(
        f"within {1e3 * tolerance:g} mm of ({place}) mm along every axis: {robust.upper:.6g} kg wherever the centre of "
        f"mass is, {exact.upper:.6g} kg if it is right there; limited by {robust.joint or 'nothing'}"
    )


#: Cells of the payload that can only be held at rest, after its mass.
_AT_REST = ("at rest", "", "", "")

#: Rows of the table of a curve.
_ROWS = 12


def slowdown(
    run: RunArgument,
    solution: SolutionOption = "knee",
    payload: Annotated[
        float | None, typer.Option(help="Mass [kg], with the shape of the run's payload; the run's own if not given.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Picture; slowdown.png beside the front if not given.")] = None,
    problem: ProblemOption = None,
) -> None:
    """Show how long a motion's path takes with another payload, and draw payload against time."""
    chosen = front_of(run, problem).pick(solution)
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
    file = _drawn(lambda: plots.slowdown_curve(curve), out or beside(run, SLOWDOWN_PICTURE))
    _out.written(file, then=f"trajevo payload-time {run} optimises the motion again for each payload")


def workspace(
    robot: RobotArgument,
    position: Annotated[tuple[float, float, float], typer.Option(help="Middle of the plane in the base frame [m].")],
    rpy: Annotated[
        tuple[float, float, float] | None,
        typer.Option(help="Roll, pitch and yaw of the tool [rad]; any orientation if not given."),
    ] = None,
    plane: Annotated[str, typer.Option(help=f"{', '.join(PLANES)}: axes of the base frame.")] = "xz",
    reach: Annotated[float, typer.Option(help="Distance from the middle to the sides [m].")] = 0.5,
    cells: Annotated[int, typer.Option(help="Cells along each side.")] = 21,
    acceleration: Annotated[
        tuple[float, float, float], typer.Option(help="Acceleration of the tool from rest, in the base frame [m/s²].")
    ] = (0.0, 0.0, 0.0),
    effort_margin: Annotated[
        float,
        typer.Option(help="Share of the effort limits that is kept free, 0 to below 1."),
    ] = 0.0,
    lock: Annotated[
        list[str] | None, typer.Option(help="JOINT=POSITION [rad or m] of a joint to hold still; may be repeated.")
    ] = None,
    tool: Annotated[str | None, typer.Option(help="Frame at the end effector.")] = None,
    allow_massless: MasslessOption = False,
    show: Annotated[str, typer.Option(help="mass, or joint for the binding joint.")] = "mass",
    out: Annotated[Path, typer.Option(help="Picture.")] = Path("workspace.png"),
) -> None:
    """Draw the largest payload that a robot can hold, or accelerate, at every tool position of a plane."""
    unlimited = {"acceleration": float("inf"), "jerk": float("inf")}  # not used here, and missing in a URDF
    loaded = load_robot(
        robot, lock=_locked(lock or ()), tool=tool, limits=unlimited, allow_massless=allow_massless or None
    )
    given: dict[str, Any] = {"position": position} | ({} if rpy is None else {"rpy": rpy})
    square = ToolPlane.around(Pose.of(given), plane, reach=reach, cells=cells)
    with Waiting("computing", ["payloads of all cells"]) as shown:
        shown.begin("payloads of all cells")
        found = workspace_capacity(loaded, square, acceleration=acceleration, effort_margin=effort_margin)
    _out.print(f"{loaded.name}: {found}")
    print_mass_notes(_out, loaded)
    if found.reached.any():
        counts = found.postures[found.reached]
        _out.print(f"postures found per cell: {counts.min()} to {counts.max()}, of which the best was taken")
    table = Listing("binding joint", "cells")
    for k, name in enumerate(found.joint_names):
        if (found.joint == k).any():
            table.add(name, str(int((found.joint == k).sum())))
    _out.print(table)
    file = _drawn(lambda: plots.workspace_capacity(found, show=show), out)
    _out.written(file, then="trajevo init writes a task in which the robot can be named")


def _table(curve: SlowdownCurve) -> Listing:
    """Some payloads of a curve, with the times at the robot's full limits and broken constraints if there are any."""
    full = curve.at_full_limits
    headings = ["payload [kg]", "least time [s]", "change [%]", "limit", "joint"]
    headings += ["at full limits [s]"] if full else []
    headings += ["not kept"] if any(curve.not_kept) else []
    margin = f", with {your_margin(curve.effort_margin)}" if curve.effort_margin else ""
    title = f"least time along the same path{margin}; effort sampled at {curve.instants} instants"
    table = Listing(*headings, title=title)
    step = -(-len(curve.payloads) // _ROWS)
    for k in range(len(curve.payloads) - 1, -1, -step)[::-1]:
        change = f"{100.0 * (curve.factors[k] - 1.0):+.2f}"
        cells = [f"{curve.payloads[k]:.4g}", f"{curve.durations[k]:.4f}", change, curve.limits[k], curve.joints[k]]
        cells += [f"{full.durations[k]:.4f}"] if full else []
        cells += [curve.not_kept[k]] if any(curve.not_kept) else []
        table.add(*cells)
    more = [""] * (len(headings) - len(_AT_REST) - 1)
    table.add(f"{curve.static_bound:.4g}", *_AT_REST, *more)
    if full:
        table.add(f"{full.static_bound:.4g}", "", "", "", "", "at rest", *more[1:])
    return table


def _locked(given: Sequence[str]) -> dict[str, float]:
    """Positions by joint, from texts ``JOINT=POSITION``."""
    locked = {}
    for text in given:
        name, _, value = text.partition("=")
        try:
            locked[name] = float(value)
        except ValueError:
            raise InvalidInputError(f"lock: expected JOINT=POSITION [rad or m], got {text!r}") from None
    return locked
