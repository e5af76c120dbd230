"""The keys of a ``task.toml`` file, and the line of every key, so that error messages can name it."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal, cast

import pydantic

from trajevo.base.shown.brief import brief
from trajevo.base.toml import Places, read_toml, validated
from trajevo.errors import InvalidInputError
from trajevo.formulation.constraints.constraint import LimitParameter
from trajevo.formulation.search import Search
from trajevo.formulation.via_points import limit_parameters
from trajevo.robot.loading.dh_keys import DhKeys

_Number = Annotated[float, pydantic.Strict()]
_Values = _Number | str | list[_Number | str] | dict[str, _Number | str]

#: The same, each of which may be a table with the limits of both directions.
_Side = dict[str, _Number | str]
_Directed = _Number | str | list[_Number | str | _Side] | dict[str, _Number | str | _Side]


class _Strict(pydantic.BaseModel):
    model_config = pydantic.ConfigDict(extra="forbid", frozen=True, defer_build=True)

    __repr__ = brief


class _Place(_Strict):
    """Where something is: lengths in m and angles in rad, or text with a unit."""

    position: list[_Number | str] | None = None
    rpy: list[_Number | str] | None = None


class _Tool(_Place):
    name: str
    parent: str
    mass: _Number | str | None = None
    com: list[_Number | str] | None = None
    inertia: list[_Number] | list[list[_Number]] | None = None


class _Robot(_Strict):
    """A robot by its name or file; or a Denavit-Hartenberg table; or joints alone, whose limits are in ``[limits]``."""

    name: str
    dh: DhKeys | None = None
    joints: list[str] | None = None
    kind: str | list[str] | None = None
    tool: str | None = None
    lock: dict[str, _Number] | None = None
    gravity: tuple[_Number, _Number, _Number] | None = None
    allow_massless: Annotated[bool, pydantic.Strict()] | None = None
    friction: str | dict[str, _Values] | None = None
    packages: str | list[str] | None = None
    xacro: dict[str, str | bool | int | float] | None = None
    base: _Place | None = None
    tools: list[_Tool] | None = None


class _Limits(_Strict):
    """Joint limits: one for all joints, a list with one per joint, or a table by joint name.

    A limit is a number in SI units or a text with a unit; a position limit is a pair of the lower and the upper end. A
    limit of velocity, acceleration or effort may also be a table with the magnitudes ``backward`` and ``forward``.
    """

    position: list[_Number | str | list[_Number | str]] | dict[str, list[_Number | str]] | None = None
    velocity: _Directed | None = None
    acceleration: _Directed | None = None
    jerk: _Values | None = None
    effort: _Directed | None = None


class _Load(_Strict):
    """A payload; it is carried from one point to another, or all the time without ``from`` and ``to``."""

    mass: _Number | str
    com: tuple[_Number | str, _Number | str, _Number | str] = (0.0, 0.0, 0.0)
    inertia: list[list[_Number]] | None = None
    model: str = "rigid"
    from_point: Annotated[int, pydantic.Field(strict=True, ge=0)] | None = pydantic.Field(None, alias="from")
    to_point: Annotated[int, pydantic.Field(strict=True, ge=0)] | None = pydantic.Field(None, alias="to")
    vary: Annotated[bool, pydantic.Strict()] | None = None
    shape: dict[str, Any] | None = None
    touches: list[str] | None = None


class _Point(_Strict):
    """A via point: joint positions, or a tool position [m] and, if it matters, the tool's orientation.

    The orientation is ``rpy`` (roll, pitch, yaw), ``quaternion`` (x, y, z, w) or ``rotation_vector`` (axis times
    angle). With it ``free`` names an axis of the tool, x, y or z, about which any orientation is right.
    """

    joints: list[_Number] | None = None
    position: tuple[_Number, _Number, _Number] | None = None
    rpy: tuple[_Number, _Number, _Number] | None = None
    quaternion: tuple[_Number, _Number, _Number, _Number] | None = None
    rotation_vector: tuple[_Number, _Number, _Number] | None = None
    free: Literal["x", "y", "z"] | None = None

    @pydantic.model_validator(mode="after")
    def _one_kind(self) -> _Point:
        if (self.joints is None) == (self.position is None):
            raise ValueError(
                "expected either joints, or position and, if the orientation matters, rpy, quaternion or "
                "rotation_vector"
            )
        given = [key for key in ("rpy", "quaternion", "rotation_vector") if getattr(self, key) is not None]
        if self.joints is not None and given:
            raise ValueError(f"joints have no {given[0]}")
        if self.free is not None and not given:
            raise ValueError("free: expected rpy, quaternion or rotation_vector with it, of which one axis is free")
        if len(given) > 1:
            raise ValueError(f"expected {given[0]} or {given[1]}, got both")
        return self


class MovingSettings(_Strict):
    """Half widths of the box in which a via point may move: around its joint positions, or its tool position [m]."""

    point: Annotated[int, pydantic.Field(strict=True, ge=0)]
    joints: _Number | list[_Number] | None = None
    tool: tuple[_Number, _Number, _Number] | None = None

    @pydantic.model_validator(mode="after")
    def _one_kind(self) -> MovingSettings:
        if (self.joints is None) == (self.tool is None):
            raise ValueError("expected either joints or tool, the half widths of the box")
        return self


class PassingSettings(_Strict):
    """How a via point is passed: with a stop or a dwell [s], a velocity per second, or in a window of time [s]."""

    point: Annotated[int, pydantic.Field(strict=True, ge=0)]
    stop: Annotated[bool, pydantic.Strict()] | None = None
    dwell: _Number | None = None
    velocity: list[_Number] | None = None
    acceleration: list[_Number] | None = None
    window: tuple[_Number, _Number] | None = None


class SegmentSettings(_Strict):
    """What is asked of the segments between two points: a line or an arc of the tool, or an upright axis of it."""

    from_point: Annotated[int, pydantic.Field(strict=True, ge=0, alias="from")]
    to_point: Annotated[int, pydantic.Field(strict=True, ge=0)] | None = pydantic.Field(None, alias="to")
    tool: Literal["line", "arc"] | None = None
    through: tuple[_Number, _Number, _Number] | None = None
    rest: Literal["both", "start", "end", "none"] | None = None
    tolerance: _Number | str | None = None
    turning: _Number | str | None = None
    upright: _Number | str | None = None
    axis: str | tuple[_Number, _Number, _Number] | None = None
    direction: tuple[_Number, _Number, _Number] | None = None


class _Constraints(pydantic.BaseModel):
    """What is limited; :func:`task_model` adds the parameters of limits."""

    model_config = pydantic.ConfigDict(extra="forbid", frozen=True, defer_build=True, strict=True)

    __repr__ = brief

    limits: list[str] = ["position", "velocity", "acceleration", "jerk", "effort"]
    held: Literal["sampled", "certified"] = "certified"


class TaskSettings(_Strict):
    """The keys of ``task.toml``, in SI units; :func:`task_model` adds the parameters of limits.

    ``name`` is what the task is called in tables, reports and pictures; its file's name if not given.
    Only angles of points (joint positions, ``rpy`` and ``rotation_vector``), of boxes in joint space, of given
    velocities and accelerations, and ``turning`` and ``upright`` of segments are in the unit ``angle``.
    """

    format: Literal[1] = 1
    name: str | None = None
    robot: str | _Robot
    angle: Literal["rad", "deg"] = "rad"
    limits: _Limits = _Limits()
    payload: _Number | str | _Load | list[_Load] = 0.0
    payload_range: tuple[_Number, _Number] | None = None
    points: str | list[list[_Number] | _Point]
    turns: Literal["as_written", "shortest"] = "as_written"
    moving: list[MovingSettings] = []
    passing: list[PassingSettings] = []
    segment: list[SegmentSettings] = []
    cyclic: Annotated[bool, pydantic.Strict()] = False
    interpolant: str | None = None
    extra_points: Annotated[int, pydantic.Field(strict=True, ge=0)] = 0
    pace: Annotated[int, pydantic.Field(strict=True, ge=0)] | None = None
    bspline: dict[str, Any] | None = None
    duration_bounds: list[_Number] | list[tuple[_Number, _Number]]
    objectives: list[str] = ["time", "energy"]
    constraints: _Constraints = _Constraints()
    reference_point: list[_Number] | None = None
    algorithm: Search = Search()
    seed: Annotated[int, pydantic.Field(strict=True, ge=0)] = 1
    samples: Annotated[int, pydantic.Field(strict=True, ge=2)] = 6

    @pydantic.field_validator("algorithm")
    @classmethod
    def _seed_at_the_top(cls, algorithm: Search) -> Search:
        if algorithm.seed is not None:
            raise ValueError("expected the seed at the top level of the task, as seed = 1")
        return algorithm

    @property
    def search(self) -> Search:
        """Settings of the task's search, including the seed."""
        return self.algorithm.updated(seed=self.seed)

    @property
    def carried(self) -> Any:
        """The payload, or the loads, as an argument of the problem."""
        if isinstance(self.payload, list):
            return [load.model_dump(by_alias=True, exclude_none=True) for load in self.payload]
        if isinstance(self.payload, _Load):
            return self.payload.model_dump(by_alias=True, exclude_none=True)
        return self.payload

    @property
    def parameters(self) -> dict[str, Any]:
        """What is given of the parameters of limits, in ``[constraints]`` and in tables of their own."""
        tables = self.model_dump(include=self.model_fields_set - set(TaskSettings.model_fields))
        return self.constraints.model_dump(exclude=set(_Constraints.model_fields), exclude_unset=True) | tables


