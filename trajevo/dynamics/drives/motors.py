"""What the motors of a motion bear: torque of the rotor, and of the load through the gear, affine in the mass.

A motor turns its rotor, which is before the gear, and the load, which is behind it: its torque times the gear ratio is
ρ + w x, with ρ = armature x acceleration and x = x₀ + m f. While the motor drives, w = 1/efficiency; while the load
drives it, w is the efficiency of that way; at rest, where friction may bear what the gear loses, w = 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import final

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.base.shown.brief import brief
from trajevo.dynamics.payload_masses import NEGLIGIBLE
from trajevo.dynamics.rollout import Rollout
from trajevo.robot.drive import Drive

#: Steps of false position to instants at which joints turn round, between samples next to them.
_STEPS = 24

#: Share of its greatest speed below which a joint has been found to turn round.
_STILL = 1e-14

#: A drive of which nothing is known.
UNKNOWN = Drive()


@final
@dataclass(frozen=True, eq=False)
class MotorStates:
    """States of joints and their motors at K instants of one motion, each array of shape (K, n_joints) but two.

    Attributes:
        times: instants, shape (K,) [s].
        segments: segments in which they lie, shape (K,).
        position: positions of the joints [rad or m].
        velocity: velocities of the joints, mere rounding set to 0 [rad/s or m/s].
        acceleration: accelerations of the joints [rad/s² or m/s²].
        rotor: torque of the rotor times the gear ratio [N·m or N].
        load: torque of the load on the joint without payload, friction included [N·m or N].
        per_kilogram: what a kilogram of payload adds to it, mere rounding set to 0 [N·m/kg or N/kg].
    """

    times: Array
    segments: Array
    position: Array
    velocity: Array
    acceleration: Array
    rotor: Array
    load: Array
    per_kilogram: Array

    __repr__ = brief

    @classmethod
    def at(cls, rollout: Rollout, times: Array) -> MotorStates:
        """At instants (K,) of the first trajectory [s]; at a break those of the segment that begins there."""
        q, v, a = (rollout.trajectory.evaluate(times[None], order) for order in range(3))
        return cls._of(rollout, times, rollout.segments_at(times)[0], (q, v, a))

    @classmethod
    def of_samples(cls, rollout: Rollout) -> MotorStates:
        """At evenly spaced instants of every segment of the first trajectory, twice where two segments meet."""
        shares, count = np.linspace(0.0, 1.0, rollout.dynamics.samples), len(rollout.trajectory.breaks[0]) - 1
        q, v, a = (rollout.trajectory.at_shares(shares, order) for order in range(3))
        begins, durations = rollout.trajectory.breaks[0, :-1, None], rollout.trajectory.segment_durations[0][:, None]
        times = (begins + durations * shares).reshape(-1)
        return cls._of(rollout, times, np.arange(count).repeat(len(shares)), (q, v, a))

    @classmethod
    def held(cls, rollout: Rollout) -> MotorStates:
        """At rest where the motion ends."""
        end = rollout.trajectory.duration[:1]
        q = rollout.trajectory.evaluate(end[None])
        still = np.zeros_like(q)
        return cls._of(rollout, end, rollout.segments_at(end)[0], (q, still, still))

    @classmethod
    def _of(cls, rollout: Rollout, times: Array, segments: Array, moving: tuple[Array, Array, Array]) -> MotorStates:
        q, v, a = moving[0], rollout.without_rounding(moving[1]), moving[2]
        unloaded = rollout.dynamics.unloaded_effort(q, v, a, segments, axis=1)[0]
        each = rollout.dynamics.effort_per_kilogram(q, v, a, segments, axis=1)[0]
        rotor = rollout.robot.friction.armature * a[0]
        felt = np.abs(each)
        each = np.where(felt > NEGLIGIBLE * felt.max(initial=0.0), each, 0.0)
        return cls(*map(frozen, (times, segments, q[0], v[0], a[0], rotor, unloaded - rotor, each)))

    def __getitem__(self, places: slice) -> MotorStates:
        """Those of some instants."""
        return MotorStates(*(frozen(getattr(self, field.name)[places]) for field in fields(MotorStates)))

    def with_more(self, more: MotorStates) -> MotorStates:
        """These states and others, in the order of time."""
        order = np.argsort(np.concatenate([self.times, more.times]), kind="stable")
        joined = (
            np.concatenate([getattr(one, field.name) for one in (self, more)])[order] for field in fields(MotorStates)
        )
        return MotorStates(*map(frozen, joined))


@final
@dataclass(frozen=True, eq=False)
class Motors:
    """The drives of a robot's joints as columns, each of shape (n_joints,).

    Attributes:
        drives: one for each joint; of one of which nothing is known all is unlimited.
    """

    drives: Sequence[Drive]

    __repr__ = brief

    @classmethod
    def of(cls, rollout: Rollout) -> Motors:
        """The drives of the robot of a rollout."""
        robot = rollout.robot
        return cls(tuple(robot.drives.get(name, UNKNOWN) for name in robot.joint_names))

    @property
    def driving(self) -> Array:
        """Efficiencies while motors drive."""
        return np.array([drive.efficiencies[0] for drive in self.drives])

    @property
    def driven(self) -> Array:
        """Efficiencies while they are driven."""
        return np.array([drive.efficiencies[1] for drive in self.drives])

    @property
    def lossy(self) -> bool:
        """Whether any gear has losses, so that the torque of its motor jumps where the joint turns round."""
        return any(drive.efficiencies != (1.0, 1.0) for drive in self.drives)

    @property
    def peak(self) -> Array:
        """Peak torques [N·m or N], inf where not known."""
        return np.array([np.inf if drive.peak_torque is None else drive.peak_torque for drive in self.drives])

    @property
    def copper(self) -> Array:
        """Heat of windings per square of the motors' torques [W/(N·m)² or W/N²], 0 where not known."""
        known = [(drive.winding_resistance, drive.gear_ratio, drive.torque_constant) for drive in self.drives]
        return np.array([r / (n * k) ** 2 if r and n and k else 0.0 for r, n, k in known])

    def through(self, load: Array, velocity: Array) -> Array:
        """Factor w from torques of the load to those of the motor, shapes (..., n_joints)."""
        driving = 1.0 / self.driving
        way = np.sign(load) * np.sign(velocity)
        factor: Array = np.where(way > 0.0, driving, np.where(velocity == 0.0, 1.0, self.driven))
        return factor

    def torque(self, states: MotorStates, mass: float) -> Array:
        """Torque of the motor times the gear ratio with a payload [kg], shape (K, n_joints) [N·m or N]."""
        load = states.load + mass * states.per_kilogram
        torque: Array = states.rotor + self.through(load, states.velocity) * load
        return torque

    def load_up_to(self, torque: Array, states: MotorStates) -> Array:
        """The load at which a motor has a torque, shapes (K, n_joints) [N·m or N]; infinite if no load reaches it."""
        left = torque - states.rotor
        factor = self.through(left, states.velocity)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(factor > 0.0, left / factor, np.copysign(np.inf, left))

    def at_speed(self, velocity: Array) -> tuple[Array, Array]:
        """Greatest torques backward and forward by the torque-speed lines, magnitudes, two arrays (K, n_joints).

        Negative where the load has to drive, -inf where the motor cannot turn so fast, inf without a line.
        """
        lines = np.stack([_line(drive, np.abs(velocity[:, k])) for k, drive in enumerate(self.drives)], axis=1)
        stall = np.array([drive.stall for drive in self.drives])
        return np.where(velocity < 0.0, lines, stall), np.where(velocity > 0.0, lines, stall)


