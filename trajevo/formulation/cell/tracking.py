"""Joint positions for many tool poses at once, each from a start near its own posture, with exact derivatives.

The steps are those of Levenberg and Marquardt with a damping that falls with the error (Yamashita and Fukushima,
Computing Supplement 15, 2001), so that they converge quadratically where a pose is reached, and settle at the nearest
posture where it is not. Every operation is analytic and every row goes its own way: complex starts or poses give exact
derivatives, and the bits of a row do not depend on the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from trajevo.base import jit
from trajevo.base.arrays import Array, read_only
from trajevo.base.shown.brief import brief
from trajevo.formulation.cell import tracking_loops
from trajevo.path.inverse_kinematics import Pose
from trajevo.robot.kinematics import ToolKinematics, crossed
from trajevo.robot.transmission import Direct

#: Greatest number of steps, and the squared error below which a row needs one more [m² and rad²].
_STEPS, _SETTLED = 30, 1e-16

#: Share of the square by which the error of a row that is not reached must fall in a step, or the row is given up.
_STALLED = 1e-4

#: Damping of J Jᵀ per error, and its least value.
_DAMPING, _LEAST_DAMPING = 0.1, 1e-14

#: Length that no step exceeds [rad or m].
_LONGEST = 0.5


@final
@dataclass(frozen=True, eq=False)
class PoseTargets:
    """Wanted poses of the tool, N of them.

    Attributes:
        position: positions, shape (N, 3) [m].
        rotation: rotation matrices, shape (N, 3, 3); the identity where any orientation is right.
        axis: unit axis of the tool about which it may be turned, shape (N, 3); 0 where none is free.
        turned: 1 where the orientation matters, else 0, shape (N,).
    """

    position: Array
    rotation: Array
    axis: Array
    turned: Array

    __repr__ = brief

    @classmethod
    def of(cls, poses: Sequence[Pose]) -> PoseTargets:
        """The targets of poses."""
        return cls(
            read_only(np.array([pose.position for pose in poses])),
            read_only(np.array([np.eye(3) if pose.rotation is None else pose.rotation for pose in poses])),
            read_only(np.array([np.zeros(3) if pose.free_axis is None else pose.free_axis for pose in poses])),
            read_only(np.array([float(pose.rotation is not None) for pose in poses])),
        )

    def chosen(self, rows: Array) -> PoseTargets:
        """Those of some rows."""
        return PoseTargets(self.position[rows], self.rotation[rows], self.axis[rows], self.turned[rows])


def tracked(
    kinematics: ToolKinematics, starts: Array, targets: PoseTargets, *, steps: int = _STEPS
) -> tuple[Array, Array]:
    """Joint positions that bring the tool to poses, or as near as it gets from starts near them.

    Joint limits are not looked at. A redundant arm goes by the shortest steps.

    Args:
        kinematics: of the tool.
        starts: joint positions, shape (N, n_joints) [rad or m].
        targets: N poses.
        steps: greatest number of steps.

    Returns:
        Joint positions, shape (N, n_joints) [rad or m], and how far the tool misses the poses, see :func:`pose_errors`.
    """
    kind = np.result_type(starts, targets.position, targets.rotation)
    if kind == np.float64 and jit.can_compile() and isinstance(kinematics.transmission, Direct):
        return _by_loops(kinematics, starts, targets, steps)
    q = starts.astype(kind)
    rows, before = np.arange(len(q)), np.full(len(q), np.inf)
    for _ in range(steps):
        own = targets if len(rows) == len(q) else targets.chosen(rows)
        error, slopes = _error_and_slopes(kinematics, q[rows], own)
        squared = (error * error).sum(axis=1)
        step = _damped(slopes, error, squared)
        length = (step * step).sum(axis=1, keepdims=True)
        q[rows] += step / np.sqrt(1.0 + length / _LONGEST**2)
        left = (squared.real > _SETTLED) & ~((squared.real < before) & (squared.real > (1.0 - _STALLED) * before))
        rows, before = rows[left], squared.real[left]
        if not len(rows):
            break
    return q, pose_errors(kinematics, q, targets)


def _by_loops(kinematics: ToolKinematics, starts: Array, targets: PoseTargets, steps: int) -> tuple[Array, Array]:
    q, missed = starts.copy(), np.empty((len(starts), 2))
    of_tool = kinematics.tool_rotation, kinematics.tool_translation
    numbers = np.array([_DAMPING, _LEAST_DAMPING, _LONGEST, _SETTLED, _STALLED])
    tracking_loops.track(
        targets.position,
        targets.rotation.reshape(-1, 9),
        targets.axis,
        targets.turned,
        np.array(kinematics.chain, dtype=np.int64),
        kinematics.rotations,
        kinematics.translations,
        kinematics.axes,
        np.array(kinematics.turns),
        *of_tool,
        steps,
        numbers,
        q,
        missed,
    )
    return q, missed


def pose_errors(kinematics: ToolKinematics, q: Array, targets: PoseTargets) -> Array:
    """How far the tool misses poses: distance [m] and chord 2 sin(θ/2) of the angle [rad], (N, 2).

    Args:
        kinematics: of the tool.
        q: joint positions, shape (N, n_joints) [rad or m].
        targets: N poses.
    """
    position, rotation = kinematics.pose(q)
    away = position - targets.position
    whole = 0.5 * np.square(rotation - targets.rotation).sum(axis=(1, 2))
    directions = [(each * targets.axis[:, None]).sum(axis=-1) for each in (rotation, targets.rotation)]
    along = np.square(directions[0] - directions[1]).sum(axis=1)
    turned = np.where(targets.axis.any(axis=1), along, whole) * targets.turned
    missed: Array = np.sqrt(np.stack([np.square(away).sum(axis=1), turned], axis=1))
    return missed


def _error_and_slopes(kinematics: ToolKinematics, q: Array, targets: PoseTargets) -> tuple[Array, Array]:
    """What is left to the poses, (N, 6), and the Jacobians that tell how it falls, (N, 6, n_joints)."""
    position, rotation, jacobian = kinematics.pose_and_jacobian(q)
    error = np.empty((len(q), 6), dtype=q.dtype)
    error[:, :3] = targets.position - position
    columns = np.swapaxes(rotation, 1, 2), np.swapaxes(targets.rotation, 1, 2)
    error[:, 3:] = 0.5 * crossed(*columns).sum(axis=1)  # sin(θ) times the axis of the rotation left
    free = np.flatnonzero(targets.axis.any(axis=1))
    if len(free):
        own = targets.axis[free, None]
        along, wanted = ((each[free] * own).sum(axis=-1) for each in (rotation, targets.rotation))
        error[free, 3:] = crossed(along, wanted)
        turning = jacobian[free, 3:]
        jacobian[free, 3:] = turning - along[:, :, None] * (along[:, :, None] * turning).sum(axis=1, keepdims=True)
    if not targets.turned.all():
        error[:, 3:] *= targets.turned[:, None]
        jacobian[:, 3:] *= targets.turned[:, None, None]
    return error, jacobian


def _damped(slopes: Array, error: Array, squared: Array) -> Array:
    transposed = np.swapaxes(slopes, 1, 2)
    system = slopes @ transposed
    diagonal = np.arange(6)
    system[:, diagonal, diagonal] += (_DAMPING * np.sqrt(squared) + _LEAST_DAMPING)[:, None]
    step: Array = (transposed @ np.linalg.solve(system, error[..., None]))[..., 0]
    return step
