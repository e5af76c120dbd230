"""The command ``trajevo check``: what is known about a problem before its search."""

from __future__ import annotations

from typing import Any

import typer

from trajevo.cli.console import Terminal
from trajevo.cli.problem_options import ProblemArgument, chosen_problem, problem_options
from trajevo.cli.results import NO_SOLUTION
from trajevo.cli.screen.tables import Listing
from trajevo.formulation.feasibility.check import check

_out = Terminal()


@problem_options
def check_problem(*, problem: ProblemArgument, options: dict[str, Any]) -> None:
    """Show what rules a motion out before a search: efforts, clearances and least times; exit code 3 if any does."""
    found = check(chosen_problem(problem, options)[0])
    _out.print(found.title)
    if found.table:
        headers, *rows = found.table
        table = Listing(*headers)
        for row in rows:
            table.add(*row)
        _out.print(table)
    for sentence in found.sentences:
        _out.print(sentence)
    if found.impossible:
        raise typer.Exit(NO_SOLUTION)
