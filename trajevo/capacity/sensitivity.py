"""What a capacity would gain from a greater effort limit or from a slower motion: exact derivatives at its binding."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.capacity.dlcc import SAMPLES, dlcc, sampled_motion
from trajevo.dynamics.path_effort import EffortOfPath
from trajevo.dynamics.payload_masses import mass_bounds
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.front.front import Solution
from trajevo.solvers.gradient.weighted_sum import WeightedOptimum


@final
@dataclass(frozen=True)
class Sensitivity:
    """How the largest payload of a motion changes, to first order and as long as the same joint and instant bind.

    Attributes:
        mass: the capacity [kg].
        joint: name of the binding joint.
        time: instant at which it binds [s].
        per_percent_of_effort: gain for each percent that the effort limit of that joint is raised [kg].
        per_second: gain for each second that the motion, scaled uniformly, takes longer [kg/s]; negative where its
            inertia relieves the joint.
        per_percent_slower: gain for each percent that it takes longer [kg].
    """

    mass: float
    joint: str
    time: float
    per_percent_of_effort: float
    per_second: float
    per_percent_slower: float

    def __str__(self) -> str:
        return (
            f"{self.per_percent_of_effort:+.4g} kg per % of the effort limit of {self.joint}, "
            f"{self.per_second:+.4g} kg per second of slower motion ({self.per_percent_slower:+.4g} kg per %)"
        )


def sensitivity(motion: Solution | Rollout | WeightedOptimum, *, samples: int = SAMPLES) -> Sensitivity:
    """Derivatives of :func:`~trajevo.capacity.dlcc.dlcc` by the binding joint's effort limit and by the duration.

    With τ = τ₀ + m τ₁ = ±limit at the binding joint and instant, dm = (±dlimit - dτ₀ - m dτ₁)/τ₁, where a factor s of
    the duration gives dτ/ds = -(viscous + 2 inertial) at s = 1.

    Args:
        motion: as for :func:`~trajevo.capacity.dlcc.dlcc`.
        samples: likewise.

    Raises:
        InvalidInputError: nothing limits the payload of this motion, or it breaks a limit without any.
    """
    capacity = dlcc(motion, samples=samples)
    if not (np.isfinite(capacity.mass) and capacity.feasible):
        raise InvalidInputError(f"motion: expected one whose capacity a joint sets, got {capacity}")
    rollout = sampled_motion(motion, samples)
    joint = rollout.robot.joint_names.index(capacity.joint)
    limit = float(rollout.robot.limits.effort[joint])
    masses = mass_bounds(rollout.unloaded_effort[0], rollout.effort_per_kilogram[0], rollout.robot.limits.effort)[1]
    instant = int(masses[:, joint].argmin())
    per_kilogram = float(rollout.effort_per_kilogram[0, instant, joint])
    state = (values[0, instant : instant + 1] for values in (rollout.q, rollout.v, rollout.a))
    effort = EffortOfPath.of(rollout, *state)
    by_factor = -(_at(effort.viscous, joint) + 2.0 * _at(effort.carrying(capacity.mass).quadratic, joint))
    per_factor = -by_factor / per_kilogram
    return Sensitivity(
        mass=capacity.mass,
        joint=capacity.joint,
        time=capacity.time,
        per_percent_of_effort=0.01 * limit / abs(per_kilogram),
        per_second=per_factor / float(rollout.trajectory.duration[0]),
        per_percent_slower=0.01 * per_factor,
    )


def _at(values: Array, joint: int) -> float:
    """One joint of one instant."""
    return float(values[0, joint])
