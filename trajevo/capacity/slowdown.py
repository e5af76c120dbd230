"""Faster or slower along the same path: the least time in which a motion, scaled uniformly, carries a payload.

The least factor of time at the instants has a closed form. It is enlarged until it is proven at every instant, see
:mod:`trajevo.capacity.scaled_path`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import final

import numpy as np

from trajevo.base.arrays import Array, frozen, numbers
from trajevo.base.shown.brief import brief
from trajevo.capacity.capacity import told_both
from trajevo.capacity.dlcc import SAMPLES
from trajevo.capacity.notebook import curve_html, slowdown_html
from trajevo.capacity.scaled_constraints import problem_of
from trajevo.capacity.scaled_path import SCALED_LIMITS, LeastFactor, ScaledPath, least_factor
from trajevo.dynamics.rollout import Rollout, rollout_of
from trajevo.errors import InvalidInputError
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.front.front import Solution
from trajevo.path.passing import Passing
from trajevo.robot.payload import Payload
from trajevo.solvers.gradient.weighted_sum import WeightedOptimum

#: Relative difference of two factors that is told.
TOLD = 1e-6


@final
@dataclass(frozen=True, eq=False)
class Slowdown:
    """The least time in which a motion along a fixed path carries a payload.

    Attributes:
        payload: the payload.
        factor: least duration over that of the original motion [1]; below 1 if the motion can be faster. If ``proven``,
            it lies a little above ``sampled_factor``, usually by 1e-8 of it; otherwise it is the same.
        sampled_factor: the least factor with which the limits are kept at ``instants`` instants.
        proven: whether every limit of the joints, effort included, and of the tool's speed is proven to be kept at
            every instant of :attr:`rollout`.
        duration: least duration [s].
        limit: the binding limit: one of :data:`~trajevo.capacity.scaled_path.SCALED_LIMITS`, or the name of a
            constraint of the motion's problem.
        joint: name of the binding joint, ``""`` if a constraint of the problem binds.
        time: instant of the scaled motion at which it binds [s]; NaN if a constraint binds that has none.
        utilisation: greatest share of each limit of each joint at ``factor``, shape (4, n_joints), rows in the order
            of :data:`~trajevo.capacity.scaled_path.SCALED_LIMITS`; 0 where there is no limit. Effort below 90 % is that
            at samples.
        allowed: all factors that limits with a closed form allow at the instants, as ascending intervals, shape
            (K, 2), the last end usually inf; K = 0 if all of them exceed the problem's longest time.
        not_kept: names of constraints of the motion's problem that are broken at ``factor``, since no greater factor
            keeps all of them, or since the path itself breaks them.
        evaluated: quantities or names of constraints of the motion's problem that are evaluated, but not proven between
            samples.
        instants: number of instants at which effort was computed.
        motion: the original motion, carrying the payload.
        problem: the problem of the motion; None for a mere rollout.
        at_full_limits: the same against the robot's full limits; None if the problem has no margins.
    """

    payload: Payload
    factor: float
    sampled_factor: float
    proven: bool
    duration: float
    limit: str
    joint: str
    time: float
    utilisation: Array
    allowed: Array
    not_kept: tuple[str, ...]
    evaluated: tuple[str, ...]
    instants: int
    motion: Rollout
    problem: TrajectoryProblem | None
    at_full_limits: Slowdown | None = None

    __repr__ = brief

    def _repr_html_(self) -> str:
        return slowdown_html(self, SCALED_LIMITS)

    @cached_property
    def rollout(self) -> Rollout:
        """The robot on the scaled motion, carrying the payload."""
        return replace(self.motion, trajectory=self.motion.trajectory.slowed(self.factor))

    @property
    def gap(self) -> float:
        """How far ``factor`` lies above ``sampled_factor``, as a share of it."""
        return self.factor / self.sampled_factor - 1.0

    def __str__(self) -> str:
        full = self.at_full_limits
        if full is None or (abs(full.factor / self.factor - 1.0) <= TOLD and full.not_kept == self.not_kept):
            return self._told
        return told_both(self._told, str(full), self.motion.effort_margin)

    @property
    def _told(self) -> str:
        percent = 100.0 * (self.factor - 1.0)
        change = (
            "as now" if abs(percent) < 1e-4 else f"{abs(percent):.3g} % {'more' if percent > 0.0 else 'less'} than now"
        )
        bound = f"{self.limit} of {self.joint}" if self.joint else self.limit
        when = "" if np.isnan(self.time) else f" at {self.time:.4f} s"
        return (
            f"{self.payload.mass:g} kg ({self.payload.model} payload) takes at least {self.duration:.4f} s, {change}, "
            f"limited by the {bound}{when}{self._certainty}"
        )

    @property
    def _certainty(self) -> str:
        if not self.proven:
            told = f"; not proven, only checked at {self.instants} instants"
        elif self.gap > TOLD:
            told = f"; {100.0 * self.gap:.2g} % above what {self.instants} instants allow, proven at every instant"
        else:
            told = "; proven at every instant"
        if self.proven and self.evaluated:
            told += f" but for {', '.join(self.evaluated)}"
        if self.scaled_too and abs(self.factor - 1.0) > TOLD:
            told += f"; scaled with the motion: {', '.join(self.scaled_too)}"
        return told + (
            f"; not kept at this speed or any slower one tried: {', '.join(self.not_kept)}" if self.not_kept else ""
        )

    @property
    def scaled_too(self) -> tuple[str, ...]:
        """What the motion's problem gives and a uniform scaling of time changes, such as dwells; usually empty."""
        interpolant = None if self.problem is None else self.problem.interpolant
        passing: tuple[Passing, ...] = getattr(interpolant, "passing", ())
        bounds = np.asarray(getattr(interpolant, "duration_bounds", ()))
        return tuple(
            name
            for name, given in (
                ("dwells", any(one.dwell for one in passing)),
                ("given velocities", any(values.any() for one in passing for values in one.vectors.values())),
                ("fixed durations", bounds.ndim == 2 and bool((bounds[:, 0] == bounds[:, 1]).any())),
            )
            if given
        )


