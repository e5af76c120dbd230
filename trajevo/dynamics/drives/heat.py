"""Mean squares of motors' torques, and temperatures of their windings, over cycles of B motions that repeat.

A winding warms up by τ dΔ/dt = ρ u - Δ with the square u of its motor's torque. Over a smooth piece the response to u
is an integral by quadrature; from piece to piece, and from cycle to cycle, what is left of it falls exponentially.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

from trajevo.base import polynomials
from trajevo.base.arrays import Array, frozen
from trajevo.dynamics.drives.cycle import legendre, response_matrices
from trajevo.dynamics.drives.duty import Duty
from trajevo.dynamics.drives.motors import Motors
from trajevo.dynamics.drives.pieces import PIECE_NODES, MotorPieces, pieces_of
from trajevo.dynamics.rollout import Rollout
from trajevo.trajectory.bernstein import gauss

#: Evenly spaced instants of every piece at which temperatures are looked at; between them they are cubics.
_LOOKED_AT = np.linspace(0.0, 1.0, 33)

#: To what share of themselves mean squares and temperatures are resolved, as tests against fine integrations show.
RESOLVED = 1e-6


def rms_torques(rollout: Rollout, duty: Duty) -> Array:
    """Root of the mean square of every motor's torque times its gear ratio over a cycle, (B, n_joints) [N·m or N]."""
    motors = Motors.of(rollout)
    timeline = _Timeline.of(pieces_of(rollout, motors), rollout)
    total = timeline.summed(timeline.duration * _weighed(timeline.square))
    period = rollout.trajectory.duration[:, None] + duty.dwell
    rms: Array = np.sqrt((total + duty.dwell * _held(rollout, motors, duty)) / period)
    return rms


def greatest_rises(rollout: Rollout, duty: Duty) -> Array:
    """Greatest temperature of every winding above its surroundings in the last cycle, shape (B, n_joints) [K].

    NaN for drives of which the temperature cannot be told.
    """
    motors = Motors.of(rollout)
    known = np.array([not drive.lacking_for_heat for drive in motors.drives])
    drives = list(zip(motors.drives, known, strict=True))
    constants = np.array([(drive.thermal_time_constant if ok else None) or np.inf for drive, ok in drives])
    per_square = np.array([drive.rise_per_square if ok else np.nan for drive, ok in drives])
    pieces = pieces_of(rollout, motors, float(constants.min(initial=np.inf)))
    timeline = _Timeline.of(pieces, rollout)
    finite = np.where(known, constants, 1.0)
    found: Array = per_square * _hottest(timeline, finite, duty, rollout, _held(rollout, motors, duty))
    return found


class _Timeline(NamedTuple):
    """MotorPieces of all joints of B motions, each joint's one after another, the L-th of all together.

    Attributes:
        duration: shape (L, B x n_joints), 0 where a joint has no such piece [s].
        square: squares of torques at the nodes, shape (L, B x n_joints, M) [(N·m)² or N²].
        there: whether a joint has such a piece, shape (L, B x n_joints).
        shape: B and n_joints.
    """

    duration: Array
    square: Array
    there: Array
    shape: tuple[int, int]

    @classmethod
    def of(cls, pieces: MotorPieces, rollout: Rollout) -> _Timeline:
        """From pieces in the order of motions, joints and time."""
        shape = (len(rollout.trajectory), rollout.robot.dof)
        columns = shape[0] * shape[1]
        first = np.searchsorted(pieces.owner, np.arange(columns))
        number = np.arange(len(pieces.owner)) - first[pieces.owner]
        count = int(number.max(initial=0)) + 1
        duration = np.zeros((count, columns), dtype=pieces.duration.dtype)
        square = np.zeros((count, columns, PIECE_NODES), dtype=pieces.torque.dtype)
        there = np.zeros((count, columns), dtype=bool)
        place = number, pieces.owner
        duration[place], square[place], there[place] = pieces.duration, pieces.torque**2, True
        return cls(duration, square, there, shape)

    def summed(self, values: Array) -> Array:
        """Sum of values (L, B x n_joints) over the pieces, (B, n_joints), one after another: no digit tells L."""
        total: Array = np.zeros_like(values[0])
        for row in values:
            total = total + row
        return np.asarray(total.reshape(self.shape))


def _weighed(values: Array) -> Array:
    """Averages over pieces from values at their nodes, (..., M) -> (...)."""
    weights = gauss(PIECE_NODES)[1]
    total: Array = weights[0] * values[..., 0]
    for k in range(1, PIECE_NODES):
        total = total + weights[k] * values[..., k]
    return total


