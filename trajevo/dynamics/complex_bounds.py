"""Bounds of efforts and tool speeds at complex instants, on which proofs between samples are based.

Along a polynomial motion the effort is an analytic function of time, so that its magnitude on an ellipse of complex
instants about an interval bounds the error of the polynomial through a few real samples. A coarse bound of the
magnitude is enough, since it is divided by a power of the ellipse's size: here it is the Newton-Euler recursion with
every vector replaced by a bound of its norm. Three facts extend the recursion to complex numbers: a rotation about a
real axis by a complex angle has the norm exp(|imaginary part|), the norm of a cross product is at most the product of
the norms, and products of complex rotations keep the sum of squares.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple, final

import numpy as np

from trajevo.base import jit
from trajevo.base.arrays import Array
from trajevo.dynamics.bounds.torque_loops import torque_bounds
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.errors import InvalidInputError
from trajevo.robot.payload import carrying, kilogram, probe


class Bounds(NamedTuple):
    """Bounds of a motion at complex instants, in actuator or model coordinates, each (..., n).

    They bound the imaginary parts and magnitudes of positions, and the magnitudes of velocities and accelerations.
    """

    imaginary: Array
    q: Array
    v: Array
    a: Array

    def at_rest(self) -> Bounds:
        """The same positions without any motion."""
        return Bounds(self.imaginary, self.q, np.zeros_like(self.v), np.zeros_like(self.a))


class _Outward(NamedTuple):
    """Bounds for each joint, the base first: rotation, lever arm, angular velocity."""

    turned: list[Array]
    arm: list[Array]
    spin: list[Array]


@final
@dataclass(frozen=True, eq=False)
class EffortReach:
    """Bounds of a robot's efforts and tool speed from bounds of its motion.

    Attributes:
        dynamics: the robot and what it carries.
        any_mass: whether the payload's mass is given with each motion.
    """

    dynamics: Dynamics
    any_mass: bool = field(default=False, kw_only=True)
    _models: dict[str, _Tree] = field(init=False, repr=False)
    _phases: tuple[tuple[EffortReach, bool], ...] = field(default=(), init=False, repr=False)

    def __post_init__(self) -> None:
        schedule = self.dynamics.schedule
        if schedule is not None:
            phases = (
                (EffortReach(self.dynamics.of_phase(phase), any_mass=self.any_mass and varies), varies)
                for phase in schedule.phases
                for varies in [schedule.varies(phase)]
            )
            object.__setattr__(self, "_phases", tuple(phases))
        robot, payload = self.dynamics.robot, self.dynamics.payload
        loaded = self.any_mass or payload.mass > 0.0
        merged = loaded and payload.model == "rigid" and not self.any_mass
        models = {"tool": robot.model, "robot": carrying(robot, payload) if merged else robot.model}
        if loaded and not merged:
            axis = payload.model == "tool_axis"
            models["axis" if axis else "kilogram"] = probe(robot) if axis else kilogram(robot, payload)
        object.__setattr__(self, "_models", {name: _Tree.of(model) for name, model in models.items()})

    @classmethod
    def of(cls, dynamics: Dynamics, *, any_mass: bool) -> EffortReach:
        """The bounds, made once for the same dynamics: to look into their models takes long."""
        return dynamics.once(f"reach, any mass {any_mass}", lambda: cls(dynamics, any_mass=any_mass))

    def effort(self, motion: Bounds, masses: Array | None = None, segments: Array | None = None) -> Array:
        """Bounds of the magnitudes of actuator efforts, without dry friction.

        Args:
            motion: bounds in actuator coordinates, shapes (..., n_joints).
            masses: masses of the payload if :attr:`any_mass`, shape (..., 1) [kg].
            segments: numbers of the segments of the motion's K pieces, shape (K,), where loads change on the way.

        Returns:
            Shape (..., n_joints) [N·m or N]; NaN or inf where there is no bound.
        """
        if self._phases:
            found = np.empty(motion.v.shape)
            for reach, varies, rows in self._by_phase(segments):
                given = None if masses is None or not varies else masses[rows]
                found[rows] = reach.effort(Bounds(*(x[rows] for x in motion)), given)
            return found
        model = Bounds(*self.dynamics.robot.transmission.reach(*motion))
        torque = _torque(self._models["robot"], model, self._gravity)
        if not self._models.keys() <= {"tool", "robot"}:
            torque = torque + (self.dynamics.payload.mass if masses is None else masses) * self._per_kilogram(model)
        return self._actuated(motion, torque)

    def unloaded_and_per_kilogram(self, motion: Bounds, segments: Array | None = None) -> tuple[Array, Array]:
        """Bounds as :meth:`effort`, without payload and of what each kilogram adds, if :attr:`any_mass`.

        Args:
            motion: bounds in actuator coordinates, shapes (..., n_joints).
            segments: as for :meth:`effort`.

        Returns:
            Two arrays of shape (..., n_joints) [N·m or N] and [N·m/kg or N/kg].
        """
        if self._phases:
            both = np.zeros((2, *motion.v.shape))
            for reach, varies, rows in self._by_phase(segments):
                part = Bounds(*(x[rows] for x in motion))
                if varies:
                    both[:, rows] = reach.unloaded_and_per_kilogram(part)
                else:
                    both[0, rows] = reach.effort(part)
            return both[0], both[1]
        transmission = self.dynamics.robot.transmission
        model = Bounds(*transmission.reach(*motion))
        unloaded = self._actuated(motion, _torque(self._models["robot"], model, self._gravity))
        return unloaded, transmission.effort_reach(motion.imaginary, self._per_kilogram(model))

    def _by_phase(self, segments: Array | None) -> Iterator[tuple[EffortReach, bool, Array]]:
        """The bounds of every phase, whether the load that capacities mean is carried in it, and its pieces."""
        schedule = self.dynamics.schedule
        if schedule is None or segments is None:
            raise InvalidInputError(f"segments: expected those of the pieces, as loads change: {schedule}")
        of_pieces = np.array(schedule.phase_of_segment)[segments]
        for k, (reach, varies) in enumerate(self._phases):
            rows = np.flatnonzero(of_pieces == k)
            if len(rows):
                yield reach, varies, rows

    def _actuated(self, motion: Bounds, torque: Array) -> Array:
        """Bounds of actuator efforts from those of model torques, friction and armature added."""
        robot = self.dynamics.robot
        effort = robot.transmission.effort_reach(motion.imaginary, torque)
        if robot.friction.none:
            return effort
        added: Array = effort + (robot.friction.viscous * motion.v + robot.friction.armature * motion.a)
        return added

    @cached_property
    def _gravity(self) -> float:
        return float(np.linalg.norm(self.dynamics.robot.model.gravity.linear))

    def _per_kilogram(self, model: Bounds) -> Array:
        """Bounds of what each kilogram of a payload adds if it is not part of the model, in model coordinates."""
        if "kilogram" in self._models:
            rigid = self.dynamics.payload.model == "rigid"
            return _torque(self._models["kilogram"], model if rigid else model.at_rest(), self._gravity)
        still = Bounds(*(np.concatenate([x, np.zeros_like(x[..., :1])], axis=-1) for x in model)).at_rest()
        held = _torque(self._models["axis"], still, 1.0)
        per_axis: Array = 3.0 * self._gravity * held[..., :-1] * held[..., -1:]  # one for each axis
        return per_axis

    def squared_tool_speed(self, motion: Bounds) -> Array:
        """Bounds of the magnitude of the tool's squared speed, shapes (..., n_joints) -> (...) [m²/s²]."""
        model = self.dynamics.robot.model
        reach = Bounds(*self.dynamics.robot.transmission.reach(*motion))
        found = _outward(self._models["tool"], reach)
        speeds = _speeds(self._models["tool"], reach, found)
        frame = model.frames[model.getFrameId(self.dynamics.robot.tool)]
        carrier = int(frame.parentJoint)
        speed: Array = speeds[carrier] + found.spin[carrier] * float(np.linalg.norm(frame.placement.translation))
        return speed**2

    def tool_turned(self, motion: Bounds) -> Array:
        """Bounds of the norm of the tool's orientation, shapes (..., n_joints) -> (...); 1 at real instants."""
        model = self.dynamics.robot.model
        found = _outward(self._models["tool"], Bounds(*self.dynamics.robot.transmission.reach(*motion)))
        joint = int(model.frames[model.getFrameId(self.dynamics.robot.tool)].parentJoint)
        turned: Array = np.ones(motion.v.shape[:-1])
        while joint:
            turned = turned * found.turned[joint]
            joint = int(model.parents[joint])
        return turned

    def tool_distance(self, motion: Bounds) -> Array:
        """Bounds of the magnitude of the tool's position in the base frame, shapes (..., n_joints) -> (...) [m]."""
        model = self.dynamics.robot.model
        found = _outward(self._models["tool"], Bounds(*self.dynamics.robot.transmission.reach(*motion)))
        frame = model.frames[model.getFrameId(self.dynamics.robot.tool)]
        joint = int(frame.parentJoint)
        distance = float(np.linalg.norm(frame.placement.translation)) + np.zeros(motion.v.shape[:-1])
        while joint:  # outwards to inwards: what lies beyond a joint is turned by it, then carried by its arm
            distance = found.turned[joint] * distance + found.arm[joint]
            joint = int(model.parents[joint])
        return distance


