"""Dynamic load-carrying capacity (DLCC): the largest payload of a motion, its binding joint and instant.

Effort is affine in the payload's mass, τ = τ₀ + m τ₁. :func:`dlcc` and :func:`capacities` enclose the largest mass that
keeps every effort limit at every instant (:mod:`trajevo.dynamics.mass_enclosure`); :func:`dlcc_sampled` has it in
closed form at sampled instants. :func:`dlcc_iterative` is the iteration of Guo 2016, section 5, at sampled instants
too; it agrees with the closed form within its step. Limits are those that the motion's problem keeps.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from trajevo.base.arrays import Array, frozen, numbers
from trajevo.capacity.capacity import GUARANTEED, ITERATED, SAMPLED, Capacities, Capacity, EffortAlong
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.mass_enclosure import enclose_masses
from trajevo.dynamics.payload_masses import mass_bounds
from trajevo.dynamics.rollout import Rollout, rollout_of
from trajevo.errors import InvalidInputError
from trajevo.front.front import Front, Solution
from trajevo.robot.joints import Sides
from trajevo.solvers.gradient.weighted_sum import WeightedOptimum

#: Default number of instants per segment at which efforts are sampled; optimisation uses fewer.
SAMPLES = 50

#: Default gap between a guaranteed mass and the upper bound, as a share of it, and the least and greatest one.
TOLERANCE, TOLERANCES = 1e-4, (1e-7, 0.1)

#: Greatest number of steps of the iteration.
MOST_STEPS = 1_000_000


def effort_along(motion: Solution | Rollout | WeightedOptimum, *, samples: int = SAMPLES) -> EffortAlong:
    """Effort along a motion, which is affine in the payload's mass.

    Args:
        motion: as for :func:`dlcc`.
        samples: as for :func:`dlcc`.
    """
    rollout = rollout_of(motion)
    efforts, capacity = _guaranteed(motion, TOLERANCE, samples)
    return EffortAlong(
        times=efforts.times,
        unloaded=efforts.unloaded,
        per_kilogram=efforts.per_kilogram,
        limit=efforts.limit.forward,
        limit_backward=None if efforts.limit.agree else efforts.limit.backward,
        mass=rollout.dynamics.payload.mass if rollout.masses is None else float(rollout.masses[0]),
        capacity=_and_at_full_limit(capacity, rollout, dlcc),
        joint_names=rollout.robot.joint_names,
        robot=rollout.robot.name,
    )


def dlcc(
    motion: Solution | Rollout | WeightedOptimum, *, tolerance: float = TOLERANCE, samples: int = SAMPLES
) -> Capacity:
    """The largest payload with which a motion is proven to keep every effort limit at every instant.

    If the motion breaks a limit without payload, a payload may help as a counterweight: the feasible masses are an
    interval, from ``least`` to ``mass``.

    Args:
        motion: a solution of a front, an optimum, or the first trajectory of a rollout. Shape and model of the payload
            are those of the motion's rollout; its mass is not used.
        tolerance: greatest gap between ``mass`` and ``upper``, and between ``lower`` and ``least``, as a share of the
            mass, 1e-7 to 0.1. Where rounding ends the search earlier, the gap is wider.
        samples: instants per segment for values over time, both ends included.

    Raises:
        InvalidInputError: a tolerance out of its range.
    """
    capacity = _guaranteed(motion, tolerance, samples)[1]
    return _and_at_full_limit(capacity, rollout_of(motion), partial(dlcc, tolerance=tolerance, samples=samples))


def dlcc_sampled(motion: Solution | Rollout | WeightedOptimum, *, samples: int = SAMPLES) -> Capacity:
    """The largest payload at sampled instants in closed form: the least value of (±limit - τ₀)/τ₁ over joints and them.

    Between the samples a limit may be broken at this mass; :func:`dlcc` guarantees that none is.

    Args:
        motion: as for :func:`dlcc`.
        samples: instants per segment, both ends included.
    """
    capacity = _closed_form(_Efforts.of(sampled_motion(motion, samples)), samples)
    return _and_at_full_limit(capacity, rollout_of(motion), partial(dlcc_sampled, samples=samples))


def dlcc_iterative(
    motion: Solution | Rollout | WeightedOptimum, *, start: float = 0.0, step: float = 0.05, samples: int = SAMPLES
) -> Capacity:
    """The largest payload by the iteration of Guo 2016, section 5, steps 7 to 9: add mass until a limit is broken.

    As in the paper, limits are looked at in sampled instants, not between them.

    Args:
        motion: as for :func:`dlcc`.
        start: first payload tried [kg].
        step: mass added in each step [kg].
        samples: as for :func:`dlcc_sampled`.

    Returns:
        The last feasible payload, or 0 if the first one is infeasible, for example because a counterweight is needed
        and ``start`` is lighter. ``history`` has every payload tried. If no payload ever reaches a limit, the result is
        that of :func:`dlcc_sampled`.

    Raises:
        InvalidInputError: a negative start, a step that is not positive, or one so small that it takes too many steps.
    """
    start, step = float(numbers(start, name="start", shape=())), float(numbers(step, name="step", shape=()))
    if start < 0.0:
        raise InvalidInputError(f"start: expected a mass from 0 on [kg], got {start}")
    if not step > 0.0:
        raise InvalidInputError(f"step: expected a positive mass [kg], got {step}")
    efforts = _Efforts.of(sampled_motion(motion, samples))
    again = partial(dlcc_iterative, start=start, step=step, samples=samples)
    closed = _closed_form(efforts, samples)
    if np.isinf(closed.mass):
        return _and_at_full_limit(closed, rollout_of(motion), again)
    if (closed.mass - start) / step > MOST_STEPS:
        raise InvalidInputError(f"step: {step} kg takes over {MOST_STEPS} steps to {closed.mass:.6g} kg")
    history: list[tuple[float, float, str]] = []
    while not history or history[-1][1] <= 1.0:
        mass = start + len(history) * step
        joint, time, used = efforts.most_used(mass)
        history.append((mass, used, efforts.dynamics.robot.joint_names[joint]))
    feasible = history[-2][0] if len(history) > 1 else 0.0
    binding = _bound(efforts, feasible, closed.least, joint, time)
    found = replace(closed, **binding, method=ITERATED, history=tuple(history))
    return _and_at_full_limit(found, rollout_of(motion), again)


def capacities(motions: Front | Rollout, *, tolerance: float = TOLERANCE, samples: int = 12) -> Capacities:
    """:func:`dlcc` of every solution of a front, or of every trajectory of a rollout, in one batch.

    Args:
        motions: a front or a rollout.
        tolerance: as for :func:`dlcc`.
        samples: instants per segment from which the search starts, both ends included.

    Raises:
        InvalidInputError: motions of another type, or a tolerance out of its range.
    """
    given = motions.rollouts if isinstance(motions, Front) else rollout_of(motions)
    if given.dynamics.schedule is not None:
        given.dynamics.schedule.check_varied("a capacity")
    fine = replace(given, dynamics=given.dynamics.sampled(samples))
    found = enclose_masses(fine, given.limits.sides("effort"), tolerance=_share(tolerance))
    joint = np.where(found.proven & np.isfinite(found.most), found.joint, -1)
    joint.setflags(write=False)
    one = Capacities(
        mass=frozen(np.where(found.proven, found.most, 0.0)),
        least=frozen(np.where(found.proven, found.least, np.nan)),
        upper=frozen(np.where(found.lower <= found.upper, found.upper, 0.0)),
        duration=frozen(given.trajectory.duration),
        joint=joint,
        joint_names=given.robot.joint_names,
        payload_model=given.dynamics.payload.model,
    )
    kept = given.effort_kept
    if kept == 1.0:
        return one
    full = capacities(replace(given, kept_limits=None), tolerance=tolerance, samples=samples)
    return replace(one, kept=kept, at_full_limit=full.mass)


@dataclass(frozen=True, eq=False)
class _Efforts:
    """Effort without payload and per kilogram, (T, n_joints), instants (T,) [s], effort limits, the dynamics behind."""

    unloaded: Array
    per_kilogram: Array
    times: Array
    limit: Sides
    dynamics: Dynamics

    @classmethod
    def of(cls, fine: Rollout, instants: Array | None = None) -> _Efforts:
        """At the samples of one motion and at further instants (K,) [s], of which NaN and known ones are left out."""
        times, unloaded, per_kilogram = fine.t[0], fine.unloaded_effort[0], fine.effort_per_kilogram[0]
        further = set() if instants is None else set(instants[np.isfinite(instants)].tolist())
        more = np.array(sorted(further.difference(times.tolist())))
        if len(more):
            q, v, a = (fine.trajectory.evaluate(more[None], order) for order in range(3))
            v, segments = fine.without_rounding(v), fine.segments_at(more)[0]
            place = np.searchsorted(times, more)
            times = frozen(np.insert(times, place, more))
            unloaded = frozen(
                np.insert(unloaded, place, fine.dynamics.unloaded_effort(q, v, a, segments, axis=1)[0], axis=0)
            )
            each = fine.dynamics.effort_per_kilogram(q, v, a, segments, axis=1)[0]
            per_kilogram = frozen(np.insert(per_kilogram, place, each, axis=0))
        return cls(unloaded, per_kilogram, times, fine.limits.sides("effort"), fine.dynamics)

    def used(self, mass: float) -> Array:
        """Effort over limit with a payload [kg], shape (T, n_joints)."""
        return self.limit.share(self.unloaded + mass * self.per_kilogram)

    def most_used(self, mass: float) -> tuple[int, float, float]:
        """The joint (index) that uses most of its limit with a payload [kg], the instant [s], and the share used."""
        used = self.used(mass)
        instant, joint = (int(i) for i in np.unravel_index(used.argmax(), used.shape))
        return joint, float(self.times[instant]), float(used[instant, joint])


def sampled_motion(motion: Solution | Rollout | WeightedOptimum, samples: int) -> Rollout:
    """The robot on one motion, with its payload and limits unchanged.

    Args:
        motion: a solution of a front, an optimum, or the first trajectory of a rollout.
        samples: instants per segment, both ends included.

    Raises:
        InvalidInputError: a motion of another type, or fewer than 2 samples.
    """
    rollout = rollout_of(motion)
    if rollout.dynamics.schedule is not None:
        rollout.dynamics.schedule.check_varied("a capacity")
    trajectory = rollout.trajectory if len(rollout.trajectory) == 1 else rollout.trajectory[0]
    return Rollout(rollout.dynamics.sampled(samples), trajectory, kept_limits=rollout.kept_limits)


def _share(tolerance: Any) -> float:
    share = float(numbers(tolerance, name="tolerance", shape=()))
    if not TOLERANCES[0] <= share <= TOLERANCES[1]:
        raise InvalidInputError(f"tolerance: expected a share from {TOLERANCES[0]:g} to {TOLERANCES[1]:g}, got {share}")
    return share


def _and_at_full_limit(found: Capacity, rollout: Rollout, again: Callable[[Rollout], Capacity]) -> Capacity:
    """The capacity with that at the robot's full limits, where the problem keeps less of them."""
    kept = rollout.effort_kept
    if kept == 1.0:
        return found
    return replace(found, kept=kept, at_full_limit=again(replace(rollout, kept_limits=None)).mass)


