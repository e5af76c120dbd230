"""The keys of a grip and of a stand in ``robot.toml`` and ``task.toml``."""

from __future__ import annotations

from typing import Annotated

import pydantic

from trajevo.robot.loading.told import Amount, Number, Told, amount, source

_Place = tuple[Amount, Amount, Amount]


class GripKeys(Told):
    """A grip that holds the payload by friction, as :class:`trajevo.robot.contacts.grip.Grip` says."""

    force_per_finger: Amount | None = amount("With which each finger presses; either this or `total_force`", "N")
    total_force: Amount | None = amount("Sum of the forces of all fingers", "N")
    friction: Number = pydantic.Field(description="Coefficient of friction between payload and fingers; no unit.")
    safety: Number = pydantic.Field(1.0, description="Factor by which friction must exceed what it holds; no unit.")
    fingers: Annotated[int, pydantic.Strict()] = pydantic.Field(2, description="How many press on the payload.")
    closing_axis: tuple[Number, Number, Number] = pydantic.Field(
        (0.0, 1.0, 0.0), description="Direction in the tool's frame in which they press; no unit."
    )
    point: _Place = pydantic.Field(
        (0.0, 0.0, 0.0), description="Middle between them in the tool's frame; a text has its unit [m]."
    )
    torsion: Amount | None = amount("Greatest moment of friction about the closing axis over the force", "m")
    source: str = pydantic.Field("", description="Where the numbers come from.")


class StandKeys(Told):
    """What the robot stands on without being bolted, as :class:`trajevo.robot.contacts.stand.Stand` says."""

    mass: Amount = pydantic.Field(description="Its mass without the moving links; a text has its unit [kg].")
    com: _Place = pydantic.Field(description="Its centre of mass; a text has its unit [m].")
    footprint: list[_Place] = pydantic.Field(
        description="Corners of the polygon in which it touches the floor, in order; texts have their units [m]."
    )
    source: str = pydantic.Field("", description="Where the numbers come from.")


class SourcedGripKeys(GripKeys):
    """The same with its source, as a file that others use must have it."""

    source: str = source()


class SourcedStandKeys(StandKeys):
    """The same with its source, as a file that others use must have it."""

    source: str = source()