class _Link(NamedTuple):
    """What the bounds need of a joint and the body that it moves.

    Attributes:
        parent: number of the joint before it, 0 for the base.
        column: its column of velocities.
        turns: whether it turns, and does not slide.
        arm: distance of its frame from that of the joint before it [m].
        mass: of its body [kg].
        lever: distance of its body's centre of mass [m].
        inertia: spectral norm of its body's inertia about the centre of mass [kg·m²].
    """

    parent: int
    column: int
    turns: bool
    arm: float
    mass: float
    lever: float
    inertia: float


@final
@dataclass(frozen=True, eq=False)
class _Tree:
    """The joints of a model, the base first; and the same as arrays for :func:`torque_bounds`."""

    links: tuple[_Link, ...]
    tree: Array
    bodies: Array

    @classmethod
    def of(cls, model: Any) -> _Tree:
        """Those of a Pinocchio model, read once, since each look into it takes long."""
        links = tuple(
            _Link(
                int(model.parents[joint]),
                int(model.joints[joint].idx_v) if joint else -1,
                joint > 0 and bool(np.ravel(model.joints[joint].createData().S)[3:].any()),
                float(np.linalg.norm(model.jointPlacements[joint].translation)),
                float(body.mass),
                float(np.linalg.norm(body.lever)),
                float(np.linalg.norm(body.inertia, ord=2)),
            )
            for joint in range(model.njoints)
            for body in [model.inertias[joint]]
        )
        tree = np.array([(link.parent, link.column, link.turns) for link in links])
        return cls(links, tree, np.array([(link.arm, link.mass, link.lever, link.inertia) for link in links]))