def task_model() -> type[TaskSettings]:
    """The keys of ``task.toml`` with the parameters of all limits at hand.

    Raises:
        InvalidInputError: a parameter has the name of another key.
    """
    return _with_parameters(tuple(limit_parameters().values()))


@cache
def _with_parameters(parameters: tuple[LimitParameter, ...]) -> type[TaskSettings]:
    keys, tables = ({p.name: _key(p) for p in parameters if p.table is table} for table in (False, True))
    for added, model in ((keys, _Constraints), (tables, TaskSettings)):
        taken = [name for name in added if name in model.model_fields]
        if taken:
            raise InvalidInputError(f"constraints: a limit's parameter {taken[0]!r} needs another name, which is taken")
    constraints: Any = pydantic.create_model("_Constraints", __base__=_Constraints, **keys)
    made: Any = pydantic.create_model(
        "TaskSettings", __base__=TaskSettings, constraints=(constraints, constraints()), **tables
    )
    return cast("type[TaskSettings]", made)


def _key(parameter: LimitParameter) -> Any:
    """Type and default of a parameter's key."""
    kind = parameter.type if parameter.default is not None else parameter.type | None
    return kind, pydantic.Field(parameter.default, description=parameter.help, strict=True)


def read_task(file: Path) -> tuple[TaskSettings, Places]:
    """Read the keys of a task, and their lines.

    Raises:
        InvalidInputError: the file cannot be read, or a key is missing, unknown or of the wrong type; the message names
            file, line and key.
    """
    content, places = read_toml(file)
    return validated(task_model(), content, places), places
