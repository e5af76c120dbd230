"""The keys of ``[robot]`` and ``[limits]`` of a task, and of a robot in a catalogue."""

from __future__ import annotations

from typing import Annotated

import pydantic

from trajevo.base.shown.brief import brief
from trajevo.robot.contacts.keys import GripKeys, StandKeys
from trajevo.robot.loading.dh_keys import DhKeys
from trajevo.robot.loading.drive_keys import DriveKeys, SupplyKeys

_Number = Annotated[float, pydantic.Strict()]
_Values = _Number | str | list[_Number | str] | dict[str, _Number | str]

#: The same, each of which may be a table with the limits of both directions.
_Side = dict[str, _Number | str]
_Directed = _Number | str | list[_Number | str | _Side] | dict[str, _Number | str | _Side]


class Keys(pydantic.BaseModel):
    """Keys of a table, which takes no others."""

    model_config = pydantic.ConfigDict(extra="forbid", frozen=True, defer_build=True)

    __repr__ = brief


class PlaceKeys(Keys):
    """Where something is: lengths in m and angles in rad, or text with a unit."""

    position: list[_Number | str] | None = pydantic.Field(
        None, description="Where its origin is, x, y and z; a text has its unit [m]."
    )
    rpy: list[_Number | str] | None = pydantic.Field(
        None, description="How it is turned: roll, pitch and yaw; a text has its unit [rad]."
    )


class ToolKeys(PlaceKeys):
    """A tool that can be mounted."""

    name: str = pydantic.Field(description="Name of the tool's frame.")
    parent: str = pydantic.Field(description="Frame to which it is mounted.")
    mass: _Number | str | None = pydantic.Field(None, description="Its mass; a text has its unit [kg].")
    com: list[_Number | str] | None = pydantic.Field(
        None, description="Its centre of mass in its own frame, x, y and z; a text has its unit [m]."
    )
    inertia: list[_Number] | list[list[_Number]] | None = pydantic.Field(
        None, description="Its inertia about the centre of mass: 3 principal values, or 3 rows of 3 [kg*m^2]."
    )


class LimitKeys(Keys):
    """Joint limits: one for all joints, a list with one per joint, or a table by joint name.

    A limit is a number in SI units or a text with a unit; a position limit is a pair of the lower and the upper end. A
    limit of velocity, acceleration or effort may also be a table with the magnitudes ``backward`` and ``forward``.
    """

    position: list[_Number | str | list[_Number | str]] | dict[str, list[_Number | str]] | None = pydantic.Field(
        default=None, description="Lower and upper end, one pair for all joints or one each [rad or m]."
    )
    velocity: _Directed | None = pydantic.Field(default=None, description="Greatest velocity [rad/s or m/s].")
    acceleration: _Directed | None = pydantic.Field(
        default=None, description="Greatest acceleration [rad/s^2 or m/s^2]."
    )
    jerk: _Values | None = pydantic.Field(default=None, description="Greatest jerk [rad/s^3 or m/s^3].")
    effort: _Directed | None = pydantic.Field(default=None, description="Greatest torque or force [N*m or N].")


class RobotKeys(Keys):
    """A robot by its name or file; or a Denavit-Hartenberg table; or joints alone, whose limits are in ``[limits]``."""

    name: str = pydantic.Field(
        description="Name in `trajevo list`, folder with robot.toml, or file; with `dh` or `joints` what it is called."
    )
    dh: DhKeys | None = pydantic.Field(None, description="Denavit-Hartenberg table of a robot without a file.")
    joints: list[str] | None = pydantic.Field(
        None, description="Names of the joints of a robot that is nothing but joints, without bodies."
    )
    kind: str | list[str] | None = pydantic.Field(
        None, description="What those joints do: revolute, prismatic or continuous, for all or one for each."
    )
    tool: str | None = pydantic.Field(None, description="Frame at the end effector; the robot's own if not given.")
    lock: dict[str, _Number] | None = pydantic.Field(
        None, description="Joints that are held still, name -> position [rad or m]."
    )
    gravity: tuple[_Number, _Number, _Number] | None = pydantic.Field(
        None, description="Gravity in the base frame [m/s^2]."
    )
    allow_massless: Annotated[bool, pydantic.Strict()] | None = pydantic.Field(
        None, description="Links without mass are meant: efforts leave them out."
    )
    friction: str | dict[str, _Values] | None = pydantic.Field(
        None,
        description='"none" leaves out what the file says; or `viscous`, `coulomb` and `armature` in SI units, one '
        "value for all joints, one each, or by name.",
    )
    packages: str | list[str] | None = pydantic.Field(
        None, description="Folders that hold packages of meshes and xacro."
    )
    xacro: dict[str, str | bool | int | float] | None = pydantic.Field(None, description="Arguments of a xacro file.")
    base: PlaceKeys | None = pydantic.Field(None, description="Where the robot stands in the cell.")
    tools: list[ToolKeys] | None = pydantic.Field(
        None, description="Tools that can be mounted, of which `tool` names one."
    )
    drives: dict[str, DriveKeys] | None = pydantic.Field(None, description="Drives of joints, by their names.")
    grip: GripKeys | None = pydantic.Field(None, description="How it holds a payload by friction.")
    stand: StandKeys | None = pydantic.Field(None, description="What it stands on without being bolted.")
    supply: SupplyKeys | None = pydantic.Field(None, description="Supply of all drives.")
    limits: LimitKeys | None = pydantic.Field(
        None, description="Limits of its joints over `[limits]`, where robots are compared."
    )


class RobotOffer(RobotKeys):
    """A robot among those to choose from: the keys of ``[robot]``, and what a buyer knows of it."""

    path: str | None = pydantic.Field(
        None, description="Folder or file of the robot, or its name in `trajevo list`; `name` if not given."
    )
    price: _Number | str | None = pydantic.Field(
        None, description='Its price: a text with its currency, such as "24000 EUR".'
    )
    mass: _Number | str | None = pydantic.Field(None, description="Mass of the arm; a text has its unit [kg].")
    reach: _Number | str | None = pydantic.Field(None, description="Its reach; a text has its unit [m].")
