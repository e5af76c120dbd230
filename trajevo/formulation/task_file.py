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
from trajevo.formulation.keys.cell_keys import BaseKeys, OrderKeys
from trajevo.formulation.keys.point_keys import LoadKeys, PointKeys
from trajevo.formulation.keys.robot_keys import Keys, LimitKeys, RobotKeys, RobotOffer
from trajevo.formulation.search import Search
from trajevo.formulation.via_points import limit_parameters

_Number = Annotated[float, pydantic.Strict()]


class MovingSettings(Keys):
    """Half widths of the box in which a via point may move: around its joint positions, or its tool position [m]."""

    point: Annotated[int, pydantic.Field(strict=True, ge=0)] = pydantic.Field(
        description="Number of the point, counted from 0."
    )
    joints: _Number | list[_Number] | None = pydantic.Field(
        None, description="Half widths of its box in joint space, one for all joints or one each [angle or m]."
    )
    tool: tuple[_Number, _Number, _Number] | None = pydantic.Field(
        None, description="Half widths of its box in the base frame, x, y and z [m]."
    )

    @pydantic.model_validator(mode="after")
    def _one_kind(self) -> MovingSettings:
        if (self.joints is None) == (self.tool is None):
            raise ValueError("expected either joints or tool, the half widths of the box")
        return self


class PassingSettings(Keys):
    """How a via point is passed: with a stop or a dwell [s], a velocity per second, or in a window of time [s]."""

    point: Annotated[int, pydantic.Field(strict=True, ge=0)] = pydantic.Field(
        description="Number of the point, counted from 0."
    )
    stop: Annotated[bool, pydantic.Strict()] | None = pydantic.Field(None, description="The motion rests there.")
    dwell: _Number | None = pydantic.Field(None, description="The motion rests there for so long [s].")
    velocity: list[_Number] | None = pydantic.Field(None, description="Velocity of every joint there [angle/s or m/s].")
    acceleration: list[_Number] | None = pydantic.Field(
        None, description="Acceleration of every joint there, at the ends of the motion [angle/s^2 or m/s^2]."
    )
    window: tuple[_Number, _Number] | None = pydantic.Field(
        None, description="Earliest and latest instant at which the point is passed [s]."
    )


class SegmentSettings(Keys):
    """What is asked of the segments between two points: a line or an arc of the tool, or an upright axis of it."""

    from_point: Annotated[int, pydantic.Field(strict=True, ge=0, alias="from")] = pydantic.Field(
        description="Number of the point at which it begins, counted from 0."
    )
    to_point: Annotated[int, pydantic.Field(strict=True, ge=0)] | None = pydantic.Field(
        None, alias="to", description="Number of the point at which it ends; the next one if not given."
    )
    tool: Literal["line", "arc"] | None = pydantic.Field(None, description="How the tool goes.")
    through: tuple[_Number, _Number, _Number] | None = pydantic.Field(
        None, description="Point of the arc, in the base frame [m]."
    )
    rest: Literal["both", "start", "end", "none"] | None = pydantic.Field(
        None, description="At which ends of the way the motion rests; both if not given."
    )
    tolerance: _Number | str | None = pydantic.Field(
        None, description="How far the tool may leave the line or arc; a text has its unit [m]."
    )
    turning: _Number | str | None = pydantic.Field(
        None, description="How far the tool may turn from what lies between its orientations at both ends [angle]."
    )
    upright: _Number | str | None = pydantic.Field(
        None, description="Greatest angle between an axis of the tool and a direction [angle]."
    )
    axis: str | tuple[_Number, _Number, _Number] | None = pydantic.Field(
        None, description="That axis of the tool, a name or a vector; z if not given."
    )
    direction: tuple[_Number, _Number, _Number] | None = pydantic.Field(
        None, description="That direction in the base frame; up, against gravity, if not given."
    )


class _Constraints(pydantic.BaseModel):
    """What is limited; :func:`task_model` adds the parameters of limits."""

    model_config = pydantic.ConfigDict(extra="forbid", frozen=True, defer_build=True, strict=True)

    __repr__ = brief

    limits: list[str] = pydantic.Field(
        default=["position", "velocity", "acceleration", "jerk", "effort"],
        description='Limits that are kept, by name as `trajevo list` shows them, or your own "module:name".',
    )
    held: Literal["sampled", "certified"] = pydantic.Field(
        default="certified",
        description="Whether efforts and tool speed are kept at every instant, by proof, or at the samples alone.",
    )


