"""What keys of ``robot.toml`` and ``task.toml`` have in common that tell of one thing: numbers and their units."""

from __future__ import annotations

from typing import Annotated, Any

import pydantic

Number = Annotated[float, pydantic.Strict()]
#: A number in SI units, or text with a unit.
Amount = Number | str


class Told(pydantic.BaseModel):
    """Keys of one thing; numbers in SI units, or text with a unit."""

    model_config = pydantic.ConfigDict(extra="forbid", frozen=True, defer_build=True)

    @property
    def arguments(self) -> dict[str, Any]:
        """What is given, as plain data."""
        return self.model_dump(exclude_none=True)


def amount(what: str, unit: str) -> Any:
    """An amount that may be given.

    Args:
        what: what it is, without a full stop.
        unit: SI unit.
    """
    return pydantic.Field(None, description=f"{what}; a text has its unit [{unit}].")


def source() -> Any:
    """Where numbers come from, which a file that others use must tell."""
    return pydantic.Field(description="Where the numbers come from.")
