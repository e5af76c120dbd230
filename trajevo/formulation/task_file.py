"""The file ``task.toml``: its keys, and where in it a mistake stands."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import pydantic

from trajevo.base.toml import Places, read_toml, validated
from trajevo.formulation.search import Search

_Number = Annotated[float, pydantic.Strict()]
_Values = _Number | str | list[_Number | str] | dict[str, _Number | str]


class _Strict(pydantic.BaseModel):
    model_config = pydantic.ConfigDict(extra="forbid", frozen=True)


class _Robot(_Strict):
    name: str
    tool: str | None = None
    lock: dict[str, _Number] | None = None
    gravity: tuple[_Number, _Number, _Number] | None = None


class _Limits(_Strict):
    """One number for all joints, one for each, or by joint; SI or text with a unit; positions in pairs."""

    position: list[_Number | str | list[_Number | str]] | dict[str, list[_Number | str]] | None = None
    velocity: _Values | None = None
    acceleration: _Values | None = None
    jerk: _Values | None = None
    effort: _Values | None = None


class _Payload(_Strict):
    mass: _Number
    com: tuple[_Number, _Number, _Number] = (0.0, 0.0, 0.0)
    inertia: list[list[_Number]] | None = None
    model: str = "rigid"


class _Point(_Strict):
    """Joint positions, or a pose of the tool [m], orientation by roll, pitch, yaw or by quaternion x, y, z, w."""

    joints: list[_Number] | None = None
    position: tuple[_Number, _Number, _Number] | None = None
    rpy: tuple[_Number, _Number, _Number] | None = None
    quaternion: tuple[_Number, _Number, _Number, _Number] | None = None

    @pydantic.model_validator(mode="after")
    def _one_kind(self) -> _Point:
        if (self.joints is None) == (self.position is None):
            raise ValueError("expected either joints, or position with rpy or quaternion where it counts")
        if self.joints is not None and (self.rpy is not None or self.quaternion is not None):
            raise ValueError("joints have no rpy or quaternion")
        if self.rpy is not None and self.quaternion is not None:
            raise ValueError("expected rpy or quaternion, got both")
        return self


class MovingSettings(_Strict):
    """A box in which a point may move: around its joint positions, or around its tool position [m]."""

    point: Annotated[int, pydantic.Field(strict=True, ge=0)]
    joints: _Number | list[_Number] | None = None
    tool: tuple[_Number, _Number, _Number] | None = None

    @pydantic.model_validator(mode="after")
    def _one_kind(self) -> MovingSettings:
        if (self.joints is None) == (self.tool is None):
            raise ValueError("expected either joints or tool, the half widths of the box")
        return self


class _Constraints(_Strict):
    limits: list[str] = ["position", "velocity", "acceleration", "jerk", "effort"]
    effort_margin: _Number = 0.0
    overshoot: _Number | None = None
    tool_speed: _Number | None = None
    tool_height: _Number | None = None
    longest_time: _Number | None = None
    held: Literal["sampled", "certified"] = "certified"


class TaskSettings(_Strict):
    """The keys of ``task.toml``; SI, save for ``angle``, the unit of the points' joint positions and ``rpy`` and of
    the boxes in joint space.
    """

    format: Literal[1] = 1
    robot: str | _Robot
    angle: Literal["rad", "deg"] = "rad"
    limits: _Limits = _Limits()
    payload: _Number | _Payload = 0.0
    payload_range: tuple[_Number, _Number] | None = None
    points: str | list[list[_Number] | _Point]
    moving: list[MovingSettings] = []
    interpolant: str = "quintic_spline"
    duration_bounds: tuple[_Number, _Number]
    objectives: list[str] = ["time", "energy"]
    constraints: _Constraints = _Constraints()
    scene: dict[str, Any] | None = None
    reference_point: list[_Number] | None = None
    algorithm: Search = Search()
    seed: Annotated[int, pydantic.Field(strict=True, ge=0)] = 1
    samples: Annotated[int, pydantic.Field(strict=True, ge=2)] = 6

    @pydantic.field_validator("algorithm")
    @classmethod
    def _seed_at_the_top(cls, algorithm: Search) -> Search:
        if algorithm.seed is not None:
            raise ValueError("the seed of a task stands at its top, as seed = 1")
        return algorithm

    @property
    def search(self) -> Search:
        """How the task is solved."""
        return self.algorithm.updated(seed=self.seed)


def read_task(file: Path) -> tuple[TaskSettings, Places]:
    """The keys of a task, and their lines.

    Raises:
        InvalidInputError: it cannot be read, or a key is missing, unknown or of another kind; the message names file,
            line and key.
    """
    content, places = read_toml(file)
    return validated(TaskSettings, content, places), places