def _guaranteed(motion: Any, tolerance: float, samples: int) -> tuple[_Efforts, Capacity]:
    """Efforts of a motion at samples and binding instants, and its guaranteed capacity."""
    fine = sampled_motion(motion, samples)
    found = enclose_masses(fine, fine.limits.sides("effort"), tolerance=_share(tolerance))
    efforts = _Efforts.of(fine, found.instants[0])
    proven = bool(found.proven[0])
    most, least = (float(found.most[0]), float(found.least[0])) if proven else (0.0, np.nan)
    ends = float(found.lower[0]), float(found.upper[0])
    binding = int(found.joint[0]), float(found.instants[0, 1])
    if ends[0] > ends[1]:
        binding = efforts.most_used(0.0)[:2]
    return efforts, _capacity(efforts, GUARANTEED, samples, (least, most), ends, binding)


def _closed_form(efforts: _Efforts, samples: int) -> Capacity:
    lower, upper = mass_bounds(efforts.unloaded, efforts.per_kilogram, efforts.limit)
    least, joint = float(lower.max()), int(upper.min(axis=0).argmin())
    most = float(upper[:, joint].min())
    if least > most:
        return _capacity(efforts, SAMPLED, samples, (np.nan, 0.0), (least, most), efforts.most_used(0.0)[:2])
    binding = joint, float(efforts.times[upper[:, joint].argmin()])
    return _capacity(efforts, SAMPLED, samples, (least, most), (least, most), binding)


