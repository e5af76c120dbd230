"""What happens on a motion besides moving: rests, and loads that are picked up and put down."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.dynamics.rollout import Rollout
from trajevo.path.loads import Schedule, together
from trajevo.robot.payload import Payload

#: Speed, as a share of the greatest of a motion, that counts as rest.
_REST = 1e-9

#: Shares of a segment at which it is looked at whether anything moves in it.
_LOOKED_AT = np.linspace(0.0, 1.0, 9)


@final
@dataclass(frozen=True)
class Carrying:
    """What the tool carries from an instant on.

    Attributes:
        t: instant [s].
        payload: all that is carried, as one payload.
        gripper: instant at which the gripper begins: the start of a dwell before a load is picked up, else ``t`` [s].
        picked: numbers of the loads that are picked up then, none at the start.
        placed: numbers of the loads that are put down then.
    """

    t: float
    payload: Payload
    gripper: float
    picked: tuple[int, ...] = ()
    placed: tuple[int, ...] = ()

    @property
    def changes(self) -> str:
        """What the gripper does, such as ``"pick up payload.1"``; empty at the start."""
        done = [f"put down payload.{k}" for k in self.placed] + [f"pick up payload.{k}" for k in self.picked]
        return ", ".join(done)

    @property
    def plain(self) -> dict[str, Any]:
        """Plain data: times [s], loads that change, and the payload from then on."""
        return {
            "time": self.t,
            "gripper": self.gripper,
            "pick up": list(self.picked),
            "put down": list(self.placed),
            "payload": self.payload.settings,
        }


def carried(rollout: Rollout) -> tuple[Carrying, ...]:
    """What a single motion carries at its start, and every change on the way, in the order of time."""
    dynamics = rollout.dynamics
    own = dynamics.payload if rollout.masses is None else _of_mass(dynamics.payload, float(rollout.masses[0]))
    schedule = dynamics.schedule
    if schedule is None:
        return (Carrying(0.0, own, 0.0),)
    breaks, dwells = rollout.trajectory.breaks[0].tolist(), _still(rollout)[0]
    last = schedule.carried[0]
    found = [Carrying(0.0, schedule.everything(last, own), 0.0)]
    for k, phase in enumerate(schedule.carried):
        if phase != last:
            picked, placed = tuple(sorted(set(phase) - set(last))), tuple(sorted(set(last) - set(phase)))
            begins = breaks[k - 1] if picked and dwells[k - 1] else breaks[k]
            found.append(Carrying(breaks[k], schedule.everything(phase, own), begins, picked, placed))
        last = phase
    end = _at_end(schedule, own, last, float(rollout.trajectory.duration[0]))
    return (*found, end) if end is not None else tuple(found)


def _at_end(schedule: Schedule, own: Payload, last: tuple[int, ...], duration: float) -> Carrying | None:
    """What is put down where the motion ends, since its ``to`` names the last point."""
    across = [k for k in schedule.carried[0] if schedule.segments_of(k) is not None]  # the seam of a cycle
    placed = tuple(k for k in last if schedule.loads[k].to_point is not None and k not in across)
    if not placed:
        return None
    left = [own if k == schedule.varied else schedule.loads[k].payload for k in last if k not in placed]
    return Carrying(duration, together(left), duration, (), placed)


def _of_mass(payload: Payload, mass: float) -> Payload:
    if payload.inertia is None or not payload.mass:
        return replace(payload, mass=mass, inertia=None)
    scaled = np.array(payload.inertia) * (mass / payload.mass)
    return replace(payload, mass=mass, inertia=tuple(map(tuple, scaled.tolist())))


@final
@dataclass(frozen=True, eq=False)
class Stretch:
    """A part of a motion between two instants at which it rests or what it carries changes.

    Attributes:
        t: instants at which points are wanted, the first and the last included, shape (K,) [s]; two for a dwell.
        q: positions there, shape (K, n_joints) [rad or m].
        dwells: whether nothing moves.
        rests: whether the motion rests at its end.
        before: what is carried from its start on, if that changes there; else None.
        gripper: what the gripper begins to do at its start; empty for nothing.
    """

    t: Array
    q: Array
    dwells: bool
    rests: bool
    before: Carrying | None
    gripper: str


def stretches(rollout: Rollout, step: float) -> tuple[Stretch, ...]:
    """A single motion cut where it rests and where what it carries changes, sampled evenly between.

    Args:
        rollout: the motion.
        step: greatest time between points [s].
    """
    return tuple(_stretches(rollout, step, carried(rollout)))


def _still(rollout: Rollout) -> tuple[Array, Array]:
    """Whether nothing moves in segments, shape (S,), and at their ends, shape (S + 1,)."""
    speeds = np.abs(rollout.trajectory.at_shares(_LOOKED_AT, 1)[0]).max(axis=1).reshape(-1, len(_LOOKED_AT))
    still = speeds <= _REST * float(speeds.max())
    return still.all(axis=1), np.append(still[:, 0], still[-1, -1])


def _stretches(rollout: Rollout, step: float, carried: tuple[Carrying, ...]) -> Iterator[Stretch]:
    trajectory, (dwells, resting) = rollout.trajectory, _still(rollout)
    breaks = trajectory.breaks[0]
    changes = {change.t: change for change in carried}
    gripper = {change.gripper: change.changes for change in carried}
    first = 0
    for k in range(1, len(breaks)):
        last = k == len(breaks) - 1
        cut = resting[k] or float(breaks[k]) in changes or (not last and dwells[k] != dwells[k - 1])
        if not (cut or last):
            continue
        start, end, dwelling = float(breaks[first]), float(breaks[k]), bool(dwells[first:k].all())
        count = 1 if dwelling else max(math.ceil((end - start) / step - 1e-9), 1)
        t = np.linspace(start, end, count + 1)
        at, told = changes.get(start), gripper.get(start, "")
        yield Stretch(frozen(t), frozen(trajectory.evaluate(t)[0]), dwelling, bool(resting[k]), at, told)
        first = k
