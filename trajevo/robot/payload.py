"""Payloads that a robot carries at its tool, and the models and regressors that give their effort."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, final

import numpy as np

from trajevo.base.arrays import Array, numbers
from trajevo.base.plain import plain_data
from trajevo.base.plugins import deferred
from trajevo.base.shown.brief import brief
from trajevo.base.units import believed, quantity, with_unit
from trajevo.errors import InvalidInputError, checked_name
from trajevo.robot.robot import Robot

if TYPE_CHECKING:
    import pinocchio as pin
else:  # which takes a tenth of the time of importing trajevo
    pin = deferred("pinocchio")

#: How a payload acts.
LOAD_MODELS = {
    "rigid": "a rigid body fixed to the tool: weight and inertia",
    "weight_only": "its weight as a vertical force at the tool, no inertia (Guo 2016)",
    "tool_axis": "its weight as a force along the tool's z axis, no inertia (the conjectured convention of Guo 2016)",
}

#: Effort is affine in these: mass [kg], mass times centre of mass [kg·m], inertia about the tool's origin [kg·m²].
PARAMETERS = ("m", "m cx", "m cy", "m cz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")


#: Distance of a centre of mass along an axis, and radius of gyration, above which numbers are not believed [m].
_FARTHEST_COM, _WIDEST = 2.0, 5.0

#: Kinds of the joints along which a base slides.
_SLIDES = ("PX", "PY", "PZ")

#: Text that begins with a number.
_QUANTITY = re.compile(r"\s*[+-]?\.?\d")


@final
@dataclass(frozen=True)
class Payload:
    """Something carried at the tool.

    Attributes:
        mass: mass, 0 or more [kg].
        com: centre of mass in the tool frame [m]; text with a unit, such as ``"30 mm"``, is converted. Farther than 2 m
            away it must be such text.
        inertia: rotational inertia about the centre of mass along the tool's axes, 3 x 3 [kg·m²]; None for a point
            mass. It scales with the mass when a capacity is computed.
        model: a key of :data:`LOAD_MODELS`.

    Raises:
        UnknownNameError: no such model.
        InvalidInputError: a mass that is negative or not finite, an inertia that no body can have, a property that the
            model cannot use, or a number that looks as if it were in mm or kg·mm².
    """

    mass: float
    com: tuple[float, float, float] = (0.0, 0.0, 0.0)
    inertia: tuple[tuple[float, ...], ...] | None = None
    model: str = "rigid"

    __repr__ = brief

    def __post_init__(self) -> None:
        checked_name("payload model", self.model, LOAD_MODELS)
        real = isinstance(self.mass, int | float | np.number) and not isinstance(self.mass, bool)
        if not (real and math.isfinite(self.mass) and self.mass >= 0.0):
            raise InvalidInputError(f"payload.mass: expected a number from 0 on [kg], got {self.mass!r}")
        object.__setattr__(self, "mass", float(self.mass))
        object.__setattr__(self, "com", _lengths(self.com))
        if self.inertia is not None:
            object.__setattr__(self, "inertia", _checked_inertia(self.inertia, self.mass))
        if self.model != "rigid" and self.inertia is not None:
            raise InvalidInputError(f"payload.inertia: the model {self.model!r} has no inertia")
        if self.model == "tool_axis" and any(self.com):
            raise InvalidInputError("payload.com: the model 'tool_axis' acts at the tool's origin")

    @classmethod
    def of(cls, given: Payload | float | dict[str, Any], *, model: str | None, usual: str = "rigid") -> Payload:
        """The payload that a caller passed: a payload, a mass [kg], or the plain data of a payload.

        Args:
            given: any of these; a mass may be text with its unit, such as ``"500 g"``, and above 1000 kg must be.
            model: a key of :data:`LOAD_MODELS` that replaces the model of ``given``; None keeps that one.
            usual: model of a bare mass if ``model`` is None.
        """
        if isinstance(given, dict):
            unknown = sorted(set(given) - {"mass", "com", "inertia", "model"})
            if unknown or "mass" not in given:
                raise InvalidInputError(f"payload: expected mass, com, inertia and model, got {sorted(given)}")
            given = cls(**{**given, "mass": _mass(given["mass"])})
        if isinstance(given, Payload):
            return given if model is None else given._replaced(model=model)
        return cls(_mass(given), model=model or usual)

    @property
    def settings(self) -> dict[str, Any]:
        """Plain data from which an equal payload can be made."""
        settings: dict[str, Any] = plain_data("payload", asdict(self) | {"com": self._com_with_units})
        return settings | {"mass": with_unit(self.mass, "kg")}

    @property
    def _com_with_units(self) -> tuple[Any, ...]:
        """The centre of mass as it can be given again."""
        return tuple(with_unit(length, "m", most=_FARTHEST_COM) for length in self.com)

    def with_mass(self, mass: float) -> Payload:
        """The same payload with another mass [kg]; its inertia scales with the mass."""
        if self.inertia is None:
            return self._replaced(mass=mass)
        scaled = tuple(tuple(entry * mass / self.mass for entry in row) for row in self.inertia)
        return self._replaced(mass=mass, inertia=scaled if mass > 0.0 else None)

    def _replaced(self, **changed: Any) -> Payload:
        return replace(self, **({"com": self._com_with_units} | changed))


def _mass(given: Any) -> Any:
    """A mass as a user gives it [kg]; what is no number is refused by :class:`Payload`."""
    if isinstance(given, str) and _QUANTITY.match(given):
        return quantity(given, "kg", name="payload.mass")
    real = isinstance(given, int | float | np.number) and not isinstance(given, bool)
    return believed(given, "kg", name="payload.mass") if real else given


def _lengths(given: Any) -> tuple[float, ...]:
    """A centre of mass as a user gives it [m]."""
    listed = given if isinstance(given, list | tuple) else [given]
    entries = [
        quantity(entry, "m", name="payload.com") if isinstance(entry, str) and _QUANTITY.match(entry) else entry
        for entry in listed
    ]
    lengths = numbers(entries if listed is given else given, name="payload.com", shape=(3,)).tolist()
    for entry, length in zip(given, lengths, strict=True):
        if not isinstance(entry, str):
            believed(length, "m", name="payload.com", most=_FARTHEST_COM)
    return tuple(lengths)


def carrying(robot: Robot, payload: Payload) -> Any:
    """A copy of a robot's model with a rigid payload fixed to the tool; the robot is not changed."""
    model = robot.model.copy()
    frame = model.frames[model.getFrameId(robot.tool)]
    model.appendBodyToJoint(frame.parentJoint, _body(payload), frame.placement)
    return model


