"""Every picture of a run that is about effort and payload, for a robot that has effort limits."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

import numpy as np

from trajevo import capacity_plots, load_plots, payload_plots
from trajevo.capacity import Capacity, dlcc
from trajevo.errors import InvalidInputError
from trajevo.front import Front, Solution
from trajevo.inverse_kinematics import Pose
from trajevo.payload_diagram import payload_diagram
from trajevo.payload_effort import payload_effort
from trajevo.payload_time import capacity_front, largest_payload, payloads_up_to
from trajevo.problem import TrajectoryProblem
from trajevo.slowdown import ScaledPath
from trajevo.slowdown_curve import slowdown_curve
from trajevo.uncertainty import price_along_path
from trajevo.workspace_capacity import ToolPlane, workspace_capacity

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
    yield "effort", "Effort at the knee as a share of its limits", load_plots.effort_utilisation(knee).figure
    if front.problem.payload_range is not None:
        yield "payload_front", "Payload against time on the front", load_plots.payload_front(front).figure
    capacity = dlcc(knee)
    if not (capacity.joint and capacity.feasible and capacity.mass > 0.0):
        return
    yield "capacities", "What every solution can carry", load_plots.front_capacities(front).figure
    caption = "What is left of the effort limits at the knee with its largest payload"
    yield "margins", caption, load_plots.capacity_margins(capacity).figure
    if 0.0 < ScaledPath(knee, _SAMPLES).static_bound < np.inf:
        curve = slowdown_curve(knee, samples=_SAMPLES)
        caption = "Payload against the least time along the path of the knee"
        yield "slowdown", caption, capacity_plots.slowdown_curve(curve).figure
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
    yield "payload_time", caption, load_plots.payload_curve(curve, at_rest=largest.at_rest).figure


def _around(knee: Solution) -> Iterator[tuple[str, str, Any]]:
    """What is held at rest around the middle of the motion, in the upright plane along which the tool moves most."""
    robot, q = knee.rollout.robot, knee.trajectory.sample(101).q[0]
    positions, rotations = robot.tool_poses(q)
    plane = "xz" if np.ptp(positions[:, 0]) >= np.ptp(positions[:, 1]) else "yz"
    square = ToolPlane.around(Pose(positions[50], rotations[50]), plane, reach=_MAP_REACH, cells=_MAP_CELLS)
    found = workspace_capacity(robot, square, payload=knee.rollout.dynamics.payload, start=q[50])
    ax = capacity_plots.workspace_capacity(found)
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
    yield "payload_diagram", caption, payload_plots.payload_contours(diagrams).figure
    masses = [float(f"{share * capacity.mass:.3g}") for share in _SHARES]
    region = payload_plots.allowed_region(efforts["knee"], masses, within=_REACH, axis="y")
    yield "allowed_centres", "Where the centre of mass of a payload may lie at the knee", region.figure
    com = front.problem.dynamics.payload.com
    robust = payload_plots.robust_mass(efforts["knee"], com=com, within=0.1)
    yield "robust_payload", "What the knee carries by how well the centre of mass is known", robust.figure
    if front.problem.dynamics.payload.mass > 0.0 and front.problem.payload_range is None:
        with contextlib.suppress(InvalidInputError):  # no speed along this path carries the payload as it is
            price = price_along_path(knee, np.linspace(0.0, 0.1, 6).tolist(), samples=_SAMPLES)
            caption = "Least time along the knee's path by how well the centre of mass is known"
            yield "uncertainty", caption, payload_plots.uncertainty_price(price).figure
