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
from trajevo.base.shown.brief import brief
from trajevo.capacity.capacity import known, margin_of, rounded, told_both
from trajevo.capacity.dlcc import SAMPLES, sampled_motion
from trajevo.capacity.notebook import curve_html, told_html
from trajevo.capacity.payload_effort import PayloadEffort, check_reach, limited_efforts, payload_effort
from trajevo.capacity.scaled_path import LeastFactor, ScaledPath, least_factor
from trajevo.capacity.slowdown import TOLD, Slowdown, slowdown_of, why_not
from trajevo.dynamics.rollout import Rollout, rollout_of
from trajevo.errors import InvalidInputError
from trajevo.front.front import Solution
from trajevo.robot.payload import Payload, quadratic_forms
from trajevo.solvers.gradient.weighted_sum import WeightedOptimum


@final
@dataclass(frozen=True)
class WorstCase:
    """The payload in given intervals whose effort comes closest to a limit or exceeds it most.

    Attributes:
        used: effort over limit [1].
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

    def _repr_html_(self) -> str:
        return told_html("Worst payload of the intervals", self)

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

    def _repr_html_(self) -> str:
        return told_html("Payload wherever its centre of mass is", self)

    def __str__(self) -> str:
        if self.at_full_limit is None:
            return self._text
        full = f"{rounded(self.at_full_limit, floor)} kg" if self.at_full_limit >= 0.0 else "none"
        return told_both(self._text, str(full), 1.0 - self.kept)

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

    __repr__ = brief

    def _repr_html_(self) -> str:
        headers = ("tolerance of the centre of mass [mm]", "largest payload [kg]", "limited by")
        return curve_html("Largest payload by tolerance", headers, (1e3 * self.tolerances, self.mass), self.joints)


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

    What is proven is so for the payloads that were examined. That they are the worst of the intervals was found at
    instants, and is not proven between them.

    Attributes:
        factor: least duration over that of the original motion [1]; below 1 if the motion can be faster.
        sampled_factor: the least factor with which the limits are kept at instants.
        proven: whether every limit is proven to be kept at every instant with each of ``payloads``.
        duration: least duration [s].
        payloads: the payloads that were examined; together they allow no smaller factor.
        binding: slowdown for the one of them that alone needs the greatest factor.
        not_kept: as :attr:`~trajevo.capacity.slowdown.Slowdown.not_kept`.
        instants: number of instants at which the worst payloads were sought.
        effort_margin: share of the effort limits that the motion's problem keeps free.
        at_full_limits: the same against the robot's full limits; None if the problem has no margins.
    """

    factor: float
    sampled_factor: float
    proven: bool
    duration: float
    payloads: tuple[Payload, ...]
    binding: Slowdown
    not_kept: tuple[str, ...]
    instants: int
    effort_margin: float
    at_full_limits: RobustSlowdown | None = None

    __repr__ = brief

    def _repr_html_(self) -> str:
        return told_html("Least duration with every payload", self)

    def __str__(self) -> str:
        full = self.at_full_limits
        if full is None or abs(full.factor / self.factor - 1.0) <= TOLD:
            return self._told
        return told_both(self._told, str(full), self.effort_margin)

    @property
    def _told(self) -> str:
        count = len(self.payloads)
        kept = "proven at every instant" if self.proven else "not proven, only checked at instants,"
        told = f"takes at least {self.duration:.4f} s with every payload; {kept} with the worst {count}"
        told += f" of them, which were found at {self.instants} instants"
        return told + (
            f"; not kept at this speed or any slower one tried: {', '.join(self.not_kept)}" if self.not_kept else ""
        )


def robust_slowdown(
    motion: Solution | Rollout | WeightedOptimum, *, mass: Any, com: Any, samples: int = SAMPLES
) -> RobustSlowdown:
    """The least uniform scaling of time with which a motion carries every payload in given intervals.

    Limits and constraints are those of :func:`trajevo.capacity.slowdown.slowdown_for`.

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
    found = _robust(motion, masses, box, samples, full=False)
    if not rollout_of(motion).keeps_margins:
        return found
    return replace(found, at_full_limits=_robust(motion, masses, box, samples, full=True))


def _robust(motion: Any, masses: tuple[float, float], box: Array, samples: int, *, full: bool) -> RobustSlowdown:
    given = sampled_motion(motion, samples)
    # The worst payload is sought against the limits that are meant.
    kept = replace(given.robot, limits=given.robot.limits if full else given.limits)
    path = replace(given, dynamics=replace(given.dynamics, robot=kept), kept_limits=None)
    payload = replace(path.dynamics.payload.with_mass(masses[1]), com=tuple(box.mean(axis=0).tolist()))
    payloads: list[Payload] = []
    paths: list[ScaledPath] = []
    factor = 0.0
    for _ in range(_PAYLOADS):
        payloads.append(payload)
        paths.append(ScaledPath(motion, samples, payload, full=full))
        common, before = _least(paths, payloads, prove=False).factor, factor
        slower = replace(path, trajectory=path.trajectory.slowed(common))
        worst = worst_case(payload_effort(slower, samples=samples), mass=masses, com=box)
        factor, payload = common, replace(payload.with_mass(worst.mass), com=worst.com)
        known = any((one.mass, one.com) == (worst.mass, worst.com) for one in payloads)
        if worst.used < _CLOSE or known or factor == before:
            return _record(paths, payloads, motion)
    raise InvalidInputError(f"com: no factor of time found that suits all payloads after {_PAYLOADS} of them")


def _least(paths: Sequence[ScaledPath], payloads: Sequence[Payload], *, prove: bool) -> LeastFactor:
    """The least factor for several payloads.

    Raises:
        InvalidInputError: a payload that cannot be carried, or no factor that allows all of them.
    """
    for path, payload in zip(paths, payloads, strict=True):
        if not path.held(payload.mass):
            raise InvalidInputError(f"payload: {why_not(path, payload)}")
    found = least_factor(paths, payloads, prove=prove)
    if found is None:
        for path, payload in zip(paths, payloads, strict=True):
            if least_factor([path], [payload], prove=False) is None:
                raise InvalidInputError(f"payload: {why_not(path, payload)}")
        raise InvalidInputError("com: expected payloads that one speed along this path suits, none suits all")
    return found


def _record(paths: Sequence[ScaledPath], payloads: Sequence[Payload], motion: Any) -> RobustSlowdown:
    found = _least(paths, payloads, prove=True)
    each = [slowdown_of(path, payload, motion) for path, payload in zip(paths, payloads, strict=True)]
    return RobustSlowdown(
        factor=found.factor,
        sampled_factor=found.sampled,
        proven=found.proven,
        duration=found.factor * float(paths[0].rollout.trajectory.duration[0]),
        payloads=tuple(payloads),
        binding=max(each, key=lambda slowdown: slowdown.factor),
        not_kept=found.not_kept,
        instants=paths[0].rollout.t.shape[1],
        effort_margin=paths[0].rollout.effort_margin,
    )
