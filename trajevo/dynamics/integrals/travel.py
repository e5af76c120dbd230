"""How far joints and tool travel, back and forth."""

from __future__ import annotations

import numpy as np

from trajevo.base import polynomials
from trajevo.base.arrays import Array
from trajevo.dynamics.integrals.resolved import Resolved, at_samples, resolve
from trajevo.dynamics.rollout import Rollout
from trajevo.robot.kinematics import ToolKinematics

#: Pieces of a segment over which a joint's travel is summed; in each a joint turns at most once.
_TRAVEL_PIECES = 32
#: Chords of a segment whose lengths are summed.
_CHORDS = 128
#: Share of the path in a segment, or on average in the motion's segments, that the polynomials may leave out.
_LEFT_OUT = 2e-5


def joint_travel(rollout: Rollout) -> Array:
    """Σ over joints of ∫ |v| dt, shape (B,) [rad or m].

    It is the sum of steps between the positions at 33 instants of every segment and where joints turn between them.
    """
    trajectory, shares = rollout.trajectory, np.linspace(0.0, 1.0, _TRAVEL_PIECES + 1)
    size = (trajectory.segment_durations.size, len(shares), -1)
    q, v = (trajectory.at_shares(shares, k).reshape(size) for k in range(2))
    spans = trajectory.segment_durations.reshape(-1) / _TRAVEL_PIECES
    step = np.diff(q, axis=1)
    step *= np.sign(step.real)
    turns = v.real[:, :-1] * v.real[:, 1:] < 0.0
    if turns.any():
        segment, piece, joint = np.nonzero(turns)
        ends = [x for k in (piece, piece + 1) for x in (q[segment, k, joint], v[segment, k, joint] * spans[segment])]
        position = polynomials.cubic(*ends)
        turn = polynomials.crossing(polynomials.derivative(position).real, np.zeros(len(piece)), np.ones(len(piece)))
        at = polynomials.values(position, turn)
        back, forth = at - ends[0], ends[2] - at
        step[turns] = back * np.sign(back.real) + forth * np.sign(forth.real)
    total: Array = step.sum(axis=(1, 2)).reshape(len(trajectory), -1).sum(axis=1)
    return total


def tool_path_length(rollout: Rollout) -> Array:
    """∫ |velocity of the tool's origin| dt, shape (B,) [m]: the length of its path, chord by chord."""
    kinematics, trajectory = ToolKinematics.of(rollout.robot), rollout.trajectory

    def position(_: Array, q: Array, v: Array, a: Array) -> Array:
        return kinematics.pose(q)[0]

    def left_out(group: Resolved) -> Array:
        missing: Array = group.last_terms.sum(axis=1)
        return missing

    states = rollout.q, rollout.v, rollout.a
    first = at_samples(trajectory, rollout.dynamics.samples, states, kinematics.pose(rollout.q)[0])
    length = _chords(first.values).real
    shared = length.reshape(len(trajectory), -1).mean(axis=1).repeat(trajectory.segment_durations.shape[1])
    per_segment = np.empty(trajectory.segment_durations.shape, dtype=first.values.dtype)
    shares = np.linspace(0.0, 1.0, _CHORDS + 1)
    for group in resolve(
        first, trajectory, position, left_out=left_out, allowed=_LEFT_OUT * np.maximum(length, shared)
    ):
        points = np.matmul(group.nodes.onto(shares), group.values)
        fine, coarse = _chords(points), _chords(points[:, ::2])
        # Chords are too short by the square of their number, where the path bends: this takes it off.
        per_segment.reshape(-1)[group.segments] = fine + (fine - coarse) / 3.0
    total: Array = per_segment.sum(axis=1)
    return total


def _chords(points: Array) -> Array:
    """Sum of the distances between consecutive points (P, T, 3), shape (P,) [m]."""
    step = np.diff(points, axis=1)
    # Without abs, which would drop complex steps.
    length: Array = np.sqrt((step * step).sum(axis=2)).sum(axis=1)
    return length
