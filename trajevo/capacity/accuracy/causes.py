"""The masses that accuracy, a grip and a stand allow at every instant looked at.

With a payload m the tool gives way by d₀ + m d₁, so a greatest deviation is a quadratic inequality. What friction holds
is linear in m, and the moment about an edge of the footprint affine: closed forms, all of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.capacity.drives.instants import Bounds
from trajevo.capacity.drives.squares import within_square
from trajevo.dynamics.contacts.bending import Bending
from trajevo.dynamics.contacts.wrenches import HeldStates, HoldingWrenches, Wrench, dot
from trajevo.dynamics.drives.motors import MotorStates
from trajevo.dynamics.payload_masses import masses_within
from trajevo.dynamics.rollout import Rollout
from trajevo.robot.contacts.grip import Grip
from trajevo.robot.contacts.stand import Stand

#: Ways in which a payload leaves a grip.
SLIPS = ("across the closing axis", "along the closing axis")


@final
@dataclass(frozen=True)
class Cause:
    """What limits the payload at single instants.

    Attributes:
        names: of one cause, or of those that are found of the same wrenches, with the places that each stands for.
        bounds: masses at states, two arrays (K, places of all) [kg].
    """

    names: Mapping[str, tuple[str, ...]]
    bounds: Bounds

    __repr__ = brief

    @property
    def columns(self) -> dict[str, slice]:
        """Columns of every name."""
        counts = np.cumsum([0, *(len(places) for places in self.names.values())]).tolist()
        return {name: slice(*ends) for name, ends in zip(self.names, pairwise(counts), strict=True)}


def causes_of(rollout: Rollout, deviation: float | None, counted: str) -> tuple[Cause, ...]:
    """What limits the payload of a motion besides drives.

    Args:
        rollout: the motion.
        deviation: greatest deviation of the tool [m]; None for any.
        counted: which torques count for it, one of :data:`~trajevo.dynamics.contacts.bending.COUNTED`.
    """
    robot = rollout.robot
    found = []
    if deviation is not None:
        bending, far = bending_of(rollout), deviation
        found.append(Cause({"deviation": ("",)}, lambda states: deviating(bending, states, far, counted)))
    if robot.grip is not None or robot.stand is not None:
        found.append(_held(rollout, robot.grip, robot.stand))
    return tuple(found)


def bending_of(rollout: Rollout) -> Bending:
    """How the joints of a robot give way, made once."""
    return rollout.dynamics.once("what gives way", lambda: Bending.of(rollout.robot))


def _held(rollout: Rollout, grip: Grip | None, stand: Stand | None) -> Cause:
    """What a grip and a stand hold, one of which is there."""
    wrenches = rollout.dynamics.once("what holds", lambda: HoldingWrenches.of(rollout.dynamics))
    gravity = np.array(rollout.robot.model.gravity.linear)

    def bounds(states: MotorStates) -> tuple[Array, Array]:
        held = wrenches.at(states.position, states.velocity, states.acceleration, states.segments)
        found = [] if grip is None else [slipping(grip, held)]
        found += [] if stand is None else [tipping(stand, gravity, held)]
        least, most = zip(*found, strict=True)
        return np.concatenate(least, axis=1), np.concatenate(most, axis=1)

    names = {} if grip is None else {"slip": SLIPS}
    return Cause(names | ({} if stand is None else {"tip_over": stand.edge_names}), bounds)


def deviating(bending: Bending, states: MotorStates, most: float, counted: str) -> tuple[Array, Array]:
    """Least and greatest masses with which the tool deviates by at most so much [m], two arrays (K, 1) [kg]."""
    moved = bending.per_load(states.position)
    each = (moved * states.per_kilogram[:, None]).sum(axis=-1)
    own = np.zeros_like(each) if counted == "payload" else (moved * states.load[:, None]).sum(axis=-1)
    a, b, c = ((x * y).sum(axis=-1) for x, y in ((own, own), (own, each), (each, each)))
    low, high = within_square(a, b, c, most**2)
    return np.maximum(low, 0.0)[:, None], high[:, None]


def slipping(grip: Grip, held: HeldStates) -> tuple[Array, Array]:
    """Least and greatest masses that a grip holds, two arrays (K, 2) [kg], by :data:`SLIPS`."""
    axis = np.array(grip.closing_axis) / np.linalg.norm(grip.closing_axis)
    force = held.grip_each.force
    along = dot(force, axis)
    across = force - np.multiply.outer(axis, along)
    square = dot(across, across) / grip.friction**2
    if grip.torsion is not None:
        turning = dot(held.grip_each.about(np.array(grip.point)), axis)
        square = square + (turning / grip.torsion) ** 2
    needed = grip.safety * np.stack([np.sqrt(square), np.abs(along)], axis=1)
    with np.errstate(divide="ignore"):
        return np.zeros_like(needed), np.where(needed > 0.0, grip.pressing / needed, np.inf)


def tipping(stand: Stand, gravity: Array, held: HeldStates) -> tuple[Array, Array]:
    """Least and greatest masses with which a stand tips over no edge of its footprint, two arrays (K, E) [kg]."""
    own, each = edge_moments(stand, gravity, held)
    return masses_within(own, each, np.zeros_like(own), np.full_like(own, np.inf))


def edge_moments(stand: Stand, gravity: Array, held: HeldStates) -> tuple[Array, Array]:
    """Moments that press a stand down about its edges: without payload [N·m], for each kilogram, two arrays (K, E).

    The floor can only push, so none may be negative; it is so if and only if the zero moment point is in the footprint.
    """
    places, ways = stand.edges(-gravity)
    weight = -stand.mass * gravity
    of_stand = np.cross(np.array(stand.com), weight)
    own = Wrench(*(x + y.reshape(3, *[1] * (x.ndim - 1)) for x, y in zip(held.base, (weight, of_stand), strict=True)))
    moments = [
        np.stack([dot(wrench.about(place), way) for place, way in zip(places, ways, strict=True)], axis=-1)
        for wrench in (own, held.base_each)
    ]
    return moments[0], moments[1]
