"""Controllers, which turn measured positions into efforts of the joints; feedforward is by trajevo's own dynamics.

With the error e = reference - measured position, its rate as the difference of two samples over the period, the gains
kp = ω² and kd = 2 ζ ω, and dynamics of the payload that the controller believes in:

- computed torque: M(q) (a + kd e' + kp e) + h(q, v) + friction, with measured q and v = reference velocity - e', where
  h are Coriolis forces and gravity. Dry friction has the sign of the reference velocity.
- PD: D (kd e' + kp e) + g(q) + viscous friction at v, where D are the inertias of the joints at the start, each with
  the others held, and g is gravity. There is no acceleration fed forward, and no dry friction.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.robot.joints import Friction


@final
@dataclass(frozen=True, eq=False)
class Belief:
    """What a controller believes of the robot: its dynamics with the payload that it believes in.

    Attributes:
        dynamics: robot without dry friction, and payload.
        friction: friction of the joints, dry friction included.
        masses: payload of each motion, shape (B,) [kg]; that of the dynamics if None.
    """

    dynamics: Dynamics
    friction: Friction
    masses: Array | None

    def effort(self, q: Array, v: Array, a: Array, rows: Array) -> Array:
        """Effort without dry friction of motions with these numbers (B,), in states (B, n_joints) [N·m or N]."""
        if self.masses is None:
            return self.dynamics.effort(q, v, a)
        each = self.dynamics.effort_per_kilogram(q, v, a)
        loaded: Array = self.dynamics.unloaded_effort(q, v, a) + self.masses[rows, None] * each
        return loaded

    def inertia(self, q: Array) -> Array:
        """Inertia of each joint alone, armature included, at positions (B, n_joints), the same shape [kg·m² or kg]."""
        rows, still = np.arange(len(q)), np.zeros_like(q)
        held, found = self.effort(q, still, still, rows), np.empty_like(q)
        for k, unit in enumerate(np.eye(q.shape[1])):
            found[:, k] = (self.effort(q, still, np.broadcast_to(unit, q.shape), rows) - held)[:, k]
        return found


@dataclass(frozen=True, eq=False)
class Controller(ABC):
    """A controller of B motions.

    Attributes:
        belief: what it believes of the robot.
        position_gain: gain of position errors, shape (n_joints,) [1/s²].
        velocity_gain: gain of their rates, shape (n_joints,) [1/s].
    """

    belief: Belief
    position_gain: Array
    velocity_gain: Array

    def corrected(self, error: Array, rate: Array) -> Array:
        """Accelerations that errors and their rates (B, n_joints) ask for, the same shape [rad/s² or m/s²]."""
        asked: Array = self.velocity_gain * rate + self.position_gain * error
        return asked

    @abstractmethod
    def effort(self, reference: tuple[Array, Array, Array], error: Array, rate: Array, rows: Array) -> Array:
        """Efforts of motions with these numbers (B,), shape (B, n_joints) [N·m or N].

        Args:
            reference: positions, velocities (0 where a joint stands) and accelerations, shapes (B, n_joints) [SI].
            error: reference less measured positions, the same shape [rad or m].
            rate: its rate, the same shape [rad/s or m/s].
            rows: numbers of the motions.
        """


@final
@dataclass(frozen=True, eq=False)
class ComputedTorque(Controller):
    """Inverse dynamics at measured states, with the reference's acceleration and what errors ask for."""

    def effort(self, reference: tuple[Array, Array, Array], error: Array, rate: Array, rows: Array) -> Array:
        """As the module tells."""
        q, v, a = reference
        asked = a + self.corrected(error, rate)
        total: Array = self.belief.effort(q - error, v - rate, asked, rows)
        return total + self.belief.friction.dry(v) if self.belief.friction.is_dry else total


@final
@dataclass(frozen=True, eq=False)
class ProportionalDerivative(Controller):
    """Each joint for itself, with gravity and viscous friction compensated.

    Attributes:
        inertia: inertia of each joint at the start, shape (B, n_joints) [kg·m² or kg].
    """

    inertia: Array

    def effort(self, reference: tuple[Array, Array, Array], error: Array, rate: Array, rows: Array) -> Array:
        """As the module tells."""
        q, v, _ = reference
        still = np.zeros_like(q)
        held = self.belief.effort(q - error, still, still, rows)
        viscous = self.belief.friction.viscous * (v - rate)
        total: Array = self.inertia[rows] * self.corrected(error, rate) + held + viscous
        return total
