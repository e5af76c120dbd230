"""Limits of segments: how far the tool is from its line or arc, and the angle of its axis to an upright direction."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import final

import numpy as np

from trajevo.base.arrays import Array, read_only
from trajevo.dynamics.enclosure import decide
from trajevo.dynamics.piece_bounds import Over, PieceBounds, Pieces
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.formulation.constraints.certified import (
    DECIDING,
    MOST_EXCESS,
    RETREAT,
    peaks_between,
    proven_excess,
)
from trajevo.formulation.constraints.constraint import Constraint
from trajevo.path.segments import ToolSegment
from trajevo.path.via_points import ViaPoints
from trajevo.robot.kinematics import ToolKinematics
from trajevo.robot.robot import Robot
from trajevo.trajectory.interpolants import FixedCurve, Interpolant
from trajevo.trajectory.interpolants.interpolant import breaks_where

#: Difference of a motion's coefficients from those of a curve that is rounding, as a share of the greatest.
_SAME = 1e-9
#: Places along a line or arc at which the axis of the tool is looked at before any search.
_LOOKED = 33


def segment_limits(
    segments: Sequence[ToolSegment],
    robot: Robot,
    points: ViaPoints,
    interpolant: Interpolant,
    curves: dict[int, FixedCurve],
    *,
    limits: str,
) -> tuple[Constraint, ...]:
    """The limits that belong to segments.

    Args:
        segments: what is asked of them.
        robot: the robot.
        points: the points.
        interpolant: interpolant of the motions.
        curves: the curves of the tool, by the point at which they begin.
        limits: ``"certified"`` for cones that are proven at every instant in the search too, or ``"sampled"``.

    Raises:
        InvalidInputError: an interpolant that passes the points between breaks, or an axis that is not upright at a
            point or on a line.
    """
    if not segments:
        return ()
    places = breaks_where(interpolant)
    for one in segments:
        if places[one.from_point] is None or places[one.last] is None:
            raise InvalidInputError(
                f"{one.name}: expected an interpolant that passes its points where segments meet, such as "
                "quintic_spline"
            )
    ends = [place or 0 for place in places]
    ways = tuple(_Way(ends[one.last], curves[one.from_point]) for one in segments if one.tool is not None)
    found = [*_way_limits(ways, robot)]
    for one in segments:
        if one.upright is not None:
            cone = _cone(one, robot, points, (ends[one.from_point], ends[one.last]))
            _check_upright(cone, robot, points, curves)
            found.append(_cone_limit(cone, robot, certified=limits == "certified"))
    return tuple(found)


@final
@dataclass(frozen=True, eq=False)
class _Way:
    """A curve of the tool in motions: its last segment's end is the break of this number."""

    end: int
    curve: FixedCurve

    @property
    def segments(self) -> Array:
        """Numbers of its segments among those of a motion."""
        return np.arange(self.end - self.curve.pieces, self.end)

    def start(self, rollout: Rollout) -> Array:
        """When motions begin it, shape (B,) [s]."""
        found: Array = rollout.trajectory.breaks[:, self.end - self.curve.pieces]
        return found

    def duration(self, rollout: Rollout) -> Array:
        """How long motions take for it, shape (B,) [s]."""
        found: Array = rollout.trajectory.breaks[:, self.end] - self.start(rollout)
        return found


