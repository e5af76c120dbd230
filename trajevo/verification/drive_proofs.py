"""Proofs that motors give what a motion asks of them at every instant: their peak torques and torque-speed lines."""

from __future__ import annotations

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.drives.torque_limits import TorqueLimits
from trajevo.dynamics.enclosure import enclose_part
from trajevo.dynamics.rollout import Rollout
from trajevo.verification.certificate import Proof


def drive_proofs(rollout: Rollout, tolerance: float) -> list[tuple[Proof, ...]]:
    """What is proven about the motors' torques at their speeds, for each motion.

    Args:
        rollout: B motions.
        tolerance: share of the greatest torque by which bounds may lie above what is exhibited.
    """
    robot = rollout.robot
    limits = TorqueLimits.of(robot) if robot.drives and robot.gives_effort else None
    if limits is None or not len(limits.joints):
        return [()] * len(rollout.trajectory)
    names = [robot.joint_names[k] for k in limits.joints]
    proven = torque_enclosed(rollout, limits, tolerance)
    return [tuple(map(_proof, names, *columns)) for columns in zip(*(x.tolist() for x in proven), strict=True)]


def torque_enclosed(rollout: Rollout, limits: TorqueLimits, tolerance: float) -> tuple[Array, Array, Array]:
    """1 plus the excess of the torques at all instants: upper bounds, greatest samples, their instants, (B, motors)."""
    segments = np.arange(rollout.trajectory.breaks.shape[1] - 1)
    found: tuple[Array, Array, Array] = enclose_part(
        rollout, limits.over, segments, np.ones(len(limits.joints)), tolerance=tolerance
    )
    return found


def _proof(joint: str, bound: float, exhibited: float, instant: float) -> Proof:
    return Proof(
        quantity="torque at speed",
        joint=joint,
        unit="1",
        limit=1.0,
        bound=bound,
        exhibited=exhibited,
        instant=instant,
        share=bound,
        exhibited_share=exhibited,
        gap=max(bound - exhibited, 0.0),
        full_limit=1.0,
    )
