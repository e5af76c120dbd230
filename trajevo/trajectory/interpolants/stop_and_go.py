"""Baselines: motions that stop at every point and are as fast as the joint limits allow.

All joints start and stop together. On a straight line between two points one parameter s runs from 0 to 1; its limits
are the tightest of the joints' limits divided by the distances that the joints move. Otherwise every joint has its own
profile, as fast as its own limits allow, and joints that would arrive early are slowed down as a whole.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
import ruckig

from trajevo.base import polynomials
from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError, checked_name
from trajevo.path.via_points import ViaPoints
from trajevo.robot.joints import JointLimits
from trajevo.trajectory.interpolants.hermite import hermite_segments
from trajevo.trajectory.interpolants.sinusoidal import PROFILE_DEGREE, PROFILE_PIECES, SINUSOIDAL
from trajevo.trajectory.polynomial import PolynomialBatch

#: Durations (P,) [s] and power coefficients (P, degree + 1) of the phases of s(t).
_Phases = tuple[Array, Array]

#: Share of a chord's time below which a phase is rounding, not motion.
_NEGLIGIBLE = 1e-12


def stop_and_go(points: ViaPoints, limits: JointLimits, *, profile: str, straight: bool = True) -> PolynomialBatch:
    """The fastest motion that stops at every point, with a given velocity profile.

    Args:
        points: via points; two of them give one rest-to-rest motion.
        limits: joint limits, SI. With limits of acceleration that differ by direction, joints speed up with one and
            slow down with the other; profiles of one piece, whose halves mirror each other, keep the lesser.
        profile: ``"trapezoid"`` (velocity and acceleration limits; its jerk is infinite at the corners and is not
            checked), ``"double_s"`` (velocity, acceleration and jerk limits, by Ruckig), ``"septic"`` (polynomial of
            degree 7, under all three), or one of :data:`SINUSOIDAL`: ``"cycloidal"`` and ``"trigonometric"`` (under all
            three) and ``"harmonic"`` (velocity and acceleration limits, as its acceleration steps at both ends).
        straight: move along straight lines in joint space; otherwise each joint moves on its own, which is faster where
            different limits bind.

    Returns:
        A batch of one trajectory.

    Raises:
        UnknownNameError: no such profile.
        InvalidInputError: a limit that the profile needs is infinite, or another number of joints.
    """
    checked_name("profile", profile, _PROFILES)
    if len(limits.velocity) != points.n_joints:
        raise InvalidInputError(
            f"limits: expected {points.n_joints} joints as in the points, got {len(limits.velocity)}"
        )
    durations, coefficients = [], []
    for start, end in zip(points.positions[:-1], points.positions[1:], strict=True):
        segment_durations, segment = (_line if straight else _apart)(start, end, limits, profile)
        durations.append(segment_durations)
        coefficients.append(segment)
    breaks = np.concatenate([[0.0], np.cumsum(np.concatenate(durations))])
    return PolynomialBatch(breaks[None], np.concatenate(coefficients)[None])


def _line(start: Array, end: Array, limits: JointLimits, profile: str) -> tuple[Array, Array]:
    """Phases of a straight chord: durations (P,) [s] and coefficients (P, n_joints, degree + 1)."""
    chord = end - start
    with np.errstate(divide="ignore"):
        share = [float(np.min(bound / np.abs(chord))) for bound in _bounds(chord, limits)]
    durations, s = _lasting(*_PROFILES[profile](*share))
    segment = chord[:, None] * s[:, None, :]
    segment[..., 0] += start
    return durations, segment


def _apart(start: Array, end: Array, limits: JointLimits, profile: str) -> tuple[Array, Array]:
    """The same with every joint on its own, cut wherever a phase of any joint ends."""
    chord = end - start
    moving = np.flatnonzero(chord)
    own = []
    for joint in moving:
        bounds = (bound[joint] for bound in _bounds(chord, limits))
        own.append(_lasting(*_PROFILES[profile](*(float(bound / abs(chord[joint])) for bound in bounds))))
    total = max(float(durations.sum()) for durations, _ in own)
    ends = [np.concatenate([[0.0], np.cumsum(d) / d.sum()]) for d, _ in own]
    cuts = np.unique(np.round(np.concatenate(ends), 12))
    degree = max(s.shape[1] for _, s in own)
    segment = np.zeros((len(cuts) - 1, len(chord), degree))
    segment[..., 0] = start
    for joint, (durations, s), at in zip(moving, own, ends, strict=True):
        phase = np.clip(np.searchsorted(at, 0.5 * (cuts[1:] + cuts[:-1]), side="right") - 1, 0, len(durations) - 1)
        scale = durations.sum()
        local = polynomials.shifted(s[phase].T, scale * (cuts[:-1] - at[phase]))
        segment[:, joint, : len(local)] += chord[joint] * (local.T * (scale / total) ** np.arange(len(local)))
    return total * np.diff(cuts), segment


def _bounds(chord: Array, limits: JointLimits) -> tuple[Array, Array, Array, Array]:
    """Limits along a chord: velocity, acceleration when speeding up and when slowing down, jerk, each (n_joints,)."""
    acceleration = limits.sides("acceleration")
    return (
        limits.sides("velocity").toward(chord),
        acceleration.toward(chord),
        acceleration.toward(-chord),
        limits.jerk,
    )


def _lasting(durations: Array, s: Array) -> _Phases:
    """The phases that are more than rounding."""
    kept = durations > _NEGLIGIBLE * durations.sum()
    return durations[kept], s[kept]


def _trapezoid(velocity: float, speeding: float, slowing: float, jerk: float) -> _Phases:
    del jerk
    _require(max(speeding, slowing), "acceleration", "trapezoid")
    mean = speeding if speeding == slowing else 2.0 / (1.0 / speeding + 1.0 / slowing)
    ramp = min(velocity / mean, mean**-0.5)  # the mean of both ramps
    speed = mean * ramp
    cruise = max(1.0 / speed - ramp, 0.0)
    up, down = ramp * (mean / speeding), ramp * (mean / slowing)
    return np.array([up, cruise, down]), np.array(
        [
            [0.0, 0.0, 0.5 * speeding],
            [0.5 * speeding * up**2, speed, 0.0],
            [1.0 - 0.5 * slowing * down**2, speed, -0.5 * slowing],
        ]
    )


def _double_s(velocity: float, speeding: float, slowing: float, jerk: float) -> _Phases:
    for value, name in ((velocity, "velocity"), (max(speeding, slowing), "acceleration"), (jerk, "jerk")):
        _require(value, name, "double_s")
    inputs, found = ruckig.InputParameter(1), ruckig.Trajectory(1)
    inputs.current_position, inputs.target_position = [0.0], [1.0]
    inputs.max_velocity, inputs.max_acceleration, inputs.max_jerk = [velocity], [speeding], [jerk]
    if slowing != speeding:
        inputs.min_acceleration = [-slowing]
    outcome = ruckig.Ruckig(1).calculate(inputs, found)
    if outcome not in (ruckig.Result.Working, ruckig.Result.Finished):
        raise InvalidInputError(f"profile 'double_s': Ruckig found no motion for these limits: {outcome}")
    phases = found.profiles[0][0]
    rows = [[p, v, 0.5 * a, j / 6.0] for p, v, a, j in zip(phases.p, phases.v, phases.a, phases.j, strict=False)]
    return np.array(phases.t), np.array(rows)


def _septic(velocity: float, speeding: float, slowing: float, jerk: float) -> _Phases:
    rest = np.zeros((1, 1, 1, 4))
    there = rest.copy()
    there[..., 0] = 1.0
    unit = PolynomialBatch(np.array([[0.0, 1.0]]), hermite_segments(rest, there, np.ones((1, 1))))
    peaks = [float(unit.peak(order)[0, 0]) for order in (1, 2, 3)]
    duration = _least_time("septic", peaks, (velocity, min(speeding, slowing), jerk))
    return np.array([duration]), unit.coefficients[0, 0] / duration ** np.arange(8)


def _sinusoidal(name: str, velocity: float, speeding: float, slowing: float, jerk: float) -> _Phases:
    shape = SINUSOIDAL[name]
    duration = _least_time(name, shape.peaks, (velocity, min(speeding, slowing), jerk))
    return np.full(PROFILE_PIECES, duration / PROFILE_PIECES), shape.pieces() / duration ** np.arange(
        PROFILE_DEGREE + 1
    )


def _least_time(profile: str, peaks: Sequence[float], limits: Sequence[float]) -> float:
    """Time in which a unit profile keeps its limits: of velocity, of acceleration, and of jerk if its peak is given."""
    duration: float = max(
        (peak / limit) ** (1.0 / order) for order, peak, limit in zip((1, 2, 3), peaks, limits, strict=False)
    )
    if not duration > 0.0:
        names = "velocity, acceleration or jerk" if len(peaks) > 2 else "velocity or acceleration"
        raise InvalidInputError(f"profile {profile!r}: needs a finite {names} limit")
    return duration


def _require(value: float, name: str, profile: str) -> None:
    if not np.isfinite(value):
        raise InvalidInputError(
            f"profile {profile!r}: needs a finite {name} limit for every joint that moves, got {value}"
        )


_PROFILES: dict[str, Callable[[float, float, float, float], _Phases]] = {
    "trapezoid": _trapezoid,
    "double_s": _double_s,
    "septic": _septic,
    **{name: partial(_sinusoidal, name) for name in SINUSOIDAL},
}
