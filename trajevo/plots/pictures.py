"""Every picture of a run, drawn once: for files beside it and for its report."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

import matplotlib.pyplot as plt
import numpy as np

from trajevo import plots
from trajevo.base.files import write_whole
from trajevo.capacity.dlcc import Capacity, dlcc
from trajevo.capacity.payload_diagram import payload_diagram
from trajevo.capacity.payload_effort import payload_effort
from trajevo.capacity.payload_time import capacity_front, largest_payload, payloads_up_to
from trajevo.capacity.slowdown import ScaledPath, slowdown_curve
from trajevo.capacity.uncertainty import price_along_path
from trajevo.capacity.workspace import ToolPlane, workspace_capacity
from trajevo.errors import InvalidInputError
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.front.front import Front, Solution
from trajevo.path.inverse_kinematics import Pose
from trajevo.plots.rivals import plot_rivals
from trajevo.solvers.rivals import rivals_of
from trajevo.trajectory.along_path import ComposedBatch

#: File stems of all these pictures.
PAYLOAD_FIGURES = (
    "effort",
    "payload_front",
    "capacities",
    "margins",
    "slowdown",
    "payload_time",
    "payload_diagram",
    "allowed_centres",
    "robust_payload",
    "uncertainty",
    "workspace",
)

#: How far off the tool's axes loads are looked at [m], and cells of the diagram along either side.
_REACH, _CELLS = 0.3, 41


#: Variables times terms of the limits up to which optimising again takes seconds.
_QUICK = 20_000

#: Cells of the map along either side, and from its middle to its sides [m].
_MAP_CELLS, _MAP_REACH = 15, 0.5


#: Instants per segment, enough for pictures.
_SAMPLES = 12

#: Shares of the largest payload whose allowed centres of mass are drawn.
_SHARES = (0.4, 0.6, 0.8, 0.95)


def payload_figures(front: Front) -> Iterator[tuple[str, str, Any]]:
    """File stem, caption and figure of each.

    Args:
        front: not empty, of a robot with effort limits. Pictures that have nothing to show are left out: those of a
            bound where no payload reaches one, those of loads off centre for a payload that acts at the tool's origin.
    """
    knee = front.knee()
    yield "effort", "Effort at the knee as a share of its limits", plots.effort_utilisation(knee).figure
    if front.problem.payload_range is not None:
        yield "payload_front", "Payload against time on the front", plots.payload_front(front).figure
    capacity = dlcc(knee)
    if not (capacity.joint and capacity.feasible and capacity.mass > 0.0):
        return
    yield "capacities", "What every solution can carry", plots.front_capacities(front).figure
    caption = "What is left of the effort limits at the knee with its largest payload"
    yield "margins", caption, plots.capacity_margins(capacity).figure
    if 0.0 < ScaledPath(knee, _SAMPLES).static_bound < np.inf:
        curve = slowdown_curve(knee, samples=_SAMPLES)
        caption = "Payload against the least time along the path of the knee"
        yield "slowdown", caption, plots.slowdown_curve(curve).figure
    with contextlib.suppress(InvalidInputError):  # no time to minimise
        yield from _optimised_again(front.problem)
    if front.problem.dynamics.payload.model != "tool_axis":
        yield from _off_centre(front, knee, capacity)
    yield from _around(knee)


def _optimised_again(problem: TrajectoryProblem) -> Iterator[tuple[str, str, Any]]:
    if problem.payload_range is not None or problem.n_var * problem.in_terms().n_ieq_constr > _QUICK:
        return
    largest = largest_payload(problem, seed=1, starts=1)
    curve = capacity_front(problem, payloads_up_to(problem, largest.mass)[0], seed=1, starts=1)
    caption = "Payload against the least time, the motion optimised again for each"
    yield "payload_time", caption, plots.payload_curve(curve, at_rest=largest.at_rest).figure


def _around(knee: Solution) -> Iterator[tuple[str, str, Any]]:
    """What is held at rest around the middle of the motion, in the upright plane along which the tool moves most."""
    robot, q = knee.rollout.robot, knee.trajectory.sample(101).q[0]
    positions, rotations = robot.tool_poses(q)
    plane = "xz" if np.ptp(positions[:, 0]) >= np.ptp(positions[:, 1]) else "yz"
    square = ToolPlane.around(Pose(positions[50], rotations[50]), plane, reach=_MAP_REACH, cells=_MAP_CELLS)
    found = workspace_capacity(robot, square, payload=knee.rollout.dynamics.payload, start=q[50])
    ax = plots.workspace_capacity(found)
    along, up = ("xyz".index(axis) for axis in plane)
    ax.plot(positions[:, along], positions[:, up], color="black", linewidth=1.0, zorder=3)
    yield "workspace", "What can be held at rest around the knee's motion (line), the tool turned as midway", ax.figure


def _off_centre(front: Front, knee: Solution, capacity: Capacity) -> Iterator[tuple[str, str, Any]]:
    chosen = {"knee": knee}
    if "time" in front.problem.objective_names:
        fastest = front.pick("least_time")
        if fastest.index != knee.index:
            chosen["least time"] = fastest
    efforts = {name: payload_effort(solution, samples=_SAMPLES) for name, solution in chosen.items()}
    xy, z = np.linspace(0.0, _REACH, _CELLS), np.linspace(-_REACH, _REACH, 2 * _CELLS - 1)
    diagrams = {name: payload_diagram(effort, xy, z) for name, effort in efforts.items()}
    caption = "What can be carried by how far off the tool the load sits, " + " and ".join(diagrams)
    yield "payload_diagram", caption, plots.payload_contours(diagrams).figure
    masses = [float(f"{share * capacity.mass:.3g}") for share in _SHARES]
    region = plots.allowed_region(efforts["knee"], masses, within=_REACH, axis="y")
    yield "allowed_centres", "Where the centre of mass of a payload may lie at the knee", region.figure
    com = front.problem.dynamics.payload.com
    robust = plots.robust_mass(efforts["knee"], com=com, within=0.1)
    yield "robust_payload", "What the knee carries by how well the centre of mass is known", robust.figure
    if front.problem.dynamics.payload.mass > 0.0 and front.problem.payload_range is None:
        with contextlib.suppress(InvalidInputError):  # no speed along this path carries the payload as it is
            price = price_along_path(knee, np.linspace(0.0, 0.1, 6).tolist(), samples=_SAMPLES)
            caption = "Least time along the knee's path by how well the centre of mass is known"
            yield "uncertainty", caption, plots.uncertainty_price(price).figure


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
        yield "path", "The path, its control polygon, and the speed of the knee", plots.path(knee).figure
    else:
        yield "tool_path", "Path of the tool at the knee", plots.tool_path(knee).figure
    if along:
        named = {solution.rule: solution for solution in front.choices()}
        yield "parameter", "The path's parameter over time", plots.parameter(named).figure
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
