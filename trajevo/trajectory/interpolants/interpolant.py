"""The interface of all interpolants, and functions shared by those with free segment times."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Protocol, runtime_checkable

import numpy as np

from trajevo.base.arrays import Array, numbers, read_only
from trajevo.errors import InvalidInputError
from trajevo.path.via_points import ViaPoints
from trajevo.trajectory.arranged import Arranged
from trajevo.trajectory.batch import TrajectoryBatch
from trajevo.trajectory.polynomial import PolynomialBatch


@dataclass(frozen=True)
class Variable:
    """A decision variable: its name, SI unit and bounds.

    Attributes:
        name: its name.
        unit: its SI unit.
        lower: least value [its unit].
        upper: greatest value [its unit].
        departs: whether it departs from a plainer motion, which is there where all such variables are in the middle
            between their bounds.
    """

    name: str
    unit: str
    lower: float
    upper: float
    departs: bool = field(default=False, kw_only=True)

    def __post_init__(self) -> None:
        if not (np.isfinite([self.lower, self.upper]).all() and self.lower < self.upper):
            raise InvalidInputError(
                f"variable {self.name!r}: expected finite bounds lower < upper, got {self.lower} and {self.upper}"
            )


#: Joints at rest at inner points, as pairs (point, joint), both counted from 0: there the joint's velocity is 0 for all
#: decision vectors.
AtRest = Sequence[tuple[int, int]]

#: Difference of two instants that is rounding, as a share of the duration.
_ROUNDING = 1e-9


class Interpolant(ABC):
    """A map from decision vectors to trajectories, for a whole population at once.

    Attributes:
        price_of_rest: what else changes where a joint rests at an inner point, in a few words; None for an interpolant
            that does not take ``at_rest``, see :data:`AtRest`.
        takes_velocities: whether it takes ``velocities`` at inner points and ``start_velocity``,
            ``start_acceleration``, ``end_velocity`` and ``end_acceleration``, see :func:`set_velocities`.
        takes_cycles: whether it takes ``cyclic``, with which the end of a motion meets its start.
        virtual_knots: number of knots that it has between the first two points, and as many between the last two; its
            variables are the times between points and these knots. None for an interpolant that has no method
            ``through``, with which every motion has points of its own, as free points between the given ones need.
        continuous: order of the highest derivative that is continuous everywhere, and 0 where a motion begins or ends
            at rest: 2 if that is the acceleration or a higher one, 1 if accelerations may jump.
    """

    price_of_rest: ClassVar[str | None] = None
    takes_velocities: ClassVar[bool] = False
    takes_cycles: ClassVar[bool] = False
    virtual_knots: ClassVar[int | None] = None
    continuous: ClassVar[int] = 2

    @property
    @abstractmethod
    def variables(self) -> tuple[Variable, ...]:
        """The decision variables, in the order of the columns of ``x``."""

    @abstractmethod
    def __call__(self, x: Array) -> TrajectoryBatch:
        """Decode decision vectors.

        Args:
            x: shape (B, n_variables), units as in :attr:`variables`.

        Returns:
            B trajectories.

        Raises:
            InvalidInputError: another shape, or a segment time that is not a positive number.
        """

    @abstractmethod
    def via_times(self, x: Array) -> Array:
        """Instants at which the via points are passed, (B, n_variables) -> (B, n_points) [s]."""


@dataclass(frozen=True, eq=False)
class SegmentTimes(Interpolant):
    """An interpolant through points of which the variables are the times of its segments.

    Attributes:
        points: the points.
        duration_bounds: least and greatest time of a segment [s].
    """

    points: ViaPoints
    duration_bounds: tuple[float, float] = field(kw_only=True)

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The segment times."""
        return duration_variables(len(self.points) - 1, self.duration_bounds)

    def via_times(self, x: Array) -> Array:
        """The segments' ends, (B, n_segments) -> (B, n_points) [s]."""
        return breaks_of(check_durations(x, len(self.points) - 1))


@runtime_checkable
class PassesNearby(Protocol):
    """An interpolant whose motions pass inner points nearby, or may do so; any other one meets all its points."""

    def via_errors(self, trajectory: TrajectoryBatch) -> Array:
        """How far motions of this interpolant pass every joint of every point, (B, n_points, n_joints) [rad or m]."""


