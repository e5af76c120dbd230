"""The keys of a joint's drive, and of the supply of all, in ``robot.toml`` and ``task.toml``."""

from __future__ import annotations

from typing import Annotated, Any, Literal

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
    inverter_drop: _Amount | None = pydantic.Field(
        None, description="Voltage that the inverter drops, lost times the current; a text has its unit [V]."
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


class SupplyKeys(pydantic.BaseModel):
    """The supply of all drives, as :class:`trajevo.robot.loading.supply.Supply` says; SI units, or text with a unit."""

    model_config = pydantic.ConfigDict(extra="forbid", frozen=True, defer_build=True)

    standby_power: _Amount | None = pydantic.Field(
        None, description="What the controller draws as long as it is on; a text has its unit [W]."
    )
    peak_power: _Amount | None = pydantic.Field(
        None, description="Greatest power that it gives to all motors together; a text has its unit [W]."
    )
    recuperation: Literal["none", "shared", "full"] | None = pydantic.Field(
        None,
        description="Energy that motors give back: burnt at each drive, shared on a DC link whose braking resistor "
        "burns the rest (if not given), or fed to the mains.",
    )
    link_capacitance: _Amount | None = pydantic.Field(
        None, description="Of the capacitors of the DC link; a text has its unit [F]."
    )
    link_voltage: _Amount | None = pydantic.Field(
        None, description="Of the DC link while the mains feed it; a text has its unit [V]."
    )
    chopper_voltage: _Amount | None = pydantic.Field(
        None, description="At which the braking resistor is switched on; a text has its unit [V]."
    )
    source: str | None = pydantic.Field(None, description="Where the numbers come from.")

    @property
    def arguments(self) -> dict[str, Any]:
        """What is given, as plain data."""
        return self.model_dump(exclude_none=True)


class SourcedSupplyKeys(SupplyKeys):
    """The same with its source, as a file that others use must have it."""

    source: str = pydantic.Field(description="Where the numbers come from.")
