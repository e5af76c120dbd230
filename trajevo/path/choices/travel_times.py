"""Times of travel from rest to rest between joint positions, for all pairs at once.

Every joint takes the least time in which it goes from rest to rest under its limits of velocity, acceleration and jerk,
with a profile of up to seven phases (Biagiotti and Melchiorri, Trajectory Planning for Automatic Machines and Robots,
2008, section 3.4); the slowest joint decides. Loads, torques and obstacles are left out: the times rank postures and
orders, and the motions themselves are optimised afterwards.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError
from trajevo.robot.joints import Sides
from trajevo.robot.robot import Robot

#: Weight of the mean of all joints' times in a cost, which decides where the slowest joint takes as long.
_MEAN = 1e-3

#: Stand-ins for no limit of velocity, acceleration and jerk.
_NONE = (1e15, 1e25, 1e40)


def rest_to_rest(distance: Array, velocity: Array, acceleration: Array, jerk: Array) -> Array:
    """Least time in which a joint covers a distance from rest to rest, with limits that may be inf; shapes broadcast.

    Args:
        distance: not negative [rad or m].
        velocity: greatest velocity [rad/s or m/s].
        acceleration: greatest acceleration, when speeding up and when slowing down [rad/s² or m/s²].
        jerk: greatest jerk [rad/s³ or m/s³].

    Returns:
        Times [s].
    """
    V, A, J = (np.minimum(limit, none) for limit, none in zip((velocity, acceleration, jerk), _NONE, strict=True))
    rising = np.minimum(np.minimum(A / J, np.sqrt(V / J)), np.cbrt(0.5 * distance / J))
    # With the greatest acceleration A = J rising held for a time, the ramps cover A (held + rising)(held + 2 rising).
    held = np.minimum(np.sqrt(0.25 * rising**2 + distance / A) - 1.5 * rising, V / A - rising)
    held = np.maximum(held, 0.0)
    speed, ramp = J * rising * (held + rising), held + 2.0 * rising
    cruising = np.maximum(distance / np.where(speed > 0.0, speed, np.inf) - ramp, 0.0)
    time: Array = 2.0 * ramp + cruising
    return time


@final
@dataclass(frozen=True, eq=False)
class TravelTimes:
    """Least times of travel of a robot from rest to rest; made by :meth:`of`.

    Attributes:
        velocity: greatest velocities of the joints in both directions [rad/s or m/s].
        acceleration: greatest accelerations, the lesser of both directions, shape (n_joints,) [rad/s² or m/s²].
        jerk: greatest jerks, shape (n_joints,) [rad/s³ or m/s³].
    """

    velocity: Sides
    acceleration: Array
    jerk: Array

    @classmethod
    def of(cls, robot: Robot) -> TravelTimes:
        """The times of a robot.

        Raises:
            InvalidInputError: a joint without any limit of velocity, acceleration and jerk.
        """
        velocity, acceleration, jerk = (robot.limits.sides(name) for name in ("velocity", "acceleration", "jerk"))
        limited = velocity.limited | acceleration.limited | jerk.limited
        if not limited.all():
            joint = robot.joint_names[int(np.flatnonzero(~limited)[0])]
            raise InvalidInputError(
                f"limits: {joint!r} has no limit of velocity, acceleration or jerk, by which postures and orders are "
                "compared; give one in [limits]"
            )
        return cls(velocity, acceleration.lesser, jerk.lesser)

    def __call__(self, start: Array, end: Array) -> Array:
        """Times from joint positions to others, (..., n_joints) each, which broadcast, -> (...) [s]."""
        slowest: Array = self._of_joints(start, end).max(axis=-1)
        return slowest

    def costs(self, start: Array, end: Array) -> Array:
        """The same times and a thousandth of the mean of all joints' times [s], by which ways are ranked."""
        each = self._of_joints(start, end)
        cost: Array = each.max(axis=-1) + _MEAN * each.mean(axis=-1)
        return cost

    def _of_joints(self, start: Array, end: Array) -> Array:
        moved = end - start
        return rest_to_rest(np.abs(moved), self.velocity.toward(moved), self.acceleration, self.jerk)

    def between(self, states: Sequence[Array]) -> Array:
        """Costs between the states of all points.

        Args:
            states: joint positions of every point, shape (S_p, n_joints) each [rad or m].

        Returns:
            Shape (P, P, S, S) [s], from the states of the first point to those of the second, with S the greatest
            number of states of a point; inf where a point has no such state.
        """
        most = max(len(q) for q in states)
        times = np.full((len(states), len(states), most, most), np.inf)
        for p, start in enumerate(states):
            for other, end in enumerate(states):
                times[p, other, : len(start), : len(end)] = self.costs(start[:, None], end[None])
        return times
