"""Robots in MuJoCo, a second engine that shares neither code nor reader of URDFs with trajevo.

Of a robot that trajevo loaded only the path of its URDF is taken, the names of its joints and its tool, where joints
are locked, and its friction, which trajevo takes from ``robot.toml`` before the URDF. Coordinates are those of
the URDF's joints, which a transmission tells from those of the actuators.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np

#: Read the masses as they stand: nothing guessed from shapes, made physical, or merged. MuJoCo refuses a moving body
#: without mass, as the first of the PUMA 560, whose inertia is an armature; ten femtograms weigh on no torque.
READING = {
    "discardvisual": "true",
    "fusestatic": "false",
    "inertiafromgeom": "false",
    "balanceinertia": "false",
    "boundmass": "1e-14",
    "boundinertia": "1e-14",
}


@dataclass(frozen=True, eq=False)
class Twin:
    """A robot with a rigid payload in MuJoCo.

    Attributes:
        model: the compiled model; its joints may come in another order than the robot's.
        columns: coordinate of every joint of the robot in the model, shape (n_joints,).
        held: coordinates of the model with locked joints at their positions.
        tool: number of the body at the tool.
    """

    model: Any
    columns: np.ndarray
    held: np.ndarray
    tool: int

    @classmethod
    def of(cls, robot, payload=None, *, gravity=(0.0, 0.0, -9.81)):
        spec = mujoco.MjSpec.from_string(without_shapes(ElementTree.parse(robot.urdf).getroot()))
        spec.option.gravity = gravity
        # What touches, what is coupled and what is at its stop would add forces that trajevo does not have.
        spec.option.disableflags = int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT | mujoco.mjtDisableBit.mjDSBL_CONTACT)
        if payload is not None and payload.mass > 0.0:
            own = np.zeros((3, 3)) if payload.inertia is None else np.array(payload.inertia)
            spec.body(robot.tool).add_body(
                mass=payload.mass,
                ipos=payload.com,
                fullinertia=[*own.diagonal(), own[0, 1], own[0, 2], own[1, 2]],
                explicitinertial=True,
            )
        model = spec.compile()
        columns = np.array([model.joint(name).dofadr[0] for name in list(robot.model.names)[1:]])
        held = np.zeros(model.nq)
        for name, position in robot.locked.items():
            held[model.joint(name).qposadr[0]] = position
        model.dof_damping[:] = model.dof_armature[:] = model.dof_frictionloss[:] = 0.0
        model.dof_damping[columns], model.dof_armature[columns] = robot.friction.viscous, robot.friction.armature
        return cls(model, columns, held, model.body(robot.tool).id)

    def effort(self, q, v, a):
        """Effort of the joints by ``mj_inverse`` in N states, all (N, n_joints), without dry friction.

        MuJoCo's own dry friction is a constraint that its solver softens, no force that is known to 1e-9.
        """
        data = mujoco.MjData(self.model)
        found = np.empty((len(q), self.model.nv))
        # Whole rows are copied, which takes a third of the time of picking columns in every state.
        for position, velocity, acceleration, effort in zip(*self._rows(q, v, a), found, strict=True):
            data.qpos[:], data.qvel[:], data.qacc[:] = position, velocity, acceleration
            mujoco.mj_inverse(self.model, data)
            effort[:] = data.qfrc_inverse
        return found[:, self.columns]

    def tool_poses(self, q):
        """Positions (N, 3) [m] and rotation matrices (N, 3, 3) of the tool."""
        data = mujoco.MjData(self.model)
        positions, rotations = np.empty((len(q), 3)), np.empty((len(q), 9))
        for row, position, rotation in zip(self._rows(q)[0], positions, rotations, strict=True):
            data.qpos[:] = row
            mujoco.mj_kinematics(self.model, data)
            position[:], rotation[:] = data.xpos[self.tool], data.xmat[self.tool]
        return positions, rotations.reshape(-1, 3, 3)

    def tool_speed(self, q, v):
        """Speed of the tool's origin, shape (N,) [m/s]."""
        data, twist = mujoco.MjData(self.model), np.empty((len(q), 6))
        for position, velocity, found in zip(*self._rows(q, v), twist, strict=True):
            data.qpos[:], data.qvel[:] = position, velocity
            mujoco.mj_kinematics(self.model, data)
            mujoco.mj_comPos(self.model, data)
            mujoco.mj_comVel(self.model, data)
            mujoco.mj_objectVelocity(self.model, data, mujoco.mjtObj.mjOBJ_XBODY, self.tool, found, 0)
        return np.linalg.norm(twist[:, 3:], axis=1)

    def _rows(self, q, *rates):
        """Coordinates of the model, shape (N, n), from those of the robot's joints."""
        rows = np.zeros((1 + len(rates), len(q), self.model.nv))
        rows[0] = self.held
        rows[:, :, self.columns] = [q, *rates]
        return rows


def without_shapes(root):
    """Text of a URDF without what is drawn or touched, whose files need not be there, and with settings for MuJoCo."""
    for link in root.iterfind("link"):
        for shape in [*link.iterfind("visual"), *link.iterfind("collision")]:
            link.remove(shape)
    ElementTree.SubElement(ElementTree.SubElement(root, "mujoco"), "compiler", READING)
    return ElementTree.tostring(root, encoding="unicode")