def _capacity(
    efforts: _Efforts,
    method: str,
    samples: int,
    masses: tuple[float, float],
    ends: tuple[float, float],
    binding: tuple[int, float],
) -> Capacity:
    """A capacity from its least and greatest masses, the bounds of these, and the binding joint and instant."""
    lower, upper = mass_bounds(efforts.unloaded, efforts.per_kilogram, efforts.limit)
    most, needed = upper.min(axis=0), lower.max(axis=0)
    least, mass = masses
    empty = ends[0] > ends[1]
    return Capacity(
        **_bound(efforts, mass, least, *binding),
        per_joint=frozen(np.where(needed <= most, most, 0.0)),
        payload_model=efforts.dynamics.payload.model,
        least=least,
        lower=np.nan if empty else ends[0],
        upper=0.0 if empty else ends[1],
        times=efforts.times,
        joint_names=efforts.dynamics.robot.joint_names,
        method=method,
        samples=samples,
    )


def _bound(efforts: _Efforts, mass: float, least: float, joint: int, time: float) -> dict[str, Any]:
    """Fields of a capacity that depend on its mass; without binding joint and instant if that is infinite."""
    finite = bool(np.isfinite(mass))
    margins = frozen(1.0 - efforts.used(mass if finite else least))
    return {
        "mass": mass,
        "joint": efforts.dynamics.robot.joint_names[joint] if finite else "",
        "time": time if finite else float("nan"),
        "margin": frozen(margins.min(axis=0)),
        "margins": margins,
    }
