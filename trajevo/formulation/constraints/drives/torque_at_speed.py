"""What motors can give at their speeds: peak torques and torque-speed lines, with the losses of gears.

Between samples the limit is proven as that of effort is, see :mod:`trajevo.formulation.constraints.certified`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.dynamics.drives.torque_limits import AskedTorque, TorqueLimits
from trajevo.dynamics.enclosure import decide
from trajevo.dynamics.piece_bounds import PieceBounds, Pieces
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.formulation.constraints.certified import DECIDING, MOST_EXCESS, RETREAT, proven_excess
from trajevo.formulation.constraints.constraint import Constraint, LimitKind
from trajevo.robot.robot import Robot
from trajevo.trajectory.bernstein import gauss, local_greatest

#: The quantity, as certificates name it.
QUANTITY = "torque at speed"

#: Nodes of every segment for the peaks that gradient solvers see.
_NODES = 8


def torque_at_speed_limits(robot: Robot) -> Constraint:
    """What every motor is asked for less what it can give at its speed, over its greatest torque.

    Raises:
        InvalidInputError: a robot without masses, or without drives that tell a peak torque or a torque-speed line.
    """
    robot.check_masses("a limit of torque at speed")
    limits = TorqueLimits.of(robot)
    if not len(limits.joints):
        raise InvalidInputError(
            "constraints: 'torque_at_speed' needs peak_torque or torque_speed of a drive, but robot "
            f"{robot.name!r} has {'none' if robot.drives else 'no drives'}"
        )
    return Constraint(
        tuple(f"{QUANTITY} of {robot.joint_names[k]}" for k in limits.joints),
        robot.reference,
        partial(_excess, limits=limits),
        partial(_at_samples, limits=limits),
        quantity=QUANTITY,
        provable=partial(_proven, limits=limits),
    )


@final
@dataclass(frozen=True, eq=False)
class ProvenTorque:
    """The excess at every instant.

    Attributes:
        limits: what the motors can give.
        sampled: the constraint at samples.
    """

    limits: TorqueLimits
    sampled: Constraint

    __repr__ = brief

    def __call__(self, rollout: Rollout) -> Array:
        """The excess, shape (B, motors) [1]."""
        return proven_excess(self.sampled.function(rollout), rollout, self._decided, self.terms)

    def terms(self, rollout: Rollout) -> Array:
        """Peaks of the excess in every segment, plus a small retreat, (B, segments x lines x motors).

        Where a joint and its load keep their directions, and for lines that are the least of their sections, they are
        peaks of polynomials, one for every section. Elsewhere they are the greatest at nodes.
        """
        limits, trajectory = self.limits, rollout.trajectory
        q, v, a = (trajectory.at_shares(gauss(_NODES)[0], order) for order in range(3))
        asked = limits.asked(rollout.effort_at_shares(q, v, a), rollout.without_rounding(v), a)
        greatest = _greatest(_per_segment(limits.excess(asked)[:2]))
        keeps = _keeps(_per_segment(asked.velocity)) & limits.bends_down
        if limits.lossy:
            keeps &= _keeps(_per_segment(asked.load))
        found = []
        for k in range(limits.offsets.shape[1]):
            # A section that a joint does not have says nothing.
            peaks = np.where(np.isinf(limits.begins[:, k]) & (k > 0), greatest, self._peaks(asked, k))
            found.append(np.where(keeps, peaks, greatest))
        ordered = np.moveaxis(np.stack(found), (2, 3), (0, 1))
        if np.isfinite(limits.fastest).any():
            faster = trajectory.segment_peaks(1)[..., limits.joints] / limits.fastest - 1.0
            shape = (*ordered.shape[:2], -1, ordered.shape[-1])
            ordered = np.concatenate([ordered.reshape(shape), faster[:, :, None]], axis=2)
        return ordered.reshape(len(ordered), -1) + RETREAT

    def _peaks(self, asked: AskedTorque, section: int) -> Array:
        """Peaks of what is asked less one section's line, over the greatest torque, (2, B, segments, motors)."""
        limits = self.limits
        offset, slope = limits.offsets[:, section], limits.slopes[:, section]
        both = np.stack([sign * asked.torque - offset - slope * sign * asked.velocity for sign in (1.0, -1.0)])
        values = np.moveaxis(_per_segment(both / limits.greatest), -2, -1)
        rows = values.reshape(-1, _NODES)
        return local_greatest(rows, np.arange(len(rows))).reshape(values.shape[:-1])

    def _decided(self, rollout: Rollout, asked: Array) -> Array:
        """Excess of the motions that are to be decided, shape (B, motors)."""
        bounds, pieces = PieceBounds.of(rollout), Pieces.of(rollout, DECIDING)
        ones = np.ones(len(self.limits.joints))
        found = decide(partial(self.limits.over, bounds), pieces.rows(asked[pieces.owner]), ones, motions=len(asked))
        return np.minimum(found - 1.0, MOST_EXCESS)


def _proven(constraint: Constraint, *, limits: TorqueLimits) -> Constraint:
    """The same limit, proven between samples."""
    proof = ProvenTorque(limits, constraint)
    return replace(constraint, function=proof, terms=proof.terms, sampled=constraint, proof="pieces", provable=None)


def _sampled(rollout: Rollout, limits: TorqueLimits) -> Array:
    """Excess at the samples, (3, B, T, motors)."""
    return limits.excess(limits.asked(rollout.effort, rollout.without_rounding(rollout.v), rollout.a))


def _excess(rollout: Rollout, *, limits: TorqueLimits) -> Array:
    excess = np.moveaxis(_sampled(rollout, limits), 0, 2)
    return _greatest(excess.reshape(len(excess), 1, -1, excess.shape[-1])[:, 0])


def _at_samples(rollout: Rollout, *, limits: TorqueLimits) -> Array:
    found = _sampled(rollout, limits)
    kept = found if np.isfinite(limits.fastest).any() else found[:2]
    ordered = np.moveaxis(kept, 0, 2)
    return ordered.reshape(len(ordered), -1)


def _per_segment(values: Array) -> Array:
    """Values (..., segments x nodes, motors) as (..., segments, nodes, motors)."""
    return values.reshape(*values.shape[:-2], -1, _NODES, values.shape[-1])


def _greatest(values: Array) -> Array:
    """The value with the greatest real part along the last axis but one."""
    if not np.iscomplexobj(values):
        greatest: Array = values.max(axis=-2)
        return greatest
    return np.take_along_axis(values, values.real.argmax(axis=-2)[..., None, :], axis=-2)[..., 0, :]


def _keeps(values: Array) -> Array:
    """Whether values (..., nodes, motors) keep their sign."""
    signs = np.sign(values.real)
    return np.asarray(signs.min(axis=-2) == signs.max(axis=-2))


TORQUE_AT_SPEED = LimitKind(
    "torque_at_speed",
    "what motors can give at their speeds: peak torques and torque-speed lines, gear losses included",
    lambda limited: torque_at_speed_limits(limited.robot),
)
