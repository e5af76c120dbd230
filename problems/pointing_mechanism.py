"""X-Y pointing mechanism: time, acceleration and jerk (Sun et al. 2020, IEEE Access, 10.1109/ACCESS.2020.3042890).

Symbols are the paper's: θ joint angles [rad], γ azimuth [rad], β pitch [rad], l link lengths [m]. The pointing
direction is the X axis of the tool frame; β is its angle from X₀ (straight up, so a zenith angle) and γ its azimuth
from -Z₀ towards +Y₀. Errata of the paper and what can be reproduced: docs/papers/sun2020.md.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar, final

import numpy as np

from trajevo.base.arrays import Array, numbers, read_only
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.errors import UnreachableError, checked_name
from trajevo.formulation.constraints.certified import held
from trajevo.formulation.constraints.joint_limits import kinematic_limits
from trajevo.formulation.objectives import Objective, summed_rms_acceleration, summed_rms_jerk, total_time
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.path.tables import read_table
from trajevo.path.via_points import ViaPoints
from trajevo.robot.robot import load_robot
from trajevo.trajectory.interpolants import HybridQuartic, Interpolant, QuinticSpline, SepticSpline

#: Link lengths l₁, l₂ [m]; Table 1 gives no values, so these are from robots/pointing_mechanism/SOURCE.md.
L1, L2 = 0.3, 0.2

#: Azimuth γ and pitch β of the five path points [deg], Table 4.
TABLE_4_POINTS_DEG = ((30.0, 30.0), (75.0, 15.0), (120.0, 0.0), (165.0, 15.0), (210.0, 30.0))

#: Instants of the solution the paper chose from its front [s], Table 4.
TABLE_4_TIMES = (0.0, 5.4682, 11.2757, 15.5999, 19.677)

#: Least and greatest time of a segment [s]. The paper prints none; the slow end of the front lies at the greatest time.
DURATION_BOUNDS = (1.0, 10.0)

#: Far corner of the hypervolume box for S₂ [deg/s²] and S₃ [deg/s³]; for S₁ it is the longest possible time.
REFERENCE_S2_DEG, REFERENCE_S3_DEG = 15.0, 40.0

INTERPOLANTS: dict[str, Callable[[ViaPoints, tuple[float, float]], Interpolant]] = {
    "printed": lambda points, bounds: HybridQuartic(points, form="printed", duration_bounds=bounds),
    "smooth": lambda points, bounds: HybridQuartic(points, form="smooth", duration_bounds=bounds),
    "quintic": lambda points, bounds: QuinticSpline(points, duration_bounds=bounds),
    "septic_spline": lambda points, bounds: SepticSpline(points, duration_bounds=bounds),
}


@final
class PointingMechanism(TrajectoryProblem):
    """Time, acceleration and jerk of the pointing mechanism, eq. (25), under the limits of Table 2.

    The variables are the segment times Δt [s], four of them for the paper's own path. The objectives are S₁ = T [s],
    S₂ = Σ RMS acceleration [rad/s²] and S₃ = Σ RMS jerk [rad/s³]. Position, velocity, acceleration and jerk are limited
    at their exact peaks.

    Args:
        interpolant: ``"smooth"`` (the paper's hybrid made C3 for all durations), ``"printed"`` (its control points as
            they stand), ``"quintic"`` (C4 quintic spline) or ``"septic_spline"`` (C6 septic spline).
        points: azimuth γ and pitch β per point, shape (K, 2) [rad], or a CSV file with the columns
            ``azimuth [deg], pitch [deg]`` (or [rad]); the five points of Table 4 if None.
        duration_bounds: least and greatest time of a segment [s].
        limits: ``"sampled"`` or ``"certified"``; both mean the same here, since no limit is checked at samples.

    Raises:
        UnknownNameError: no such interpolant or limits.
        UnreachableError: a direction that cannot be reached by any joint angles.
        InvalidInputError: too few, repeated, non-finite or out-of-range points, or bad bounds.
    """

    registered_name: ClassVar[str] = "pointing"
    title: str = "X-Y pointing mechanism: time, acceleration, jerk (Sun 2020)"

    def __init__(
        self,
        *,
        interpolant: str = "smooth",
        points: Any = None,
        duration_bounds: tuple[float, float] = DURATION_BOUNDS,
        limits: str = "sampled",
    ) -> None:
        checked_name("interpolant", interpolant, INTERPOLANTS)
        if points is None:
            directions = np.radians(TABLE_4_POINTS_DEG)
        elif isinstance(points, str | Path):
            directions = read_table(points).si({"azimuth": "rad", "pitch": "rad"})
        else:
            directions = numbers(points, name="points", shape=("n_points", 2))
        self.directions = read_only(directions)
        self.interpolant_name, self.limits = interpolant, limits
        self.duration_bounds = tuple(numbers(duration_bounds, name="duration_bounds", shape=(2,)).tolist())
        robot = load_robot("pointing_mechanism")
        via = ViaPoints.for_robot(robot, joint_angles(directions), angle="deg")
        super().__init__(
            dynamics=Dynamics(robot),
            interpolant=INTERPOLANTS[interpolant](via, self.duration_bounds),
            objectives=(
                Objective("time", "s", "Sun 2020, eq. (25), S1", total_time),
                Objective("acceleration", "rad/s^2", "Sun 2020, eq. (25), S2", summed_rms_acceleration),
                Objective("jerk", "rad/s^3", "Sun 2020, eq. (25), S3", summed_rms_jerk),
            ),
            constraints=held(kinematic_limits(robot), limits),
            reference_point=(
                (len(via) - 1) * self.duration_bounds[1],
                np.radians(REFERENCE_S2_DEG),
                np.radians(REFERENCE_S3_DEG),
            ),
            angle="deg",
        )

    @property
    def settings(self) -> dict[str, Any]:
        """Keyword arguments that make an equal problem."""
        return {
            "interpolant": self.interpolant_name,
            "points": self.directions.tolist(),
            "duration_bounds": list(self.duration_bounds),
            "limits": self.limits,
        }


def forward_kinematics(theta: Any) -> Array:
    """Pose of the tool in the base frame, eq. (2): joint angles (K, 2) [rad] -> (K, 4, 4), lengths in m."""
    theta1, theta2 = numbers(theta, name="theta", shape=("K", 2)).T
    c1, s1, c2, s2 = np.cos(theta1), np.sin(theta1), np.cos(theta2), np.sin(theta2)
    zero, one = np.zeros_like(c1), np.ones_like(c1)
    rows = [
        [c1 * c2, -c1 * s2, -s1, L1 * c1 + L2 * c1 * c2],
        [c2 * s1, -s1 * s2, c1, L1 * s1 + L2 * c2 * s1],
        [-s2, -c2, zero, -L2 * s2],
        [zero, zero, zero, one],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def inverse_kinematics(position: Any) -> Array:
    """Joint angles that put the tool at a point, eqs. (5)-(6): (K, 3) [m] -> (K, 2) [rad].

    Raises:
        UnreachableError: a point is not on the surface that the tool moves on; the message names it.
    """
    p = numbers(position, name="position", shape=("K", 3))
    px, py, pz = p.T
    _refuse(np.abs(pz) > L2 * (1.0 + 1e-12), p, f"|z| exceeds l2 = {L2} m", "m")
    # The distance from the axis of joint 1 gives the cosine that eq. (6) leaves out: theta2 is sharp near 90 deg too.
    sine, cosine = -pz / L2, (np.hypot(px, py) - L1) / L2
    off = np.abs(np.hypot(sine, cosine) - 1.0)
    _refuse(off > 1e-9, p, "its distance from the axis of joint 1 is not l1 + l2 cos(theta2)", "m")
    _refuse(cosine < -1e-9, p, "it needs |theta2| > 90 deg, where eq. (6) does not hold", "m")
    return np.stack([np.arctan2(py, px), np.arctan2(sine, np.maximum(cosine, 0.0))], axis=-1)


def joint_angles(direction: Any) -> Array:
    """Joint angles that point in a direction, eqs. (7)-(8): azimuth γ and pitch β (K, 2) [rad] -> (K, 2) [rad].

    Equation (7) as printed, θ₁ = arctan(sin γ tan β), points the other way for β > 90°; this is the form that holds
    for 0 ≤ β < 180°.

    Raises:
        UnreachableError: β is outside [0°, 180°), or the direction lies on the axis of joint 1, where θ₁ is undefined.
    """
    directions = numbers(direction, name="points", shape=("n_points", 2))
    gamma, beta = directions.T
    shown = np.degrees(directions)
    _refuse((beta < 0.0) | (beta >= np.pi), shown, "expected a pitch from 0 deg to below 180 deg", "deg")
    y, x = np.sin(gamma) * np.sin(beta), np.cos(beta)
    _refuse(
        np.hypot(y, x) < 1e-12, shown, "the direction lies on the axis of joint 1, whose angle is then undefined", "deg"
    )
    return np.stack([np.arctan2(y, x), np.arcsin(np.clip(np.cos(gamma) * np.sin(beta), -1.0, 1.0))], axis=-1)


def azimuth_pitch(theta: Any) -> Array:
    """Direction of given joint angles, the inverse of eqs. (7)-(8): (K, 2) [rad] -> azimuth γ, pitch β (K, 2) [rad].

    γ is in [0, 2π), β in [0, π]. Straight up (β = 0) every azimuth is the same direction; γ is then 0.
    """
    theta1, theta2 = numbers(theta, name="theta", shape=("K", 2)).T
    up, y, minus_z = np.cos(theta1) * np.cos(theta2), np.sin(theta1) * np.cos(theta2), np.sin(theta2) + 0.0
    azimuth = np.mod(np.arctan2(y, minus_z), 2.0 * np.pi)
    azimuth = np.where(azimuth < 2.0 * np.pi, azimuth, 0.0)  # a tiny negative angle rounds up to the whole turn
    return np.stack([azimuth, np.arctan2(np.hypot(y, minus_z), up)], axis=-1)


def _refuse(bad: Array, points: Array, why: str, unit: str) -> None:
    if bad.any():
        i = int(np.flatnonzero(bad)[0])
        coordinates = ", ".join(f"{value:.6g}" for value in points[i])
        raise UnreachableError(f"point {i} ({coordinates}) {unit} cannot be reached: {why}")


def paper_solution() -> Array:
    """Segment times of the solution in Table 4, shape (1, 4) [s]."""
    return np.diff(TABLE_4_TIMES)[None]
