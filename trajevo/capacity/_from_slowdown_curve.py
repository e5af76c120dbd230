"""Payload against the least time along one path: :mod:`trajevo.slowdown` over masses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from trajevo.arrays import Array, frozen, numbers
from trajevo.capacity import SAMPLES
from trajevo.dynamics import Rollout
from trajevo.errors import InvalidInputError
from trajevo.front import Solution
from trajevo.slowdown import ScaledPath
from trajevo.weighted import WeightedOptimum


@final
@dataclass(frozen=True, eq=False)
class SlowdownCurve:
    """The least time of a motion along a fixed path for each payload.

    Attributes:
        payloads: [kg], ascending, shape (N,).
        factors: least duration over that of the motion as it is, shape (N,); NaN where the payload cannot be carried.
        durations: least duration, shape (N,) [s]; NaN likewise.
        limits: what binds, one of :data:`SCALED_LIMITS`, empty where the payload cannot be carried, N of them.
        joints: names of the binding joints, N of them.
        static_bound: the greatest payload that can be held at rest everywhere on the path [kg]; may be inf.
        present_duration: of the motion as it is [s].
        payload_model: how the payload acts.
    """

    payloads: Array
    factors: Array
    durations: Array
    limits: tuple[str, ...]
    joints: tuple[str, ...]
    static_bound: float
    present_duration: float
    payload_model: str


def slowdown_curve(
    motion: Solution | Rollout | WeightedOptimum, payloads: Sequence[float] | None = None, *, samples: int = SAMPLES
) -> SlowdownCurve:
    """:func:`slowdown_for` over masses.

    Args:
        motion: as for :func:`slowdown_for`; the shape and the model of the payload are its own.
        payloads: masses [kg]; if None 40 from 0 to 99 % of what the robot can hold at rest, close where the time rises.
        samples: as for :func:`slowdown_for`.

    Raises:
        InvalidInputError: no payloads, negative ones, or none given where nothing bounds what the robot can hold.
    """
    path = ScaledPath(motion, samples)
    own, now = path.rollout.dynamics.payload, float(path.rollout.trajectory.duration[0])
    if payloads is None:
        if not 0.0 < path.static_bound < np.inf:
            raise InvalidInputError(
                f"payloads: expected masses [kg], as the robot can hold {max(path.static_bound, 0.0):g} kg at rest"
            )
        payloads = (path.static_bound * (1.0 - np.linspace(1.0, 0.1, 40) ** 2)).tolist()
    masses = np.sort(numbers(payloads, name="payloads", shape=("N",)))
    if not len(masses) or masses[0] < 0.0:
        raise InvalidInputError(f"payloads: expected at least one mass from 0 on [kg], got {masses.tolist()}")
    found = [path.slowdown(own.with_mass(mass)) if path.carries(mass) else None for mass in masses.tolist()]
    factors = np.array([np.nan if one is None else one.factor for one in found])
    return SlowdownCurve(
        payloads=frozen(masses),
        factors=frozen(factors),
        durations=frozen(now * factors),
        limits=tuple("" if one is None else one.limit for one in found),
        joints=tuple("" if one is None else one.joint for one in found),
        static_bound=path.static_bound,
        present_duration=now,
        payload_model=own.model,
    )