def _outward(tree: _Tree, motion: Bounds) -> _Outward:
    """Recursion from the base to the tips; the loop runs over joints, each carried by its parent."""
    nothing = np.zeros(motion.v.shape[:-1])
    found = _Outward([nothing + 1.0], [nothing], [nothing])
    for link in tree.links[1:]:
        column, turns = link.column, link.turns
        found.turned.append(np.exp(motion.imaginary[..., column]) if turns else nothing + 1.0)
        found.arm.append((link.arm if turns else link.arm + motion.q[..., column]) + nothing)
        carried = found.turned[-1] * found.spin[link.parent]
        found.spin.append(carried + motion.v[..., column] if turns else carried)
    return found


def _speeds(tree: _Tree, motion: Bounds, found: _Outward) -> list[Array]:
    """Bounds of the speeds of the joints' origins, the base first."""
    speeds = [np.zeros(motion.v.shape[:-1])]
    for joint, link in enumerate(tree.links[1:], start=1):
        carried = found.turned[joint] * (speeds[link.parent] + found.spin[link.parent] * found.arm[joint])
        speeds.append(carried if link.turns else carried + motion.v[..., link.column])
    return speeds


def _accelerations(tree: _Tree, motion: Bounds, found: _Outward, gravity: float) -> tuple[list[Array], list[Array]]:
    """Bounds of the joints' angular accelerations and of the accelerations of their origins, the base first."""
    nothing = np.zeros(motion.v.shape[:-1])
    rates, pulls = [nothing], [nothing + gravity]
    for joint, link in enumerate(tree.links[1:], start=1):
        v, a = motion.v[..., link.column], motion.a[..., link.column]
        turned, before, rate = found.turned[joint], found.spin[link.parent], rates[link.parent]
        carried = turned * before
        rates.append(turned * rate + (a + carried * v if link.turns else 0.0))
        pull = turned * (pulls[link.parent] + (rate + before**2) * found.arm[joint])
        pulls.append(pull if link.turns else pull + 2.0 * carried * v + a)
    return rates, pulls


def _torque(tree: _Tree, motion: Bounds, gravity: float) -> Array:
    """Recursion from the tips to the base: bounds of the torque of every joint from forces and moments beyond it."""
    if jit.can_compile():
        return _torque_in_loops(tree, motion, gravity)
    links, found = tree.links, _outward(tree, motion)
    rates, pulls = _accelerations(tree, motion, found, gravity)
    force: list[Array] = []
    moment: list[Array] = []
    for joint, link in enumerate(links):
        swing = rates[joint] + found.spin[joint] ** 2
        held = link.mass * (pulls[joint] + swing * link.lever)
        force.append(held)
        moment.append(link.inertia * swing + link.lever * held)
    torque = np.empty_like(motion.v)
    for joint in reversed(range(1, len(links))):
        link = links[joint]
        torque[..., link.column] = (moment if link.turns else force)[joint]
        force[link.parent] = force[link.parent] + found.turned[joint] * force[joint]
        carried = moment[joint] + found.arm[joint] * force[joint]
        moment[link.parent] = moment[link.parent] + found.turned[joint] * carried
    return torque


def _torque_in_loops(tree: _Tree, motion: Bounds, gravity: float) -> Array:
    """As :func:`_torque`; norms of rotations by numpy, whose exponential differs from others in its last digit."""
    rows = (-1, motion.v.shape[-1])
    torque = np.empty_like(motion.v)
    turned, q, v, a = (np.broadcast_to(x, torque.shape).reshape(rows) for x in (np.exp(motion.imaginary), *motion[1:]))
    torque_bounds(tree.tree, tree.bodies, gravity, turned, q, v, a, torque.reshape(rows))
    return torque
