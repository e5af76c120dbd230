"""The keys of a grip and of a stand in ``robot.toml`` and ``task.toml``."""

from __future__ import annotations

from typing import Annotated, Any

import pydantic

_Number = Annotated[float, pydantic.Strict()]
_Amount = _Number | str
_Place = tuple[_Amount, _Amount, _Amount]


class _Told(pydantic.BaseModel):
    """Numbers in SI units, or text with a unit."""

    model_config = pydantic.ConfigDict(extra="forbid", frozen=True, defer_build=True)

    @property
    def arguments(self) -> dict[str, Any]:
        """What is given, as plain data."""
        return self.model_dump(exclude_none=True)


class GripKeys(_Told):
    """A grip that holds the payload by friction, as :class:`trajevo.robot.contacts.grip.Grip` says."""

    force_per_finger: _Amount | None = pydantic.Field(
        None, description="With which each finger presses; either this or `total_force`; a text has its unit [N]."
    )
    total_force: _Amount | None = pydantic.Field(
        None, description="Sum of the forces of all fingers; a text has its unit [N]."
    )
    friction: _Number = pydantic.Field(description="Coefficient of friction between payload and fingers; no unit.")
    safety: _Number = pydantic.Field(1.0, description="Factor by which friction must exceed what it holds; no unit.")
    fingers: Annotated[int, pydantic.Strict()] = pydantic.Field(2, description="How many press on the payload.")
    closing_axis: tuple[_Number, _Number, _Number] = pydantic.Field(
        (0.0, 1.0, 0.0), description="Direction in the tool's frame in which they press; no unit."
    )
    point: _Place = pydantic.Field(
        (0.0, 0.0, 0.0), description="Middle between them in the tool's frame; a text has its unit [m]."
    )
    torsion: _Amount | None = pydantic.Field(
        None,
        description="Greatest moment of friction about the closing axis over the force; a text has its unit [m].",
    )
    source: str = pydantic.Field("", description="Where the numbers come from.")


class StandKeys(_Told):
    """What the robot stands on without being bolted, as :class:`trajevo.robot.contacts.stand.Stand` says."""

    mass: _Amount = pydantic.Field(description="Its mass without the moving links; a text has its unit [kg].")
    com: _Place = pydantic.Field(description="Its centre of mass; a text has its unit [m].")
    footprint: list[_Place] = pydantic.Field(
        description="Corners of the polygon in which it touches the floor, in order; texts have their units [m]."
    )
    source: str = pydantic.Field("", description="Where the numbers come from.")


class SourcedGripKeys(GripKeys):
    """The same with its source, as a file that others use must have it."""

    source: str = pydantic.Field(description="Where the numbers come from.")


class SourcedStandKeys(StandKeys):
    """The same with its source, as a file that others use must have it."""

    source: str = pydantic.Field(description="Where the numbers come from.")
