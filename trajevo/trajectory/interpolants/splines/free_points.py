"""Splines with free points between the via points: when each is passed, and where, are decision variables.

Splines through few points are stiff. A spline that also passes ``count`` free points in every gap has as many more
pieces, and can be any clamped B-spline of its degree with these knots. A free point is told by its distance from the
spline without free points: if all distances are 0, the motion is that spline, so freedom never makes a motion worse.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, numbers, read_only
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError
from trajevo.path.via_points import ViaPoints
from trajevo.robot.robot import Robot
from trajevo.trajectory.batch import TrajectoryBatch
from trajevo.trajectory.interpolants.interpolant import Interpolant, Variable, decision_vectors
from trajevo.trajectory.interpolants.splines.gaps import half_widths

#: Greatest number of free points in a gap.
MOST = 8

#: Half width of a free point's box as a share of the joint's range over the via points.
_WIDTH = 0.25

#: How far a free point's instant may be from the even one, and least distance from the ends of its gap, as shares of
#: the distance between even ones.
_ASIDE, _INSIDE = 0.4, 0.2


@final
@dataclass(frozen=True, eq=False)
class ExtraPoints:
    """Free points in every gap between two via points.

    Attributes:
        count: number of free points in a gap.
        half_width: how far each joint may be to either side of the spline without them, shape (n_joints,) [rad or m].
        joints: names of the joints.
        units: their units.

    Raises:
        InvalidInputError: no whole number from 1 to :data:`MOST`, or widths that are not positive.
    """

    count: int
    half_width: Array
    joints: tuple[str, ...]
    units: tuple[str, ...]

    __repr__ = brief

    def __post_init__(self) -> None:
        object.__setattr__(self, "count", checked_count(self.count, least=1))
        widths = numbers(self.half_width, name="half_width", shape=(len(self.joints),))
        if not (widths > 0.0).all():
            raise InvalidInputError(f"half_width: expected positive numbers, got {widths.tolist()}")
        object.__setattr__(self, "half_width", read_only(widths))

    @classmethod
    def of(cls, given: Any, robot: Robot, points: ViaPoints) -> ExtraPoints | None:
        """Free points as a user asks for them: their number in every gap, None for 0.

        Raises:
            InvalidInputError: no such number.
        """
        count = checked_count(given)
        if not count:
            return None
        return cls(count, half_widths(points, robot.joint_units, _WIDTH), robot.joint_names, robot.joint_units)

    def around(self, kind: str, make: Any) -> WithExtraPoints:
        """A class of interpolants of a name with these points.

        Raises:
            InvalidInputError: an interpolant that takes none.
        """
        return WithExtraPoints(kind, make, self)


def checked_count(given: Any, *, least: int = 0) -> int:
    """A number of free points in a gap.

    Raises:
        InvalidInputError: no whole number from ``least`` to :data:`MOST`.
    """
    if isinstance(given, bool) or not isinstance(given, int | np.integer) or not least <= given <= MOST:
        raise InvalidInputError(f"extra_points: expected a whole number from {least} to {MOST}, got {given!r}")
    return int(given)


@final
@dataclass(frozen=True, eq=False)
class WithExtraPoints:
    """A class of interpolants that has free points in every gap, to be called as the class itself.

    Attributes:
        kind: name of the class, for messages.
        make: the class; its instances have ``through`` and ``virtual_knots``.
        extra: the free points.

    Raises:
        InvalidInputError: an interpolant that takes none.
    """

    kind: str
    make: Any
    extra: ExtraPoints

    __repr__ = brief

    def __post_init__(self) -> None:
        if getattr(self.make, "virtual_knots", None) is None:
            raise InvalidInputError(
                f"extra_points: {self.kind!r} takes none; quintic_spline, septic_spline, cubic and hermite do"
            )

    @property
    def takes_velocities(self) -> bool:
        """As the class."""
        return bool(self.make.takes_velocities)

    @property
    def takes_cycles(self) -> bool:
        """As the class."""
        return bool(self.make.takes_cycles)

    def __call__(self, points: ViaPoints, **given: Any) -> FreePoints:
        """An interpolant through points."""
        return FreePoints(self.make, points, self.extra, **given)


@final
@dataclass(frozen=True, eq=False)
class FreePoints(Interpolant):
    """A spline through via points and free points between them.

    Attributes:
        make: class of the spline.
        points: via points; only the first joints of them, as many as ``extra`` has, are moved by free points.
        extra: the free points.
        duration_bounds: least and greatest time between two via points, as the class takes it [s].
        at_rest: joints at rest at inner points, for a class that takes them.
        velocities: velocities at inner points, the same.
        cyclic: whether the end meets the start, the same.
        ends: further arguments of the class, the states at both ends.
    """

    make: Any
    points: ViaPoints
    extra: ExtraPoints
    duration_bounds: tuple[float, float] = field(kw_only=True)
    at_rest: Any = field(default=(), kw_only=True)
    velocities: Mapping[int, Array] = field(default_factory=dict, kw_only=True)
    start_velocity: Array | None = field(default=None, kw_only=True)
    start_acceleration: Array | None = field(default=None, kw_only=True)
    end_velocity: Array | None = field(default=None, kw_only=True)
    end_acceleration: Array | None = field(default=None, kw_only=True)
    cyclic: bool = field(default=False, kw_only=True)
    _guess: Any = field(init=False, repr=False)
    _fine: Any = field(init=False, repr=False)

    __repr__ = brief

    def __post_init__(self) -> None:
        each, count = self.extra.count + 1, len(self.points)
        states = ("start_velocity", "start_acceleration", "end_velocity", "end_acceleration")
        given: dict[str, Any] = {name: getattr(self, name) for name in states if getattr(self, name) is not None}
        given["duration_bounds"] = self.duration_bounds
        given |= {"cyclic": True} if self.cyclic else {}
        coarse = given | {"at_rest": self.at_rest, "velocities": self.velocities}
        object.__setattr__(self, "_guess", self.make(self.points, **coarse))
        places, positions = np.arange((count - 1) * each + 1) / each, self.points.positions
        between = np.stack([np.interp(places, np.arange(count), column) for column in positions.T], axis=1)
        between[::each] = positions
        fine = given | {
            "at_rest": [(point * each, joint) for point, joint in self._guess.at_rest],
            "velocities": {point * each: velocity for point, velocity in self.velocities.items()},
        }
        object.__setattr__(self, "_fine", self.make(ViaPoints(between), **fine))

    @cached_property
    def _variables(self) -> tuple[Variable, ...]:
        extra, gaps = self.extra, len(self.points) - 1
        even = extra.count + 1
        shares = [
            Variable(
                f"share of knot_{gap * extra.count + k}",
                "1",
                (max(k - _ASIDE, _INSIDE) if k > 1 else _INSIDE) / even,
                (min(k + _ASIDE, even - _INSIDE) if k < extra.count else even - _INSIDE) / even,
                departs=True,
            )
            for gap in range(gaps)
            for k in range(1, even)
        ]
        offsets = [
            Variable(f"{joint} at knot_{knot + 1}", unit, -width, width, departs=True)
            for joint, unit, width in zip(extra.joints, extra.units, extra.half_width.tolist(), strict=True)
            for knot in range(gaps * extra.count)
        ]
        return (*self._guess.variables, *shares, *offsets)

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Those of the spline; when free points are passed, as a share of their gap; and where, joint by joint."""
        return self._variables

    def __call__(self, x: Array) -> TrajectoryBatch:
        """Motions for decision vectors of shape (B, n_variables)."""
        rows = decision_vectors(x, len(self._variables))
        times, count, gaps = len(self._guess.variables), self.extra.count, len(self.points) - 1
        timing, shares = rows[:, :times], rows[:, times : times + gaps * count]
        offsets = rows[:, times + gaps * count :].reshape(len(rows), len(self.extra.joints), gaps * count)
        parts, instants = self._divided(timing, shares.reshape(len(rows), gaps, count))
        first = self._guess(timing)
        free = np.array(first.evaluate(instants))
        free[:, :, : len(self.extra.joints)] += np.swapaxes(offsets, 1, 2)
        positions = np.empty((len(rows), gaps * (count + 1) + 1, self.points.n_joints), dtype=free.dtype)
        positions[:, :: count + 1] = self.points.positions
        inner = np.delete(np.arange(positions.shape[1]), np.s_[:: count + 1])
        positions[:, inner] = free
        found: TrajectoryBatch = self._fine.through(positions, parts)
        return found

    def via_times(self, x: Array) -> Array:
        """When the via points are passed, (B, n_variables) -> (B, n_points) [s]."""
        rows = decision_vectors(x, len(self._variables))
        times: Array = self._guess.via_times(rows[:, : len(self._guess.variables)])
        return times

    def _divided(self, timing: Array, shares: Array) -> tuple[Array, Array]:
        """Durations between all knots, and the instants of the free points, (B, gaps * count) [s].

        Args:
            timing: the spline's own variables, shape (B, C) [s].
            shares: when the free points are passed, shape (B, gaps, count).
        """
        virtual, gaps = self.make.virtual_knots, shares.shape[1]
        split = timing[:, virtual : virtual + gaps]
        ends = np.concatenate([np.zeros_like(shares[..., :1]), shares, np.ones_like(shares[..., :1])], axis=2)
        parts = (np.diff(ends, axis=2) * split[..., None]).reshape(len(timing), -1)
        starts = np.cumsum(timing, axis=1)[:, virtual : virtual + gaps] - split
        instants = starts[..., None] + shares * split[..., None]
        whole = np.concatenate([timing[:, :virtual], parts, timing[:, timing.shape[1] - virtual :]], axis=1)
        return whole, instants.reshape(len(timing), -1)
