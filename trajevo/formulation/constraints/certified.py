"""Constraints that are at most 0 only if the limit is proven at every instant, not only at samples.

For positions, velocities, accelerations, jerks and clearances this holds anyway, by exact extremes or guaranteed
bounds. For effort and tool speed it does not: if the samples of a motion keep the limit, these constraints use the
bounds from :func:`trajevo.dynamics.enclosure.decide`, which subdivides the motion only as far as the decision needs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.dynamics.enclosure import decide
from trajevo.dynamics.piece_bounds import PieceBounds, Pieces
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import checked_name
from trajevo.formulation.constraints.constraint import Constraint
from trajevo.robot.joints import Sides
from trajevo.robot.kinematics import ToolKinematics
from trajevo.trajectory.bernstein import gauss, local_greatest

#: Where effort and tool speed keep their limits: at the samples, or proven at every instant.
HOLDS = ("sampled", "certified")

#: Number of nodes of each piece in the proof, and of each segment for the peaks that gradient solvers see.
DECIDING, _NODES = 10, 8
#: Share of the limit that is added to these peaks: twice the violation that gradient solvers tolerate.
RETREAT = 2e-6
#: Upper limit of the excess of undecided motions, whose bounds may be far beyond the limit.
MOST_EXCESS = 1.0


def held(constraints: Sequence[Constraint], limits: str) -> tuple[Constraint, ...]:
    """Constraints with effort and tool-speed limits at the samples or proven at every instant.

    Args:
        constraints: any constraints; only limits of efforts, tool speeds and the torques of drives are changed.
        limits: ``"sampled"`` or ``"certified"``.

    Raises:
        UnknownNameError: another value of ``limits``.
    """
    checked_name("limits", limits, HOLDS)
    return tuple(constraints) if limits == "sampled" else tuple(certified(constraint) for constraint in constraints)


def certified(constraint: Constraint) -> Constraint:
    """An effort or tool-speed limit that is at most 0 only if the limit is proven; those without a proof unchanged.

    The names of the columns stay the same. For a motion that breaks the limit at a sample, all columns have their
    values from the samples: the motion is infeasible in any case. For any other motion, a column is the proven upper
    bound divided by the limit, minus 1. If the motion is found to break the limit between samples, a column is the
    greatest value found, divided by the limit, minus 1. If neither can be shown, at least one column is above 0. The
    derivative is that of the peaks, which are also the terms for gradient solvers.
    """
    if constraint.sampled is not None or not constraint.names:
        return constraint
    if constraint.provable is not None:
        return constraint.provable(constraint)
    if constraint.quantity not in ("effort", "tool speed"):
        return constraint
    proof = _Proof(constraint)
    return replace(constraint, function=proof, terms=proof.terms, sampled=constraint, proof="pieces")


@final
@dataclass(frozen=True, eq=False)
class _Proof:
    """Excess of efforts or tool speed over their limits, as a share of the limit."""

    sampled: Constraint

    __repr__ = brief

    def __call__(self, rollout: Rollout) -> Array:
        return proven_excess(self.sampled.function(rollout), rollout, self._decided, self.terms)

    def terms(self, rollout: Rollout) -> Array:
        """Peaks over the limit, minus 1, plus a small retreat, (B, segments x signs x columns)."""
        if self._of_tool:
            peaks = _speed_peaks(rollout)
        else:
            peaks = _effort_peaks(rollout, np.flatnonzero(rollout.robot.limits.sides("effort").limited))
        limits = self._limits(rollout)
        kept: Array = limits.forward[limits.limited] if limits.agree else limits[limits.limited].both
        excess: Array = peaks / kept - 1.0 + RETREAT
        return excess.reshape(len(excess), -1)

    def _decided(self, rollout: Rollout, asked: Array) -> Array:
        """Excess of the motions that are to be decided, shape (B, columns)."""
        pieces, bounds, limits = Pieces.of(rollout, DECIDING), PieceBounds.of(rollout), self._limits(rollout).lesser
        over = bounds.tool_speed if self._of_tool else bounds.efforts
        found = decide(over, pieces.rows(asked[pieces.owner]), limits, motions=len(asked))
        limited = np.isfinite(limits)
        return np.minimum(found[:, limited] / limits[limited] - 1.0, MOST_EXCESS)

    def _limits(self, rollout: Rollout) -> Sides:
        """Limit of the tool speed, or of the effort of every joint; inf for none."""
        if self._of_tool:
            return Sides.of(np.array([self.sampled.limit]))
        return rollout.robot.limits.sides("effort").times(np.asarray(self.sampled.share))

    @property
    def _of_tool(self) -> bool:
        return self.sampled.quantity == "tool speed"


def proven_excess(
    values: Array,
    rollout: Rollout,
    decided: Callable[[Rollout, Array], Array],
    terms: Callable[[Rollout], Array],
) -> Array:
    """Excess of a limit from its proof where the samples keep it, and from the samples elsewhere, shape (B, columns).

    Args:
        values: excess at the samples, shape (B, columns).
        rollout: B motions.
        decided: rollout and a mask (B,) of the motions that are to be decided -> excess (B, columns).
        terms: rollout -> the smooth terms whose greatest the columns are, for their derivatives.
    """
    kept = np.asarray((values.real <= 0.0).all(axis=1))
    if not kept.any():
        return values
    # A batch of complex steps holds a motion per variable with the same real part, which is decided once.
    first = _first_of_equals(rollout) if np.iscomplexobj(values) else np.full(len(kept), True)
    excess = decided(rollout, kept & first)[np.flatnonzero(first)[np.cumsum(first) - 1]]
    excess = np.maximum(excess, values.real)  # no column is below the samples, also where a violation was found
    if np.iscomplexobj(values):
        each = terms(rollout).reshape(len(values), -1, values.shape[1])
        steepest = np.take_along_axis(each, each.real.argmax(axis=1)[:, None], axis=1)[:, 0]
        excess = excess + 1j * steepest.imag
    return np.where(kept[:, None], excess, values)


def peaks_between(rollout: Rollout, of: Callable[[Array], Array]) -> Array:
    """Greatest value in every segment, sought between nodes, of a function of positions (B, T, n_joints) -> (B, T)."""
    q = rollout.trajectory.at_shares(gauss(_NODES)[0], 0)
    return _peaks(_per_segment(of(q)[..., None]))[..., 0]


def _first_of_equals(rollout: Rollout) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Whether the real part of each motion differs from that of the previous one, shape (B,)."""
    motion = np.concatenate([rollout.t[..., None], rollout.q, rollout.v, rollout.a], axis=-1).real
    changed = (motion[1:] != motion[:-1]).any(axis=(1, 2))
    if rollout.masses is not None:
        changed |= rollout.masses.real[1:] != rollout.masses.real[:-1]
    if rollout.dynamics.gravity is not None:
        gravity = rollout.dynamics.gravity.real
        changed |= (gravity[1:] != gravity[:-1]).any(axis=1)
    return np.concatenate([[True], changed])


def _effort_peaks(rollout: Rollout, joints: Array) -> Array:
    """Greatest effort of chosen joints in every segment, either way, (B, segments, 2, joints) [N·m or N].

    The effort of a joint with dry friction jumps where the joint reverses; there the greatest at the nodes is taken.
    """
    q, v, a = (rollout.trajectory.at_shares(gauss(_NODES)[0], order) for order in range(3))
    effort = _per_segment(rollout.effort_at_shares(q, v, a)[..., joints])
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
    """Greatest value of each polynomial through the values at the nodes, (..., nodes) -> (...)."""
    rows = values.reshape(-1, values.shape[-1])
    return local_greatest(rows, np.arange(len(rows))).reshape(values.shape[:-1])