def _line(drive: Drive, speed: Array) -> Array:
    """Torque with which a motor can drive at speeds (K,)."""
    if drive.torque_speed is None:
        return np.full(len(speed), np.inf)
    speeds, torques = np.array(drive.torque_speed).T
    within = np.interp(speed, speeds, torques)
    slope = (torques[-1] - torques[-2]) / (speeds[-1] - speeds[-2])
    beyond = slope * (speed - speeds[-1]) if torques[-1] == 0.0 else np.full(len(speed), -np.inf)
    line: Array = np.where(speed > speeds[-1], beyond, within)
    return line


def turning_points(states: MotorStates, rollout: Rollout) -> Array:
    """Instants of the first trajectory at which a joint turns round, between given states, shape (R,) [s]."""
    times, v = states.times, states.velocity
    before, joint = np.nonzero(v[:-1] * v[1:] < 0.0)
    left, right = times[before], times[before + 1]
    low, high = v[before, joint], v[before + 1, joint]
    middle: Array = left
    before_that = np.full(len(joint), -1)
    for _ in range(_STEPS if len(joint) else 0):
        with np.errstate(divide="ignore", invalid="ignore"):
            middle = np.where(high == low, middle, (left * high - right * low) / (high - low))
        here = rollout.trajectory.evaluate(middle[None], 1)[0, np.arange(len(joint)), joint]
        if (np.abs(here) <= _STILL * rollout.trajectory.peak(1)[0, joint]).all():
            break
        same = here * low > 0.0
        # An end that stays twice weighs half, so that both ends come near.
        weight = np.where(same == before_that, 0.5, 1.0)
        high, low = np.where(same, weight * high, here), np.where(same, here, weight * low)
        before_that = same
        left, right = np.where(same, middle, left), np.where(same, right, middle)
    return np.unique(middle)
