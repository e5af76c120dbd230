"""Motions along a fixed path, where only u(t) is free: a B-spline (Paing 2021), as fast as limits allow.

For a fixed shape of u(t), velocity, acceleration and jerk scale with 1/T, 1/T² and 1/T³, so that the least feasible
duration has a closed form: T = max over axes of peak₁/v, √(peak₂/a), ∛(peak₃/j), with the peaks in unit time.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError, checked_name
from trajevo.path.curve import GeometricPath
from trajevo.path.via_points import ViaPoints
from trajevo.robot.joints import JointLimits
from trajevo.trajectory.along_path import ComposedBatch
from trajevo.trajectory.batch import DERIVATIVES
from trajevo.trajectory.interpolants.interpolant import Interpolant, Variable, decision_vectors
from trajevo.trajectory.parameterisation import ORDERS, Course
from trajevo.trajectory.polynomial import PolynomialBatch

#: How the peaks that set the least duration are bounded: the true ones, or the paper's (20)-(25).
BOUNDS = ("tight", "hull")

#: What the time variable is: the share of the way from the least to the longest time, seconds, or none (least time).
TIMINGS = ("share", "seconds", "least")

#: How many fewer rises than control points there are: (18) fixes three at each end, c₀ = c₁ = c₂ = 0 and mirrored.
_TAKEN = 5

#: Added to every rise, so that u(t) increases strictly, as the paper asks, even where all of them are 0.
_LEAST_RISE = 1e-12

#: Slope at an end, as a share of the greatest, below which a path is at rest there.
_AT_REST = 1e-9

#: Share by which durations are stretched, so that rounding does not exceed a limit.
_ROUNDING = 1e-14


@final
@dataclass(frozen=True, eq=False)
class Reparameterisation(Interpolant):
    """u(t) of (6), at rest at both ends by construction (18), with its rises as variables, under limits of every axis.

    Attributes:
        path: the path, of order 4 at least, so that it has a jerk.
        limits: only those of velocity, acceleration and jerk are used; one of them must be finite.
        longest_time: t_max [s].
        bound: one of ``BOUNDS``.
        timing: one of ``TIMINGS``.
        control_points: number of control points of u(t), at least 7.
        order: order of u(t), at least 4.
        tolerance: share by which a tight peak may exceed the true one.

    Raises:
        UnknownNameError: no such bound or timing.
        InvalidInputError: an argument out of range, another number of axes, or no finite limit.
    """

    path: GeometricPath
    limits: JointLimits
    longest_time: float = field(kw_only=True)
    bound: str = field(default="tight", kw_only=True)
    timing: str = field(default="share", kw_only=True)
    control_points: int = field(default=16, kw_only=True)
    order: int = field(default=6, kw_only=True)
    tolerance: float = field(default=1e-6, kw_only=True)

    __repr__ = brief

    def __post_init__(self) -> None:
        checked_name("limits", self.bound, BOUNDS)
        checked_name("timing", self.timing, TIMINGS)
        _check(self.path, self.limits, self.longest_time)
        _at_least("order", self.order, 4)
        _at_least("control_points", self.control_points, max(self.order, _TAKEN + 2))
        len(self.even_course)  # refuses a tolerance out of range

    @property
    def n_rises(self) -> int:
        """Number of rises between free control points."""
        return self.control_points - _TAKEN

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Rises of u between control points, where only their ratios matter, and the time variable if there is one."""
        rises = tuple(Variable(f"rise_{i + 1}", "1", 0.0, 1.0) for i in range(self.n_rises))
        if self.timing == "least":
            return rises
        if self.timing == "share":
            return (*rises, Variable("slowness", "1", 0.0, 1.0))
        return (*rises, Variable("time", "s", self._no_faster(), self.longest_time))

    @property
    def even_course(self) -> Course:
        """The course whose control points rise evenly, a batch of one."""
        return self._made(np.ones((1, self.n_rises)))

    @property
    def points(self) -> ViaPoints:
        """The path's own positions at its parameters."""
        return ViaPoints(self.path(self.path.parameters))

    def __call__(self, x: Array) -> ComposedBatch:
        """Motions along the path for decision vectors, shape (B, n_variables)."""
        course, last = self._course(x)
        return ComposedBatch(course, self._durations(course, last))

    def via_times(self, x: Array) -> Array:
        """Instants at which the path's parameters are reached, (B, n_variables) -> (B, n_points) [s]."""
        course, last = self._course(x)
        instants = course.instants_of(np.asarray(self.path.parameters)) * self._durations(course, last)[:, None]
        return frozen(instants)

    def least_durations(self, course: Course) -> Array:
        """Least duration of every course under the limits, in closed form, shape (B,) [s]."""
        peak = course.peak if self.bound == "tight" else course.hull_peak
        return _least_durations([peak(order) for order in ORDERS], self.limits)

    def with_seconds(self, x: Array) -> Array:
        """Decision vectors (B, n_variables) of this interpolant -> those of the same one with ``timing="seconds"``."""
        course, last = self._course(x)
        return np.column_stack([np.atleast_2d(x)[:, : self.n_rises], self._durations(course, last)])

    def from_seconds(self, x: Array) -> Array:
        """The inverse of :meth:`with_seconds` for ``timing="share"``; a time below the least becomes the least."""
        rises, seconds = x[:, : self.n_rises], x[:, self.n_rises]
        least = self.least_durations(self._made(rises))
        return np.column_stack([rises, slowness(least, seconds, self.longest_time)])

    def course_of(self, control_points: Array) -> Course:
        """The courses of control points of u(t), shape (B, control_points), from 0 to 1 and at rest at both ends."""
        return Course(self.path, control_points, order=self.order, tolerance=self.tolerance)

    def rises_of(self, control_points: Array) -> Array:
        """The rises whose courses these are, the greatest of each 1, (B, control_points) -> (B, n_rises)."""
        rises = np.diff(control_points[:, 2:-2], axis=1)
        found: Array = rises / rises.max(axis=1, keepdims=True)
        return found

    def _durations(self, course: Course, last: Array) -> Array:
        if self.timing == "seconds":
            return last
        least = self.least_durations(course)
        return least if self.timing == "least" else _slowed(least, last, self.longest_time)

    def _course(self, x: Array) -> tuple[Course, Array]:
        """The courses and the time variables of decision vectors."""
        given = decision_vectors(x, len(self.variables))
        return self._made(given[:, : self.n_rises]), given[:, -1]

    def _made(self, rises: Array) -> Course:
        return self.course_of(self._control_points(rises))

    def _control_points(self, rises: Array) -> Array:
        """Control points of (6) with (18) built in, shape (B, control_points)."""
        good = np.isfinite(rises).all(axis=1) & (rises.real >= 0.0).all(axis=1)
        if not good.all():
            row = int(np.flatnonzero(~good)[0])
            raise InvalidInputError(f"x: expected rises from 0 on, got {rises[row].tolist()} in row {row}")
        climbed = np.cumsum(rises + _LEAST_RISE, axis=1)
        c = np.zeros((len(rises), self.control_points), dtype=rises.dtype)
        c[:, 3:-2] = climbed / climbed[:, -1:]
        c[:, -3:] = 1.0
        return c

    def _no_faster(self) -> float:
        """A time that no motion can beat: every axis must cross its extent from rest to rest [s]."""
        lower, upper = self.path.extremes(0)
        extent = upper - lower
        v, a, j = (_limit(self.limits, order) for order in ORDERS)
        needed = np.stack([extent / v, 2.0 * np.sqrt(extent / a), (32.0 * extent / j) ** (1.0 / 3.0)])
        return float(np.clip(needed.max(), 1e-6 * self.longest_time, 0.999 * self.longest_time))


