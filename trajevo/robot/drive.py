"""The drive of a joint: motor, gear and brake, and what their makers say of them.

Makers state torques at the motor; here all torques of a drive are those of its motor times the gear ratio, so that they
compare with the effort of the joint. Losses of the gear are in the efficiencies, not in the torques.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, final

import numpy as np

from trajevo.base.arrays import real_number
from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError

#: SI units of what is one number, of joints that turn and that slide.
DRIVE_UNITS: Mapping[str, tuple[str, str]] = {
    "peak_torque": ("N*m", "N"),
    "continuous_torque": ("N*m", "N"),
    "gear_ratio": ("1", "1"),
    "efficiency_driving": ("1", "1"),
    "efficiency_driven": ("1", "1"),
    "rotor_inertia": ("kg*m^2", "kg*m^2"),
    "winding_resistance": ("ohm", "ohm"),
    "torque_constant": ("N*m/A", "N*m/A"),
    "inverter_drop": ("V", "V"),
    "thermal_resistance": ("K/W", "K/W"),
    "thermal_time_constant": ("s", "s"),
    "greatest_rise": ("K", "K"),
}

#: What the temperature of a winding follows from.
_HEAT = ("gear_ratio", "winding_resistance", "torque_constant", "thermal_resistance", "thermal_time_constant")

#: What the current of a motor and its loss follow from.
_CURRENT = ("gear_ratio", "winding_resistance", "torque_constant")

#: What may be 0.
_FROM_ZERO = ("rotor_inertia", "efficiency_driven", "inverter_drop")


@final
@dataclass(frozen=True, kw_only=True)
class Drive:
    """The drive of one joint, SI; what is None is not known, and limits nothing.

    Attributes:
        peak_torque: greatest torque of the motor times the gear ratio [N·m or N].
        continuous_torque: greatest root of the mean square of the same torque over a cycle [N·m or N].
        torque_speed: points (speed of the joint, torque) [rad/s or m/s, N·m or N], from speed 0 on, with torques that
            do not rise: what the motor can drive with at that speed, on straight lines between the points. A motor that
            is driven by its load has the torque of the first point at every speed. Beyond the last point, the last line
            goes on if it ends at torque 0, so that the load has to drive; otherwise the motor cannot turn so fast.
        gear_ratio: radians of the motor per radian or metre of the joint [rad/rad or rad/m].
        efficiency_driving: share of the motor's power that the gear hands on while the motor drives the joint; 1 if
            None.
        efficiency_driven: share of the load's torque that reaches the motor while the load drives it, 0 for a gear that
            locks itself; as ``efficiency_driving`` if None. A gear that loses the same torque both ways has
            2 - 1/``efficiency_driving``, which is never more, so that this is the safe side for torque and heat.
        rotor_inertia: inertia of what turns with the motor, on the motor's side [kg·m²]; times the gear ratio squared
            it becomes the armature of the joint, which must not be given elsewhere too.
        winding_resistance: resistance of the winding, with which the current of the torque constant heats it [ohm].
        torque_constant: torque of the motor per current [N·m/A].
        inverter_drop: voltage that the inverter drops, which loses it times the magnitude of the current [V]; none if
            None.
        thermal_resistance: from the winding to its surroundings [K/W].
        thermal_time_constant: in which the winding warms up [s].
        greatest_rise: greatest temperature of the winding above its surroundings [K].
        brake: whether a brake holds the joint while it stands, so that the motor rests.
        source: where the numbers come from.

    Raises:
        InvalidInputError: a number that no drive has, or numbers that contradict each other.
    """

    peak_torque: float | None = None
    continuous_torque: float | None = None
    torque_speed: tuple[tuple[float, float], ...] | None = None
    gear_ratio: float | None = None
    efficiency_driving: float | None = None
    efficiency_driven: float | None = None
    rotor_inertia: float | None = None
    winding_resistance: float | None = None
    torque_constant: float | None = None
    inverter_drop: float | None = None
    thermal_resistance: float | None = None
    thermal_time_constant: float | None = None
    greatest_rise: float | None = None
    brake: bool = False
    source: str = ""

    __repr__ = brief

    def __post_init__(self) -> None:
        for name in DRIVE_UNITS:
            if getattr(self, name) is not None:
                object.__setattr__(self, name, _amount(name, getattr(self, name)))
        if self.torque_speed is not None:
            object.__setattr__(self, "torque_speed", _line(self.torque_speed))
        if not isinstance(self.brake, bool):
            raise InvalidInputError(f"brake: expected True or False, got {self.brake!r}")
        if not isinstance(self.source, str):
            raise InvalidInputError(f"source: expected text, got {self.source!r}")
        self._check_together()

    def _check_together(self) -> None:
        if self.efficiency_driven is not None and self.efficiency_driving is None:
            raise InvalidInputError("efficiency_driven: expected efficiency_driving with it, got none")
        if self.rotor_inertia and self.gear_ratio is None:
            raise InvalidInputError("rotor_inertia: expected gear_ratio with it, got none")
        most = min(self.stall, np.inf if self.peak_torque is None else self.peak_torque)
        if self.continuous_torque is not None and self.continuous_torque > most:
            raise InvalidInputError(
                f"continuous_torque: expected at most the greatest torque, {most:g}, got {self.continuous_torque:g}"
            )

    @property
    def stall(self) -> float:
        """Torque of the torque-speed line at speed 0 [N·m or N]; inf without such a line."""
        return np.inf if self.torque_speed is None else self.torque_speed[0][1]

    @property
    def efficiencies(self) -> tuple[float, float]:
        """Efficiencies while the motor drives, and while it is driven [1]."""
        driving = 1.0 if self.efficiency_driving is None else self.efficiency_driving
        return driving, driving if self.efficiency_driven is None else self.efficiency_driven

    @property
    def lacking_for_heat(self) -> tuple[str, ...]:
        """What is not known, but needed for the temperature of the winding."""
        return tuple(name for name in _HEAT if getattr(self, name) is None)

    @property
    def lacking_for_current(self) -> tuple[str, ...]:
        """What is not known, but needed for the current of the motor and the power that it draws."""
        return tuple(name for name in _CURRENT if getattr(self, name) is None)

    @property
    def current_losses(self) -> tuple[float, float]:
        """What the motor loses: per square of its torque times the gear ratio in the winding, [W/(N·m)² or W/N²], and
        per magnitude of it in the inverter, [W/(N·m) or W/N].

        Raises:
            InvalidInputError: something of the drive that it needs is not known.
        """
        ratio, ohm, constant = (getattr(self, name) for name in _CURRENT)
        if ratio is None or ohm is None or constant is None:
            raise InvalidInputError(f"drive: expected {', '.join(self.lacking_for_current)} for a current, got none")
        per_ampere = ratio * constant
        return float(ohm / per_ampere**2), float((self.inverter_drop or 0.0) / per_ampere)

    @property
    def rise_per_square(self) -> float:
        """Temperature in steady state per square of the motor's torque times the gear ratio [K/(N·m)² or K/N²].

        Raises:
            InvalidInputError: something of the drive that it needs is not known.
        """
        ratio, ohm, constant, thermal, duration = (getattr(self, name) for name in _HEAT)
        if ratio is None or ohm is None or constant is None or thermal is None or duration is None:
            raise InvalidInputError(f"drive: expected {', '.join(self.lacking_for_heat)} for a temperature, got none")
        return float(thermal * ohm / (ratio * constant) ** 2)

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """What can be told of a drive."""
        return tuple(field.name for field in fields(cls))


def _amount(name: str, given: Any) -> float:
    """A number of a drive that is in its range."""
    number = real_number(given)
    if number is None or not np.isfinite(number) or number < 0.0 or (number == 0.0 and name not in _FROM_ZERO):
        kind = "a number from 0 on" if name in _FROM_ZERO else "a positive number"
        raise InvalidInputError(f"{name}: expected {kind}, got {given!r}")
    if name.startswith("efficiency") and number > 1.0:
        raise InvalidInputError(f"{name}: expected a share of at most 1, got {given!r}")
    return number


def _line(given: Any) -> tuple[tuple[float, float], ...]:
    """Points of a torque-speed line."""
    wrong = "torque_speed: expected points of speed and torque, at least two"
    if not isinstance(given, list | tuple | np.ndarray) or len(given) < 2:
        raise InvalidInputError(f"{wrong}, got {given!r}")
    points = []
    for point in given:
        pair = [real_number(x) for x in point] if isinstance(point, list | tuple | np.ndarray) else []
        known = [x for x in pair if x is not None and np.isfinite(x)]
        if len(pair) != 2 or len(known) != 2:
            raise InvalidInputError(f"{wrong}, got {point!r}")
        points.append((known[0], known[1]))
    speeds, torques = np.array(points).T
    if speeds[0] != 0.0 or (np.diff(speeds) <= 0.0).any():
        raise InvalidInputError(f"torque_speed: expected speeds that rise from 0, got {speeds.tolist()}")
    if (torques < 0.0).any() or torques[0] == 0.0 or (np.diff(torques) > 0.0).any():
        raise InvalidInputError(
            f"torque_speed: expected torques that do not rise with the speed, from above 0, got {torques.tolist()}"
        )
    return tuple(points)
