"""Pinocchio's model of a URDF: one coordinate for every joint that moves, the others locked."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.plugins import deferred
from trajevo.errors import InvalidInputError, UnknownNameError
from trajevo.robot.loading.arguments import check_locked
from trajevo.robot.urdf.look import without_look

if TYPE_CHECKING:
    import pinocchio as pin
else:  # which takes a tenth of the time of importing trajevo
    pin = deferred("pinocchio")

#: Beginning of the names of links' frames that must differ from those of joints for a while.
_LINK = "link of trajevo "


def read_model(text: str, file: Path | str) -> Any:
    """Pinocchio model of a checked URDF, with one coordinate for every joint.

    Pinocchio describes a continuous joint by cosine and sine, which no spline can go through. Here it is a revolute
    joint without a range, so that -90° and 270° are two positions, a turn apart.

    Raises:
        InvalidInputError: Pinocchio cannot read it.
    """
    robot = ElementTree.fromstring(text)
    without_look(robot)
    endless = [joint for joint in robot.iterfind("joint") if joint.get("type") == "continuous"]
    unlimited = {joint.get("name", "") for joint in endless if joint.find("limit") is None}
    for joint in endless:
        joint.set("type", "revolute")
        limit = joint.find("limit")
        if limit is None:  # which only these joints may lack, while a revolute one has to have it
            limit = ElementTree.SubElement(joint, "limit", velocity="1", effort="1")
        limit.attrib |= {"lower": "-1", "upper": "1"}  # no number stands for infinity in the file
    try:
        model = pin.buildModelFromXML(ElementTree.tostring(robot, encoding="unicode"))
    except (ValueError, RuntimeError) as error:
        raise InvalidInputError(f"{file}: Pinocchio cannot read it: {error}") from error
    for name in (joint.get("name", "") for joint in endless):
        place = model.joints[model.getJointId(name)].idx_q
        model.lowerPositionLimit[place], model.upperPositionLimit[place] = -np.inf, np.inf
        if name in unlimited:
            model.upperVelocityLimit[place] = model.upperEffortLimit[place] = np.inf
    return model


def build_model(
    text: str,
    file: Path | str,
    lock: Mapping[str, float],
    limits: Mapping[str, Mapping[str, float]] | None = None,
) -> tuple[Any, tuple[str, ...]]:
    """Pinocchio model of a checked URDF with some joints locked, and the unit of every remaining joint.

    Args:
        text: the URDF.
        file: where it is from, for messages.
        lock: positions of the joints to lock [rad or m].
        limits: limits in place of those of the text, by joint and then ``lower``, ``upper``, ``velocity``, ``effort``;
            others are no part of a model.
    """
    model = _locked(read_model(text, file), file, lock)
    columns = {
        "lower": model.lowerPositionLimit,
        "upper": model.upperPositionLimit,
        "velocity": model.upperVelocityLimit,
        "effort": model.upperEffortLimit,
    }
    for place, name in enumerate(list(model.names)[1:]):
        for key, value in (limits or {}).get(name, {}).items():
            if key in columns:
                columns[key][place] = value
    return model, tuple("m" if _slides(joint) else "rad" for joint in list(model.joints)[1:])


def held_still(model: Any, file: Path | str, lock: Mapping[str, float]) -> tuple[list[int], Array]:
    """Numbers of the joints to lock in the full model, and a configuration of it with their locked positions."""
    held = pin.neutral(model)
    numbers = []
    for name, position in lock.items():
        if name not in list(model.names)[1:]:
            raise UnknownNameError(f"joint to lock in {file}", name, list(model.names)[1:])
        real = isinstance(position, int | float | np.number) and not isinstance(position, bool)
        if not (real and np.isfinite(position)):
            raise InvalidInputError(f"{file}: lock: expected a position of joint {name!r} [rad or m], got {position!r}")
        joint = model.joints[model.getJointId(name)]
        check_locked(model, file, name, joint, float(position))
        numbers.append(model.getJointId(name))
        held[joint.idx_q] = position
    return numbers, held


def _locked(model: Any, file: Path | str, lock: Mapping[str, float]) -> Any:
    """The model without its locked joints, in which a name that a link and a joint share is that of the link's frame.

    Pinocchio finds a joint to lock by the name of its frame, which must then be the only one of that name.
    """
    if lock and len(lock) == model.njoints - 1:
        raise InvalidInputError(f"{file}: lock: expected at least one joint left to move, got all locked: {list(lock)}")
    links = [frame for frame in model.frames if frame.type == pin.BODY]
    shared = {frame.name for frame in links} & {frame.name for frame in model.frames if frame.type != pin.BODY}
    for frame in links:
        frame.name = f"{_LINK}{frame.name}" if frame.name in shared else frame.name
    reduced = pin.buildReducedModel(model, *held_still(model, file, lock)) if lock else model
    for frame in reduced.frames:
        if frame.type == pin.BODY:
            frame.name = frame.name.removeprefix(_LINK)
        elif frame.name in shared:
            frame.name = f"joint {frame.name}"
    return reduced


def _slides(joint: Any) -> bool:
    return "JointModelP" in joint.shortname()