@final
@dataclass(frozen=True, eq=False)
class LinearReparameterisation(Interpolant):
    """u = t / T, the paper's baseline (section VI.D): the path itself must be at rest at both ends.

    Attributes:
        path: a path with s' = s'' = 0 at both ends, see ``at_rest`` of :class:`~trajevo.path.curve.GeometricPath`.
        limits: as for :class:`Reparameterisation`, whose two bounds are equal here.
        longest_time: t_max [s].

    Raises:
        InvalidInputError: as for :class:`Reparameterisation`, or a path that is not at rest at its ends.
    """

    path: GeometricPath
    limits: JointLimits
    longest_time: float = field(kw_only=True)

    def __post_init__(self) -> None:
        _check(self.path, self.limits, self.longest_time)
        for order in (1, 2):
            if np.abs(self.path([0.0, 1.0], order)).max() > _AT_REST * self.path.peak(order).max():
                raise InvalidInputError("path: u = t / T needs a path that is at rest at both ends")

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The share of the way from the least to the longest time."""
        return (Variable("slowness", "1", 0.0, 1.0),)

    @property
    def points(self) -> ViaPoints:
        """The path's own positions at its parameters."""
        return ViaPoints(self.path(self.path.parameters))

    def __call__(self, x: Array) -> PolynomialBatch:
        """Motions along the path for decision vectors, shape (B, 1)."""
        durations = self._durations(x)
        scaled = self.path.pieces(0).T[None] * durations[:, None, None, None] ** -np.arange(float(self.path.order))
        return PolynomialBatch(self.path.breaks * durations[:, None], scaled)

    def via_times(self, x: Array) -> Array:
        """Instants at which the path's parameters are reached, (B, 1) -> (B, n_points) [s]."""
        return frozen(np.asarray(self.path.parameters) * self._durations(x)[:, None])

    def _durations(self, x: Array) -> Array:
        given = decision_vectors(x, 1)
        least = _least_durations([self.path.peak(order)[None] for order in ORDERS], self.limits)
        return _slowed(least, given[:, 0], self.longest_time)


