"""Motions that stop at inner points: legs between the stops, each by an interpolant of its own, with waits between.

A leg along a line or an arc of the tool is a fixed curve, in a time that is free. Where it does not rest at an end, the
leg that it joins there has its velocity and acceleration.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any, cast, final

import numpy as np

from trajevo.base.arrays import Array, numbers, read_only
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError
from trajevo.path.passing import Passing
from trajevo.path.via_points import ViaPoints
from trajevo.trajectory.batch import TrajectoryBatch
from trajevo.trajectory.interpolants.along_way import FixedCurve
from trajevo.trajectory.interpolants.flowing import ENDS, Flowing
from trajevo.trajectory.interpolants.interpolant import (
    AtRest,
    Interpolant,
    PassesNearby,
    Variable,
    breaks_of,
    checked_bounds,
    checked_rests,
    decision_vectors,
    example_of,
    piecewise_polynomials,
)
from trajevo.trajectory.polynomial import PolynomialBatch

#: Velocity and acceleration at the ends of a leg that count as rest, as a share of the greatest; rounding of times.
_REST, _ROUNDING = 1e-7, 1e-9

#: Ratio of the bounds of a duration that stand in where all durations are fixed.
_APART = 2.0


@final
@dataclass(frozen=True, eq=False)
class Legs(Interpolant):
    """An interpolant from stop to stop, with waits, given velocities, and bounds of its own for every duration.

    A leg begins and ends as motions of its interpolant do, at rest. A duration whose bounds are equal is no variable.

    Attributes:
        kind: name of the interpolant, for messages.
        make: the interpolant; it takes points and ``duration_bounds``, and ``at_rest`` or velocities if they are given.
        points: via points.
        passing: how points are passed, in their order.
        duration_bounds: least and greatest duration, shape (2,), or for every segment (n_points - 1, 2) [s].
        at_rest: further joints at rest at inner points, pairs (point, joint) from 0.
        cyclic: whether the end meets the start, for an interpolant that takes it, without stops.
        curves: fixed curves of the tool by the point at which they begin; the motion stops at their ends.

    Raises:
        InvalidInputError: the interpolant takes too few points, no velocities, or no bounds for each duration; its
            motions do not begin and end at rest, or are no polynomials.
    """

    kind: str
    make: Callable[..., Interpolant]
    points: ViaPoints
    passing: tuple[Passing, ...] = field(kw_only=True)
    duration_bounds: Array = field(kw_only=True)
    at_rest: AtRest = field(default=(), kw_only=True)
    cyclic: bool = field(default=False, kw_only=True)
    curves: Mapping[int, FixedCurve] = field(default_factory=dict, kw_only=True)
    _stops: tuple[Passing, ...] = field(init=False, repr=False)
    _legs: tuple[Interpolant, ...] = field(init=False, repr=False)
    _counts: tuple[int, ...] = field(init=False, repr=False)
    _variables: tuple[Variable, ...] = field(init=False, repr=False)
    _fixed: tuple[tuple[int, float], ...] = field(init=False, repr=False)

    __repr__ = brief

    def __post_init__(self) -> None:
        object.__setattr__(self, "duration_bounds", checked_durations(self.duration_bounds, len(self.points)))
        object.__setattr__(self, "at_rest", checked_rests(self.at_rest, self.points))
        cuts = {one.point: one for one in self.passing if one.stop}
        cuts |= {point: Passing(point) for point in self._flowing}
        object.__setattr__(self, "_stops", tuple(cuts[point] for point in sorted(cuts)))
        if self.cyclic and self._stops:
            raise InvalidInputError(
                f"cyclic: expected no stops, got one at point {self._stops[0].point}: begin and end at this point, "
                "at rest, without cyclic"
            )
        object.__setattr__(self, "_legs", tuple(self._leg(first, last) for first, last in self._ends()))
        self._check_motions()
        self._name_variables()

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The variables of all legs whose bounds are not equal, leg by leg."""
        return self._variables

    def __call__(self, x: Array) -> PolynomialBatch:
        """Motions for decision vectors of shape (B, n_variables)."""
        parts = self._parts(x)
        legs = [piecewise_polynomials(self._motion(k, parts), self.kind) for k in range(len(self._legs))]
        degree = max(leg.degree for leg in legs)
        durations, pieces = [], []
        for k, leg in enumerate(legs):
            durations.append(leg.segment_durations)
            pieces.append(np.pad(leg.coefficients, [(0, 0)] * 3 + [(0, degree - leg.degree)]))
            if k < len(self._stops) and self._stops[k].dwell:
                still = np.zeros((len(leg), 1, self.points.n_joints, degree + 1), dtype=leg.coefficients.dtype)
                still[..., 0] = self.points.positions[self._stops[k].point]
                durations.append(np.full((len(leg), 1), self._stops[k].dwell))
                pieces.append(still)
        return PolynomialBatch(breaks_of(np.concatenate(durations, axis=1)), np.concatenate(pieces, axis=1))

    def via_times(self, x: Array) -> Array:
        """When the points are passed, or reached before a dwell, (B, n_variables) -> (B, n_points) [s]."""
        times: list[Array] = []
        waited = [0.0, *(stop.dwell for stop in self._stops)]
        for leg, part, wait in zip(self._legs, self._parts(x), waited, strict=True):
            own = leg.via_times(part)
            times.append(times[-1][:, -1:] + wait + own[:, 1:] if times else own)
        return np.concatenate(times, axis=1)

    def via_errors(self, trajectory: TrajectoryBatch) -> Array:
        """How far motions pass their points, (B, n_points, n_joints) [rad or m]; of no point if all are met.

        Stops are met whatever the interpolant does with the points between them.
        """
        motion, errors, first = (
            piecewise_polynomials(trajectory, self.kind),
            np.zeros((len(trajectory), 0, trajectory.n_joints)),
            0,
        )
        waits = [*(stop.dwell > 0.0 for stop in self._stops), False]
        for leg, count, wait in zip(self._legs, self._counts, waits, strict=True):
            breaks, pieces = motion.breaks[:, first : first + count + 1], motion.coefficients[:, first : first + count]
            if isinstance(leg, PassesNearby):
                own = leg.via_errors(PolynomialBatch(breaks - breaks[:, :1], pieces))
                errors = np.concatenate([errors[:, :-1], own], axis=1)
            first += count + wait
        return errors

    @property
    def _flowing(self) -> set[int]:
        """Points at which a curve of the tool begins or ends without a rest."""
        ends = [one.segment.rests for one in self.curves.values()]
        return {point for each in ends for point, rests in each.items() if not rests}

    def _motion(self, k: int, parts: list[Array]) -> TrajectoryBatch:
        """Motions of a leg, with the states of the curves that it joins without a rest."""
        leg, states = self._legs[k], {}
        if not isinstance(leg, Flowing):
            return leg(parts[k])
        for end, place, other in (("start", k - 1, "end"), ("end", k + 1, "start")):
            if end in leg.ends:
                velocity, acceleration = cast("FixedCurve", self._legs[place]).states[other]
                states[end] = velocity / parts[place], acceleration / parts[place] ** 2
        return leg.with_states(parts[k], states)

    def _ends(self) -> list[tuple[int, int]]:
        """First and last point of every leg."""
        return list(pairwise([0, *(stop.point for stop in self._stops), len(self.points) - 1]))

    def _leg(self, first: int, last: int) -> Interpolant:
        """The interpolant from one point to another, which may refuse to take so few points."""
        bounds = self.duration_bounds.reshape(-1, 2)
        low, high = float(bounds[:, 0].min()), float(bounds[:, 1].max())
        given: dict[str, Any] = {"duration_bounds": (low, high if high > low else _APART * low)}
        if first in self.curves:
            return replace(self.curves[first], **given)
        rests = [(point - first, joint) for point, joint in self.at_rest if first < point < last]
        given |= ({"at_rest": rests} if rests else {}) | ({"cyclic": True} if self.cyclic else {})
        given |= self._velocities(first, last)
        ends = tuple(end for end, point in zip(ENDS, (first, last), strict=True) if point in self._flowing)
        points = ViaPoints(self.points.positions[first : last + 1])
        try:
            return Flowing(self.kind, self.make, points, ends, given) if ends else self.make(points, **given)
        except InvalidInputError as error:
            if not self._stops:
                raise
            raise InvalidInputError(f"passing: from point {first} to {last}, between stops: {error}") from error

    def _velocities(self, first: int, last: int) -> dict[str, Any]:
        """Given velocities and accelerations of a leg."""
        at = [one for one in self.passing if one.vectors and first <= one.point <= last]
        if at and not getattr(self.make, "takes_velocities", False):
            raise InvalidInputError(
                f"passing: point {at[0].point}: {next(iter(at[0].vectors))}: {self.kind!r} takes none; "
                "quintic_spline, septic_spline, cubic, bspline and hermite do"
            )
        found: dict[str, Any] = {}
        for one in at:
            if first < one.point < last:
                found.setdefault("velocities", {})[one.point - first] = one.velocity
            else:
                side = "start" if one.point == first else "end"
                found |= {f"{side}_{key}": values for key, values in one.vectors.items()}
        return found

    def _parts(self, x: Array) -> list[Array]:
        """The decision vectors of every leg, with the fixed durations."""
        rows = decision_vectors(x, len(self._variables))
        counts = [len(leg.variables) for leg in self._legs]
        whole = np.empty((len(rows), sum(counts)), dtype=rows.dtype)
        fixed = dict(self._fixed)
        whole[:, [k for k in range(sum(counts)) if k not in fixed]] = rows
        for column, duration in fixed.items():
            whole[:, column] = duration
        return np.split(whole, np.cumsum(counts)[:-1], axis=1)

    def _name_variables(self) -> None:
        """Number the variables through all legs, give durations their own bounds, and leave the fixed ones out."""
        counts: Counter[str] = Counter()
        named, fixed = [], []
        several = len(self._legs) > 1
        bounds = iter(self.duration_bounds.tolist() if self.duration_bounds.ndim == 2 else ())
        every = [(number, variable) for number, leg in enumerate(self._legs, 1) for variable in leg.variables]
        for column, (number, variable) in enumerate(every):
            name, stem = variable.name, re.fullmatch(r"(.*_)\d+", variable.name)
            if stem:
                counts[stem[1]] += 1
                name = f"{stem[1]}{counts[stem[1]]}"
            elif several:
                name = f"{name} of leg {number}"
            low, high = variable.lower, variable.upper
            if variable.unit == "s":
                low, high = next(bounds, [low, high])
            if low == high:
                fixed.append((column, low))
            else:
                named.append(Variable(name, variable.unit, low, high, departs=variable.departs))
        object.__setattr__(self, "_fixed", tuple(fixed))
        object.__setattr__(self, "_variables", tuple(named))

    def _check_motions(self) -> None:
        """Refuse interpolants whose motions cannot be put together, or whose durations cannot be bounded one by one."""
        counts: list[int] = []
        shares = np.array([0.0, 0.3, 0.6, 1.0])  # not the middle, where an acceleration may vanish
        for leg, (first, last) in zip(self._legs, self._ends(), strict=True):
            x = example_of(leg)
            motion = piecewise_polynomials(leg(x), self.kind)
            counts.append(motion.segment_durations.shape[1])
            spans = np.diff(leg.via_times(x), axis=1)
            times = x[:, [variable.unit == "s" for variable in leg.variables]]
            if self.duration_bounds.ndim == 2 and (
                spans.shape != times.shape or np.abs(spans - times).max() > _ROUNDING
            ):
                raise InvalidInputError(
                    f"duration_bounds: expected one pair for all segments, as the variables of {self.kind!r} are not "
                    "the times between its points"
                )
            for order in range(1, getattr(self.make, "continuous", 2) + 1):
                values = np.abs(motion.at_shares(shares, order)[0])
                open_ = {0, len(self.points) - 1} | self._flowing
                inner = [k for k, point in ((0, first), (-1, last)) if point not in open_]
                if inner and values[inner].max() > _REST * values.max():
                    raise InvalidInputError(f"passing: {self.kind!r} does not begin and end at rest, as a stop needs")
        object.__setattr__(self, "_counts", tuple(counts))


def checked_durations(given: Any, count: int) -> Array:
    """Bounds of durations, (2,) for all segments between ``count`` points or one pair for each (count - 1, 2) [s].

    Raises:
        InvalidInputError: something else; the two may be equal only where each segment has its own.
    """
    try:
        pairs = np.ndim(given) == 2
    except ValueError:  # rows of different lengths
        pairs = True
    if not pairs:
        return read_only(checked_bounds(given))
    try:
        bounds = numbers(given, name="duration_bounds", shape=(count - 1, 2))
    except InvalidInputError as error:
        raise InvalidInputError(f"{error}; one pair [s] for each segment, or one for all") from error
    for segment, (low, high) in enumerate(bounds.tolist()):
        if not 0.0 < low <= high:
            raise InvalidInputError(
                f"duration_bounds: segment {segment}, from point {segment} to {segment + 1}: expected "
                f"0 < lower <= upper [s], got {low} and {high}"
            )
    return read_only(bounds)
