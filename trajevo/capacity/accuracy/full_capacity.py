"""The largest payload under all limits at once, and how far the tool gives way with a payload.

Drives, deviation, slip and tip-over are looked at in evenly spaced instants and, ever finer, around those that bind.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from trajevo.base.arrays import frozen, numbers, real_number
from trajevo.capacity.accuracy.causes import Cause, bending_of, causes_of
from trajevo.capacity.accuracy.found import CAUSES, CauseLimit, FullCapacity, ToolDeviation
from trajevo.capacity.dlcc import sampled_motion
from trajevo.capacity.drives.drive_capacity import DENSE, Cycling, rollout_mass
from trajevo.capacity.drives.found import DriveLimit
from trajevo.capacity.drives.instants import MassesOfJoints, Sought, causes_at_instants, masses_at_instants
from trajevo.capacity.drives.supply_power import masses_of_supply
from trajevo.capacity.scaled_constraints import problem_of
from trajevo.dynamics.contacts.bending import COUNTED, Bending, known_stiffness
from trajevo.dynamics.drives.duty import checked_cycles, checked_dwell
from trajevo.dynamics.drives.motors import Motors, MotorStates
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError, checked_name
from trajevo.front.front import Solution
from trajevo.robot.robot import Robot
from trajevo.solvers.gradient.weighted_sum import WeightedOptimum

#: Greatest deviation that is believed without a unit [m].
_FARTHEST = 1.0

#: Rounds in which the greatest deviation is looked at again, and instants of each.
_ZOOMS, _PARTS = 5, 17


def full_capacity(
    motion: Solution | Rollout | WeightedOptimum,
    *,
    deviation: float | None = None,
    counted: str = "all",
    dwell: float = 0.0,
    cycles: int | None = None,
    samples: int = DENSE,
) -> FullCapacity:
    """The largest payload under every limit that is known, and what binds: a drive, accuracy, the grip, or the stand.

    Args:
        motion: a solution of a front, an optimum, or the first trajectory of a rollout. Shape and model of the payload
            are those of the motion's rollout; its mass is not used. Drives with their stiffness, grip and stand are
            those of its robot.
        deviation: greatest deviation of the tool's origin because joints give way [m]; if None that of the motion's
            problem, and any if it has none.
        counted: ``"all"`` for the deviation by all loads, ``"payload"`` for that by the payload alone, as of a robot
            that was calibrated without one.
        dwell: time at rest after the motion until it begins anew [s], as for :func:`drive_capacity`.
        cycles: how often the motion is made from cold windings on; for ever if None.
        samples: evenly spaced instants per segment at which limits are looked at, both ends included; those that bind
            are searched between them too.

    Raises:
        InvalidInputError: a deviation that is not positive, or of a robot without stiffness, or as for
            :func:`drive_capacity`.
        UnknownNameError: another word for ``counted``.
    """
    rollout = sampled_motion(motion, samples)
    most, counted = deviation_of(motion, deviation, counted)
    robot, causes = rollout.robot, causes_of(rollout, most, counted)
    limits: list[CauseLimit] = []
    if robot.drives:
        cycling = Cycling.of(motion, dwell, cycles, samples)
        found = cycling.limits(binding=True, further=_sought(cycling.sampled, causes))
        limits += [_by_joints(limit, robot.joint_names) for limit in found.drives if limit.known.any()]
        not_covered = [CAUSES[limit.cause] for limit in found.drives if not limit.known.any()]
        not_covered += cycling.not_known
        rest, often, masses = cycling.cycle.dwell, cycling.cycle.cycles, found.further
    else:
        rest, often, not_covered = checked_dwell(dwell), checked_cycles(cycles), ["drives"]
        causes = (*_effort(rollout), *causes)
        masses = tuple(masses_at_instants(rollout, _sought(MotorStates.of_samples(rollout), causes)))
    power = supply_power_of(motion, robot)
    if power is None:
        not_covered += [CAUSES["peak_power"]] if robot.drives else []
    else:
        limits += [_limit("peak_power", masses_of_supply(rollout, power), ("all motors",))]
    limits += _of_causes(rollout, causes, masses, counted)
    not_covered += _not_known(robot, most)
    return _together(
        limits,
        deviation=most,
        robot=robot.name,
        payload_model=rollout.dynamics.payload.model,
        dwell=rest,
        cycles=often,
        samples=samples,
        not_covered=tuple(not_covered),
    )


def tool_deviation(
    motion: Solution | Rollout | WeightedOptimum,
    *,
    mass: float | None = None,
    counted: str = "all",
    samples: int = DENSE,
) -> ToolDeviation:
    """How far the tool gives way on a motion because its joints do, and by which joints.

    Args:
        motion: as for :func:`full_capacity`; at least one drive of its robot has a stiffness.
        mass: of the payload [kg]; that which the motion carries if None.
        counted: as for :func:`full_capacity`.
        samples: as for :func:`full_capacity`.

    Raises:
        InvalidInputError: a mass below 0, or a robot without stiffness.
        UnknownNameError: another word for ``counted``.
    """
    checked_name("counted", counted, COUNTED)
    rollout = sampled_motion(motion, samples)
    carried = rollout_mass(rollout) if mass is None else float(numbers(mass, name="mass", shape=()))
    if carried < 0.0:
        raise InvalidInputError(f"mass: expected a payload from 0 on [kg], got {carried}")
    bending, states = bending_of(rollout), MotorStates.of_samples(rollout)
    moved = _moved(bending, states, carried, counted)
    along = np.sqrt((moved.sum(axis=2) ** 2).sum(axis=1))
    place = int(along.argmax())
    greatest, time, there = float(along[place]), float(states.times[place]), moved[place]
    width = float(np.diff(states.times).max())
    for _ in range(_ZOOMS):
        instants = np.clip(time + width * np.linspace(-1.0, 1.0, _PARTS), 0.0, rollout.trajectory.duration[0])
        near = _moved(bending, MotorStates.at(rollout, instants), carried, counted)
        far = np.sqrt((near.sum(axis=2) ** 2).sum(axis=1))
        place, width = int(far.argmax()), 4.0 * width / _PARTS
        if far[place] > greatest:
            greatest, time, there = float(far[place]), float(instants[place]), near[place]
    total = there.sum(axis=1)
    return ToolDeviation(
        mass=carried,
        greatest=greatest,
        time=time,
        deviation=frozen(total),
        by_joint=frozen(total @ there / greatest if greatest > 0.0 else np.zeros(there.shape[1])),
        axes=frozen(np.abs(moved.sum(axis=2)).max(axis=0)),
        times=states.times,
        along=frozen(along),
        counted=counted,
        joint_names=rollout.robot.joint_names,
        rigid=tuple(name for name in rollout.robot.joint_names if name not in known_stiffness(rollout.robot)),
    )


def _moved(bending: Bending, states: MotorStates, mass: float, counted: str) -> Any:
    """What every joint moves the tool at states with a payload [kg], shape (K, 3, n_joints) [m]."""
    own = 0.0 if counted == "payload" else states.load
    return bending.by_joint(states.position, own + mass * states.per_kilogram)


def deviation_of(motion: Any, given: Any, counted: str) -> tuple[float | None, str]:
    """The greatest deviation [m] that is asked for, or that the motion's problem keeps, and which torques count."""
    checked_name("counted", counted, COUNTED)
    if given is not None:
        most = real_number(given)
        if most is None or not np.isfinite(most) or most <= 0.0:
            raise InvalidInputError(f"deviation: expected a positive length [m], got {given!r}")
        if most > _FARTHEST:
            raise InvalidInputError(f"deviation: {most:g} m looks like mm: expected at most 1 m, {1e-3 * most:g} if so")
        return most, counted
    problem = problem_of(motion)
    for constraint in () if problem is None else problem.constraints:
        if constraint.quantity.startswith("tool deviation") and isinstance(constraint.limit, float):
            return constraint.limit, "payload" if constraint.quantity.endswith("by the payload") else "all"
    return None, counted


