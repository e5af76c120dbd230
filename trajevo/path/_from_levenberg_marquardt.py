"""Joint positions for poses of the tool from many starts, each with a pose of its own, all in one batch of arrays.

Levenberg-Marquardt steps, damped by the squared error that is left (Sugihara, IEEE Transactions on Robotics 27, 2011),
with joints held that a limit stops. What is met or no longer gets better leaves the batch.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, final

import numpy as np

from trajevo.arrays import Array, frozen, numbers
from trajevo.errors import InvalidInputError
from trajevo.kinematics import ToolKinematics
from trajevo.posture import TOLERANCE, JointRanges, check_search, missed, rotation_matrix
from trajevo.robot import Robot

#: Error at which a start leaves the batch as met: far below any tolerance, so that starts with one aim agree.
_SETTLED = 1e-11

#: Steps at most, and those in a row that may lessen the squared error by less than a share before a start is given up.
_STEPS, _STALLED, _PROGRESS = 60, 8, 1e-2

#: Damping over squared error: at first, and how it changes with a step taken or refused.
_DAMPING, _EASED, _TIGHTENED, _LEAST_DAMPING = 0.1, 0.3, 5.0, 1e-3

#: Keeps a singular system of equations solvable where no error is left.
_REGULAR = 1e-15

#: Rows per block, so that the arrays of a step stay in the processor's cache.
_BLOCK = 8192


def solve_postures(
    robot: Robot,
    positions: Any,
    rotation: Any,
    starts: Any,
    *,
    tolerance: float = TOLERANCE,
) -> tuple[Array, Array]:
    """Where starts lead that each aim at a pose of the tool, all of them at once.

    Args:
        robot: the robot whose tool and position limits count.
        positions: wanted position of the tool for every start, shape (N, 3) [m].
        rotation: wanted rotation matrix of all, shape (3, 3); None if any orientation will do.
        starts: joint positions, shape (N, n_joints) [rad or m]; those outside the limits are moved inside.
        tolerance: greatest error of position [m] and of orientation [rad].

    Returns:
        Joint positions inside the limits, shape (N, n_joints) [rad or m], and whether they meet the pose, (N,).

    Raises:
        InvalidInputError: shapes that do not fit, no rotation matrix, or numbers that are none.
    """
    check_search(0, 0, tolerance)
    wanted = numbers(positions, name="positions", shape=("N", 3))
    turned = None if rotation is None else rotation_matrix(rotation)
    begun = numbers(starts, name="starts", shape=("N", robot.dof))
    if len(begun) != len(wanted):
        raise InvalidInputError(f"starts: expected one per position ({len(wanted)}), got {len(begun)}")
    kinematics = ToolKinematics.of(robot)
    q, error = PostureSolver(kinematics, JointRanges.of(robot, kinematics), turned)(wanted, begun)
    return frozen(q), error <= tolerance


#: Joint positions with residual, Jacobian, squared and greatest error.
_State = tuple[Array, Array, Array, Array, Array]


@dataclass
class _Batch:
    """Starts under way: their numbers (N,), wanted positions (N, 3), joint positions (N, n_joints), residuals (N, E),
    Jacobians (N, E, n_joints), squared and greatest errors, damping and steps without progress (N,).
    """

    row: Array
    wanted: Array
    q: Array
    residual: Array
    jacobian: Array
    squared: Array
    greatest: Array
    damping: Array
    stalled: Array

    def keep(self, chosen: Array) -> None:
        """Drop all others."""
        for field in fields(self):
            setattr(self, field.name, getattr(self, field.name)[chosen])

    def take(self, other: _State, chosen: Array) -> None:
        """Joint positions and what follows from them, where chosen."""
        for name, values in zip(("q", "residual", "jacobian", "squared", "greatest"), other, strict=True):
            getattr(self, name)[chosen] = values[chosen]


@final
@dataclass(frozen=True, eq=False)
class PostureSolver:
    """Levenberg-Marquardt steps for one robot and orientation.

    Attributes:
        kinematics: of the tool.
        ranges: of the joints.
        rotation: wanted rotation matrix, shape (3, 3); None if any orientation will do.
    """

    kinematics: ToolKinematics
    ranges: JointRanges
    rotation: Array | None

    def __call__(self, wanted: Array, starts: Array) -> tuple[Array, Array]:
        """Where starts lead.

        Args:
            wanted: positions of the tool, shape (N, 3) [m].
            starts: joint positions, shape (N, n_joints) [rad or m].

        Returns:
            Joint positions inside the limits, shape (N, n_joints), and the greater of the errors of position [m] and
            of orientation [rad], shape (N,).
        """
        q, error = np.empty_like(starts), np.empty(len(starts))
        for first in range(0, len(starts), _BLOCK):
            self._solve(wanted[first : first + _BLOCK], starts[first : first + _BLOCK], q[first:], error[first:])
        return q, error

    def _solve(self, wanted: Array, starts: Array, q: Array, error: Array) -> None:
        """One block, into the first rows of ``q`` and ``error``."""
        count = len(starts)
        state = self._at(wanted, np.clip(starts, self.ranges.lower, self.ranges.upper))
        batch = _Batch(np.arange(count), wanted, *state, np.full(count, _DAMPING), np.zeros(count, dtype=np.int64))
        for _ in range(_STEPS):
            new = self._at(batch.wanted, self._stepped(batch))
            better = new[3] < batch.squared
            gained = new[3] < (1.0 - _PROGRESS) * batch.squared
            batch.damping = np.where(
                better, np.maximum(_EASED * batch.damping, _LEAST_DAMPING), _TIGHTENED * batch.damping
            )
            batch.stalled = np.where(gained, 0, batch.stalled + 1)
            batch.take(new, better)
            over = (batch.greatest <= _SETTLED) | (batch.stalled >= _STALLED)
            q[batch.row[over]], error[batch.row[over]] = batch.q[over], batch.greatest[over]
            batch.keep(~over)
            if not len(batch.row):
                return
        q[batch.row], error[batch.row] = batch.q, batch.greatest

    def _stepped(self, batch: _Batch) -> Array:
        """Where the damped normal equations lead, inside the limits; joints stay that a limit stops."""
        gradient = (batch.residual[:, None] @ batch.jacobian)[:, 0]
        held = (batch.q <= self.ranges.lower) & (gradient > 0.0) | (batch.q >= self.ranges.upper) & (gradient < 0.0)
        free = batch.jacobian * ~held[:, None]
        system = np.swapaxes(free, -1, -2) @ free
        diagonal = np.arange(system.shape[-1])
        system[:, diagonal, diagonal] += np.where(held, 1.0, (batch.damping * batch.squared + _REGULAR)[:, None])
        step = np.linalg.solve(system, np.where(held, 0.0, -gradient)[..., None])[..., 0]
        stepped: Array = np.clip(batch.q + step, self.ranges.lower, self.ranges.upper)
        return stepped

    def _at(self, wanted: Array, q: Array) -> _State:
        """Joint positions with residual, Jacobian, squared and greatest error.

        The rows of orientation are -Σ r × r*/2 over the columns of R and R*, and those of the geometric Jacobian: the
        normal equations are those of the nine numbers (R - R*)/√2, as Σ [r]ᵀ[r]/2 over an orthonormal frame is I.
        """
        position, rotation, jacobian = self.kinematics.pose_and_jacobian(q)
        distance, angle = missed(position, rotation, wanted, self.rotation)
        squared, greatest = distance**2 + 4.0 * np.sin(0.5 * angle) ** 2, np.maximum(distance, angle)
        if self.rotation is None:
            return q, position - wanted, jacobian[:, :3], squared, greatest
        turned = -0.5 * np.cross(rotation, self.rotation, axis=-2).sum(axis=-1)
        return q, np.concatenate([position - wanted, turned], axis=-1), jacobian, squared, greatest
