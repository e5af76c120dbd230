"""What motors can give at their speeds, and how much of it motions use: at single states, and over whole pieces.

The torque of a motor times the gear ratio is r + w x, see :mod:`trajevo.dynamics.drives.motors`. While the joint moves
forward, w x is the greater of x/efficiency and x times the efficiency of the driven gear; while it moves backward, the
lesser. What the motor can give is a line of straight sections over the speed. So over a piece of a motion
(:mod:`trajevo.dynamics.piece_bounds`) what is asked less what can be given is at most the greatest of a few functions
that are linear in r, x and the velocity together, which their Bernstein coefficients bound.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, final

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.base.shown.brief import brief
from trajevo.dynamics.drives.motors import UNKNOWN
from trajevo.dynamics.piece_bounds import Over, PieceBounds, Pieces, dry_range, interpolation_errors, motion_bounds
from trajevo.robot.drive import Drive
from trajevo.robot.robot import Robot
from trajevo.trajectory.bernstein import bernstein_halves, hull


class AskedOfMotors(NamedTuple):
    """What motors are asked for, each array of shape (..., m) for m motors.

    Attributes:
        rotor: torque of the rotor times the gear ratio [N·m or N].
        load: torque of the load on the joint [N·m or N].
        torque: torque of the motor times the gear ratio [N·m or N].
        velocity: velocity of the joint [rad/s or m/s].
    """

    rotor: Array
    load: Array
    torque: Array
    velocity: Array


@final
@dataclass(frozen=True, eq=False)
class TorqueLimits:
    """The m motors of a robot whose torque is limited, each with K sections of its line at most.

    Attributes:
        joints: numbers of their joints, shape (m,).
        greatest: torque at rest, shape (m,) [N·m or N].
        begins: speeds at which the sections begin, the first from -inf on, inf where there is none, shape (m, K).
        offsets: torques of the sections' lines at speed 0, shape (m, K) [N·m or N].
        slopes: their slopes, none above 0, shape (m, K) [N·m·s/rad or N·s/m].
        fastest: speeds that motors cannot exceed, inf where there is none, shape (m,) [rad/s or m/s].
        driving: efficiencies while motors drive, shape (m,) [1].
        driven: efficiencies while they are driven, shape (m,) [1].
        armature: inertias of the rotors times their gear ratios squared, shape (m,) [kg·m² or kg].
    """

    joints: np.ndarray[Any, np.dtype[np.intp]]
    greatest: Array
    begins: Array
    offsets: Array
    slopes: Array
    fastest: Array
    driving: Array
    driven: Array
    armature: Array

    __repr__ = brief

    @classmethod
    def of(cls, robot: Robot) -> TorqueLimits:
        """The limits of a robot's drives."""
        drives = [robot.drives.get(name, UNKNOWN) for name in robot.joint_names]
        joints = [k for k, drive in enumerate(drives) if drive.peak_torque is not None or drive.torque_speed]
        lines = [_sections(drives[k]) for k in joints]
        count = max((len(line) for line in lines), default=1)
        padded = np.array([[*line, *[(np.inf, 0.0, 0.0)] * (count - len(line))] for line in lines])
        padded = padded.reshape(len(lines), count, 3)
        efficiencies = np.array([drives[k].efficiencies for k in joints]).reshape(-1, 2)
        return cls(
            joints=np.array(joints, dtype=np.intp),
            greatest=frozen(padded[:, 0, 1]),
            begins=frozen(padded[..., 0]),
            offsets=frozen(padded[..., 1]),
            slopes=frozen(padded[..., 2]),
            fastest=frozen(np.array([_fastest(drives[k]) for k in joints])),
            driving=frozen(efficiencies[:, 0]),
            driven=frozen(efficiencies[:, 1]),
            armature=frozen(np.asarray(robot.friction.armature)[joints]),
        )

    @property
    def lossy(self) -> bool:
        """Whether any gear has losses."""
        return bool(((self.driving < 1.0) | (self.driven < 1.0)).any())

    @property
    def bends_down(self) -> Array:
        """Whether each line is the least of its sections' lines at every speed, shape (m,), bool."""
        steeper = (np.diff(self.slopes, axis=1) <= 0.0) | np.isinf(self.begins[:, 1:])
        return np.asarray(steeper.all(axis=1))

    def asked(self, effort: Array, v: Array, a: Array) -> AskedOfMotors:
        """What states of all joints ask of the motors.

        Args:
            effort: efforts of the joints, shape (..., n_joints) [N·m or N].
            v: their velocities, mere rounding set to 0 [rad/s or m/s].
            a: their accelerations [rad/s² or m/s²].
        """
        velocity, rotor = v[..., self.joints], self.armature * a[..., self.joints]
        load = effort[..., self.joints] - rotor
        if not self.lossy:
            return AskedOfMotors(rotor, load, rotor + load, velocity)
        way = np.sign(load.real) * np.sign(velocity.real)
        factor = np.where(way > 0.0, 1.0 / self.driving, np.where(velocity.real == 0.0, 1.0, self.driven))
        return AskedOfMotors(rotor, load, rotor + factor * load, velocity)

    def given(self, speed: Array) -> Array:
        """Greatest torque at a speed in the direction of the torque, negative against it, shape (..., m) [N·m or N]."""
        section = (speed.real[..., None] > self.begins[:, 1:]).sum(axis=-1)
        number = np.arange(len(self.joints))
        given: Array = self.offsets[number, section] + self.slopes[number, section] * speed
        return given

    def excess(self, asked: AskedOfMotors) -> Array:
        """What is asked less what can be given, over the greatest torque: forward, backward, and by speed, (3, ..., m).

        At most 0 where the motor can. A torque of 0.9 of what can be given at rest has -0.1.
        """
        forward, backward = (
            (sign * asked.torque - self.given(sign * asked.velocity)) / self.greatest for sign in (1.0, -1.0)
        )
        faster = asked.velocity * np.sign(asked.velocity.real) / self.fastest - 1.0
        return np.stack([forward, backward, faster])

    def over(self, bounds: PieceBounds, pieces: Pieces) -> Over:
        """1 plus the excess over pieces, 1 where the limit is reached, Q = m."""
        reach = motion_bounds(pieces.states, bounds.degree)
        smooth, magnitude = bounds.smooth_efforts(pieces, reach)
        _, v, a = np.split(pieces.states, 3, axis=-1)
        standing = bounds.standing[pieces.owner]
        error, slack = interpolation_errors([magnitude[..., self.joints]], pieces.states.shape[1])
        least, greatest = hull(np.moveaxis(v, 1, -1))
        lowest, highest = (x[:, self.joints] for x in dry_range(bounds.friction, least, greatest, standing))
        least, greatest = least[:, self.joints], greatest[:, self.joints]
        rotor = self.armature * a[..., self.joints]
        parts = (rotor, smooth[..., self.joints] - rotor, v[..., self.joints])
        curves = _Curves.of(parts, error)
        rest = standing[:, self.joints]
        ahead = self._greatest(curves, 1.0, highest, (least, greatest), rest)
        behind = self._greatest(curves, -1.0, -lowest, (-greatest, -least), rest)
        above = np.maximum(ahead, behind) / self.greatest
        above = np.maximum(above, np.maximum(greatest, -least) / self.fastest - 1.0)
        moving = np.where(np.abs(v) <= standing[:, None], 0.0, v)
        found = self.excess(self.asked(smooth + bounds.friction.dry(moving), moving, a)).max(axis=0)
        return Over(1.0 + above, slack / (self.driving * self.greatest), 1.0 + found)

    def _greatest(self, curves: _Curves, sign: float, dry: Array, speeds: tuple[Array, Array], rest: Array) -> Array:
        """Upper bounds of what is asked less what can be given in one direction, shape (K, m) [N·m or N].

        Args:
            curves: rotor, load and velocity over the pieces.
            sign: the direction.
            dry: greatest dry friction in it (K, m).
            speeds: least and greatest speeds in it (K, m).
            rest: greatest speeds at which joints count as at rest (K, m).
        """
        sections = [(speed[..., None] > self.begins[:, 1:]).sum(axis=-1) for speed in speeds]
        least_given = self.given(speeds[1])
        several = (sections[0] < sections[1]) & ~self.bends_down
        one = np.ones(len(self.joints))
        found = []
        for factor in (1.0 / self.driving, self.driven, one) if self.lossy else (one,):
            torque, more = curves.torque(sign, factor, dry)
            best = np.where(several, torque.max(axis=-1) + more - least_given, -np.inf)
            for k in range(self.offsets.shape[1]):
                seen = (sections[0] <= k) & (sections[1] >= k) & ~several
                lines = self.offsets[:, k], sign * self.slopes[:, k]
                best = np.where(seen, np.maximum(best, curves.above(torque, *lines) + more), best)
            found.append(best)
        at_rest: Array = found[-1]
        if not self.lossy:
            return at_rest
        against, along = np.minimum(found[0], found[1]), np.maximum(found[0], found[1])
        # A motor that is driven bears less than one that holds, so that rest counts wherever a joint comes to it.
        stopping: Array = np.where(speeds[0] >= -rest, at_rest, np.maximum(against, at_rest))
        bound: Array = np.where(speeds[1] < -rest, against, np.where(speeds[1] > rest, along, stopping))
        return bound


