"""Robots: a Pinocchio model with the limits that a URDF cannot hold.

A robot is a folder ``<name>/`` with ``<name>.urdf``, ``robot.toml`` (limits with their units, tool frame) and
``SOURCE.md`` (where each number comes from).
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from trajevo.arrays import Array, numbers, read_only
from trajevo.errors import InvalidInputError, UnknownNameError
from trajevo.robot_check import checked_urdf
from trajevo.robot_file import RobotFile
from trajevo.transmission import Transmission

ROBOTS_FOLDER = Path(__file__).resolve().parents[1] / "robots"


@dataclass(frozen=True, eq=False)
class JointLimits:
    """Limits of each joint, arrays of shape (n_joints,), SI: rad or m, s, N·m or N.

    Every limit is a number or an explicit ``inf``; none has a default.

    Attributes:
        lower: least position [rad or m].
        upper: greatest position [rad or m].
        velocity: greatest speed [rad/s or m/s].
        acceleration: greatest acceleration [rad/s² or m/s²].
        jerk: greatest jerk [rad/s³ or m/s³].
        effort: greatest torque or force [N·m or N].

    Raises:
        InvalidInputError: shapes differ, a limit is NaN or not positive, or lower is not below upper.
    """

    lower: Array
    upper: Array
    velocity: Array
    acceleration: Array
    jerk: Array
    effort: Array

    def __post_init__(self) -> None:
        for field in fields(self):
            values = read_only(getattr(self, field.name))
            object.__setattr__(self, field.name, values)
            if values.shape != self.lower.shape or values.ndim != 1:
                raise InvalidInputError(f"limits.{field.name}: expected shape {self.lower.shape}, got {values.shape}")
            if np.isnan(values).any():
                raise InvalidInputError(f"limits.{field.name}: expected numbers or inf, got NaN")
            if field.name not in ("lower", "upper") and not (values > 0.0).all():
                raise InvalidInputError(f"limits.{field.name}: expected positive numbers or inf, got {values.tolist()}")
        if not (self.lower < self.upper).all():
            raise InvalidInputError(
                f"limits: lower must be below upper, got {self.lower.tolist()} and {self.upper.tolist()}"
            )


@dataclass(frozen=True, eq=False)
class Friction:
    """What the actuators add to the rigid-body effort: viscous v + dry friction against v + armature a, (n_joints,).

    Attributes:
        viscous: [N·m·s/rad or N·s/m].
        coulomb: dry friction of a joint that moves forward, and of any where it is the same both ways [N·m or N].
        armature: inertia of motor and gear seen at the joint [kg·m² or kg].
        coulomb_backward: dry friction of a joint that moves backward; as forward if None.
    """

    viscous: Array
    coulomb: Array
    armature: Array
    coulomb_backward: Array | None = None

    def __post_init__(self) -> None:
        if self.coulomb_backward is None:
            object.__setattr__(self, "coulomb_backward", self.coulomb)
        for field in fields(self):
            values = read_only(getattr(self, field.name))
            object.__setattr__(self, field.name, values)
            if values.shape != self.viscous.shape or values.ndim != 1:
                raise InvalidInputError(
                    f"friction.{field.name}: expected shape {self.viscous.shape}, got {values.shape}"
                )
            if not (np.isfinite(values).all() and (values >= 0.0).all()):
                raise InvalidInputError(f"friction.{field.name}: expected numbers from 0 on, got {values.tolist()}")

    @property
    def none(self) -> bool:
        """Whether it adds nothing."""
        return not any(getattr(self, field.name).any() for field in fields(self))

    def effort(self, v: Array, a: Array) -> Array:
        """What it adds at velocities and accelerations of shape (..., n_joints); nothing dry where a joint stands."""
        against = np.where(v.real > 0.0, self.coulomb, -np.asarray(self.coulomb_backward)) * (v.real != 0.0)
        added: Array = self.viscous * v + against + self.armature * a
        return added


@dataclass(frozen=True, eq=False)
class Robot:
    """A robot whose actuators are planned for: Pinocchio model, transmission, limits, friction and tool frame.

    "Joint" means an actuated coordinate everywhere; for most robots these are the joints of the model.

    Attributes:
        name: name of the robot.
        model: Pinocchio model with one configuration coordinate per joint (nq == nv), gravity of ``robot.toml``.
        transmission: actuator coordinates -> model coordinates.
        limits: joint limits, SI.
        friction: viscous and Coulomb friction and armature of the actuators.
        joint_names: names of the joints in the order of every (..., n_joints) array.
        joint_units: ``"rad"`` or ``"m"`` per joint.
        tool: name of the frame at the end effector.
        source: folder the robot was loaded from.
        reference: where its numbers come from, one line.
    """

    name: str
    model: Any
    transmission: Transmission
    limits: JointLimits
    friction: Friction
    joint_names: tuple[str, ...]
    joint_units: tuple[str, ...]
    tool: str
    source: Path
    reference: str

    @property
    def dof(self) -> int:
        """Number of joints."""
        return len(self.joint_names)

    def tool_poses(self, q: Array) -> tuple[Array, Array]:
        """Forward kinematics of the tool frame by Pinocchio, for pictures and checks.

        Args:
            q: joint positions, shape (T, n_joints) [rad or m].

        Returns:
            Positions (T, 3) [m] and rotation matrices (T, 3, 3) in the base frame.
        """
        positions, rotations = self.joint_poses(q)
        return positions[:, -1], rotations[:, -1]

    def joint_poses(self, q: Array) -> tuple[Array, Array]:
        """Forward kinematics of the whole chain by Pinocchio: every joint of the model, then the tool.

        Args:
            q: joint positions, shape (T, n_joints) [rad or m].

        Returns:
            Origins (T, n_joints + 1, 3) [m] and rotation matrices (T, n_joints + 1, 3, 3) in the base frame, from the
            base to the tool. A joint's frame moves with it.
        """
        data = self.model.createData()
        tool = self.model.getFrameId(self.tool)
        actuated = numbers(q, name="q", shape=("T", self.dof))
        places = (len(actuated), self.model.njoints)  # Pinocchio counts the base, which here makes room for the tool
        positions, rotations = np.empty((*places, 3)), np.empty((*places, 3, 3))
        still = np.zeros_like(actuated)
        for i, configuration in enumerate(self.transmission.motion(actuated, still, still)[0]):
            pin.forwardKinematics(self.model, data, configuration)
            for k, placement in enumerate((*data.oMi[1:], pin.updateFramePlacement(self.model, data, tool))):
                positions[i, k], rotations[i, k] = placement.translation, placement.rotation
        return positions, rotations

    @property
    def joint_axes(self) -> tuple[Array, Array]:
        """Unit axis of every joint of the model in its own frame, (n_joints, 3), and whether it turns, (n_joints,)."""
        subspaces = np.array([np.ravel(joint.createData().S) for joint in self.model.joints[1:]])
        turns: Array = np.any(subspaces[:, 3:], axis=1, keepdims=True)
        return np.where(turns, subspaces[:, 3:], subspaces[:, :3]), turns[:, 0]


def list_robots() -> list[str]:
    """Names of the robots that come with trajevo."""
    return sorted(folder.name for folder in ROBOTS_FOLDER.iterdir() if (folder / "robot.toml").is_file())


def load_robot(name: str | Path) -> Robot:
    """Load a robot by name or from a folder of the same make-up.

    Args:
        name: a name of :func:`list_robots`, or the path of a folder with ``robot.toml`` and the URDF it names. A name
            that trajevo knows wins over a folder of that name.

    Returns:
        The robot, limits in SI. Limits of position, velocity and effort are those of ``robot.toml``; the URDF's are
        not used.

    Raises:
        UnknownNameError: neither a known robot nor a folder with ``robot.toml``, or the tool is no frame of the URDF;
            the message lists those that are.
        InvalidInputError: not a name or a path, or a file that cannot be used: ``robot.toml`` as
            :class:`~trajevo.robot_file.RobotFile` says, the URDF as :func:`~trajevo.robot_check.checked_urdf` says or
            because Pinocchio cannot read it or a joint is not revolute or prismatic. The message names the file and,
            where the fault lies in one, the joint or link and the value.
    """
    if not isinstance(name, str | Path):
        raise InvalidInputError(f"robot: expected a name or the path of a folder, got {name!r}")
    folder = ROBOTS_FOLDER / str(name)
    if str(name) not in list_robots():
        folder = Path(name)
        if not (folder / "robot.toml").is_file():
            raise UnknownNameError("robot", name, list_robots())
    file = RobotFile(folder / "robot.toml")
    urdf = folder / file.settings.urdf
    model = _load_model(urdf)
    model.gravity.linear = file.gravity()
    model_names = tuple(model.names[1:])
    model_units = tuple(
        _joint_unit(joint, name, urdf) for joint, name in zip(model.joints[1:], model_names, strict=True)
    )
    transmission, names, units = file.transmission(model_names, model_units)
    if not model.existFrame(file.settings.tool):
        frames = [frame.name for frame in model.frames]
        raise UnknownNameError(f"tool frame in {file.path}", file.settings.tool, frames)
    return Robot(
        name=file.settings.name,
        model=model,
        transmission=transmission,
        limits=JointLimits(**file.limits(names, units)),
        friction=Friction(**file.friction(names, units)),
        joint_names=names,
        joint_units=units,
        tool=file.settings.tool,
        source=folder,
        reference=file.settings.reference,
    )


def _load_model(file: Path) -> Any:
    text = checked_urdf(file)
    try:
        return pin.buildModelFromXML(text)
    except (ValueError, RuntimeError) as error:
        raise InvalidInputError(f"{file}: Pinocchio cannot read it: {error}") from error


def _joint_unit(joint: Any, name: str, file: Path) -> str:
    """Unit of a joint's coordinate; joints with none or several coordinates cannot be planned for."""
    kind = joint.shortname()
    if joint.nq != 1 or joint.nv != 1:
        raise InvalidInputError(
            f"{file}: joint {name!r} is a {kind} with {joint.nq} coordinates; expected revolute or prismatic"
        )
    return "m" if "JointModelP" in kind else "rad"
