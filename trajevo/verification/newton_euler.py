"""Inverse dynamics by an independent recursion, against which the results of Pinocchio can be checked.

Only the order of the joints and the gravity vector are taken from Pinocchio. The URDF is read again, and the recursion
of Newton and Euler (Luh, Walker and Paul 1980) uses the axes of the base instead of those of the links.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, final
from xml.etree import ElementTree

import numpy as np

from trajevo.base.arrays import Array, numbers
from trajevo.errors import InvalidInputError, UnknownNameError
from trajevo.robot.payload import Payload
from trajevo.robot.robot import Robot

_NOTHING = Payload(0.0)


class _Pose(NamedTuple):
    """Pose of a frame on the moving joint that carries it: number of that joint (-1: the base), rotation and offset."""

    mover: int
    rotation: Array
    offset: Array

    def then(self, rotation: Array, offset: Array) -> _Pose:
        return _Pose(self.mover, self.rotation @ rotation, self.offset + self.rotation @ offset)


class _Mover(NamedTuple):
    """A moving joint: its pose on the joint before it, its unit axis, and its column in the model's arrays."""

    place: _Pose
    axis: Array
    slides: bool
    column: int


class _Body(NamedTuple):
    """A mass fixed to a moving joint, in that joint's frame; the inertia is about the centre of mass."""

    mover: int
    mass: float
    com: Array
    inertia: Array


class _State(NamedTuple):
    """Motion of a frame in N states, in axes of the base: rotation (N, 3, 3), the others (N, 3).

    ``turning`` is the angular velocity, ``turning_rate`` the angular acceleration.
    """

    rotation: Array
    origin: Array
    turning: Array
    turning_rate: Array
    acceleration: Array

    def acceleration_at(self, arm: Array) -> Array:
        """Acceleration of a point that is fixed to the frame, ``arm`` away from its origin."""
        spin = np.cross(self.turning, np.cross(self.turning, arm))
        total: Array = self.acceleration + np.cross(self.turning_rate, arm) + spin
        return total


class _Tree(NamedTuple):
    """The moving joints, each after the one that carries it, their bodies, and the tool."""

    movers: tuple[_Mover, ...]
    bodies: tuple[_Body, ...]
    tool: _Pose


