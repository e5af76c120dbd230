"""Joint positions for tool poses from many starts, each with its own pose, all in one batch of arrays.

Levenberg-Marquardt steps, damped by the remaining squared error (Sugihara, IEEE Transactions on Robotics 27, 2011).
Joints that would leave their limits are held at them. A start leaves the batch when its pose is reached or its error
stops falling. The orientation error is the chord 2 sin(θ/2) = |R - R*|/√2, which, unlike the rotation vector, is smooth
up to θ = π.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, numbers, read_only
from trajevo.errors import InvalidInputError
from trajevo.path.rotations import made_orthogonal
from trajevo.robot.kinematics import ToolKinematics, crossed
from trajevo.robot.robot import Robot

#: Greatest error of position [m] and of orientation [rad] with which a pose counts as reached.
TOLERANCE = 1e-6

#: How far a rotation matrix or a quaternion may be from unit length.
ROUNDED = 1e-3

_TURN = 2.0 * np.pi


@final
@dataclass(frozen=True, eq=False)
class JointRanges:
    """Position limits of a robot for a search; made by :meth:`of`.

    Attributes:
        lower: lower position limits, shape (n_joints,) [rad or m].
        upper: upper position limits, shape (n_joints,) [rad or m].
        low: lower ends of the box from which starts are drawn, shape (n_joints,) [rad or m]; where a range has no end,
            the box extends over a whole turn (2π rad, or the same number of metres).
        high: upper ends of this box, shape (n_joints,) [rad or m].
        turning: mask of the joints for which a whole turn yields the same pose of the tool, shape (n_joints,).
    """

    lower: Array
    upper: Array
    low: Array
    high: Array
    turning: Array

    @classmethod
    def of(cls, robot: Robot, kinematics: ToolKinematics) -> JointRanges:
        """The ranges of a robot; the kinematics of its tool tell which joints are revolute."""
        lower, upper = robot.limits.lower, robot.limits.upper
        low = np.where(np.isfinite(lower), lower, np.where(np.isfinite(upper), upper - _TURN, -np.pi))
        high = np.where(np.isfinite(upper), upper, low + _TURN)
        middle = 0.5 * (low + high)
        turned = kinematics.pose(middle + _TURN * np.eye(robot.dof))
        apart = [
            np.abs(there - here).reshape(robot.dof, -1).max(axis=1)
            for there, here in zip(turned, kinematics.pose(middle), strict=True)
        ]
        turning: Array = np.maximum(*apart) < 1e-9
        turning.setflags(write=False)
        return cls(read_only(lower), read_only(upper), read_only(low), read_only(high), turning)

    @property
    def middle(self) -> Array:
        """Middle of the box, shape (n_joints,) [rad or m]."""
        middle: Array = 0.5 * (self.low + self.high)
        return middle

    def random(self, generator: np.random.Generator, count: int) -> Array:
        """Joint positions, uniformly distributed in the box, shape (count, n_joints) [rad or m]."""
        return generator.uniform(self.low, self.high, (count, len(self.low)))

    def around(self, q: Array, reach: float) -> JointRanges:
        """The part of the ranges and of the box within a distance of joint positions (n_joints,), for each joint."""
        lower, upper = read_only(np.maximum(self.lower, q - reach)), read_only(np.minimum(self.upper, q + reach))
        return replace(self, lower=lower, upper=upper, low=lower, high=upper)

    def unwound(self, q: Array, near: Array) -> Array:
        """Joint positions shifted by whole turns so that every joint is nearest to other positions, within the limits.

        Args:
            q: joint positions within the limits, shape (..., n_joints) [rad or m].
            near: the other joint positions, shape (n_joints,) [rad or m].
        """
        turns = np.where(self.turning, np.rint((near - q) / _TURN), 0.0)
        least, most = np.ceil((self.lower - q) / _TURN), np.floor((self.upper - q) / _TURN)
        shifted = q + _TURN * np.clip(turns, np.minimum(least, 0.0), np.maximum(most, 0.0))
        unwound: Array = np.clip(shifted, self.lower, self.upper)  # rounding can put a joint just beyond its limit
        return unwound


def missed(
    position: Array, rotation: Array, wanted: Array, wanted_rotation: Array | None, free: Array | None = None
) -> tuple[Array, Array]:
    """Errors of tool poses.

    Args:
        position: positions of the tools, shape (N, 3) [m].
        rotation: rotation matrices of the tools, shape (N, 3, 3).
        wanted: wanted positions, shape (3,) or (N, 3) [m].
        wanted_rotation: wanted rotation matrices, shape (3, 3) or (N, 3, 3); None for any orientation.
        free: unit axis in the tool's frame about which the tool may be turned, shape (3,); None for none.

    Returns:
        Errors of position [m] and of orientation [rad], shape (N,) each.
    """
    distance: Array = np.linalg.norm(position - wanted, axis=-1)
    if wanted_rotation is None:
        return distance, np.zeros_like(distance)
    if free is not None:
        half = 0.5 * np.linalg.norm((rotation * free).sum(axis=-1) - (wanted_rotation * free).sum(axis=-1), axis=-1)
        return distance, 2.0 * np.arcsin(np.minimum(half, 1.0))
    half = np.linalg.norm((rotation - wanted_rotation).reshape(-1, 9), axis=1) / np.sqrt(8.0)
    return distance, 2.0 * np.arcsin(np.minimum(half, 1.0))


def rotation_matrix(values: Any, name: str = "rotation") -> Array:
    """A rotation matrix, made orthogonal, since typed numbers are rounded.

    Args:
        values: shape (3, 3).
        name: name of the argument, for the message.

    Raises:
        InvalidInputError: another shape, or not a rotation matrix.
    """
    given = numbers(values, name=name, shape=(3, 3))
    if np.abs(given @ given.T - np.eye(3)).max() > ROUNDED or np.linalg.det(given) < 0.0:
        raise InvalidInputError(f"{name}: expected a rotation matrix, got {given.tolist()}")
    return read_only(made_orthogonal(given))


def check_search(starts: int, seed: int, tolerance: float) -> None:
    """Refuse invalid numbers for a search.

    Raises:
        InvalidInputError: starts or seed that are not whole numbers from 0 on, or a tolerance that is not positive.
    """
    for name, value in (("starts", starts), ("seed", seed)):
        if not isinstance(value, int | np.integer) or isinstance(value, bool) or value < 0:
            raise InvalidInputError(f"{name}: expected a whole number from 0 on, got {value!r}")
    if not (isinstance(tolerance, int | float) and 0.0 < tolerance < np.inf):
        raise InvalidInputError(f"tolerance: expected a positive number [m and rad], got {tolerance!r}")


#: Error at which a start leaves the batch as solved: far below any tolerance, so that results for one posture agree.
SETTLED = 1e-11

#: Greatest number of steps. A start is given up after so many steps in a row that each reduce the squared error by less
#: than this share.
_STEPS, _STALLED, _PROGRESS = 60, 8, 1e-2


#: Damping over squared error: initial value, factors after an accepted and a rejected step, and least value.
_DAMPING, _EASED, _TIGHTENED, _LEAST_DAMPING = 0.1, 0.3, 5.0, 1e-3


#: Regularisation that keeps a singular system of equations solvable without remaining error.
_REGULAR = 1e-15

#: Rows per block, so that the arrays of a step stay in the processor's cache.
_BLOCK = 8192

#: Joint positions with residual, Jacobian, squared and greatest error.
_State = tuple[Array, Array, Array, Array, Array]


@dataclass
class _Batch:
    """Unfinished starts: their indices (N,), wanted positions (N, 3), joint positions (N, n_joints), residuals (N, E),
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
        """Keep the chosen starts and drop all others."""
        for field in fields(self):
            setattr(self, field.name, getattr(self, field.name)[chosen])

    def take(self, other: _State, chosen: Array) -> None:
        """Take over new joint positions, with their residuals, Jacobians and errors, for the chosen starts."""
        for name, values in zip(("q", "residual", "jacobian", "squared", "greatest"), other, strict=True):
            getattr(self, name)[chosen] = values[chosen]


