"""Shapes of motions enclosed over boxes of their segment times: coefficients are rational in the times.

A shape is the motion of a decision vector in a time of its own: only the ratios of the segment times matter, since
velocities, accelerations and jerks of a motion that takes T times as long are 1/T, 1/T² and 1/T³ of what they were. The
variables of a box are the logarithms of the ratios of neighbouring segment times, and the first segment's time is 1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError
from trajevo.trajectory.interpolants import (
    HybridQuartic,
    ImprovedQuarticBSpline,
    Interpolant,
    QuinticSpline,
    SepticSpline,
    SinglePolynomial,
)
from trajevo.trajectory.interpolants.hermite import hermite_matrix
from trajevo.trajectory.interpolants.improved_quartic import OFFSETS, PIECES, QUARTIC_BASIS
from trajevo.verification.bounds.enclosed import Enclosed, stacked
from trajevo.verification.bounds.pieces import EnclosedShape, ShapePieces, Times
from trajevo.verification.bounds.splines import OddSpline


def shape_of(interpolant: Interpolant) -> EnclosedShape:
    """The pieces of an interpolant as a function of enclosed segment times.

    Raises:
        InvalidInputError: an interpolant whose variables are not only the times between its points, or that has states
            of its own at points or ends.
    """
    kind: Any = type(interpolant)
    if kind not in _SHAPES:
        known = ", ".join(one.__name__ for one in _SHAPES)
        raise InvalidInputError(
            f"interpolant: bounds from below are known of {known}, whose variables are times; got {kind.__name__}"
        )
    own = [name for name in ("at_rest", "velocities", "cyclic") if getattr(interpolant, name, None)]
    ends = ("start_velocity", "start_acceleration", "end_velocity", "end_acceleration")
    own += [name for name in ends if np.any(getattr(interpolant, name, 0.0))]
    if own:
        raise InvalidInputError(
            f"interpolant: bounds from below are known of motions from rest to rest that are free at their inner "
            f"points; got {own[0]}"
        )
    return _SHAPES[kind](interpolant)


@final
@dataclass(frozen=True, eq=False)
class _Quartic:
    """The improved quartic B-spline, with septic first and last segments if it is the hybrid."""

    positions: Array
    form: str
    hybrid: bool
    widest: float = 0.4
    degree: int | None = None

    def __call__(self, times: Times) -> ShapePieces:
        pieces, rates, last = [], [], times.segments - 1
        for k in range(times.segments):
            rate = times.product({k: -1.0})
            if self.hybrid and k in (0, last):
                pieces.append(self._septic(k, times))
                rates.append(rate)
            else:
                pieces += self._quartics(k, times)
                rates += [rate.times(PIECES)] * PIECES
        return ShapePieces(stacked(pieces, -3), stacked(rates))

    def _reach(self, i: int, k: int, times: Times) -> Enclosed:
        """Rate of the control points of point i in segment k, times the duration of that segment, (B, n_joints)."""
        p = self.positions
        if i in (0, len(p) - 1):
            return times.known(np.zeros(p.shape[1]))
        if self.form == "printed":
            return times.known(p[i + 1] - p[i])
        other = i if k == i - 1 else i - 1
        share = (times.product({}) + times.product({other: 1.0, k: -1.0})).to_power(-1.0)
        return share.shaped(-1).times(p[i + 1] - p[i - 1])

    def _quartics(self, k: int, times: Times) -> list[Enclosed]:
        """The four pieces of a segment, as polynomials of the degree of all pieces."""
        near, far = OFFSETS[self.form]
        controls = []
        for i in (k, k + 1):
            place, reach = times.known(self.positions[i]), self._reach(i, k, times)
            controls += [place + reach.times(offset) for offset in (-far, -near, near, far)]
        degree = 7 if self.hybrid else 4
        basis = np.pad(QUARTIC_BASIS, ((0, degree - 4), (0, 0)))
        return [stacked(controls[i : i + 5]).through(basis) for i in range(PIECES)]

    def _septic(self, k: int, times: Times) -> Enclosed:
        """The first or the last segment, from the spline's state where they meet."""
        first, count = k == 0, len(self.positions)
        near, far = OFFSETS[self.form]
        end, meeting = (0, 1) if first else (count - 1, count - 2)
        spline = k if times.segments == 2 else 1 if first else times.segments - 2
        if self.form == "printed":  # the rate is that of the spline's side, in the septic's time
            rate = times.product({k: 1.0, spline: -1.0}).shaped(-1) * self._reach(meeting, spline, times)
        else:
            rate = self._reach(meeting, k, times)
        velocity = rate.times((near + far / 3.0) * PIECES)
        ratio = times.product({k: 2.0, spline: -2.0}).shaped(-1)
        jerk = (rate * ratio).times((far / 3.0 - near) * PIECES**3)
        still = times.known(np.zeros(self.positions.shape[1]))
        rest = [times.known(self.positions[end]), still, still, still]
        joint = [times.known(self.positions[meeting]), velocity, still, jerk]
        return stacked(rest + joint if first else joint + rest).through(hermite_matrix(4))


