"""Faster or slower along the same path: the least time in which a motion, scaled uniformly, carries a payload.

The allowed speeds have a closed form, see :mod:`trajevo.dynamics.path_effort`; instants are added where the effort
peaks between samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import final

import numpy as np

from trajevo.base.arrays import Array, frozen, numbers
from trajevo.capacity.dlcc import SAMPLES, sampled_motion
from trajevo.dynamics.path_effort import EffortOfPath, allowed_speeds
from trajevo.dynamics.payload_masses import mass_bounds
from trajevo.dynamics.rollout import Rollout, rollout_of
from trajevo.errors import InvalidInputError
from trajevo.front.front import Solution
from trajevo.robot.payload import Payload
from trajevo.solvers.gradient.weighted_sum import WeightedOptimum

#: Limits that can bound the speed, in the order of :attr:`Slowdown.utilisation`.
SCALED_LIMITS = ("velocity", "acceleration", "jerk", "effort")

#: Share of an effort limit that counts as rounding.
_ROUNDING = 1e-12

#: Utilisation from which a peak of effort between samples is searched, and number of peaks at a time.
_NEAR, _PEAKS = 0.9, 64


#: Number of new instants between the neighbours of a peak, and greatest number of rounds that add them.
_ZOOM, _ROUNDS = 21, 16


#: Relative change of the speed that ends the search.
_SETTLED = 1e-11


@final
@dataclass(frozen=True, eq=False)
class Slowdown:
    """The least time in which a motion along a fixed path carries a payload.

    Attributes:
        payload: the payload.
        factor: least duration over that of the original motion; below 1 if the motion can be faster.
        duration: least duration [s].
        limit: the binding limit, one of :data:`SCALED_LIMITS`.
        joint: name of the binding joint.
        time: instant of the scaled motion at which it binds [s].
        utilisation: greatest share of each limit of each joint at ``factor``, shape (4, n_joints), rows in the order
            of :data:`SCALED_LIMITS`; 0 where there is no limit. Effort below 90 % is that at samples.
        allowed: all factors that every limit allows, as ascending intervals, shape (K, 2), the last end usually inf.
        motion: the original motion, carrying the payload.
    """

    payload: Payload
    factor: float
    duration: float
    limit: str
    joint: str
    time: float
    utilisation: Array
    allowed: Array
    motion: Rollout

    @cached_property
    def rollout(self) -> Rollout:
        """The robot on the scaled motion, carrying the payload."""
        return replace(self.motion, trajectory=self.motion.trajectory.slowed(self.factor))

    def __str__(self) -> str:
        percent = 100.0 * (self.factor - 1.0)
        change = (
            "as now" if abs(percent) < 1e-6 else f"{abs(percent):.3g} % {'more' if percent > 0.0 else 'less'} than now"
        )
        return (
            f"{self.payload.mass:g} kg ({self.payload.model} payload) takes at least {self.duration:.4f} s, {change}, "
            f"limited by the {self.limit} of {self.joint} at {self.time:.4f} s"
        )


def slowdown_for(
    motion: Solution | Rollout | WeightedOptimum, payload: Payload | float, *, samples: int = SAMPLES
) -> Slowdown:
    """The least uniform scaling of time with which a motion carries a payload within the robot's limits.

    The limits are those of velocity, acceleration, jerk (exact peaks) and effort. Position limits do not depend on
    time; a problem's other constraints, such as a tool speed, are not considered.

    Args:
        motion: a solution of a front, an optimum, or the first trajectory of a rollout.
        payload: a payload, or a mass [kg] with shape and model of the motion's own payload.
        samples: instants per segment at the start, both ends included.

    Raises:
        InvalidInputError: a payload that the robot cannot hold at rest somewhere on the path (the message says how much
            it can hold) or that it cannot carry at any speed, or a robot without any limit.
    """
    own = rollout_of(motion).dynamics.payload
    carried = payload if isinstance(payload, Payload) else own.with_mass(Payload(payload).mass)
    return ScaledPath(motion, samples, carried).slowdown(carried)


class ScaledPath:
    """One motion: its effort by powers of the speed, at instants that are added as needed, and its kinematic bounds."""

    def __init__(
        self, motion: Solution | Rollout | WeightedOptimum, samples: int, shape: Payload | None = None
    ) -> None:
        given = sampled_motion(motion, samples)
        if shape is not None and shape != given.dynamics.payload:
            given = replace(given, dynamics=replace(given.dynamics, payload=shape))
        self.rollout = given
        self.limits = given.robot.limits
        self.t: Array = self.rollout.t[0]
        v = self.rollout.without_rounding(self.rollout.v)
        self.effort = EffortOfPath.of(self.rollout, self.rollout.q[0], v[0], self.rollout.a[0])
        limit = np.stack([self.limits.velocity, self.limits.acceleration, self.limits.jerk])
        peaks = np.concatenate([self.rollout.trajectory.peak(order) for order in (1, 2, 3)])
        #: Share of the limit at the original speed, rows velocity, acceleration, jerk.
        self.shares = peaks / limit
        with np.errstate(divide="ignore"):
            self.greatest_speeds = self.shares ** (-1.0 / np.array([[1.0], [2.0], [3.0]]))

    @property
    def _masses_at_rest(self) -> tuple[Array, Array]:
        return mass_bounds(self.effort.held, self.effort.held_per_kilogram, self.limits.effort)

    @cached_property
    def static_bound(self) -> float:
        """The greatest payload [kg] held at rest at all instants; -inf if no mass, not even 0, can be held."""
        least, greatest = (masses.ravel() for masses in self._masses_at_rest)
        return float(greatest.min()) if least.max() <= greatest.min() else -np.inf

    def slowdown(self, payload: Payload) -> Slowdown:
        """The least time with a payload of the path's shape.

        Raises:
            InvalidInputError: the payload cannot be carried at any speed, or nothing bounds the motion.
        """
        if not self._held(payload.mass):
            raise InvalidInputError(f"payload: {self._not_held(payload.mass)}: no slower motion can carry it")
        found = self.slowdown_if_any(payload)
        if found is None:
            raise InvalidInputError(
                f"payload: expected one that some speed along this path suits, got {payload.mass:g} kg: the robot "
                "holds it at rest, but moving it breaks an effort limit however slowly"
            )
        return found

    def slowdown_if_any(self, payload: Payload) -> Slowdown | None:
        """As :meth:`slowdown`, but None if the payload cannot be carried at any speed."""
        if not self._held(payload.mass):
            return None
        speeds, bound = self._greatest_speed(payload.mass)
        if not len(speeds):
            return None
        if bound < 0:
            raise InvalidInputError(
                f"motion: expected one that a limit of velocity, acceleration, jerk or effort bounds, but "
                f"{self.rollout.robot.name!r} has none that this motion would reach"
            )
        return self._bound(payload, speeds, bound)

    def _not_held(self, mass: float) -> str:
        """Text that says which mass the robot cannot hold at rest, and which it can."""
        least, greatest = self._masses_at_rest
        binding, short = (least, mass < least.max()) if mass < least.max() else (-greatest, False)
        instant, joint = (int(i) for i in np.unravel_index(binding.argmax(), binding.shape))
        where = f"{self.rollout.robot.joint_names[joint]} can hold at rest at {self.t[instant]:.4f} s of this motion"
        if np.isinf(least.max()):
            return f"expected a path along which the robot can hold itself, but no mass is what {where}"
        bound = (
            f"at least {least.max():.6f} kg as a counterweight, the least that"
            if short
            else (f"at most {greatest.min():.6f} kg, which")
        )
        return f"expected {bound} {where}, got {mass:g} kg"

    def _greatest_speed(self, mass: float) -> tuple[Array, int]:
        """The result of :meth:`_speeds`, with instants added until the greatest speed settles."""
        before = -1.0
        for _ in range(_ROUNDS):
            speeds, bound = self._speeds(mass)
            if bound < 0 or abs(float(speeds[-1, 1]) - before) <= _SETTLED * before:
                break
            before = float(speeds[-1, 1])
            self._look_closer(mass, before)
        return speeds, bound

    def _held(self, mass: float) -> bool:
        held = self.effort.held + mass * self.effort.held_per_kilogram
        return bool((np.abs(held) <= self.limits.effort * (1.0 + _ROUNDING)).all())

    def _speeds(self, mass: float) -> tuple[Array, int]:
        """Allowed speeds, and the index of the binding interval: kinematic ones first, then those of effort."""
        lower, upper = self.effort.carrying(mass).excluded(self.limits.effort * (1.0 + _ROUNDING))
        kinematic = self.greatest_speeds.ravel()
        return allowed_speeds(
            np.concatenate([kinematic, lower.ravel()]),
            np.concatenate([np.full_like(kinematic, np.inf), upper.ravel()]),
        )

    def _look_closer(self, mass: float, speed: float) -> None:
        """Add instants around the greatest peaks of effort at a speed."""
        used = np.abs(self.effort.carrying(mass).at(speed)) / self.limits.effort
        padded = np.pad(used, ((1, 1), (0, 0)), constant_values=-np.inf)
        peaks = np.where((used >= padded[:-2]) & (used >= padded[2:]) & (used >= _NEAR), used, -np.inf).max(axis=1)
        order = np.argsort(-peaks, kind="stable")[:_PEAKS]
        chosen = order[peaks[order] > -np.inf]
        if not len(chosen):
            return
        low, high = self.t[np.maximum(chosen - 1, 0)], self.t[np.minimum(chosen + 1, len(self.t) - 1)]
        shares = np.linspace(0.0, 1.0, _ZOOM + 2)[1:-1]
        # Breaks are among the instants twice, so none of these ranges crosses a break.
        new = np.setdiff1d(low[:, None] + (high - low)[:, None] * shares, self.t)
        if not len(new):
            return
        trajectory = self.rollout.trajectory
        q, v, a = (trajectory.evaluate(new[None], order) for order in range(3))
        extra = EffortOfPath.of(self.rollout, q[0], self.rollout.without_rounding(v)[0], a[0])
        sorted_places = np.argsort(np.concatenate([self.t, new]), kind="stable")
        self.t = np.concatenate([self.t, new])[sorted_places]
        self.effort = self.effort.joined(extra, sorted_places)

    def _bound(self, payload: Payload, speeds: Array, bound: int) -> Slowdown:
        """The slowdown at the greatest allowed speed."""
        speed, names = float(speeds[-1, 1]), self.rollout.robot.joint_names
        used = np.abs(self.effort.carrying(payload.mass).at(speed)) / self.limits.effort
        kind, joint = divmod(min(bound, self.shares.size), len(names))
        if kind < len(self.shares):
            derivative = self.rollout.trajectory.evaluate(self.t[None], kind + 1)[0, :, joint]
            instant = int(np.abs(derivative).argmax())
        else:
            instant, joint = np.unravel_index(bound - self.shares.size, (4, *used.shape))[1:]
        scaled = self.shares * speed ** np.array([[1.0], [2.0], [3.0]])
        with np.errstate(divide="ignore"):
            allowed = 1.0 / speeds[::-1, ::-1]
        now = float(self.rollout.trajectory.duration[0])
        return Slowdown(
            payload=payload,
            factor=1.0 / speed,
            duration=now / speed,
            limit=SCALED_LIMITS[min(kind, len(self.shares))],
            joint=names[int(joint)],
            time=float(self.t[instant]) / speed,
            utilisation=frozen(np.vstack([scaled, used.max(axis=0)])),
            allowed=frozen(allowed),
            motion=replace(self.rollout, dynamics=replace(self.rollout.dynamics, payload=payload)),
        )


@final
@dataclass(frozen=True, eq=False)
class SlowdownCurve:
    """The least time of a motion along a fixed path for each payload.

    Attributes:
        payloads: masses, ascending, shape (N,) [kg].
        factors: least duration over that of the original motion, NaN where the payload cannot be carried, shape (N,).
        durations: least duration, NaN where the payload cannot be carried, shape (N,) [s].
        limits: N binding limits, each one of :data:`SCALED_LIMITS`, empty where the payload cannot be carried.
        joints: names of the N binding joints.
        static_bound: the greatest payload that can be held at rest everywhere on the path [kg]; may be inf.
        present_duration: duration of the original motion [s].
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
    """:func:`slowdown_for` many masses.

    Args:
        motion: as for :func:`slowdown_for`; its payload gives shape and model.
        payloads: masses [kg]; if None, 40 from 0 to 99 % of the greatest mass that the robot can hold at rest, denser
            where the time rises.
        samples: as for :func:`slowdown_for`.

    Raises:
        InvalidInputError: no or negative masses, or None although nothing bounds the mass that the robot can hold.
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
    found = [path.slowdown_if_any(own.with_mass(mass)) for mass in masses.tolist()]
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