@runtime_checkable
class ArrangesPoints(Protocol):
    """An interpolant whose points differ from individual to individual, as the cell varies."""

    @property
    def base_origin(self) -> Array | None:
        """Origin of the robot's base at its given place, shape (3,) [m]; None if it stands still."""

    @property
    def base_tilts(self) -> bool:
        """Whether the robot's base may be tilted."""

    def motions(self, x: Array) -> tuple[TrajectoryBatch, Arranged]:
        """The motions of decision vectors (B, n_variables), and how the cell is arranged for each of them."""


def checked_bounds(bounds: Any) -> tuple[float, float]:
    """Bounds of a duration as 0 < lower < upper [s]."""
    lower, upper = numbers(bounds, name="duration_bounds", shape=(2,)).tolist()
    if not 0.0 < lower < upper:
        raise InvalidInputError(f"duration_bounds: expected 0 < lower < upper [s], got {lower} and {upper}")
    return lower, upper


def checked_points(points: Any, least: int, what: str) -> None:
    """Refuse anything but via points, and fewer points than an interpolant needs."""
    if not isinstance(points, ViaPoints):
        raise InvalidInputError(f"points: {what} needs ViaPoints, got {type(points).__name__}")
    if len(points) < least:
        raise InvalidInputError(f"points: {what} needs at least {least} points, got {len(points)}")


def checked_rests(at_rest: Any, points: ViaPoints) -> tuple[tuple[int, int], ...]:
    """Pairs (point, joint) of joints at rest at inner points, sorted, each once.

    Raises:
        InvalidInputError: something else than such pairs, or a point or joint that does not exist.
    """
    last, joints = len(points) - 1, points.n_joints
    try:
        pairs = np.asarray(list(at_rest) or np.empty((0, 2), dtype=np.intp))
    except (TypeError, ValueError):
        pairs = np.empty(0)
    if pairs.ndim != 2 or pairs.shape[1] != 2 or not np.issubdtype(pairs.dtype, np.integer):
        raise InvalidInputError(f"at_rest: expected pairs (point, joint) of whole numbers, got {at_rest!r}")
    for point, joint in pairs.tolist():
        if not 0 < point < last:
            raise InvalidInputError(f"at_rest: expected inner points, 1 to {last - 1}, got point {point}")
        if not 0 <= joint < joints:
            raise InvalidInputError(f"at_rest: expected joints 0 to {joints - 1}, got joint {joint}")
    return tuple(sorted({(point, joint) for point, joint in pairs.tolist()}))


#: Given velocities and accelerations at both ends, as interpolants call them.
END_STATES = ("start_velocity", "start_acceleration", "end_velocity", "end_acceleration")


def set_velocities(interpolant: Any) -> None:
    """Check the given velocities and accelerations of an interpolant that takes them, and store them as arrays.

    Its :data:`END_STATES` are arrays (n_joints,) or None for 0; its ``velocities`` are a mapping from inner points to
    arrays (n_joints,) [rad/s or m/s].

    Raises:
        InvalidInputError: other shapes, or a point that is no inner one.
    """
    joints, last = interpolant.points.n_joints, len(interpolant.points) - 1
    for name in END_STATES:
        given = getattr(interpolant, name)
        values = np.zeros(joints) if given is None else numbers(given, name=name, shape=(joints,))
        object.__setattr__(interpolant, name, read_only(values))
    found = {}
    for point, values in interpolant.velocities.items():
        if not 0 < point < last:
            raise InvalidInputError(f"velocities: expected inner points, 1 to {last - 1}, got point {point}")
        found[point] = read_only(numbers(values, name=f"velocities: point {point}", shape=(joints,)))
    object.__setattr__(interpolant, "velocities", found)


def check_cycle(interpolant: Any) -> None:
    """Refuse a cyclic interpolant whose last point is not its first one, or that has given states at its ends.

    Raises:
        InvalidInputError: as said.
    """
    if not interpolant.cyclic:
        return
    positions = interpolant.points.positions
    if np.abs(positions[-1] - positions[0]).max() > 0.0:
        raise InvalidInputError(
            f"cyclic: expected the last point to be the first, {positions[0].tolist()}, got {positions[-1].tolist()}"
        )
    for name in END_STATES:
        if getattr(interpolant, name).any():
            raise InvalidInputError(f"cyclic: expected no {name}, as a cyclic motion has no end")


