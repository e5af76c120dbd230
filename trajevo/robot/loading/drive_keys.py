"""The keys of a joint's drive, and of the supply of all, in ``robot.toml`` and ``task.toml``."""

from __future__ import annotations

from typing import Annotated, Literal

import pydantic

from trajevo.robot.loading.told import Amount, Number, Told, amount, source


class DriveKeys(Told):
    """The drive of a joint, as :class:`trajevo.robot.drive.Drive` says; numbers in SI units, or text with a unit."""

    peak_torque: Amount | None = amount("Greatest torque of the motor times the gear ratio", "N*m or N")
    continuous_torque: Amount | None = amount("Greatest root mean square of that torque over a cycle", "N*m or N")
    torque_speed: list[tuple[Amount, Amount]] | None = pydantic.Field(
        None,
        description="Points of the joint's speed and the greatest torque with which it can be driven then, from speed "
        "0 on; texts have their units [rad/s or m/s; N*m or N].",
    )
    gear_ratio: Number | None = pydantic.Field(
        None, description="Radians of the motor per radian or metre of the joint; no unit."
    )
    efficiency_driving: Number | None = pydantic.Field(
        None, description="Efficiency of the gear while the motor drives, at most 1; no unit."
    )
    efficiency_driven: Number | None = pydantic.Field(
        None, description="The same while the load drives the motor; as `efficiency_driving` if not given."
    )
    rotor_inertia: Amount | None = pydantic.Field(
        None, description="Inertia of what turns with the motor, in place of the joint's armature [kg*m^2]."
    )
    stiffness: Amount | None = amount("Torque over the angle by which the joint gives way", "N*m/rad or N/m")
    winding_resistance: Amount | None = amount("Resistance of the winding", "ohm")
    torque_constant: Amount | None = amount("Torque of the motor per current", "N*m/A")
    inverter_drop: Amount | None = amount("Voltage that the inverter drops, lost times the current", "V")
    thermal_resistance: Amount | None = amount("From the winding to its surroundings", "K/W")
    thermal_time_constant: Amount | None = amount("In which the winding warms up", "s")
    greatest_rise: Amount | None = amount("Greatest temperature of the winding above its surroundings", "K")
    brake: Annotated[bool, pydantic.Strict()] | None = pydantic.Field(
        None, description="A brake holds the joint while it stands."
    )
    source: str | None = pydantic.Field(None, description="Where the numbers come from.")


class SourcedDriveKeys(DriveKeys):
    """The same with its source, as a file that others use must have it."""

    source: str = source()


class SupplyKeys(Told):
    """The supply of all drives, as :class:`trajevo.robot.loading.supply.Supply` says; SI units, or text with a unit."""

    standby_power: Amount | None = amount("What the controller draws as long as it is on", "W")
    peak_power: Amount | None = amount("Greatest power that it gives to all motors together", "W")
    recuperation: Literal["none", "shared", "full"] | None = pydantic.Field(
        None,
        description="Energy that motors give back: burnt at each drive, shared on a DC link whose braking resistor "
        "burns the rest (if not given), or fed to the mains.",
    )
    link_capacitance: Amount | None = amount("Of the capacitors of the DC link", "F")
    link_voltage: Amount | None = amount("Of the DC link while the mains feed it", "V")
    chopper_voltage: Amount | None = amount("At which the braking resistor is switched on", "V")
    source: str | None = pydantic.Field(None, description="Where the numbers come from.")


class SourcedSupplyKeys(SupplyKeys):
    """The same with its source, as a file that others use must have it."""

    source: str = source()