def with_loads(robot: Robot, loads: Mapping[str, Payload]) -> Any:
    """A copy of a robot's model with a rigid load on the links that some joints move, placed in the joints' frames."""
    model = robot.model.copy()
    for joint, payload in loads.items():
        model.appendBodyToJoint(model.getJointId(joint), _body(payload), pin.SE3.Identity())
    return model


def massless(robot: Robot) -> Any:
    """A copy of a robot's model in which every mass and inertia is zero."""
    model = robot.model.copy()
    for joint in range(model.njoints):
        model.inertias[joint] = pin.Inertia.Zero()
    return model


def kilogram(robot: Robot, payload: Payload) -> Any:
    """A massless copy of a robot's model that carries one kilogram of a payload."""
    model = massless(robot)
    frame = model.frames[model.getFrameId(robot.tool)]
    model.appendBodyToJoint(frame.parentJoint, _body(payload.with_mass(1.0)), frame.placement)
    return model


def probe(robot: Robot) -> Any:
    """A massless copy with one kilogram on an additional prismatic joint along the tool's z axis.

    That joint is the last coordinate of the model. At rest under gravity g it holds the force -a·g, where a is the
    tool's z axis, and the other joints hold -Jᵀ g.
    """
    model = massless(robot)
    frame = model.frames[model.getFrameId(robot.tool)]
    joint = model.addJoint(frame.parentJoint, pin.JointModelPZ(), frame.placement, "probe")
    model.appendBodyToJoint(joint, pin.Inertia(1.0, np.zeros(3), np.zeros((3, 3))), pin.SE3.Identity())
    return model


def gripping(robot: Robot, payload: Payload) -> Any:
    """A massless copy with one kilogram of a payload on six more joints at the tool, which bear what a grip gives.

    They are the last coordinates of the model: three slide along the tool's axes, three turn about them.
    """
    model = massless(robot)
    frame = model.frames[model.getFrameId(robot.tool)]
    joint = _on_six_joints(model, frame.parentJoint, frame.placement, "grip")
    model.appendBodyToJoint(joint, _body(payload.with_mass(1.0)), pin.SE3.Identity())
    return model


