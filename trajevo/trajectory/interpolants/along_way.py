"""Motions of the tool along a line or an arc: one fixed curve of the joints, in a time that is free.

Since the curve does not depend on its time, neither does its distance from the line: what is shown for one motion holds
for all. It is a spline through postures on the way, so many of them that it stays within half the tolerance. The tool
goes along the way as a single polynomial goes from rest to rest: 10 u³ - 15 u⁴ + 6 u⁵ or, where jerk is 0 at the ends
too, 35 u⁴ - 84 u⁵ + 70 u⁶ - 20 u⁷, u from 0 to 1. Where it does not rest at one end, it goes along one half of such a
law, with the greatest speed at that end and no acceleration along the way; where it rests at neither, evenly.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, final

import numpy as np

from trajevo.base import polynomials
from trajevo.base.arrays import Array, read_only
from trajevo.base.shown.brief import brief
from trajevo.errors import UnreachableError
from trajevo.path.segments import ToolSegment
from trajevo.path.tool_ways import ToolWay, WayPostures
from trajevo.path.via_points import ViaPoints
from trajevo.robot.joints import Sides
from trajevo.robot.robot import Robot
from trajevo.trajectory.interpolants.interpolant import Interpolant, Variable, check_durations, checked_bounds
from trajevo.trajectory.interpolants.splines.odd_degree import QuinticSpline, SepticSpline
from trajevo.trajectory.peak_shares import peak_shares
from trajevo.trajectory.polynomial import PolynomialBatch

#: Shares of the way as ascending powers of the share of time, by the spline along it.
_LAWS: dict[type[QuinticSpline | SepticSpline], tuple[float, ...]] = {
    QuinticSpline: (0.0, 0.0, 0.0, 10.0, -15.0, 6.0),
    SepticSpline: (0.0, 0.0, 0.0, 0.0, 35.0, -84.0, 70.0, -20.0),
}

#: Share of the way near an end from which slopes there are taken, and places there.
_NEAR, _FITTED = 0.1, 11

#: Numbers of pieces that are tried, share of the tolerances that the curve may use, and samples of a piece.
_PIECES, _USED, _SAMPLES = (3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96), 0.5, 9


@final
@dataclass(frozen=True, eq=False)
class FixedCurve(Interpolant):
    """A fixed curve of the joints, in a time that is free.

    Attributes:
        segment: what it is for.
        way: the way of the tool.
        law: share of the way as ascending powers of the share of time.
        breaks: ends of its pieces as shares of the time, shape (S + 1,).
        coefficients: of a motion that takes 1 s, shape (S, n_joints, degree + 1).
        deviation: greatest distance found between the tool and the way [m].
        turned: greatest angle found between the tool's orientation and that of the way [rad].
        duration_bounds: least and greatest time [s].
    """

    segment: ToolSegment
    way: ToolWay
    law: tuple[float, ...]
    breaks: Array
    coefficients: Array
    deviation: float
    turned: float
    duration_bounds: tuple[float, float] = field(kw_only=True)

    __repr__ = brief

    def __post_init__(self) -> None:
        object.__setattr__(self, "duration_bounds", checked_bounds(self.duration_bounds))

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The time."""
        return (Variable("dt_1", "s", *self.duration_bounds),)

    def __call__(self, x: Array) -> PolynomialBatch:
        """The curve in times of shape (B, 1) [s]."""
        times = check_durations(x, 1)
        powers = times[:, :, None, None] ** -np.arange(self.coefficients.shape[-1], dtype=np.float64)
        breaks = times * self.breaks
        breaks[:, 0] = 0.0
        return PolynomialBatch(breaks, self.coefficients * powers)

    def via_times(self, x: Array) -> Array:
        """0 and the time, (B, 1) -> (B, 2) [s]."""
        times: Array = check_durations(x, 1) * np.array([0.0, 1.0])
        return times

    @property
    def pieces(self) -> int:
        """Number of its pieces."""
        return len(self.breaks) - 1

    @property
    def states(self) -> dict[str, tuple[Array, Array]]:
        """Velocity and acceleration at the start and the end of a motion that takes 1 s, (n_joints,) each."""
        unit = self(np.ones((1, 1)))
        found = [unit.at_shares(np.array([0.0, 1.0]), order)[0, [0, -1]] for order in (1, 2)]
        return {"start": (found[0][0], found[1][0]), "end": (found[0][1], found[1][1])}

    def share(self, u: Array) -> Array:
        """Share of the way by the share of time, any shape."""
        return np.asarray(polynomials.values(np.array(self.law), u))

    def least_times(self, velocity: Sides, acceleration: Sides, jerk: Sides) -> Array:
        """Least time that each joint needs within limits, which may be inf, shapes (n_joints,) [s].

        Args:
            velocity: of each joint [rad/s or m/s].
            acceleration: the same [rad/s² or m/s²].
            jerk: the same [rad/s³ or m/s³].
        """
        unit = self(np.ones((1, 1)))
        needed = [
            peak_shares(unit, order, limit)[0] ** (1.0 / order)
            for order, limit in enumerate((velocity, acceleration, jerk), start=1)
        ]
        least: Array = np.max(needed, axis=0)
        return least

    def with_more_columns(self, count: int) -> FixedCurve:
        """The same for points with further columns, which are 0."""
        wider = np.pad(self.coefficients, [(0, 0), (0, count), (0, 0)])
        return replace(self, coefficients=read_only(wider))