@final
@dataclass(frozen=True, eq=False)
class OffWays:
    """How far the tool is from its lines and arcs over the tolerances, minus 1, shape (B, ways).

    Motions of the problem run along fixed curves, whatever their times, so that what was found for the curves holds for
    all of them. Other motions are looked at at their samples.

    Attributes:
        ways: the ways.
        kinematics: of the tool.
        turned: whether angles are meant, otherwise distances.
        at_samples: whether to look at the samples in any case.
    """

    ways: tuple[_Way, ...]
    kinematics: ToolKinematics
    turned: bool
    at_samples: bool

    def __call__(self, rollout: Rollout) -> Array:
        """The excess of every way."""
        return np.stack([self._excess(way, rollout) for way in self.ways], axis=1)

    def limit(self, way: _Way) -> float:
        """Its tolerance [m or rad]."""
        return way.curve.segment.turning if self.turned else way.curve.segment.tolerance

    def _excess(self, way: _Way, rollout: Rollout) -> Array:
        if self.at_samples or not self._on_curve(way, rollout):
            found = self._sampled(way, rollout)
        else:
            known = way.curve.turned if self.turned else way.curve.deviation
            found = np.full(len(rollout.trajectory), known)
        return found / self.limit(way) - 1.0

    def _on_curve(self, way: _Way, rollout: Rollout) -> bool:
        coefficients = getattr(rollout.trajectory, "coefficients", None)
        own = way.curve.coefficients
        if coefficients is None:
            return False
        part = coefficients.real[:, way.segments]
        powers = way.duration(rollout).real[:, None, None, None] ** np.arange(part.shape[-1])
        unit = (part * powers)[..., : own.shape[-1]]
        return bool(np.abs(unit - own[:, : part.shape[2]]).max() <= _SAME * np.abs(own).max())

    def _sampled(self, way: _Way, rollout: Rollout) -> Array:
        count = rollout.dynamics.samples
        chosen = (way.segments[:, None] * count + np.arange(count)).reshape(-1)
        t, q = rollout.t.real[:, chosen], rollout.q.real[:, chosen]
        share = (t - way.start(rollout).real[:, None]) / way.duration(rollout).real[:, None]
        apart = way.curve.way.apart(self.kinematics, way.curve.share(share), q)[int(self.turned)]
        greatest: Array = apart.max(axis=1)
        return greatest

    def enclosed(self, way: _Way, rollout: Rollout) -> Callable[[PieceBounds, Pieces], Over]:
        """Bounds of squared distance and turn over pieces, for certificates."""
        start, duration = way.start(rollout).real, way.duration(rollout).real
        law = np.array(way.curve.law)
        return lambda bounds, pieces: bounds.tool_off_way(pieces, way.curve.way, law, start, duration)


def _way_limits(ways: tuple[_Way, ...], robot: Robot) -> list[Constraint]:
    found = []
    for turned, quantity, unit in ((False, "distance", "m"), (True, "turn", "rad")):
        chosen = tuple(way for way in ways if not turned or way.curve.way.oriented)
        if not chosen:
            continue
        function = OffWays(chosen, ToolKinematics.of(robot), turned, at_samples=False)
        labels = [f"{way.curve.segment.tool} {way.curve.segment.label}" for way in chosen]
        limit = Constraint(
            tuple(f"{quantity} from {label}" for label in labels),
            "lines and arcs of the tool",
            function,
            quantity=f"{quantity} from the way",
            limit=tuple(function.limit(way) for way in chosen),
            unit=unit,
            proof="pieces",
        )
        samples = replace(limit, function=replace(function, at_samples=True), proof="samples")
        found.append(replace(limit, sampled=samples))
    return found


@final
@dataclass(frozen=True, eq=False)
class Cone:
    """A cone in which an axis of the tool stays on some segments.

    Attributes:
        segment: what was asked.
        axis: unit axis in the tool's frame, shape (3,).
        direction: unit direction in the base frame, shape (3,).
        segments: numbers of the segments of motions.
    """

    segment: ToolSegment
    axis: Array
    direction: Array
    segments: Array

    @property
    def most(self) -> float:
        """Greatest 1 - cos of the angle."""
        angle = self.segment.upright or 0.0
        return float(2.0 * np.sin(0.5 * angle) ** 2)

    def over(self, bounds: PieceBounds, pieces: Pieces) -> Over:
        """Bounds of 1 - cos of the angle over pieces."""
        return bounds.tool_tilt(pieces, self.axis, self.direction)


@final
@dataclass(frozen=True, eq=False)
class Tilt:
    """Greatest 1 - cos of the angle of the tool's axis at the samples, over that of the cone, minus 1, (B, 1)."""

    cone: Cone
    kinematics: ToolKinematics

    def __call__(self, rollout: Rollout) -> Array:
        """The excess."""
        greatest: Array = self.terms(rollout).max(axis=1, keepdims=True)
        return greatest

    def terms(self, rollout: Rollout) -> Array:
        """The same at every sample, (B, samples)."""
        count = rollout.dynamics.samples
        chosen = (self.cone.segments[:, None] * count + np.arange(count)).reshape(-1)
        excess: Array = self.kinematics.tilt(rollout.q[:, chosen], self.cone.axis, self.cone.direction)
        return excess / self.cone.most - 1.0


