"""Pose, Jacobian and twist of the tool, for whole populations at once.

Pinocchio takes one real configuration per call; here one call takes arrays of any leading shape. Complex arrays work
too (derivatives by complex step), as only analytic operations are used. The formulas are the product of joint
placements and the geometric Jacobian (Siciliano, Robotics, 2009, sections 2.8 and 3.1).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, final

import numpy as np

from trajevo.base.arrays import Array, read_only
from trajevo.errors import InvalidInputError
from trajevo.robot.robot import Robot
from trajevo.robot.transmission import Transmission

#: Entries of placements that are this near to 0, 1 or -1 differ from it only by rounding.
_ROUNDING = 1e-15


class ToolMotion(NamedTuple):
    """How the tool moves, along its own axes.

    Attributes:
        rotation: from the tool's frame to the base frame, shape (..., 3, 3).
        acceleration: of the tool's origin, without gravity, shape (..., 3) [m/s²].
        angular_velocity: shape (..., 3) [rad/s].
        angular_acceleration: shape (..., 3) [rad/s²].
        jacobian: twist of the tool per joint velocity, linear rows first, shape (..., 6, n_joints).
    """

    rotation: Array
    acceleration: Array
    angular_velocity: Array
    angular_acceleration: Array
    jacobian: Array


@final
@dataclass(frozen=True, eq=False)
class ToolKinematics:
    """Kinematics of the tool frame along the joints that carry it; made by :meth:`of`.

    Attributes:
        transmission: actuator coordinates -> model coordinates.
        dof: number of joints of the robot.
        chain: index among the model's coordinates of each of the C joints from the base to the tool.
        rotations: rotation of each joint's frame in the frame of the joint before, at position 0, shape (C, 3, 3).
        translations: origin of that frame, shape (C, 3) [m].
        axes: unit axes in the joints' own frames, shape (C, 3).
        turns: whether a joint is revolute, otherwise prismatic, shape (C,).
        tool_rotation: rotation of the tool in the last joint's frame, shape (3, 3).
        tool_translation: origin of the tool in that frame, shape (3,) [m].
    """

    transmission: Transmission
    dof: int
    chain: tuple[int, ...]
    rotations: Array
    translations: Array
    axes: Array
    turns: tuple[bool, ...]
    tool_rotation: Array
    tool_translation: Array

    @classmethod
    def of(cls, robot: Robot) -> ToolKinematics:
        """The kinematics of a robot's tool, read once from its model; the model itself is not kept.

        Raises:
            InvalidInputError: the robot is joints and limits alone.
        """
        robot.check_body("the place of the tool")
        model = robot.model
        frame = model.frames[model.getFrameId(robot.tool)]
        numbers, joint = [], int(frame.parentJoint)
        while joint:
            numbers.append(joint)
            joint = int(model.parents[joint])
        numbers.reverse()
        axes, turns = robot.joint_axes
        places = [model.jointPlacements[k] for k in numbers]
        carrying = [k - 1 for k in numbers]
        return cls(
            transmission=robot.transmission,
            dof=robot.dof,
            chain=tuple(int(model.joints[k].idx_q) for k in numbers),
            rotations=read_only(np.array([place.rotation for place in places]).reshape(-1, 3, 3)),
            translations=read_only(np.array([place.translation for place in places]).reshape(-1, 3)),
            axes=read_only(axes[carrying]),
            turns=tuple(bool(turn) for turn in turns[carrying]),
            tool_rotation=read_only(frame.placement.rotation),
            tool_translation=read_only(frame.placement.translation),
        )

    @cached_property
    def _about(self) -> list[tuple[Array, Array]]:
        """Matrix of the vector product with each joint's axis, and its square."""
        matrices = [np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]) for x, y, z in self.axes]
        return [(matrix, matrix @ matrix) for matrix in matrices]

    @cached_property
    def _places(self) -> tuple[list[tuple[list[list[float]], list[float]]], list[float]]:
        """Frames whose z-axis is the joint's axis: columns of each one's rotation in the one before, and its origin.

        Then the tool's origin in the last of them.
        """
        before, places = np.eye(3), []
        for rotation, translation, axis in zip(self.rotations, self.translations, self.axes, strict=True):
            own = frame_along(axis)
            turned = before.T @ without_rounding(rotation) @ own
            places.append((turned.T.tolist(), (before.T @ without_rounding(translation)).tolist()))
            before = own
        return places, (before.T @ self.tool_translation).tolist()

    def pose(self, q: Array) -> tuple[Array, Array]:
        """Pose of the tool in the base frame.

        Args:
            q: joint positions, shape (..., n_joints) [rad or m]; complex ones stay complex.

        Returns:
            Positions (..., 3) [m] and rotation matrices (..., 3, 3).

        Raises:
            InvalidInputError: another number of joints.
        """
        return self._walk(self._checked(q, "q"))[:2]

    def joint_lines(self, q: Array) -> tuple[Array, Array]:
        """Where the axes of the joints lie in the base frame.

        Args:
            q: joint positions, shape (..., n_joints) [rad or m]; complex ones stay complex.

        Returns:
            A point of every axis [m] and its unit direction, shape (..., C, 3) each.
        """
        _, _, origins, axes = self._walk(self._checked(q, "q"))
        return np.stack(origins, axis=-2), np.stack(axes, axis=-2)

    def origins(self, q: Array) -> Array:
        """Origins of the joints that carry the tool, from the base on, and of the tool.

        Args:
            q: joint positions, shape (..., n_joints) [rad or m]; complex ones stay complex.

        Returns:
            Shape (..., C + 1, 3) [m].

        Raises:
            InvalidInputError: another number of joints.
        """
        position, _, origins, _ = self._walk(self._checked(q, "q"))
        return np.stack([*origins, position], axis=-2)

    def tilt(self, q: Array, axis: Array, direction: Array) -> Array:
        """1 - cos of the angle between an axis of the tool and a direction; complex joint positions stay complex.

        Args:
            q: joint positions, shape (..., n_joints) [rad or m].
            axis: unit axis in the tool's frame, shape (3,).
            direction: unit direction in the base frame, shape (3,).

        Returns:
            Shape (...).
        """
        rotation = self.pose(q)[1]
        tilt: Array = 1.0 - ((rotation * axis).sum(axis=-1) * direction).sum(axis=-1)
        return tilt

    def jacobian(self, q: Array) -> Array:
        """Jacobian: twist of the tool per joint velocity, in the base frame at the tool's origin, linear rows first.

        Args:
            q: joint positions, shape (..., n_joints) [rad or m]; complex ones stay complex.

        Returns:
            Shape (..., 6, n_joints) [m or rad per rad or m].

        Raises:
            InvalidInputError: another number of joints.
        """
        return self.pose_and_jacobian(q)[2]

    def pose_and_jacobian(self, q: Array) -> tuple[Array, Array, Array]:
        """Results of :meth:`pose` and :meth:`jacobian`, from one pass along the chain."""
        positions = self._checked(q, "q")
        position, rotation, origins, axes = self._walk(positions)
        geometric = self._geometric(position, origins, axes)
        shape = (*positions.shape, self.dof)
        at = np.broadcast_to(positions[..., None, :], shape)
        unit = np.broadcast_to(np.eye(self.dof, dtype=positions.dtype), shape)
        moved = self.transmission.motion(at, unit, np.zeros_like(unit))[1][..., list(self.chain)]
        return position, rotation, geometric @ np.swapaxes(moved, -1, -2)

    def twist(self, q: Array, v: Array) -> Array:
        """Linear and angular velocity of the tool in the base frame.

        Args:
            q: joint positions, shape (..., n_joints) [rad or m].
            v: joint velocities, the same shape [rad/s or m/s].

        Returns:
            Shape (..., 6), linear first [m/s and rad/s].

        Raises:
            InvalidInputError: another number of joints.
        """
        positions, velocities = self._states(q, v)
        moved = self.transmission.motion(positions, velocities, np.zeros_like(velocities))[1][..., list(self.chain)]
        position, _, origins, axes = self._walk(positions)
        twist: Array = (self._geometric(position, origins, axes) @ moved[..., None])[..., 0]
        return twist

    def squared_speed(self, q: Array, v: Array) -> Array:
        """Square of the speed of the tool's origin, in a fifth of the time of :meth:`twist` or less.

        Velocities are carried from joint to joint along the joints' own axes, one row of configurations for each
        component: to turn a vector does not change its length, so that no pose is needed, and most entries of
        placements are 0 or 1.

        Args:
            q: joint positions, shape (..., n_joints) [rad or m]; complex ones stay complex.
            v: joint velocities, the same shape [rad/s or m/s].

        Returns:
            Shape (...) [m²/s²].

        Raises:
            InvalidInputError: another number of joints.
        """
        positions, velocities = self._states(q, v)
        moved = self.transmission.motion(positions, velocities, np.zeros_like(velocities))
        coordinates, speeds = (np.ascontiguousarray(np.moveaxis(x, -1, 0)) for x in moved[:2])
        # Components along a frame's axes: those of its origin's velocity, and below them of its angular velocity.
        one: list[Array] = [np.zeros((2, *positions.shape[:-1]), dtype=positions.dtype) for _ in range(3)]
        places, tool = self._places
        for (columns, origin), turns, place in zip(places, self.turns, self.chain, strict=True):
            _carry(one, origin)
            one = [_combined(column, one) for column in columns]
            if turns:
                cosine, sine = np.cos(coordinates[place]), np.sin(coordinates[place])
                one[:2] = cosine * one[0] + sine * one[1], cosine * one[1] - sine * one[0]
            else:
                _carry(one, [0.0, 0.0, coordinates[place]])
            one[2][int(turns)] += speeds[place]
        _carry(one, tool)
        squared: Array = one[0][0] ** 2 + one[1][0] ** 2 + one[2][0] ** 2
        return squared

    def motion(self, q: Array, v: Array, a: Array) -> ToolMotion:
        """Velocity and acceleration of the tool, and its Jacobian, all along the tool's own axes.

        Args:
            q: joint positions, shape (..., n_joints) [rad or m]; complex ones stay complex, as do the others.
            v: joint velocities, the same shape [rad/s or m/s].
            a: joint accelerations, the same shape [rad/s² or m/s²].

        Raises:
            InvalidInputError: another number of joints.
        """
        q, v, a = self._states(q, v, a)
        speed, gain = (moved[..., list(self.chain)] for moved in self.transmission.motion(q, v, a)[1:])
        place, rotation, origins, axes = self._walk(q)
        at = turning = rate = acceleration = np.zeros_like(place)

        def reached(there: Array) -> Array:
            moved: Array = acceleration + crossed(rate, there - at) + crossed(turning, crossed(turning, there - at))
            return moved

        for k, axis in enumerate(axes):
            along, more = axis * speed[..., k, None], axis * gain[..., k, None]
            # A sliding joint's point that lies at the tool now carries on; the way to it is that of the link before.
            there = origins[k] if self.turns[k] else place
            acceleration, at = reached(there), there
            if self.turns[k]:
                rate, turning = rate + more + crossed(turning, along), turning + along
            else:
                acceleration = acceleration + more + 2.0 * crossed(turning, along)
        acceleration = reached(place)
        back = np.swapaxes(rotation, -1, -2)
        own = [(back @ one[..., None])[..., 0] for one in (acceleration, turning, rate)]
        jacobian = self.pose_and_jacobian(q)[2]
        halves = back @ jacobian[..., :3, :], back @ jacobian[..., 3:, :]
        return ToolMotion(rotation, own[0], own[1], own[2], np.concatenate(halves, axis=-2))

    def _checked(self, q: Array, name: str) -> Array:
        array = np.asarray(q, dtype=np.complex128 if np.iscomplexobj(q) else np.float64)
        if array.ndim == 0 or array.shape[-1] != self.dof:
            raise InvalidInputError(f"{name}: expected shape (..., {self.dof}), got {array.shape}")
        return array

    def _states(self, *states: Array) -> tuple[Array, ...]:
        """States of one type: a transmission copies velocities, so they must be complex if positions are."""
        checked = [self._checked(state, name) for state, name in zip(states, "qva", strict=False)]
        kind = np.result_type(*checked)
        return tuple(state.astype(kind, copy=False) for state in checked)

    def _geometric(self, position: Array, origins: list[Array], axes: list[Array]) -> Array:
        """The Jacobian of the joints of the chain, shape (..., 6, C)."""
        columns = np.zeros((*position.shape[:-1], 6, len(self.chain)), dtype=position.dtype)
        for k, turns in enumerate(self.turns):
            if turns:
                columns[..., :3, k] = crossed(axes[k], position - origins[k])
                columns[..., 3:, k] = axes[k]
            else:
                columns[..., :3, k] = axes[k]
        return columns

    def _walk(self, q: Array) -> tuple[Array, Array, list[Array], list[Array]]:
        """Pose of the tool, and origin and axis of every joint of the chain, in the base frame.

        The loop runs over joints, since each is placed by the one before, and never over configurations.
        """
        still = np.zeros_like(q)
        model = self.transmission.motion(q, still, still)[0]
        position = np.zeros((*q.shape[:-1], 3), dtype=q.dtype)
        rotation = np.broadcast_to(np.eye(3, dtype=q.dtype), (*q.shape[:-1], 3, 3))
        origins, axes = [], []
        for k, place in enumerate(self.chain):
            position = position + rotation @ self.translations[k]
            rotation = rotation @ self.rotations[k]
            axis, angle = rotation @ self.axes[k], model[..., place, None]
            origins.append(position)
            axes.append(axis)
            if self.turns[k]:
                rotation = rotation @ _turned(*self._about[k], angle[..., None])
            else:
                position = position + axis * angle
        return position + rotation @ self.tool_translation, rotation @ self.tool_rotation, origins, axes