def curve_along(segment: ToolSegment, robot: Robot, points: ViaPoints, *, kind: str) -> FixedCurve:
    """The curve of a segment along its line or arc.

    Args:
        segment: the segment.
        robot: the robot.
        points: the points, of which it joins two.
        kind: interpolant of the rest of the motion; ``septic_spline`` begins and ends with jerk 0 here too.

    Raises:
        UnreachableError: a place on the way that the robot does not reach, or too near to a singular posture to be
            followed within the tolerance.
        InvalidInputError: as :meth:`~trajevo.path.tool_ways.ToolWay.of`.
    """
    ends = points.positions[[segment.from_point, segment.last]]
    postures = WayPostures.of(segment, robot, *ends)
    made: Any = SepticSpline if kind == "septic_spline" else QuinticSpline
    for pieces in _PIECES:
        curve = _with_pieces(postures, made, pieces)
        if curve.deviation <= _USED * segment.tolerance and curve.turned <= _USED * segment.turning:
            return curve
    raise UnreachableError(
        f"{segment.name}: cannot be followed within {1e3 * segment.tolerance:g} mm and "
        f"{np.degrees(segment.turning):g} deg: with {_PIECES[-1]} pieces the tool is still up to "
        f"{1e3 * curve.deviation:.3g} mm and {np.degrees(curve.turned):.3g} deg away, since the {segment.tool} passes "
        "near a singular posture; allow more, or choose other points"
    )


def _law(made: type[QuinticSpline | SepticSpline], rest: str) -> tuple[float, ...]:
    """Share of the way as ascending powers of the share of time."""
    if rest == "none":
        return (0.0, 1.0)
    whole = np.polynomial.Polynomial(_LAWS[made])
    if rest == "start":
        whole = 2.0 * whole(np.polynomial.Polynomial([0.0, 0.5]))
    elif rest == "end":
        whole = 2.0 * whole(np.polynomial.Polynomial([0.5, 0.5])) - 1.0
    return tuple(whole.coef.tolist())


def _end_states(postures: WayPostures, law: Array) -> dict[str, Array]:
    """Velocities and accelerations at both ends of a motion that takes 1 s."""
    found: dict[str, Array] = {}
    for name, end, side in (("start", 0.0, 1.0), ("end", 1.0, -1.0)):
        shares = end + side * _NEAR * 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, _FITTED)))
        fit = np.polynomial.chebyshev.Chebyshev.fit
        each = [fit(shares, column, _FITTED - 2) for column in postures.at(shares).T]
        slope, bend = (np.array([one.deriv(order)(end) for one in each]) for order in (1, 2))
        speed, rate = (float(polynomials.values(polynomials.derivative(law, k), np.array(end))) for k in (1, 2))
        found |= {f"{name}_velocity": slope * speed, f"{name}_acceleration": bend * speed**2 + slope * rate}
    return found


def _with_pieces(postures: WayPostures, made: Any, pieces: int) -> FixedCurve:
    law = _law(made, postures.segment.rest)
    states = _end_states(postures, np.array(law))
    shares = np.linspace(0.0, 1.0, pieces + 1)
    through = ViaPoints(postures.at(polynomials.values(np.array(law), shares)))
    spline: PolynomialBatch = made(through, duration_bounds=(1e-3, 1.0), **states)(np.full((1, pieces), 1.0 / pieces))
    u = (shares[:-1, None] + np.linspace(0.0, 1.0 / pieces, _SAMPLES)).reshape(-1)
    q = spline.at_shares(np.linspace(0.0, 1.0, _SAMPLES), 0)[0]
    apart = postures.way.apart(postures.kinematics, polynomials.values(np.array(law), u), q)
    return FixedCurve(
        postures.segment,
        postures.way,
        law,
        read_only(shares),
        read_only(spline.coefficients[0]),
        *(float(each.max()) for each in apart),
        duration_bounds=(0.5, 1.0),
    )