class _Curves(NamedTuple):
    """Rotor, load and velocity over pieces: Bernstein coefficients (K, m, C), and bounds of their errors (K, m)."""

    rotor: Array
    load: Array
    velocity: Array
    slacks: tuple[Array, Array, Array]

    @classmethod
    def of(cls, parts: tuple[Array, Array, Array], error: Array) -> _Curves:
        """From values at the nodes (K, N, m), of which the second has an error of its own (K, m)."""
        (rotor, by_rotor), (load, by_load), (velocity, by_velocity) = (
            bernstein_halves(np.moveaxis(part, 1, -1)) for part in parts
        )
        return cls(rotor, load, velocity, (by_rotor, by_load + error, by_velocity))

    def torque(self, sign: float, factor: Array, dry: Array) -> tuple[Array, Array]:
        """Torque of the motor in a direction (K, m, C), and what friction and errors add to it (K, m)."""
        torque = sign * (self.rotor + factor[..., None] * self.load)
        return torque, factor * (dry + self.slacks[1]) + self.slacks[0]

    def above(self, torque: Array, offset: Array, slope: Array) -> Array:
        """Upper bounds of a torque less a line over the velocity, shape (K, m)."""
        least: Array = (torque - slope[:, None] * self.velocity).max(axis=-1) - offset + np.abs(slope) * self.slacks[2]
        return least


def _sections(drive: Drive) -> list[tuple[float, float, float]]:
    """Where sections of the line of a motor's torque begin, and their torques at speed 0 and slopes."""
    peak = np.inf if drive.peak_torque is None else drive.peak_torque
    sections = [(-np.inf, float(min(peak, drive.stall)), 0.0)]
    if drive.torque_speed is None:
        return sections
    points = np.array(drive.torque_speed)
    ends = [*points[1:-1, 0], np.inf]  # the last one goes on, also where no motor can turn so fast
    for (speed, torque), (after, lower), end in zip(points[:-1], points[1:], ends, strict=True):
        slope = (lower - torque) / (after - speed)
        offset = torque - slope * speed
        begin = speed if torque <= peak else (peak - offset) / slope if lower < peak else end
        if begin < end and slope < 0.0:
            sections.append((float(begin), float(offset), float(slope)))
        elif begin < end and torque < sections[0][1]:
            sections.append((float(begin), float(torque), 0.0))
    return sections


def _fastest(drive: Drive) -> float:
    """The speed that a motor cannot exceed whatever drives it."""
    speed, torque = (np.inf, 0.0) if drive.torque_speed is None else drive.torque_speed[-1]
    return speed if torque > 0.0 else np.inf