def frame_along(axis: Any) -> Array:
    """A rotation (3, 3) that takes the z-axis to a unit axis (3,), without rounding if that is x, y or z."""
    z = np.array(axis, dtype=np.float64)
    if z.max() == 1.0:
        return np.roll(np.eye(3), int(z.argmax()) - 2, axis=0)
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def without_rounding(values: Any) -> Array:
    """Entries of a placement; those that differ from a whole number by rounding alone are that number."""
    entries = np.asarray(values, dtype=np.float64)
    whole = np.round(entries)
    return np.where(np.abs(entries - whole) < _ROUNDING, whole, entries)


def _combined(weights: Sequence[float], vectors: Sequence[Array]) -> Array:
    """Weighted sum of vectors; what has no weight is not computed, and what has the weight 1 not copied."""
    terms = [x if weight == 1.0 else weight * x for weight, x in zip(weights, vectors, strict=True) if weight != 0.0]
    total = terms[0]
    for term in terms[1:]:
        total = total + term
    return total


def _carry(one: Sequence[Array], to: Sequence[Any]) -> None:
    """Add what another point is faster than a frame's origin to the upper rows, from the lower ones' vector product."""
    for i in range(3):
        for k, other, sign in ((i - 1, i - 2, 1.0), (i - 2, i - 1, -1.0)):
            if np.ndim(to[k]) or to[k] != 0.0:
                one[i][0] += (sign * to[k]) * one[other][1]


def crossed(one: Array, other: Array) -> Array:
    """Vector product of (..., 3) and (..., 3), that of ``np.cross`` to the bit, which takes three times as long."""
    x, y, z = one[..., 0], one[..., 1], one[..., 2]
    u, v, w = other[..., 0], other[..., 1], other[..., 2]
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=-1)


def _turned(cross: Array, squared: Array, angle: Array) -> Array:
    """Rodrigues' rotation, of the matrix of a unit axis' vector product and its square; (..., 1, 1) -> (..., 3, 3)."""
    turned: Array = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * squared
    return turned
