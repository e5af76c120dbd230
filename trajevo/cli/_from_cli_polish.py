"""The command ``trajevo polish``: a run's front refined by gradients, beside its own."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from trajevo.cli_files import RunArgument, front_of
from trajevo.cli_results import write_results
from trajevo.errors import InvalidInputError
from trajevo.polish import Polished, polish
from trajevo.run_folder import FRONT_FILE, RunFolder

_out = Console(soft_wrap=True, highlight=False)


def polish_run(
    run: RunArgument,
    members: Annotated[int, typer.Option(help="Members that are refined in every round.")] = 10,
    rounds: Annotated[int, typer.Option(help="Rounds of refining members and filling gaps.")] = 2,
    seed: Annotated[int | None, typer.Option(help="Seed of all randomness; the run's own if not given.")] = None,
    cpu_time: Annotated[float | None, typer.Option(help="CPU time after which no step is begun [s].")] = None,
    out: Annotated[Path | None, typer.Option(help="File for the polished front; the run then stays as it is.")] = None,
) -> None:
    """Refine a run's front by gradients; the front as it was stays beside it, in evolved.json."""
    front, own = front_of(run), run / FRONT_FILE if run.is_dir() else run
    if not run.is_dir() and out is None:
        raise InvalidInputError(f"out: {run} is a front's file, not a run's folder; say where the polished front goes")
    if out is not None and out.resolve() == own.resolve():
        raise InvalidInputError(f"out: {out} is the front itself, which is kept; choose another file")
    found = polish(front, members=members, rounds=rounds, seed=seed, cpu_time=cpu_time)
    _out.print(_table(found))
    _out.print(f"polished: {found}")
    if out is not None:
        found.front.save(out)
        _out.print(f"written: {out}")
        return
    folder = RunFolder(run)
    with folder.alone():
        if not folder.evolved_file.exists():
            found.original.save(folder.evolved_file)
        found.front.save(own)
    write_results(found.front, run)


def _table(found: Polished) -> Table:
    """The least of every objective before and after."""
    table = Table("least", "before", "after", "unit", box=SIMPLE)
    before, after = found.original.F.min(axis=0), found.front.F.min(axis=0)
    for objective, was, now in zip(found.front.record.objectives, before, after, strict=True):
        table.add_row(objective.name, f"{was:.6g}", f"{now:.6g}", objective.unit)
    return table