@final
@dataclass(frozen=True, eq=False)
class _ProvenTilt:
    """The same, at most 0 only if it is proven at every instant."""

    sampled: Tilt

    def __call__(self, rollout: Rollout) -> Array:
        return proven_excess(self.sampled(rollout), rollout, self._decided, self.terms)

    def terms(self, rollout: Rollout) -> Array:
        """Peaks over the limit, minus 1, plus a small retreat, (B, segments)."""
        cone = self.sampled.cone
        peaks = peaks_between(rollout, lambda q: self.sampled.kinematics.tilt(q, cone.axis, cone.direction))
        excess: Array = peaks[:, cone.segments] / cone.most - 1.0 + RETREAT
        return excess

    def _decided(self, rollout: Rollout, asked: Array) -> Array:
        cone, bounds, pieces = self.sampled.cone, PieceBounds.of(rollout), Pieces.of(rollout, DECIDING)
        chosen = pieces.rows(asked[pieces.owner] & np.isin(pieces.segment, cone.segments))
        found = decide(lambda some: cone.over(bounds, some), chosen, np.array([cone.most]), motions=len(asked))
        return np.minimum(found / cone.most - 1.0, MOST_EXCESS)


def _cone(segment: ToolSegment, robot: Robot, points: ViaPoints, ends: tuple[int, int]) -> Cone:
    robot.check_body("an upright axis of the tool")
    axis = np.array(segment.axis)
    direction = segment.direction
    if direction is None:
        pull = np.asarray(robot.model.gravity.linear)
        up = -pull / np.linalg.norm(pull) if pull.any() else np.array([0.0, 0.0, 1.0])
        tilt = float(ToolKinematics.of(robot).tilt(points.positions[segment.from_point], axis, up))
        direction = up if tilt <= 1.0 else -up
    return Cone(segment, read_only(axis), read_only(direction), np.arange(*ends))


def _cone_limit(cone: Cone, robot: Robot, *, certified: bool) -> Constraint:
    tilt = Tilt(cone, ToolKinematics.of(robot))
    # The share is one of 1 - cos, which is smooth where the axis is upright.
    sampled = Constraint(
        (f"tilt {cone.segment.label}",), "upright axis of the tool", tilt, tilt.terms, quantity="tilt", unit="1"
    )
    if not certified:
        return sampled
    proof = _ProvenTilt(tilt)
    return replace(sampled, function=proof, terms=proof.terms, sampled=sampled, proof="pieces")


def _check_upright(cone: Cone, robot: Robot, points: ViaPoints, curves: dict[int, FixedCurve]) -> None:
    """Refuse a cone that a point or a line leaves whatever the motion is."""
    segment, kinematics = cone.segment, ToolKinematics.of(robot)
    for point in range(segment.from_point, segment.last + 1):
        _check_at(cone, kinematics, points.positions[point][None], [f"at point {point}"])
        curve = curves.get(point)
        if curve is not None and point < segment.last:
            shares = np.linspace(0.0, 1.0, _LOOKED)
            q = curve(np.ones((1, 1))).evaluate(shares[None])[0]
            places = [
                f"at {100.0 * curve.share(u):.0f} % of the {curve.segment.tool} {curve.segment.label}" for u in shares
            ]
            _check_at(cone, kinematics, q, places)


def _check_at(cone: Cone, kinematics: ToolKinematics, q: Array, places: Sequence[str]) -> None:
    tilt = kinematics.tilt(q, cone.axis, cone.direction)
    worst = int(tilt.argmax())
    if tilt[worst] > cone.most * (1.0 + _SAME):
        angle, most = (np.degrees(2.0 * np.arcsin(np.sqrt(0.5 * value))) for value in (tilt[worst], cone.most))
        raise InvalidInputError(
            f"{cone.segment.name}: upright: {places[worst]} the tool's axis {np.round(cone.axis, 4).tolist()} is "
            f"{angle:.4g} deg from {np.round(cone.direction, 4).tolist()}, more than the {most:.4g} deg allowed"
        )
