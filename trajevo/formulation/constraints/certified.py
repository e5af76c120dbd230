"""Limits that are at most 0 only where it is proven that they are kept at every instant, not at samples alone.

Positions, velocities, accelerations, jerks and clearances are so limited anyway, by exact extremes or guaranteed
bounds. Effort and the tool's speed are not: of a motion whose samples keep the limit these constraints take what
:func:`trajevo.dynamics.enclosure.decide` proves, cut only as far as it takes to tell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.enclosure import decide
from trajevo.dynamics.piece_bounds import PieceBounds, Pieces
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import checked_name
from trajevo.formulation.constraints.constraint import Constraint
from trajevo.robot.kinematics import ToolKinematics
from trajevo.trajectory.bernstein import gauss, local_greatest

#: How effort and the tool's speed are held to their limits: at the samples, or proven at every instant.
HOLDS = ("sampled", "certified")

#: Nodes of a piece on which it is decided, and of every segment from which gradient solvers are told its peaks.
_DECIDING, _NODES = 10, 8
#: By how much of a limit they are told that it is exceeded: twice what they may leave it exceeded by.
_RETREAT = 2e-6
#: What the excess of motions that are not decided, and whose bounds are far beyond the limit, is taken for.
_MOST_EXCESS = 1.0


def held(constraints: Sequence[Constraint], limits: str) -> tuple[Constraint, ...]:
    """Constraints with their effort and tool-speed limits held as asked for.

    Args:
        constraints: any; those that hold between samples already, and those that nothing is proven of, stay.
        limits: ``"sampled"`` or ``"certified"``.

    Raises:
        UnknownNameError: another value of ``limits``.
    """
    checked_name("limits", limits, HOLDS)
    return tuple(constraints) if limits == "sampled" else tuple(certified(constraint) for constraint in constraints)


def certified(constraint: Constraint) -> Constraint:
    """An effort or tool-speed limit that is at most 0 only where it is proven to be kept; another limit as it is.

    The name stays. A motion that breaks a limit at a sample is told as it is by the samples, in all columns: it is
    infeasible whatever else could be proven. Of the others a column is what is proven not to be exceeded over the
    limit, minus 1; where a limit is found to be broken, the greatest value found; where neither can be shown, more
    than 0. The derivative is that of the peaks, which are also what gradient solvers are given as terms.
    """
    if constraint.sampled is not None or constraint.quantity not in ("effort", "tool speed") or not constraint.names:
        return constraint
    proof = _Proof(constraint)
    return replace(constraint, function=proof, terms=proof.terms, sampled=constraint, proof="pieces")


@final
@dataclass(frozen=True, eq=False)
class _Proof:
    """The excess of efforts or of the tool's speed."""

    sampled: Constraint

    def __call__(self, rollout: Rollout) -> Array:
        values = self.sampled.function(rollout)
        kept = np.asarray((values.real <= 0.0).all(axis=1))
        if not kept.any():
            return values
        # Complex motions come once for every variable, with the same real part: it is decided once.
        first = _first_of_equals(rollout) if np.iscomplexobj(values) else np.full(len(kept), True)
        excess = self._decided(rollout, kept & first)[np.flatnonzero(first)[np.cumsum(first) - 1]]
        excess = np.maximum(excess, values.real)  # where a break is found, other columns tell no less than the samples
        if np.iscomplexobj(values):
            terms = self.terms(rollout).reshape(len(values), -1, values.shape[1])
            steepest = np.take_along_axis(terms, terms.real.argmax(axis=1)[:, None], axis=1)[:, 0]
            excess = excess + 1j * steepest.imag
        return np.where(kept[:, None], excess, values)

    def terms(self, rollout: Rollout) -> Array:
        """The peaks over the limit, minus 1, all but for a retreat, (B, segments x signs x columns)."""
        if self._of_tool:
            peaks = _speed_peaks(rollout)
        else:
            peaks = _effort_peaks(rollout, np.flatnonzero(np.isfinite(rollout.robot.limits.effort)))
        limits = self._limits(rollout)
        excess: Array = peaks / limits[np.isfinite(limits)] - 1.0 + _RETREAT
        return excess.reshape(len(excess), -1)

    def _decided(self, rollout: Rollout, asked: Array) -> Array:
        """The excess of the motions asked for, shape (B, columns)."""
        pieces, bounds, limits = Pieces.of(rollout, _DECIDING), PieceBounds.of(rollout), self._limits(rollout)
        over = bounds.tool_speed if self._of_tool else bounds.efforts
        found = decide(over, pieces.rows(asked[pieces.owner]), limits, motions=len(asked))
        limited = np.isfinite(limits)
        return np.minimum(found[:, limited] / limits[limited] - 1.0, _MOST_EXCESS)

    def _limits(self, rollout: Rollout) -> Array:
        """What the tool, or every joint, is held to; inf where nothing is."""
        if self._of_tool:
            return np.array([self.sampled.limit])
        return np.asarray(rollout.robot.limits.effort * self.sampled.share)

    @property
    def _of_tool(self) -> bool:
        return self.sampled.quantity == "tool speed"


