"""Arms with tight limits of effort, through points that may move far: least times of many valleys."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from trajevo import ViaPointProblem, load_robot

DATA = Path(__file__).parents[1] / "data"

#: No limits but those of effort.
_FREE: dict[str, Any] = {"acceleration": np.inf, "jerk": np.inf}

#: Corners of the boxes of time [s] and energy [J] in which hypervolumes are compared.
CORNERS = {"rods": (15.0, 1.2), "three_links": (3.0, 130.0), "ur5": (3.0, 190.0)}


def rods(count: int, limits: str = "sampled", **more: Any) -> ViaPointProblem:
    """Two rods in a plane across gravity, with 1 N·m at each joint and 1 kg at the tip."""
    robot = load_robot(DATA / "rods.urdf", limits=_FREE)
    return _through(robot, [0.0, 0.5], [0.522, 0.5], count, [1.0, 1.5], payload=1.0, limits=limits, **more)


def three_links(count: int, limits: str = "sampled", **more: Any) -> ViaPointProblem:
    """Three links in a vertical plane, with 1 kg at the tip, which they can hardly hold stretched out."""
    robot = load_robot(DATA / "three_links.urdf", limits=_FREE)
    ends = [-0.6, 0.9, -1.2], [1.4, -1.0, 0.8]
    return _through(robot, *ends, count, [1.5, 1.5, 1.5], payload=1.0, limits=limits, **more)


def ur5(count: int, limits: str = "sampled", **more: Any) -> ViaPointProblem:
    """A UR5 with 2 kg and less than half of its efforts."""
    robot = load_robot("ur5", tool="tool0", limits=_FREE | {"effort": [70.0, 70.0, 40.0, 8.0, 8.0, 8.0]})
    ends = [-0.8, -1.2, 1.4, -1.2, -1.5, 0.3], [1.3, -1.6, 1.7, -0.9, -1.8, 1.0]
    return _through(robot, *ends, count, [0.8] * 6, payload=2.0, limits=limits, **more)


def _through(
    robot: Any, first: list[float], last: list[float], count: int, moves: list[float], **more: Any
) -> ViaPointProblem:
    """So many points evenly from the first to the last, the inner ones free by so much [rad]; time and energy."""
    given: dict[str, Any] = {
        "robot": robot,
        "points": np.linspace(first, last, count),
        "interpolant": "cubic",
        "duration_bounds": (0.02, 4.0),
        "moving": [{"point": k, "joints": moves} for k in range(1, count - 1)],
        "objectives": ["time", "energy"],
        "constraints": ["effort"],
        "samples": 8,
    }
    return ViaPointProblem(**given | more)


ARMS = {"rods": rods, "three_links": three_links, "ur5": ur5}