def supply_power_of(motion: Any, robot: Robot) -> float | None:
    """The greatest power of all motors together [W] that the motion's problem keeps, or else that the supply gives."""
    problem = problem_of(motion)
    for constraint in () if problem is None else problem.constraints:
        if constraint.quantity == "peak power" and isinstance(constraint.limit, float):
            return constraint.limit
    return robot.supply.peak_power


def _effort(rollout: Rollout) -> Iterator[Cause]:
    """The effort limits of a robot without drives, if it has any."""
    sides = rollout.limits.sides("effort")
    if sides.limited.any():
        bounds = causes_at_instants(rollout, Motors.of(rollout))["effort"]
        yield Cause({"effort": rollout.robot.joint_names}, bounds)


def _sought(states: MotorStates, causes: Sequence[Cause]) -> list[Sought]:
    """What causes allow at instants; of the places of each the one that binds counts alone."""
    return [Sought(states, cause.bounds, tuple(cause.columns.values())) for cause in causes]


def _by_joints(limit: DriveLimit, names: Sequence[str]) -> CauseLimit:
    return _limit(limit.cause, MassesOfJoints(limit.least, limit.mass, limit.time), names)


def _limit(cause: str, masses: MassesOfJoints, places: Sequence[str]) -> CauseLimit:
    """What a cause allows at all its places together."""
    most, least = float(masses.most.min()), float(masses.least.max())
    impossible = masses.most < masses.least
    column = int(impossible.argmax()) if impossible.any() else int(masses.most.argmin())
    bound = most < np.inf
    time = float(masses.time[column]) if bound else np.nan
    return CauseLimit(cause, least, -np.inf if impossible.any() else most, places[column] if bound else "", time)


