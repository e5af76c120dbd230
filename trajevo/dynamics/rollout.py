"""Rollouts: a robot's motions and efforts at the Gauss-Lobatto nodes of every segment, both ends included."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cache, cached_property
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.dynamics.inverse_dynamics import _ROUNDING, Dynamics
from trajevo.errors import InvalidInputError
from trajevo.robot.joints import JointLimits, least_share
from trajevo.robot.robot import Robot
from trajevo.trajectory.batch import TrajectoryBatch


@cache
def lobatto(count: int) -> tuple[Array, Array]:
    """Gauss-Lobatto nodes on [0, 1] and weights of sum 1; exact for polynomials of degree 2 count - 3."""
    legendre = np.polynomial.Legendre.basis(count - 1)
    nodes = np.concatenate([[-1.0], np.sort(legendre.deriv().roots().real), [1.0]])
    weights = 2.0 / (count * (count - 1) * legendre(nodes) ** 2)
    return frozen(0.5 * (nodes + 1.0)), frozen(0.5 * weights)


@cache
def lobatto_derivative(count: int) -> Array:
    """Matrix (count, count) from values at Gauss-Lobatto nodes to the derivative of the polynomial through them."""
    nodes = lobatto(count)[0]
    powers = nodes[:, None] ** np.arange(count)
    slopes = np.arange(1, count) * nodes[:, None] ** np.arange(count - 1)
    return frozen(np.linalg.solve(powers.T, np.pad(slopes, ((0, 0), (1, 0))).T).T)


@final
@dataclass(frozen=True, eq=False)
class Rollout:
    """A batch of trajectories of a robot, sampled per segment; effort is computed once, when it is first needed.

    Attributes:
        dynamics: robot, payload, samples per segment.
        trajectory: B trajectories of its joints.
        masses: payload mass of each trajectory, shape (B,) [kg]; the payload's own if None.
        kept_limits: limits of the joints that the motions are meant to keep; the robot's own if None.

    Raises:
        InvalidInputError: the trajectory has another number of joints than the robot.
    """

    dynamics: Dynamics
    trajectory: TrajectoryBatch
    masses: Array | None = None
    kept_limits: JointLimits | None = None

    def __post_init__(self) -> None:
        if self.trajectory.n_joints != self.robot.dof:
            raise InvalidInputError(
                f"trajectory: robot {self.robot.name!r} has {self.robot.dof} joints, "
                f"got a trajectory of {self.trajectory.n_joints}"
            )

    @property
    def robot(self) -> Robot:
        """The robot that moves."""
        return self.dynamics.robot

    @property
    def limits(self) -> JointLimits:
        """Limits that the motions are measured against: a problem's margin is already taken off."""
        return self.robot.limits if self.kept_limits is None else self.kept_limits

    @property
    def effort_margin(self) -> float:
        """Greatest share of a joint's effort limit that is kept free, 0 for none."""
        return 1.0 - least_share(self.limits.effort, self.robot.limits.effort)

    @property
    def keeps_margins(self) -> bool:
        """Whether some limit that the motions are measured against is not the robot's own."""
        return any(
            not np.array_equal(getattr(self.limits, field.name), getattr(self.robot.limits, field.name))
            for field in fields(JointLimits)
        )

    @cached_property
    def t(self) -> Array:
        """Instants of the samples, shape (B, T) [s]: Gauss-Lobatto nodes of every segment, T = segments x samples."""
        nodes = lobatto(self.dynamics.samples)[0]
        t = self.trajectory.breaks[:, :-1, None] + self.trajectory.segment_durations[:, :, None] * nodes
        return frozen(t.reshape(len(self.trajectory), -1))

    @cached_property
    def q(self) -> Array:
        """Positions at the samples, shape (B, T, n_joints) [rad or m]."""
        return self._sampled(0)

    @cached_property
    def v(self) -> Array:
        """Velocities at the samples, shape (B, T, n_joints) [rad/s or m/s]."""
        return self._sampled(1)

    @cached_property
    def a(self) -> Array:
        """Accelerations at the samples, shape (B, T, n_joints) [rad/s² or m/s²]."""
        return self._sampled(2)

    @cached_property
    def j(self) -> Array:
        """Jerks at the samples, shape (B, T, n_joints) [rad/s³ or m/s³]."""
        return self._sampled(3)

    def _sampled(self, derivative: int) -> Array:
        return self.trajectory.at_shares(lobatto(self.dynamics.samples)[0], derivative)

    @cached_property
    def quadrature(self) -> Array:
        """Weights that turn the samples' values into ∫ dt, shape (B, T) [s]."""
        weights = lobatto(self.dynamics.samples)[1]
        return frozen((self.trajectory.segment_durations[:, :, None] * weights).reshape(len(self.trajectory), -1))

    @cached_property
    def unloaded_effort(self) -> Array:
        """Effort without payload at the samples, shape (B, T, n_joints) [N·m or N]."""
        return frozen(self.dynamics.unloaded_effort(self.q, self._moving, self.a))

    @cached_property
    def effort_per_kilogram(self) -> Array:
        """Effort that one kilogram of payload adds at the samples, shape (B, T, n_joints) [N·m/kg or N/kg]."""
        return frozen(self.dynamics.effort_per_kilogram(self.q, self.v, self.a))

    @cached_property
    def effort(self) -> Array:
        """Effort with the payload at the samples, shape (B, T, n_joints) [N·m or N]."""
        if self.masses is not None:
            return frozen(self.unloaded_effort + self.masses[:, None, None] * self.effort_per_kilogram)
        return frozen(self.dynamics.effort(self.q, self._moving, self.a))

    @cached_property
    def _moving(self) -> Array:
        """Velocities at the samples, with mere rounding set to 0, which dry friction would take for a motion."""
        return self.v if self.robot.friction.none else self.without_rounding(self.v)

    def effort_in(self, q: Array, v: Array, a: Array) -> Array:
        """Effort with the payload in given states, shapes (B, T, n_joints) [N·m or N].

        A joint whose velocity is mere rounding counts as at rest, see :meth:`without_rounding`.
        """
        v = self.without_rounding(v)
        if self.masses is None:
            return frozen(self.dynamics.effort(q, v, a))
        each = self.dynamics.effort_per_kilogram(q, v, a)
        return frozen(self.dynamics.unloaded_effort(q, v, a) + self.masses[:, None, None] * each)

    def without_rounding(self, v: Array) -> Array:
        """Velocities, shape (B, T, n_joints) [rad/s or m/s], with mere rounding set to 0.

        Otherwise the sign of dry friction would be random at the ends of a motion and for joints that do not move.
        """
        return np.where(np.abs(v.real) <= self.standing[:, None], 0.0, v)

    @cached_property
    def standing(self) -> Array:
        """Greatest speed at which every joint counts as at rest, shape (B, n_joints) [rad/s or m/s]."""
        peaks = self.trajectory.peak(1) + self.trajectory.peak(0) / self.trajectory.duration[:, None]
        return frozen(_ROUNDING * peaks.real)

    @property
    def power(self) -> Array:
        """Mechanical power of every actuator at the samples, shape (B, T, n_joints) [W]."""
        return frozen(self.effort * self.v)


def rollout_of(motion: Any) -> Rollout:
    """The rollout of a motion: itself, or that of a solution or an optimum.

    Raises:
        InvalidInputError: it is none of these.
    """
    found = motion if isinstance(motion, Rollout) else getattr(motion, "rollout", None)
    if not isinstance(found, Rollout):
        raise InvalidInputError(f"motion: expected a solution, an optimum or a rollout, got {type(motion).__name__}")
    return found
