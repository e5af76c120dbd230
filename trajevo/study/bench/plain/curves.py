"""Motions as SciPy makes them: one decision vector -> piecewise polynomials of all joints."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import BSpline, PPoly, make_interp_spline
from scipy.special import roots_jacobi

from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError

#: Degree of splines through points, and the derivatives that are 0 at both ends.
_DEGREES = {"quintic_spline": (5, (1, 2)), "septic_spline": (7, (1, 2, 3))}

#: Control points of the smooth quartic beside a point, in shares of the velocity there times the segment's time.
_BESIDE = np.array([-0.375, -0.125, 0.125, 0.375])

#: Orders of derivatives that the shape of a B-spline can hold at both ends.
_HELD = {"position": (), "velocity": (1,), "acceleration": (1, 2), "jerk": (1, 2, 3)}


class Timed(NamedTuple):
    """What an interpolant makes of a decision vector.

    Attributes:
        variables: number of its variables.
        curve: variables (n,) and points (K, n_joints) -> motion.
    """

    variables: int
    curve: Callable[[Array, Array], PPoly]


def curve_of(kind: str, points: int, settings: Mapping[str, Any], controlled: Sequence[int]) -> Timed:
    """The interpolant of a name.

    Args:
        kind: its name.
        points: number K of points.
        settings: the problem's settings.
        controlled: numbers of the joints that have free control points.

    Raises:
        InvalidInputError: it has no plain statement.
    """
    if kind == "cubic":
        return Timed(points + 1, _virtual_cubic)
    if kind in _DEGREES:
        degree, held = _DEGREES[kind]
        return Timed(points - 1, lambda x, q: _spline(x, q, degree, held))
    if kind == "polynomial":
        return Timed(points - 1, _polynomial)
    if kind == "hybrid":
        return Timed(points - 1, _hybrid)
    if kind == "bspline":
        shape, gaps = settings["bspline"], points - 1
        weights = gaps * (shape["control_points"] + 1) if shape["knots"] == "free" else 0
        free = len(controlled) * len(_free_controls(gaps, shape)[1])
        return Timed(gaps + weights + free, lambda x, q: _b_spline(x, q, shape, list(controlled)))
    raise InvalidInputError(f"interpolant: no plain statement of {kind!r}")


def _virtual_cubic(h: Array, q: Array) -> PPoly:
    """Cubic spline with a free knot after the first and before the last point, at rest without acceleration."""
    t = np.concatenate([[0.0], np.cumsum(h)])
    known = np.delete(t, [1, len(t) - 2])
    still = [(order, np.zeros(q.shape[1])) for order in (1, 2)]
    knots = np.concatenate([[0.0] * 3, t, [t[-1]] * 3])
    return pieces_of(make_interp_spline(known, q, k=3, t=knots, bc_type=(still, still)))


def _spline(h: Array, q: Array, degree: int, held: tuple[int, ...]) -> PPoly:
    t = np.concatenate([[0.0], np.cumsum(h)])
    still = [(order, np.zeros(q.shape[1])) for order in held]
    return pieces_of(make_interp_spline(t, q, k=degree, bc_type=(still, still)))


def _polynomial(h: Array, q: Array) -> PPoly:
    """The one polynomial through all points, at rest without acceleration at both ends, cut at the points."""
    t = np.concatenate([[0.0], np.cumsum(h)])
    unit, powers = t / t[-1], range(len(t) + 4)
    rows = [unit**power for power in powers]
    ends = [[_falling(p, k) * end ** float(max(p - k, 0)) for p in powers] for k in (1, 2) for end in (0.0, 1.0)]
    matrix = np.concatenate([np.stack(rows, axis=1), np.array(ends)])
    whole = np.linalg.solve(matrix, np.concatenate([q, np.zeros((4, q.shape[1]))]))
    one = PPoly(whole[::-1, None, :], [0.0, 1.0])
    taylor = [one(unit[:-1], order) / _falling(order, order) / t[-1] ** order for order in powers[::-1]]
    return PPoly(np.stack(taylor), t)


def _hybrid(h: Array, q: Array) -> PPoly:
    """Septics at both ends, and four quartic pieces between each two inner points, smooth to the jerk."""
    t = np.concatenate([[0.0], np.cumsum(h)])
    slopes = (q[2:] - q[:-2]) / (t[2:] - t[:-2])[:, None]
    pieces = [_hermite(h[0], [q[0], 0.0, 0.0, 0.0], [q[1], slopes[0], 0.0, 0.0])]
    for k in range(1, len(h) - 1):
        before = q[k] + _BESIDE[:, None] * slopes[k - 1] * h[k]
        after = q[k + 1] + _BESIDE[:, None] * slopes[k] * h[k]
        step = h[k] / 4.0
        spline = BSpline(step * np.arange(-4.0, 9.0), np.concatenate([before, after]), 4)
        for start in step * np.arange(4.0):
            low = [spline(start, order) / _falling(order, order) for order in range(4)]
            fourth = spline(start + 0.5 * step, 4) / 24.0  # jumps at the ends of the piece
            pieces.append(np.stack([*[0.0 * fourth] * 3, fourth, *low[::-1]]))
    pieces.append(_hermite(h[-1], [q[-2], slopes[-1], 0.0, 0.0], [q[-1], 0.0, 0.0, 0.0]))
    inner = [t[k] + h[k] * np.arange(4) / 4.0 for k in range(1, len(h) - 1)]
    breaks = np.concatenate([[0.0], *inner, t[-2:]])
    return PPoly(np.stack(pieces, axis=1), breaks)


def _hermite(h: float, start: list[Any], end: list[Any]) -> Array:
    """The septic with given position, velocity, acceleration and jerk at both ends, (8, n_joints), highest first."""
    matrix = [[_falling(p, k) * 0.0 ** max(p - k, 0) if p >= k else 0.0 for p in range(8)] for k in range(4)]
    matrix += [[_falling(p, k) if p >= k else 0.0 for p in range(8)] for k in range(4)]
    values = [state[k] * h**k + 0.0 * start[0] for state in (start, end) for k in range(4)]
    unit = np.linalg.solve(np.array(matrix), np.stack(values))
    found: Array = (unit / h ** np.arange(8.0)[:, None])[::-1]
    return found


def _b_spline(x: Array, q: Array, shape: Mapping[str, Any], controlled: list[int]) -> PPoly:
    """B-spline through the points whose free control points are those of the plain spline plus offsets."""
    degree, each, held = shape["degree"], shape["control_points"] + 1, _HELD[shape["ends"]]
    gaps = len(q) - 1
    h, t = x[:gaps], np.concatenate([[0.0], np.cumsum(x[:gaps])])
    weights = np.ones((gaps, each))
    if shape["knots"] == "free":
        weights = x[gaps : gaps * (each + 1)].reshape(gaps, each)
    parts = (weights / weights.sum(axis=1, keepdims=True) * h[:, None]).reshape(-1)
    ends = np.concatenate([[0.0], np.cumsum(parts)])
    ends[::each] = t
    knots = np.concatenate([[0.0] * degree, ends, [ends[-1]] * degree])
    follow, free = _free_controls(gaps, shape)
    basis = BSpline(knots, np.eye(len(follow) + len(free)), degree)
    greville = np.array([knots[k + 1 : k + degree + 1].mean() for k in range(len(follow) + len(free))])
    plain = _spline(h, q, degree, tuple(range(1, (degree + 1) // 2)))
    control = np.linalg.solve(basis(greville), plain(greville))
    control[free[:, None], controlled] += x[len(x) - len(controlled) * len(free) :].reshape(-1, len(free)).T
    matrix = np.concatenate([basis(t), *(basis(t[[0, -1]], order) for order in held)])
    values = np.concatenate([q, np.zeros((2 * len(held), q.shape[1]))])
    control[follow] = np.linalg.solve(matrix[:, follow], values - matrix[:, free] @ control[free])
    return pieces_of(BSpline(knots, control, degree))


def _free_controls(gaps: int, shape: Mapping[str, Any]) -> tuple[Array, Array]:
    """Numbers of the control points that follow from points and ends, and of the others."""
    degree, each, held = shape["degree"], shape["control_points"] + 1, len(_HELD[shape["ends"]])
    count = gaps * each + degree
    middles = np.arange(1, gaps) * each + (degree - 1) // 2
    follow = np.unique([*range(held + 1), *range(count - held - 1, count), *middles])
    return follow, np.setdiff1d(np.arange(count), follow)


def pieces_of(spline: BSpline) -> PPoly:
    """The polynomials between knots that differ."""
    knots = np.unique(spline.t)
    taylor = [spline(knots[:-1], order) / _falling(order, order) for order in range(spline.k, -1, -1)]
    return PPoly(np.stack(taylor), knots)


def _falling(power: int, order: int) -> float:
    """Factor of a power's derivative of an order: p (p - 1) ... (p - k + 1)."""
    return float(math.perm(power, order)) if power >= order else 0.0


