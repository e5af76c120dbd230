"""The masses that accuracy, a grip and a stand allow at every instant looked at.

With a payload m the tool gives way by d₀ + m d₁, so a greatest deviation is a quadratic inequality. What friction holds
is linear in m, and the moment about an edge of the footprint affine: closed forms, all of them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.capacity.accuracy.states import MotionStates
from trajevo.capacity.drives.squares import within_square
from trajevo.dynamics.contacts.bending import Bending
from trajevo.dynamics.contacts.links import dot
from trajevo.dynamics.contacts.wrenches import NOTHING, HeldStates, HoldingWrenches, Wrench
from trajevo.dynamics.payload_masses import masses_within
from trajevo.dynamics.rollout import Rollout
from trajevo.robot.contacts.grip import Grip
from trajevo.robot.contacts.stand import Stand

#: Ways in which a payload leaves a grip.
SLIPS = ("across the closing axis", "along the closing axis")


#: States at K instants -> least and greatest masses, two arrays (K, C) [kg].
_Bounds = Callable[[MotionStates, HeldStates], tuple[Array, Array]]


@final
@dataclass(frozen=True, eq=False)
class Causes:
    """What limits the payload at single instants, in columns.

    Attributes:
        columns: those of every cause.
        places: what every column stands for.
        of_causes: masses by every cause.
        holding: forces on grip and stand; None if neither is there.
    """

    columns: Mapping[str, slice]
    places: tuple[str, ...]
    of_causes: tuple[_Bounds, ...]
    holding: HoldingWrenches | None

    __repr__ = brief

    def bounds(self, states: MotionStates) -> tuple[Array, Array]:
        """Least and greatest masses at K instants, two arrays (K, columns) [kg]."""
        held = NOTHING if self.holding is None else self.holding.at(states.q, states.v, states.a, states.segments)
        least, most = zip(*(bounds(states, held) for bounds in self.of_causes), strict=True)
        return np.concatenate(least, axis=1), np.concatenate(most, axis=1)


def causes_of(rollout: Rollout, deviation: float | None, counted: str) -> Causes:
    """What limits the payload of a motion besides drives.

    Args:
        rollout: the motion.
        deviation: greatest deviation of the tool [m]; None for any.
        counted: which torques count for it, one of :data:`~trajevo.dynamics.contacts.bending.COUNTED`.
    """
    robot = rollout.robot
    grip, stand, gravity = robot.grip, robot.stand, np.array(robot.model.gravity.linear)
    found: dict[str, tuple[tuple[str, ...], _Bounds]] = {}
    if deviation is not None:
        bending, far = Bending.of(robot), deviation
        found["deviation"] = ("",), lambda states, _: deviating(bending, states, far, counted)
    if grip is not None:
        found["slip"] = SLIPS, lambda _, held: slipping(grip, held)
    if stand is not None:
        found["tip_over"] = stand.edge_names, lambda _, held: tipping(stand, gravity, held)
    counts = np.cumsum([0, *(len(places) for places, _ in found.values())]).tolist()
    return Causes(
        columns={name: slice(*ends) for name, ends in zip(found, pairwise(counts), strict=True)},
        places=tuple(place for places, _ in found.values() for place in places),
        of_causes=tuple(bounds for _, bounds in found.values()),
        holding=None if grip is None and stand is None else HoldingWrenches.of(rollout.dynamics),
    )


def deviating(bending: Bending, states: MotionStates, most: float, counted: str) -> tuple[Array, Array]:
    """Least and greatest masses with which the tool deviates by at most so much [m], two arrays (K, 1) [kg]."""
    moved = bending.per_load(states.q)
    each = (moved * states.each[:, None]).sum(axis=-1)
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
