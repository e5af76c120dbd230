"""The masses with which all motors together take no more than their supply gives, at every instant looked at."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from trajevo.base.arrays import Array
from trajevo.capacity.drives.instants import MassesOfJoints, Sought, masses_at_instants
from trajevo.dynamics.drives.motors import Motors, MotorStates
from trajevo.dynamics.drives.power import supply_power
from trajevo.dynamics.rollout import Rollout

#: Masses that are tried, between neighbours of which the power passes its limit once at most [kg].
_TRIED = np.concatenate([[0.0], np.geomspace(1e-3, 1e5, 81)])

#: Steps by which the place where it passes is halved: a double holds no more.
_HALVINGS = 52


def masses_of_supply(rollout: Rollout, most: float) -> MassesOfJoints:
    """The masses that a limit of the power of all motors together leaves, as of one joint.

    The power is not quadratic in the mass where gears have losses, so masses are tried, and the limit is sought between
    those that keep it and those that do not.

    Args:
        rollout: the first motion counts.
        most: greatest power [W].
    """
    motors = Motors.of(rollout)

    def bounds(states: MotorStates) -> tuple[Array, Array]:
        def power(mass: Array) -> Array:
            load = states.load + mass[:, None] * states.per_kilogram
            torque = states.rotor + motors.through(load, states.velocity) * load
            return supply_power(motors, torque, states.velocity)

        return _between(power, len(states.times), most)

    return masses_at_instants(rollout, [Sought(MotorStates.of_samples(rollout), bounds)])[0]


def _between(power: Callable[[Array], Array], count: int, most: float) -> tuple[Array, Array]:
    """Least and greatest mass with which a power (K,) of masses (K,) keeps its limit, two arrays (K, 1) [kg]."""
    kept = np.stack([power(np.full(count, mass)) <= most for mass in _TRIED])
    first = kept.argmax(axis=0)
    after = np.where(np.arange(len(kept))[:, None] < first, True, kept).argmin(axis=0)  # 0 if all later ones are kept
    unlimited = after == 0
    last = np.where(unlimited, len(kept) - 1, after) - 1
    lower = np.where(first == 0, 0.0, _passed(power, _TRIED[first], _TRIED[np.maximum(first - 1, 0)], most))
    upper = np.where(unlimited, np.inf, _passed(power, _TRIED[last], _TRIED[np.minimum(last + 1, len(kept) - 1)], most))
    none = ~kept.any(axis=0)
    return np.where(none, np.inf, lower)[:, None], np.where(none, -np.inf, upper)[:, None]


def _passed(power: Callable[[Array], Array], keeps: Array, breaks: Array, most: float) -> Array:
    """The mass between one that keeps the limit and one that breaks it, on the side that keeps it, shape (K,) [kg]."""
    for _ in range(_HALVINGS):
        middle = 0.5 * (keeps + breaks)
        kept = power(middle) <= most
        keeps, breaks = np.where(kept, middle, keeps), np.where(kept, breaks, middle)
    return keeps