@final
@dataclass(frozen=True, eq=False)
class _SinglePolynomial:
    """One polynomial through all points, at rest without acceleration at both ends.

    It is the quintic step from the first to the last point, plus a multiple of u³ (1 - u)³ ∏ (u - u_j) for each inner
    point i, with j the other inner points, that takes it to the point at u_i.
    """

    positions: Array
    widest: float = 0.06
    degree: int | None = None

    def __call__(self, times: Times) -> ShapePieces:
        p, inverse = self.positions, times.total.to_power(-1.0)
        inner = range(1, len(p) - 1)
        passed = [times.product({0: 1.0})]
        for k in range(1, times.segments):
            passed.append(passed[-1] + times.product({k: 1.0}))
        at = {i: passed[i - 1] * inverse for i in inner}
        left = {i: times.known(1.0) - at[i] for i in inner}
        degree = len(p) + 3
        step = np.zeros(degree + 1)
        step[3:6] = (10.0, -15.0, 6.0)
        base = np.zeros((p.shape[1], degree + 1))
        base[:] = (p[-1] - p[0])[:, None] * step
        base[:, 0] += p[0]
        whole = times.known(base)
        for i in inner:
            whole = whole + self._bump(i, at, left, times, degree)
        return ShapePieces(whole.shaped(-3), inverse.shaped(-1))

    def _bump(self, i: int, at: dict[int, Enclosed], left: dict[int, Enclosed], times: Times, degree: int) -> Enclosed:
        """The multiple of an inner point, (B, n_joints, degree + 1)."""
        p, u = self.positions, at[i]
        # u³ (10 - 15 u + 6 u²) at the point, and what divides the product there.
        reached = u.to_power(3.0) * (times.known(10.0) - u.times(15.0) + u.to_power(2.0).times(6.0))
        missing = times.known(p[i] - p[0]) - reached.shaped(-1).times(p[-1] - p[0])
        scale = (u * left[i]).to_power(-3.0)
        row = np.zeros(degree + 1)
        row[3:7] = (1.0, -3.0, 3.0, -1.0)
        polynomial = times.known(row)
        for j in at:
            if j != i:
                apart = ((u - at[j]) if j < i else (at[j] - u)).to_power(-1.0)
                scale = scale * apart if j < i else -(scale * apart)
                moved = polynomial.through(np.eye(degree + 1, k=-1))
                polynomial = moved - polynomial * at[j].shaped(-1)
        return (missing * scale.shaped(-1)).shaped(-1) * polynomial.shaped(-2)


_SHAPES: dict[type[Interpolant], Callable[[Any], EnclosedShape]] = {
    HybridQuartic: lambda one: _Quartic(one.points.positions, one.form, True),
    ImprovedQuarticBSpline: lambda one: _Quartic(one.points.positions, one.form, False),
    QuinticSpline: lambda one: OddSpline(one.points.positions, 3),
    SepticSpline: lambda one: OddSpline(one.points.positions, 4),
    SinglePolynomial: lambda one: _SinglePolynomial(one.points.positions),
}
