"""Motion of all links and of the tool in the base frame, for any number of states at once.

The recursion is that of Newton-Euler's outward pass (Siciliano, Robotics, 2009, section 7.5.2), with gravity as an
acceleration of the base. Components stand before states, x of all states first, as numpy is slow at many short vectors.
All operations are sums of products of single states, so that no state depends on the others to the bit, and analytic,
so that complex steps pass.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.rnea_tree import Joint, tree_of
from trajevo.errors import InvalidInputError
from trajevo.robot.robot import Robot


class LinkMotion(NamedTuple):
    """A frame that moves with a link, in the base frame.

    Attributes:
        rotation: from the frame to the base, shape (3, 3, ...).
        origin: of the frame, shape (3, ...) [m].
        spin: angular velocity, shape (3, ...) [rad/s].
        spin_rate: angular acceleration, shape (3, ...) [rad/s²].
        felt: acceleration of the origin minus gravity, shape (3, ...) [m/s²].
    """

    rotation: Array
    origin: Array
    spin: Array
    spin_rate: Array
    felt: Array

    def moved(self, translation: Any, rotation: Any = None) -> LinkMotion:
        """Another frame of the same link, placed in this one."""
        arm = turned(self.rotation, np.asarray(translation))
        felt = self.felt + cross(self.spin_rate, arm) + cross(self.spin, cross(self.spin, arm))
        axes = self.rotation if rotation is None else product(self.rotation, np.asarray(rotation))
        return LinkMotion(axes, self.origin + arm, self.spin, self.spin_rate, felt)


def joints_of(robot: Robot) -> tuple[Joint, ...]:
    """The joints of a robot's model.

    Raises:
        InvalidInputError: a joint that neither turns about nor slides along an axis.
    """
    tree = tree_of(robot.model)
    if tree is None:
        raise InvalidInputError(f"robot {robot.name!r}: expected joints that turn or slide, got others")
    return tree


def link_motions(robot: Robot, joints: tuple[Joint, ...], q: Array, v: Array, a: Array) -> list[LinkMotion]:
    """The frames of all joints of the model, after the base.

    Args:
        robot: the robot; its masses do not matter.
        joints: its joints.
        q: positions, shape (..., n_joints) [rad or m].
        v: velocities, the same shape [rad/s or m/s].
        a: accelerations, the same shape [rad/s² or m/s²].
    """
    positions, velocities, accelerations = robot.transmission.motion(q, v, a)
    none = np.zeros((3, *q.shape[:-1]), dtype=np.result_type(q, v, a))
    one = np.ones(q.shape[:-1])
    upright = np.multiply.outer(np.eye(3), one)
    found = [LinkMotion(upright, none, none, none, none - np.multiply.outer(np.array(robot.model.gravity.linear), one))]
    for k, joint in enumerate(joints):
        state = tuple(x[..., k] for x in (positions, velocities, accelerations))
        found.append(_carried(found[joint.parent], joint, *state))
    return found


def tool_motion(robot: Robot, links: list[LinkMotion]) -> LinkMotion:
    """The tool's frame, given the frames of all joints."""
    frame = robot.model.frames[robot.model.getFrameId(robot.tool)]
    return links[int(frame.parentJoint)].moved(frame.placement.translation, frame.placement.rotation)


def _carried(parent: LinkMotion, joint: Joint, position: Array, velocity: Array, acceleration: Array) -> LinkMotion:
    """The frame of a joint, from that of the joint before it and its own state, each of shape (...)."""
    still = np.reshape(joint.rotation, (3, 3))
    if joint.slides:
        there = parent.moved(joint.origin, still)
        axis = turned(there.rotation, np.array(joint.axis))
        slid = there.moved(np.multiply.outer(np.array(joint.axis), position))
        along = axis * acceleration + 2.0 * cross(parent.spin, axis) * velocity
        return slid._replace(felt=slid.felt + along)
    x, y, z = joint.axis
    about = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    outer = np.multiply.outer
    turn = outer(still @ about, np.sin(position)) + outer(still @ about @ about, 1.0 - np.cos(position))
    turn += still.reshape(3, 3, *[1] * position.ndim)
    there = parent.moved(joint.origin)
    axis = turned(parent.rotation, still @ np.array(joint.axis))
    return there._replace(
        rotation=product(parent.rotation, turn),
        spin=parent.spin + axis * velocity,
        spin_rate=parent.spin_rate + axis * acceleration + cross(parent.spin, axis) * velocity,
    )


def turned(rotation: Array, vector: Array) -> Array:
    """Vectors (3, ...) or (3,) of frames with rotations (3, 3, ...) or (3, 3) in the base frame."""
    if rotation.ndim < vector.ndim + 1:
        rotation = rotation.reshape(3, 3, *[1] * (vector.ndim - 1))
    found: Array = rotation[:, 0] * vector[0] + rotation[:, 1] * vector[1] + rotation[:, 2] * vector[2]
    return found


def turned_back(rotation: Array, vector: Array) -> Array:
    """Vectors (3, ...) of the base frame in frames with rotations (3, 3, ...)."""
    return turned(np.swapaxes(rotation, 0, 1), vector)


def product(one: Array, other: Array) -> Array:
    """Products of rotations (3, 3, ...), state by state; the other may be one for all, (3, 3)."""
    return np.stack([turned(one, other[:, k]) for k in range(3)], axis=1)


def cross(one: Array, other: Array) -> Array:
    """Vector products of (3, ...) and (3, ...) or (3,)."""
    (x, y, z), (u, v, w) = one, other
    first = y * w - z * v
    found: Array = np.empty((3, *first.shape), dtype=first.dtype)  # np.stack takes most of the time of short arrays
    found[0], found[1], found[2] = first, z * u - x * w, x * v - y * u
    return found


def dot(one: Array, other: Array) -> Array:
    """Scalar products of (3, ...) and (3, ...) or (3,)."""
    found: Array = one[0] * other[0] + one[1] * other[1] + one[2] * other[2]
    return found
