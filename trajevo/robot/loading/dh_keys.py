"""The keys of a Denavit-Hartenberg table in ``robot.toml`` and ``task.toml``."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import pydantic

_Number = Annotated[float, pydantic.Strict()]


class _Strict(pydantic.BaseModel):
    model_config = pydantic.ConfigDict(extra="forbid", frozen=True, defer_build=True)


class _Row(_Strict):
    """One joint. Numbers are in m and rad, or text with a unit."""

    joint: Literal["revolute", "prismatic"] = pydantic.Field("revolute", description="What the joint does.")
    a: _Number | str = pydantic.Field(description="Length of the link; a text has its unit [m].")
    alpha: _Number | str = pydantic.Field(description="Twist of the link; a text has its unit [rad].")
    d: _Number | str | None = pydantic.Field(
        None, description="Offset along the joint's axis; not needed where the joint slides [m]."
    )
    theta: _Number | str | None = pydantic.Field(
        None, description="Angle about the joint's axis; not needed where the joint turns [rad]."
    )


class _Tool(_Strict):
    position: list[_Number] = pydantic.Field(
        [0.0, 0.0, 0.0], description="Origin of the tool in the frame of the last link, x, y and z [m]."
    )
    rpy: list[_Number] = pydantic.Field([0.0, 0.0, 0.0], description="Its roll, pitch and yaw [rad].")


class DhKeys(_Strict):
    """A Denavit-Hartenberg table, as :meth:`trajevo.robot.loading.dh.DhTable.of` takes it."""

    convention: Literal["standard", "modified"] = pydantic.Field(
        description="Which of both conventions the rows follow."
    )
    rows: list[_Row] = pydantic.Field(description="One for each joint, from the base on.")
    masses: list[_Number | str] | None = pydantic.Field(
        None, description="Mass of every link; a text has its unit [kg]."
    )
    coms: list[list[_Number]] | None = pydantic.Field(
        None, description="Centre of mass of every link in its own frame, rows of x, y and z [m]."
    )
    inertias: list[list[_Number] | list[list[_Number]]] | None = pydantic.Field(
        None, description="Inertia of every link about its centre of mass: 3 principal values, or 3 rows of 3 [kg*m^2]."
    )
    names: list[str] | None = pydantic.Field(None, description="Names of the joints; numbered if not given.")
    tool: _Tool | None = pydantic.Field(None, description="Where the tool is, if not at the last frame.")

    @property
    def arguments(self) -> dict[str, Any]:
        """What is given, as plain data."""
        return self.model_dump(exclude_none=True)