@final
@dataclass(frozen=True, eq=False)
class NewtonEuler:
    """Effort of a robot that carries a payload, in plain numpy and without Pinocchio.

    Attributes:
        robot: the robot; it is not changed.
        payload: what it carries.

    Raises:
        InvalidInputError: the URDF cannot be read, or has a joint that is neither planned for, nor locked, nor fixed.
        UnknownNameError: the tool is neither a link nor a joint of the URDF.
    """

    robot: Robot
    payload: Payload = _NOTHING
    _tree: _Tree = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self.robot.check_body("effort")
        object.__setattr__(self, "_tree", _read_tree(self.robot))

    def effort(self, q: Array, v: Array, a: Array) -> Array:
        """Actuator effort with the payload, friction and armature included.

        Args:
            q: joint positions, shape (N, n_joints) [rad or m].
            v: velocities, the same shape [rad/s or m/s].
            a: accelerations, the same shape [rad/s² or m/s²].

        Returns:
            Shape (N, n_joints) [N·m or N].

        Raises:
            InvalidInputError: a wrong shape, or numbers that are not finite.
        """
        q = numbers(q, name="q", shape=("N", self.robot.dof))
        v, a = (numbers(x, name=name, shape=q.shape) for x, name in ((v, "v"), (a, "a")))
        states, axes = self._states(*self.robot.transmission.motion(q, v, a))
        total = self.robot.transmission.effort(q, self._torque(states, axes)) + self.robot.friction.effort(v, a)
        return np.asarray(total)

    def _states(self, q: Array, v: Array, a: Array) -> tuple[dict[int, _State], list[Array]]:
        """Outward recursion: state of every joint's frame (-1: the base, at rest), and the joint axes, each (N, 3)."""
        nothing = np.zeros((len(q), 3))
        states = {-1: _State(np.broadcast_to(np.eye(3), (len(q), 3, 3)), nothing, nothing, nothing, nothing)}
        axes = []
        for number, mover in enumerate(self._tree.movers):
            before = states[mover.place.mover]
            position, speed, gain = (x[:, mover.column, None] for x in (q, v, a))
            rotation = before.rotation @ mover.place.rotation
            axis = _turned(rotation, mover.axis)
            arm = _turned(before.rotation, mover.place.offset)
            along, own = axis * speed, axis * gain
            if mover.slides:
                arm = arm + axis * position
                turning, rate = before.turning, before.turning_rate
                linear = before.acceleration_at(arm) + 2.0 * np.cross(turning, along) + own
            else:
                rotation = rotation @ _about(mover.axis, position[:, 0])
                turning = before.turning + along
                rate = before.turning_rate + own + np.cross(before.turning, along)
                linear = before.acceleration_at(arm)
            states[number] = _State(rotation, before.origin + arm, turning, rate, linear)
            axes.append(axis)
        return states, axes

    def _torque(self, states: dict[int, _State], axes: Sequence[Array]) -> Array:
        """Inward recursion: efforts of the joints (N, n_joints), from force and moment about each joint's origin."""
        count = len(self._tree.movers)
        force, moment = np.zeros((2, count, len(states[-1].origin), 3))
        for number, arm, held, turned in self._wrenches(states):
            force[number] += held
            moment[number] += turned + np.cross(arm, held)
        torque = np.empty((len(states[-1].origin), count))
        for number in reversed(range(count)):
            mover, before = self._tree.movers[number], self._tree.movers[number].place.mover
            borne = force[number] if mover.slides else moment[number]
            torque[:, mover.column] = np.sum(borne * axes[number], axis=1)
            if before >= 0:
                arm = states[number].origin - states[before].origin
                force[before] += force[number]
                moment[before] += moment[number] + np.cross(arm, force[number])
        return torque

    def _wrenches(self, states: dict[int, _State]) -> list[tuple[int, Array, Array, Array]]:
        """For every body its joint, the arm from the joint's origin, and the force and moment that its motion needs."""
        gravity = np.array(self.robot.model.gravity.linear, dtype=np.float64)
        payload, tool, found = self.payload, self._tree.tool, []
        bodies, com = list(self._tree.bodies), tool.offset + tool.rotation @ np.array(payload.com)
        if payload.model == "rigid":
            own = np.zeros((3, 3)) if payload.inertia is None else np.array(payload.inertia)
            bodies.append(_Body(tool.mover, payload.mass, com, tool.rotation @ own @ tool.rotation.T))
        elif tool.mover >= 0:
            at = states[tool.mover]
            down = gravity if payload.model == "weight_only" else np.linalg.norm(gravity) * tool.rotation[:, 2]
            weight = payload.mass * (down if payload.model == "weight_only" else _turned(at.rotation, down))
            arm = _turned(at.rotation, com)
            found.append((tool.mover, arm, np.broadcast_to(-weight, arm.shape), np.zeros_like(arm)))
        for body in bodies:
            if body.mover < 0:
                continue  # the ground holds it
            at = states[body.mover]
            arm = _turned(at.rotation, body.com)
            inertia = at.rotation @ body.inertia @ np.swapaxes(at.rotation, 1, 2)
            turned = _turned(inertia, at.turning_rate) + np.cross(at.turning, _turned(inertia, at.turning))
            found.append((body.mover, arm, body.mass * (at.acceleration_at(arm) - gravity), turned))
        return found


def _read_tree(robot: Robot) -> _Tree:
    """Read the URDF; everything fixed or locked is merged into the moving joints that carry it."""
    root = robot.description()
    columns = {name: column for column, name in enumerate(list(robot.model.names)[1:])}
    joints = [(joint, _end(joint, "parent"), _end(joint, "child")) for joint in root.iterfind("joint")]
    children = {child for _, _, child in joints}
    links = {str(link.get("name")): link for link in root.iterfind("link")}
    poses = {name: _Pose(-1, np.eye(3), np.zeros(3)) for name in links if name not in children}
    movers: list[_Mover] = []
    reached = list(poses)
    while reached:
        parent = reached.pop()
        for joint, above, child in joints:
            if above == parent:
                poses[child] = _beyond(joint, poses[parent], robot, columns, movers)
                reached.append(child)
    bodies = tuple(body for name, link in links.items() for body in _bodies(link, poses[name]))
    frames = {str(joint.get("name")): poses[child] for joint, _, child in joints} | poses  # of one name, the link's
    if robot.tool not in frames:
        raise UnknownNameError(f"tool frame in {robot.where}", robot.tool, frames)
    return _Tree(tuple(movers), bodies, frames[robot.tool])


