"""Electrical power and energy of drives: of every motor, of all at one link, and of what braking gives back.

A motor whose torque times the gear ratio is T draws T v for its shaft, c T² in the winding with c = R/(N k)², and the
inverter loses b |T| with b = U/(N k); how its gear makes T stands in :mod:`trajevo.dynamics.drives.motors`. What it
draws is negative while it brakes more than it loses.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.dynamics.drives.link import Works, link_of, works_of
from trajevo.dynamics.drives.motors import UNKNOWN, Motors
from trajevo.dynamics.drives.smooth_pieces import SmoothPieces, smooth_pieces
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.robot.robot import Robot


@final
@dataclass(frozen=True, eq=False)
class MotorPowers:
    """What becomes of the power of motors, each array of shape (..., n_joints) [W]; their sum is what they draw.

    Attributes:
        mechanical: what moves links, payload and rotors.
        friction: of the joints.
        gear: what gears lose.
        copper: what windings lose.
        inverter: what inverters lose, of shape () without such a loss.
    """

    mechanical: Array
    friction: Array
    gear: Array
    copper: Array
    inverter: Array

    __repr__ = brief


@final
@dataclass(frozen=True, eq=False)
class Motoring:
    """The drives of a robot, and what turns states of its joints into powers.

    Attributes:
        robot: the robot.
        motors: its drives.
        per_square: loss of the winding per square of a motor's torque times the gear ratio, (n_joints,).
        per_torque: loss of the inverter per magnitude of it, (n_joints,).
    """

    robot: Robot
    motors: Motors
    per_square: Array
    per_torque: Array

    __repr__ = brief

    @classmethod
    def of(cls, rollout: Rollout) -> Motoring:
        """The drives of the robot of a rollout, which must tell enough.

        Raises:
            InvalidInputError: a joint without a drive, or a drive that does not tell what its current follows from.
        """
        check_drives(rollout.robot, "electrical energy")
        motors = Motors.of(rollout)
        per_square, per_torque = np.array([drive.current_losses for drive in motors.drives]).T
        return cls(rollout.robot, motors, per_square, per_torque)

    def torque(self, load: Array, ways: Array, rotor: Array) -> Array:
        """Torque of motors times the gear ratio, shapes (..., n_joints) [N·m or N], see :meth:`powers`."""
        torque: Array = rotor + self.motors.through(load.real, ways) * load
        return torque

    def lost(self, torque: Array) -> tuple[Array, Array]:
        """What windings and inverters lose at torques of shape (..., n_joints) [W]."""
        inverters = self.per_torque * torque * np.sign(torque.real) if self.per_torque.any() else np.zeros(())
        return self.per_square * torque * torque, inverters

    def drawn(self, v: Array, effort: Array, a: Array, ways: Array) -> Array:
        """What each motor draws with its inverter, negative while it gives back, see :meth:`powers`."""
        friction = self.robot.friction
        rotor = friction.armature * a
        torque = self.torque(effort + friction.dry(ways) - rotor, ways, rotor)
        copper, inverter = self.lost(torque)
        total: Array = torque * v + copper + inverter
        return total

    def powers(self, v: Array, effort: Array, a: Array, ways: Array) -> MotorPowers:
        """Powers in states of shape (..., n_joints).

        Args:
            v: velocities [rad/s or m/s].
            effort: efforts without dry friction [N·m or N].
            a: accelerations [rad/s² or m/s²].
            ways: real numbers with the signs of the ways in which the joints move, 0 of joints at rest.
        """
        friction = self.robot.friction
        dry, rotor = friction.dry(ways), friction.armature * a
        rubbing, load = friction.viscous * v + dry, effort + dry - rotor
        torque = self.torque(load, ways, rotor)
        return MotorPowers((rotor + load - rubbing) * v, rubbing * v, (torque - rotor - load) * v, *self.lost(torque))


def check_drives(robot: Robot, quantity: str) -> None:
    """Refuse a quantity that needs the currents of all motors.

    Args:
        robot: the robot.
        quantity: what is to be computed, for the message.

    Raises:
        InvalidInputError: a drive does not tell them; the message names the joints and what they lack.
    """
    lacking = {name: robot.drives.get(name, UNKNOWN).lacking_for_current for name in robot.joint_names}
    told = "; ".join(f"{name} lacks {', '.join(what)}" for name, what in lacking.items() if what)
    if told:
        raise InvalidInputError(
            f"{quantity} needs the drives of all joints of robot {robot.name!r}, but {told}: give them in robot.toml "
            f"([drives.{robot.joint_names[0]}]), in the [robot] of a task, or as an argument "
            "(load_robot(..., drives={...}))"
        )


@final
@dataclass(frozen=True, eq=False)
class Drawn:
    """What motors draw in one piece of motions after another.

    Attributes:
        pieces: L smooth pieces.
        ways: signs of the ways in which joints move in them, 0 at rest, shape (L, 1, n_joints).
        power: what each motor draws at their nodes, shape (L, N, n_joints) [W].
    """

    pieces: SmoothPieces
    ways: Array
    power: Array

    __repr__ = brief

    @classmethod
    def by_pieces(cls, rollout: Rollout) -> Iterator[Drawn]:
        """All motions of a rollout, some pieces at a time."""
        motoring, count = Motoring.of(rollout), rollout.trajectory.segment_durations.shape[1]
        for pieces in smooth_pieces(rollout, motoring.motors):
            ways = pieces.ways(rollout.standing[pieces.segments // count])
            yield cls(pieces, ways, motoring.drawn(pieces.velocity, pieces.effort, pieces.acceleration, ways))

    @property
    def each(self) -> Works:
        """What each motor draws, in parts in which it only draws or only gives back."""
        return works_of(self.pieces, self.power)

    @property
    def together(self) -> Works:
        """The same of all motors at one link."""
        return works_of(self.pieces, summed(self.power)[..., None])


def electrical_energy(rollout: Rollout) -> Array:
    """What the drives of a robot draw from the mains on a motion, with standby, shape (B,) [J].

    What motors give back counts as the robot's supply says, see :class:`~trajevo.robot.loading.supply.Supply`; a link
    that stores energy begins at the voltage of the mains, and what is left in it at the end counts for nothing.

    Raises:
        InvalidInputError: a drive does not tell what the current of its motor follows from.
    """
    supply, per_segment = rollout.robot.supply, rollout.trajectory.segment_durations.shape
    works = [drawn.each if supply.recuperation == "none" else drawn.together for drawn in Drawn.by_pieces(rollout)]
    if supply.storable > 0.0:
        drawn = link_of(works, per_segment, supply.storable).drawn
    else:
        found = np.zeros(per_segment[0] * per_segment[1], dtype=rollout.effort.dtype)
        for work in works:
            np.add.at(found, work.segments, work.net if supply.recuperation == "full" else work.drawn)
        drawn = found.reshape(per_segment).sum(axis=1)
    total: Array = drawn + supply.standby * rollout.trajectory.duration
    return total


def summed(values: Array) -> Array:
    """Sum over the last axis, one joint after another, so that its digits are those of the row alone."""
    total: Array = values[..., 0]
    for k in range(1, values.shape[-1]):
        total = total + values[..., k]
    return total