def _first_of_equals(rollout: Rollout) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Motions whose real part is not that of the one before, shape (B,)."""
    motion = np.concatenate([rollout.t[..., None], rollout.q, rollout.v, rollout.a], axis=-1).real
    changed = (motion[1:] != motion[:-1]).any(axis=(1, 2))
    if rollout.masses is not None:
        changed |= rollout.masses.real[1:] != rollout.masses.real[:-1]
    return np.concatenate([[True], changed])


def _effort_peaks(rollout: Rollout, joints: Array) -> Array:
    """Greatest effort and greatest against it in every segment, of chosen joints, (B, segments, 2, joints) [N·m or N].

    Where a joint with dry friction turns back its effort jumps, and the greatest at the nodes is taken.
    """
    q, v, a = (rollout.trajectory.at_shares(gauss(_NODES)[0], order) for order in range(3))
    effort = _per_segment(rollout.effort_in(q, v, a)[..., joints])
    peaks = _peaks(np.stack([effort, -effort], axis=2))
    friction = rollout.robot.friction
    dry = np.asarray(friction.coulomb + friction.coulomb_backward)[joints] > 0.0
    speed = np.sign(_per_segment(rollout.without_rounding(v)[..., joints]).real)
    turns = dry & (speed.min(axis=-1) != speed.max(axis=-1))
    at_nodes = np.stack([_greatest(effort), _greatest(-effort)], axis=2)
    return np.where(turns[:, :, None], at_nodes, peaks)


def _speed_peaks(rollout: Rollout) -> Array:
    """Greatest speed of the tool in every segment, (B, segments, 1) [m/s]."""
    q, v = (rollout.trajectory.at_shares(gauss(_NODES)[0], order) for order in range(2))
    velocity = ToolKinematics.of(rollout.robot).twist(q, v)[..., :3]
    squared = _peaks(_per_segment((velocity * velocity).sum(axis=-1)[..., None]))
    return np.sqrt(np.where(squared.real > 0.0, squared, 0.0))


def _per_segment(values: Array) -> Array:
    """Values (B, segments x nodes, columns) as (B, segments, columns, nodes)."""
    return np.swapaxes(values.reshape(len(values), -1, _NODES, values.shape[-1]), 2, 3)


def _greatest(values: Array) -> Array:
    """The value with the greatest real part along the last axis."""
    return np.take_along_axis(values, values.real.argmax(axis=-1)[..., None], axis=-1)[..., 0]


def _peaks(values: Array) -> Array:
    """Greatest value of every polynomial through values at the nodes, (..., nodes) -> (...)."""
    rows = values.reshape(-1, values.shape[-1])
    return local_greatest(rows, np.arange(len(rows))).reshape(values.shape[:-1])
