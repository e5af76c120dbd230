"""Instants of one motion, with what joints bear there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.base.shown.brief import brief
from trajevo.dynamics.payload_masses import NEGLIGIBLE
from trajevo.dynamics.rollout import Rollout


@final
@dataclass(frozen=True, eq=False)
class MotionStates:
    """States at K instants of the first trajectory of a rollout, each array of shape (K, n_joints) but two.

    Attributes:
        times: instants, shape (K,) [s].
        segments: segments in which they lie, shape (K,).
        q: positions [rad or m].
        v: velocities, mere rounding set to 0 [rad/s or m/s].
        a: accelerations [rad/s² or m/s²].
        load: what joints bear without payload: effort without that of the rotors [N·m or N].
        each: what a kilogram of payload adds to it, mere rounding set to 0 [N·m/kg or N/kg].
    """

    times: Array
    segments: Array
    q: Array
    v: Array
    a: Array
    load: Array
    each: Array

    __repr__ = brief

    @classmethod
    def at(cls, rollout: Rollout, times: Array) -> MotionStates:
        """At instants (K,) [s]; at a break those of the segment that begins there."""
        q, v, a = (rollout.trajectory.evaluate(times[None], order) for order in range(3))
        return cls._of(rollout, times, rollout.segments_at(times)[0], (q, v, a))

    @classmethod
    def of_samples(cls, rollout: Rollout) -> MotionStates:
        """At evenly spaced instants of every segment, twice where two segments meet."""
        shares, count = np.linspace(0.0, 1.0, rollout.dynamics.samples), len(rollout.trajectory.breaks[0]) - 1
        q, v, a = (rollout.trajectory.at_shares(shares, order) for order in range(3))
        begins, durations = rollout.trajectory.breaks[0, :-1, None], rollout.trajectory.segment_durations[0][:, None]
        times = (begins + durations * shares).reshape(-1)
        return cls._of(rollout, times, np.arange(count).repeat(len(shares)), (q, v, a))

    @classmethod
    def _of(cls, rollout: Rollout, times: Array, segments: Array, moving: tuple[Array, Array, Array]) -> MotionStates:
        q, v, a = moving[0], rollout.without_rounding(moving[1]), moving[2]
        load = rollout.dynamics.unloaded_effort(q, v, a, segments, axis=1) - rollout.robot.friction.armature * a
        each = rollout.dynamics.effort_per_kilogram(q, v, a, segments, axis=1)
        felt = np.abs(each)
        each = np.where(felt > NEGLIGIBLE * felt.max(initial=0.0), each, 0.0)
        return cls(*map(frozen, (times, segments, q[0], v[0], a[0], load[0], each[0])))
