"""The quintic spline with four continuous derivatives, and the septic spline with six."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.trajectory.batch import TrajectoryBatch
from trajevo.trajectory.interpolants.hermite import odd_spline
from trajevo.trajectory.interpolants.interpolant import (
    END_STATES,
    check_cycle,
    check_durations,
)
from trajevo.trajectory.interpolants.splines.spline import Spline


@dataclass(frozen=True, eq=False)
class OddDegreeSpline(Spline):
    """A spline of odd degree with as many continuous derivatives as it can have.

    Attributes:
        cyclic: whether the end meets the start with all continuous derivatives; the last point is then the first one.
    """

    takes_cycles: ClassVar[bool] = True
    virtual_knots: ClassVar[int | None] = 0
    #: Derivatives from 0 on that two pieces share by their values at a point: half the coefficients of a piece.
    conditions: ClassVar[int]

    cyclic: bool = field(default=False, kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        check_cycle(self)

    def __call__(self, x: Array) -> TrajectoryBatch:
        """Splines for segment times of shape (B, n_segments) [s]."""
        return self.through(self.points.positions, x)

    def through(self, positions: Array, x: Array) -> TrajectoryBatch:
        """The same through other points, (n_points, n_joints) or of each motion (B, n_points, n_joints) [rad or m]."""
        ends = np.stack([getattr(self, name) for name in END_STATES])
        given: dict[str, Any] = {"at_rest": self.at_rest, "velocities": self.velocities, "cyclic": self.cyclic}
        durations = check_durations(x, len(self.points) - 1)
        return odd_spline(positions, durations, self.conditions, ends=ends if ends.any() else None, **given)


@final
@dataclass(frozen=True, eq=False)
class QuinticSpline(OddDegreeSpline):
    """C4 quintic spline through the points; velocity and acceleration given at both ends, but not jerk.

    Attributes:
        points: at least 2 via points.
        duration_bounds: least and greatest time of a segment [s].
        at_rest: joints at rest at inner points, pairs (point, joint) from 0; there the joint's fourth derivative may
            jump.
        velocities: velocities at inner points, shape (n_joints,) each [rad/s or m/s], with the same effect.
        start_velocity: shape (n_joints,) [rad/s or m/s]; zero if not given, as the next three.
        start_acceleration: shape (n_joints,) [rad/s² or m/s²].
        end_velocity: shape (n_joints,) [rad/s or m/s].
        end_acceleration: shape (n_joints,) [rad/s² or m/s²].
        cyclic: whether the end meets the start with all continuous derivatives; the last point is then the first one.
    """

    price_of_rest: ClassVar[str | None] = "its fourth derivative may jump there"
    called: ClassVar[str] = "the quintic spline"
    conditions: ClassVar[int] = 3

    __repr__ = brief


@final
@dataclass(frozen=True, eq=False)
class SepticSpline(OddDegreeSpline):
    """C6 septic spline through the points; velocity and acceleration given, and jerk zero, at both ends.

    Attributes:
        points: at least 2 via points.
        duration_bounds: least and greatest time of a segment [s].
        at_rest: joints at rest at inner points, pairs (point, joint) from 0; there the joint's sixth derivative may
            jump.
        velocities: velocities at inner points, shape (n_joints,) each [rad/s or m/s], with the same effect.
        start_velocity: shape (n_joints,) [rad/s or m/s]; zero if not given, as the next three.
        start_acceleration: shape (n_joints,) [rad/s² or m/s²].
        end_velocity: shape (n_joints,) [rad/s or m/s].
        end_acceleration: shape (n_joints,) [rad/s² or m/s²].
        cyclic: whether the end meets the start with all continuous derivatives; the last point is then the first one.
    """

    price_of_rest: ClassVar[str | None] = "its sixth derivative may jump there"
    called: ClassVar[str] = "the septic spline"
    conditions: ClassVar[int] = 4

    __repr__ = brief