def slowdown_for(
    motion: Solution | Rollout | WeightedOptimum, payload: Payload | float, *, samples: int = SAMPLES
) -> Slowdown:
    """The least uniform scaling of time with which a motion carries a payload within its limits, proven if possible.

    The limits are those that the motion's problem keeps, less its margins; a mere rollout of a robot keeps the robot's.
    Velocity, acceleration and jerk are measured by their exact peaks. The least factor for the effort at instants is
    enlarged until no instant can exceed a limit; where that fails, as with a static load right at its limit, the
    factor at the instants is returned and :attr:`Slowdown.proven` is False.

    If the motion has a problem, as solutions and optima do, all its constraints count. The speed of the tool, mean
    velocities and the longest time have a closed form. Others, such as one of your own, are evaluated on the scaled
    motion, at ``samples`` instants per segment, and where they are broken a greater factor that keeps them is searched;
    :attr:`Slowdown.not_kept` names those that no factor tried keeps.

    Args:
        motion: a solution of a front, an optimum, or the first trajectory of a rollout.
        payload: a payload, or a mass [kg] with shape and model of the motion's own payload.
        samples: instants per segment at the start, both ends included.

    Raises:
        InvalidInputError: a payload that the robot cannot hold at rest somewhere on the path (the message says how much
            it can hold) or that it cannot carry at any speed, or a robot without any limit.
    """
    rollout = rollout_of(motion)
    carried = payload if isinstance(payload, Payload) else rollout.dynamics.payload.with_mass(Payload(payload).mass)
    found = slowdown_of(ScaledPath(motion, samples, carried), carried, motion)
    if not rollout.keeps_margins:
        return found
    return replace(found, at_full_limits=slowdown_of(ScaledPath(motion, samples, carried, full=True), carried, motion))


def slowdown_of(path: ScaledPath, payload: Payload, motion: Solution | Rollout | WeightedOptimum) -> Slowdown:
    """The slowdown of a motion with a payload of a path's shape; raises as :func:`slowdown_for`."""
    found = least_factor([path], [payload]) if path.held(payload.mass) else None
    if found is None:
        raise InvalidInputError(f"payload: {why_not(path, payload)}")
    return _slowdown(path, payload, found, problem_of(motion))


def why_not(path: ScaledPath, payload: Payload) -> str:
    """Text that says why a payload cannot be carried at any speed."""
    if not path.held(payload.mass):
        return f"{path.not_held(payload.mass)}: no slower motion can carry it"
    return (
        f"expected one that some speed along this path suits, got {payload.mass:g} kg: the robot holds it at rest, but "
        "moving it breaks an effort limit however slowly"
    )


