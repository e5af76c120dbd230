"""Where commands read a run from and write beside it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from trajevo.front import Front
from trajevo.runs import read_run

RunArgument = Annotated[Path, typer.Argument(help="Folder that `trajevo solve` wrote, or a front's file.")]

#: Pictures that commands write beside a front unless told where.
SLOWDOWN_PICTURE, DIAGRAM_PICTURE, CURVE_PICTURE = "slowdown.png", "payload_diagram.png", "payload_time.png"
#: What the name of a curve's picture ends with where it is that of the price of uncertainty.
PRICE_SUFFIX = "_uncertainty"
PICTURES = (SLOWDOWN_PICTURE, DIAGRAM_PICTURE, CURVE_PICTURE, CURVE_PICTURE.replace(".", f"{PRICE_SUFFIX}."))

#: What every command says of how one solution is chosen.
SOLUTION_HELP = "knee, utopia, weighted, least_OBJECTIVE or a row."


def front_of(run: Path) -> Front:
    """Front of a run's folder, finished or not, or of a front's file."""
    return read_run(run) if run.is_dir() else Front.load(run)


def beside(run: Path, name: str) -> Path:
    """A file in a run's folder, or beside a front's file."""
    return run / name if run.is_dir() else run.with_name(name)
