"""Power that all motors of B motions take from a shared supply: mechanical power, and what windings turn into heat."""

from __future__ import annotations

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.drives.cycle import legendre
from trajevo.dynamics.drives.motors import Motors
from trajevo.dynamics.drives.pieces import PIECE_NODES, cells_of
from trajevo.dynamics.rollout import Rollout

#: Evenly spaced instants of every cell at which the power is looked at; a parabola leads to the top between them.
_SHARES = np.linspace(0.0, 1.0, 33)


def supply_power(motors: Motors, torque: Array, velocity: Array) -> Array:
    """Power that motors take together, less what they give back, shape (...) [W].

    Heat of windings counts for drives that tell gear ratio, torque constant and resistance of the winding.

    Args:
        motors: the motors.
        torque: torques times the gear ratios, shape (..., n_joints) [N·m or N].
        velocity: velocities of the joints, the same shape [rad/s or m/s].
    """
    total = np.zeros_like(torque[..., 0])
    for k, resistance in enumerate(motors.copper.tolist()):
        one = torque[..., k]
        total = total + one * velocity[..., k] + resistance * one * one
    return total


def greatest_supply_power(rollout: Rollout) -> Array:
    """Greatest power that the motors take together at any instant looked at, shape (B,) [W]; 0 if they only give."""
    motors, count = Motors.of(rollout), rollout.trajectory.segment_durations.shape[1]
    onto = np.polynomial.legendre.legvander(2.0 * _SHARES - 1.0, PIECE_NODES - 1) @ legendre(PIECE_NODES)[2]
    rows, tops = [np.arange(len(rollout.trajectory))], [np.zeros(len(rollout.trajectory), dtype=rollout.effort.dtype)]
    for cells in cells_of(rollout):
        rows.append(cells.segment // count)
        smooth, rotor, v = (np.matmul(onto, x) for x in (cells.smooth, cells.rotor, cells.velocity))
        v = np.where(np.abs(v.real) <= rollout.standing[rows[-1]][:, None], 0.0, v)
        load = smooth - rotor + rollout.robot.friction.dry(v)
        way = np.sign(load.real) * np.sign(v.real)
        factor = np.where(way > 0.0, 1.0 / motors.driving, np.where(v.real == 0.0, 1.0, motors.driven))
        tops.append(_tops(supply_power(motors, rotor + factor * load, v)))
    owner, values = np.concatenate(rows), np.concatenate(tops)
    order = np.lexsort((values.real, owner))
    greatest: Array = values[order][np.append(owner[order][1:] != owner[order][:-1], True)]
    return greatest


def _tops(values: Array) -> Array:
    """Greatest of values (C, U), or of the parabola through it and its neighbours, shape (C,)."""
    best = values.real.argmax(axis=1)
    middle = np.clip(best, 1, values.shape[1] - 2)
    before, here, after = (np.take_along_axis(values, (middle + k)[:, None], axis=1)[:, 0] for k in (-1, 0, 1))
    slope, bend = 0.5 * (after - before), after - 2.0 * here + before
    hump = (bend.real < 0.0) & (np.abs(slope.real) < -bend.real)
    top = here - 0.5 * slope * slope / np.where(hump, bend, -1.0)
    greatest = np.take_along_axis(values, best[:, None], axis=1)[:, 0]
    found: Array = np.where(hump & (top.real > greatest.real), top, greatest)
    return found
