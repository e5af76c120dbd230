"""Robots: a Pinocchio model with the limits that a URDF cannot hold.

A robot is a folder ``<name>/`` with ``<name>.urdf``, ``robot.toml`` (limits with their units, tool frame) and
``SOURCE.md`` (where each number comes from).
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import pinocchio as pin
import pydantic

from trajevo.arrays import Array, read_only
from trajevo.errors import InvalidInputError, UnknownNameError
from trajevo.units import per_time, si_unit, to_si

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
class Robot:
    """A robot whose joints are planned for: Pinocchio model, limits and tool frame.

    Attributes:
        name: name of the robot.
        model: Pinocchio model with one configuration coordinate per joint (nq == nv).
        limits: joint limits, SI.
        joint_names: names of the joints in the order of every (..., n_joints) array.
        joint_units: ``"rad"`` or ``"m"`` per joint.
        tool: name of the frame at the end effector.
        source: folder the robot was loaded from.
        reference: where its numbers come from, one line.
    """

    name: str
    model: Any
    limits: JointLimits
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
        data = self.model.createData()
        frame = self.model.getFrameId(self.tool)
        positions, rotations = np.empty((len(q), 3)), np.empty((len(q), 3, 3))
        for i, configuration in enumerate(np.asarray(q, dtype=np.float64)):
            pin.forwardKinematics(self.model, data, configuration)
            placement = pin.updateFramePlacement(self.model, data, frame)
            positions[i], rotations[i] = placement.translation, placement.rotation
        return positions, rotations


def list_robots() -> list[str]:
    """Names of the robots that come with trajevo."""
    return sorted(folder.name for folder in ROBOTS_FOLDER.iterdir() if (folder / "robot.toml").is_file())


def load_robot(name: str | Path) -> Robot:
    """Load a robot by name or from a folder of the same make-up.

    Args:
        name: a name of :func:`list_robots`, or the path of a folder with ``robot.toml`` and the URDF it names.

    Returns:
        The robot, limits in SI.

    Raises:
        UnknownNameError: no such robot.
        InvalidInputError: a file of the robot cannot be used; the message names file, joint and value.
    """
    folder = ROBOTS_FOLDER / str(name)
    if str(name) not in list_robots():
        folder = Path(name)
        if not (folder / "robot.toml").is_file():
            raise UnknownNameError("robot", name, list_robots())
    settings = _read_settings(folder / "robot.toml")
    model = _load_model(folder / settings.urdf)
    names = tuple(model.names[1:])
    units = tuple(
        _joint_unit(joint, name, folder / settings.urdf) for joint, name in zip(model.joints[1:], names, strict=True)
    )
    if not model.existFrame(settings.tool):
        frames = [frame.name for frame in model.frames]
        raise UnknownNameError(f"tool frame in {folder / 'robot.toml'}", settings.tool, frames)
    return Robot(
        name=settings.name,
        model=model,
        limits=_limits(settings, names, units, folder / "robot.toml"),
        joint_names=names,
        joint_units=units,
        tool=settings.tool,
        source=folder,
        reference=settings.reference,
    )


class _Strict(pydantic.BaseModel):
    model_config = pydantic.ConfigDict(extra="forbid", frozen=True)


class _Limit(_Strict):
    limit: Annotated[float, pydantic.Field(gt=0.0)]
    unit: str


class _Range(_Strict):
    lower: float
    upper: float
    unit: str


class _Joint(_Strict):
    position: _Range
    velocity: _Limit
    acceleration: _Limit
    jerk: _Limit
    effort: _Limit


class _Settings(_Strict):
    name: str
    urdf: str
    tool: str
    reference: str
    format: Literal[1]
    joints: dict[str, _Joint]


def _read_settings(file: Path) -> _Settings:
    try:
        return _Settings.model_validate(tomllib.loads(file.read_text(encoding="utf-8")))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InvalidInputError(f"{file}: cannot be read as TOML: {error}") from error
    except pydantic.ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise InvalidInputError(f"{file}: {place}: {first['msg']}, got {first['input']!r}") from error


def _load_model(file: Path) -> Any:
    if not file.is_file():
        raise InvalidInputError(f"{file}: no such URDF file")
    try:
        return pin.buildModelFromUrdf(str(file))
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


def _limits(settings: _Settings, names: tuple[str, ...], units: tuple[str, ...], file: Path) -> JointLimits:
    if set(settings.joints) != set(names):
        raise InvalidInputError(
            f"{file}: limits given for joints {sorted(settings.joints)}, the URDF has {sorted(names)}"
        )

    def column(pick: Callable[[_Joint], tuple[float, str]], expected: Callable[[str], str]) -> list[float]:
        values = []
        for name, unit in zip(names, units, strict=True):
            value, given = pick(settings.joints[name])
            if si_unit(given) != expected(unit):
                raise InvalidInputError(
                    f"{file}: joint {name!r}: unit {given!r}, expected one that converts to {expected(unit)!r}"
                )
            values.append(value * to_si(given) if math.isfinite(value) else value)
        return values

    return JointLimits(
        lower=read_only(column(lambda joint: (joint.position.lower, joint.position.unit), lambda unit: unit)),
        upper=read_only(column(lambda joint: (joint.position.upper, joint.position.unit), lambda unit: unit)),
        velocity=read_only(column(lambda joint: (joint.velocity.limit, joint.velocity.unit), lambda u: per_time(u, 1))),
        acceleration=read_only(
            column(lambda joint: (joint.acceleration.limit, joint.acceleration.unit), lambda u: per_time(u, 2))
        ),
        jerk=read_only(column(lambda joint: (joint.jerk.limit, joint.jerk.unit), lambda u: per_time(u, 3))),
        effort=read_only(
            column(lambda joint: (joint.effort.limit, joint.effort.unit), lambda u: "N" if u == "m" else "N*m")
        ),
    )