@final
@dataclass(frozen=True, eq=False)
class PostureSolver:
    """Levenberg-Marquardt solver for one robot and orientation.

    Attributes:
        kinematics: kinematics of the tool.
        ranges: ranges of the joints.
        rotation: wanted rotation matrix, shape (3, 3); None for any orientation.
        free: unit axis in the tool's frame about which the tool may be turned, shape (3,); None for none.
    """

    kinematics: ToolKinematics
    ranges: JointRanges
    rotation: Array | None
    free: Array | None = None

    def __call__(self, wanted: Array, starts: Array) -> tuple[Array, Array]:
        """The joint positions found from starts.

        Args:
            wanted: wanted positions of the tool, shape (N, 3) [m].
            starts: joint positions, shape (N, n_joints) [rad or m].

        Returns:
            Joint positions within the limits, shape (N, n_joints) [rad or m], and the greater of the errors of position
            [m] and of orientation [rad], shape (N,).
        """
        q, error = np.empty_like(starts), np.empty(len(starts))
        for first in range(0, len(starts), _BLOCK):
            self._solve(wanted[first : first + _BLOCK], starts[first : first + _BLOCK], q[first:], error[first:])
        return q, error

    def _solve(self, wanted: Array, starts: Array, q: Array, error: Array) -> None:
        """Solve one block and write the results into ``q`` and ``error``."""
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
            over = (batch.greatest <= SETTLED) | (batch.stalled >= _STALLED)
            q[batch.row[over]], error[batch.row[over]] = batch.q[over], batch.greatest[over]
            batch.keep(~over)
            if not len(batch.row):
                return
        q[batch.row], error[batch.row] = batch.q, batch.greatest

    def _stepped(self, batch: _Batch) -> Array:
        """Result of a step by the damped normal equations, within the limits; joints stopped by a limit stay there."""
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

        The orientation residual is -Σ r × r*/2 over the columns r of R and r* of R*, with the rows of the geometric
        Jacobian. The normal equations are those of the nine numbers (R - R*)/√2, since Σ [r]ᵀ[r]/2 over an orthonormal
        frame is I. With a free axis it is the difference of the two directions of this axis.
        """
        position, rotation, jacobian = self.kinematics.pose_and_jacobian(q)
        distance, angle = missed(position, rotation, wanted, self.rotation, self.free)
        squared, greatest = distance**2 + 4.0 * np.sin(0.5 * angle) ** 2, np.maximum(distance, angle)
        if self.rotation is None:
            return q, position - wanted, jacobian[:, :3], squared, greatest
        if self.free is not None:
            axis = (rotation * self.free).sum(axis=-1)
            residual = np.concatenate([position - wanted, axis - (self.rotation * self.free).sum(axis=-1)], axis=-1)
            slopes = crossed(
                np.swapaxes(jacobian[:, 3:], 1, 2), np.broadcast_to(axis[:, None], (len(q), q.shape[1], 3))
            )
            rows = np.concatenate([jacobian[:, :3], np.swapaxes(slopes, 1, 2)], axis=1)
            return q, residual, rows, squared, greatest
        turned = -0.5 * crossed(np.swapaxes(rotation, -1, -2), self.rotation.T).sum(axis=-2)
        return q, np.concatenate([position - wanted, turned], axis=-1), jacobian, squared, greatest
