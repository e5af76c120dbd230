"""The keys of a joint's drive in ``robot.toml`` and ``task.toml``."""

from __future__ import annotations

from typing import Annotated, Any

import pydantic

_Number = Annotated[float, pydantic.Strict()]
_Amount = _Number | str


class DriveKeys(pydantic.BaseModel):
    """The drive of a joint, as :class:`trajevo.robot.drive.Drive` says; numbers in SI units, or text with a unit."""

    model_config = pydantic.ConfigDict(extra="forbid", frozen=True, defer_build=True)

    peak_torque: _Amount | None = pydantic.Field(
        None, description="Greatest torque of the motor times the gear ratio; a text has its unit [N*m or N]."
    )
    continuous_torque: _Amount | None = pydantic.Field(
        None, description="Greatest root mean square of that torque over a cycle; a text has its unit [N*m or N]."
    )
    torque_speed: list[tuple[_Amount, _Amount]] | None = pydantic.Field(
        None,
        description="Points of the joint's speed and the greatest torque with which it can be driven then, from speed "
        "0 on; texts have their units [rad/s or m/s; N*m or N].",
    )
    gear_ratio: _Number | None = pydantic.Field(
        None, description="Radians of the motor per radian or metre of the joint; no unit."
    )
    efficiency_driving: _Number | None = pydantic.Field(
        None, description="Efficiency of the gear while the motor drives, at most 1; no unit."
    )
    efficiency_driven: _Number | None = pydantic.Field(
        None, description="The same while the load drives the motor; as `efficiency_driving` if not given."
    )
    rotor_inertia: _Amount | None = pydantic.Field(
        None, description="Inertia of what turns with the motor, in place of the joint's armature [kg*m^2]."
    )
    stiffness: _Amount | None = pydantic.Field(
        None,
        description="Torque over the angle by which the joint gives way; a text has its unit [N*m/rad or N/m].",
    )
    winding_resistance: _Amount | None = pydantic.Field(
        None, description="Resistance of the winding; a text has its unit [ohm]."
    )
    torque_constant: _Amount | None = pydantic.Field(
        None, description="Torque of the motor per current; a text has its unit [N*m/A]."
    )
    thermal_resistance: _Amount | None = pydantic.Field(
        None, description="From the winding to its surroundings; a text has its unit [K/W]."
    )
    thermal_time_constant: _Amount | None = pydantic.Field(
        None, description="In which the winding warms up; a text has its unit [s]."
    )
    greatest_rise: _Amount | None = pydantic.Field(
        None, description="Greatest temperature of the winding above its surroundings; a text has its unit [K]."
    )
    brake: Annotated[bool, pydantic.Strict()] | None = pydantic.Field(
        None, description="A brake holds the joint while it stands."
    )
    source: str | None = pydantic.Field(None, description="Where the numbers come from.")

    @property
    def arguments(self) -> dict[str, Any]:
        """What is given, as plain data."""
        return self.model_dump(exclude_none=True)


class SourcedDriveKeys(DriveKeys):
    """The same with its source, as a file that others use must have it."""

    source: str = pydantic.Field(description="Where the numbers come from.")
