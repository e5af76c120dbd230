"""A robot's efforts, tool and distances as Pinocchio gives them, one state after another."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np
import pinocchio as pin

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError
from trajevo.robot.payload import Payload
from trajevo.robot.robot import Robot
from trajevo.robot.transmission import CoupledScrews, Direct

#: Steps of Newton's method to a moved pose, and the error at which it has converged [m and rad].
_STEPS, _REACHED = 30, 1e-13

#: Share of a joint's greatest speed below which it is at rest, for dry friction.
_ROUNDING = 1e-9


@final
@dataclass(frozen=True, eq=False)
class Arm:
    """A robot with a payload.

    Attributes:
        robot: the robot; its model, limits and friction are used.
        payload: the payload.
        model: Pinocchio's model with the payload.
        data: its data.
        tool: number of the tool's frame, -1 without a body.
    """

    robot: Robot
    payload: Payload
    model: Any
    data: Any
    tool: int

    __repr__ = brief

    @classmethod
    def of(cls, robot: Robot, payload: Payload) -> Arm:
        """A robot with a payload.

        Raises:
            InvalidInputError: a payload that is no rigid body, or actuators that drive joints in another way.
        """
        if not isinstance(robot.transmission, Direct | CoupledScrews):
            raise InvalidInputError(f"robot: no plain statement of {type(robot.transmission).__name__}")
        if payload.mass and payload.model != "rigid":
            raise InvalidInputError(f"payload: no plain statement of the model {payload.model!r}")
        model = pin.Model(robot.model)
        tool = model.getFrameId(robot.tool) if robot.has_body else -1
        if payload.mass:
            frame = model.frames[tool]
            inertia = np.zeros((3, 3)) if payload.inertia is None else np.array(payload.inertia)
            body = pin.Inertia(payload.mass, np.array(payload.com), inertia)
            model.appendBodyToJoint(frame.parentJoint, body, frame.placement)
        return cls(robot, payload, model, model.createData(), tool)

    def carrying(self, mass: float) -> Arm:
        """The same with another mass of the payload [kg]."""
        return Arm.of(self.robot, replace(self.payload, mass=mass))

    def efforts(self, q: Array, v: Array, a: Array) -> Array:
        """Efforts of the actuators with friction and armature, shapes (T, n_joints) [N·m or N]."""
        friction = self.robot.friction
        still = _ROUNDING * (np.abs(v).max(axis=0) + np.abs(q).max(axis=0))
        v = np.where(np.abs(v) <= still, 0.0, v) if friction.is_dry else v
        drive = self.robot.transmission
        rigid = self._of_screws(drive, q, v, a) if isinstance(drive, CoupledScrews) else self._torques(q, v, a)
        backward = np.asarray(friction.coulomb_backward)
        dry = np.where(v > 0.0, friction.coulomb, np.where(v < 0.0, -backward, 0.0))
        found: Array = rigid + friction.viscous * v + dry + friction.armature * a
        return found

    def _torques(self, q: Array, v: Array, a: Array) -> Array:
        return np.array([pin.rnea(self.model, self.data, *state) for state in zip(q, v, a, strict=True)])

    def _of_screws(self, drive: CoupledScrews, q: Array, v: Array, a: Array) -> Array:
        """Forces of two parallel screws that drive a slide by their mean and a swivel by their difference."""
        first, second, span = drive.slide, drive.swivel, drive.span
        apart, rate, change = (x[:, second] - x[:, first] for x in (q, v, a))
        slope = span / (span**2 + apart**2)
        bend = -2.0 * span * apart * rate**2 / (span**2 + apart**2) ** 2
        turned = np.arctan(apart / span), slope * rate, slope * change + bend
        states = []
        for x, angle in zip((q, v, a), turned, strict=True):
            state = x.copy()
            state[:, first], state[:, second] = 0.5 * (x[:, first] + x[:, second]), angle
            states.append(state)
        torque = self._torques(states[0], states[1], states[2])
        slide, swivel = 0.5 * torque[:, first], slope * torque[:, second]
        torque[:, first], torque[:, second] = slide - swivel, slide + swivel
        return torque

    def heights(self, q: Array) -> Array:
        """Heights of the tool's origin over the base, shape (T,) [m]."""
        return np.array([self._place(one).translation[2] for one in q])

    def speeds(self, q: Array, v: Array) -> Array:
        """Speeds of the tool's origin, shape (T,) [m/s]."""
        found = []
        for position, velocity in zip(q, v, strict=True):
            pin.forwardKinematics(self.model, self.data, position, velocity)
            twist = pin.getFrameVelocity(self.model, self.data, self.tool, pin.LOCAL)
            found.append(float(np.linalg.norm(twist.linear)))
        return np.array(found)

    def moved(self, q: Array, by: Array) -> tuple[Array, float]:
        """Joint positions (n_joints,) with the tool moved along the base's axes (3,) [m], and the error left."""
        place = self._place(q).copy()
        wanted, error = pin.SE3(place.rotation, place.translation + by), np.inf
        for _ in range(_STEPS):
            now = self._place(q)
            apart = pin.log6(now.actInv(wanted)).vector
            error = float(np.abs(apart).max())
            if error < _REACHED:
                break
            slopes = pin.computeFrameJacobian(self.model, self.data, q, self.tool, pin.LOCAL)
            step = np.linalg.lstsq(slopes, apart, rcond=None)[0]
            q = q + step / max(1.0, 2.0 * float(np.linalg.norm(step)))
        return q, error

    def _place(self, q: Array) -> Any:
        pin.framesForwardKinematics(self.model, self.data, q)
        return self.data.oMf[self.tool]
