"""The supply that the drives of a robot share: a DC link, and what becomes of energy that motors give back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Literal, final, get_args

import numpy as np

from trajevo.base.arrays import real_number
from trajevo.base.shown.brief import brief
from trajevo.base.units import quantity
from trajevo.errors import InvalidInputError, checked_name

#: What becomes of energy that motors give back.
Recuperation = Literal["none", "shared", "full"]

#: SI units of what is a number.
SUPPLY_UNITS: Mapping[str, str] = {
    "standby_power": "W",
    "peak_power": "W",
    "link_capacitance": "F",
    "link_voltage": "V",
    "chopper_voltage": "V",
}

#: What a link that stores energy needs.
_LINK = ("link_capacitance", "link_voltage", "chopper_voltage")


@final
@dataclass(frozen=True, kw_only=True)
class Supply:
    """The supply of all drives of a robot, SI.

    Attributes:
        standby_power: what the controller draws as long as it is on, whatever the motors do [W]; none if None.
        peak_power: greatest power that it gives to all motors together [W]; any if None.
        recuperation: ``"none"`` if no drive can use what another one gives back, ``"shared"`` if all are at one DC
            link, so that what some give back drives the others and a braking resistor burns the rest, ``"full"`` if
            the rest goes back to the mains.
        link_capacitance: of the capacitors of a shared link [F]; nothing is stored if None.
        link_voltage: of the link while the mains feed it [V].
        chopper_voltage: at which the braking resistor is switched on [V].
        source: where the numbers come from.

    Raises:
        InvalidInputError: a number that no supply has, or numbers that contradict each other or lack others.
    """

    standby_power: float | None = None
    peak_power: float | None = None
    recuperation: Recuperation = "shared"
    link_capacitance: float | None = None
    link_voltage: float | None = None
    chopper_voltage: float | None = None
    source: str = ""

    __repr__ = brief

    def __post_init__(self) -> None:
        for name in SUPPLY_UNITS:
            if getattr(self, name) is not None:
                object.__setattr__(self, name, _amount(name, getattr(self, name)))
        if not isinstance(self.recuperation, str) or self.recuperation not in get_args(Recuperation):
            raise InvalidInputError(f"recuperation: expected 'none', 'shared' or 'full', got {self.recuperation!r}")
        if not isinstance(self.source, str):
            raise InvalidInputError(f"source: expected text, got {self.source!r}")
        self._check_link()

    def _check_link(self) -> None:
        given = [name for name in _LINK if getattr(self, name) is not None]
        if not given:
            return
        lacking = [name for name in _LINK if name not in given]
        if lacking:
            raise InvalidInputError(f"{given[0]}: expected {' and '.join(lacking)} with it, got none")
        if self.recuperation != "shared":
            raise InvalidInputError(
                f"link_capacitance: expected recuperation 'shared' with it, as only such a link stores what motors "
                f"give back, got {self.recuperation!r}"
            )
        if (self.chopper_voltage or 0.0) <= (self.link_voltage or 0.0):
            raise InvalidInputError(
                f"chopper_voltage: expected more than link_voltage, {self.link_voltage:g} V, "
                f"got {self.chopper_voltage:g} V"
            )

    @property
    def standby(self) -> float:
        """Power of the controller, 0 if it is not known [W]."""
        return self.standby_power or 0.0

    @property
    def storable(self) -> float:
        """What the link can store before the braking resistor is switched on, ½ C (U_chopper² - U_link²) [J]."""
        if self.link_capacitance is None or self.link_voltage is None or self.chopper_voltage is None:
            return 0.0
        return 0.5 * self.link_capacitance * (self.chopper_voltage**2 - self.link_voltage**2)

    def voltage_with(self, stored: float) -> float:
        """Voltage of the link with energy stored in it beyond that of the mains [V].

        Args:
            stored: the energy, from 0 on; what is more than :attr:`storable` is burnt [J].

        Raises:
            InvalidInputError: a link without capacitors, or an energy below 0.
        """
        if self.link_capacitance is None or self.link_voltage is None:
            raise InvalidInputError("supply: expected link_capacitance, link_voltage and chopper_voltage, got none")
        if not stored >= 0.0:
            raise InvalidInputError(f"stored: expected an energy from 0 on [J], got {stored!r}")
        return float((self.link_voltage**2 + 2.0 * min(stored, self.storable) / self.link_capacitance) ** 0.5)

    def burnt_of(self, given_back: float) -> float:
        """What the braking resistor burns of energy that comes into a link at the voltage of the mains [J].

        Args:
            given_back: the energy [J].
        """
        return max(given_back - self.storable, 0.0)

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """What can be told of a supply."""
        return tuple(field.name for field in fields(cls))


def supply_of(given: Any, declared: Mapping[str, Any] | None = None) -> Supply:
    """The supply of a robot.

    Args:
        given: what a caller gave, a :class:`Supply` or a mapping from its attributes to numbers [SI] or text with a
            unit, which completes or replaces what the file says; None for nothing.
        declared: the same of ``robot.toml``.

    Raises:
        InvalidInputError: anything else, or a supply that there cannot be.
        UnknownNameError: another name of an attribute.
    """
    told = plain_supply(given)
    if not isinstance(told, Mapping | None):
        raise InvalidInputError(f"supply: expected a mapping from {', '.join(Supply.names())}, got {given!r}")
    values = {**(declared or {}), **(told or {})}
    for name in values:
        checked_name("key of supply", name, Supply.names())
    try:
        return Supply(**{name: _si(name, value) for name, value in values.items() if value is not None})
    except InvalidInputError as error:
        raise InvalidInputError(f"supply.{error}") from error


def plain_supply(given: Any) -> Any:
    """What a supply says as a mapping, and anything else as it is."""
    if not isinstance(given, Supply):
        return given
    return {name: getattr(given, name) for name in Supply.names() if getattr(given, name) not in (None, "")}


def _si(name: str, value: Any) -> Any:
    return quantity(value, SUPPLY_UNITS[name], name=name) if isinstance(value, str) and name in SUPPLY_UNITS else value


def _amount(name: str, given: Any) -> float:
    """A number of a supply that is in its range."""
    number, from_zero = real_number(given), name == "standby_power"
    if number is None or not np.isfinite(number) or number < 0.0 or (number == 0.0 and not from_zero):
        kind = "a number from 0 on" if from_zero else "a positive number"
        raise InvalidInputError(f"{name}: expected {kind}, got {given!r}")
    return number
