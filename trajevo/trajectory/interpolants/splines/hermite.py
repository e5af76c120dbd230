"""Cubic Hermite splines, whose velocities are free where pieces meet: accelerations may jump, as least times ask for.

Where no jerk is limited, the fastest motion changes an effort or an acceleration from one limit to the other at once. A
spline with continuous accelerations cannot. This one is the cubic spline through the points, plus a cubic Hermite
spline whose velocities at all knots, and whose positions at the knots between via points, are free. So if all offsets
are 0 the motion is the cubic spline, and freedom never makes a motion worse.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError
from trajevo.path.via_points import ViaPoints
from trajevo.robot.robot import Robot
from trajevo.trajectory.interpolants.hermite import hermite_segments, odd_spline
from trajevo.trajectory.interpolants.interpolant import (
    Variable,
    breaks_of,
    check_durations,
    decision_vectors,
    duration_variables,
    known_velocities,
)
from trajevo.trajectory.interpolants.splines.free_points import checked_count
from trajevo.trajectory.interpolants.splines.gaps import divided, half_widths, named_joints, on_pieces, weight_variables
from trajevo.trajectory.interpolants.splines.spline import Spline
from trajevo.trajectory.polynomial import PolynomialBatch

#: Half width of what is free, as a share of the joint's range over the via points: of the distance that a velocity
#: would cover in a mean gap, and of a position.
_TRAVEL, _WIDTH = 1.0, 0.25


@final
@dataclass(frozen=True, eq=False)
class HermiteSpline(Spline):
    """C1 cubic Hermite spline through the points, at rest at both ends, with free velocities.

    Accelerations may jump at every knot and at both ends, so that its jerk is infinite there.

    Attributes:
        points: at least 2 via points; only their first joints, as many as ``span`` has, have free velocities.
        duration_bounds: least and greatest time between two points [s].
        extra_points: number of free knots in every gap between two points, from 0 to 8.
        span: range of each joint, shape (n_joints,) [rad or m]; a velocity may differ from that of the cubic spline by
            a range per mean time of a gap, and a free point by a quarter of it. That over the points if None.
        joints: names of the joints; numbered if None.
        units: their units; rad if None.
        at_rest: joints at rest at inner points, pairs (point, joint) from 0: their velocity there is no variable.
        velocities: velocities at inner points, shape (n_joints,) each [rad/s or m/s], with the same effect.
        start_velocity: shape (n_joints,) [rad/s or m/s]; zero if not given.
        start_acceleration: none can be given, as for ``end_acceleration``, since accelerations are free at both ends.
        end_velocity: as ``start_velocity``.
        end_acceleration: as ``start_acceleration``.

    Raises:
        InvalidInputError: another number of free knots, spans that are not positive, or a given acceleration.
    """

    price_of_rest: ClassVar[str | None] = "its velocity there is no longer free"
    called: ClassVar[str] = "the Hermite spline"
    continuous: ClassVar[int] = 1

    extra_points: int = field(default=0, kw_only=True)
    span: Array | None = field(default=None, kw_only=True)
    joints: tuple[str, ...] | None = field(default=None, kw_only=True)
    units: tuple[str, ...] | None = field(default=None, kw_only=True)

    __repr__ = brief

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "extra_points", checked_count(self.extra_points))
        named = named_joints(self.points, self.joints, self.units, self.span, 1.0, name="span")
        for name, value in zip(("joints", "units", "span"), named, strict=True):
            object.__setattr__(self, name, value)
        for name in ("start_acceleration", "end_acceleration"):
            if getattr(self, name).any():
                raise InvalidInputError(
                    f"{name}: expected none, as accelerations of 'hermite' are free and may jump; cubic, bspline, "
                    "quintic_spline and septic_spline take one"
                )

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The times; weights of pieces; offsets of velocities, joint by joint; offsets of positions, the same."""
        return self._variables

    def __call__(self, x: Array) -> PolynomialBatch:
        """Motions for decision vectors of shape (B, n_variables)."""
        rows = decision_vectors(x, len(self._variables))
        parts, first = self._parts(rows), len(self._variables) - len(self._free[0]) - len(self._moved[0])
        spline = odd_spline(self.points.positions, rows[:, : len(self.points) - 1], 2, ends=self._ends)
        pieces = on_pieces(spline.coefficients, parts, self.extra_points + 1)
        states = np.zeros((len(rows), parts.shape[1] + 1, self.points.n_joints, 2), dtype=pieces.dtype)
        states[:, :-1] = pieces[..., :2]
        states[:, :: self.extra_points + 1, :, 0] = self.points.positions
        states[:, 0, :, 1], states[:, -1, :, 1] = self.start_velocity, self.end_velocity
        for (point, joint), velocity in self._given.items():
            states[:, point * (self.extra_points + 1), joint, 1] = velocity
        knots, joints = self._free
        mean = 0.5 * (self.extra_points + 1) * (parts[:, knots - 1] + parts[:, knots])
        states[:, knots, joints, 1] += rows[:, first : first + len(knots)] / mean
        knots, joints = self._moved
        states[:, knots, joints, 0] += rows[:, rows.shape[1] - len(knots) :]
        return PolynomialBatch(breaks_of(parts), hermite_segments(states[:, :-1], states[:, 1:], parts))

    def via_times(self, x: Array) -> Array:
        """When the via points are passed, (B, n_variables) -> (B, n_points) [s]."""
        parts = self._parts(decision_vectors(x, len(self._variables)))
        return breaks_of(parts)[:, :: self.extra_points + 1]

    @property
    def _ends(self) -> Array | None:
        """Velocity and acceleration at the start, then at the end, (4, n_joints); None at rest."""
        ends = np.zeros((4, self.points.n_joints))
        ends[0], ends[2] = self.start_velocity, self.end_velocity
        return ends if ends.any() else None

    @cached_property
    def _given(self) -> dict[tuple[int, int], float]:
        """Velocities of joints at inner points that are no variables."""
        known, values = known_velocities(self.points.positions.shape, self.at_rest, self.velocities)
        return {(point, joint): float(values[point, joint]) for point, joint in known}

    @cached_property
    def _free(self) -> tuple[Array, Array]:
        """Numbers of the knots whose velocities are free, and of their joints, in the order of variables."""
        each, gaps = self.extra_points + 1, len(self.points) - 1
        taken = {(point * each, joint) for point, joint in self._given}
        pairs = [
            (knot, joint)
            for joint in range(len(self.joints or ()))
            for knot in range(1, gaps * each)
            if (knot, joint) not in taken
        ]
        knots, joints = np.array(pairs, dtype=np.intp).reshape(-1, 2).T
        return knots, joints

    @cached_property
    def _moved(self) -> tuple[Array, Array]:
        """Numbers of the knots whose positions are free, and of their joints, in the order of variables."""
        each = self.extra_points + 1
        knots = np.delete(np.arange((len(self.points) - 1) * each + 1), np.s_[::each])
        count = len(self.joints or ())
        return np.tile(knots, count), np.repeat(np.arange(count), len(knots))

    @cached_property
    def _variables(self) -> tuple[Variable, ...]:
        gaps, names, units = len(self.points) - 1, self.joints or (), self.units or ()
        weights = weight_variables(gaps * (self.extra_points + 1) if self.extra_points else 0)
        offsets = [
            Variable(f"{what} {names[joint]} at knot_{knot}", units[joint], -share * span, share * span, departs=True)
            for what, share, (knots, joints) in (
                ("travel of", _TRAVEL, self._free),
                ("offset of", _WIDTH, self._moved),
            )
            for knot, joint in zip(knots.tolist(), joints.tolist(), strict=True)
            for span in [float(np.asarray(self.span)[joint])]
        ]
        return (*duration_variables(gaps, self.duration_bounds), *weights, *offsets)

    def _parts(self, rows: Array) -> Array:
        """Times between neighbouring knots, shape (B, S) [s]."""
        gaps = len(self.points) - 1
        times = check_durations(rows[:, :gaps], gaps)
        return divided(times, rows[:, gaps : gaps * (self.extra_points + 2)]) if self.extra_points else times


