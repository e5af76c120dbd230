"""Slower along the same path until every payload of intervals can be carried.

Each payload leaves the factors of time of :mod:`trajevo.slowdown`, in closed form. Which payloads count is found by
exchange: at the least factor that those known so far leave, the worst payload of the intervals
(:mod:`trajevo.robust_payload`, exact) joins them, until it breaks no limit. So nothing is given away, and the result is
that of all payloads, not of vertices alone. One that is close to a limit joins as well, since its effort may peak
between the instants, where its slowdown looks closer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np

from trajevo.arrays import Array
from trajevo.capacity import SAMPLES, sampled_motion
from trajevo.dynamics import Rollout
from trajevo.errors import InvalidInputError
from trajevo.front import Solution
from trajevo.intervals import interval, mass_interval
from trajevo.payload import Payload
from trajevo.payload_effort import payload_effort
from trajevo.robust_payload import worst_case
from trajevo.slowdown import Slowdown, slowdown_for
from trajevo.weighted import WeightedOptimum

#: Share of a limit from which the worst payload is looked at closer.
_CLOSE = 0.98

#: Payloads that are looked at before the search is given up; one or two for most motions, 17 for one of 167.
_PAYLOADS = 100


@final
@dataclass(frozen=True, eq=False)
class RobustSlowdown:
    """The least time in which a motion along a fixed path carries every payload of intervals.

    Attributes:
        factor: least duration over that of the motion as it is; below 1 the motion can be faster.
        duration: least duration [s].
        payloads: those that were looked at; together they leave no smaller factor.
        binding: the slowdown for the one of them that needs most by itself.
    """

    factor: float
    duration: float
    payloads: tuple[Payload, ...]
    binding: Slowdown


def robust_slowdown(
    motion: Solution | Rollout | WeightedOptimum, *, mass: Any, com: Any, samples: int = SAMPLES
) -> RobustSlowdown:
    """The least uniform scaling of time with which a motion carries every payload of intervals.

    Args:
        motion: as for :func:`trajevo.slowdown.slowdown_for`; how the payload acts and its inertia per kilogram are its
            own.
        mass: least and greatest mass, shape (2,) [kg].
        com: least and greatest coordinates of the centre of mass in the tool frame, shape (2, 3) [m].
        samples: instants per segment, both ends included.

    Raises:
        InvalidInputError: intervals that are not from a least to a greatest, a negative mass, a payload among them that
            no speed along the path carries, or no factor that suits all.
    """
    masses, box = mass_interval(mass), interval(com, "com", (2, 3))
    path = sampled_motion(motion, samples)
    at, worst_com = masses[1], tuple(box.mean(axis=0).tolist())
    found: list[Slowdown] = []
    factor = 0.0
    for _ in range(_PAYLOADS):
        found.append(slowdown_for(path, replace(path.dynamics.payload.with_mass(at), com=worst_com), samples=samples))
        factor, before = _least_common([slowdown.allowed for slowdown in found]), factor
        slower = Rollout(path.dynamics, path.trajectory.slowed(factor))
        worst = worst_case(payload_effort(slower, samples=samples), mass=masses, com=box)
        known = any((one.payload.mass, one.payload.com) == (worst.mass, worst.com) for one in found)
        if worst.used < _CLOSE or known or factor == before:
            return RobustSlowdown(
                factor=factor,
                duration=factor * float(path.trajectory.duration[0]),
                payloads=tuple(slowdown.payload for slowdown in found),
                binding=max(found, key=lambda slowdown: slowdown.factor),
            )
        at, worst_com = worst.mass, worst.com
    raise InvalidInputError(f"com: no factor of time found that suits all payloads after {_PAYLOADS} of them")


def _least_common(allowed: Sequence[Array]) -> float:
    """The least number in all of some unions of closed intervals, each (K, 2) and ascending."""
    least, before = 0.0, -1.0
    while least != before:
        before = least
        for intervals in allowed:
            reached = np.flatnonzero(intervals[:, 1] >= least)
            if not len(reached):
                raise InvalidInputError("com: expected payloads that one speed along this path suits, none suits all")
            least = max(least, float(intervals[reached[0], 0]))
    return least
