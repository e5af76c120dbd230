"""How far two solids can move relative to each other within an interval of time.

A point p of a solid stays within max|p''| Δt²/8 of the straight line between where it is at both ends of the interval,
so that the solid moves at most as far as from one end to the other, and max|p''| Δt²/4. Two links that move together
may hardly move relative to each other: for them, the paths of the joints between them times their reach count if that
is less. An obstacle that moves adds the length of its own path.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.trajectory.batch import TrajectoryBatch

if TYPE_CHECKING:
    from trajevo.formulation.constraints.collision import Collision


@final
class Sweeps:
    """Bounds for a batch of motions.

    A bound has a column per link for obstacles that stand still, one per pair of links, and one per pair of a link and
    an obstacle that moves.

    To the bit, the bounds of an interval do not depend on other intervals; complex steps are kept.

    Args:
        collision: robot and scene.
        trajectory: the motions.

    Attributes:
        column: the column of every pair, shape (n_pairs,).
    """

    def __init__(self, collision: Collision, trajectory: TrajectoryBatch) -> None:
        self.bodies, own = collision.bodies, collision.bodies.count
        first, second = collision.ends.T
        inner = np.flatnonzero(second < own)
        moving = np.flatnonzero((second >= own) & (second < len(collision.bodies.radii)))
        self.column = first.copy()
        self.column[inner] = own + np.arange(len(inner))
        self.column[moving] = own + len(inner) + np.arange(len(moving))
        self._inner, self._moving = (first[inner], second[inner]), (first[moving], second[moving])
        joints = slice(collision.robot.dof)  # without the time
        lower, upper = (bound[..., joints] for bound in trajectory.extremes(0))
        peaks = [trajectory.segment_peaks(order)[..., joints] for order in (1, 2)]
        of_model, reached = map(self.bodies.coordinates.sizes, peaks), collision.solid_reach(lower, upper)
        self._bending, self._peak = _bending(self.bodies.turning, reached[:, None], *of_model), peaks[1]
        # Only between links, which may move together.
        self._reach = collision.reach(lower, upper)[:, inner] if len(inner) else np.empty((0, 0, collision.robot.dof))

    @property
    def need_velocities(self) -> bool:
        """Whether joint velocities matter: only between links, which may move together."""
        return bool(self._reach.shape[1])

    def travel(self, where: tuple[Array, Array], moved: Array, v: Array, dt: Array) -> Array:
        """How far the solids of each column can move relative to each other, shape (J, columns) [m].

        Args:
            where: motion and segment of each interval, (J,) each.
            moved: how far each solid is moved from one end to the other, see :meth:`Bodies.moved`, shape (J, G) [m].
            v: rates of states at both ends, within the segment, first those of the joints, shape (2, J, n_columns)
                [rad/s or m/s]; not looked at unless they are needed.
            dt: length of the interval, shape (J,) [s].
        """
        row, segment = where
        part = np.minimum(segment, self._peak.shape[1] - 1)
        single: Array = moved[:, : self.bodies.count] + self._bending[row, part] * (0.25 * dt * dt)[:, None]
        columns = [single]
        if self.need_velocities:
            straight = single[:, self._inner[0]] + single[:, self._inner[1]]
            # Joint by joint, so that the digits of an interval are its own.
            peak, reach = self._peak[row, part], self._reach[row]
            most = furthest(v[..., : peak.shape[1]], peak, dt[:, None])
            swept = sum(most[:, joint, None] * reach[:, :, joint] for joint in range(most.shape[1]))
            columns.append(np.where(swept.real < straight.real, swept, straight))
        if len(self._moving[0]):
            columns.append(single[:, self._moving[0]] + moved[:, self._moving[1]])
        return np.concatenate(columns, axis=1) if len(columns) > 1 else single


def furthest(v: Array, peak: Array, dt: Array) -> Array:
    """How far joints can move in an interval: |v| is at most both |v₀| + a τ and |v₁| + a (Δt - τ).

    Args:
        v: velocities at both ends, shape (2, ..., n_joints) [rad/s or m/s]; complex steps are kept.
        peak: greatest |acceleration| a, shape (..., n_joints) [rad/s² or m/s²].
        dt: length Δt of the interval, shape (..., 1) [s].

    Returns:
        Shape (..., n_joints) [rad or m].
    """
    speed = v * np.sign(v.real)
    most: Array = 0.5 * speed.sum(axis=0) * dt + 0.25 * peak * dt**2
    return most


def _bending(turning: Array, reach: Array, speed: Array, acceleration: Array) -> Array:
    """Bound of the acceleration of any point of G solids.

    Args:
        turning: which joints turn, shape (n_joints,).
        reach: bound of a point's speed per unit of joint speed, shape (..., G, n_joints) [m/rad or 1].
        speed: greatest joint speeds, shape (..., n_joints) [rad/s or m/s].
        acceleration: greatest joint accelerations, the same shape [rad/s² or m/s²].

    Returns:
        Shape (..., G) [m/s²].
    """
    v, a = speed[..., None, :], acceleration[..., None, :]
    # A joint's axis turns with the joints before it, and the arm turns around it: twice the product of both speeds.
    turns = np.where((reach.real > 0.0) & turning, v, 0.0)
    before = np.cumsum(turns, axis=-1) - turns
    bending: Array = (reach * (a + v * (turns + 2.0 * before))).sum(axis=-1)
    return bending