@final
@dataclass(frozen=True, eq=False)
class HermiteShape:
    """How the Hermite splines of a problem are, to be called as their class.

    Attributes:
        count: number of free knots in every gap.
        span: range of each joint, shape (n_joints,) [rad or m].
        joints: names of the joints.
        units: their units.

    Raises:
        InvalidInputError: no such number.
    """

    takes_velocities: ClassVar[bool] = True
    continuous: ClassVar[int] = HermiteSpline.continuous

    count: int
    span: Array
    joints: tuple[str, ...]
    units: tuple[str, ...]

    __repr__ = brief

    @classmethod
    def of(cls, given: Any, robot: Robot, points: ViaPoints) -> HermiteShape:
        """As a user asks for them: the number of free points in every gap.

        Raises:
            InvalidInputError: no such number.
        """
        span = half_widths(points, robot.joint_units, 1.0)
        return cls(checked_count(given), span, robot.joint_names, robot.joint_units)

    def around(self, kind: str, make: Any) -> HermiteShape:
        """The same, for the class of Hermite splines."""
        return self

    def __call__(self, points: ViaPoints, **given: Any) -> HermiteSpline:
        """A Hermite spline through points."""
        own: dict[str, Any] = {"span": self.span, "joints": self.joints, "units": self.units}
        return HermiteSpline(points, extra_points=self.count, **own, **given)
