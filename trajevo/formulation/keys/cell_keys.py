"""The keys of ``task.toml`` that tell what of the cell is free: where the robot stands, and the order of the points."""

from __future__ import annotations

from typing import Annotated, Literal

import pydantic

from trajevo.robot.loading.told import Amount, Told

_Index = Annotated[int, pydantic.Field(strict=True, ge=0)]


class BaseRanges(Told):
    """Ranges of a base; other keys are refused where the ranges are used, which says the nearest one."""

    model_config = pydantic.ConfigDict(extra="allow", frozen=True, defer_build=True)

    x: list[Amount] | None = pydantic.Field(None, description="Along x of the cell; a text has its unit [m].")
    y: list[Amount] | None = pydantic.Field(None, description="Along y of the cell; a text has its unit [m].")
    z: list[Amount] | None = pydantic.Field(None, description="Along z of the cell; a text has its unit [m].")
    yaw: list[Amount] | None = pydantic.Field(
        None, description="About the vertical axis through its origin; a text has its unit [rad]."
    )
    pitch: list[Amount] | None = pydantic.Field(
        None, description="Tilt about y of the cell through its origin, before the yaw; a text has its unit [rad]."
    )
    roll: list[Amount] | None = pydantic.Field(
        None, description="Tilt about x of the cell through its origin, before the pitch; a text has its unit [rad]."
    )


class BaseKeys(Told):
    """Where the robot may stand: ranges of how far its base is from its given place, in the axes of the cell."""

    moving: BaseRanges = pydantic.Field(description="Least and greatest displacement; what is not named stands still.")


class OrderKeys(Told):
    """Points that may be visited in any order; they have the places of their group, all others their own."""

    free: Literal["all"] | list[_Index] | list[list[_Index]] = pydantic.Field(
        description="Numbers of these points, counted from 0, or several such groups; all means all between the ends."
    )
    after: dict[str, _Index | list[_Index]] | None = pydantic.Field(
        None, description="For a point by its number, those that are visited before it, as `{ 4 = [2] }`."
    )
