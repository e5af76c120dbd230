"""The keys of a Denavit-Hartenberg table in ``robot.toml`` and ``task.toml``."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import pydantic

_Number = Annotated[float, pydantic.Strict()]


class _Strict(pydantic.BaseModel):
    model_config = pydantic.ConfigDict(extra="forbid", frozen=True, defer_build=True)


class _Row(_Strict):
    """One joint. Numbers are in m and rad, or text with a unit."""

    joint: Literal["revolute", "prismatic"] = "revolute"
    a: _Number | str
    alpha: _Number | str
    d: _Number | str | None = None
    theta: _Number | str | None = None


class _Tool(_Strict):
    position: list[_Number] = [0.0, 0.0, 0.0]
    rpy: list[_Number] = [0.0, 0.0, 0.0]


class DhKeys(_Strict):
    """The arguments of :meth:`trajevo.robot.loading.dh.DhTable.of`."""

    convention: Literal["standard", "modified"]
    rows: list[_Row]
    masses: list[_Number | str] | None = None
    coms: list[list[_Number]] | None = None
    inertias: list[list[_Number] | list[list[_Number]]] | None = None
    names: list[str] | None = None
    tool: _Tool | None = None

    @property
    def arguments(self) -> dict[str, Any]:
        """What is given, as plain data."""
        return self.model_dump(exclude_none=True)
