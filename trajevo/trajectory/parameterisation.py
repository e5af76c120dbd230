"""Time courses along a fixed path in unit time: s(u(t)), 0 <= t <= 1, with B-splines s(u) and u(t).

Numbers in brackets are equations of Paing 2021. :func:`peaks` and :func:`signed_terms` are the paper's bounds of the
derivatives; :class:`Course` has values, integrals, and bounds that are guaranteed and tight. Between the instants where
a piece of u(t) ends or where u(t) crosses a knot of the path, s(u(t)) is a polynomial of degree (order of path - 1) x
(order of u - 1); everything is computed segment by segment between those instants, for all courses at once. A motion
that takes T seconds has the d-th derivatives of its course divided by T^d.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cache, cached_property, reduce
from math import factorial, perm
from typing import final

import numpy as np

from trajevo.base import polynomials
from trajevo.base.arrays import Array, frozen, read_only, row_products
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError
from trajevo.path.curve import GeometricPath
from trajevo.trajectory.bernstein import gauss, greatest_magnitude, least_tolerance, local_greatest

#: Velocity, acceleration, jerk.
ORDERS = (1, 2, 3)

#: Offsets of the velocity and acceleration coefficients that occur in the terms of (25), from the jerk coefficient.
_MEETING = ((0, 0), (1, 0), (1, 1), (2, 1))


def derived_coefficients(control_points: Array, knots: Array, order: int) -> list[Array]:
    """Coefficients (10), (12), (14) of the derivatives of u(t) in unit time, each (B, n_control_points - order)."""
    c, found = control_points, []
    for taken in ORDERS:
        last = c.shape[1] - 1
        c = (order - taken) * np.diff(c, axis=1) / (knots[order : order + last] - knots[taken : taken + last])
        found.append(c)
    return found


def peaks(path: GeometricPath, derived: list[Array]) -> list[Array]:
    """Bounds (21), (23), (25) of velocity, acceleration and jerk in unit time, each (B, n_axes)."""
    v, a, j = derived
    a, j = a * np.sign(a.real), j * np.sign(j.real)
    return [reduce(np.maximum, _terms(path, order, v, a, j)).max(axis=2).T for order in ORDERS]


def signed_terms(path: GeometricPath, derived: list[Array], derivative: int) -> Array:
    """Smooth terms whose greatest is a bound of :func:`peaks`: A and J occur with both signs; (B, n_axes, K)."""
    v, a, j = derived
    signs = [((1, 1),), ((1, 1), (-1, 1)), ((1, 1), (1, -1), (-1, 1), (-1, -1))][derivative - 1]
    terms = [term for turn, sign in signs for term in _terms(path, derivative, v, turn * a, sign * j)]
    return np.swapaxes(np.concatenate(terms, axis=2), 0, 1)


def _terms(path: GeometricPath, derivative: int, v: Array, a: Array, j: Array) -> list[Array]:
    """Terms of (21), (23) or (25), each (n_axes, B, K); v is never negative."""
    s1, s2, s3 = (path.peak(order)[:, None, None] for order in ORDERS)
    if derivative == 1:
        return [s1 * v]
    size = (v, a, j)[derivative - 1].shape[1]
    speed = [v[:, k : k + size] for k in range(derivative)]
    if derivative == 2:
        rest = s1 * a
        return [s2 * some**2 + rest for some in speed]
    rest = s1 * j
    return [s3 * speed[k] ** 3 + s2 * (3.0 * a[:, i : i + size] * speed[k]) + rest for k, i in _MEETING]


#: Number of parts of every piece of u(t); gradient solvers get the greatest value in each. That of a part with two
#: equal extremes is not smooth, and time-optimal motions along symmetric paths have pieces with two.
_PARTS = 2

#: Ends, parts and pieces of segments.
_Segments = tuple[Array, Array, Array]

#: Greatest tolerance at which a bound is still useful.
MOST_TOLERANCE = 0.1


@final
@dataclass(frozen=True, eq=False)
class Course:
    """B time courses along one path in unit time.

    Attributes:
        path: s(u).
        control_points: c of (6), not decreasing, from 0 to 1, shape (B, n_control_points); complex steps are kept.
        order: order of u(t); its inner knots are uniform.
        tolerance: share by which a guaranteed peak may exceed the true one.

    Raises:
        InvalidInputError: shapes that do not fit, control points that decrease or do not run from 0 to 1, or a
            tolerance out of range.
    """

    path: GeometricPath
    control_points: Array
    order: int = field(default=6, kw_only=True)
    tolerance: float = field(default=1e-6, kw_only=True)

    __repr__ = brief

    def __post_init__(self) -> None:
        c = read_only(self.control_points)
        object.__setattr__(self, "control_points", c)
        if c.ndim != 2 or c.shape[1] < self.order:
            raise InvalidInputError(
                f"control_points: expected shape (B, n) with n of at least the order {self.order}, got {c.shape}"
            )
        steps = np.diff(c.real, axis=1)
        if not ((steps >= 0.0).all() and (c[:, 0] == 0.0).all() and (c[:, -1] == 1.0).all()):
            raise InvalidInputError("control_points: expected rows that run from 0 to 1 and do not decrease")
        least = least_tolerance(self._nodes)
        if not least <= self.tolerance <= MOST_TOLERANCE:
            raise InvalidInputError(
                f"tolerance: expected a number from {least:.3g} to {MOST_TOLERANCE:g} for a path of order "
                f"{self.path.order}, got {self.tolerance!r}"
            )

    def __len__(self) -> int:
        return len(self.control_points)

    def rows(self, index: slice) -> Course:
        """The courses of a slice of rows."""
        return replace(self, control_points=self.control_points[index])

    @property
    def knots(self) -> Array:
        """Knots of u(t), eq. (7), shape (n_control_points + order,)."""
        return uniform_knots(self.order, self.control_points.shape[1])

    @property
    def n_spans(self) -> int:
        """Number of polynomial pieces of u(t)."""
        return int(self.control_points.shape[1]) - self.order + 1

    @cached_property
    def breaks(self) -> Array:
        """Instants where segments meet, shape (B, S + 1), from 0 to 1; two may coincide."""
        return frozen(self.segments[0])

    def instants_of(self, u: Array) -> Array:
        """Unit times at which the courses reach parameters of the path, shape (U,) -> (B, U)."""
        at_ends = self.coefficients[0].real
        span = (at_ends[:, 1:, None] <= u).sum(axis=1)
        local = np.take_along_axis(self.coefficients, span[None], axis=2)
        local[0] -= u
        share = polynomials.root_of_rising(local.reshape(self.order, -1)).reshape(span.shape)
        return frozen(np.where(u <= 0.0, 0.0, np.where(u >= 1.0, 1.0, (span + share) / self.n_spans)))

    def parameter(self, t: Array, derivative: int = 0) -> Array:
        """u(t) or one of its derivatives, eq. (8), at unit times of shape (B, T)."""
        span = np.clip(np.floor(t.real * self.n_spans).astype(np.intp), 0, self.n_spans - 1)
        local = polynomials.derivative(np.take_along_axis(self.coefficients, span[None], axis=2), derivative)
        return polynomials.values(local, t * self.n_spans - span) * float(self.n_spans) ** derivative

    def at(self, t: Array, derivative: int) -> Array:
        """Value of a derivative of s(u(t)), eqs. (15)-(17), at unit times of shape (B, T) -> (n_axes, B, T)."""
        u = [self.parameter(t, order) for order in range(derivative + 1)]
        piece = np.searchsorted(self.path.breaks[1:-1], u[0].real, side="right")
        return _chain(self.path, piece, u[0] - self.path.breaks[piece], u[1:], (derivative,))[0]

    def at_shares(self, shares: Array, derivative: int) -> Array:
        """The same at shares of every segment, (N,) -> (n_axes, B, S, N)."""
        return self._chain_at(shares, (derivative,))[0]

    def peak(self, derivative: int) -> Array:
        """Guaranteed bound of a derivative's magnitude, within the tolerance of the true peak, shape (B, n_axes)."""
        return frozen(self._peaks[_place(derivative)])

    def extremes(self, derivative: int) -> tuple[Array, Array]:
        """Guaranteed lower and upper bound of a derivative, two arrays of shape (B, n_axes)."""
        if derivative == 0:
            least, greatest = self.path.extremes(0)
            return np.tile(least, (len(self), 1)), np.tile(greatest, (len(self), 1))
        values, reach = self._at_gauss[derivative - 1], self.peak(derivative)
        lift = reach.T[:, :, None, None]
        above, below = (self._bounded(v).T - reach for v in (lift + values, lift - values))
        return -below, above

    def hull_peak(self, derivative: int) -> Array:
        """The paper's bound (20)-(25) of a derivative's magnitude, shape (B, n_axes)."""
        return self._hull_peaks[_place(derivative)]

    def hull_terms(self, derivative: int) -> Array:
        """Smooth terms whose greatest is :meth:`hull_peak`, (B, n_axes, K)."""
        return signed_terms(self.path, self._derived, ORDERS[_place(derivative)])

    def local_terms(self, derivative: int) -> Array:
        """Greatest values of a derivative and of its negative in every part of u(t), smooth in the control points.

        The greatest of them is the true peak if that lies near the best of many nodes; shape (B, n_axes, K).
        """
        found: Array = self._local[_place(derivative)]
        return found

    def integral_of_square(self, derivative: int) -> Array:
        """∫ (d-th derivative)² dt by Gauss-Legendre quadrature of every segment, exact, shape (B, n_axes)."""
        sampled = derivative > 0 and "_at_gauss" in self.__dict__  # the samples of peaks, if there are any, serve too
        nodes, weights = gauss(self._nodes if sampled else self._nodes + 1 - derivative)
        values = self._at_gauss[derivative - 1] if sampled else self.at_shares(nodes, derivative)
        widths = np.diff(self.breaks, axis=1)
        return frozen((np.square(values) @ weights * widths).sum(axis=2).T)

    @property
    def _nodes(self) -> int:
        """Number of Gauss nodes that exactly interpolate the velocity of a segment and integrate its square."""
        return (self.path.order - 1) * (self.order - 1)

    @cached_property
    def coefficients(self) -> Array:
        """Coefficients of u(t) in powers of the share of the span, ascending, shape (order, B, n_spans)."""
        flat = row_products(self.control_points, span_coefficients(self.order, self.control_points.shape[1]))
        return np.ascontiguousarray(np.moveaxis(flat.reshape(len(self), self.order, self.n_spans), 1, 0))

    @cached_property
    def segments(self) -> _Segments:
        """Ends of the segments (B, S + 1), and for each the piece of u(t) and of the path that it is in (B, S)."""
        return self._cut(1)

    def _cut(self, parts: int) -> _Segments:
        """Ends of the segments (B, S + 1), and for each segment the part and the piece of the path it is in (B, S).

        Every piece of u(t) is divided into ``parts`` equal parts.
        """
        count = self.n_spans * parts
        ends = np.tile(np.linspace(0.0, 1.0, count + 1), (len(self), 1))
        merged = np.concatenate([ends, self.instants_of(self.path.breaks[1:-1])], axis=1)
        order = np.argsort(merged.real, axis=1, kind="stable")
        crossing = order[:, :-1] > count
        return np.take_along_axis(merged, order, axis=1), np.cumsum(~crossing, axis=1) - 1, np.cumsum(crossing, axis=1)

    def _chain_at(
        self, shares: Array, wanted: tuple[int, ...], segments: _Segments | None = None, parts: int = 1
    ) -> list[Array]:
        """Derivatives of s(u(t)) at shares of every segment, each (n_axes, B, S, N)."""
        ends, part, piece = segments or self.segments
        span = part // parts
        local = np.take_along_axis(self.coefficients, span[None], axis=2)
        local = polynomials.shifted(local, ends[:, :-1] * self.n_spans - span)
        local[0] -= self.path.breaks[piece]
        widths = np.diff(ends, axis=1) * self.n_spans
        scaled = [widths**k for k in range(self.order)]
        u = []
        for order in range(max(wanted) + 1):
            rates = [perm(k, order) * float(self.n_spans) ** order for k in range(self.order)]
            stretched = [local[k] * scaled[k - order] * rates[k] for k in range(order, self.order)]
            u.append(np.stack(stretched, axis=-1) @ _powers(len(stretched), shares))
        return _chain(self.path, piece[..., None], u[0], u[1:], wanted)

    @cached_property
    def _at_gauss(self) -> list[Array]:
        return self._chain_at(gauss(self._nodes)[0], ORDERS)

    @cached_property
    def _peaks(self) -> Array:
        return np.swapaxes(self._bounded(np.stack(self._at_gauss)), 1, 2)

    @cached_property
    def _local(self) -> Array:
        segments, count = self._cut(_PARTS), self.n_spans * _PARTS
        values = np.stack([self._chain_at(gauss(self._nodes)[0], ORDERS, segments, _PARTS)] * 2)
        values[1] *= -1.0
        runs = np.arange(values[..., 0, 0].size).reshape(values.shape[:-2])[..., None]
        groups = (runs * count + segments[1]).ravel()
        found = local_greatest(values.reshape(-1, values.shape[-1]), groups)
        both = found.reshape(*values.shape[:-2], count)
        return np.swapaxes(np.concatenate([both[0], both[1]], axis=-1), 1, 2)

    def _bounded(self, values: Array) -> Array:
        """Bound of every course's magnitude, (..., S, N) -> (...)."""
        flat = values.reshape(int(np.prod(values.shape[:-2])), *values.shape[-2:])
        return greatest_magnitude(flat, self.tolerance).reshape(values.shape[:-2])

    @cached_property
    def _hull_peaks(self) -> list[Array]:
        return [frozen(peak) for peak in peaks(self.path, self._derived)]

    @cached_property
    def _derived(self) -> list[Array]:
        return derived_coefficients(self.control_points, self.knots, self.order)