def known_velocities(
    shape: tuple[int, ...], at_rest: AtRest, velocities: Mapping[int, Array]
) -> tuple[tuple[tuple[int, int], ...], Array]:
    """Pairs (point, joint) whose velocity is known, sorted, and the velocities, 0 elsewhere, (n_points, n_joints)."""
    values = np.zeros(shape)
    for point, given in velocities.items():
        values[point] = given
    given_at = ((point, joint) for point in velocities for joint in range(shape[1]))
    return tuple(sorted({*at_rest, *given_at})), values


def alike(at_rest: AtRest, n_joints: int) -> list[tuple[list[int], list[int]]]:
    """Joints that rest at the same points, and these points; the joints of all groups together are all joints."""
    groups: dict[tuple[int, ...], list[int]] = {}
    for joint in range(n_joints):
        groups.setdefault(tuple(point for point, other in at_rest if other == joint), []).append(joint)
    return [(joints, list(points)) for points, joints in groups.items()]


def duration_variables(count: int, bounds: tuple[float, float], symbol: str = "dt") -> tuple[Variable, ...]:
    """One free time per segment, the first named ``dt_1`` [s]."""
    return tuple(Variable(f"{symbol}_{i + 1}", "s", *bounds) for i in range(count))


def breaks_at_points(interpolant: Interpolant) -> tuple[int, ...] | None:
    """Index of the break at which each point is passed; None if some point is passed between breaks."""
    found = breaks_where(interpolant)
    known = tuple(k for k in found if k is not None)
    return known if len(known) == len(found) else None


def breaks_where(interpolant: Interpolant) -> tuple[int | None, ...]:
    """Index of the break at which each point is passed, None for a point that is passed between breaks."""
    x = example_of(interpolant)
    times, breaks = interpolant.via_times(x)[0], interpolant(x).breaks[0]
    apart = np.abs(times[:, None] - breaks)
    at_breaks = apart.min(axis=1) <= _ROUNDING * breaks[-1]
    return tuple(int(k) if at else None for k, at in zip(apart.argmin(axis=1), at_breaks, strict=True))


def piecewise_polynomials(trajectory: TrajectoryBatch, kind: str) -> PolynomialBatch:
    """Motions of an interpolant that is named ``kind``; any but piecewise polynomials are refused."""
    if not isinstance(trajectory, PolynomialBatch):
        raise InvalidInputError(
            f"interpolant: expected one of piecewise polynomials, got {kind!r}, {type(trajectory).__name__}"
        )
    return trajectory


def example_of(interpolant: Interpolant) -> Array:
    """Unequal values of an interpolant's variables, shape (1, n)."""
    own = interpolant.variables
    shares = np.linspace(0.4, 0.6, len(own))
    return np.array([[v.lower + share * (v.upper - v.lower) for v, share in zip(own, shares, strict=True)]])


def decision_vectors(x: Any, count: int, what: str = "decision vectors") -> Array:
    """Rows of numbers as an array (B, count); complex ones stay complex."""
    try:
        rows = np.asarray(x, dtype=np.complex128 if np.iscomplexobj(x) else np.float64)
    except (TypeError, ValueError):
        raise InvalidInputError(f"x: expected {what} of shape (B, {count}), got {x!r}") from None
    if rows.ndim != 2 or rows.shape[1] != count:
        raise InvalidInputError(f"x: expected {what} of shape (B, {count}), got {rows.shape}")
    return rows


def check_durations(x: Any, count: int) -> Array:
    """Segment times as an array (B, n_segments), every one positive and finite [s]; complex ones stay complex."""
    durations = decision_vectors(x, count, "segment times")
    good = np.isfinite(durations) & (durations.real > 0.0)
    if not good.all():
        row, segment = (int(i) for i in np.argwhere(~good)[0])
        raise InvalidInputError(
            f"x: expected positive segment times [s], got {durations[row, segment]} for segment {segment} of row {row}"
        )
    return durations


def breaks_of(durations: Array) -> Array:
    """Instants of the breaks, (B, S) durations -> (B, S + 1), from 0 [s]."""
    return np.concatenate([np.zeros((len(durations), 1)), np.cumsum(durations, axis=1)], axis=1)
