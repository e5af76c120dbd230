"""The quintic spline with four continuous derivatives, and the septic spline with six."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.path.via_points import ViaPoints
from trajevo.trajectory.batch import TrajectoryBatch
from trajevo.trajectory.interpolants.hermite import odd_spline
from trajevo.trajectory.interpolants.interpolant import (
    END_STATES,
    AtRest,
    Interpolant,
    Variable,
    breaks_of,
    check_cycle,
    check_durations,
    checked_bounds,
    checked_points,
    checked_rests,
    duration_variables,
    set_velocities,
)


@final
@dataclass(frozen=True, eq=False)
class QuinticSpline(Interpolant):
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
    takes_velocities: ClassVar[bool] = True
    takes_cycles: ClassVar[bool] = True
    virtual_knots: ClassVar[int | None] = 0

    points: ViaPoints
    duration_bounds: tuple[float, float] = field(kw_only=True)
    at_rest: AtRest = field(default=(), kw_only=True)
    velocities: Mapping[int, Array] = field(default_factory=dict, kw_only=True)
    start_velocity: Array | None = field(default=None, kw_only=True)
    start_acceleration: Array | None = field(default=None, kw_only=True)
    end_velocity: Array | None = field(default=None, kw_only=True)
    end_acceleration: Array | None = field(default=None, kw_only=True)
    cyclic: bool = field(default=False, kw_only=True)

    __repr__ = brief

    def __post_init__(self) -> None:
        checked_points(self.points, 2, "the quintic spline")
        object.__setattr__(self, "duration_bounds", checked_bounds(self.duration_bounds))
        object.__setattr__(self, "at_rest", checked_rests(self.at_rest, self.points))
        set_velocities(self)
        check_cycle(self)

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The segment times."""
        return duration_variables(len(self.points) - 1, self.duration_bounds)

    def __call__(self, x: Array) -> TrajectoryBatch:
        """Splines for segment times of shape (B, n_segments) [s]."""
        return self.through(self.points.positions, x)

    def through(self, positions: Array, x: Array) -> TrajectoryBatch:
        """The same through other points, (n_points, n_joints) or of each motion (B, n_points, n_joints) [rad or m]."""
        return _spline(self, positions, check_durations(x, len(self.points) - 1), 3)

    def via_times(self, x: Array) -> Array:
        """The segments' ends, (B, n_segments) -> (B, n_points) [s]."""
        return breaks_of(check_durations(x, len(self.points) - 1))


@final
@dataclass(frozen=True, eq=False)
class SepticSpline(Interpolant):
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
    takes_velocities: ClassVar[bool] = True
    takes_cycles: ClassVar[bool] = True
    virtual_knots: ClassVar[int | None] = 0

    points: ViaPoints
    duration_bounds: tuple[float, float] = field(kw_only=True)
    at_rest: AtRest = field(default=(), kw_only=True)
    velocities: Mapping[int, Array] = field(default_factory=dict, kw_only=True)
    start_velocity: Array | None = field(default=None, kw_only=True)
    start_acceleration: Array | None = field(default=None, kw_only=True)
    end_velocity: Array | None = field(default=None, kw_only=True)
    end_acceleration: Array | None = field(default=None, kw_only=True)
    cyclic: bool = field(default=False, kw_only=True)

    __repr__ = brief

    def __post_init__(self) -> None:
        checked_points(self.points, 2, "the septic spline")
        object.__setattr__(self, "duration_bounds", checked_bounds(self.duration_bounds))
        object.__setattr__(self, "at_rest", checked_rests(self.at_rest, self.points))
        set_velocities(self)
        check_cycle(self)

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The segment times."""
        return duration_variables(len(self.points) - 1, self.duration_bounds)

    def __call__(self, x: Array) -> TrajectoryBatch:
        """Splines for segment times of shape (B, n_segments) [s]."""
        return self.through(self.points.positions, x)

    def through(self, positions: Array, x: Array) -> TrajectoryBatch:
        """The same through other points, (n_points, n_joints) or of each motion (B, n_points, n_joints) [rad or m]."""
        return _spline(self, positions, check_durations(x, len(self.points) - 1), 4)

    def via_times(self, x: Array) -> Array:
        """The segments' ends, (B, n_segments) -> (B, n_points) [s]."""
        return breaks_of(check_durations(x, len(self.points) - 1))


def _spline(spline: Any, positions: Array, durations: Array, r: int) -> TrajectoryBatch:
    """The spline of one of these classes, with its given velocities."""
    ends = np.stack([getattr(spline, name) for name in END_STATES])
    given = {
        "at_rest": spline.at_rest,
        "velocities": spline.velocities,
        "ends": ends if ends.any() else None,
        "cyclic": spline.cyclic,
    }
    return odd_spline(positions, durations, r, **given)