def _slowed(least: Array, share: Array, longest: float) -> Array:
    """Durations at shares of the way from the least to the longest; rounding makes none less than the least."""
    stretched = longest - (1.0 - share) * (longest - least)
    durations: Array = np.where(stretched.real > least.real, stretched, least)
    return durations


def slowness(least: Array, seconds: Array, longest: float) -> Array:
    """Shares of the way from the least to the longest duration at which ``seconds`` lie, from 0 to 1, shape (B,)."""
    room = longest - least
    share = 1.0 - np.divide(longest - seconds, room, out=np.ones_like(room), where=room > 0.0)
    return np.clip(share, 0.0, 1.0)


def _least_durations(peaks: list[Array], limits: JointLimits) -> Array:
    """Least durations under limits, from the peaks of velocity, acceleration, jerk in unit time, each (B, n_axes)."""
    needed = []
    for order, peak in zip(ORDERS, peaks, strict=True):
        limit = _limit(limits, order)
        kept = np.isfinite(limit)
        needed.append((peak[:, kept] / limit[kept]) ** (1.0 / order))
    longest: Array = np.concatenate(needed, axis=1).max(axis=1) * (1.0 + _ROUNDING)
    return longest


def _limit(limits: JointLimits, order: int) -> Array:
    limit: Array = getattr(limits, DERIVATIVES[order])
    return limit


def _check(path: GeometricPath, limits: JointLimits, longest_time: Any) -> None:
    """Refuse arguments with which no motion along a path can be planned."""
    if not isinstance(path, GeometricPath):
        raise InvalidInputError(f"path: expected a GeometricPath, got {type(path).__name__}")
    if path.order < 4:
        raise InvalidInputError(f"path: expected order 4 at least, so that it has a jerk, got {path.order}")
    if len(limits.velocity) != path.n_axes:
        raise InvalidInputError(f"limits: expected {path.n_axes} axes as in the path, got {len(limits.velocity)}")
    if not (isinstance(longest_time, int | float) and np.isfinite(longest_time) and longest_time > 0.0):
        raise InvalidInputError(f"longest_time: expected a positive time [s], got {longest_time!r}")
    for name in DERIVATIVES[1:]:
        sides = limits.sides(name)
        if not sides.agree:
            raise InvalidInputError(
                f"limits: expected one limit of {name} for both directions, as motions along a path are planned by "
                f"bounds of magnitudes, got {sides.forward.tolist()} forward and {sides.backward.tolist()} backward; "
                f"give the lesser as {name}"
            )
    if not any(np.isfinite(_limit(limits, order)).any() for order in ORDERS):
        raise InvalidInputError("limits: expected a finite velocity, acceleration or jerk limit, got inf alone")


def _at_least(name: str, value: Any, least: int) -> None:
    if not isinstance(value, int) or isinstance(value, bool) or value < least:
        raise InvalidInputError(f"{name}: expected a whole number of at least {least}, got {value!r}")