def standing(model: Any) -> Any:
    """A model on six more joints at its base, which bear what a stand gives; rotors of motors are left out.

    They are the first coordinates of the model: three slide along the base's axes, three turn about them. The base
    itself has no mass.
    """
    stand = pin.Model()
    joint = _on_six_joints(stand, 0, pin.SE3.Identity(), "stand")
    frame = stand.addFrame(pin.Frame("stand", joint, 0, pin.SE3.Identity(), pin.FrameType.FIXED_JOINT))
    held = pin.appendModel(stand, model, frame, pin.SE3.Identity())
    held.gravity, held.inertias[joint] = model.gravity, pin.Inertia.Zero()
    held.armature[:] = 0.0
    return held


def on_slides(model: Any) -> Any:
    """A model on three more joints without mass at its base, which slide along the base's axes, without gravity.

    They are the first coordinates of the model. A base that accelerates against gravity needs the torques that gravity
    asks for, so that states may each have a gravity of their own.
    """
    slides, joint = pin.Model(), 0
    for kind in _SLIDES:
        joint = slides.addJoint(joint, getattr(pin, f"JointModel{kind}")(), pin.SE3.Identity(), f"base {kind}")
    frame = slides.addFrame(pin.Frame("slides", joint, 0, pin.SE3.Identity(), pin.FrameType.FIXED_JOINT))
    moved = pin.appendModel(slides, model, frame, pin.SE3.Identity())
    moved.gravity.linear = np.zeros(3)
    moved.inertias[joint] = pin.Inertia.Zero()  # what is fixed to the base has no part in the torques of the arm
    for number in range(1, model.njoints):  # without the rounding of a change of frames that are the same
        moved.inertias[joint + number] = model.inertias[number]
    return moved


def under_gravity(robot: Robot, gravity: Array) -> Robot:
    """The same robot with another gravity in its base frame, shape (3,) [m/s²]; its settings are those of the given."""
    model = robot.model.copy()
    model.gravity.linear = np.array(gravity)
    return replace(robot, model=model)


def on_carriage(model: Any, names: Sequence[str], origin: Array) -> Any:
    """A model whose base more joints move, the first ones: along x, y and z, and about z, y and x through a point.

    Args:
        model: the model.
        names: names of the joints, from the first one on; the last one carries the frame ``carriage``, in which the
            base stands.
        origin: that point, shape (3,) [m].
    """
    carriage, joint, place = pin.Model(), 0, pin.SE3(np.eye(3), np.array(origin))
    for name, kind in zip(names, ("PX", "PY", "PZ", "RZ", "RY", "RX"), strict=False):
        joint = carriage.addJoint(joint, getattr(pin, f"JointModel{kind}")(), place, name)
        place = pin.SE3.Identity()
    back = pin.SE3(np.eye(3), -np.array(origin))
    frame = carriage.addFrame(pin.Frame("carriage", joint, 0, back, pin.FrameType.FIXED_JOINT))
    moved = pin.appendModel(carriage, model, frame, pin.SE3.Identity())
    moved.gravity = model.gravity
    return moved


def _on_six_joints(model: Any, joint: int, placement: Any, name: str) -> int:
    """Add joints that slide along and turn about three axes; the number of the last one."""
    for kind in ("PX", "PY", "PZ", "RX", "RY", "RZ"):
        joint = model.addJoint(joint, getattr(pin, f"JointModel{kind}")(), placement, f"{name} {kind}")
        placement = pin.SE3.Identity()
    return joint


def tool_regressor(robot: Robot, q: Array, v: Array, a: Array) -> Array:
    """Model torque per unit of each of the ten inertial parameters of a body that is fixed to the tool.

    The loop over Pinocchio's regressor takes half the time of ten batched runs of inverse dynamics, one per parameter.

    Args:
        robot: the robot; its own masses do not matter.
        q: positions in model coordinates, shape (T, n_joints) [rad or m].
        v: velocities, the same shape [rad/s or m/s].
        a: accelerations, the same shape [rad/s² or m/s²].

    Returns:
        Shape (T, n_joints, 10), parameters in the order of :data:`PARAMETERS`.
    """
    model, data = robot.model, robot.model.createData()
    frame = model.frames[model.getFrameId(robot.tool)]
    body = slice(10 * (frame.parentJoint - 1), 10 * frame.parentJoint)
    at_joint = np.empty((*q.shape, 10))
    for i, state in enumerate(zip(q, v, a, strict=True)):
        rows = pin.computeJointTorqueRegressor(model, data, *state).reshape(model.nv, -1)  # one row comes flat
        at_joint[i] = rows[:, body]
    return at_joint @ _at_joint(frame.placement.rotation, frame.placement.translation)


