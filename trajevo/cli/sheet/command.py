"""``trajevo payload-sheet``: the sheet of what a motion carries, to check and sign."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Any

import typer

from trajevo.base.units import quantity
from trajevo.cli import completion
from trajevo.cli.console import Terminal
from trajevo.cli.problem_options import ProblemOption
from trajevo.cli.results import SHEET_FILE, RunArgument, beside, front_of
from trajevo.errors import InvalidInputError
from trajevo.page.sheet.sheet import NO_DRIVES, payload_sheet

_out = Terminal()

#: A load on the arm as it is written.
_MOUNTED = re.compile(r"([^=]+)=([^@]+?)(?:@(.*))?")

#: Exit code for a load that is not within limits.
_NOT_WITHIN = 1


def payload_sheet_of(
    run: RunArgument,
    member: Annotated[
        str,
        typer.Option(
            help="knee, utopia, weighted, topsis, least_OBJECTIVE or a row.", autocompletion=completion.solutions
        ),
    ] = "knee",
    dwell: Annotated[float, typer.Option(help="Time at rest after the motion, until it begins anew [s].")] = 0.0,
    supplementary: Annotated[
        list[str] | None,
        typer.Option(
            help="JOINT=MASS@X,Y,Z of a load mounted on the arm: a mass, such as '10 kg', and its centre in the frame "
            "of the joint [m]; may be repeated."
        ),
    ] = None,
    creator: Annotated[str, typer.Option(help="Who makes the sheet; a line to fill in if not given.")] = "",
    out: Annotated[
        Path | None, typer.Option(help="HTML file; payload_sheet.html beside the front if not given.")
    ] = None,
    problem: ProblemOption = None,
) -> None:
    """Write the sheet of what a motion carries, to check and sign, and its JSON; exit code 1 unless within limits."""
    mounted = dict(_mounted(text) for text in supplementary or [])
    chosen = front_of(run, problem).pick(member)
    sheet = payload_sheet(chosen, dwell=dwell, supplementary=mounted, creator=creator)
    files = sheet.save(out or beside(run, SHEET_FILE))
    _out.print(f"{sheet.verdict}: {sheet.load.mass:g} kg on {sheet.robot}, {sheet.motion}")
    for name, verdict in (("static", sheet.static), ("dynamic", sheet.dynamic)):
        _out.print(f"{name}: {verdict}")
    for verdict in sheet.duty:
        _out.print(f"{verdict.about}: {verdict}")
    _out.print(f"largest payload: {sheet.capacity or f'not told: {sheet.capacity_note}'}")
    if sheet.drive_capacity is not None:
        _out.print(f"largest payload by the drives: {sheet.drive_capacity}")
    if not sheet.duty:
        _out.print(NO_DRIVES)
    _out.written(*files, then=f"trajevo certify {run} --solution {member} shows what is proven")
    if sheet.verdict != "within limits":
        raise typer.Exit(_NOT_WITHIN)


def _mounted(text: str) -> tuple[str, Any]:
    """A joint and its load from ``JOINT=MASS@X,Y,Z``."""
    match = _MOUNTED.fullmatch(text)
    if match is None:
        raise InvalidInputError(
            f"--supplementary: expected JOINT=MASS@X,Y,Z such as 'elbow_joint=10 kg@0.1,0,0.2', got {text!r}"
        )
    joint, mass, place = (None if part is None else part.strip() for part in match.groups())
    try:
        com = [0.0, 0.0, 0.0] if place is None else [_length(part) for part in place.split(",")]
        return str(joint), {"mass": str(mass) if _has_unit(str(mass)) else float(str(mass)), "com": com}
    except ValueError as error:
        raise InvalidInputError(f"--supplementary: expected numbers in JOINT=MASS@X,Y,Z, got {text!r}") from error


def _has_unit(text: str) -> bool:
    return bool(re.search(r"[a-zA-Z]\s*$", text))


def _length(text: str) -> float:
    return quantity(text.strip(), "m", name="--supplementary") if _has_unit(text) else float(text)