def _of_causes(
    rollout: Rollout, causes: Sequence[Cause], masses: Sequence[MassesOfJoints], counted: str
) -> Iterator[CauseLimit]:
    """What causes allow with the masses that were found, and which joint gives way most where the tool deviates."""
    for cause, found in zip(causes, masses, strict=True):
        for name, columns in cause.columns.items():
            limit = _limit(name, MassesOfJoints(*(each[columns] for each in found)), cause.names[name])
            if name == "deviation" and not np.isnan(limit.time):
                at = MotorStates.at(rollout, np.array([limit.time]))
                moved = _moved(bending_of(rollout), at, max(limit.mass, 0.0), counted)[0]
                limit = replace(limit, place=rollout.robot.joint_names[int((moved.sum(axis=1) @ moved).argmax())])
            yield limit


def _not_known(robot: Robot, deviation: float | None) -> Iterator[str]:
    """What of accuracy, grip and stand limits nothing."""
    known = known_stiffness(robot)
    if deviation is None:
        yield "deviation of the tool"
    else:
        rigid = [name for name in robot.joint_names if name not in known]
        if rigid:
            yield f"what {', '.join(rigid)} give way, for want of stiffness"
    if robot.grip is None:
        yield CAUSES["slip"]
    if robot.stand is None:
        yield CAUSES["tip_over"]


def _together(limits: Sequence[CauseLimit], **told: Any) -> FullCapacity:
    """The capacity by all causes together; the other arguments are fields."""
    if not limits:
        return FullCapacity(mass=np.inf, least=0.0, cause="", place="", time=np.nan, limits=(), **told)
    least, binding = max(limit.least for limit in limits), min(limits, key=lambda limit: limit.mass)
    possible = least <= binding.mass
    bound = binding.mass < np.inf
    return FullCapacity(
        mass=binding.mass if possible else 0.0,
        least=least if possible else np.nan,
        cause=binding.cause if bound else "",
        place=binding.place if bound else "",
        time=binding.time if bound else np.nan,
        limits=tuple(limits),
        **told,
    )
