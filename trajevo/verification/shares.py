"""The shares of limits that solutions use, as they are shown: near the truth also where a limit is proven coarsely."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.enclosure import enclose
from trajevo.dynamics.rollout import Rollout
from trajevo.formulation.constraints.clearance import ProvenClearance
from trajevo.formulation.constraints.clearance_gradients import bases_of, missing
from trajevo.formulation.constraints.constraint import Constraint
from trajevo.formulation.constraints.drives.torque_at_speed import ProvenTorque
from trajevo.front.front import Front, Solution
from trajevo.verification.drive_proofs import torque_enclosed

#: How far a shown share may lie above that of the greatest sample.
_TOLERANCE = 0.001

#: Functions of constraints that stop as soon as it is known that a limit is kept.
_PROOFS = (ProvenClearance, ProvenTorque)


def shares_used(solution: Solution) -> dict[str, float]:
    """Share of the limit of every constraint that a solution uses, 1 if it is reached.

    While a search runs, the proof of an effort, tool-speed or clearance limit stops as soon as it is known that the
    limit is kept, so that ``solution.G`` may be far above the true value. Here the proof goes on to 0.1 % of the limit.

    Returns:
        Name of the constraint's column -> share.
    """
    return _shares(solution.front, [solution.index], lambda: solution.rollout)[0]


def shares_of_rows(front: Front, rows: Sequence[int]) -> list[dict[str, float]]:
    """:func:`shares_used` of several rows of a front, in one batch."""
    return _shares(front, rows, lambda: front.problem.rollout(front.X[list(rows)]))


def _shares(front: Front, rows: Sequence[int], moved: Callable[[], Rollout]) -> list[dict[str, float]]:
    excess = front.G[list(rows)].copy()
    if any(_coarse(constraint) for constraint in front.problem.constraints):
        rollout, first = moved(), 0
        for constraint in front.problem.constraints:
            columns = slice(first, first + len(constraint.names))
            if _coarse(constraint):
                excess[:, columns] = np.minimum(excess[:, columns], _near(constraint, rollout))
            first = columns.stop
    names = front.record.constraints
    return [dict(zip(names, (1.0 + values).tolist(), strict=True)) for values in excess]


def _coarse(constraint: Constraint) -> bool:
    """Whether the values of a constraint may be far above the truth."""
    known = constraint.quantity in ("effort", "tool speed") or isinstance(constraint.function, _PROOFS)
    return known and constraint.proof == "pieces"


def _near(constraint: Constraint, rollout: Rollout) -> Array:
    """Values of a coarse constraint near the truth, (B, columns)."""
    if isinstance(constraint.function, ProvenClearance):
        found = constraint.function.closest(rollout.trajectory, bases_of(rollout))
        return np.stack([missing(np.array(one.wanted), one.proven) for one in found], axis=1)
    if isinstance(constraint.function, ProvenTorque):
        return torque_enclosed(rollout, constraint.function.limits, _TOLERANCE)[0] - 1.0
    dof = rollout.robot.dof
    limits = np.full(2 * dof + 1, np.inf)
    if constraint.quantity == "tool speed":
        limits[-1] = constraint.limit
    else:
        limits[:dof] = rollout.robot.limits.sides("effort").lesser * constraint.share
    limited = np.isfinite(limits)
    bound = enclose(rollout, limits, tolerance=_TOLERANCE).bound[:, limited]
    return np.asarray(bound / limits[limited] - 1.0)
