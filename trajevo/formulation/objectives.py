"""Objectives: pure functions of a rollout, to be minimised, each with its name, unit and equation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.rollout import Rollout, lobatto_derivative
from trajevo.formulation.constraints.tool import (
    tool_speed,
)
from trajevo.robot.kinematics import ToolKinematics


@dataclass(frozen=True)
class Objective:
    """Something to minimise.

    Attributes:
        name: short name.
        unit: SI unit.
        reference: where the formula stands.
        function: rollout of B trajectories -> (B,).
    """

    name: str
    unit: str
    reference: str
    function: Callable[[Rollout], Array]


def total_time(rollout: Rollout) -> Array:
    """Duration of the motion, T = Σ Δt, shape (B,) [s]."""
    return rollout.trajectory.duration


def summed_rms(rollout: Rollout, derivative: int) -> Array:
    """Σ over joints of √(1/T ∫ (d-th derivative)² dt), exact, shape (B,) [rad/s^d or m/s^d]."""
    trajectory = rollout.trajectory
    mean_square = trajectory.integral_of_square(derivative) / trajectory.duration[:, None]
    total: Array = np.sqrt(mean_square).sum(axis=1)
    return total


def summed_rms_acceleration(rollout: Rollout) -> Array:
    """Σ over joints of the RMS acceleration, shape (B,) [rad/s² or m/s²]."""
    return summed_rms(rollout, 2)


def summed_rms_jerk(rollout: Rollout) -> Array:
    """Σ over joints of the RMS jerk, shape (B,) [rad/s³ or m/s³]."""
    return summed_rms(rollout, 3)


def integrated_square_acceleration(rollout: Rollout) -> Array:
    """∫ Σ over joints of acceleration² dt, exact, shape (B,) [SI²/s³]."""
    total: Array = rollout.trajectory.integral_of_square(2).sum(axis=1)
    return total


def integrated_square_jerk(rollout: Rollout) -> Array:
    """∫ Σ over joints of jerk² dt, exact, shape (B,) [SI²/s⁵]."""
    total: Array = rollout.trajectory.integral_of_square(3).sum(axis=1)
    return total


@dataclass(frozen=True)
class _TrapezoidSquareJerk:
    intervals: int

    def __call__(self, rollout: Rollout) -> Array:
        trajectory = rollout.trajectory
        shares = np.linspace(0.0, 1.0, self.intervals + 1)
        jerk = trajectory.evaluate(trajectory.duration.real[:, None] * shares, 3)
        square = np.square(jerk).sum(axis=2)
        mean: Array = (square.sum(axis=1) - 0.5 * (square[:, 0] + square[:, -1])) / self.intervals
        return trajectory.duration * mean


def trapezoid_square_jerk(intervals: int) -> Callable[[Rollout], Array]:
    """∫ Σ over joints of jerk² dt by the trapezoidal rule over equal intervals, eq. (29) of Paing 2021, [SI²/s⁵]."""
    return _TrapezoidSquareJerk(intervals)


@dataclass(frozen=True)
class _TimesDuration:
    function: Callable[[Rollout], Array]
    power: int

    def __call__(self, rollout: Rollout) -> Array:
        total: Array = self.function(rollout) * rollout.trajectory.duration**self.power
        return total


def times_duration(function: Callable[[Rollout], Array], power: int) -> Callable[[Rollout], Array]:
    """An objective times a power of the duration: constant in time where the objective falls with that power."""
    return _TimesDuration(function, power)


def integrated_square_power(rollout: Rollout) -> Array:
    """∫ Σ over joints of (effort x velocity)² dt by Gauss-Lobatto quadrature, shape (B,) [W²·s]."""
    power = rollout.power
    total: Array = np.einsum("btn,btn,bt->b", power, power, rollout.quadrature)
    return total


def mechanical_energy(rollout: Rollout) -> Array:
    """∫ Σ over joints of |effort x velocity| dt by Gauss-Lobatto quadrature, shape (B,) [J]: braking costs too."""
    power = rollout.power
    total: Array = np.einsum("btn,bt->b", power * np.sign(power.real), rollout.quadrature)
    return total


def integrated_square_effort(rollout: Rollout) -> Array:
    """∫ Σ over joints of effort² dt by Gauss-Lobatto quadrature, shape (B,) [(N·m)²·s or N²·s]: what heats motors."""
    total: Array = np.einsum("btn,btn,bt->b", rollout.effort, rollout.effort, rollout.quadrature)
    return total


def integrated_square_effort_rate(rollout: Rollout) -> Array:
    """∫ Σ over joints of (d effort / dt)² dt, shape (B,) [(N·m)²/s or N²/s].

    Effort is taken as the polynomial through its samples within every segment; steps between segments do not count.
    """
    per_segment = rollout.effort.reshape(len(rollout.trajectory), -1, rollout.dynamics.samples, rollout.robot.dof)
    slopes = np.einsum("uw,bswn->bsun", lobatto_derivative(rollout.dynamics.samples), per_segment)
    rate = (slopes / rollout.trajectory.segment_durations[:, :, None, None]).reshape(rollout.effort.shape)
    total: Array = np.einsum("btn,btn,bt->b", rate, rate, rollout.quadrature)
    return total


def effort_ratio(rollout: Rollout) -> Array:
    """Greatest |effort| over its limit of any joint at any sample, shape (B,) [1]."""
    limit = rollout.robot.limits.effort
    kept = np.isfinite(limit)
    share = rollout.effort[:, :, kept] / limit[kept]
    greatest: Array = (share * np.sign(share.real)).reshape(len(share), -1).max(axis=1)
    return greatest


#: Pieces of a segment over which a joint's way is summed up; only a piece in which it turns back counts too little.
_TRAVEL_PIECES = 32


def joint_travel(rollout: Rollout) -> Array:
    """Σ over joints of ∫ |v| dt, from the positions at 33 instants of every segment, shape (B,) [rad or m]."""
    q = rollout.trajectory.at_shares(np.linspace(0.0, 1.0, _TRAVEL_PIECES + 1), 0)
    step = np.diff(q, axis=1)
    total: Array = (step * np.sign(step.real)).sum(axis=(1, 2))
    return total


@dataclass(frozen=True)
class _UnusedPayload:
    greatest: float

    def __call__(self, rollout: Rollout) -> Array:
        masses = rollout.masses if rollout.masses is not None else np.array(rollout.dynamics.payload.mass)
        unused: Array = self.greatest - masses + np.zeros(len(rollout.trajectory))
        return unused


def unused_payload(greatest: float) -> Callable[[Rollout], Array]:
    """What is left of the greatest payload [kg]: minimising it maximises the payload."""
    return _UnusedPayload(greatest)


def tool_path_length(rollout: Rollout) -> Array:
    """∫ |velocity of the tool's origin| dt by Gauss-Lobatto quadrature, shape (B,) [m].

    Where the tool turns sharply the speed has a kink, and few samples per segment are only close.
    """
    speed = tool_speed(rollout, ToolKinematics.of(rollout.robot))
    length: Array = (speed * rollout.quadrature).sum(axis=1)
    return length
