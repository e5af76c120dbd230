"""Improved quartic uniform B-spline (Sun 2020, eqs. (15)-(24)), as printed and made smooth.

Every path point is replaced by four collinear control points; between two points the curve is four quartic pieces of
equal duration, and it passes every point. Two forms differ only in where the control points lie:

``"printed"``: p ∓ d/12, p ∓ d/24 with d the chord to the next point, eq. (20). The paper gives no map from time to
    the B-spline's u; here u runs from 0 to 1 on every quarter of a segment. Velocity and jerk then jump at a point
    between two spline segments of different duration: the curve is only C0 in velocity, against the paper's claim.
``"smooth"``: p ∓ 3/8 m Δt, p ∓ 1/8 m Δt with m = (p₊ - p₋)/(t₊ - t₋), the slope across the point; these are the
    Greville abscissae of the knots. Velocity m, acceleration 0 and jerk 0 hold on both sides, so the curve is C3 for
    all durations, and a straight evenly timed row of points is followed at constant speed.

At the ends of the whole curve the four control points are the point itself, rule (2) of the paper: velocity,
acceleration and jerk are 0 there.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, final

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.base.shown.brief import brief
from trajevo.errors import checked_name
from trajevo.path.via_points import ViaPoints
from trajevo.trajectory.batch import TrajectoryBatch
from trajevo.trajectory.interpolants.interpolant import (
    AtRest,
    SegmentTimes,
    breaks_of,
    check_durations,
    checked_bounds,
    checked_points,
    checked_rests,
)
from trajevo.trajectory.polynomial import PolynomialBatch

#: Uniform quartic B-spline, eq. (17): rows are powers of u, columns the five control points.
QUARTIC_BASIS = frozen(
    np.array(
        [
            [1.0, 11.0, 11.0, 1.0, 0.0],
            [-4.0, -12.0, 12.0, 4.0, 0.0],
            [6.0, -6.0, -6.0, 6.0, 0.0],
            [-4.0, 12.0, -12.0, 4.0, 0.0],
            [1.0, -4.0, 6.0, -4.0, 1.0],
        ]
    )
    / 24.0
)

#: Pieces per spline segment, eqs. (21)-(24).
PIECES = 4

#: Distance of the near and the far control points from the point, in units of (rate x segment time).
OFFSETS = {"printed": (1.0 / 24.0, 1.0 / 12.0), "smooth": (1.0 / 8.0, 3.0 / 8.0)}


@final
@dataclass(frozen=True, eq=False)
class ImprovedQuarticBSpline(SegmentTimes):
    """The improved quartic uniform B-spline of Sun 2020 through via points, from rest to rest.

    Attributes:
        points: at least 2 via points.
        form: ``"smooth"`` or ``"printed"``, see the module.
        duration_bounds: least and greatest time of a segment [s].
        at_rest: joints at rest at inner points, pairs (point, joint) from 0; there the joint's four control points
            coincide, so that its acceleration and jerk are 0 too.

    Raises:
        UnknownNameError: no such form.
        InvalidInputError: too few points, or a joint at rest that does not exist.
    """

    price_of_rest: ClassVar[str | None] = "its acceleration and jerk are 0 there too"

    form: str = field(default="smooth", kw_only=True)
    at_rest: AtRest = field(default=(), kw_only=True)

    __repr__ = brief

    def __post_init__(self) -> None:
        checked_name("form of the improved quartic B-spline", self.form, OFFSETS)
        checked_points(self.points, 2, "the improved quartic B-spline")
        object.__setattr__(self, "duration_bounds", checked_bounds(self.duration_bounds))
        object.__setattr__(self, "at_rest", checked_rests(self.at_rest, self.points))

    def __call__(self, x: Array) -> TrajectoryBatch:
        """Curves for segment times of shape (B, n_segments) [s]."""
        durations = check_durations(x, len(self.points) - 1)
        before, after = control_rates(self.points, durations, self.form, self.at_rest)
        still = np.zeros((len(durations), 1, self.points.n_joints), dtype=durations.dtype)
        start, end = np.concatenate([still, after], axis=1), np.concatenate([before, still], axis=1)
        pieces = quartic_pieces(self.points.positions, start, end, durations, self.form)
        return PolynomialBatch(breaks_of(np.repeat(durations / PIECES, PIECES, axis=1)), pieces)


def control_rates(points: ViaPoints, durations: Array, form: str, at_rest: AtRest) -> tuple[Array, Array]:
    """Rate of the control points before and after each inner point, (B, K - 2, n_joints) [rad/s or m/s].

    Args:
        points: K points.
        durations: shape (B, K - 1) [s].
        form: a name of :data:`OFFSETS`.
        at_rest: joints at rest at inner points.
    """
    p = points.positions
    if form == "smooth":
        slope = (p[2:] - p[:-2]) / (durations[:, :-1] + durations[:, 1:])[..., None]
        before = after = slope
    else:
        chord = np.diff(p, axis=0)[1:]  # p_{i+1} - p_i at the inner points, eq. (20)
        before, after = chord / durations[:, :-1, None], chord / durations[:, 1:, None]
    for point, joint in at_rest:
        before[:, point - 1, joint] = after[:, point - 1, joint] = 0.0
    return before, after


def quartic_pieces(positions: Array, start: Array, end: Array, durations: Array, form: str) -> Array:
    """The quartic pieces of spline segments one after the other.

    Args:
        positions: of the K points that they join, shape (K, n_joints) [rad or m].
        start: rates of the control points where segments begin, shape (B, K - 1, n_joints) [rad/s or m/s].
        end: the same where they end.
        durations: shape (B, K - 1) [s].
        form: a name of :data:`OFFSETS`.

    Returns:
        Power coefficients in the time since each piece's beginning, (B, 4 (K - 1), n_joints, 5) [rad/s^k or m/s^k].
    """
    near, far = OFFSETS[form]
    offsets = np.array([-far, -near, near, far])
    p, span = positions[:, :, None], durations[:, :, None, None]
    controls = np.concatenate(
        [p[:-1] + offsets * start[..., None] * span, p[1:] + offsets * end[..., None] * span], axis=-1
    )
    windows = np.lib.stride_tricks.sliding_window_view(controls, 5, axis=-1)  # (B, K - 1, n_joints, 4, 5)
    unit = np.moveaxis(windows @ QUARTIC_BASIS.T, 3, 2)  # (B, K - 1, 4, n_joints, 5)
    pieces = unit / (durations[:, :, None, None, None] / PIECES) ** np.arange(5)
    return np.asarray(pieces.reshape(len(durations), PIECES * durations.shape[1], *pieces.shape[3:]))
