"""The masses that drives allow at every instant looked at: by the effort limits, peak torque, and torque at speed."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.drives.motors import Motors, MotorStates
from trajevo.dynamics.payload_masses import mass_bounds, masses_within
from trajevo.dynamics.rollout import Rollout

#: How often, and into how many parts, the surroundings of a binding instant are divided.
_ZOOMS, _PARTS = 5, 17

#: Least and greatest masses at states, two arrays (K, n_joints) [kg].
Bounds = Callable[[MotorStates], tuple[Array, Array]]


class MassesOfJoints(NamedTuple):
    """Masses that joints allow [kg], inf and -inf for none, and instants that bind [s], NaN for none; (n_joints,)."""

    least: Array
    most: Array
    time: Array


def causes_at_instants(rollout: Rollout, motors: Motors) -> dict[str, Bounds]:
    """What limits the payload at single instants, by name."""
    sides = rollout.limits.sides("effort")

    def effort(states: MotorStates) -> tuple[Array, Array]:
        return mass_bounds(states.rotor + states.load, states.per_kilogram, sides)

    def between(states: MotorStates, backward: Array, forward: Array) -> tuple[Array, Array]:
        low, high = motors.load_up_to(-backward, states), motors.load_up_to(forward, states)
        return masses_within(states.load, states.per_kilogram, low, high)

    def peak_torque(states: MotorStates) -> tuple[Array, Array]:
        peak = np.broadcast_to(motors.peak, states.load.shape)
        return between(states, peak, peak)

    def torque_at_speed(states: MotorStates) -> tuple[Array, Array]:
        return between(states, *motors.at_speed(states.velocity))

    return {"effort": effort, "peak_torque": peak_torque, "torque_at_speed": torque_at_speed}


def masses_at_instants(rollout: Rollout, states: MotorStates, bounds: Bounds) -> MassesOfJoints:
    """The masses at given instants and, finer, around those that bind.

    Args:
        rollout: the motion.
        states: its states at instants in the order of time.
        bounds: masses at states.
    """
    lower, upper = bounds(states)
    joints = np.arange(lower.shape[1])
    binding = upper.argmin(axis=0)
    most, time = upper[binding, joints], states.times[binding]
    least_at = lower.argmax(axis=0)
    least, time_of_least = lower[least_at, joints], states.times[least_at]
    widest = np.diff(states.times).max()
    width = widest
    for _ in range(_ZOOMS):
        near = _around(rollout, np.concatenate([time, time_of_least]), width)
        # The first half of the instants is around those of the greatest masses, the second around those of the least.
        low, high = (x.reshape(2, len(joints), _PARTS, -1) for x in bounds(near))
        grid = near.times.reshape(2, len(joints), _PARTS)
        upper, lower = high[0, joints, :, joints], low[1, joints, :, joints]
        chosen = upper.argmin(axis=1)
        better = upper[joints, chosen] < most
        most, time = (np.where(better, new[joints, chosen], old) for new, old in ((upper, most), (grid[0], time)))
        chosen = lower.argmax(axis=1)
        better = lower[joints, chosen] > least
        least, time_of_least = (
            np.where(better, new[joints, chosen], old) for new, old in ((lower, least), (grid[1], time_of_least))
        )
        width *= 4.0 / _PARTS
    return MassesOfJoints(least, most, np.where(most < np.inf, time, np.nan))


def _around(rollout: Rollout, instants: Array, width: float) -> MotorStates:
    """States at instants around some (K,), K x parts of them [s]."""
    grid = instants[:, None] + width * np.linspace(-1.0, 1.0, _PARTS)
    return MotorStates.at(rollout, np.clip(grid, 0.0, rollout.trajectory.duration[0]).reshape(-1))
