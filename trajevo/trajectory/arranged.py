"""Where the points of a population lie if the cell itself varies: where the robot stands, how it reaches each point."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief


@final
@dataclass(frozen=True, eq=False)
class Arranged:
    """The points of B individuals, and how they came about.

    Attributes:
        points: joint positions in the order of the visits, shape (B, K, n_joints) [rad or m].
        missed: how far the tool misses the pose at each of them: distance [m] and angle [rad], shape (B, K, 2).
        bases: how far the robot stands from the given place: along x, y and z of the cell [m] and turned about the
            vertical axis through its own origin [rad], shape (B, 4); None if it stands at its place.
        origin: origin of the robot's base at its given place, shape (3,) [m]; None if it stands there.
        order: number of the point that is visited at each place, shape (B, K); None for the given order.
        branch: number of the posture with which each place is reached, shape (B, K); None if there is one for each.
    """

    points: Array
    missed: Array
    bases: Array | None = None
    origin: Array | None = None
    order: Array | None = None
    branch: Array | None = None

    __repr__ = brief
