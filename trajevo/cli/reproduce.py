"""The command ``trajevo reproduce``."""

from __future__ import annotations

import signal
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from trajevo.base.units import pretty
from trajevo.cli import completion
from trajevo.cli.console import Terminal
from trajevo.cli.screen.tables import Listing
from trajevo.cli.screen.waiting import Waiting
from trajevo.reproduction.page import shown_number
from trajevo.reproduction.paper import Item, LeftOut, Shown
from trajevo.reproduction.registry import paper_named
from trajevo.reproduction.reproduce import reproduce as make_again

_out = Terminal()


def reproduce(
    paper: Annotated[
        str,
        typer.Argument(help="Paper: sun2020, guo2016, paing2021, raji2022.", autocompletion=completion.papers),
    ],
    figure: Annotated[list[str] | None, typer.Option(help="Number of a figure; may be given several times.")] = None,
    table: Annotated[list[str] | None, typer.Option(help="Number of a table; may be given several times.")] = None,
    out: Annotated[Path | None, typer.Option(help="Folder of the files; reproduced/PAPER if not given.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of all searches.")] = 1,
    short: Annotated[bool, typer.Option("--short", help="Short searches, for a first look.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress.")] = False,
) -> None:
    """Make figures and tables of a paper again beside its printed numbers; exit code 1 if one is not as expected."""
    found = paper_named(paper)
    figures, tables = tuple(figure or ()), tuple(table or ())
    steps = [str(item) for item in found.chosen(figures=figures, tables=tables)]
    with Waiting(found.name, steps, quiet=quiet, lines=True) as shown:
        made = make_again(
            found,
            out or Path("reproduced") / found.name,
            figures=figures,
            tables=tables,
            seed=seed,
            short=short,
            begin=lambda item: shown.begin(str(item)),
        )
    for item, one in made.shown.items():
        _print(item, one)
    if not (figures or tables):
        _print_left_out(found.left_out)
    _out.print(f"written: {', '.join(file.name for file in made.files) or 'nothing'}; in {made.folder}")
    if made.stopped_by:
        left = steps[len(made.shown) :]
        _out.print(
            f"stopped by {made.stopped_by} before {left[0] if left else 'the end'}; next: the same command again"
        )
        raise typer.Exit(128 + signal.Signals[made.stopped_by])
    if made.unexpected:
        names = ", ".join(f"{item}, {number.of}" for item, number in made.unexpected)
        _out.print(f"not as expected: {names}")
        raise typer.Exit(1)


def _print(item: Item, shown: Shown) -> None:
    if not shown.numbers:
        _out.print(f"{item}: {item.title}")
        return
    table = Listing("quantity", "the paper prints", "here", "", title=f"{item}: {item.title}")
    for number in shown.numbers:
        of = number.of if number.unit == "1" else f"{number.of} [{pretty(number.unit)}]"
        said = number.verdict if not number.why else f"{number.verdict}: {number.why}"
        table.add(of, number.printed, shown_number(number.ours), said)
    _out.print(table)


def _print_left_out(left_out: Sequence[LeftOut]) -> None:
    if left_out:
        table = Listing("cannot be made again", "shows", "why")
        for one in left_out:
            table.add(one.what, one.title, one.why)
        _out.print(table)
