"""Torques of motors over pieces of B motions on which they are smooth, for integrals over cycles.

Efforts without dry friction are polynomials through as many nodes of every segment as they need. A segment becomes
cells that polynomials through fewer nodes describe. With dry friction and with losses of gears the torque of a motor
jumps where its joint turns round, and bends where its load changes its direction: there the cells of that joint end.
What happens in a piece depends on nothing else in the batch.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.dynamics.drives.cycle import legendre
from trajevo.dynamics.drives.motors import Motors
from trajevo.dynamics.integrals.resolved import Resolved
from trajevo.dynamics.rollout import Rollout
from trajevo.trajectory.bernstein import gauss

#: Nodes of every piece, and shares of a cell between which a velocity or a load changes its sign once at most.
PIECE_NODES = 20
_SHARES = np.linspace(0.0, 1.0, 41)

#: Slope at a change of sign, as a share of the greatest value in the cell, that is rounding.
_FLAT = 1e-6

#: Steps of false position to where a sign changes.
_STEPS = 12

#: Longest cell as a multiple of the shortest time constant, and how many cells a segment may have.
_LONGEST, _MOST_CELLS = 0.5, 200


class Cells(NamedTuple):
    """C cells with M nodes each.

    Attributes:
        segment: numbers of the segments among those of all motions, row by row, shape (C,).
        begin: shares of the segments at which they begin, shape (C,).
        width: their shares of the segments, shape (C,).
        duration: shape (C,) [s].
        smooth: efforts without dry friction at the nodes, shape (C, M, n_joints) [N·m or N].
        rotor: torques of the rotors times the gear ratios [N·m or N].
        velocity: velocities of the joints [rad/s or m/s].
    """

    segment: Array
    begin: Array
    width: Array
    duration: Array
    smooth: Array
    rotor: Array
    velocity: Array


class MotorPieces(NamedTuple):
    """R pieces of single joints, in the order of motions, joints and time.

    Attributes:
        owner: numbers of motion and joint, motion x n_joints + joint, shape (R,).
        duration: shape (R,) [s].
        torque: torque of the motor times the gear ratio at the nodes, shape (R, M) [N·m or N].
    """

    owner: Array
    duration: Array
    torque: Array


def pieces_of(rollout: Rollout, motors: Motors, shortest: float = np.inf) -> MotorPieces:
    """The pieces of all joints.

    Args:
        rollout: B motions.
        motors: the motors of its robot.
        shortest: shortest time constant that temperatures follow with [s].
    """
    parts = [_pieces(rollout, motors, cells) for cells in cells_of(rollout, shortest)]
    owner, order, lower, duration, torque = (np.concatenate(x) for x in zip(*parts, strict=True))
    sorted_ = np.lexsort((lower, order, owner))
    return MotorPieces(owner[sorted_], duration[sorted_], torque[sorted_])


def cells_of(rollout: Rollout, shortest: float = np.inf) -> list[Cells]:
    """The segments of all motions in cells."""
    found = []
    for group in rollout.resolved_for_heat:
        size = len(group.nodes.shares)
        needed = 1 if size <= PIECE_NODES + 1 else 2
        long = np.ceil(group.durations.real / (_LONGEST * shortest))
        count = np.clip(long, needed, _MOST_CELLS).astype(np.intp)
        for parts in np.unique(count).tolist():
            found.append(_cells(rollout, group, np.flatnonzero(count == parts), parts))
    return found


def _cells(rollout: Rollout, group: Resolved, chosen: Array, parts: int) -> Cells:
    """Chosen segments of a group, each in as many cells."""
    begins = np.arange(parts) / parts
    shares = (begins[:, None] + gauss(PIECE_NODES)[0] / parts).reshape(-1)
    segment = group.segments[chosen]
    shape = (len(chosen) * parts, PIECE_NODES, rollout.robot.dof)
    smooth = np.matmul(group.nodes.onto(shares), group.values[chosen]).reshape(shape)
    trajectory = rollout.trajectory
    v, a = (
        trajectory.at_shares(shares, order).reshape(-1, len(shares), rollout.robot.dof)[segment].reshape(shape)
        for order in (1, 2)
    )
    durations = trajectory.segment_durations.reshape(-1)[segment].repeat(parts) / parts
    begin = np.tile(begins, len(chosen))
    rotor = rollout.robot.friction.armature * a
    return Cells(segment.repeat(parts), begin, np.full(len(begin), 1.0 / parts), durations, smooth, rotor, v)


def _pieces(rollout: Rollout, motors: Motors, cells: Cells) -> tuple[Array, Array, Array, Array, Array]:
    """Owners, places of cells in the motion, where pieces begin in them, durations, and torques at nodes."""
    dof, count = rollout.robot.dof, rollout.trajectory.segment_durations.shape[1]
    rows = cells.segment // count
    curves = [np.moveaxis(x, 2, 1).reshape(-1, PIECE_NODES) for x in (cells.smooth - cells.rotor, cells.rotor)]
    velocity = np.moveaxis(cells.velocity, 2, 1).reshape(-1, PIECE_NODES)
    joint = np.tile(np.arange(dof), len(rows))
    standing = rollout.standing[rows].reshape(-1)
    ones = np.ones(dof)
    dry = np.stack([rollout.robot.friction.dry(sign * ones) for sign in (-1.0, 0.0, 1.0)])
    cell, lower, upper = _split(rollout, motors, curves[0], velocity, dry[:, joint])
    whole = (lower.real == 0.0) & (upper.real == 1.0)
    load, rotor = (_within(curve, cell, lower, upper, whole) for curve in curves)
    middle = 0.5 * (lower + upper).real
    speed = _at(_coefficients(velocity.real)[cell], middle)
    way = np.where(np.abs(speed) <= standing[cell], 0.0, np.sign(speed)).astype(np.intp)
    load = load + dry[way + 1, joint[cell]][:, None]
    side = np.sign(_at(_coefficients(curves[0].real)[cell], middle) + dry[way + 1, joint[cell]]) * way
    factor = np.where(
        side > 0.0, 1.0 / motors.driving[joint[cell]], np.where(way == 0, 1.0, motors.driven[joint[cell]])
    )
    owner = rows[cell // dof] * dof + joint[cell]
    order = cells.segment[cell // dof] % count + cells.begin[cell // dof]
    duration = cells.duration[cell // dof] * (upper - lower)
    return owner, order, lower.real, duration, rotor + factor[:, None] * load


def _split(rollout: Rollout, motors: Motors, load: Array, velocity: Array, dry: Array) -> tuple[Array, Array, Array]:
    """Numbers of cells of single joints, and shares of these at which pieces begin and end, shape (R,) each."""
    count = len(load)
    number, zero = np.arange(count), np.zeros(count, dtype=load.dtype)
    if not (motors.lossy or rollout.robot.friction.is_dry):
        return number, zero, zero + 1.0
    changes = [_changes(velocity)]
    if motors.lossy:
        sides = (1.0, -1.0) if rollout.robot.friction.is_dry else (1.0,)
        changes += [_changes(load + dry[1 + int(side)][:, None]) for side in sides]
    at, share = (np.concatenate(x) for x in zip(*changes, strict=True))
    cell, lower = np.concatenate([number, at]), np.concatenate([zero, share])
    order = np.lexsort((lower.real, cell))
    cell, lower = cell[order], lower[order]
    last = np.append(cell[1:] != cell[:-1], True)
    upper = np.where(last, 1.0, np.append(lower[1:], 1.0))
    return cell, lower, upper


def _changes(values: Array) -> tuple[Array, Array]:
    """Numbers of the cells in which polynomials (K, M) change their sign, and where; complex as their derivatives."""
    seen = np.matmul(values.real[:, None, :], _matrices()[0])[:, 0]
    cell, before = np.nonzero(seen[:, :-1] * seen[:, 1:] < 0.0)
    left, right = _SHARES[before], _SHARES[before + 1]
    low, high = seen[cell, before], seen[cell, before + 1]
    chosen = _coefficients(values[cell])
    share: Array = left
    for _ in range(_STEPS):
        share = (left * high - right * low) / (high - low)
        here = _at(chosen.real, share)
        same = here * low > 0.0
        # The end that stays weighs half, so that both ends come near.
        high, low = np.where(same, 0.5 * high, here), np.where(same, here, 0.5 * low)
        left, right = np.where(same, share, left), np.where(same, right, share)
    if not np.iscomplexobj(values):
        return cell, share
    slope = _at(_coefficients(values[cell].real, slopes=True), share)
    # Where a joint comes to rest its velocity touches 0, and rounding alone makes it pass: such a place does not move.
    flat = np.abs(slope) <= _FLAT * np.abs(seen[cell]).max(axis=1)
    shift = np.where(flat, 0.0, _at(chosen, share).imag / np.where(flat, 1.0, slope))
    return cell, share - 1j * shift


def _within(values: Array, cell: Array, lower: Array, upper: Array, whole: Array) -> Array:
    """Polynomials through values (K, M) at the nodes of parts of them, shape (R, M)."""
    found = values[cell]
    parts = np.flatnonzero(~whole)
    if len(parts):
        shares = lower[parts, None] + (upper - lower)[parts, None] * gauss(PIECE_NODES)[0]
        found[parts] = _at(_coefficients(found[parts])[:, None, :], shares)
    return found


def _coefficients(values: Array, *, slopes: bool = False) -> Array:
    """Legendre coefficients of polynomials (R, M) or of their slopes, each by itself."""
    found: Array = np.matmul(values[:, None, :], _matrices()[2 if slopes else 1])[:, 0]
    return found


def _at(coefficients: Array, shares: Array) -> Array:
    """Values at shares (...) of polynomials with Legendre coefficients (..., M)."""
    found: Array = (np.polynomial.legendre.legvander(2.0 * shares - 1.0, PIECE_NODES - 1) * coefficients).sum(axis=-1)
    return found


@cache
def _matrices() -> tuple[Array, Array, Array]:
    """Matrices from values at the nodes to those at the shares looked at, to Legendre coefficients, and of slopes."""
    to_legendre = legendre(PIECE_NODES)[2]
    seen = (np.polynomial.legendre.legvander(2.0 * _SHARES - 1.0, PIECE_NODES - 1) @ to_legendre).T
    slopes = np.zeros_like(to_legendre)
    slopes[:-1] = 2.0 * np.polynomial.legendre.legder(to_legendre)
    return tuple(frozen(np.ascontiguousarray(x)) for x in (seen, to_legendre.T, slopes.T))  # type: ignore[return-value]
