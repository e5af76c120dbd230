"""Boxes in which a via point may move, and joint positions for a tool that moves inside one."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, numbers, read_only
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError
from trajevo.robot.kinematics import ToolKinematics

#: Number of Newton steps to a moved pose; from a few decimetres away, six are enough.
_STEPS = 12

#: Damping of J Jᵀ [m² or rad²], which keeps a step finite where the arm is singular.
_DAMPING = 1e-8

#: Length that no Newton step exceeds [rad or m].
_LONGEST = 0.5


@final
@dataclass(frozen=True, eq=False)
class JointBox:
    """A box in joint space in which a via point may move.

    Attributes:
        point: index of the point, from 0.
        half_width: how far each joint may move to either side, shape (n_joints,) [rad or m]; 0 fixes a joint.

    Raises:
        InvalidInputError: not an index, or widths that are negative or all 0.
    """

    point: int
    half_width: Array

    __repr__ = brief

    def __post_init__(self) -> None:
        _check(self, ("n_joints",))


@final
@dataclass(frozen=True, eq=False)
class CartesianBox:
    """A box along the axes of the base frame in which the tool may move at a via point.

    Attributes:
        point: index of the point, from 0.
        half_width: how far the tool may move to either side, shape (3,) [m]; 0 fixes a coordinate.
        keep_orientation: whether the tool keeps its orientation at the point; an arm of fewer than six joints mostly
            cannot.

    Raises:
        InvalidInputError: not an index, or widths that are negative or all 0.
    """

    point: int
    half_width: Array
    keep_orientation: bool = field(default=True, kw_only=True)

    __repr__ = brief

    def __post_init__(self) -> None:
        _check(self, (3,))


def followed(kinematics: ToolKinematics, start: Array, position: Array, rotation: Array | None) -> Array:
    """Joint positions that bring the tool to positions near its start, by a fixed number of damped Newton steps.

    Every operation is analytic, including the limit on a step's length, so complex positions give exact derivatives. A
    row that does not converge is left where the last step took it.

    Args:
        kinematics: of the tool.
        start: joint positions, shape (n_joints,) [rad or m].
        position: wanted positions of the tool, shape (B, 3) [m].
        rotation: orientation to keep, shape (3, 3), or None.

    Returns:
        Shape (B, n_joints) [rad or m].
    """
    q = start + np.zeros((len(position), 1), dtype=position.dtype)
    rows = 3 if rotation is None else 6
    for _ in range(_STEPS):
        at, turned, jacobian = kinematics.pose_and_jacobian(q)
        error = position - at
        if rotation is not None:
            axis = 0.5 * np.cross(turned, rotation, axis=-2).sum(axis=-1)  # sin(θ) times the axis of the rotation left
            error = np.concatenate([error, axis], axis=-1)
        slopes = jacobian[:, :rows]
        transposed = np.swapaxes(slopes, 1, 2)
        step = (transposed @ np.linalg.solve(slopes @ transposed + _DAMPING * np.eye(rows), error[..., None]))[..., 0]
        q = q + step / np.sqrt(1.0 + (step * step).sum(axis=1, keepdims=True) / _LONGEST**2)
    return q


def missed(kinematics: ToolKinematics, q: Array, start: Array, box: CartesianBox) -> Array:
    """How far the tool is outside a box around its start, or rotated from its orientation there, if that is more.

    Args:
        kinematics: of the tool.
        q: joint positions, shape (B, n_joints) [rad or m].
        start: joint positions at the middle of the box, shape (n_joints,) [rad or m].
        box: the box.

    Returns:
        Shape (B,) [m or rad].
    """
    middle, kept = kinematics.pose(start)
    position, rotation = kinematics.pose(q)
    moved = position - middle
    outside: Array = np.maximum(moved * np.sign(moved.real) - box.half_width, 0.0).max(axis=1)
    if not box.keep_orientation:
        return outside
    turned = rotation - kept  # of norm √8 sin(θ/2)
    worst: Array = np.maximum(outside, np.sqrt(0.5 * (turned * turned).sum(axis=(1, 2))))
    return worst


def _check(box: Any, shape: tuple[str | int, ...]) -> None:
    if not isinstance(box.point, int | np.integer) or isinstance(box.point, bool) or box.point < 0:
        raise InvalidInputError(f"box: expected the index of a point, a whole number from 0 on, got {box.point!r}")
    widths = numbers(box.half_width, name=f"half_width at point {box.point}", shape=shape)
    if (widths < 0.0).any() or not widths.any():
        raise InvalidInputError(
            f"half_width at point {box.point}: expected numbers from 0 on, one of them above 0, got {widths.tolist()}"
        )
    object.__setattr__(box, "half_width", read_only(widths))
