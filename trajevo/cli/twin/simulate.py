"""``trajevo simulate``: a motion or a whole front in closed loop, told in the terminal and drawn."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from trajevo import plots
from trajevo.cli import completion
from trajevo.cli.console import Terminal
from trajevo.cli.problem_options import ProblemOption
from trajevo.cli.results import (
    ACHIEVED_PICTURE,
    CLOSED_LOOP_PICTURE,
    RunArgument,
    SolutionOption,
    beside,
    front_of,
)
from trajevo.cli.screen.tables import Listing
from trajevo.cli.screen.waiting import Waiting
from trajevo.errors import InvalidInputError
from trajevo.plots.pictures import save_figure
from trajevo.verification.twin.settings import CONTROLLERS, TwinSettings
from trajevo.verification.twin.simulate import simulate as simulated
from trajevo.verification.twin.simulated_front import SimulatedFront
from trajevo.verification.twin.simulation import Simulation

_out = Terminal()

#: Solutions of a front that are played if nothing else is said, spread over it, and rows of the printed table.
_MOST, _SHOWN = 100, 12


def simulate(
    run: RunArgument,
    solution: SolutionOption = "knee",
    every: Annotated[
        bool, typer.Option("--all", help="Play the front, or 100 solutions that are spread over a larger one.")
    ] = False,
    controller: Annotated[
        str,
        typer.Option(help=f"{' or '.join(CONTROLLERS)}.", autocompletion=completion.controllers),
    ] = TwinSettings.controller,
    rate: Annotated[float, typer.Option(help="How often the controller acts [Hz].")] = TwinSettings.rate,
    natural_frequency: Annotated[float, typer.Option(help="Natural frequency of the error's decay [rad/s].")] = 50.0,
    damping_ratio: Annotated[float, typer.Option(help="Damping ratio of that decay.")] = 1.0,
    resolution: Annotated[float, typer.Option(help="Step of the encoders [rad or m].")] = 0.0,
    noise: Annotated[float, typer.Option(help="Standard deviation of measured positions [rad or m].")] = 0.0,
    delay: Annotated[float, typer.Option(help="From measuring to acting [s].")] = 0.0,
    payload_error: Annotated[
        float, typer.Option(help="How much more payload the controller believes in than is carried, as a share.")
    ] = 0.0,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the noise.")] = TwinSettings.seed,
    tolerance: Annotated[
        float, typer.Option(help="Distance of the tool from its end within which it is settled [m].")
    ] = TwinSettings.tolerance,
    settle: Annotated[float, typer.Option(help="How long it is watched after the end [s].")] = TwinSettings.settle,
    out: Annotated[
        Path | None,
        typer.Option(help=f"Picture; {CLOSED_LOOP_PICTURE} or {ACHIEVED_PICTURE} beside the front if not given."),
    ] = None,
    problem: ProblemOption = None,
) -> None:
    """Play a motion, or the front, in closed loop in MuJoCo: errors, efforts, settling, and what stays undominated."""
    settings: dict[str, Any] = {
        "controller": controller,
        "rate": rate,
        "natural_frequency": natural_frequency,
        "damping_ratio": damping_ratio,
        "resolution": resolution,
        "noise": noise,
        "delay": delay,
        "payload_error": payload_error,
        "seed": seed,
        "tolerance": tolerance,
        "settle": settle,
    }
    TwinSettings(**settings)  # which refuses what cannot be used before a run is read
    if every and solution != "knee":
        raise InvalidInputError(f"--all: expected no --solution with it, got {solution!r}")
    front = front_of(run, problem)
    motion: Any = front if every else front.pick(solution)
    if every:
        settings["rows"] = front.thinned(_MOST)
    with Waiting("simulating", ["motions"]) as shown:
        shown.begin("motions")
        found = simulated(motion, **settings)
    if isinstance(found, SimulatedFront):
        _print_front(found)
        figure, target = plots.achieved_front(found).figure, out or beside(run, ACHIEVED_PICTURE)
    else:
        _out.print(f"{motion.rule} (row {motion.index})")
        _print_motion(found)
        figure, target = plots.closed_loop(found)[0].figure, out or beside(run, CLOSED_LOOP_PICTURE)
    more = "--solution ROW plays one of them alone" if every else "--all tells what of the front is achieved"
    then = f"trajevo simulate {run} {more}"
    _out.written(save_figure(figure, target), then=then)


def _print_motion(found: Simulation) -> None:
    _out.print(str(found))
    table = Listing("joint", "greatest error", "RMS error", "effort limit used [%]")
    for k, name in enumerate(found.robot.joint_names):
        unit = found.robot.joint_units[k]
        errors = (f"{values[k]:.3g} {unit}" for values in (found.greatest_error, found.rms_error))
        table.add(name, *errors, f"{100.0 * found.used[k]:.4g}" if found.used[k] else "")
    _out.print(table)


def _print_front(found: SimulatedFront) -> None:
    if len(found) < len(found.front):
        _out.print(f"{len(found)} of {len(found.front)} solutions, spread over the front")
    _out.print(str(found))
    names = found.front.objective_names
    table = Listing("row", *(f"{name} achieved" for name in names), "settling [s]", "tool off [mm]", "effort used [%]")
    stand = np.flatnonzero(found.stands)
    for row in stand[np.unique(np.linspace(0, len(stand) - 1, min(len(stand), _SHOWN)).round().astype(int))]:
        achieved = (f"{value:.5g}" for value in found.F[row])
        told = (found.settling[row], 1e3 * found.greatest_tool_error[row], 100.0 * found.used[row].max())
        table.add(str(found.rows[row]), *achieved, *(f"{value:.4g}" for value in told))
    if len(stand):
        _out.print(table)
