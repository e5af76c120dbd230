"""What a robot is put together from, chosen from its files and what a caller gave: transmission, tool, masses."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np

from trajevo.base.arrays import Array
from trajevo.errors import InvalidInputError, UnknownNameError
from trajevo.robot.description import Description
from trajevo.robot.loading.arguments import STANDARD_GRAVITY, checked_gravity
from trajevo.robot.masses import massless, moving_bodies
from trajevo.robot.transmission import Direct, Mimicking, Transmission
from trajevo.robot.urdf.bodies import tips
from trajevo.robot.urdf.joints import Follower

if TYPE_CHECKING:
    from trajevo.robot.robot_toml import RobotFile


def drives_of(
    model: Any, units: tuple[str, ...], following: tuple[Follower, ...], file: RobotFile | None
) -> tuple[Transmission, tuple[str, ...], tuple[str, ...]]:
    """The transmission, and the names and units of the actuators in the order of the model's joints."""
    joints = tuple(model.names[1:])
    led = {follower.name for follower in following}
    names = tuple(name for name in joints if name not in led)
    units = tuple(unit for name, unit in zip(joints, units, strict=True) if name not in led)
    transmission: Transmission = Direct()
    if file is not None:
        transmission, names, units = file.transmission(names, units)
    if not following:
        return transmission, names, units
    if file is not None and not isinstance(transmission, Direct):
        raise InvalidInputError(
            f"{file.path}: transmission: expected joints that follow no others, but {following[0]} in the URDF; lock it"
        )
    return Mimicking.of(joints, following), names, units


def gravity_of(given: Any, file: RobotFile | None, found: Description) -> Array:
    """Gravity in the base frame [m/s²]: as asked for, as files say, or the standard one along -z."""
    if given is not None:
        return checked_gravity(given)
    if file is not None:
        return file.gravity()
    return np.array(STANDARD_GRAVITY) if found.gravity is None else found.gravity


def tool_of(model: Any, tool: str | None, text: str, where: Path, file: RobotFile | None) -> str:
    """The frame at the end effector: the one asked for, that of ``robot.toml``, or the only tip."""
    ends = tips(ElementTree.fromstring(text))
    if tool is None and file is None and len(ends) != 1:
        raise InvalidInputError(f"{where}: tool: expected a frame, as the URDF has several tips: {', '.join(ends)}")
    chosen = tool or (ends[0] if file is None else file.settings.tool)
    if not model.existFrame(chosen):
        named = where if file is None else file.path
        raise UnknownNameError(f"tool frame in {named}", chosen, [frame.name for frame in model.frames[1:]])
    return chosen


def masses_meant(asked: bool | None, file: RobotFile | None, model: Any, found: Description) -> bool:
    """Whether it is meant that links have no mass: as asked for, as files say, or as their format has it."""
    if asked is not None:
        return asked
    if file is not None and file.settings.allow_massless:
        return True
    if not found.between:
        return False
    return all(found.between.issuperset(body.links) for body in massless(moving_bodies(model)))