def extremes(curve: PPoly, order: int) -> tuple[Array, Array]:
    """Least and greatest value of a derivative of every joint over the motion, shapes (n_joints,) [SI]."""
    rate = curve.derivative(order) if order else curve
    widths = np.diff(rate.x)
    powers = widths[:, None] ** np.arange(len(rate.c) - 1, -1, -1)
    ends = np.concatenate([rate.c[-1], np.einsum("kij,ik->ij", rate.c, powers)])
    least, greatest = ends.min(axis=0), ends.max(axis=0)
    if len(rate.c) == 1:
        return least, greatest
    slope = rate.derivative()
    for joint in range(ends.shape[1]):
        roots = PPoly(slope.c[:, :, joint], slope.x).roots(discontinuity=False, extrapolate=False)
        inside = roots[np.isfinite(roots)]
        if len(inside):
            values = PPoly(rate.c[:, :, joint], rate.x)(inside)
            least[joint], greatest[joint] = min(least[joint], values.min()), max(greatest[joint], values.max())
    return least, greatest


def square_integral(curve: PPoly, order: int) -> Array:
    """∫ (derivative)² dt of every joint over the motion, exact, shape (n_joints,) [SI]."""
    rate = curve.derivative(order)
    nodes, weights = np.polynomial.legendre.leggauss(len(rate.c))
    t = rate.x[:-1, None] + 0.5 * (1.0 + nodes) * np.diff(rate.x)[:, None]
    total: Array = (np.square(rate(t)) * (0.5 * np.diff(rate.x)[:, None] * weights)[..., None]).sum(axis=(0, 1))
    return total


def lobatto_shares(count: int) -> Array:
    """Gauss-Lobatto nodes on [0, 1], both ends included, shape (count,)."""
    inner = roots_jacobi(count - 2, 1.0, 1.0)[0] if count > 2 else np.empty(0)
    return 0.5 * (1.0 + np.concatenate([[-1.0], inner, [1.0]]))


def instants(curve: PPoly, shares: Array) -> Array:
    """Instants at shares of every piece of a motion, shape (pieces x shares,) [s]."""
    found: Array = (curve.x[:-1, None] + shares * np.diff(curve.x)[:, None]).reshape(-1)
    return found


def states(curve: PPoly, shares: Array) -> tuple[Array, Array, Array]:
    """Positions, velocities and accelerations at shares of every piece, shapes (pieces x shares, n_joints) [SI].

    At the end of a piece they are the piece's own: accelerations may jump there.
    """
    h, found = np.diff(curve.x)[:, None] * shares, []
    for order in range(3):
        rate = curve.derivative(order) if order else curve
        value = np.zeros((*h.shape, rate.c.shape[2]))
        for coefficient in rate.c:
            value = value * h[..., None] + coefficient[:, None]
        found.append(value.reshape(-1, value.shape[2]))
    return found[0], found[1], found[2]
