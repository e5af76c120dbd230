"""The masses that drives allow at every instant looked at: by the effort limits, peak torque, and torque at speed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.dynamics.drives.motors import Motors, MotorStates
from trajevo.dynamics.payload_masses import mass_bounds, masses_within
from trajevo.dynamics.rollout import Rollout

#: How often, and into how many parts, the surroundings of a binding instant are divided.
_ZOOMS, _PARTS = 3, 65
_AROUND = np.linspace(-1.0, 1.0, _PARTS)

#: What else may bind between samples: what is within this share of the least mass at them.
_NEARLY = 0.05


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


@final
@dataclass(frozen=True, eq=False)
class Sought:
    """Masses that something allows at instants, to be sought finer around those that bind.

    Attributes:
        states: at instants in the order of time.
        bounds: masses at states, in a column for each thing that binds.
        together: columns of which the one that binds alone counts, so that others are not searched finer.
    """

    states: MotorStates
    bounds: Bounds
    together: tuple[slice, ...] = ()

    __repr__ = brief


def masses_at_instants(rollout: Rollout, sought: Sequence[Sought]) -> list[MassesOfJoints]:
    """The masses at given instants and, finer, around those that bind: of all that is sought in one batch of states.

    Args:
        rollout: the motion.
        sought: what allows masses, with the states at which they are looked at first.
    """
    searches = [_Search(each) for each in sought]
    for _ in range(_ZOOMS):
        grids = [search.instants(rollout) for search in searches]
        if not sum(map(len, grids)):
            break
        near = MotorStates.at(rollout, np.concatenate(grids))
        ends = np.cumsum([len(grid) for grid in grids])
        for search, grid, end in zip(searches, grids, ends.tolist(), strict=True):
            if len(grid):
                search.look(near[end - len(grid) : end])
    return [search.found for search in searches]


@final
class _Search:
    """The least of many functions of time, and where to look next: of greatest masses, and of least ones, negative."""

    def __init__(self, sought: Sought) -> None:
        self._bounds, states = sought.bounds, sought.states
        found = self._functions(states)
        binding = found.argmin(axis=0)
        self._least, self._times = found[binding, np.arange(len(binding))], states.times[binding]
        most, least = self._halves
        searched = _searched(most, least, sought.together)
        # Where no instant asks for a payload there is none around which one may ask for more.
        self._columns = np.flatnonzero(np.concatenate([searched, searched & (least > 0.0)]))
        self._width = float(np.diff(states.times).max())

    def instants(self, rollout: Rollout) -> Array:
        """Instants around those that bind, for one column after the other [s]."""
        grid = self._times[self._columns, None] + self._width * _AROUND
        near: Array = np.clip(grid, 0.0, rollout.trajectory.duration[0]).reshape(-1)
        return near

    def look(self, near: MotorStates) -> None:
        """Take what states at these instants tell."""
        columns = self._columns
        every = np.arange(len(columns))
        found = self._functions(near).reshape(len(columns), _PARTS, -1)[every, :, columns]
        chosen = every, found.argmin(axis=1)
        better = found[chosen] < self._least[columns]
        self._least[columns[better]] = found[chosen][better]
        self._times[columns[better]] = near.times.reshape(found.shape)[chosen][better]
        self._width *= 4.0 / _PARTS

    @property
    def found(self) -> MassesOfJoints:
        """Masses and instants that bind."""
        most, least = self._halves
        return MassesOfJoints(least, most, np.where(most < np.inf, self._times[: len(most)], np.nan))

    @property
    def _halves(self) -> tuple[Array, Array]:
        """Greatest and least masses."""
        most, negative = self._least.reshape(2, -1)
        return most, 0.0 - negative

    def _functions(self, states: MotorStates) -> Array:
        lower, upper = self._bounds(states)
        return np.concatenate([upper, -lower], axis=1)


def _searched(most: Array, least: Array, together: Iterable[slice]) -> Array:
    """Which columns are searched finer, shape (columns,): of those together those that bind, or nearly so."""
    searched = np.ones(len(most), dtype=np.bool_)
    for columns in together:
        searched[columns] = nearly_binding(most[columns], least[columns])
    return searched


def nearly_binding(most: Array, least: Array) -> Array:
    """Which masses may be the ones that bind when they are found more closely, the shape of the arrays."""
    first = most.min()
    nearly = first + _NEARLY * abs(first) if np.isfinite(first) else first
    may: Array = (most <= nearly) | (least > 0.0)
    return may
