"""Values by name that print with their units."""

from __future__ import annotations

from collections.abc import Mapping
from typing import final

from trajevo.base.units import pretty


@final
class Quantities(dict[str, float]):
    """Values by name, SI; printed, each has its unit.

    Args:
        values: name -> value [SI].
        units: name -> SI unit.
    """

    def __init__(self, values: Mapping[str, float], units: Mapping[str, str]) -> None:
        super().__init__(values)
        self.units = dict(units)

    def __str__(self) -> str:
        return ", ".join(f"{name} {with_unit(f'{value:.5g}', self.units[name])}" for name, value in self.items())


def with_unit(number: str, unit: str) -> str:
    """A number with its unit, none for a plain number."""
    return number if unit == "1" else f"{number} {pretty(unit)}"
