"""The order in which points are visited and the posture at each of them, in one picture."""

from __future__ import annotations

from typing import Any

import numpy as np

from trajevo.errors import InvalidInputError
from trajevo.front.front import Solution
from trajevo.plots.motion import equal_axes
from trajevo.plots.paper import Width, colour, inches, key, panel
from trajevo.plots.scenery import BaseInCell

#: Symbols of postures, in the order in which they are met.
_SYMBOLS = "osD^v<>P"

#: Distance of a number from its point, as a share of the extent of the path.
_AWAY = 0.045


def visits(motion: Solution, *, samples: int = 400, ax: Any = None, width: Width = "column") -> Any:
    """Path of the tool in 3D [m] with the points by their numbers; symbol and colour of a point are its posture.

    Args:
        motion: a solution of a problem in which postures or the order of points are chosen.
        samples: number of instants drawn.
        ax: axes in space.
        width: ``"column"``, ``"page"`` or millimetres.

    Returns:
        The axes.

    Raises:
        InvalidInputError: no solution, one whose postures and order are given, or a robot without a body.
    """
    found = motion.visits if isinstance(motion, Solution) else None
    if found is None:
        raise InvalidInputError(
            "motion: expected a solution of a problem with postures or an order that are chosen, got "
            f"{'one without' if isinstance(motion, Solution) else type(motion).__name__}"
        )
    rollout = motion.rollout
    rollout.robot.check_body("a picture of the visits")
    trajectory = rollout.trajectory[0]
    standing = BaseInCell.of(rollout)
    path = standing(rollout.robot.tool_poses(trajectory.sample(samples).q[0])[0])
    times = motion.front.problem.via_times(motion.x)[0]
    points = standing(rollout.robot.tool_poses(trajectory.evaluate(times)[0])[0])
    postures = list(dict.fromkeys(found.postures))
    with panel(ax, width=width, height=0.8 * 25.4 * inches(width), space=True) as space:
        space.plot(*path.T, "-", color="0.55", linewidth=0.9, label="tool, from the ring")
        for k, posture in enumerate(postures):
            own = points[[each == posture for each in found.postures]]
            look = {"linestyle": "none", "markersize": 5.0, "label": posture or "joint positions"}
            space.plot(*own.T, _SYMBOLS[k % len(_SYMBOLS)], color=colour(k), **look)
        space.plot(*points[0, :, None], "o", markersize=10.0, markerfacecolor="none", color="0.3", linestyle="none")
        away = _AWAY * float(np.ptp(path, axis=0).max())
        for number, point in zip(found.order, points, strict=True):
            space.text(*(point + away), str(number), fontsize="small")
        equal_axes(space, path)
        key(space)
    return space
