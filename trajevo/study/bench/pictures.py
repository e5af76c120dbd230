"""Pictures of a benchmark: how fast rivals come near the best known, and what most of their runs attain."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

from trajevo.base.arrays import Array
from trajevo.base.files import own_folder, why_not, write_whole
from trajevo.errors import InvalidInputError, checked_name
from trajevo.plots.paper import LIMIT, Width, key, log_ticks, panel
from trajevo.study.bench.record import BenchResults, BenchRun
from trajevo.study.bench.score import SHARES
from trajevo.study.plots import band_drawn, surfaces_drawn, surfaces_of

#: Times at which shares are drawn, evenly spaced in their logarithm, and the first as a share of the last.
_TIMES, _FIRST = 200, 1e-3


def convergence(results: BenchResults, problem: str, *, ax: Axes | None = None, width: Width = "column") -> Axes:
    """Share of the best known against CPU time: median over the runs of each rival, within a band of its quartiles.

    Args:
        results: the results.
        problem: name of a problem among them.
        ax: axes to draw into; new ones if None.
        width: ``"column"``, ``"page"`` or millimetres.

    Raises:
        UnknownNameError: no such problem.
        InvalidInputError: no run of it has a score.
    """
    groups = _scored(results, problem)
    longest = max(run.budget for runs in groups.values() for run in runs)
    t = np.geomspace(_FIRST * longest, longest, _TIMES)
    with panel(ax, width=width, height=50.0) as ax:
        for share in SHARES:
            ax.axhline(100.0 * share, color=LIMIT, linewidth=0.5, linestyle=":")
        for i, (rival, runs) in enumerate(groups.items()):
            courses = 100.0 * np.array([course(run, t) for run in runs])
            band_drawn(ax, i, t, np.quantile(courses, (0.25, 0.5, 0.75), axis=0, method="inverted_cdf"), rival)
        ax.set(xscale="log", xlim=(t[0], t[-1]), ylim=(0.0, None), xlabel="CPU time [s]")
        ax.set_ylabel("share of the best known [%]")
        log_ticks(ax.xaxis)
        key(ax)
    return ax


def course(run: BenchRun, t: Array) -> Array:
    """Share of the best known that a run had reached at times (N,) [s], 0 before anything feasible."""
    after = np.searchsorted([one.cpu for one in run.history], t, side="right")
    reached: Array = np.array([0.0, *(one.share for one in run.history)])[after]
    return reached


def attainment_of_rivals(
    results: BenchResults, problem: str, *, ax: Axes | None = None, width: Width = "column"
) -> Axes:
    """What half of the runs of each rival attain in the first two objectives, within what one and three quarters do.

    Args:
        results: the results.
        problem: name of a problem among them.
        ax: axes to draw into; new ones if None.
        width: ``"column"``, ``"page"`` or millimetres.

    Raises:
        UnknownNameError: no such problem.
        InvalidInputError: a problem of one objective, or too few runs that found anything.
    """
    groups = _scored(results, problem)
    one = min((run for runs in groups.values() for run in runs), key=lambda run: len(run.objectives))
    if len(one.objectives) < 2:
        raise InvalidInputError(f"attainment: {problem} has one objective, surfaces are those of two")
    fronts = {rival: surfaces_of([run.values[:, :2] for run in runs]) for rival, runs in groups.items()}
    shown = list(zip(one.objectives[:2], one.units[:2], strict=True))
    return surfaces_drawn(fronts, shown, title="rivals", ax=ax, width=width)


def write_pictures(results: BenchResults, folder: str | Path) -> tuple[tuple[Path, ...], tuple[str, ...]]:
    """Draw all pictures of all problems.

    Returns:
        The files, and what could not be drawn, one sentence each.

    Raises:
        InvalidInputError: the folder cannot be written.
    """
    written, notes = [], []
    drawings: dict[str, Callable[..., Any]] = {"convergence": convergence, "attainment": attainment_of_rivals}
    try:
        place = own_folder(Path(folder))
        for problem in dict.fromkeys(run.problem for run in results.runs):
            # Solvers along paths tell of a time alone.
            alone = any(len(run.objectives) == 1 for run in results.runs if run.problem == problem)
            for name, draw in list(drawings.items())[: 1 if alone else 2]:
                try:
                    figure = draw(results, problem, width="page").figure
                except InvalidInputError as error:
                    notes.append(f"not drawn: {problem}: {error}")
                    continue
                stream = io.BytesIO()
                figure.savefig(stream, format="png", dpi=150)
                plt.close(figure)
                file = place / f"{name}_{problem}.png"
                write_whole(file, stream.getbuffer())
                written.append(file)
    except OSError as error:
        raise InvalidInputError(f"{folder}: the pictures cannot be written there: {why_not(error)}") from error
    return tuple(written), tuple(notes)


def _scored(results: BenchResults, problem: str) -> Mapping[str, Sequence[BenchRun]]:
    """Rival -> its runs on a problem that have a score."""
    checked_name("problem", problem, dict.fromkeys(run.problem for run in results.runs))
    own = [run for run in results.runs if run.problem == problem and run.end == "scored"]
    if not own:
        raise InvalidInputError("no run has a score")
    if not any(run.history for run in own):
        raise InvalidInputError("results in short have no histories; pictures need the folder of the benchmark")
    return {rival: list(runs) for rival, runs in groupby(own, key=lambda run: run.rival)}
