"""How far the tool gives way because the joints do: each by the torque that it bears, over its stiffness.

Motors are taken to be where they should be, and links to be rigid. What a joint bears is the effort without that of the
rotor, which is before the gear that gives way.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError
from trajevo.robot.kinematics import ToolKinematics
from trajevo.robot.robot import Robot

#: Which torques count: all, or those of the payload alone, as of a robot that was calibrated without one.
COUNTED = ("all", "payload")


@final
@dataclass(frozen=True, eq=False)
class Bending:
    """Joints that give way under load, and the tool that they carry.

    Attributes:
        kinematics: those of the tool.
        compliance: angle over torque of every joint, 0 if its stiffness is not known, shape (n_joints,) [rad/(N·m) or
            m/N].
    """

    kinematics: ToolKinematics
    compliance: Array

    __repr__ = brief

    @classmethod
    def of(cls, robot: Robot) -> Bending:
        """The joints of a robot.

        Raises:
            InvalidInputError: no joint has a stiffness, or the robot is joints and limits alone.
        """
        known = [getattr(robot.drives.get(name), "stiffness", None) for name in robot.joint_names]
        if not any(known):
            raise InvalidInputError(
                f"robot {robot.name!r} has no stiffness of any joint, so that its tool does not give way: give it "
                f"in robot.toml ([drives.{robot.joint_names[0]}] stiffness), in the [robot] of a task, or as an "
                "argument (load_robot(..., drives={...}))"
            )
        compliance = np.array([1.0 / stiffness if stiffness else 0.0 for stiffness in known])
        return cls(ToolKinematics.of(robot), frozen(compliance))

    def per_load(self, q: Array) -> Array:
        """What every joint moves the tool's origin for what it bears, in the base frame.

        Args:
            q: positions, shape (..., n_joints) [rad or m].

        Returns:
            Shape (..., 3, n_joints) [m/(N·m) or m/N].
        """
        moved: Array = -self.kinematics.jacobian(q)[..., :3, :] * self.compliance
        return moved

    def by_joint(self, q: Array, load: Array) -> Array:
        """What every joint moves the tool's origin, in the base frame, shape (..., 3, n_joints) [m].

        Args:
            q: positions, shape (..., n_joints) [rad or m].
            load: what the joints bear, the same shape [N·m or N].
        """
        moved: Array = self.per_load(q) * load[..., None, :]
        return moved


def known_stiffness(robot: Robot) -> tuple[str, ...]:
    """Names of the joints whose stiffness is known."""
    return tuple(name for name, drive in robot.drives.items() if drive.stiffness is not None)
