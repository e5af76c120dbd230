"""``trajevo certify``: what a motion never exceeds at any instant, proven."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import numpy as np
import typer
from rich.box import SIMPLE
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from trajevo.certificate import Certificate
from trajevo.certify import certify, certify_all
from trajevo.cli_files import SOLUTION_HELP, RunArgument, front_of
from trajevo.units import pretty

_out = Console(soft_wrap=True, highlight=False)


def certificate(
    run: RunArgument,
    solution: Annotated[str, typer.Option(help=SOLUTION_HELP)] = "knee",
    tolerance: Annotated[
        float, typer.Option(help="Share of a limit by which bounds may lie above what a sample exhibits.")
    ] = 0.001,
    tool_speed: Annotated[
        float | None, typer.Option(help="Greatest speed of the tool [m/s]; that of the run's problem if not given.")
    ] = None,
    power: Annotated[float | None, typer.Option(help="Greatest mechanical power of every joint [W].")] = None,
    every: Annotated[bool, typer.Option("--all", help="Every solution of the front.")] = False,
) -> None:
    """Prove that a motion keeps every limit at every instant; exit code 1 if one is broken or not decided."""
    front = front_of(run)
    if every:
        found: Sequence[Certificate] = certify_all(front, tolerance=tolerance, tool_speed=tool_speed, power=power)
    else:
        found = [certify(front.pick(solution), tolerance=tolerance, tool_speed=tool_speed, power=power)]
        _out.print(_table(found[0]))
    for each in found:
        if not (every and each.proven):
            _out.print(escape(str(each)))
    kept = sum(each.proven for each in found)
    if every:
        _out.print(f"{kept} of {len(found)} solutions are proven to keep every limit at every instant.")
    if kept < len(found):
        raise typer.Exit(1)


def _table(certificate: Certificate) -> Table:
    """The row of every quantity that is nearest to its limit, and every other one that is not proven."""
    columns = ("quantity", "greatest sample", "at", "proven at most", "limit", "proven share")
    table = Table(*columns, box=SIMPLE)
    for row in certificate.rows:
        if row not in certificate.by_quantity and row.proven:
            continue
        unit = pretty(row.unit)
        limited = bool(np.isfinite(row.limit))
        limit = (f"{row.limit:g} {unit}", f"{100.0 * row.share:.3f} %") if limited else ("none", "")
        cells = (row.name, f"{row.exhibited:.6g} {unit}", f"{row.instant:.4f} s", f"{row.bound:.6g} {unit}", *limit)
        table.add_row(*map(escape, cells), style="bold red" if row.violated else "green" if limited else None)
    return table
