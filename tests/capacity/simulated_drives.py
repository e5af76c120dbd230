"""Drives simulated step by step, as a second opinion: no closed form, no roots, no quadrature of smooth pieces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from trajevo import Payload, load_robot
from trajevo.dynamics.inverse_dynamics import Dynamics


@dataclass
class Simulated:
    """A motion of a robot in `steps` equal steps per segment: what its motors bear, and how they warm up."""

    robot: object
    trajectory: object
    steps: int

    def __post_init__(self):
        shares = np.linspace(0.0, 1.0, 2 * self.steps + 1)
        q, v, a = (self.trajectory.at_shares(shares, order) for order in range(3))
        self.velocity = v[0]
        self.load, self.per_kilogram = self._affine(q, v, a)
        self.rotor = self.robot.friction.armature * a[0]
        self.load = self.load - self.rotor
        still = np.zeros_like(q[:, -1:])
        self.held = [x[0] for x in self._affine(q[:, -1:], still, still)]
        # Midpoints of the steps, and their durations.
        self.middle = np.arange(len(shares) * len(self.trajectory.segment_durations[0])) % len(shares) % 2 == 1
        self.step = (self.trajectory.segment_durations[0] / self.steps).repeat(self.steps)

    def _affine(self, q, v, a):
        """Efforts without payload and per kilogram, from those of the robot with two payloads."""
        empty = Dynamics(self.robot, Payload(0.0)).effort(q, v, a)[0]
        loaded = Dynamics(self.robot, Payload(2.0)).effort(q, v, a)[0]
        return empty, (loaded - empty) / 2.0

    def torque(self, joint, mass):
        """Torque of a motor times the gear ratio, at all instants, shape (T,)."""
        drive = self.robot.drives[self.robot.joint_names[joint]]
        driving = drive.efficiency_driving or 1.0
        driven = driving if drive.efficiency_driven is None else drive.efficiency_driven
        load, v = self.load[:, joint] + mass * self.per_kilogram[:, joint], self.velocity[:, joint]
        behind = np.where(v == 0.0, load, np.where(load * v > 0.0, load / driving, load * driven))
        return self.rotor[:, joint] + behind

    def at_rest(self, joint, mass):
        drive = self.robot.drives[self.robot.joint_names[joint]]
        return 0.0 if drive.brake else self.held[0][joint] + mass * self.held[1][joint]

    def peak(self, joint, mass):
        drive = self.robot.drives[self.robot.joint_names[joint]]
        return np.abs(self.torque(joint, mass)).max() / drive.peak_torque

    def speed(self, joint, mass):
        """1 plus the greatest excess over what the motor can drive with, as a share of its stall torque."""
        (_, stall), (fastest, _) = self.robot.drives[self.robot.joint_names[joint]].torque_speed
        torque, v = self.torque(joint, mass), self.velocity[:, joint]
        line = stall * (1.0 - np.abs(v) / fastest)
        forward, backward = np.where(v > 0.0, line, stall), np.where(v < 0.0, line, stall)
        return 1.0 + max((torque - forward).max(), (-torque - backward).max()) / stall

    def rms(self, joint, mass, dwell):
        square = self.torque(joint, mass)[self.middle] ** 2
        total = (square * self.step).sum() + dwell * self.at_rest(joint, mass) ** 2
        return np.sqrt(total / (self.step.sum() + dwell))

    def steady(self, joint, dwell):
        """Number of cycles after which nothing is left of the begin."""
        constant = self.robot.drives[self.robot.joint_names[joint]].thermal_time_constant
        return 2 + int(17.0 * constant / (self.step.sum() + dwell))

    def rises(self, joint, mass, dwell, cycles):
        """Temperatures of the winding after every step of the last of some cycles, or of a steady state (None)."""
        drive = self.robot.drives[self.robot.joint_names[joint]]
        per_square = drive.thermal_resistance * drive.winding_resistance
        from scipy.signal import (
            lfilter,
        )  # takes a second to import, which every process that collects tests would spend

        per_square /= (drive.gear_ratio * drive.torque_constant) ** 2
        steady = per_square * self.torque(joint, mass)[self.middle] ** 2
        held, rise = per_square * self.at_rest(joint, mass) ** 2, 0.0
        kept = np.exp(-self.step / drive.thermal_time_constant)
        rest = np.exp(-dwell / drive.thermal_time_constant)
        for _ in range(cycles or self.steady(joint, dwell)):
            rises = [np.array([rise])]
            for begin in range(0, len(steady), self.steps):
                one = slice(begin, begin + self.steps)
                share = kept[begin]
                rises.append(lfilter([1.0 - share], [1.0, -share], steady[one], zi=[share * rises[-1][-1]])[0])
            rise = held + rest * (rises[-1][-1] - held)
            rises.append(np.array([rise]))
        return np.concatenate(rises)


def last_kept(level, inside, outside, *, halvings):
    """The mass from a feasible one on at which a level first exceeds 1 by bisection, or the other one."""
    if level(outside) <= 1.0:
        return outside
    low, high = inside, outside
    for _ in range(halvings):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if level(middle) <= 1.0 else (low, middle)
    return low


def with_drives(text, drives):
    """The robot of a URDF with drives."""
    limits = {"velocity": np.inf, "acceleration": np.inf, "jerk": np.inf, "effort": np.inf}
    return load_robot("random", urdf=text, limits=limits, drives=drives)
