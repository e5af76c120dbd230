"""Every picture of a run, drawn once: for files beside it and for its report."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

import matplotlib.pyplot as plt
import numpy as np

from trajevo import path_plots, plots
from trajevo.composed import ComposedBatch
from trajevo.errors import InvalidInputError
from trajevo.files import write_whole
from trajevo.front import Front
from trajevo.payload_figures import PAYLOAD_FIGURES, payload_figures
from trajevo.rivals import plot_rivals, rivals_of

#: Dots per inch.
_RESOLUTION = 150

#: Figures wider than this scroll sideways on a small screen instead of shrinking [inch].
_WIDE = 10.0

#: File stems of all pictures that a run may have.
FIGURES = (
    "front",
    "front_3d",
    "parallel",
    "hypervolume",
    "profiles",
    "path",
    "parameter",
    "tool_path",
    "rivals",
    *PAYLOAD_FIGURES,
)


@final
@dataclass(frozen=True, eq=False)
class Picture:
    """A picture of a run.

    Attributes:
        stem: of its file's name, one of :data:`FIGURES`.
        caption: what it shows.
        png: the file's content.
        wide: whether it should not shrink on a small screen.
    """

    stem: str
    caption: str
    png: bytes
    wide: bool


def draw_all(front: Front) -> tuple[Picture, ...]:
    """Every picture of a run; an empty front has none."""
    if not len(front):
        return ()
    drawn = []
    for stem, caption, figure in _figures(front):
        wide = figure.get_figwidth() > _WIDE
        drawn.append(Picture(stem, caption, _png(figure), wide))
    return tuple(drawn)


def save_pictures(pictures: Sequence[Picture], folder: Path) -> list[Path]:
    """Write pictures as PNG.

    Raises:
        InvalidInputError: one cannot be written.
    """
    return [written(folder / f"{picture.stem}.png", picture.png) for picture in pictures]


def save_figure(figure: Any, file: Path) -> Path:
    """Write one figure as PNG, and close it.

    Raises:
        InvalidInputError: it cannot be written.
    """
    return written(file, _png(figure))


def written(file: Path, content: bytes) -> Path:
    """Write a file whole.

    Raises:
        InvalidInputError: it cannot be written.
    """
    try:
        write_whole(file, content)
    except OSError as error:
        raise InvalidInputError(f"{file}: cannot be written: {error.strerror}") from error
    return file


def _figures(front: Front) -> Iterator[tuple[str, str, Any]]:
    """Every figure of a run, one at a time: file stem, caption, figure."""
    knee = front.knee()
    if front.F.shape[1] > 1:
        yield "front", "The front, every pair of objectives", plots.front(front, mark=knee)[0].figure
    if front.F.shape[1] > 2:
        yield "front_3d", "The front, three objectives", plots.front_3d(front, mark=knee).figure
    yield "parallel", "Trade-offs: one line per solution", plots.parallel_coordinates(front, mark=knee).figure
    yield "hypervolume", "Hypervolume by generation", plots.hypervolume(front).figure
    yield "profiles", "Joint motion of the knee inside its limits (dashed)", plots.profiles(knee)[0].figure
    along = isinstance(knee.trajectory, ComposedBatch)
    if along and knee.trajectory.n_joints == 2:
        yield "path", "The path, its control polygon, and the speed of the knee", path_plots.path(knee).figure
    else:
        yield "tool_path", "Path of the tool at the knee", plots.tool_path(knee).figure
    if along:
        named = {solution.rule: solution for solution in front.choices()}
        yield "parameter", "The path's parameter over time", path_plots.parameter(named).figure
    if front.problem.compares_rivals:
        rivals = plot_rivals(rivals_of(front.problem))[0].figure
        yield "rivals", "Interpolants at their least times under the same limits", rivals
    if np.isfinite(front.problem.robot.limits.effort).any():
        yield from payload_figures(front)


def _png(figure: Any) -> bytes:
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=_RESOLUTION, bbox_inches="tight")
    plt.close(figure)
    return stream.getvalue()
