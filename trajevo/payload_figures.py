"""Every picture of a run that is about effort and payload, for a robot that has effort limits."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from trajevo import capacity_plots, load_plots, payload_plots
from trajevo.capacity import Capacity, dlcc
from trajevo.front import Front, Solution
from trajevo.payload_diagram import payload_diagram
from trajevo.payload_effort import payload_effort
from trajevo.slowdown import ScaledPath
from trajevo.slowdown_curve import slowdown_curve

#: File stems of all these pictures.
PAYLOAD_FIGURES = (
    "effort",
    "payload_front",
    "capacities",
    "margins",
    "slowdown",
    "payload_diagram",
    "allowed_centres",
    "robust_payload",
)

#: How far off the tool's axes loads are looked at [m], and cells of the diagram along either side.
_REACH, _CELLS = 0.3, 41

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
    if front.problem.dynamics.payload.model != "tool_axis":
        yield from _off_centre(front, knee, capacity)


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
