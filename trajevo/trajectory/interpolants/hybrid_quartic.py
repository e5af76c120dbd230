"""Septic + improved quartic uniform B-spline + septic (Sun 2020, eqs. (9)-(24)), as printed and made smooth.

Every point between the ends is replaced by four collinear control points; on the segment between two such points the
curve is four quartic pieces of equal duration. The first and the last segment are septic polynomials that start and
end at rest. Two forms differ only in where the control points lie:

``"printed"``: p ∓ d/12, p ∓ d/24 with d the chord to the next point, eq. (20). The paper gives no map from time to
    the B-spline's u; here u runs from 0 to 1 on every quarter of a segment. Velocity and jerk then jump at a point
    between two spline segments of different duration: the curve is only C0 in velocity, against the paper's claim.
``"smooth"``: p ∓ 3/8 m Δt, p ∓ 1/8 m Δt with m = (p₊ - p₋)/(t₊ - t₋), the slope across the point; these are the
    Greville abscissae of the knots. Velocity m, acceleration 0 and jerk 0 hold on both sides, so the curve is C3 for
    all durations, and a straight evenly timed row of points is followed at constant speed.
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
from trajevo.trajectory.interpolants.hermite import hermite_segments
from trajevo.trajectory.interpolants.interpolant import (
    AtRest,
    Interpolant,
    Variable,
    breaks_of,
    check_durations,
    checked_bounds,
    checked_points,
    checked_rests,
    duration_variables,
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

#: Fewest points: the printed form takes the septics' inner states from a spline segment, so there must be one.
LEAST_POINTS = {"printed": 4, "smooth": 3}


@final
@dataclass(frozen=True, eq=False)
class HybridQuartic(Interpolant):
    """The hybrid curve of Sun 2020 through via points.

    Attributes:
        points: at least 3 via points, 4 for ``"printed"``.
        form: ``"smooth"`` or ``"printed"``, see the module.
        duration_bounds: least and greatest time of a segment [s].
        at_rest: joints at rest at inner points, pairs (point, joint) from 0; there the joint's four control points
            coincide, so that its acceleration and jerk are 0 too.

    Raises:
        UnknownNameError: no such form.
        InvalidInputError: too few points, or a joint at rest that does not exist.
    """

    price_of_rest: ClassVar[str | None] = "its acceleration and jerk are 0 there too"

    points: ViaPoints
    form: str = field(default="smooth", kw_only=True)
    duration_bounds: tuple[float, float] = field(kw_only=True)
    at_rest: AtRest = field(default=(), kw_only=True)

    __repr__ = brief

    def __post_init__(self) -> None:
        checked_name("form of the hybrid quartic", self.form, OFFSETS)
        checked_points(self.points, LEAST_POINTS[self.form], f"the {self.form} hybrid quartic")
        object.__setattr__(self, "duration_bounds", checked_bounds(self.duration_bounds))
        object.__setattr__(self, "at_rest", checked_rests(self.at_rest, self.points))

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The segment times."""
        return duration_variables(len(self.points) - 1, self.duration_bounds)

    def __call__(self, x: Array) -> TrajectoryBatch:
        """Curves for segment times of shape (B, n_segments) [s]."""
        durations = check_durations(x, len(self.points) - 1)
        before, after = self._rates(durations)
        inner = durations[:, 1:-1]
        spline = self._spline_pieces(after[:, :-1], before[:, 1:], inner)
        near_start = inner[:, :1] if inner.shape[1] else durations[:, :1]
        near_end = inner[:, -1:] if inner.shape[1] else durations[:, -1:]
        entry = self._state(self.points.positions[1], after[:, :1], near_start)
        leave = self._state(self.points.positions[-2], before[:, -1:], near_end)
        first = hermite_segments(self._rest(entry, 0), entry, durations[:, :1])
        last = hermite_segments(leave, self._rest(leave, -1), durations[:, -1:])
        pieces = np.repeat(inner / PIECES, PIECES, axis=1)
        breaks = breaks_of(np.concatenate([durations[:, :1], pieces, durations[:, -1:]], axis=1))
        return PolynomialBatch(breaks, np.concatenate([first, spline, last], axis=1))

    def via_times(self, x: Array) -> Array:
        """The segments' ends, (B, n_segments) -> (B, n_points) [s]."""
        return breaks_of(check_durations(x, len(self.points) - 1))

    def _rates(self, durations: Array) -> tuple[Array, Array]:
        """Rate of the control points before and after each inner point, (B, K - 2, n_joints) [rad/s or m/s]."""
        p = self.points.positions
        if self.form == "smooth":
            slope = (p[2:] - p[:-2]) / (durations[:, :-1] + durations[:, 1:])[..., None]
            before = after = slope
        else:
            chord = np.diff(p, axis=0)[1:]  # p_{i+1} - p_i at the inner points, eq. (20)
            before, after = chord / durations[:, :-1, None], chord / durations[:, 1:, None]
        for point, joint in self.at_rest:
            before[:, point - 1, joint] = after[:, point - 1, joint] = 0.0
        return before, after

    def _spline_pieces(self, start: Array, end: Array, durations: Array) -> Array:
        """The quartic pieces of all spline segments, (B, 4 (K - 3), n_joints, 8) [rad/s^k or m/s^k]."""
        near, far = OFFSETS[self.form]
        offsets = np.array([-far, -near, near, far])
        p = self.points.positions[1:-1, :, None]
        span = durations[:, :, None, None]
        controls = np.concatenate(
            [p[:-1] + offsets * start[..., None] * span, p[1:] + offsets * end[..., None] * span], axis=-1
        )
        windows = np.lib.stride_tricks.sliding_window_view(controls, 5, axis=-1)  # (B, K - 3, n_joints, 4, 5)
        unit = np.moveaxis(windows @ QUARTIC_BASIS.T, 3, 2)  # (B, K - 3, 4, n_joints, 5)
        powers = (durations[:, :, None, None, None] / PIECES) ** np.arange(5)
        padded = np.zeros((*unit.shape[:-1], 8), dtype=unit.dtype)
        padded[..., :5] = unit / powers
        return padded.reshape(len(durations), PIECES * durations.shape[1], *padded.shape[3:])

    def _state(self, position: Array, rate: Array, duration: Array) -> Array:
        """Taylor coefficients of the spline at a point, (B, 1, n_joints, 4): eq. (18) and its derivatives."""
        near, far = OFFSETS[self.form]
        state = np.zeros((*rate.shape, 4), dtype=rate.dtype)
        state[..., 0] = position
        state[..., 1] = (near + far / 3.0) * PIECES * rate
        state[..., 3] = (far / 3.0 - near) * PIECES**3 * rate / duration[..., None] ** 2
        return state

    def _rest(self, like: Array, point: int) -> Array:
        """The state at rest at a point, in the shape of another state."""
        state = np.zeros_like(like)
        state[..., 0] = self.points.positions[point]
        return state
