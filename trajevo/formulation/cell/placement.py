"""Where the base of a solution's robot stands."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, final

import numpy as np

from trajevo.dynamics.rollout import Rollout
from trajevo.robot.files.cell import base_of


@final
@dataclass(frozen=True)
class BasePlacement:
    """Where the base of a robot stands in the cell.

    Attributes:
        position: origin of the base, x, y and z [m].
        rpy: roll, pitch and yaw of the base about the fixed axes of the cell [rad].
        moved: how far the origin is from the given place, along x, y and z [m].
        yaw: how far the base is turned from there about the vertical axis [rad].
    """

    position: tuple[float, float, float]
    rpy: tuple[float, float, float]
    moved: tuple[float, float, float]
    yaw: float

    @classmethod
    def of(cls, rollout: Rollout) -> BasePlacement | None:
        """That of the first motion of a rollout; None if its base does not move."""
        arranged = rollout.arranged
        if arranged is None or arranged.bases is None or arranged.origin is None:
            return None
        x, y, z, yaw = np.asarray(arranged.bases[0].real).tolist()
        given, rpy = arranged.origin.tolist(), base_of(rollout.robot.description()).rpy.tolist()
        position = given[0] + x, given[1] + y, given[2] + z
        return cls(position, (rpy[0], rpy[1], rpy[2] + yaw), (x, y, z), yaw)

    @property
    def settings(self) -> dict[str, Any]:
        """Plain data, the argument ``base`` of :func:`~trajevo.load_robot` that puts the robot there."""
        return {"position": list(self.position), "rpy": list(self.rpy)}

    def __str__(self) -> str:
        places = ", ".join(f"{axis} {_told(value)} m" for axis, value in zip("xyz", self.position, strict=True))
        turned = f", yaw {np.degrees(self.rpy[2]):.4g} deg" if self.rpy[2] or self.yaw else ""
        away = ", ".join(_told(value, "+") for value in self.moved)
        return f"{places}{turned} (moved by {away} m{f', {np.degrees(self.yaw):+.4g} deg' if self.yaw else ''})"


def _told(value: float, sign: str = "") -> str:
    """A length [m] to 4 digits; what is below a nanometre is 0."""
    return format(round(value, 9) + 0.0, f"{sign}.4g")