def _held(rollout: Rollout, motors: Motors, duty: Duty) -> Array:
    """Square of every motor's torque times the gear ratio while it stands where the motion ends, (B, n_joints)."""
    if duty.dwell == 0.0:
        return np.zeros((len(rollout.trajectory), rollout.robot.dof))
    end = rollout.trajectory.duration[:, None]
    q = rollout.trajectory.at_shares(np.ones(1), 0)[:, -1:]
    still = np.zeros_like(q)
    torque: Array = rollout.effort_in(q, still, still, end.real)[:, 0]
    braked = np.array([drive.brake for drive in motors.drives])
    return np.where(braked, 0.0, torque**2)


def _hottest(timeline: _Timeline, constants: Array, duty: Duty, rollout: Rollout, held: Array) -> Array:
    """The greatest response to squares of torques in the last cycle, shape (B, n_joints)."""
    batch, dof = timeline.shape
    tau = np.broadcast_to(constants, (batch, dof)).reshape(-1)
    shares = timeline.duration / tau
    added = np.zeros((*timeline.duration.shape, len(_LOOKED_AT)), dtype=timeline.square.dtype)
    where = timeline.there
    matrices = response_matrices(shares[where], _LOOKED_AT, PIECE_NODES)
    added[where] = (matrices * timeline.square[where][:, None, :]).sum(axis=-1)
    left = np.exp(-shares)
    cold = [np.zeros(batch * dof, dtype=added.dtype)]
    for k in range(len(shares)):
        cold.append(left[k] * cold[-1] + added[k, :, -1])
    rest, still = duty.dwell / tau, held.reshape(-1)
    end = np.exp(-rest) * cold[-1] - np.expm1(-rest) * still
    period = (rollout.trajectory.duration + duty.dwell).repeat(dof) / tau
    begin = end * _kept(period, duty.cycles)
    begins = [begin]
    for k in range(len(shares)):
        begins.append(left[k] * begins[-1] + added[k, :, -1])
    looked = added + np.stack(begins[:-1])[..., None] * np.exp(-shares[..., None] * _LOOKED_AT)
    last = np.exp(-rest) * begins[-1] - np.expm1(-rest) * still
    return _peaks(timeline, looked, shares, np.stack([begin, last])).reshape(timeline.shape)


def _kept(period: Array, cycles: int | None) -> Array:
    """What is left at the begin of the last cycle of what one cycle adds, over that of all cycles before it.

    ``expm1`` takes no complex steps; with the period p in time constants the derivative is that of the closed form.
    """
    real = period.real
    if cycles is None:
        value, slope = -1.0 / np.expm1(-real), -np.exp(-real) / np.expm1(-real) ** 2
    else:
        many = cycles - 1
        value = np.expm1(-many * real) / np.expm1(-real)
        slope = (-many * np.exp(-many * real) + value * np.exp(-real)) / np.expm1(-real)
    kept: Array = value + slope * (period - real) if np.iscomplexobj(period) else value
    return kept


def _peaks(timeline: _Timeline, looked: Array, shares: Array, ends: Array) -> Array:
    """Greatest response, at the instants looked at and at the tops of the cubics between them, (B x n_joints,)."""
    onto = _onto()
    square = np.matmul(timeline.square, onto.T)
    step = (_LOOKED_AT[1] - _LOOKED_AT[0]) * shares[..., None]
    slopes = (square - looked) * step
    tops = np.where(timeline.there[..., None], looked, -np.inf)
    inside = (slopes.real[..., :-1] > 0.0) & (slopes.real[..., 1:] < 0.0) & timeline.there[..., None]
    between = np.full(inside.shape, -np.inf, dtype=looked.dtype)
    if inside.any():
        first, last = looked[..., :-1][inside], looked[..., 1:][inside]
        cubics = polynomials.cubic(first, slopes[..., :-1][inside], last, slopes[..., 1:][inside])
        between[inside] = polynomials.extremes(cubics, 1)[1][0]
    everything = np.concatenate([tops, between], axis=-1)
    rows = np.concatenate([np.moveaxis(everything, 1, 0).reshape(looked.shape[1], -1), ends.T], axis=1)
    best: Array = np.take_along_axis(rows, rows.real.argmax(axis=1)[:, None], axis=1)[:, 0]
    return best


@cache
def _onto() -> Array:
    """Matrix from values at a piece's nodes to those at the instants looked at."""
    return frozen(np.polynomial.legendre.legvander(2.0 * _LOOKED_AT - 1.0, PIECE_NODES - 1) @ legendre(PIECE_NODES)[2])
