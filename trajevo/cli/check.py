"""The command ``trajevo check``: what is known about a problem before its search."""

from __future__ import annotations

import typer
from rich.console import Console

from trajevo.cli.problem_options import (
    ConventionOption,
    EncodingOption,
    InterpolantOption,
    LimitsOption,
    PathOption,
    PayloadModelOption,
    PayloadOption,
    PointsOption,
    ProblemArgument,
    SetOption,
    chosen_problem,
)
from trajevo.cli.results import NO_SOLUTION
from trajevo.formulation.feasibility.check import check

_out = Console(soft_wrap=True, highlight=False)


def check_problem(
    problem: ProblemArgument,
    interpolant: InterpolantOption = None,
    payload: PayloadOption = None,
    payload_model: PayloadModelOption = None,
    convention: ConventionOption = None,
    points: PointsOption = None,
    path: PathOption = None,
    limits: LimitsOption = None,
    encoding: EncodingOption = None,
    set_: SetOption = None,
) -> None:
    """Show what rules a motion out before a search: efforts, clearances and least times; exit code 3 if any does."""
    arguments = {
        "interpolant": interpolant,
        "payload": payload,
        "payload_model": payload_model,
        "convention": convention,
        "points": points,
        "path": path,
        "limits": limits,
        "encoding": encoding,
    }
    found = check(chosen_problem(problem, arguments, set_)[0])
    _out.print(str(found), markup=False)
    if found.impossible:
        raise typer.Exit(NO_SOLUTION)