def _slowdown(path: ScaledPath, payload: Payload, found: LeastFactor, problem: TrajectoryProblem | None) -> Slowdown:
    """The record of a least factor.

    Raises:
        InvalidInputError: nothing bounds the motion.
    """
    bound = found.bounds[0]
    if bound is None:
        raise InvalidInputError(
            f"motion: expected one that a limit of velocity, acceleration, jerk or effort bounds, but "
            f"{path.rollout.robot.name!r} has none that this motion would reach"
        )
    return Slowdown(
        payload=payload,
        factor=found.factor,
        sampled_factor=found.sampled,
        proven=found.proven,
        duration=float(path.rollout.trajectory.duration[0]) * found.factor,
        limit=bound.limit,
        joint=bound.joint,
        time=bound.time * found.factor,
        utilisation=frozen(path.utilisation(payload.mass, 1.0 / found.factor)),
        allowed=frozen(found.allowed),
        not_kept=found.not_kept,
        evaluated=path.constraints.evaluated,
        instants=len(path.t),
        motion=path.carrying(payload),
        problem=problem,
    )


@final
@dataclass(frozen=True, eq=False)
class SlowdownCurve:
    """The least time of a motion along a fixed path for each payload, with effort at instants, not proven between them.

    Attributes:
        payloads: masses, ascending, shape (N,) [kg].
        factors: least duration over that of the original motion [1], NaN where the payload cannot be carried, shape
            (N,).
        durations: least duration, NaN where the payload cannot be carried, shape (N,) [s].
        limits: N binding limits, as :attr:`Slowdown.limit`, empty where the payload cannot be carried.
        joints: names of the N binding joints, empty where none binds.
        not_kept: N texts, each the names of constraints that are broken with that payload, see
            :attr:`Slowdown.not_kept`.
        static_bound: the greatest payload that can be held at rest everywhere on the path [kg]; may be inf.
        present_duration: duration of the original motion [s].
        payload_model: how the payload acts.
        instants: number of instants at which effort was computed.
        effort_margin: share of the effort limits that the motion's problem keeps free.
        at_full_limits: the same against the robot's full limits; None if the problem has no margins.
    """

    payloads: Array
    factors: Array
    durations: Array
    limits: tuple[str, ...]
    joints: tuple[str, ...]
    not_kept: tuple[str, ...]
    static_bound: float
    present_duration: float
    payload_model: str
    instants: int
    effort_margin: float
    at_full_limits: SlowdownCurve | None = None

    __repr__ = brief

    def _repr_html_(self) -> str:
        headers = ("payload [kg]", "least duration [s]", "limited by")
        return curve_html("Least duration along the same path", headers, (self.payloads, self.durations), self.limits)


def slowdown_curve(
    motion: Solution | Rollout | WeightedOptimum, payloads: Sequence[float] | None = None, *, samples: int = SAMPLES
) -> SlowdownCurve:
    """:attr:`Slowdown.sampled_factor` for many masses: effort keeps its limits at instants, which is not proven.

    Args:
        motion: as for :func:`slowdown_for`; its payload gives shape and model.
        payloads: masses [kg]; if None, 40 from 0 to 99 % of the greatest mass that the robot can hold at rest, denser
            where the time rises.
        samples: as for :func:`slowdown_for`.

    Raises:
        InvalidInputError: no or negative masses, or None although nothing bounds the mass that the robot can hold.
    """
    path = ScaledPath(motion, samples)
    if payloads is None:
        if not 0.0 < path.static_bound < np.inf:
            raise InvalidInputError(
                f"payloads: expected masses [kg], as the robot can hold {max(path.static_bound, 0.0):g} kg at rest"
            )
        payloads = (path.static_bound * (1.0 - np.linspace(1.0, 0.1, 40) ** 2)).tolist()
    masses = np.sort(numbers(payloads, name="payloads", shape=("N",)))
    if not len(masses) or masses[0] < 0.0:
        raise InvalidInputError(f"payloads: expected at least one mass from 0 on [kg], got {masses.tolist()}")
    curve = _curve(path, masses)
    if not path.rollout.keeps_margins:
        return curve
    return replace(curve, at_full_limits=_curve(ScaledPath(motion, samples, full=True), masses))


def _curve(path: ScaledPath, masses: Array) -> SlowdownCurve:
    own, now = path.rollout.dynamics.payload, float(path.rollout.trajectory.duration[0])
    found = []
    for mass in masses.tolist():
        carried = own.with_mass(mass)
        least = least_factor([path], [carried], prove=False) if path.held(mass) else None
        found.append(None if least is None else _slowdown(path, carried, least, None))
    factors = np.array([np.nan if one is None else one.factor for one in found])
    return SlowdownCurve(
        payloads=frozen(masses),
        factors=frozen(factors),
        durations=frozen(now * factors),
        limits=tuple("" if one is None else one.limit for one in found),
        joints=tuple("" if one is None else one.joint for one in found),
        not_kept=tuple("" if one is None else ", ".join(one.not_kept) for one in found),
        static_bound=path.static_bound,
        present_duration=now,
        payload_model=own.model,
        instants=len(path.t),
        effort_margin=path.rollout.effort_margin,
    )