def _at_joint(rotation: Array, position: Array) -> Array:
    """Matrix (10, 10) from the ten parameters in a frame on a body to those in the body's own frame."""
    columns = np.empty((10, 10))
    for k, unit in enumerate(np.eye(10)):
        mass, moment, inertia = unit[0], rotation @ unit[1:4], rotation @ tensor_of(unit[4:]) @ rotation.T
        shift = 2.0 * moment @ position + mass * position @ position
        inertia += shift * np.eye(3) - np.outer(position, moment) - np.outer(moment, position)
        inertia -= mass * np.outer(position, position)
        columns[:, k] = [mass, *(moment + mass * position), *entries_of(inertia)]
    return columns


def tensor_of(entries: Array) -> Array:
    """Symmetric tensors (..., 3, 3) from their entries xx, xy, yy, xz, yz, zz, shape (..., 6)."""
    tensors: Array = entries[..., [[0, 1, 3], [1, 2, 4], [3, 4, 5]]]
    return tensors


def entries_of(tensors: Array) -> Array:
    """Entries xx, xy, yy, xz, yz, zz (..., 6) of symmetric tensors, shape (..., 3, 3)."""
    entries: Array = tensors[..., [0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]]
    return entries


def com_features(com: Array, inertia: Array) -> Array:
    """The ten parameters of one kilogram, (P, 10), with centres of mass (P, 3) [m] and an inertia (3, 3) [m²]."""
    about_tool = inertia + (com**2).sum(axis=1)[:, None, None] * np.eye(3) - com[:, :, None] * com[:, None, :]
    return np.column_stack([np.ones(len(com)), com, entries_of(about_tool)])


def quadratic_forms(rows: Array, inertia: Array) -> tuple[Array, Array, Array]:
    """Rows of slopes as quadratic forms a + b·c + cᵀ Q c of the centre of mass c.

    Args:
        rows: slopes per kilogram, shape (R, 10).
        inertia: inertia per kilogram about the centre of mass, shape (3, 3) [m²].

    Returns:
        a (R,), b (R, 3), Q (R, 3, 3).
    """
    tensors = tensor_of(rows[:, 4:] * np.array([1.0, 0.5, 1.0, 0.5, 0.5, 1.0]))
    trace = np.trace(tensors, axis1=1, axis2=2)
    a = rows[:, 0] + (tensors * inertia).sum(axis=(1, 2))
    return a, rows[:, 1:4], trace[:, None, None] * np.eye(3) - tensors


def _body(payload: Payload) -> Any:
    inertia = np.zeros((3, 3)) if payload.inertia is None else np.array(payload.inertia)
    return pin.Inertia(payload.mass, np.array(payload.com), inertia)


def _checked_inertia(inertia: Any, mass: float) -> tuple[tuple[float, ...], ...]:
    tensor = numbers(inertia, name="payload.inertia", shape=(3, 3))
    moments = np.linalg.eigvalsh(tensor)
    physical = np.allclose(tensor, tensor.T, rtol=1e-9) and moments[0] >= 0.0
    if not (physical and moments[2] <= moments[0] + moments[1] + 1e-12 * moments[2]):
        raise InvalidInputError(
            "payload.inertia: expected a symmetric tensor whose principal moments obey the triangle inequality, "
            f"got {tensor.tolist()}"
        )
    if not mass > 0.0:
        raise InvalidInputError("payload.inertia: a payload without mass has no inertia")
    radius = float(np.sqrt(moments[2] / mass))
    if radius > _WIDEST:
        raise InvalidInputError(
            f"payload.inertia: {moments[2]:g} kg·m² for {mass:g} kg is that of a body with a radius of gyration of "
            f"{radius:.3g} m and looks like kg·mm²: 1 kg·mm² is 1e-6 kg·m²"
        )
    return tuple(map(tuple, tensor.tolist()))
