"""Payloads known only to intervals: feasible means feasible for every mass and centre of mass that they allow.

Effort is τ₀ + m f(c). For a fixed c it is affine in m, for a fixed m it grows with f(c), so its extremes over
intervals of both are at an end of the mass's and at an extreme of f over the box of centres of mass. Where f is affine
(a bare weight, a robot at rest, the inertia about the tool's origin known) that is a vertex: effort is bilinear in mass
and centre of mass, and the vertices are all that need be looked at. In motion, an inertia about the centre of mass
makes f quadratic; its extremes are then among the stationary points of the box's faces and edges, of which all are
looked at too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, final

import numpy as np

from trajevo.arrays import Array
from trajevo.intervals import greatest_quadratic, interval, mass_interval
from trajevo.payload_effort import PayloadEffort, limited_efforts, quadratic_forms


@final
@dataclass(frozen=True)
class WorstCase:
    """The payload, of all that intervals allow, that comes closest to a limit or exceeds one most.

    Attributes:
        used: effort over limit.
        joint: name of the joint.
        time: instant [s].
        mass: of that payload [kg].
        com: its centre of mass in the tool frame [m].
    """

    used: float
    joint: str
    time: float
    mass: float
    com: tuple[float, float, float]

    @property
    def feasible(self) -> bool:
        """Whether every payload of the intervals keeps every limit."""
        return self.used <= 1.0

    def __str__(self) -> str:
        place = ", ".join(f"{1e3 * x:g}" for x in self.com)
        return (
            f"{100.0 * self.used:.2f} % of the effort limit of {self.joint} at {self.time:.4f} s, by {self.mass:g} kg "
            f"with its centre at ({place}) mm"
        )


@final
@dataclass(frozen=True)
class RobustCapacity:
    """The masses that a motion can carry wherever in a box the centre of mass is.

    Attributes:
        lower: [kg]; above 0 where the motion needs the payload as a counterweight, NaN where no mass is feasible.
        upper: [kg]; inf where nothing limits it, NaN where no mass is feasible.
        joint: name of the joint that binds at ``upper``, empty where none does.
        time: when it binds [s], NaN where none does.
        com: centre of mass in the tool frame for which it binds [m]; the middle of the box where none does.
    """

    lower: float
    upper: float
    joint: str
    time: float
    com: tuple[float, float, float]

    def __str__(self) -> str:
        if np.isnan(self.upper):
            return "no mass is feasible wherever its centre may be"
        place = ", ".join(f"{1e3 * x:g}" for x in self.com)
        least = f"{self.lower:.6f} to " if self.lower > 0.0 else ""
        by = f", limited by {self.joint} at {self.time:.4f} s with its centre at ({place}) mm" if self.joint else ""
        return f"{least}{self.upper:.6f} kg wherever the centre of mass is{by}"


def worst_case(effort: PayloadEffort, *, mass: Any, com: Any) -> WorstCase:
    """The worst payload of intervals of mass and centre of mass.

    Args:
        effort: along the motion.
        mass: least and greatest mass, shape (2,) [kg].
        com: least and greatest coordinates of the centre of mass in the tool frame, shape (2, 3) [m].

    Raises:
        InvalidInputError: intervals that are not from a least to a greatest, a negative mass, or a robot without
            effort limits.
    """
    masses, (low, high) = np.array(mass_interval(mass)), interval(com, "com", (2, 3))
    base, slopes, limit, joint, time = limited_efforts(effort)
    signed = np.concatenate([slopes, -slopes])
    most, where = greatest_in_box(signed, low, high, effort.inertia)
    used = (np.concatenate([base, -base]) + masses[:, None] * most) / np.tile(limit, 2)
    end, row = (int(i) for i in np.unravel_index(used.argmax(), used.shape))
    return WorstCase(
        used=float(used[end, row]),
        joint=effort.robot.joint_names[joint[row % len(joint)]],
        time=float(time[row % len(time)]),
        mass=float(masses[end]),
        com=_point(where[row]),
    )


def robust_capacity(effort: PayloadEffort, *, com: Any) -> RobustCapacity:
    """The masses that a motion can carry wherever in a box the centre of mass is, in closed form.

    Args:
        effort: along the motion.
        com: least and greatest coordinates of the centre of mass in the tool frame, shape (2, 3) [m].

    Raises:
        InvalidInputError: a box that is none, or a robot without effort limits.
    """
    low, high = interval(com, "com", (2, 3))
    rows = effort.rows
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
    )


def greatest_in_box(rows: Array, low: Array, high: Array, inertia: Array) -> tuple[Array, Array]:
    """Greatest value of every row over a box of centres of mass, and where.

    Args:
        rows: per kilogram, shape (R, 10).
        low: least coordinates, shape (3,) [m].
        high: greatest coordinates, shape (3,) [m].
        inertia: per kilogram about the centre of mass, shape (3, 3) [m²].

    Returns:
        Values (R,) and centres of mass (R, 3) [m].
    """
    return greatest_quadratic(*quadratic_forms(rows, inertia), low, high)


def _point(com: Array) -> tuple[float, float, float]:
    x, y, z = com.tolist()
    return x, y, z
