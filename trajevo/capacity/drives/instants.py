"""The masses that drives allow at every instant looked at: by the effort limits, peak torque, and torque at speed."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple, Protocol, TypeVar

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.drives.motors import Motors, MotorStates
from trajevo.dynamics.payload_masses import mass_bounds, masses_within
from trajevo.dynamics.rollout import Rollout

#: How often, and into how many parts, the surroundings of a binding instant are divided.
_ZOOMS, _PARTS = 3, 65

#: What else may bind between samples: what is within this share of the least mass at them.
_NEARLY = 0.05


class Timed(Protocol):
    """States that know their instants."""

    @property
    def times(self) -> Array:
        """Instants, shape (K,) [s]."""


_States = TypeVar("_States", bound=Timed)

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


def masses_at_instants(
    rollout: Rollout,
    states: _States,
    bounds: Callable[[_States], tuple[Array, Array]],
    at: Callable[[Rollout, Array], _States],
    together: Iterable[slice] = (),
) -> MassesOfJoints:
    """The masses at given instants and, finer, around those that bind.

    Args:
        rollout: the motion.
        states: its states at instants in the order of time.
        bounds: masses at states, two arrays (K, n_joints), or with another column for each thing that binds [kg].
        at: states at instants (K,) [s] in any order.
        together: columns of which the one that binds alone counts, so that others are not searched finer.
    """
    lower, upper = bounds(states)
    every = np.arange(lower.shape[1])
    binding, least_at = upper.argmin(axis=0), lower.argmax(axis=0)
    most, time = upper[binding, every], states.times[binding]
    least, time_of_least = lower[least_at, every], states.times[least_at]
    joints = np.flatnonzero(_searched(most, least, together))
    columns = np.arange(len(joints))
    width = np.diff(states.times).max()
    for _ in range(_ZOOMS):
        near = at(rollout, _around(rollout, np.concatenate([time[joints], time_of_least[joints]]), width))
        low, high = (x.reshape(2, len(joints), _PARTS, -1) for x in bounds(near))
        grid = near.times.reshape(2, len(joints), _PARTS)
        low, high = low[1, columns, :, joints], high[0, columns, :, joints]
        chosen = columns, high.argmin(axis=1)
        better = high[chosen] < most[joints]
        most[joints], time[joints] = (
            np.where(better, new, old) for new, old in ((high[chosen], most[joints]), (grid[0][chosen], time[joints]))
        )
        chosen = columns, low.argmax(axis=1)
        better = low[chosen] > least[joints]
        least[joints], time_of_least[joints] = (
            np.where(better, new, old)
            for new, old in ((low[chosen], least[joints]), (grid[1][chosen], time_of_least[joints]))
        )
        width *= 4.0 / _PARTS
    return MassesOfJoints(least, most, np.where(most < np.inf, time, np.nan))


def _searched(most: Array, least: Array, together: Iterable[slice]) -> Array:
    """Which columns are searched finer, shape (columns,): of those together those that bind, or nearly so."""
    searched = np.ones(len(most), dtype=np.bool_)
    for columns in together:
        smallest = most[columns].min()  # -inf where no payload keeps the limit
        nearly = smallest + _NEARLY * abs(smallest) if np.isfinite(smallest) else smallest
        searched[columns] = (most[columns] <= nearly) | (least[columns] > 0.0)
    return searched


def _around(rollout: Rollout, instants: Array, width: float) -> Array:
    """Instants around some (n_joints,), n_joints x parts of them [s]."""
    grid = instants[:, None] + width * np.linspace(-1.0, 1.0, _PARTS)
    near: Array = np.clip(grid, 0.0, rollout.trajectory.duration[0]).reshape(-1)
    return near
