"""Geometric paths: B-spline curves s(u), 0 <= u <= 1, through points or near them.

Numbers in brackets are equations of Piegl and Tiller, *The NURBS Book* (1996), or of Paing 2021 where so stated.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, final

import numpy as np

from trajevo.base import polynomials
from trajevo.base.arrays import Array, frozen, numbers, read_only
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError, checked_name
from trajevo.path.via_points import ViaPoints

#: Highest derivative that is bounded and evaluated: jerk along a path needs s'''.
MOST_DERIVATIVES = 3

#: Exponent of the chord lengths that give the parameters of the points.
PARAMETERS = {"uniform": 0.0, "centripetal": 0.5, "chord": 1.0}


@final
@dataclass(frozen=True, eq=False)
class GeometricPath:
    """A clamped B-spline curve on [0, 1], continuously differentiable (order - 2) times.

    Attributes:
        knots: order equal knots at 0 and at 1, inner ones increasing, shape (n_control_points + order,) [1].
        control_points: shape (n_control_points, n_axes) [m or rad].
        parameters: u at the points through or near which the path was fitted, shape (n_points,) [1]; if None, the u
            where polynomial pieces meet.

    Raises:
        InvalidInputError: shapes that do not fit, knots that are not clamped or do not increase, or an order below 2.
    """

    knots: Array
    control_points: Array
    parameters: Array | None = None

    __repr__ = brief

    def __post_init__(self) -> None:
        knots = numbers(self.knots, name="knots", shape=("n_control_points + order",))
        control_points = numbers(self.control_points, name="control_points", shape=("n_control_points", "n_axes"))
        object.__setattr__(self, "knots", read_only(knots))
        object.__setattr__(self, "control_points", read_only(control_points))
        if control_points.shape[1] < 1:
            raise InvalidInputError("control_points: expected at least 1 axis")
        if not 2 <= self.order <= len(control_points):
            raise InvalidInputError(
                f"knots: {len(knots)} knots over {len(control_points)} control points give order {self.order}; "
                f"expected an order from 2 to the number of control points"
            )
        inner = knots[self.order : -self.order]
        clamped = (knots[: self.order] == 0.0).all() and (knots[-self.order :] == 1.0).all()
        if not (clamped and (np.diff(np.concatenate([[0.0], inner, [1.0]])) > 0.0).all()):
            raise InvalidInputError(
                f"knots: expected {self.order} zeros, increasing inner knots, {self.order} ones, got {knots.tolist()}"
            )
        given = self.breaks if self.parameters is None else self.parameters
        object.__setattr__(self, "parameters", read_only(_rising(given)))

    @classmethod
    def through(
        cls,
        points: Any,
        *,
        order: int = 6,
        parameters: str | Any = "centripetal",
        knots: str | Any = "averaging",
        at_rest: bool = False,
    ) -> GeometricPath:
        """The curve that passes through every point.

        Args:
            points: shape (n_points, n_axes) [m or rad].
            order: order of the B-spline, its degree plus one.
            parameters: how the points get their u: ``"centripetal"``, ``"chord"``, ``"uniform"``, or the values of u.
            knots: ``"averaging"`` (9.8), ``"uniform"``, ``"quantiles"`` (at equal shares of the points), or the inner
                knots themselves.
            at_rest: make s' and s'' zero at both ends, with two more control points at each.

        Raises:
            InvalidInputError: fewer points than the order, a point that repeats the one before, or inner knots that
                leave the curve undetermined.
            UnknownNameError: no such parameters or knots.
        """
        given = ViaPoints(points).positions
        if len(given) < order and not at_rest:
            raise InvalidInputError(f"points: a curve of order {order} needs at least {order}, got {len(given)}")
        return _fitted(given, len(given) + (4 if at_rest else 0), order, parameters, knots, at_rest)

    @classmethod
    def near(
        cls,
        points: Any,
        *,
        control_points: int,
        order: int = 6,
        parameters: str | Any = "centripetal",
        knots: str | Any = "averaging",
        at_rest: bool = False,
    ) -> GeometricPath:
        """The curve with a given number of control points that comes nearest to the points and meets both ends.

        Args:
            points: shape (n_points, n_axes) [m or rad].
            control_points: from the order to the number of points.
            order: order of the B-spline.
            parameters: as for :meth:`through`.
            knots: ``"averaging"`` (9.68, 9.69), ``"shifted"`` (the same with indices that count from 1, which
                reproduces Paing 2021), ``"uniform"``, ``"quantiles"``, or the inner knots themselves.
            at_rest: make s' and s'' zero at both ends, which takes two of the control points at each.

        Returns:
            The curve of least Σ |s(u_i) - point_i|² over the inner points.

        Raises:
            InvalidInputError: as for :meth:`through`, or another number of control points.
            UnknownNameError: no such parameters or knots.
        """
        given = ViaPoints(points).positions
        least, most = order + (4 if at_rest else 0), len(given) + (4 if at_rest else 0)
        if len(given) < order:
            raise InvalidInputError(f"points: a curve of order {order} needs at least {order}, got {len(given)}")
        if not isinstance(control_points, int) or not least <= control_points <= most:
            raise InvalidInputError(
                f"control_points: expected a whole number from {least} to {most}, got {control_points!r}"
            )
        return _fitted(given, control_points, order, parameters, knots, at_rest)

    @property
    def order(self) -> int:
        """Order of the B-spline, its degree plus one."""
        return len(self.knots) - len(self.control_points)

    @property
    def n_axes(self) -> int:
        """Number of axes."""
        return int(self.control_points.shape[1])

    @cached_property
    def breaks(self) -> Array:
        """Parameters at which polynomial pieces meet, both ends included, shape (n_pieces + 1,) [1]."""
        return frozen(np.unique(self.knots))

    def pieces(self, derivative: int) -> Array:
        """Coefficients of a derivative by u, ascending powers of u - break [units of the axes].

        Shape (order - derivative or 1, n_axes, n_pieces).
        """
        return self._pieces[_checked(derivative)]

    def __call__(self, u: Any, derivative: int = 0) -> Array:
        """The position or a derivative in u, (...,) -> (..., n_axes) [m or rad].

        Raises:
            InvalidInputError: u outside [0, 1], or a derivative other than 0 to 3.
        """
        at = np.asarray(u, dtype=np.float64)
        if not ((at >= 0.0) & (at <= 1.0)).all():
            raise InvalidInputError(f"u: expected numbers from 0 to 1, got {at.min():g} to {at.max():g}")
        piece = np.searchsorted(self.breaks[1:-1], at, side="right")
        local = self.pieces(derivative)[..., piece]
        return frozen(np.moveaxis(polynomials.values(local, at - self.breaks[piece]), 0, -1))

    def extremes(self, derivative: int) -> tuple[Array, Array]:
        """Exact least and greatest value of a derivative by u, two arrays (n_axes,) [units of the axes]."""
        lower, upper = self._extremes
        return lower[_checked(derivative)], upper[derivative]

    def peak(self, derivative: int) -> Array:
        """Exact max |d-th derivative| on [0, 1] of every axis, shape (n_axes,), for (21), (23), (25) of Paing 2021."""
        lower, upper = self.extremes(derivative)
        return frozen(np.maximum(-lower, upper))

    @property
    def settings(self) -> dict[str, Any]:
        """Keyword arguments that make an equal path, as plain data."""
        return {
            "knots": self.knots.tolist(),
            "control_points": self.control_points.tolist(),
            "parameters": self._at.tolist(),
        }

    @property
    def _at(self) -> Array:
        return np.asarray(self.parameters)

    @cached_property
    def _pieces(self) -> list[Array]:
        from scipy.interpolate import BSpline  # imported where it computes, since that takes long

        spline = BSpline(self.knots, self.control_points, self.order - 1)
        powers = np.stack([spline(self.breaks[:-1], k).T / math.factorial(k) for k in range(self.order)])
        return [frozen(polynomials.derivative(powers, taken)) for taken in range(MOST_DERIVATIVES + 1)]

    @cached_property
    def _extremes(self) -> tuple[Array, Array]:
        widths = np.diff(self.breaks)
        unit = self.pieces(0) * widths ** np.arange(self.order)[:, None, None]
        shape = (MOST_DERIVATIVES + 1, self.n_axes, len(widths))
        per_u = widths ** -np.arange(MOST_DERIVATIVES + 1, dtype=np.float64)[:, None, None]
        bounds = polynomials.extremes(unit.reshape(self.order, -1), MOST_DERIVATIVES + 1)
        lower, upper = (bound.reshape(shape) * per_u for bound in bounds)
        return frozen(lower.min(axis=2)), frozen(upper.max(axis=2))


def _fitted(points: Array, count: int, order: int, parameters: Any, knots: Any, at_rest: bool) -> GeometricPath:
    """The least-squares curve with ``count`` control points; if these are enough, it passes through all points."""
    from scipy.interpolate import BSpline  # imported where it computes, since that takes long

    if not isinstance(order, int) or order < 2:
        raise InvalidInputError(f"order: expected a whole number of at least 2, got {order!r}")
    if isinstance(parameters, str):
        chords = np.linalg.norm(np.diff(points, axis=0), axis=1)
        steps = chords ** PARAMETERS[checked_name("parameters", parameters, PARAMETERS)]
        u = np.concatenate([[0.0], np.cumsum(steps) / steps.sum()])
        u[-1] = 1.0
    else:
        u = _rising(parameters)
        if len(u) != len(points):
            raise InvalidInputError(f"parameters: expected {len(points)}, one for each point, got {len(u)}")
    if isinstance(knots, str):
        inner = KNOTS[checked_name("knots", knots, KNOTS)](u, count, order)
    else:
        inner = numbers(knots, name="knots", shape=(count - order,))
    vector = np.concatenate([np.zeros(order), inner, np.ones(order)])
    path = GeometricPath(vector, np.zeros((count, points.shape[1])), u)
    basis = BSpline.design_matrix(u, path.knots, order - 1).toarray()
    ends = 3 if at_rest else 1
    first, last = (basis[:, part].sum(axis=1) for part in (slice(None, ends), slice(-ends, None)))
    wanted = points - first[:, None] * points[0] - last[:, None] * points[-1]
    free = basis[1:-1, ends:-ends]
    found, _, rank, _ = np.linalg.lstsq(free, wanted[1:-1], rcond=None)
    if rank < free.shape[1]:
        raise InvalidInputError(
            f"knots: {count - order} inner knots leave {free.shape[1] - rank} control points undetermined; "
            f"use fewer control points or other knots or parameters"
        )
    return GeometricPath(vector, np.concatenate([points[:1]] * ends + [found] + [points[-1:]] * ends), u)


def _checked(derivative: int) -> int:
    if derivative not in range(MOST_DERIVATIVES + 1):
        raise InvalidInputError(f"derivative: expected 0 to {MOST_DERIVATIVES}, got {derivative!r}")
    return derivative


def _rising(parameters: Any) -> Array:
    given = numbers(parameters, name="parameters", shape=("n_points",))
    if len(given) < 2 or given[0] != 0.0 or given[-1] != 1.0 or (np.diff(given) <= 0.0).any():
        raise InvalidInputError(f"parameters: expected numbers increasing from 0 to 1, got {given.tolist()}")
    return given


def _averaging(u: Array, count: int, order: int) -> Array:
    """(9.8) for as many control points as points, (9.68) and (9.69) for fewer."""
    if count == len(u):
        return np.array([u[j : j + order - 1].mean() for j in range(1, count - order + 1)])
    return _spread(u, count, order, 0)


def _spread(u: Array, count: int, order: int, shift: int) -> Array:
    """(9.69), every knot between the parameters of two points; a ``shift`` of 1 uses the points one earlier."""
    spacing = len(u) / (count - order + 1)
    places = spacing * np.arange(1, count - order + 1)
    before = np.floor(places).astype(int)
    share = places - before
    knots: Array = (1.0 - share) * u[before - 1 - shift] + share * u[before - shift]
    return knots


def _quantiles(u: Array, count: int, order: int) -> Array:
    shares = np.linspace(0.0, len(u) - 1.0, count - order + 2)[1:-1]
    return np.interp(shares, np.arange(len(u)), u)


def _uniform(u: Array, count: int, order: int) -> Array:
    del u
    return np.linspace(0.0, 1.0, count - order + 2)[1:-1]


#: Rules for the inner knots: parameters of the points, number of control points, order -> inner knots.
KNOTS: dict[str, Callable[[Array, int, int], Array]] = {
    "averaging": _averaging,
    "shifted": lambda u, count, order: _spread(u, count, order, 1),
    "uniform": _uniform,
    "quantiles": _quantiles,
}
