"""Exact derivatives of a capacity with respect to the binding effort limit and the duration."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.capacity.dlcc import SAMPLES, dlcc_sampled, sampled_motion
from trajevo.capacity.notebook import told_html
from trajevo.dynamics.path_effort import EffortOfPath
from trajevo.dynamics.payload_masses import mass_bounds
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.front.front import Solution
from trajevo.solvers.gradient.weighted_sum import WeightedOptimum


@final
@dataclass(frozen=True)
class Sensitivity:
    """How the largest payload of a motion changes, to first order and while the same joint and instant bind.

    Limits are those that the motion's problem keeps. The instant is one of the sampled ones: between two samples near a
    peak the derivatives differ by as little as the effort.

    Attributes:
        mass: the capacity at the sampled instants [kg], as of :func:`~trajevo.capacity.dlcc.dlcc_sampled`.
        joint: name of the binding joint.
        time: instant at which it binds [s].
        per_percent_of_effort: gain for each percent by which the effort limit of this joint is raised [kg].
        per_second: gain for each second by which the motion, scaled uniformly, takes longer [kg/s]; negative if its
            inertia relieves the joint.
        per_percent_slower: gain for each percent by which the motion takes longer [kg].
    """

    mass: float
    joint: str
    time: float
    per_percent_of_effort: float
    per_second: float
    per_percent_slower: float

    def _repr_html_(self) -> str:
        return told_html("Sensitivity of the largest payload", self)

    def __str__(self) -> str:
        return (
            f"{self.per_percent_of_effort:+.4g} kg per % of the effort limit of {self.joint}, "
            f"{self.per_second:+.4g} kg per second of slower motion ({self.per_percent_slower:+.4g} kg per %)"
        )


def sensitivity(motion: Solution | Rollout | WeightedOptimum, *, samples: int = SAMPLES) -> Sensitivity:
    """Derivatives of :func:`~trajevo.capacity.dlcc.dlcc_sampled` with respect to binding effort limit and duration.

    From τ = τ₀ + m τ₁ = ±limit at the binding joint and instant follows dm = (±dlimit - dτ₀ - m dτ₁)/τ₁. If the
    duration is scaled by s, dτ/ds = -(viscous + 2 inertial) at s = 1.

    Args:
        motion: as for :func:`~trajevo.capacity.dlcc.dlcc`.
        samples: as for :func:`~trajevo.capacity.dlcc.dlcc_sampled`.

    Raises:
        InvalidInputError: nothing limits the payload of this motion, or the motion breaks a limit without payload.
    """
    capacity = dlcc_sampled(motion, samples=samples)
    if not (np.isfinite(capacity.mass) and capacity.feasible):
        raise InvalidInputError(f"motion: expected one whose capacity a joint sets, got {capacity}")
    rollout = sampled_motion(motion, samples)
    joint = rollout.robot.joint_names.index(capacity.joint)
    sides = rollout.limits.sides("effort")
    masses = mass_bounds(rollout.unloaded_effort[0], rollout.effort_per_kilogram[0], sides)[1]
    instant = int(masses[:, joint].argmin())
    per_kilogram = float(rollout.effort_per_kilogram[0, instant, joint])
    limit = float(sides.toward(rollout.effort_per_kilogram[0, instant])[joint])
    here = slice(instant, instant + 1)
    q, v, a = (values[0, here] for values in (rollout.q, rollout.v, rollout.a))
    effort = EffortOfPath.of(rollout, q, v, a, rollout.segments[here])
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
    """The value of one joint at a single instant."""
    return float(values[0, joint])
