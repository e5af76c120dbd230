"""Proofs that a motion keeps its problem's own constraints, and the names of those about which nothing is proven."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.drives.heat import RESOLVED
from trajevo.dynamics.enclosure import enclose_height
from trajevo.dynamics.rollout import Rollout
from trajevo.formulation.constraints.clearance import ProvenClearance
from trajevo.formulation.constraints.clearance_gradients import bases_of, missing
from trajevo.formulation.constraints.constraint import Constraint
from trajevo.formulation.constraints.drives.heat import OverCycles
from trajevo.formulation.constraints.motion_limits import via_errors
from trajevo.formulation.constraints.tool import HEIGHT_SCALE
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.formulation.segments.limits import OffWays, Tilt
from trajevo.robot.joints import position_unit
from trajevo.verification.certificate import Proof, Uncovered
from trajevo.verification.segment_proofs import add_tilt, add_ways

#: Factor of the problem's number of samples at which constraints are looked at that cannot be proven.
_DENSER = 20

#: How far a proven height may lie below the least height found [m].
_HEIGHT_TOLERANCE = 1e-3

#: Quantities whose rows do not come from the problem's constraints.
_ELSEWHERE = ("tool speed", "torque at speed")

_Rows = list[list[Proof]]


def constraint_proofs(
    problem: TrajectoryProblem, rollout: Rollout
) -> tuple[list[tuple[Proof, ...]], list[tuple[Uncovered, ...]]]:
    """What is proven about the constraints of a problem that are no limits of its robot's joints.

    Args:
        problem: the problem.
        rollout: B motions of it.

    Returns:
        For each motion its proofs, and the constraints about which nothing is proven.
    """
    rows: _Rows = [[] for _ in range(len(rollout.trajectory))]
    # Limits of joints, of the tool's speed and of the torques of drives have rows already.
    left = [c for c in problem.constraints if c.names and not c.of_joints and c.quantity not in _ELSEWHERE]
    for constraint in left:
        at_samples = constraint.at_samples.function
        if isinstance(constraint.function, ProvenClearance):
            _add_clearances(rows, constraint.function, rollout)
        elif isinstance(at_samples, OffWays):
            add_ways(rows, constraint.names, at_samples, rollout)
        elif isinstance(at_samples, Tilt):
            add_tilt(rows, constraint.names[0], at_samples.cone, rollout)
        elif constraint.quantity == "tool height" and isinstance(constraint.limit, float):
            _add_height(rows, constraint, rollout)
        elif constraint.proof != "samples":
            _add_own_proof(rows, constraint, rollout)
    if not any(constraint.quantity == "via error" for constraint in left):
        _add_via_errors(rows, problem, rollout)
    sampled = [c for c in left if c.proof == "samples" and c.quantity not in ("tool height", "tilt")]
    return [tuple(each) for each in rows], _uncovered(sampled, rollout)


def _add_clearances(rows: _Rows, clearance: ProvenClearance, rollout: Rollout) -> None:
    for closest in clearance.closest(rollout.trajectory, bases_of(rollout)):
        wanted = np.array(closest.wanted)
        for k, row in enumerate(rows):
            proven, sampled = float(closest.proven[k]), float(closest.sampled[k])
            share, shown = (1.0 + float(missing(wanted, np.array(d))) for d in (proven, sampled))
            pair = closest.pairs[k]
            row.append(
                Proof(
                    quantity=closest.name,
                    joint=None,
                    unit="m",
                    limit=closest.wanted,
                    bound=proven,
                    exhibited=sampled,
                    instant=float(closest.instant[k]),
                    share=share,
                    exhibited_share=shown,
                    gap=share - shown,
                    full_limit=closest.wanted,
                    least=True,
                    between=(pair.first, pair.second),
                )
            )


def _add_height(rows: _Rows, constraint: Constraint, rollout: Rollout) -> None:
    least = float(constraint.limit)  # type: ignore[arg-type]
    for k, (proven, sampled, instant) in enumerate(
        zip(*enclose_height(rollout, least, tolerance=_HEIGHT_TOLERANCE), strict=True)
    ):
        share, shown = (1.0 + (least - float(height)) / HEIGHT_SCALE for height in (proven, sampled))
        rows[k].append(
            Proof(
                quantity="tool height",
                joint=None,
                unit="m",
                limit=least,
                bound=float(proven),
                exhibited=float(sampled),
                instant=float(instant),
                share=share,
                exhibited_share=shown,
                gap=share - shown,
                full_limit=least,
                least=True,
            )
        )


def _add_own_proof(rows: _Rows, constraint: Constraint, rollout: Rollout) -> None:
    """A constraint whose own values hold at every instant."""
    limits = constraint.limit if isinstance(constraint.limit, tuple) else (constraint.limit,) * len(constraint.names)
    values = 1.0 + constraint.function(rollout)
    for name, limit, shares in zip(constraint.names, limits, values.T, strict=True):
        scale, unit = (1.0, "1") if limit is None or constraint.unit == "1" else (limit, constraint.unit)
        unit = position_unit(rollout.robot) if unit == "rad or m" else unit
        for row, share in zip(rows, shares.tolist(), strict=True):
            row.append(_of_the_motion(name, unit, scale, scale * share))


def _add_via_errors(rows: _Rows, problem: TrajectoryProblem, rollout: Rollout) -> None:
    """How far points are missed, without a limit, if the interpolant does not meet them."""
    errors = via_errors(problem.interpolant, rollout.trajectory)
    if errors.shape[1]:
        for row, most in zip(rows, errors.max(axis=(1, 2)).tolist(), strict=True):
            row.append(_of_the_motion("via error", position_unit(rollout.robot), np.inf, most))


def _of_the_motion(name: str, unit: str, limit: float, value: float) -> Proof:
    """An exact value that belongs to the motion as a whole, not to an instant."""
    return Proof(
        quantity=name,
        joint=None,
        unit=unit,
        limit=limit,
        bound=value,
        exhibited=value,
        instant=float("nan"),
        share=value / limit,
        exhibited_share=value / limit,
        gap=0.0,
        full_limit=limit,
    )


def _uncovered(constraints: Sequence[Constraint], rollout: Rollout) -> list[tuple[Uncovered, ...]]:
    """Constraints at far more samples than the problem's own."""
    found: list[list[Uncovered]] = [[] for _ in range(len(rollout.trajectory))]
    if not constraints:
        return [() for _ in found]
    integrals = [c for c in constraints if isinstance(c.function, OverCycles)]
    for constraint in integrals:
        shares = (1.0 + np.asarray(constraint.function(rollout))).tolist()
        reason = f"an integral over cycles, resolved to {RESOLVED:g}, not proven"
        for each, values in zip(found, shares, strict=True):
            each += [Uncovered(name, reason, share, 0) for name, share in zip(constraint.names, values, strict=True)]
    constraints = [c for c in constraints if c not in integrals]
    dense = replace(rollout, dynamics=rollout.dynamics.sampled(rollout.dynamics.samples * _DENSER))
    count = dense.t.shape[1]
    for constraint in constraints:
        at_samples: Array = 1.0 + np.asarray(constraint.function(dense))
        for each, values in zip(found, at_samples.tolist(), strict=True):
            for name, share in zip(constraint.names, values, strict=True):
                each.append(Uncovered(name, "checked at samples only", share, count))
    return [tuple(each) for each in found]
