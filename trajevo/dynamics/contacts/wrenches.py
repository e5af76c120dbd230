"""Forces and moments that move a robot's links and its payload, which what holds them has to give."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, final

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.base.shown.brief import brief
from trajevo.dynamics.contacts.links import LinkMotion, cross, joints_of, link_motions, tool_motion, turned, turned_back
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rnea_tree import Inertias, Joint
from trajevo.robot.payload import Payload
from trajevo.robot.robot import Robot


class Wrench(NamedTuple):
    """A force (3, ...) and a moment about a point (3, ...), in the base frame.

    Of a mass [N and N·m], or of each kilogram [N/kg and N·m/kg].
    """

    force: Array
    moment: Array

    def about(self, point: Array) -> Array:
        """Moment about another point, given relative to the first, shape (3, ...)."""
        moment: Array = self.moment + cross(self.force, point)
        return moment


def payload_wrench(robot: Robot, payload: Payload, tool: LinkMotion, still: LinkMotion) -> Wrench:
    """What each kilogram of a payload takes, about the tool's origin.

    Args:
        robot: the robot.
        payload: gives shape and model; its mass does not matter.
        tool: motion of the tool.
        still: the same at rest in the same positions, for payloads of which the weight alone counts.
    """
    if payload.model == "tool_axis":  # effort is that of its weight along the tool's z axis, held against it
        strength = float(np.linalg.norm(robot.model.gravity.linear))
        force = -strength * tool.rotation[:, 2]
        return Wrench(force, np.zeros_like(force))
    moving = still if payload.model == "weight_only" else tool
    com = np.array(payload.com)
    force = moving.moved(com).felt
    moment = cross(turned(moving.rotation, com), force)
    if payload.inertia is None or payload.mass == 0.0:
        return Wrench(force, moment)
    tensor = np.array(payload.inertia) / payload.mass
    spin, rate = (turned_back(moving.rotation, each) for each in (moving.spin, moving.spin_rate))
    return Wrench(force, moment + turned(moving.rotation, _spun(tensor, spin, rate)))


@final
@dataclass(frozen=True, eq=False)
class CarriedBodies:
    """The moving links of a model, each in the frame of its joint.

    Attributes:
        masses: [kg].
        moments: mass times centre of mass, shape (n, 3) [kg·m].
        tensors: inertia about the frame's origin, shape (n, 3, 3) [kg·m²].
    """

    masses: tuple[float, ...]
    moments: Array
    tensors: Array

    __repr__ = brief

    @classmethod
    def of(cls, robot: Robot) -> CarriedBodies:
        """The links of a robot."""
        rows = Inertias.of(robot.model).bodies
        tensors = np.zeros((len(rows), 3, 3))
        for tensor, entries in zip(tensors, rows[:, 4:], strict=True):
            tensor[np.triu_indices(3)] = entries
            tensor += np.triu(tensor, 1).T
        return cls(tuple(rows[:, 0].tolist()), frozen(rows[:, 1:4].copy()), frozen(tensors))

    def wrench(self, links: list[LinkMotion]) -> Wrench:
        """What the links take, about the origin of the base frame; rotors of motors are left out.

        Args:
            links: the base, and the frames of all joints.
        """
        # One array of all links, (3, links, ...), as numpy is slow at many short ones.
        every = LinkMotion(*(np.stack(parts, axis=-links[0].felt.ndim) for parts in zip(*links[1:], strict=True)))
        ones = [1] * (links[0].felt.ndim - 1)
        about, mass = self.moments.T.reshape(3, -1, *ones), np.reshape(self.masses, (-1, *ones))
        tensors = self.tensors.transpose(1, 2, 0).reshape(3, 3, -1, *ones)
        felt, spin, rate = (turned_back(every.rotation, each) for each in (every.felt, every.spin, every.spin_rate))
        pushed = mass * felt + cross(rate, about) + cross(spin, cross(spin, about))
        own = turned(every.rotation, _spun(tensors, spin, rate) - cross(felt, about))
        pushed = turned(every.rotation, pushed)
        return Wrench(pushed.sum(axis=1), (own + cross(every.origin, pushed)).sum(axis=1))


class HeldStates(NamedTuple):
    """What is held at states: by the stand without payload, by the stand and by the grip for each kilogram of it.

    Attributes:
        base: of the links and of all loads but the payload, about the base's origin.
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
        joints: of the robot's model.
        bodies: the links, with all loads but the payload, of every phase of the schedule of loads.
    """

    dynamics: Dynamics
    joints: tuple[Joint, ...]
    bodies: tuple[CarriedBodies, ...]

    __repr__ = brief

    @classmethod
    def of(cls, dynamics: Dynamics) -> HoldingWrenches:
        """The robot of a motion.

        Raises:
            InvalidInputError: links that a joint moves have no mass.
        """
        dynamics.robot.check_masses("what a grip or a stand holds")
        schedule = dynamics.schedule
        parts = [dynamics] if schedule is None else [dynamics.of_phase(phase) for phase in schedule.phases]
        return cls(dynamics, joints_of(dynamics.robot), tuple(CarriedBodies.of(part.robot) for part in parts))

    def at(self, q: Array, v: Array, a: Array, segments: Array) -> HeldStates:
        """Forces and moments at states.

        Args:
            q: positions, shape (..., K, n_joints) [rad or m].
            v: velocities, the same shape [rad/s or m/s].
            a: accelerations, the same shape [rad/s² or m/s²].
            segments: segments of the motion in which the states lie, shape (K,).
        """
        robot, payload = self.dynamics.robot, self.dynamics.payload
        links = link_motions(robot, self.joints, q, v, a)
        tool = still = tool_motion(robot, links)
        if payload.model != "rigid":
            still = tool_motion(robot, link_motions(robot, self.joints, q, np.zeros_like(v), np.zeros_like(a)))
        each = payload_wrench(robot, payload, tool, still)
        base_each = Wrench(each.force, each.moment + cross(tool.origin, each.force))
        grip_each = Wrench(*(turned_back(tool.rotation, x) for x in each))
        schedule = self.dynamics.schedule
        if schedule is None:
            return HeldStates(self.bodies[0].wrench(links), base_each, grip_each)
        of_states = np.array(schedule.phase_of_segment)[segments]
        base = Wrench(*np.zeros((2, 3, *q.shape[:-1]), dtype=np.result_type(q, v, a)))
        for k, bodies in enumerate(self.bodies):
            there = of_states == k
            for found, own in zip(base, bodies.wrench(links), strict=True):
                found[:] = np.where(there, own, found)
        carried = np.array([schedule.varies(phase) for phase in schedule.phases])[of_states]
        each_of = [Wrench(*(np.where(carried, x, 0.0) for x in wrench)) for wrench in (base_each, grip_each)]
        return HeldStates(base, *each_of)


def _spun(tensor: Array, spin: Array, rate: Array) -> Array:
    """Moment that turns a body with a tensor (3, 3), tensor·rate + spin x tensor·spin, all in its own frame."""
    moment: Array = turned(tensor, rate) + cross(spin, turned(tensor, spin))
    return moment
