"""Forces and moments that move a robot's links and its payload, which what holds them has to give."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.contacts.links import LinkMotion, link_motions, tool_motion, turned, turned_back
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rnea_tree import Inertias
from trajevo.robot.kinematics import crossed
from trajevo.robot.payload import Payload
from trajevo.robot.robot import Robot


class Wrench(NamedTuple):
    """A force (..., 3) and a moment about a point (..., 3), in the base frame.

    Of a mass [N and N·m], or of each kilogram [N/kg and N·m/kg].
    """

    force: Array
    moment: Array

    def about(self, point: Array) -> Array:
        """Moment about another point, given relative to the first, shape (..., 3)."""
        moment: Array = self.moment - crossed(point, self.force)
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
        force = -strength * tool.rotation[..., :, 2]
        return Wrench(force, np.zeros_like(force))
    moving = still if payload.model == "weight_only" else tool
    com = np.array(payload.com)
    force = moving.moved(com).felt
    moment = crossed(turned(moving.rotation, com), force)
    if payload.inertia is None or payload.mass == 0.0:
        return Wrench(force, moment)
    tensor = np.array(payload.inertia) / payload.mass
    spin, rate = (turned_back(moving.rotation, each) for each in (moving.spin, moving.spin_rate))
    return Wrench(force, moment + turned(moving.rotation, _spun(tensor, spin, rate)))


def links_wrench(robot: Robot, links: list[LinkMotion]) -> Wrench:
    """What all moving links take, about the origin of the base frame; rotors of motors are left out."""
    force = moment = np.zeros_like(links[0].felt)
    bodies = Inertias.of(robot.model).bodies
    for link, (mass, x, y, z, *entries) in zip(links[1:], bodies.tolist(), strict=True):
        about = np.array([x, y, z])  # mass times centre of mass
        tensor = np.zeros((3, 3))
        tensor[np.triu_indices(3)] = entries
        felt, spin, rate = (turned_back(link.rotation, each) for each in (link.felt, link.spin, link.spin_rate))
        pushed = mass * felt + crossed(rate, about) + crossed(spin, crossed(spin, about))
        own = crossed(about, felt) + _spun(tensor + np.triu(tensor, 1).T, spin, rate)
        pushed, own = turned(link.rotation, pushed), turned(link.rotation, own)
        force, moment = force + pushed, moment + own + crossed(link.origin, pushed)
    return Wrench(force, moment)


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


def held_at(dynamics: Dynamics, q: Array, v: Array, a: Array, segments: Array) -> HeldStates:
    """Forces and moments at states.

    Args:
        dynamics: robot and payload, whose mass does not matter.
        q: positions, shape (K, n_joints) [rad or m].
        v: velocities, the same shape [rad/s or m/s].
        a: accelerations, the same shape [rad/s² or m/s²].
        segments: segments of the motion in which the states lie, shape (K,).
    """
    robot, kind = dynamics.robot, np.result_type(q, v, a)
    links = link_motions(robot, q, v, a)
    tool = tool_motion(robot, links)
    still = tool
    if dynamics.payload.model != "rigid":
        still = tool_motion(robot, link_motions(robot, q, np.zeros_like(v), np.zeros_like(a)))
    base, base_each, grip_each = (Wrench(*np.zeros((2, *q.shape[:-1], 3), dtype=kind)) for _ in range(3))
    each = payload_wrench(robot, dynamics.payload, tool, still)
    for part, places, carried in _phases(dynamics, segments):
        there = links_wrench(part.robot, [LinkMotion(*(x[places] for x in link)) for link in links])
        base.force[places], base.moment[places] = there
        if carried:
            held = Wrench(*(x[places] for x in each))
            base_each.force[places] = held.force
            base_each.moment[places] = held.moment + crossed(tool.origin[places], held.force)
            for found, own in zip(grip_each, held, strict=True):
                found[places] = turned_back(tool.rotation[places], own)
    return HeldStates(base, base_each, grip_each)


def _phases(dynamics: Dynamics, segments: Array) -> Iterator[tuple[Dynamics, Array, bool]]:
    """What is carried, the places of the states at which it is, and whether the payload is among it."""
    if dynamics.schedule is None:
        yield dynamics, np.arange(len(segments)), True
        return
    of_states = np.array(dynamics.schedule.phase_of_segment)[segments]
    for k, phase in enumerate(dynamics.schedule.phases):
        places = np.flatnonzero(of_states == k)
        if len(places):
            yield dynamics.of_phase(phase), places, dynamics.schedule.varies(phase)


def _spun(tensor: Array, spin: Array, rate: Array) -> Array:
    """Moment that turns a body with a tensor (3, 3), tensor·rate + spin x tensor·spin, all in its own frame."""
    moment: Array = turned(tensor, rate) + crossed(spin, turned(tensor, spin))
    return moment
