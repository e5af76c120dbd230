"""Where a derivative of a motion is infinite, since the one below it jumps at a break between two segments."""

from __future__ import annotations

import numpy as np

from trajevo.base.arrays import Array
from trajevo.trajectory.batch import TrajectoryBatch

#: Share of the greatest magnitude above which a difference at a break is a jump, and what rounding of positions may
#: make, as a share of the greatest one over a power of the shortest segment.
_JUMP, _ROUNDING = 1e-6, 1e-11


def infinite(trajectory: TrajectoryBatch, order: int) -> tuple[Array, Array]:
    """Joints for which a derivative is infinite at a break, and when.

    Args:
        trajectory: the motions.
        order: of the derivative, from 1 to 3.

    Returns:
        Mask (B, n_joints), and the instant of the greatest jump of the derivative below, (B, n_joints) [s].
    """
    jump = np.abs(trajectory.jump(order - 1))
    if not jump.shape[1]:
        none = np.zeros((len(trajectory), trajectory.n_joints))
        return none.astype(bool), none
    worst = jump.argmax(axis=1)
    instants = np.take_along_axis(trajectory.breaks[:, 1:-1], worst, axis=1)
    shortest = trajectory.segment_durations.min(axis=1)[:, None] ** (order - 1)
    least = _JUMP * trajectory.peak(order - 1) + _ROUNDING * trajectory.peak(0).max(axis=1, keepdims=True) / shortest
    return jump.max(axis=1) > least, instants