def _place(derivative: int) -> int:
    """Index of velocity, acceleration or jerk in :data:`ORDERS`."""
    if derivative not in ORDERS:
        raise InvalidInputError(f"derivative: expected 1 to {max(ORDERS)}, got {derivative!r}")
    return derivative - 1


def _chain(path: GeometricPath, piece: Array, offset: Array, u: list[Array], wanted: tuple[int, ...]) -> list[Array]:
    """Time derivatives of s(u(t)) from u - break and the time derivatives of u: (15)-(17)."""

    def s(order: int) -> Array:
        return polynomials.values(path.pieces(order)[..., piece], offset)

    if wanted == (0,):
        return [s(0)]
    first = s(1)
    found = []
    if 1 in wanted:
        found.append(first * u[0])
    if max(wanted) > 1:
        second, squared = s(2), u[0] * u[0]
    if 2 in wanted:
        found.append(second * squared + first * u[1])
    if 3 in wanted:
        found.append(s(3) * (squared * u[0]) + second * (3.0 * u[0] * u[1]) + first * u[2])
    return found


@cache
def uniform_knots(order: int, count: int) -> Array:
    """Clamped uniform knots of (7) in unit time, shape (count + order,)."""
    return frozen(np.concatenate([np.zeros(order - 1), np.linspace(0.0, 1.0, count - order + 2), np.ones(order - 1)]))


@cache
def span_coefficients(order: int, count: int) -> Array:
    """Matrix from control points to coefficients in powers of the share of every span, (count, order x n_spans)."""
    from scipy.interpolate import BSpline  # imported where it computes, since that takes long

    knots, spans = uniform_knots(order, count), count - order + 1
    basis, starts = BSpline(knots, np.eye(count), order - 1), knots[order - 1 : count]
    powers = [basis(starts, nu=k).T / (factorial(k) * float(spans) ** k) for k in range(order)]
    return frozen(np.concatenate(powers, axis=1))


def _powers(count: int, shares: Array) -> Array:
    """Powers of shares, (count, N)."""
    return np.vander(shares, count, increasing=True).T
