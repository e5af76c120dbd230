"""What an arm carries on a motion by its drives, and what the motion asks of them.

Effort is affine in the payload's mass m, τ = τ₀ + m f. Limits at single instants (effort, peak torque, torque at
speed) are affine in it, so each leaves an interval of masses in closed form. The mean square of a motor's torque and
the temperature of its winding are quadratic, so those are larger roots. All are looked at in the samples and in further
nodes; around those that bind the motion is sampled anew, ever finer, so that their instants are found too.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from trajevo.base.arrays import Array, frozen, numbers
from trajevo.capacity.dlcc import sampled_motion
from trajevo.capacity.drives.found import DriveCapacity, DriveLimit, DriveLoad
from trajevo.capacity.drives.instants import (
    MassesOfJoints,
    Sought,
    causes_at_instants,
    masses_at_instants,
    nearly_binding,
)
from trajevo.capacity.drives.squares import HeatLimit, JointCycle, MassesOfJoint
from trajevo.dynamics.drives.cycle import LONGEST, MOST_PIECES, NODES, Cycle, legendre
from trajevo.dynamics.drives.duty import checked_cycles, checked_dwell
from trajevo.dynamics.drives.motors import Motors, MotorStates, turning_points
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.front.front import Solution
from trajevo.robot.drive import Drive
from trajevo.solvers.gradient.weighted_sum import WeightedOptimum

#: Default number of instants per segment at which limits are looked at: nothing proves them between.
DENSE = 200

#: How often pieces are halved at most, and what the last terms of squares may be, as a share of the greatest square.
_HALVINGS, _RESOLVED = 8, 1e-9

#: How near to the ends of pieces limits are looked at, as a share of the motion.
NEAR = 1e-7

#: Masses beyond so many times the least one that a joint allows are not sought where the joint that binds counts alone.
_BEYOND = 1.1

#: A joint whose drive says nothing of a cause.
_FREE = MassesOfJoint(0.0, np.inf, np.nan)


def drive_capacity(
    motion: Solution | Rollout | WeightedOptimum,
    *,
    dwell: float = 0.0,
    cycles: int | None = None,
    samples: int = DENSE,
) -> DriveCapacity:
    """The largest payload that drives allow on a motion that repeats, and what limits it: torque, speed, or heat.

    Args:
        motion: a solution of a front, an optimum, or the first trajectory of a rollout, of a robot with drives. Shape
            and model of the payload are those of the motion's rollout; its mass is not used.
        dwell: time at rest after the motion, at its end, until it begins anew [s]. Motors hold gravity and payload
            then, unless a brake does.
        cycles: how often the motion is made from cold windings on; for ever if None.
        samples: evenly spaced instants per segment at which limits are looked at, both ends included; those that bind
            are searched between them too.

    Raises:
        InvalidInputError: a robot without drives, a dwell below 0, no whole number of cycles from 1 on, or a time
            constant that is too short for the motion.
    """
    cycling = Cycling.of(motion, dwell, cycles, samples)
    return DriveCapacity.of(
        cycling.limits().drives,
        joint_names=cycling.rollout.robot.joint_names,
        robot=cycling.rollout.robot.name,
        payload_model=cycling.rollout.dynamics.payload.model,
        dwell=cycling.cycle.dwell,
        cycles=cycling.cycle.cycles,
        samples=samples,
        not_known=cycling.not_known,
    )


def drive_load(
    motion: Solution | Rollout | WeightedOptimum,
    *,
    mass: float | None = None,
    dwell: float = 0.0,
    cycles: int | None = None,
    samples: int = DENSE,
) -> DriveLoad:
    """What a motion that repeats asks of every drive with a payload: torques, their mean square, temperatures.

    Args:
        motion: as for :func:`drive_capacity`.
        mass: of the payload [kg]; that which the motion carries if None.
        dwell: as for :func:`drive_capacity`.
        cycles: as for :func:`drive_capacity`.
        samples: as for :func:`drive_capacity`.

    Raises:
        InvalidInputError: a mass below 0, or as for :func:`drive_capacity`.
    """
    cycling = Cycling.of(motion, dwell, cycles, samples)
    rollout = cycling.rollout
    given = rollout_mass(rollout) if mass is None else float(numbers(mass, name="mass", shape=()))
    if given < 0.0:
        raise InvalidInputError(f"mass: expected a payload from 0 on [kg], got {given}")
    torque = cycling.motors.torque(cycling.states, given)
    backward, forward = cycling.motors.at_speed(cycling.states.velocity)
    used = np.maximum(_share(torque, forward), _share(-torque, backward))
    fastest = used.argmax(axis=0)
    rms, mean, hottest, when = (np.array(column) for column in zip(*cycling.heats(given), strict=True))
    drives = cycling.motors.drives
    continuous, rise = (
        np.array([getattr(drive, name) or np.nan for drive in drives])
        for name in ("continuous_torque", "greatest_rise")
    )
    peak = np.abs(torque).max(axis=0)
    return DriveLoad(
        mass=given,
        peak_torque=frozen(peak),
        peak_share=frozen(np.where(np.isfinite(cycling.motors.peak), peak / cycling.motors.peak, np.nan)),
        speed_share=frozen(np.where([drive.torque_speed is not None for drive in drives], used.max(axis=0), np.nan)),
        speed_time=frozen(cycling.states.times[fastest]),
        rms_torque=frozen(rms),
        rms_share=frozen(rms / continuous),
        mean_rise=frozen(mean),
        peak_rise=frozen(hottest),
        rise_share=frozen(hottest / rise),
        rise_time=frozen(when),
        joint_names=rollout.robot.joint_names,
        dwell=cycling.cycle.dwell,
        cycles=cycling.cycle.cycles,
    )


def rollout_mass(rollout: Rollout) -> float:
    """The payload that the first trajectory of a rollout carries [kg]; NaN if it is open which of several is meant."""
    schedule = rollout.dynamics.schedule
    if schedule is not None and schedule.varied is None:
        return float("nan")
    return rollout.dynamics.payload.mass if rollout.masses is None else float(rollout.masses[0])


class CycleLimits(NamedTuple):
    """What drives allow on a motion that repeats, and masses of further causes that were sought."""

    drives: tuple[DriveLimit, ...]
    further: tuple[MassesOfJoints, ...]


class Cycling(NamedTuple):
    """A motion that repeats: the robot on it, its motors, states at instants, and smooth pieces with their states.

    Attributes:
        rollout: the motion.
        motors: of the robot.
        sampled: states at evenly spaced instants.
        states: the same and further ones, at which limits are looked at.
        cycle: smooth pieces and the time at rest.
        at_nodes: states at their nodes.
        held: the state at rest.
    """

    rollout: Rollout
    motors: Motors
    sampled: MotorStates
    states: MotorStates
    cycle: Cycle
    at_nodes: MotorStates
    held: MotorStates

    @classmethod
    def of(cls, motion: Any, dwell: Any, cycles: Any, samples: int) -> Cycling:
        """A motion with its time at rest, checked."""
        rollout = sampled_motion(motion, samples)
        robot = rollout.robot
        if not robot.drives:
            raise InvalidInputError(
                f"robot {robot.name!r} has no drives: give them in robot.toml ([drives.{robot.joint_names[0]}]), in "
                "the [robot] of a task, or as an argument (load_robot(..., drives={...}))"
            )
        rest, often = checked_dwell(dwell), checked_cycles(cycles)
        motors = Motors.of(rollout)
        sampled = MotorStates.of_samples(rollout)
        smooth = _smooth(rollout, motors, sampled)
        cycle, at_nodes = _resolved(rollout, _pieces(smooth, motors, rest, often))
        # Where joints turn round torques jump with losses: both sides count.
        near = np.concatenate([cycle.ends[1:-1] + side * NEAR * cycle.ends[-1] for side in (-1.0, 1.0)])
        states = sampled.with_more(at_nodes)
        states = states.with_more(MotorStates.at(rollout, near)) if len(near) else states
        return cls(rollout, motors, sampled, states, cycle, at_nodes, MotorStates.held(rollout))

    def limits(self, *, binding: bool = False, further: Sequence[Sought] = ()) -> CycleLimits:
        """What drives allow, and masses of further causes that are sought in the same states.

        Args:
            binding: whether the joint that binds counts alone, so that others are not searched finer.
            further: what else is sought.
        """
        drives, causes = self.motors.drives, causes_at_instants(self.rollout, self.motors)
        known = {
            "effort": self.rollout.limits.sides("effort").limited,
            "peak_torque": np.array([drive.peak_torque is not None for drive in drives]),
            "torque_at_speed": np.array([drive.torque_speed is not None for drive in drives]),
        }
        together = (slice(None),) if binding else ()
        sought = {
            cause: Sought(self.states, bounds, together) for cause, bounds in causes.items() if known[cause].any()
        }
        found = masses_at_instants(self.rollout, [*sought.values(), *further])
        masses = dict(zip(sought, found, strict=False))
        free = _columns([_FREE] * len(drives))
        limits = [_limit(cause, masses.get(cause, free), known[cause]) for cause in causes]
        joints = self.joints
        limits += [_by_heat(cause, joints, asked, binding) for cause, asked in self._heat_limits().items()]
        return CycleLimits(tuple(limits), tuple(found[len(sought) :]))

    def _heat_limits(self) -> dict[str, list[HeatLimit | None]]:
        """What the mean squares of the motors' torques over a cycle must not exceed, and the temperatures."""
        temperatures = [_greatest_square(drive) for drive in self.motors.drives]
        continuous = [drive.continuous_torque for drive in self.motors.drives]
        return {
            "rms_torque": [None if most is None else HeatLimit(most**2) for most in continuous],
            "temperature": temperatures,
        }

    def heats(self, mass: float) -> Iterator[tuple[float, float, float, float]]:
        """RMS torque, mean and greatest temperature in the last cycle [K], and the instant of that, of every joint."""
        for joint, drive in zip(self.joints, self.motors.drives, strict=True):
            cycle, square, held = joint.at_mass(mass)
            mean = float(cycle.mean(square, held))
            if drive.lacking_for_heat or drive.thermal_time_constant is None:
                yield mean**0.5, np.nan, np.nan, np.nan
                continue
            hottest, time = cycle.hottest(square, held, drive.thermal_time_constant)
            scale = drive.rise_per_square
            yield mean**0.5, scale * mean if cycle.cycles is None else np.nan, scale * hottest, time

    @property
    def not_known(self) -> tuple[str, ...]:
        """What limits nothing although a drive tells of it, because something else of it is not known."""
        drives = self.rollout.robot.drives.items()
        lacking = {name: drive.lacking_for_heat for name, drive in drives if drive.greatest_rise is not None}
        return tuple(f"temperature of {name}, for want of {', '.join(few)}" for name, few in lacking.items() if few)

    @property
    def joints(self) -> tuple[JointCycle, ...]:
        """What the motor of every joint bears."""
        shape = (len(self.cycle.ends) - 1, NODES)
        middle = self.at_nodes.velocity.reshape(*shape, -1)[:, NODES // 2]
        found = []
        for k, drive in enumerate(self.motors.drives):
            rotor, load, each = (
                getattr(self.at_nodes, name)[:, k].reshape(shape) for name in ("rotor", "load", "per_kilogram")
            )
            held = (0.0, 0.0) if drive.brake else (float(self.held.load[0, k]), float(self.held.per_kilogram[0, k]))
            found.append(JointCycle(self.cycle, rotor, load, each, np.sign(middle[:, k]), held, drive.efficiencies))
        return tuple(found)


def _by_heat(cause: str, joints: Sequence[JointCycle], asked: Sequence[HeatLimit | None], binding: bool) -> DriveLimit:
    """What a limit of every joint over the whole cycle allows."""
    rows, bound = [_FREE] * len(joints), np.inf
    for k, joint in sorted(enumerate(joints), key=lambda each: _strain(each[1], asked[each[0]]), reverse=True):
        limit = asked[k]
        rows[k] = _FREE if limit is None else joint.roughly(limit, bound)
        if binding and 0.0 < rows[k].most < bound:
            bound = min(bound, _BEYOND * rows[k].most)
    rough = _columns(rows)
    closely = nearly_binding(rough.most, rough.least) if binding else np.ones(len(rows), dtype=np.bool_)
    for k in np.flatnonzero(closely).tolist():
        limit = asked[k]
        rows[k] = _FREE if limit is None else joints[k].masses(limit, rows[k])
    return _limit(cause, _columns(rows), np.array([limit is not None for limit in asked]))


def _strain(joint: JointCycle, limit: HeatLimit | None) -> float:
    """How much of a limit a kilogram takes, roughly: joints of which it takes most are looked at first."""
    return 0.0 if limit is None else float((joint.per_kilogram**2).mean()) / limit.most


def _greatest_square(drive: Drive) -> HeatLimit | None:
    """What a winding bears of the square of its motor's torque, if that is known."""
    if drive.greatest_rise is None or drive.thermal_time_constant is None or drive.lacking_for_heat:
        return None
    return HeatLimit(drive.greatest_rise / drive.rise_per_square, drive.thermal_time_constant)


def _smooth(rollout: Rollout, motors: Motors, sampled: MotorStates) -> Array:
    """Instants between which torques are smooth, from the begin to the end of the motion [s]."""
    ends: Array = rollout.trajectory.breaks[0]
    if motors.lossy or rollout.robot.friction.is_dry:
        ends = np.unique(np.concatenate([ends, turning_points(sampled, rollout)]))
    return ends


def _pieces(ends: Array, motors: Motors, dwell: float, cycles: int | None) -> Cycle:
    """The motion in pieces between instants [s], and short enough for the temperatures of all windings."""
    whole = Cycle(frozen(ends), dwell, cycles).split(np.empty(0))
    shortest = min((drive.thermal_time_constant or np.inf for drive in motors.drives), default=np.inf)
    parts = np.maximum(np.ceil(whole.durations / (LONGEST * shortest)), 1.0)
    if parts.sum() > MOST_PIECES:
        raise InvalidInputError(
            f"thermal_time_constant: {shortest:g} s is too short for a motion of {whole.ends[-1]:g} s: expected at "
            f"least {whole.ends[-1] / (LONGEST * MOST_PIECES):.3g} s"
        )
    inner = [
        np.linspace(begin, end, int(count) + 1)[1:-1]
        for begin, end, count in zip(whole.ends[:-1], whole.ends[1:], parts, strict=True)
    ]
    return whole.split(np.concatenate(inner))


def _resolved(rollout: Rollout, cycle: Cycle) -> tuple[Cycle, MotorStates]:
    """Pieces that are halved until polynomials through the nodes tell squares of torques, and states at the nodes."""
    states = MotorStates.at(rollout, cycle.nodes.reshape(-1))
    for _ in range(_HALVINGS):
        shape = (len(cycle.ends) - 1, NODES, -1)
        torques = (states.rotor, states.load, states.per_kilogram, states.rotor + states.load)
        squares = np.stack([torque.reshape(shape) ** 2 for torque in torques])
        last = np.abs(legendre(NODES)[2][-2:] @ squares).max(axis=2)
        rough = (last > _RESOLVED * squares.max(axis=(1, 2))[:, None]).any(axis=(0, 2))
        if not rough.any() or len(cycle.ends) > MOST_PIECES:
            break
        cycle = cycle.split((0.5 * (cycle.ends[1:] + cycle.ends[:-1]))[rough])
        states = MotorStates.at(rollout, cycle.nodes.reshape(-1))
    return cycle, states


def _share(torque: Array, limit: Array) -> Array:
    """Share of a limit that a torque in its direction takes; where the load has to drive, inf or 0."""
    with np.errstate(divide="ignore", invalid="ignore"):
        share: Array = np.where(limit > 0.0, np.maximum(torque, 0.0) / limit, np.where(torque > limit, np.inf, 0.0))
    return share


def _columns(rows: list[MassesOfJoint]) -> MassesOfJoints:
    return MassesOfJoints(*(np.array(column) for column in zip(*rows, strict=True)))


def _limit(cause: str, masses: MassesOfJoints, known: Array) -> DriveLimit:
    least, most, time = masses
    return DriveLimit(
        cause=cause,
        least=frozen(np.where(known, np.where(most < 0.0, np.inf, least), 0.0)),
        mass=frozen(np.where(known, np.where(most < 0.0, -np.inf, most), np.inf)),
        time=frozen(np.where(known, time, np.nan)),
        known=frozen(known),
    )
