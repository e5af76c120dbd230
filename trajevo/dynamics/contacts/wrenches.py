"""Forces and moments that move a robot's links and its payload, which what holds them has to give.

Six more joints without mass stand between the base and the arm, and six between the tool and the payload: three that
slide along the axes and three that turn about them. At rest they bear what is held (Siciliano, Robotics, 2009, section
7.5), so that inverse dynamics tell it, as quickly as they tell torques, real and complex.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.robot.kinematics import ToolKinematics
from trajevo.robot.payload import gripping, standing

#: Joints of a wrench.
_SIX = 6


class Wrench(NamedTuple):
    """A force (3, ...) and a moment about a point (3, ...), in the base frame.

    Of a mass [N and N·m], or of each kilogram [N/kg and N·m/kg].
    """

    force: Array
    moment: Array

    @classmethod
    def borne(cls, torques: Array) -> Wrench:
        """What six joints bear, shape (..., 6)."""
        first = np.moveaxis(torques, -1, 0)
        return cls(first[:3], first[3:])

    def about(self, point: Array) -> Array:
        """Moment about another point, given relative to the first, shape (3, ...)."""
        moment: Array = self.moment + cross(self.force, point)
        return moment


class HeldStates(NamedTuple):
    """What is held at states: by the stand without payload, by the stand and by the grip for each kilogram of it.

    Attributes:
        base: of the links and of all loads but the payload, about the base's origin; rotors of motors are left out.
        base_each: of each kilogram of the payload, about the base's origin; 0 where it is not carried.
        grip_each: the same about the tool's origin, in the tool's frame.
    """

    base: Wrench
    base_each: Wrench
    grip_each: Wrench


@final
@dataclass(frozen=True, eq=False)
class HoldingWrenches:
    """A robot with its payload, held by a stand and holding by a grip.

    Attributes:
        dynamics: robot and payload, whose mass does not matter.
        parts: the same for every phase of the schedule of loads, with all loads but the payload.
    """

    dynamics: Dynamics
    parts: tuple[Dynamics, ...]

    __repr__ = brief

    @classmethod
    def of(cls, dynamics: Dynamics) -> HoldingWrenches:
        """The robot of a motion.

        Raises:
            InvalidInputError: links that a joint moves have no mass.
        """
        dynamics.robot.check_masses("what a grip or a stand holds")
        schedule = dynamics.schedule
        parts = (dynamics,) if schedule is None else tuple(map(dynamics.of_phase, schedule.phases))
        return cls(dynamics, parts)

    def at(self, q: Array, v: Array, a: Array, segments: Array) -> HeldStates:
        """Forces and moments at states.

        Args:
            q: positions, shape (..., K, n_joints) [rad or m].
            v: velocities, the same shape [rad/s or m/s].
            a: accelerations, the same shape [rad/s² or m/s²].
            segments: segments of the motion in which the states lie, shape (K,).
        """
        base_each, grip_each = self._of_payload(q, v, a)
        schedule = self.dynamics.schedule
        if schedule is None:
            return HeldStates(_of_links(self.dynamics, q, v, a), base_each, grip_each)
        of_states = np.array(schedule.phase_of_segment)[segments]
        base = Wrench(*np.zeros((2, 3, *q.shape[:-1]), dtype=np.result_type(q, v, a)))
        for k, part in enumerate(self.parts):
            for found, own in zip(base, _of_links(part, q, v, a), strict=True):
                found[:] = np.where(of_states == k, own, found)
        carried = np.array([schedule.varies(phase) for phase in schedule.phases])[of_states]
        each_of = [Wrench(*(np.where(carried, x, 0.0) for x in wrench)) for wrench in (base_each, grip_each)]
        return HeldStates(base, *each_of)

    def _of_payload(self, q: Array, v: Array, a: Array) -> tuple[Wrench, Wrench]:
        """What each kilogram of the payload takes of the stand, and of the grip in the tool's frame."""
        robot, payload = self.dynamics.robot, self.dynamics.payload
        if payload.model == "tool_axis":  # effort is that of its weight along the tool's z axis, held against it
            strength = float(np.linalg.norm(robot.model.gravity.linear))
            place, rotation = ToolKinematics.of(robot).pose(q)
            force = np.moveaxis(-strength * rotation[..., 2], -1, 0)
            along = np.zeros_like(force)
            along[2] = -strength
            return Wrench(force, cross(np.moveaxis(place, -1, 0), force)), Wrench(along, np.zeros_like(along))
        if payload.model == "weight_only":
            v, a = np.zeros_like(v), np.zeros_like(a)
        torques = _torques(self.dynamics, "payload held", lambda: standing(gripping(robot, payload)), q, v, a, _SIX)
        return Wrench.borne(torques[..., :_SIX]), Wrench.borne(torques[..., -_SIX:])


def _of_links(part: Dynamics, q: Array, v: Array, a: Array) -> Wrench:
    """What the links and loads of a robot take, about the origin of the base frame."""
    return Wrench.borne(_torques(part, "links held", lambda: standing(part.robot.model), q, v, a)[..., :_SIX])


def _torques(
    dynamics: Dynamics, name: str, make: Callable[[], Any], q: Array, v: Array, a: Array, after: int = 0
) -> Array:
    """Torques of a model with six joints before those of the arm, and some after them, all of these at rest."""
    wide = []
    for state in dynamics.robot.transmission.motion(q, v, a):
        count = state.shape[-1]
        rest = np.zeros((*state.shape[:-1], _SIX + count + after), dtype=state.dtype)
        rest[..., _SIX : _SIX + count] = state
        wide.append(rest)
    return dynamics.torque_of(name, make, *wide)


def cross(one: Array, other: Array) -> Array:
    """Vector products of (3, ...) and (3, ...) or (3,)."""
    (x, y, z), (u, v, w) = one, other
    found: Array = np.stack([y * w - z * v, z * u - x * w, x * v - y * u])
    return found


def dot(one: Array, other: Array) -> Array:
    """Scalar products of (3, ...) and (3, ...) or (3,)."""
    found: Array = one[0] * other[0] + one[1] * other[1] + one[2] * other[2]
    return found