def _beyond(
    joint: ElementTree.Element, before: _Pose, robot: Robot, columns: dict[str, int], movers: list[_Mover]
) -> _Pose:
    """Pose of the link beyond a joint; a moving joint is added to ``movers``."""
    name, kind = str(joint.get("name")), joint.get("type")
    place = before.then(*_origin(joint))
    if kind == "fixed":
        return place
    axis = _vector(joint.find("axis"), "xyz", (1.0, 0.0, 0.0))
    axis = axis / np.linalg.norm(axis)
    if kind not in ("revolute", "continuous", "prismatic") or name not in {*columns, *robot.locked}:
        raise InvalidInputError(
            f"{robot.where}: joint {name!r}: expected a fixed or locked joint, or a revolute or prismatic one that is "
            f"planned for, got one of type {kind!r}"
        )
    if name in columns:
        movers.append(_Mover(place, axis, kind == "prismatic", columns[name]))
        return _Pose(len(movers) - 1, np.eye(3), np.zeros(3))
    held = robot.locked[name]
    if kind == "prismatic":
        return place.then(np.eye(3), axis * held)
    return place.then(_about(axis, np.array([held]))[0], np.zeros(3))


def _bodies(link: ElementTree.Element, pose: _Pose) -> list[_Body]:
    """The body of a link, none if it has no mass."""
    inertial = link.find("inertial")
    mass = 0.0 if inertial is None else float(_attribute(inertial, "mass", "value"))
    if inertial is None or mass == 0.0:
        return []
    at = pose.then(*_origin(inertial))
    rows = (("ixx", "ixy", "ixz"), ("ixy", "iyy", "iyz"), ("ixz", "iyz", "izz"))
    inertia = np.array([[float(_attribute(inertial, "inertia", key)) for key in row] for row in rows])
    return [_Body(pose.mover, mass, at.offset, at.rotation @ inertia @ at.rotation.T)]


def _origin(element: ElementTree.Element) -> tuple[Array, Array]:
    """Rotation and offset of an ``<origin>``: rotations about the fixed axes x, y and z, in this order."""
    origin = element.find("origin")
    roll, pitch, yaw = _vector(origin, "rpy", (0.0, 0.0, 0.0))
    x, y, z = (_about(axis, np.array([angle]))[0] for axis, angle in zip(np.eye(3), (roll, pitch, yaw), strict=True))
    return z @ y @ x, _vector(origin, "xyz", (0.0, 0.0, 0.0))


def _vector(element: ElementTree.Element | None, key: str, otherwise: tuple[float, float, float]) -> Array:
    text = None if element is None else element.get(key)
    return np.array(otherwise if text is None else [float(part) for part in text.split()])


def _attribute(parent: ElementTree.Element, tag: str, key: str) -> str:
    child = parent.find(tag)
    return "0" if child is None else child.get(key, "0")


def _end(joint: ElementTree.Element, tag: str) -> str:
    return _attribute(joint, tag, "link")


def _about(axis: Array, angle: Array) -> Array:
    """Rotations about a unit axis by angles (N,), shape (N, 3, 3), by the formula of Rodrigues."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    sine, rest = np.sin(angle)[:, None, None], 1.0 - np.cos(angle)[:, None, None]
    rotation: Array = np.eye(3) + sine * cross + rest * (cross @ cross)
    return rotation


def _turned(rotation: Array, vectors: Array) -> Array:
    """Matrices (N, 3, 3) times vectors (3,) or (N, 3), shape (N, 3)."""
    turned: Array = (rotation @ vectors[..., None])[..., 0]
    return turned
