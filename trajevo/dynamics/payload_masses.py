"""The masses that effort limits leave: |τ₀ + m τ₁| <= limit, affine in the payload's mass m, is an interval of m."""

from __future__ import annotations

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.inverse_dynamics import Dynamics

#: Share of the greatest effort per kilogram below which a joint does not feel the payload but rounding.
NEGLIGIBLE = 1e-12


def mass_bounds(unloaded: Array, per_kilogram: Array, limit: Array) -> tuple[Array, Array]:
    """Least and greatest mass from 0 on that each effort limit leaves.

    Args:
        unloaded: effort without payload τ₀, shape (..., n_joints) [N·m or N].
        per_kilogram: what each kilogram adds to it τ₁, the same shape [N·m/kg or N/kg].
        limit: of every joint, shape (n_joints,), may be inf.

    Returns:
        Two arrays of shape (..., n_joints) [kg]. The lower one is above 0 where the limit is broken without payload and
        the payload is a counterweight; where nothing helps it is inf and the upper one -inf.
    """
    felt = np.abs(per_kilogram)
    felt_at_all = felt > NEGLIGIBLE * felt.max(initial=0.0)
    slope = np.where(felt_at_all, felt, 1.0)
    # (limit - τ₀)/τ₁ where the payload pushes up, (limit + τ₀)/(-τ₁) where it pushes down.
    room = limit - np.copysign(unloaded, unloaded * per_kilogram)
    upper = np.where(felt_at_all, room / slope, np.inf)
    broken = np.abs(unloaded) > limit
    relieved = felt_at_all & (unloaded * per_kilogram < 0.0)
    excess = np.where(broken, np.abs(unloaded) - limit, 0.0)
    lower = np.where(broken, np.where(relieved, excess / slope, np.inf), 0.0)
    return lower, np.where(broken & ~relieved, -np.inf, upper)


def masses_held(dynamics: Dynamics, q: Array) -> tuple[float, float]:
    """Least and greatest payload [kg] that a robot can hold at rest in all of some positions, shape (N, n_joints).

    The greatest is inf where no limit is reached; the least exceeds it where no payload can be held.
    """
    still = np.zeros_like(q)
    unloaded, per_kilogram = dynamics.unloaded_effort(q, still, still), dynamics.effort_per_kilogram(q, still, still)
    lower, upper = mass_bounds(unloaded, per_kilogram, dynamics.robot.limits.effort)
    return float(lower.max()), float(upper.min())
