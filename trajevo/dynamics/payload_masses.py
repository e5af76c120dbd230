"""Payload masses that effort limits allow.

The effort τ₀ + m τ₁ is affine in the mass m, so that |τ₀ + m τ₁| <= limit holds on an interval of m.
"""

from __future__ import annotations

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.robot.joints import Sides

#: Share of the greatest effort per kilogram below which the effort per kilogram of a joint is mere rounding.
NEGLIGIBLE = 1e-12


def mass_bounds(unloaded: Array, per_kilogram: Array, limit: Array | Sides) -> tuple[Array, Array]:
    """Least and greatest mass, 0 or more, that each effort limit allows.

    Args:
        unloaded: effort without payload τ₀, shape (..., n_joints) [N·m or N].
        per_kilogram: effort τ₁ that each kilogram adds, the same shape [N·m/kg or N/kg].
        limit: effort limit of every joint, of both directions or of each, may be inf, shape (n_joints,) [N·m or N].

    Returns:
        Two arrays of shape (..., n_joints) [kg]. The lower one is above 0 where the limit is broken without payload and
        the payload is a counterweight. Where no mass keeps the limit, the lower one is inf and the upper one -inf.
    """
    felt = np.abs(per_kilogram)
    felt_at_all = felt > NEGLIGIBLE * felt.max(initial=0.0)
    slope = np.where(felt_at_all, felt, 1.0)
    sides = Sides.of(limit)
    # (limit - τ₀)/τ₁ where the payload pushes up, (limit + τ₀)/(-τ₁) where it pushes down.
    room = sides.toward(per_kilogram) - np.copysign(unloaded, unloaded * per_kilogram)
    upper = np.where(felt_at_all, room / slope, np.inf)
    own = sides.toward(unloaded)
    broken = np.abs(unloaded) > own
    relieved = felt_at_all & (unloaded * per_kilogram < 0.0)
    excess = np.where(broken, np.abs(unloaded) - own, 0.0)
    lower = np.where(broken, np.where(relieved, excess / slope, np.inf), 0.0)
    return lower, np.where(broken & ~relieved, -np.inf, upper)


def masses_within(unloaded: Array, per_kilogram: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """Least and greatest mass, 0 or more, with which efforts stay between two ends that may differ at every instant.

    Args:
        unloaded: effort without payload τ₀, shape (..., n_joints) [N·m or N].
        per_kilogram: effort τ₁ that each kilogram adds, the same shape [N·m/kg or N/kg].
        low: least efforts, the same shape, -inf for none [N·m or N].
        high: greatest efforts, the same shape, inf for none and -inf where none is allowed [N·m or N].

    Returns:
        As :func:`mass_bounds`; the greatest mass is below 0 where only less than nothing would help.
    """
    felt = np.abs(per_kilogram)
    felt_at_all = felt > NEGLIGIBLE * felt.max(initial=0.0)
    slope = np.where(felt_at_all, per_kilogram, 1.0)
    to_low, to_high = (low - unloaded) / slope, (high - unloaded) / slope
    kept = (low <= unloaded) & (unloaded <= high)
    lower = np.where(slope > 0.0, to_low, to_high)
    upper = np.where(slope > 0.0, to_high, to_low)
    possible = lower <= upper
    lower = np.where(felt_at_all & possible, np.maximum(lower, 0.0), np.where(kept, 0.0, np.inf))
    return lower, np.where(felt_at_all & possible, upper, np.where(kept, np.inf, -np.inf))


def masses_held(dynamics: Dynamics, q: Array, segments: Array | None = None) -> tuple[float, float]:
    """Least and greatest payload [kg] that a robot can hold at rest in all given positions.

    The greatest is inf where no limit is reached; the least exceeds it where no payload can be held.

    Args:
        dynamics: dynamics of the robot, whose payload gives shape and model.
        q: positions, shape (N, n_joints) [rad or m].
        segments: segments of the motion in which they lie, shape (N,), where loads change on the way.
    """
    still = np.zeros_like(q)
    unloaded = dynamics.unloaded_effort(q, still, still, segments)
    per_kilogram = dynamics.effort_per_kilogram(q, still, still, segments)
    lower, upper = mass_bounds(unloaded, per_kilogram, dynamics.robot.limits.sides("effort"))
    return float(lower.max()), float(upper.min())