class TaskSettings(Keys):
    """The keys of ``task.toml``, in SI units; :func:`task_model` adds the parameters of limits.

    ``name`` is what the task is called in tables, reports and pictures; its file's name if not given.
    Only angles of points (joint positions, ``rpy`` and ``rotation_vector``), of boxes in joint space, of given
    velocities and accelerations, and ``turning`` and ``upright`` of segments are in the unit ``angle``.
    """

    format: Literal[1] = pydantic.Field(1, description="Version of this format.")
    name: str | None = pydantic.Field(
        None, description="Title above tables, reports and pictures; the file's name if not given."
    )
    robot: str | RobotKeys | None = pydantic.Field(None, description="The robot: a name or file, or a table.")
    robots: str | list[str | RobotOffer] | None = pydantic.Field(
        None,
        description="Robots to choose from, in place of `robot`: names, files or tables, or a folder with "
        "`catalogue.toml`; see `trajevo choose-robot`.",
    )
    angle: Literal["rad", "deg"] = pydantic.Field(
        "rad",
        description="Unit of angles of points, boxes, given velocities and accelerations, `turning` and `upright`.",
    )
    limits: LimitKeys = pydantic.Field(LimitKeys(), description="Joint limits over those of the robot's own files.")
    payload: _Number | str | LoadKeys | list[LoadKeys] = pydantic.Field(
        0.0, description="What the tool carries: its mass [kg], a table, or tables of what is carried when."
    )
    payload_range: tuple[_Number, _Number] | None = pydantic.Field(
        None, description="Least and greatest payload, of objectives that choose it [kg]."
    )
    points: str | list[list[_Number] | PointKeys] = pydantic.Field(
        description="Points to visit, in order: joint positions [angle or m] or tables, or a CSV file."
    )
    base: BaseKeys | None = pydantic.Field(
        None, description="Where the robot may stand, if that is free; the points are then tool poses."
    )
    order: Literal["free"] | OrderKeys | None = pydantic.Field(
        None, description="Which points may be visited in any order; free means all between the ends."
    )
    postures: Literal["nearest", "best", "all"] | None = pydantic.Field(
        None,
        description="How postures of tool poses are chosen: nearest to the one before; best, by the times from rest to "
        "rest; or all, as a variable. If not given, nearest, or best where the order is free.",
    )
    turns: Literal["as_written", "shortest"] = pydantic.Field(
        "as_written", description="Whether joints go as points are written, or the shorter way round by whole turns."
    )
    moving: list[MovingSettings] = pydantic.Field([], description="Points that may move inside a box.")
    passing: list[PassingSettings] = pydantic.Field([], description="How points are passed, if not freely.")
    segment: list[SegmentSettings] = pydantic.Field([], description="What is asked of the tool between points.")
    cyclic: Annotated[bool, pydantic.Strict()] = pydantic.Field(
        False, description="The last point is the first, and the motion goes through it without a stop."
    )
    interpolant: str | None = pydantic.Field(
        None,
        description='Name in `trajevo list`, or "module:name"; if not given, bspline or quintic_spline.',
    )
    extra_points: Annotated[int, pydantic.Field(strict=True, ge=0)] = pydantic.Field(
        0, description="Number of free points in every gap between two points, for splines."
    )
    pace: Annotated[int, pydantic.Field(strict=True, ge=0)] | None = pydantic.Field(
        None,
        description="Number of variables of a pace that all times follow, from 4 to 200, or 0.",
    )
    bspline: dict[str, Any] | None = pydantic.Field(None, description="Of the interpolant bspline.")
    duration_bounds: list[_Number] | list[tuple[_Number, _Number]] = pydantic.Field(
        description="Least and greatest time between two points, one pair or one for each [s]."
    )
    objectives: list[str] = pydantic.Field(
        ["time", "energy"],
        description='What is minimised, by name as `trajevo list` shows it, or your own "module:name".',
    )
    constraints: _Constraints = pydantic.Field(_Constraints(), description="What is limited.")
    reference_point: list[_Number] | None = pydantic.Field(
        None,
        description="Far corner of the hypervolume's box, one number per objective [SI unit of each].",
    )
    algorithm: Search = pydantic.Field(Search(), description="Settings of the search.")
    seed: Annotated[int, pydantic.Field(strict=True, ge=0)] = pydantic.Field(1, description="Seed of all randomness.")
    samples: Annotated[int, pydantic.Field(strict=True, ge=2)] = pydantic.Field(
        6, description="Number of samples in every segment, where something is checked at samples."
    )

    @pydantic.model_validator(mode="after")
    def _one_robot(self) -> TaskSettings:
        if (self.robot is None) == (self.robots is None):
            got = "neither" if self.robot is None else "both"
            raise ValueError(f"robot: expected a robot, or robots to choose from, got {got}")
        return self

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
        if isinstance(self.payload, LoadKeys):
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
        "TaskSettings",
        __base__=TaskSettings,
        constraints=(constraints, pydantic.Field(constraints(), description="What is limited.")),
        **tables,
    )
    return cast("type[TaskSettings]", made)


def _key(parameter: LimitParameter) -> Any:
    """Type and default of a parameter's key."""
    kind = parameter.type if parameter.default is not None else parameter.type | None
    says = f"{parameter.help} [{parameter.unit}]" if parameter.unit else parameter.help
    return kind, pydantic.Field(parameter.default, description=says, strict=True)


def read_task(file: Path) -> tuple[TaskSettings, Places]:
    """Read the keys of a task, and their lines.

    Raises:
        InvalidInputError: the file cannot be read, or a key is missing, unknown or of the wrong type; the message names
            file, line and key.
    """
    content, places = read_toml(file)
    return validated(task_model(), content, places), places
