"""Payloads known only as intervals: feasible means feasible for every mass and centre of mass in the intervals.

Effort is τ₀ + m f(c). For a fixed c it is affine in m, and for a fixed m it grows with f(c). So its extremes are at an
end of the mass interval and at an extreme of f over the box of centres of mass. If f is affine (a bare weight, a robot
at rest, or a known inertia about the tool's origin), an extreme of f is at a vertex of the box, so that checking the
vertices is enough. In motion, an inertia about the centre of mass makes f quadratic; its extremes are then at vertices
or at stationary points in the box, its faces and edges, which are all checked.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil, floor
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, frozen, numbers
from trajevo.base.intervals import greatest_quadratic, interval, mass_interval
from trajevo.capacity.capacity import known, margin_of, rounded
from trajevo.capacity.dlcc import SAMPLES, sampled_motion
from trajevo.capacity.payload_effort import (
    PayloadEffort,
    check_reach,
    limited_efforts,
    payload_effort,
)
from trajevo.capacity.slowdown import Slowdown, slowdown_for
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.front.front import Solution
from trajevo.robot.payload import Payload, quadratic_forms
from trajevo.solvers.gradient.weighted_sum import WeightedOptimum


@final
@dataclass(frozen=True)
class WorstCase:
    """The payload in given intervals whose effort comes closest to a limit or exceeds it most.

    Attributes:
        used: effort over limit.
        joint: name of the joint.
        time: instant [s].
        mass: mass of this payload [kg].
        com: its centre of mass in the tool frame [m].
        samples: instants per segment that were looked at; None if no instant uses more.
        kept: share of the robot's effort limits that the motion's problem keeps, of which ``used`` is a share.
    """

    used: float
    joint: str
    time: float
    mass: float
    com: tuple[float, float, float]
    samples: int | None
    kept: float

    @property
    def feasible(self) -> bool:
        """Whether every payload in the intervals keeps every limit."""
        return self.used <= 1.0

    def __str__(self) -> str:
        place = ", ".join(f"{1e3 * x:g}" for x in self.com)
        return (
            f"{100.0 * self.used:.2f} % of the effort limit of {self.joint}{_less(self.kept)} at {self.time:.4f} s, by "
            f"{self.mass:g} kg with its centre at ({place}) mm; {known(self.samples)}"
        )


@final
@dataclass(frozen=True)
class RobustCapacity:
    """The masses that a motion can carry for every centre of mass in a box.

    Attributes:
        lower: least mass [kg]; above 0 if the motion needs the payload as a counterweight, NaN if no mass is feasible.
        upper: greatest mass [kg]; inf if nothing limits it, NaN if no mass is feasible.
        joint: name of the joint that binds at ``upper``, empty if none does.
        time: instant at which it binds [s], NaN if none does.
        com: centre of mass in the tool frame for which it binds [m]; the middle of the box if none does.
        samples: instants per segment that were looked at; None if the masses are guaranteed at every instant.
        kept: share of the robot's effort limits that the motion's problem keeps.
        at_full_limit: ``upper`` at the robot's full effort limits [kg]; None if ``kept`` is 1.
    """

    lower: float
    upper: float
    joint: str
    time: float
    com: tuple[float, float, float]
    samples: int | None
    kept: float
    at_full_limit: float | None

    def __str__(self) -> str:
        if self.at_full_limit is None:
            return self._text
        full = f"{rounded(self.at_full_limit, floor)} kg" if self.at_full_limit >= 0.0 else "none"
        return f"with the margin of {margin_of(self.kept)}: {self._text}; at the robot's full limit: {full}"

    @property
    def _text(self) -> str:
        if np.isnan(self.upper):
            return f"no mass is feasible wherever its centre may be; {known(self.samples)}"
        place = ", ".join(f"{1e3 * x:g}" for x in self.com)
        least = f"{rounded(self.lower, ceil)} to " if self.lower > 0.0 else ""
        by = f", limited by {self.joint} at {self.time:.4f} s with its centre at ({place}) mm" if self.joint else ""
        return f"{least}{rounded(self.upper, floor)} kg wherever the centre of mass is{by}; {known(self.samples)}"


def worst_case(effort: PayloadEffort, *, mass: Any, com: Any) -> WorstCase:
    """The worst payload in given intervals of mass and centre of mass.

    Args:
        effort: effort along the motion.
        mass: least and greatest mass, shape (2,) [kg].
        com: least and greatest coordinates of the centre of mass in the tool frame, shape (2, 3) [m].

    Raises:
        InvalidInputError: an interval whose ends are not in ascending order, a negative mass, or a robot without effort
            limits.
    """
    masses, (low, high) = np.array(mass_interval(mass)), interval(com, "com", (2, 3))
    _check_box(effort, low, high)
    efforts = limited_efforts(effort)
    most, where = greatest_in_box(efforts.slopes, low, high, effort.inertia)
    used = (efforts.base + masses[:, None] * most) / efforts.limit
    end, row = (int(i) for i in np.unravel_index(used.argmax(), used.shape))
    return WorstCase(
        used=float(used[end, row]),
        joint=effort.robot.joint_names[efforts.joint[row]],
        time=float(efforts.time[row]),
        mass=float(masses[end]),
        com=_point(where[row]),
        samples=effort.samples,
        kept=effort.kept,
    )


def robust_capacity(effort: PayloadEffort, *, com: Any) -> RobustCapacity:
    """The masses that a motion can carry for every centre of mass in a box, in closed form.

    Args:
        effort: effort along the motion, at samples or bounded at every instant
            (:func:`~trajevo.capacity.payload_effort.payload_bounds`).
        com: least and greatest coordinates of the centre of mass in the tool frame, shape (2, 3) [m].

    Raises:
        InvalidInputError: an invalid box, or a robot without effort limits.
    """
    low, high = interval(com, "com", (2, 3))
    _check_box(effort, low, high)
    rows = effort.rows_within(float(np.linalg.norm(np.maximum(np.abs(low), np.abs(high)))))
    above, where = greatest_in_box(rows.above, low, high, effort.inertia)
    below = greatest_in_box(rows.below, low, high, effort.inertia)[0]
    row = int(above.argmax()) if len(above) else 0
    found = rows.mass_range(
        np.array([above.max(initial=-np.inf)]), np.array([row]), np.array([below.max(initial=-np.inf)])
    )
    binds = int(found.joint[0])
    return RobustCapacity(
        lower=float(found.lower[0]),
        upper=float(found.upper[0]),
        joint=effort.robot.joint_names[binds] if binds >= 0 else "",
        time=float(found.time[0]),
        com=_point(where[row] if binds >= 0 else 0.5 * (low + high)),
        samples=effort.samples,
        kept=effort.kept,
        at_full_limit=None if effort.kept == 1.0 else robust_capacity(effort.at_full_limit, com=com).upper,
    )


def _check_box(effort: PayloadEffort, low: Array, high: Array) -> None:
    check_reach(effort, np.maximum(np.abs(low), np.abs(high))[None])


def _less(kept: float) -> str:
    return "" if kept == 1.0 else f" less {margin_of(kept)}"


@final
@dataclass(frozen=True, eq=False)
class RobustCurve:
    """The largest payload by the tolerance of its centre of mass.

    Attributes:
        com: middle of the boxes in which the centre of mass may be, in the tool frame, shape (3,) [m].
        tolerances: half of the sides of the boxes, ascending from 0, shape (N,) [m].
        mass: greatest mass, inf where nothing limits it, NaN where no mass is feasible, shape (N,) [kg].
        joints: names of the joints that bind, empty where none does, N of them.
        payload_model: how the payload acts.
        samples: instants per segment that were looked at; None if the masses are guaranteed at every instant.
        kept: share of the robot's effort limits that the motion's problem keeps.
    """

    com: Array
    tolerances: Array
    mass: Array
    joints: tuple[str, ...]
    payload_model: str
    samples: int | None
    kept: float


def robust_curve(
    effort: PayloadEffort, *, com: Any = (0.0, 0.0, 0.0), within: float = 0.1, count: int = 26
) -> RobustCurve:
    """:func:`robust_capacity` for boxes of increasing size.

    Args:
        effort: effort along the motion.
        com: middle of the boxes, in the tool frame, shape (3,) [m].
        within: half of the side of the largest box [m].
        count: number of boxes.

    Raises:
        InvalidInputError: another shape, or a robot without effort limits.
    """
    middle, half = numbers(com, name="com", shape=(3,)), np.linspace(0.0, within, count)
    found = [robust_capacity(effort, com=np.stack([middle - by, middle + by])) for by in half]
    return RobustCurve(
        com=frozen(middle.copy()),
        tolerances=frozen(half),
        mass=frozen(np.array([one.upper for one in found])),
        joints=tuple(one.joint for one in found),
        payload_model=effort.payload_model,
        samples=effort.samples,
        kept=effort.kept,
    )


def greatest_in_box(rows: Array, low: Array, high: Array, inertia: Array) -> tuple[Array, Array]:
    """Greatest value of every row over a box of centres of mass, and the centre of mass that yields it.

    Args:
        rows: slopes per kilogram, shape (R, 10).
        low: least coordinates, shape (3,) [m].
        high: greatest coordinates, shape (3,) [m].
        inertia: inertia per kilogram about the centre of mass, shape (3, 3) [m²].

    Returns:
        Values (R,) and centres of mass (R, 3) [m].
    """
    return greatest_quadratic(*quadratic_forms(rows, inertia), low, high)


def _point(com: Array) -> tuple[float, float, float]:
    x, y, z = com.tolist()
    return x, y, z


#: Share of a limit below which the worst payload ends the search; above it, this payload is examined too.
_CLOSE = 0.98

#: Payloads after which the search is given up; most motions need one or two, one of 167 needed 17.
_PAYLOADS = 100


@final
@dataclass(frozen=True, eq=False)
class RobustSlowdown:
    """The least time in which a motion along a fixed path carries every payload in given intervals.

    Attributes:
        factor: least duration over that of the original motion; below 1 if the motion can be faster.
        duration: least duration [s].
        payloads: the payloads that were examined; together they allow no smaller factor.
        binding: slowdown for the one of them that alone needs the greatest factor.
    """

    factor: float
    duration: float
    payloads: tuple[Payload, ...]
    binding: Slowdown


def robust_slowdown(
    motion: Solution | Rollout | WeightedOptimum, *, mass: Any, com: Any, samples: int = SAMPLES
) -> RobustSlowdown:
    """The least uniform scaling of time with which a motion carries every payload in given intervals.

    Args:
        motion: as for :func:`trajevo.capacity.slowdown.slowdown_for`; its payload gives the model and the inertia per
            kilogram.
        mass: least and greatest mass, shape (2,) [kg].
        com: least and greatest coordinates of the centre of mass in the tool frame, shape (2, 3) [m].
        samples: instants per segment, both ends included.

    Raises:
        InvalidInputError: an interval whose ends are not in ascending order, a negative mass, a payload in the
            intervals that cannot be carried at any speed along the path, or no factor that allows all payloads.
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
    """The least number that is in every one of several unions of closed intervals, each (K, 2) and ascending."""
    least, before = 0.0, -1.0
    while least != before:
        before = least
        for intervals in allowed:
            reached = np.flatnonzero(intervals[:, 1] >= least)
            if not len(reached):
                raise InvalidInputError("com: expected payloads that one speed along this path suits, none suits all")
            least = max(least, float(intervals[reached[0], 0]))
    return least
