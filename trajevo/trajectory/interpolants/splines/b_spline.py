"""Clamped B-splines of degree 3, 5 or 7 with free control points between the via points, which they pass exactly.

Every via point is a knot, and every gap between two of them has ``control_points`` more knots, evenly or freely: then
each piece has a weight, and takes as much of its gap as its weight is of their sum. A spline with these knots is the
spline of its degree without free control points, of which only the times are variables, plus a B-spline whose control
points are free but for those that follow: the first and the last ones from what is held at both ends, and one at every
inner via point, that in the middle of those which act there, from passing it. So if all offsets are 0 the motion is the
spline without free control points, and freedom never makes a motion worse. An offset moves the motion on degree + 1
pieces and, through what follows from it, on few more.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property
from math import comb
from typing import Any, ClassVar, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError, checked_name, known_names
from trajevo.path.via_points import ViaPoints
from trajevo.robot.robot import Robot
from trajevo.trajectory.interpolants.hermite import odd_spline, solve_block_tridiagonal
from trajevo.trajectory.interpolants.interpolant import (
    Variable,
    alike,
    breaks_of,
    check_durations,
    decision_vectors,
    duration_variables,
    known_velocities,
)
from trajevo.trajectory.interpolants.splines.basis import basis_pieces
from trajevo.trajectory.interpolants.splines.gaps import divided, half_widths, named_joints, on_pieces, weight_variables
from trajevo.trajectory.interpolants.splines.spline import Spline
from trajevo.trajectory.polynomial import PolynomialBatch

#: Degrees, and greatest number of free control points that a gap adds.
DEGREES, MOST = (3, 5, 7), 30

#: Where knots between via points lie.
KNOTS = ("even", "free")

#: The highest derivative that is held at both ends, by its order; those above are free.
HELD = ("position", "velocity", "acceleration", "jerk")

#: Half width of a control point's range as a share of the joint's range over the via points.
_WIDTH = 0.25


@final
@dataclass(frozen=True, eq=False)
class BSpline(Spline):
    """Clamped B-spline through the points, with free control points between them.

    All derivatives below the degree are continuous. What is held at both ends is 0, or velocity and acceleration as
    they are given.

    Attributes:
        points: at least 2 via points; only their first joints, as many as ``half_width`` has, have free control points.
        duration_bounds: least and greatest time between two points [s].
        degree: 3, 5 or 7.
        control_points: number of knots, and so of control points, in every gap between two points.
        knots: ``"even"`` in every gap, or ``"free"``: how long the pieces between them are is free too.
        ends: the highest derivative held at both ends: ``"position"``, ``"velocity"``, ``"acceleration"``, ``"jerk"``.
        half_width: how far each control point of a joint may be to either side of that of the spline without free
            control points, shape (n_joints,) [rad or m], 0 for a joint without any; a quarter of its range over the
            points if None.
        joints: names of the joints; numbered if None.
        units: their units; rad if None.
        at_rest: joints at rest at inner points, pairs (point, joint) from 0: one more control point follows from it.
        velocities: velocities at inner points, shape (n_joints,) each [rad/s or m/s], with the same effect.
        start_velocity: shape (n_joints,) [rad/s or m/s]; zero if not given, as the next three.
        start_acceleration: shape (n_joints,) [rad/s² or m/s²].
        end_velocity: shape (n_joints,) [rad/s or m/s].
        end_acceleration: shape (n_joints,) [rad/s² or m/s²].

    Raises:
        InvalidInputError: another degree, number, kind of knots or of ends; too few control points for what is held.
    """

    price_of_rest: ClassVar[str | None] = "one of its control points is no longer free"
    called: ClassVar[str] = "the B-spline"

    degree: int = field(default=3, kw_only=True)
    control_points: int = field(default=3, kw_only=True)
    knots: str = field(default="free", kw_only=True)
    ends: str = field(default="acceleration", kw_only=True)
    half_width: Array | None = field(default=None, kw_only=True)
    joints: tuple[str, ...] | None = field(default=None, kw_only=True)
    units: tuple[str, ...] | None = field(default=None, kw_only=True)

    __repr__ = brief

    def __post_init__(self) -> None:
        super().__post_init__()
        check_shape(self.degree, self.control_points, self.knots, self.ends)
        self._name_joints()
        self._check_ends()
        least = self._held + 2 - self._middle
        if self._known[0] and self.control_points < max(least, 2):
            raise InvalidInputError(
                f"control_points: expected at least {max(least, 2)} in a gap where a velocity is given at an inner "
                f"point, got {self.control_points}"
            )

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The times; how long pieces between free knots are; and the offsets of control points, joint by joint."""
        return self._variables

    def __call__(self, x: Array) -> PolynomialBatch:
        """Motions for decision vectors of shape (B, n_variables)."""
        rows = decision_vectors(x, len(self._variables))
        parts = self._parts(rows)
        pieces, basis = self._without_offsets(rows, parts), basis_pieces(parts, self.degree)
        controls = self._controls(rows, pieces, basis, parts)
        for k in range(self.degree + 1):
            pieces += basis[:, :, k, None, :] * controls[:, k : k + parts.shape[1], :, None]
        # Exactly: rounding would carry a joint past a point that lies on its limit.
        at, (known, velocities) = self._first_pieces, self._known
        pieces[..., 0][:, [0, *at]] = self.points.positions[:-1]
        pieces[:, 0, :, 1 : self._held + 1] = self._states("start")[:, 1 : self._held + 1]
        for point, joint in known:
            pieces[:, at[point - 1], joint, 1] = velocities[point, joint]
        return PolynomialBatch(breaks_of(parts), pieces)

    def via_times(self, x: Array) -> Array:
        """When the via points are passed, (B, n_variables) -> (B, n_points) [s]."""
        parts = self._parts(decision_vectors(x, len(self._variables)))
        return breaks_of(parts)[:, :: self.control_points + 1]

    @property
    def _held(self) -> int:
        """Order of the highest derivative held at the ends."""
        return HELD.index(self.ends)

    @property
    def _middle(self) -> int:
        """Place of the control point that follows from a via point among those that act on the piece from there."""
        return (self.degree - 1) // 2

    @property
    def _first_pieces(self) -> Array:
        """The pieces that begin at inner via points, shape (n_points - 2,)."""
        return np.arange(1, len(self.points) - 1) * (self.control_points + 1)

    @cached_property
    def _known(self) -> tuple[tuple[tuple[int, int], ...], Array]:
        return known_velocities(self.points.positions.shape, self.at_rest, self.velocities)

    @cached_property
    def _offsets(self) -> tuple[Array, Array]:
        """Numbers of the free control points among all, and of their joints, in the order of variables."""
        count, held = (len(self.points) - 1) * (self.control_points + 1) + self.degree, self._held + 1
        controls, joints = [], []
        for joint in np.flatnonzero(np.asarray(self.half_width)).tolist():
            more = [point for point, other in self._known[0] if other == joint]
            follow = [
                *(self._first_pieces + self._middle),
                *(self._first_pieces[k - 1] + self._middle + 1 for k in more),
            ]
            free = np.setdiff1d(np.arange(held, count - held), follow)
            controls.append(free)
            joints.append(np.full(len(free), joint))
        empty = np.empty(0, dtype=np.intp)
        return np.concatenate([empty, *controls]), np.concatenate([empty, *joints])

    @cached_property
    def _variables(self) -> tuple[Variable, ...]:
        gaps, (_, joints) = len(self.points) - 1, self._offsets
        pieces = gaps * (self.control_points + 1) if self.knots == "free" else 0
        weights = weight_variables(pieces)
        names, units, widths = self.joints or (), self.units or (), np.asarray(self.half_width).tolist()
        numbered = np.concatenate([np.arange(np.count_nonzero(joints == k)) for k in range(len(names))])
        offsets = [
            Variable(
                f"{names[joint]} of control point_{number + 1}",
                units[joint],
                -widths[joint],
                widths[joint],
                departs=True,
            )
            for joint, number in zip(joints.tolist(), numbered.tolist(), strict=True)
        ]
        return (*duration_variables(gaps, self.duration_bounds), *weights, *offsets)

    def _parts(self, rows: Array) -> Array:
        """Times between neighbouring knots, shape (B, S) [s]."""
        gaps, count = len(self.points) - 1, self.control_points
        times = check_durations(rows[:, :gaps], gaps)
        if self.knots == "even":
            return np.repeat(times / (count + 1), count + 1, axis=1)
        return divided(times, rows[:, gaps : gaps * (count + 2)])

    def _without_offsets(self, rows: Array, parts: Array) -> Array:
        """Coefficients of the spline without free control points on the pieces, (B, S, n_joints, degree + 1)."""
        gaps, each = len(self.points) - 1, self.control_points + 1
        states = np.stack([self._states(end)[:, order] * order for end in ("start", "end") for order in (1, 2)])
        spline = odd_spline(
            self.points.positions, rows[:, :gaps], (self.degree + 1) // 2, ends=states if states.any() else None
        )
        return on_pieces(spline.coefficients, parts, each)

    def _controls(self, rows: Array, pieces: Array, basis: Array, parts: Array) -> Array:
        """Control points of what is added to the spline, shape (B, S + degree, n_joints) [rad or m].

        Args:
            rows: decision vectors, shape (B, n_variables).
            pieces: coefficients of the spline, shape (B, S, n_joints, degree + 1).
            basis: those of the B-splines, shape (B, S, degree + 1, degree + 1).
            parts: times between neighbouring knots, shape (B, S) [s].
        """
        controls = np.zeros((len(rows), parts.shape[1] + self.degree, self.points.n_joints), dtype=pieces.dtype)
        free, joints = self._offsets
        controls[:, free, joints] = rows[:, len(self._variables) - len(free) :]
        for order in range((self.degree + 1) // 2, self._held + 1):  # what the spline without offsets does not hold
            start, end = self._states("start")[:, order], self._states("end")[:, order]
            controls[:, order] = (start - pieces[:, 0, :, order]) / basis[:, 0, order, order, None]
            last = _at_end(basis[:, -1, self.degree - order], parts[:, -1], order)
            controls[:, -1 - order] = (end - _at_end(pieces[:, -1], parts[:, -1:], order)) / last[:, None]
        if len(self.points) > 2:
            for members, at in alike(self._known[0], self.points.n_joints):
                self._pass_points(controls, members, at, pieces, basis)
        return controls

    def _pass_points(self, controls: Array, members: list[int], at: list[int], pieces: Array, basis: Array) -> None:
        """Set the control points that follow from passing inner points, for joints with known velocities at some."""
        first, middle, size = self._first_pieces, self._middle, 2 if at else 1
        here, knots = basis[:, first], self.control_points + 1
        given = np.isin(np.arange(1, len(self.points) - 1), at)
        drive = np.zeros((len(basis), len(first), size, len(members)), dtype=pieces.dtype)
        for place in range(self.degree):
            acting = controls[:, first + place][:, :, members]
            drive -= here[:, :, place, :size, None] * acting[:, :, None]
        if at:
            slopes = pieces[:, first][:, :, members, 1]
            drive[:, :, 1] += self._known[1][1:-1, members] - slopes
            drive[:, ~given, 1] = 0.0
        sides = {}
        for name, shift in (("left", -knots), ("here", 0), ("right", knots)):
            side = np.zeros((len(basis), len(first), size, size), dtype=basis.dtype)
            for column in range(size):
                if 0 <= middle + shift + column < self.degree:
                    side[..., column] = here[:, :, middle + shift + column, :size]
            if at:  # where the velocity is free, so is the second control point: it is left as it is
                side[:, ~given, 1] = np.eye(2)[1] if name == "here" else 0.0
            sides[name] = side
        if middle + size - 1 < knots:  # no two points share a control point that follows
            moves = np.linalg.solve(sides["here"], drive)
        else:
            moves = solve_block_tridiagonal(sides["left"][:, 1:], sides["here"], sides["right"][:, :-1], drive)
        for column in range(size):
            controls[:, (first + middle + column)[:, None], members] += moves[:, :, column]

    def _states(self, end: str) -> Array:
        """Taylor coefficients at an end that are held or given, 0 for the others, shape (n_joints, 4)."""
        states = np.zeros((self.points.n_joints, len(HELD)))
        states[:, 0] = self.points.positions[0 if end == "start" else -1]
        states[:, 1], states[:, 2] = getattr(self, f"{end}_velocity"), 0.5 * getattr(self, f"{end}_acceleration")
        return states

    def _name_joints(self) -> None:
        named = named_joints(
            self.points, self.joints, self.units, self.half_width, _WIDTH, name="half_width", or_none=True
        )
        for name, value in zip(("joints", "units", "half_width"), named, strict=True):
            object.__setattr__(self, name, value)

    def _check_ends(self) -> None:
        """Refuse states at the ends that are left free."""
        for order, kind in enumerate(HELD[1:3], start=1):
            for end in ("start", "end"):
                if self._held < order and getattr(self, f"{end}_{kind}").any():
                    raise InvalidInputError(
                        f"{end}_{kind}: expected none, as ends = {self.ends!r} leaves it free; {kind!r} holds it"
                    )


def check_shape(degree: Any, control_points: Any, knots: Any, ends: Any) -> None:
    """Refuse what no B-spline of this module has.

    Raises:
        InvalidInputError: another degree or number, or too few control points for what is held at both ends.
        UnknownNameError: no such kind of knots or ends.
    """
    if isinstance(degree, bool) or degree not in DEGREES:
        raise InvalidInputError(f"degree: expected {', '.join(map(str, DEGREES))}, got {degree!r}")
    checked_name("knots", knots, KNOTS)
    checked_name("ends", ends, HELD)
    held = HELD.index(ends)
    if held >= degree:
        raise InvalidInputError(f"ends: a B-spline of degree {degree} cannot hold its {ends}; degree 5 and 7 can")
    least = max(1, held + 1 - (degree - 1) // 2)
    if isinstance(control_points, bool) or not isinstance(control_points, int | np.integer):
        raise InvalidInputError(f"control_points: expected a whole number, got {control_points!r}")
    if not least <= control_points <= MOST:
        raise InvalidInputError(
            f"control_points: expected {least} to {MOST} in every gap with degree {degree} and ends = {ends!r}, "
            f"got {control_points}"
        )


def _at_end(coefficients: Array, parts: Array, order: int) -> Array:
    """Taylor coefficient of an order at the end of pieces, from power coefficients (..., degree + 1)."""
    powers = range(order, coefficients.shape[-1])
    terms = [comb(power, order) * coefficients[..., power] * parts ** (power - order) for power in powers]
    total: Array = sum(terms[1:], terms[0])
    return total


@final
@dataclass(frozen=True, eq=False)
class BSplineShape:
    """How the B-splines of a problem are, to be called as their class.

    Attributes:
        settings: ``degree``, ``control_points``, ``knots`` and ``ends`` of :class:`BSpline`, or some of them; all of
            them once made.
        half_width: how far control points may be to either side, shape (n_joints,) [rad or m].
        joints: names of the joints.
        units: their units.

    Raises:
        InvalidInputError: something else, or what :func:`check_shape` refuses.
    """

    takes_velocities: ClassVar[bool] = True

    settings: Mapping[str, Any]
    half_width: Array
    joints: tuple[str, ...]
    units: tuple[str, ...]

    __repr__ = brief

    def __post_init__(self) -> None:
        if not isinstance(self.settings, Mapping):
            raise InvalidInputError(f"bspline: expected {', '.join(SHAPE)} by name, got {self.settings!r}")
        for key in self.settings:
            if key not in SHAPE:
                raise InvalidInputError(f"bspline: unknown key {key!r}; {known_names(key, SHAPE)}")
        try:
            check_shape(**SHAPE | dict(self.settings))
        except InvalidInputError as error:
            raise InvalidInputError(f"bspline: {error}") from error
        object.__setattr__(self, "settings", SHAPE | dict(self.settings))

    @classmethod
    def of(cls, given: Any, robot: Robot, points: ViaPoints, *, of_joints_alone: bool = False) -> BSplineShape:
        """As a user asks for them: settings by name.

        Args:
            given: the settings.
            robot: the robot.
            points: the via points.
            of_joints_alone: whether a joint's motion matters to nothing but its own limits and objectives: then one
                that is at the same position at all points has no control points, and stands.

        Raises:
            InvalidInputError: as the class.
        """
        widths = half_widths(points, robot.joint_units, _WIDTH)
        if of_joints_alone:
            widths = np.where(np.ptp(points.positions, axis=0) > 0.0, widths, 0.0)
        return cls({} if given is None else given, widths, robot.joint_names, robot.joint_units)

    def around(self, kind: str, make: Any) -> BSplineShape:
        """The same, for the class of B-splines.

        Raises:
            InvalidInputError: another class of interpolants.
        """
        if make is not BSpline:
            raise InvalidInputError(f"bspline: {kind!r} is none; expected interpolant = 'bspline'")
        return self

    def __call__(self, points: ViaPoints, **given: Any) -> BSpline:
        """A B-spline through points."""
        own: dict[str, Any] = {"half_width": self.half_width, "joints": self.joints, "units": self.units}
        return BSpline(points, **self.settings, **own, **given)


#: Keys of the shape, and what they are if not given.
SHAPE: dict[str, Any] = {
    one.name: one.default for one in fields(BSpline) if one.name in ("degree", "control_points", "knots", "ends")
}
