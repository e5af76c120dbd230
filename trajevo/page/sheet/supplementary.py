"""Loads that are mounted on links of the arm, such as a valve terminal on the forearm."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, final

from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError, UnknownNameError
from trajevo.page.sheet.load_data import LoadData
from trajevo.robot.payload import Payload
from trajevo.robot.robot import Robot


@final
@dataclass(frozen=True)
class SupplementaryLoad:
    """A load on the link that a joint moves.

    Attributes:
        joint: name of the joint.
        payload: the load; its centre of mass is in the frame of the joint.
    """

    joint: str
    payload: Payload

    __repr__ = brief

    @property
    def data(self) -> LoadData:
        """Its load data, in the frame of the joint."""
        return LoadData.of(self.payload)


def loads_on(robot: Robot, given: Any) -> tuple[SupplementaryLoad, ...]:
    """Loads by the joints that move them.

    Args:
        robot: the robot.
        given: joint -> payload, its settings, or its mass [kg].

    Raises:
        UnknownNameError: no such joint.
        InvalidInputError: something else, or a load that is no rigid body.
    """
    if not isinstance(given, Mapping):
        raise InvalidInputError(f"supplementary: expected joints with their loads, got {given!r}")
    names = list(robot.model.names)[1:]
    found = []
    for joint, load in given.items():
        if joint not in names:
            raise UnknownNameError("joint with a supplementary load", joint, names)
        try:
            payload = Payload.of(load, model=None)
        except InvalidInputError as error:
            raise InvalidInputError(f"supplementary: {joint}: {error}") from error
        if payload.model != "rigid":
            raise InvalidInputError(f"supplementary: expected a rigid load on {joint!r}, got {payload.model!r}")
        found.append(SupplementaryLoad(joint, payload))
    return tuple(found)
