"""What splines through points have in common: velocities given at points, and states given at both ends."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from trajevo.base.arrays import Array
from trajevo.trajectory.interpolants.interpolant import (
    AtRest,
    SegmentTimes,
    checked_bounds,
    checked_points,
    checked_rests,
    set_velocities,
)


@dataclass(frozen=True, eq=False)
class Spline(SegmentTimes):
    """A spline through at least 2 points that takes velocities at inner points and states at both ends.

    Attributes:
        at_rest: joints at rest at inner points, pairs (point, joint) from 0.
        velocities: velocities at inner points, shape (n_joints,) each [rad/s or m/s].
        start_velocity: shape (n_joints,) [rad/s or m/s]; zero if not given, as the next three.
        start_acceleration: shape (n_joints,) [rad/s² or m/s²].
        end_velocity: shape (n_joints,) [rad/s or m/s].
        end_acceleration: shape (n_joints,) [rad/s² or m/s²].
    """

    takes_velocities: ClassVar[bool] = True
    called: ClassVar[str]

    at_rest: AtRest = field(default=(), kw_only=True)
    velocities: Mapping[int, Array] = field(default_factory=dict, kw_only=True)
    start_velocity: Array | None = field(default=None, kw_only=True)
    start_acceleration: Array | None = field(default=None, kw_only=True)
    end_velocity: Array | None = field(default=None, kw_only=True)
    end_acceleration: Array | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        checked_points(self.points, 2, self.called)
        object.__setattr__(self, "duration_bounds", checked_bounds(self.duration_bounds))
        object.__setattr__(self, "at_rest", checked_rests(self.at_rest, self.points))
        set_velocities(self)
