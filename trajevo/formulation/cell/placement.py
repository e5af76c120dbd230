"""Where the base of a solution's robot stands."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, final

import numpy as np

from trajevo.dynamics.rollout import Rollout
from trajevo.formulation.constraints.scenes.rotations import matrix_of, rpy_of
from trajevo.robot.files.cell import base_of
from trajevo.trajectory.arranged import base_rotations


@final
@dataclass(frozen=True)
class BasePlacement:
    """Where the base of a robot stands in the cell.

    Attributes:
        position: origin of the base, x, y and z [m].
        rpy: roll, pitch and yaw of the base about the fixed axes of the cell [rad].
        moved: how far the origin is from the given place, along x, y and z [m].
        yaw: how far the base is turned from there about the vertical axis [rad].
        pitch: how far it is tilted from there about y of the cell, before the yaw [rad].
        roll: how far it is tilted from there about x of the cell, before the pitch [rad].
    """

    position: tuple[float, float, float]
    rpy: tuple[float, float, float]
    moved: tuple[float, float, float]
    yaw: float
    pitch: float = 0.0
    roll: float = 0.0

    @classmethod
    def of(cls, rollout: Rollout) -> BasePlacement | None:
        """That of the first motion of a rollout; None if its base does not move."""
        arranged = rollout.arranged
        if arranged is None or arranged.bases is None or arranged.origin is None:
            return None
        bases = np.asarray(arranged.bases[:1].real)
        x, y, z, yaw, *tilt = bases[0].tolist()
        given, rpy = arranged.origin.tolist(), base_of(rollout.robot.description()).rpy
        position = given[0] + x, given[1] + y, given[2] + z
        roll, pitch, turn = rpy.tolist()
        if not any(tilt):
            return cls(position, (roll, pitch, turn + yaw), (x, y, z), yaw)
        turned = rpy_of(base_rotations(bases)[0] @ matrix_of(rpy.tolist()), "base")
        return cls(position, turned, (x, y, z), yaw, *tilt)

    @property
    def settings(self) -> dict[str, Any]:
        """Plain data, the argument ``base`` of :func:`~trajevo.load_robot` that puts the robot there."""
        return {"position": list(self.position), "rpy": list(self.rpy)}

    def __str__(self) -> str:
        places = ", ".join(f"{axis} {_told(value)} m" for axis, value in zip("xyz", self.position, strict=True))
        away = ", ".join(_told(value, "+") for value in self.moved)
        if self.pitch or self.roll:
            names = "roll", "pitch", "yaw"
            angles = (f"{name} {np.degrees(each):.4g} deg" for name, each in zip(names, self.rpy, strict=True))
            moved = zip(names, (self.roll, self.pitch, self.yaw), strict=True)
            by = ", ".join(f"{name} {np.degrees(each):+.4g} deg" for name, each in moved)
            return f"{places}, {', '.join(angles)} (moved by {away} m, {by})"
        turned = f", yaw {np.degrees(self.rpy[2]):.4g} deg" if self.rpy[2] or self.yaw else ""
        return f"{places}{turned} (moved by {away} m{f', {np.degrees(self.yaw):+.4g} deg' if self.yaw else ''})"


def _told(value: float, sign: str = "") -> str:
    """A length [m] to 4 digits; what is below a nanometre is 0."""
    return format(round(value, 9) + 0.0, f"{sign}.4g")
