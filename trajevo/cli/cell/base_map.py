"""``trajevo base-map``: the least of an objective from every place of a robot's base, in a table and a picture."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from trajevo import plots
from trajevo.base.units import display, pretty
from trajevo.cli.console import Terminal
from trajevo.cli.problem_options import ProblemArgument, chosen_problem, problem_options
from trajevo.cli.results import NO_SOLUTION
from trajevo.cli.screen.tables import Listing
from trajevo.cli.screen.waiting import Waiting
from trajevo.errors import InvalidInputError
from trajevo.formulation.cell.base_box import COORDINATES
from trajevo.plots.pictures import save_figure
from trajevo.solvers.base_map import BaseMap
from trajevo.solvers.base_map import base_map as mapped

_out = Terminal()

#: Greatest number of rows and columns of the printed table; the picture has all cells.
_SHOWN = 7


@problem_options
def base_map(
    *,
    problem: ProblemArgument,
    options: dict[str, Any],
    axes: Annotated[
        tuple[str, str], typer.Option(help=f"Two coordinates of the base that move: {', '.join(COORDINATES)}.")
    ] = ("x", "y"),
    cells: Annotated[int, typer.Option(help="Places along each of them.")] = 15,
    at: Annotated[
        list[str] | None,
        typer.Option(help="COORDINATE=DISPLACEMENT of the base beside the plane [m or rad]; may be repeated."),
    ] = None,
    objective: Annotated[str | None, typer.Option(help="One of the problem's objectives; the first if none.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the random timings.")] = 0,
    out: Annotated[Path, typer.Option(help="Picture.")] = Path("base_map.png"),
) -> None:
    """Show and draw the least of an objective from every place of a robot's base; exit code 3 if there is none."""
    made = chosen_problem(problem, options)[0]
    with Waiting("computing", ["motions from all places"]) as shown:
        shown.begin("motions from all places")
        found = mapped(made, axes=axes, cells=cells, at=_places(at or ()), objective=objective, seed=seed)
    _out.print(f"{made.title}: {found}")
    _out.print(_table(found))
    with Waiting("drawing", [out.name]) as shown:
        shown.begin(out.name)
        file = save_figure(plots.base_map(found).figure, out)
    _out.written(file, then="trajevo solve finds the front over all places")
    if np.isnan(found.least).all():
        raise typer.Exit(NO_SOLUTION)


def _places(given: list[str] | tuple[str, ...]) -> dict[str, float | str] | None:
    places: dict[str, float | str] = {}
    for pair in given:
        name, equals, value = pair.partition("=")
        if not equals or not value:
            raise InvalidInputError(f"--at: expected COORDINATE=DISPLACEMENT, such as z=0.2, got {pair!r}")
        try:
            places[name.strip()] = float(value)
        except ValueError:
            places[name.strip()] = value.strip()
    return places or None


def _table(found: BaseMap) -> Listing:
    unit, factor = display(found.unit, angle=found.problem.angle, length=found.problem.length)
    columns, rows = (_some(len(values)) for values in (found.columns, found.rows))
    first, second = (f"{axis} [{COORDINATES[axis]}]" for axis in found.axes)
    title = f"least {found.objective} [{pretty(unit)}] by displacement of the base; - where there is no motion"
    table = Listing(f"{second} \\ {first}", *(f"{found.columns[k]:.3g}" for k in columns), title=title)
    for row in reversed(rows):
        values = factor * found.least[row, columns]
        table.add(f"{found.rows[row]:.3g}", *("-" if np.isnan(value) else f"{value:.4g}" for value in values))
    return table


def _some(count: int) -> list[int]:
    return sorted({round(k) for k in np.linspace(0, count - 1, min(count, _SHOWN))})
