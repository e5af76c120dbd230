"""How much floor a motion takes."""

from __future__ import annotations

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.rollout import Rollout
from trajevo.robot.kinematics import ToolKinematics
from trajevo.trajectory.arranged import base_rotations


def footprint(rollout: Rollout) -> Array:
    """Floor area of the smallest rectangle along x and y of the cell that holds an arm's way, shape (B,) [m²].

    It holds the origins of the base, of every joint and of the tool at all samples, as seen from above; how thick the
    links are is not counted.
    """
    arranged, whole = rollout.arranged, ToolKinematics.of(rollout.robot).origins(rollout.q)
    places = whole[..., :2]
    if arranged is not None and arranged.bases is not None and arranged.origin is not None and arranged.tilts:
        rotation = base_rotations(arranged.bases)[:, None, None, :2]
        away = (rotation * (whole - arranged.origin)[..., None, :]).sum(axis=-1)
        places = away + arranged.origin[:2] + arranged.bases[:, None, None, :2]
    elif arranged is not None and arranged.bases is not None and arranged.origin is not None:
        given, bases = arranged.origin[:2], arranged.bases[:, None, None]
        away = places - given
        cosine, sine = np.cos(bases[..., 3]), np.sin(bases[..., 3])
        turned = [cosine * away[..., 0] - sine * away[..., 1], sine * away[..., 0] + cosine * away[..., 1]]
        places = np.stack(turned, axis=-1) + given + bases[..., :2]
    seen = places.reshape(len(places), -1, 2)
    # Without max, which would compare imaginary parts too.
    ends = [np.take_along_axis(seen, at(seen.real, axis=1)[:, None], axis=1)[:, 0] for at in (np.argmin, np.argmax)]
    area: Array = (ends[1] - ends[0]).prod(axis=1)
    return area
