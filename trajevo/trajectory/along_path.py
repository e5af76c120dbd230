"""Trajectories along a fixed path: s(u(t)), whose shape does not depend on the decision variables."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any, SupportsIndex, final

import numpy as np

from trajevo.base.arrays import Array, frozen, read_only
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError
from trajevo.trajectory.batch import TrajectoryBatch, checked_factor, checked_order, checked_shares, chosen_rows
from trajevo.trajectory.parameterisation import ORDERS, Course
from trajevo.trajectory.polynomial import PolynomialBatch

#: Share of the motion below which a segment is no more than rounding of two instants that coincide.
_SHORTEST = 1e-12


@final
@dataclass(frozen=True, eq=False)
class ComposedBatch(TrajectoryBatch):
    """B motions along one path, each a time course in unit time that is stretched to a duration.

    Peaks are guaranteed: never below the true ones, and above them by at most the course's tolerance.

    Attributes:
        course: the B time courses in unit time.
        durations: shape (B,) [s]; complex steps are kept.
        breaks: instants where u(t) changes its polynomial or crosses a knot of the path, shape (B, S + 1) [s].

    Raises:
        InvalidInputError: another number of durations, or one that is not positive.
    """

    course: Course
    durations: Array
    breaks: Array = field(init=False)

    __repr__ = brief

    def __post_init__(self) -> None:
        durations = read_only(self.durations)
        if durations.shape != (len(self.course),):
            raise InvalidInputError(f"durations: expected shape ({len(self.course)},), got {durations.shape}")
        if not (np.isfinite(durations).all() and (durations.real > 0.0).all()):
            raise InvalidInputError(f"durations: expected positive times [s], got {durations.tolist()}")
        object.__setattr__(self, "durations", durations)
        object.__setattr__(self, "breaks", frozen(self.course.breaks * durations[:, None]))

    def __len__(self) -> int:
        return len(self.durations)

    def __getitem__(self, index: SupportsIndex | slice) -> ComposedBatch:
        rows = chosen_rows(len(self), index)
        return ComposedBatch(self.course.rows(rows), self.durations[rows])

    def real_rows(self, rows: Array) -> ComposedBatch:
        """The chosen motions without complex steps."""
        course = replace(self.course, control_points=self.course.control_points[rows].real)
        return ComposedBatch(course, self.durations[rows].real)

    def slowed(self, factor: float) -> ComposedBatch:
        """The same time courses in ``factor`` times the durations."""
        return ComposedBatch(self.course, self.durations * checked_factor(factor))

    @property
    def n_joints(self) -> int:
        """Number of axes of the path."""
        return self.course.path.n_axes

    @property
    def degree(self) -> int:
        """Degree of s(u(t)) within a segment."""
        return (self.course.path.order - 1) * (self.course.order - 1)

    def evaluate(self, t: Array, derivative: int = 0) -> Array:
        """Values at instants; derivatives up to the jerk."""
        order = _up_to_jerk(derivative)
        share = self._instants(t) / self.durations[:, None]
        unit = share + (np.clip(share.real, 0.0, 1.0) - share.real)
        return frozen(np.moveaxis(self.course.at(unit, order), 0, -1) * self._scale(order)[:, None, None])

    def at_shares(self, u: Array, derivative: int) -> Array:
        """Values at shares of every segment; derivatives up to the jerk."""
        order = _up_to_jerk(derivative)
        values = np.moveaxis(self.course.at_shares(checked_shares(u), order), 0, -1)
        return frozen(values.reshape(len(self), -1, self.n_joints) * self._scale(order)[:, None, None])

    def extremes(self, derivative: int) -> tuple[Array, Array]:
        """Guaranteed bounds of the least and the greatest value; exact for the position."""
        order = _up_to_jerk(derivative)
        lower, upper = (bound * self._scale(order)[:, None] for bound in self.course.extremes(order))
        return frozen(lower), frozen(upper)

    def peak(self, derivative: int) -> Array:
        """Guaranteed bound of the greatest absolute value; exact for the position."""
        order = _up_to_jerk(derivative)
        if order == 0:
            lower, upper = self.extremes(0)
            return frozen(np.maximum(-lower, upper))
        return frozen(self.course.peak(order) * self._scale(order)[:, None])

    def hull_peak(self, derivative: int) -> Array:
        """Bound (20)-(25) of Paing 2021 for velocity, acceleration or jerk, shape (B, n_axes) [rad/s^d or m/s^d]."""
        return frozen(self.course.hull_peak(derivative) * self._scale(derivative)[:, None])

    def integral_of_square(self, derivative: int) -> Array:
        """By Gauss-Legendre quadrature with enough nodes to be exact for every segment."""
        order = _up_to_jerk(derivative)
        return frozen(self.course.integral_of_square(order) * (self.durations ** (1 - 2 * order))[:, None])

    def jump(self, derivative: int) -> Array:
        """Value after minus value before each inner break."""
        ends = self.at_shares(np.array([0.0, 1.0]), derivative).reshape(len(self), -1, 2, self.n_joints)
        return frozen(ends[:, 1:, 0] - ends[:, :-1, 1])

    def definition(self, index: int) -> dict[str, Any]:
        """Both B-splines: the path s(u) and the time course u(t / duration)."""
        path, course = self.course.path, self.course
        return {
            "kind": "s(u(t / duration)), both clamped B-splines",
            "duration [s]": float(self.durations[index]),
            "path": {"order": path.order, "knots": path.knots.tolist(), "control_points": path.control_points.tolist()},
            "u": {
                "order": course.order,
                "knots": course.knots.tolist(),
                "control_points": course.control_points[index].tolist(),
            },
        }

    def polynomials(self, index: int) -> PolynomialBatch:
        """One motion as polynomials of time: s(u(t)) of every segment, composed in rationals and then rounded once.

        Segments shorter than 1e-12 of the motion, at which it is continuous, become part of the one before.
        """
        (ends,), (spans,), (pieces,) = self.course.rows(slice(index, index + 1)).segments
        duration, count = Fraction(float(self.durations[index].real)), self.course.n_spans
        begins = [k for k in range(len(spans)) if k == 0 or ends[k + 1].real - ends[k].real > _SHORTEST]
        breaks = np.append(ends.real[begins] * float(duration), float(duration))
        rows = []
        for begin, k in zip(breaks, begins, strict=False):
            u = _moved(
                _exact(self.course.coefficients[:, index, spans[k]]), Fraction(begin) / duration * count - spans[k]
            )
            u[0] -= Fraction(float(self.course.path.breaks[pieces[k]]))
            axes = [_composed(_exact(s), u) for s in self.course.path.pieces(0)[:, :, pieces[k]].T]
            rows.append([[float(c * (count / duration) ** i) for i, c in enumerate(axis)] for axis in axes])
        return PolynomialBatch(breaks[None], np.array([rows]))

    def _scale(self, derivative: int) -> Array:
        scale: Array = self.durations ** float(-derivative)
        return scale


def _up_to_jerk(derivative: int) -> int:
    order = checked_order(derivative)
    if order > max(ORDERS):
        raise InvalidInputError(f"derivative: expected 0 to {max(ORDERS)}, got {derivative}")
    return order


def _exact(numbers: Array) -> list[Fraction]:
    """The rationals that doubles stand for."""
    return [Fraction(float(x)) for x in numbers.real]


def _moved(a: list[Fraction], start: Fraction) -> list[Fraction]:
    """Coefficients of p(start + x)."""
    return _composed(a, [start, Fraction(1)])


def _composed(outer: list[Fraction], inner: list[Fraction]) -> list[Fraction]:
    """Coefficients of a polynomial of a polynomial, ascending, by Horner's scheme."""
    found = [outer[-1]]
    for c in reversed(outer[:-1]):
        product = [Fraction(0)] * (len(found) + len(inner) - 1)
        for i, x in enumerate(found):
            for k, y in enumerate(inner):
                product[i + k] += x * y
        found = [product[0] + c, *product[1:]]
    return found
