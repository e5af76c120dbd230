"""How much floor a motion takes."""

from __future__ import annotations

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.rollout import Rollout
from trajevo.robot.kinematics import ToolKinematics


def footprint(rollout: Rollout) -> Array:
    """Floor area of the smallest rectangle along x and y of the cell that holds an arm's way, shape (B,) [m²].

    It holds the origins of the base, of every joint and of the tool at all samples, as seen from above; how thick the
    links are is not counted.
    """
    places = ToolKinematics.of(rollout.robot).origins(rollout.q)
    placed = None if rollout.arranged is None else rollout.arranged.placements
    if placed is not None:
        rotation, translation = (each[:, None, None] for each in placed)
        places = (rotation * places[..., None, :]).sum(axis=-1) + translation
    seen = places[..., :2].reshape(len(places), -1, 2)
    # Without max, which would compare imaginary parts too.
    ends = [np.take_along_axis(seen, at(seen.real, axis=1)[:, None], axis=1)[:, 0] for at in (np.argmin, np.argmax)]
    area: Array = (ends[1] - ends[0]).prod(axis=1)
    return area
