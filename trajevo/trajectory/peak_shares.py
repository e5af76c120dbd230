"""Shares of limits that motions use at their peaks."""

from __future__ import annotations

from trajevo.base.arrays import Array
from trajevo.robot.joints import Sides
from trajevo.trajectory.batch import TrajectoryBatch


def peak_shares(trajectory: TrajectoryBatch, order: int, limits: Sides) -> Array:
    """Greatest share of its limit that a derivative of each joint uses at any instant, shape (B, n_joints).

    Args:
        trajectory: B motions.
        order: 1 velocity, 2 acceleration, 3 jerk.
        limits: limits of the derivative, shape (n_joints,) [rad/s^order or m/s^order].
    """
    if limits.agree:
        shares: Array = trajectory.peak(order) / limits.forward
        return shares
    return limits.share_between(*trajectory.extremes(order))
