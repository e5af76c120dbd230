"""The keys of points and of loads in ``task.toml``."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import pydantic

from trajevo.formulation.keys.robot_keys import Keys
from trajevo.robot.payload import LOAD_MODELS

_Number = Annotated[float, pydantic.Strict()]


class LoadKeys(Keys):
    """A payload; it is carried from one point to another, or all the time without ``from`` and ``to``."""

    mass: _Number | str = pydantic.Field(description="Its mass; a text has its unit [kg].")
    com: tuple[_Number | str, _Number | str, _Number | str] = pydantic.Field(
        (0.0, 0.0, 0.0), description="Its centre of mass in the tool's frame, x, y and z; a text has its unit [m]."
    )
    inertia: list[list[_Number]] | None = pydantic.Field(
        None, description="Its inertia about the centre of mass, 3 rows of 3 [kg*m^2]."
    )
    model: str = pydantic.Field("rigid", description=f"How it acts: {', '.join(LOAD_MODELS)}.")
    from_point: Annotated[int, pydantic.Field(strict=True, ge=0)] | None = pydantic.Field(
        None, alias="from", description="Point at which it is picked up, counted from 0; after a dwell there."
    )
    to_point: Annotated[int, pydantic.Field(strict=True, ge=0)] | None = pydantic.Field(
        None, alias="to", description="Point at which it is put down, counted from 0; before a dwell there."
    )
    vary: Annotated[bool, pydantic.Strict()] | None = pydantic.Field(
        None, description="Capacities, and objectives that choose the payload, mean this load."
    )
    shape: dict[str, Any] | None = pydantic.Field(
        None,
        description="Solid that keeps the clearance of the scene while it is carried, about `com` in the tool's frame; "
        "its keys are those of an obstacle.",
    )
    touches: list[str] | None = pydantic.Field(
        None, description="Names of obstacles and links from which it need not stay away."
    )


class PointKeys(Keys):
    """A via point: joint positions, or a tool position [m] and, if it matters, the tool's orientation.

    The orientation is ``rpy`` (roll, pitch, yaw), ``quaternion`` (x, y, z, w) or ``rotation_vector`` (axis times
    angle). With it ``free`` names an axis of the tool, x, y or z, about which any orientation is right.
    """

    joints: list[_Number] | None = pydantic.Field(
        None, description="Joint positions in the order of the robot's joints [angle or m]."
    )
    position: tuple[_Number, _Number, _Number] | None = pydantic.Field(
        None, description="Position of the tool in the base frame [m]."
    )
    rpy: tuple[_Number, _Number, _Number] | None = pydantic.Field(
        None, description="Orientation of the tool: roll, pitch and yaw [angle]."
    )
    quaternion: tuple[_Number, _Number, _Number, _Number] | None = pydantic.Field(
        None, description="Orientation of the tool: x, y, z, w [1]."
    )
    rotation_vector: tuple[_Number, _Number, _Number] | None = pydantic.Field(
        None, description="Orientation of the tool: axis times angle [angle]."
    )
    free: Literal["x", "y", "z"] | None = pydantic.Field(
        None, description="Axis of the tool about which any orientation is right."
    )

    @pydantic.model_validator(mode="after")
    def _one_kind(self) -> PointKeys:
        if (self.joints is None) == (self.position is None):
            raise ValueError(
                "expected either joints, or position and, if the orientation matters, rpy, quaternion or "
                "rotation_vector"
            )
        given = [key for key in ("rpy", "quaternion", "rotation_vector") if getattr(self, key) is not None]
        if self.joints is not None and given:
            raise ValueError(f"joints have no {given[0]}")
        if self.free is not None and not given:
            raise ValueError("free: expected rpy, quaternion or rotation_vector with it, of which one axis is free")
        if len(given) > 1:
            raise ValueError(f"expected {given[0]} or {given[1]}, got both")
        return self
