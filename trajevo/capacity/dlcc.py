"""Dynamic load-carrying capacity (DLCC): the largest payload of a motion, its binding joint and instant.

Effort is affine in the payload's mass, τ = τ₀ + m τ₁, so the capacity has a closed form. The iteration of Guo 2016,
section 5, is implemented too; it agrees with the closed form within its step.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, frozen, numbers
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.payload_masses import mass_bounds
from trajevo.dynamics.rollout import Rollout, rollout_of
from trajevo.errors import InvalidInputError
from trajevo.front.front import Front, Solution
from trajevo.solvers.gradient.weighted_sum import WeightedOptimum

#: Default number of instants per segment at which a capacity is computed; optimisation uses fewer.
SAMPLES = 50

#: Greatest number of steps of the iteration.
MOST_STEPS = 1_000_000

#: Excess over a limit, as a share of it, that counts as rounding.
_ROUNDING = 1e-12


@final
@dataclass(frozen=True, eq=False)
class Capacity:
    """The largest payload of a motion.

    Attributes:
        mass: the largest payload [kg]; inf if no effort limit is ever reached, 0 if one is reached without any payload
            or no payload is feasible.
        joint: name of the binding joint, empty if there is none.
        time: instant at which it binds [s], NaN if there is none.
        margin: unused share of each joint's effort limit at ``mass``, shape (n_joints,); negative for joints over their
            limit if no payload is feasible.
        per_joint: largest payload that each joint alone allows, shape (n_joints,) [kg].
        payload_model: how the payload acts, a key of :data:`trajevo.robot.payload.LOAD_MODELS`.
        least: the least payload [kg]; above 0 if the motion keeps the limits only with a payload as counterweight, NaN
            if no payload, not even 0, is feasible.
        times: instants at which effort was computed, shape (T,) [s].
        margins: unused share of each joint's effort limit over time, shape (T, n_joints), at ``mass`` or, if nothing
            limits the mass, at ``least``.
        joint_names: names of the robot's joints.
        history: for the iteration, every (mass [kg], greatest effort over limit, joint) tried; the last is infeasible.
    """

    mass: float
    joint: str
    time: float
    margin: Array
    per_joint: Array
    payload_model: str
    least: float
    times: Array
    margins: Array
    joint_names: tuple[str, ...]
    history: tuple[tuple[float, float, str], ...] = ()

    @property
    def feasible(self) -> bool:
        """Whether the motion keeps every effort limit at ``mass``."""
        return bool(self.margin.min() >= -_ROUNDING)

    def __str__(self) -> str:
        model, counterweight = self.payload_model, self.least > 0.0
        if not self.joint:
            return f"unlimited: no joint has an effort limit that a {model} payload reaches on this motion" + (
                f"; at least {self.least:.6f} kg, without which one is broken" if counterweight else ""
            )
        if len(self.history) == 1 and (self.history[0][0] > 0.0 or counterweight):
            tried = self.history[0][0]
            advice = f"start at {self.least:.6g} kg" if tried < self.least else "start lower"
            return f"the first payload tried, {tried:g} kg, already breaks the limit of {self.joint}; {advice}"
        if not self.feasible:
            return (
                f"0 kg: even without payload {self.joint} exceeds its effort limit by "
                f"{-100.0 * self.margin.min():.3g} %, at {self.time:.4f} s"
            )
        carried = f"{self.least:.6f} to {self.mass:.6f} kg" if counterweight else f"{self.mass:.6f} kg"
        return f"{carried} ({model} payload), limited by {self.joint} at {self.time:.4f} s"


@final
@dataclass(frozen=True, eq=False)
class EffortAlong:
    """Effort along one motion as an affine function of the payload's mass, and the motion's capacity.

    Attributes:
        times: instants, shape (T,) [s].
        unloaded: effort without payload, shape (T, n_joints) [N·m or N].
        per_kilogram: effort that every kilogram of the payload adds, shape (T, n_joints) [N·m/kg or N/kg].
        limit: effort limits, shape (n_joints,) [N·m or N]; inf for none.
        mass: mass of the payload that is carried [kg].
        capacity: the largest payload.
        joint_names: names of the robot's joints.
        robot: name of the robot.
    """

    times: Array
    unloaded: Array
    per_kilogram: Array
    limit: Array
    mass: float
    capacity: Capacity
    joint_names: tuple[str, ...]
    robot: str


def effort_along(motion: Solution | Rollout | WeightedOptimum, *, samples: int = SAMPLES) -> EffortAlong:
    """Effort along a motion, which is affine in the payload's mass.

    Args:
        motion: as for :func:`dlcc`.
        samples: as for :func:`dlcc`.
    """
    rollout = rollout_of(motion)
    efforts = _efforts(motion, samples)
    return EffortAlong(
        times=efforts.times,
        unloaded=efforts.unloaded,
        per_kilogram=efforts.per_kilogram,
        limit=rollout.robot.limits.effort,
        mass=rollout.dynamics.payload.mass if rollout.masses is None else float(rollout.masses[0]),
        capacity=_closed_form(efforts),
        joint_names=rollout.robot.joint_names,
        robot=rollout.robot.name,
    )


def dlcc(motion: Solution | Rollout | WeightedOptimum, *, samples: int = SAMPLES) -> Capacity:
    """The largest payload of a motion in closed form: the least value of (±limit - τ₀)/τ₁ over joints and instants.

    If the motion breaks a limit without payload, a payload may help as a counterweight: the feasible masses are an
    interval, from ``least`` to ``mass``.

    Args:
        motion: a solution of a front, an optimum, or the first trajectory of a rollout. Shape and model of the payload
            are those of the motion's rollout; its mass is not used.
        samples: instants per segment, both ends included.
    """
    return _closed_form(_efforts(motion, samples))


def dlcc_iterative(
    motion: Solution | Rollout | WeightedOptimum, *, start: float = 0.0, step: float = 0.05, samples: int = SAMPLES
) -> Capacity:
    """The largest payload by the iteration of Guo 2016, section 5, steps 7 to 9: add mass until a limit is broken.

    Args:
        motion: as for :func:`dlcc`.
        start: first payload tried [kg].
        step: mass added in each step [kg].
        samples: as for :func:`dlcc`.

    Returns:
        The last feasible payload, or 0 if the first one is infeasible, for example because a counterweight is needed
        and ``start`` is lighter. ``history`` has every payload tried. If no payload ever reaches a limit, the result is
        that of :func:`dlcc`.

    Raises:
        InvalidInputError: a negative start, a step that is not positive, or one so small that it takes too many steps.
    """
    start, step = float(numbers(start, name="start", shape=())), float(numbers(step, name="step", shape=()))
    if start < 0.0:
        raise InvalidInputError(f"start: expected a mass from 0 on [kg], got {start}")
    if not step > 0.0:
        raise InvalidInputError(f"step: expected a positive mass [kg], got {step}")
    efforts = _efforts(motion, samples)
    closed = _closed_form(efforts)
    if np.isinf(closed.mass):
        return closed
    if (closed.mass - start) / step > MOST_STEPS:
        raise InvalidInputError(f"step: {step} kg takes over {MOST_STEPS} steps to {closed.mass:.6g} kg")
    history: list[tuple[float, float, str]] = []
    while not history or history[-1][1] <= 1.0:
        mass = start + len(history) * step
        used = efforts.used(mass)
        instant, joint = (int(i) for i in np.unravel_index(used.argmax(), used.shape))
        history.append((mass, float(used.max()), efforts.dynamics.robot.joint_names[joint]))
    feasible = history[-2][0] if len(history) > 1 else 0.0
    found = _bound(efforts, feasible, joint, instant, closed.per_joint, closed.least)
    return replace(found, history=tuple(history))


@final
@dataclass(frozen=True, eq=False)
class Capacities:
    """The largest payloads of B motions.

    Attributes:
        mass: as :attr:`Capacity.mass`, shape (B,) [kg].
        least: as :attr:`Capacity.least`, shape (B,) [kg].
        duration: durations of the motions, shape (B,) [s].
        joint: index of the binding joint, -1 if there is none, shape (B,).
        joint_names: names of the robot's joints.
        payload_model: how the payload acts.
    """

    mass: Array
    least: Array
    duration: Array
    joint: Array
    joint_names: tuple[str, ...]
    payload_model: str


def capacities(motions: Front | Rollout, *, samples: int = 12) -> Capacities:
    """:func:`dlcc` of every solution of a front, or of every trajectory of a rollout, in one batch.

    Args:
        motions: a front or a rollout.
        samples: instants per segment, both ends included.

    Raises:
        InvalidInputError: motions of another type.
    """
    given = motions.rollouts if isinstance(motions, Front) else rollout_of(motions)
    fine = Rollout(given.dynamics.sampled(samples), given.trajectory)
    lower, upper = mass_bounds(fine.unloaded_effort, fine.effort_per_kilogram, given.robot.limits.effort)
    least, each = lower.max(axis=(1, 2), initial=0.0), upper.min(axis=1)
    most = each.min(axis=1)
    never = least > most
    joint = np.where(never | np.isinf(most), -1, each.argmin(axis=1))
    joint.setflags(write=False)
    return Capacities(
        mass=frozen(np.where(never, 0.0, most)),
        least=frozen(np.where(never, np.nan, least)),
        duration=frozen(given.trajectory.duration),
        joint=joint,
        joint_names=given.robot.joint_names,
        payload_model=given.dynamics.payload.model,
    )


@dataclass(frozen=True, eq=False)
class _Efforts:
    """Effort without payload and per kilogram, (T, n_joints), instants (T,) [s], and the dynamics behind them."""

    unloaded: Array
    per_kilogram: Array
    times: Array
    dynamics: Dynamics

    def used(self, mass: float) -> Array:
        """Effort over limit with a payload [kg], shape (T, n_joints)."""
        share: Array = np.abs(self.unloaded + mass * self.per_kilogram) / self.dynamics.robot.limits.effort
        return share


def sampled_motion(motion: Solution | Rollout | WeightedOptimum, samples: int) -> Rollout:
    """The robot on one motion, with its payload unchanged.

    Args:
        motion: a solution of a front, an optimum, or the first trajectory of a rollout.
        samples: instants per segment, both ends included.

    Raises:
        InvalidInputError: a motion of another type, or fewer than 2 samples.
    """
    rollout = rollout_of(motion)
    trajectory = rollout.trajectory if len(rollout.trajectory) == 1 else rollout.trajectory[0]
    return Rollout(rollout.dynamics.sampled(samples), trajectory, kept_limits=rollout.kept_limits)


def _efforts(motion: Any, samples: int) -> _Efforts:
    fine = sampled_motion(motion, samples)
    return _Efforts(fine.unloaded_effort[0], fine.effort_per_kilogram[0], fine.t[0], fine.dynamics)


def _closed_form(efforts: _Efforts) -> Capacity:
    lower, upper = mass_bounds(efforts.unloaded, efforts.per_kilogram, efforts.dynamics.robot.limits.effort)
    most, needed = upper.min(axis=0), lower.max(axis=0)
    per_joint = np.where(needed <= most, most, 0.0)
    joint, least = int(most.argmin()), float(needed.max())
    if least > most[joint]:
        used = efforts.used(0.0)
        instant, joint = (int(i) for i in np.unravel_index(used.argmax(), used.shape))
        return _bound(efforts, 0.0, joint, instant, per_joint, float("nan"))
    return _bound(efforts, float(most[joint]), joint, int(upper[:, joint].argmin()), per_joint, least)


def _bound(efforts: _Efforts, mass: float, joint: int, instant: int, per_joint: Array, least: float) -> Capacity:
    """The capacity with a binding joint and instant; without them if the mass is infinite."""
    finite = bool(np.isfinite(mass))
    margins = frozen(1.0 - efforts.used(mass if finite else least))
    return Capacity(
        mass=mass,
        joint=efforts.dynamics.robot.joint_names[joint] if finite else "",
        time=float(efforts.times[instant]) if finite else float("nan"),
        margin=frozen(margins.min(axis=0)),
        per_joint=frozen(per_joint),
        payload_model=efforts.dynamics.payload.model,
        least=least,
        times=efforts.times,
        margins=margins,
        joint_names=efforts.dynamics.robot.joint_names,
    )
