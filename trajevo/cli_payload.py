"""What ``trajevo payload-diagram`` does: numbers in the terminal, a picture in a file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import final

import numpy as np
from rich.box import SIMPLE
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from trajevo.errors import InvalidInputError
from trajevo.front import Front, Solution
from trajevo.payload_diagram import PayloadDiagram, payload_diagram
from trajevo.payload_effort import PayloadEffort, payload_effort
from trajevo.payload_plots import payload_contours
from trajevo.report import save_figure
from trajevo.robust_payload import robust_capacity

#: Rows and columns of the printed table at most; the picture has all cells.
_SHOWN = 5


@final
@dataclass(frozen=True)
class DiagramOptions:
    """What a diagram is of.

    Attributes:
        offset_xy: greatest distance from the tool's z axis [m].
        offset_z: least and greatest place along it [m].
        grid: cells along either.
        direction: of the offset [deg], or None for the worst.
        tolerance: how far to either side of the payload's own centre of mass along every axis it may be [m], or None
            for no word on it.

    Raises:
        InvalidInputError: no room, too few cells, or a negative tolerance.
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


def draw_payload_diagrams(
    out: Console, front: Front, rules: Sequence[str], options: DiagramOptions, file: Path
) -> None:
    """Print and draw the payload diagrams of solutions, overlaid.

    Args:
        out: where to print.
        front: of the solutions.
        rules: what :meth:`~trajevo.front.Front.pick` picks them by.
        options: what the diagrams are of.
        file: PNG to write.

    Raises:
        InvalidInputError: a robot without effort limits, a payload that has no centre of mass, or a file that cannot
            be written.
    """
    chosen = {rule: front.pick(rule) for rule in rules}
    efforts = {rule: payload_effort(solution) for rule, solution in chosen.items()}
    xy = np.linspace(0.0, options.offset_xy, options.grid)
    z = np.linspace(*options.offset_z, options.grid)
    direction = None if options.direction is None else float(np.radians(options.direction))
    diagrams = {rule: payload_diagram(effort, xy, z, direction=direction) for rule, effort in efforts.items()}
    for rule, solution in chosen.items():
        out.print(f"{solution.rule} (row {solution.index}), time {solution.F.get('time', float('nan')):.4f} s")
        _print_diagram(out, diagrams[rule])
        if options.tolerance is not None:
            _print_robust(out, efforts[rule], solution.front.problem.dynamics.payload.com, options.tolerance)
    figure = payload_contours(_labelled(chosen, diagrams)).figure
    out.print(f"written: {save_figure(figure, file)}")


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
    """Some of the cells, first and last included: the greatest mass, and the least where it is above 0."""
    rows, columns = (
        np.unique(np.linspace(0, count - 1, min(count, _SHOWN)).round().astype(int)) for count in diagram.mass.shape
    )
    angle = np.degrees(diagram.direction.flat[0])
    where = "in the worst direction" if diagram.worst else f"at {angle:g}° from the tool's x axis"
    title = f"largest payload [kg] ({diagram.payload_model}), L_xy {where}"
    table = Table(escape("L_z [mm]"), box=SIMPLE, title=escape(title), title_justify="left")
    for column in columns:
        table.add_column(f"L_xy {1e3 * diagram.offset_xy[column]:.4g} mm")
    for row in rows[::-1]:
        cells = [escape(_cell(diagram, row, column)) for column in columns]
        table.add_row(f"{1e3 * diagram.offset_z[row]:.4g}", *cells)
    out.print(table)


def _cell(diagram: PayloadDiagram, row: int, column: int) -> str:
    mass, least, joint = (float(grid[row, column]) for grid in (diagram.mass, diagram.least, diagram.joint))
    if np.isnan(mass):
        return "none"
    masses = f"{mass:.3f}" if least == 0.0 else f"{least:.3f} to {mass:.3f}"
    return "unlimited" if joint < 0 and least == 0.0 else f"{masses} {diagram.joint_names[int(joint)]}"


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
