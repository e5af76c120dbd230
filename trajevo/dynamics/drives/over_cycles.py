"""What drives bear over cycles as one number of a motion, to be minimised."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.dynamics.drives.duty import Duty
from trajevo.dynamics.drives.heat import greatest_rises, rms_torques
from trajevo.dynamics.drives.motors import Motors
from trajevo.dynamics.drives.power import greatest_supply_power
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.robot.robot import Robot


@final
@dataclass(frozen=True, eq=False)
class OfDuty:
    """The greatest of all joints, shape (B,): share of a continuous torque [1], or temperature of a winding [K].

    Attributes:
        of: which of both.
        duty: how often the motion is made.
    """

    of: Literal["rms torque", "winding rise"]
    duty: Duty

    __repr__ = brief

    def __call__(self, rollout: Rollout) -> Array:
        """The greatest of all joints of which it is known."""
        if self.of == "rms torque":
            limits = np.array([drive.continuous_torque or np.inf for drive in Motors.of(rollout).drives])
            found = rms_torques(rollout, self.duty) / limits
        else:
            rises = greatest_rises(rollout, self.duty)
            found = np.where(np.isnan(rises.real), -np.inf, rises)
        greatest: Array = np.take_along_axis(found, found.real.argmax(axis=1)[:, None], axis=1)[:, 0]
        return greatest


#: Objectives of drives: name, SI unit, function of a rollout, and what it is.
OF_DRIVES: tuple[tuple[str, str, Callable[[Rollout], Array], str], ...] = (
    (
        "rms_torque_share",
        "1",
        OfDuty("rms torque", Duty()),
        "greatest share of a motor's continuous torque that its RMS torque over a cycle is",
    ),
    (
        "winding_rise",
        "K",
        OfDuty("winding rise", Duty()),
        "greatest temperature of any winding above its surroundings",
    ),
    (
        "peak_power",
        "W",
        greatest_supply_power,
        "greatest power that all motors take together from a shared supply",
    ),
)

_OF_DUTY = {name for name, _, function, _ in OF_DRIVES if isinstance(function, OfDuty)}


def of_duty(names: Any) -> bool:
    """Whether one of the named objectives depends on how often the motion is made; False for what is no list."""
    return not isinstance(names, str) and isinstance(names, Sequence) and not _OF_DUTY.isdisjoint(map(str, names))


def at_duty(function: Callable[[Rollout], Array], duty: Duty | None) -> Callable[[Rollout], Array]:
    """An objective's function for a motion that is made so often; the same if it does not depend on it."""
    return function if duty is None or not isinstance(function, OfDuty) else replace(function, duty=duty)


def check_known(robot: Robot, name: str) -> None:
    """Refuse a robot of whose drives nothing tells what an objective asks.

    Raises:
        InvalidInputError: no drives, no continuous torque, or none that tells all that a temperature follows from.
    """
    drives = robot.drives.values()
    if not drives:
        raise InvalidInputError(f"objectives: {name} needs drives, robot {robot.name!r} has none")
    if name == "rms_torque_share" and all(drive.continuous_torque is None for drive in drives):
        raise InvalidInputError(f"objectives: {name} needs continuous_torque of a drive, robot {robot.name!r} has none")
    if name == "winding_rise" and all(drive.lacking_for_heat for drive in drives):
        lacking = min((drive.lacking_for_heat for drive in drives), key=len)
        raise InvalidInputError(
            f"objectives: {name} needs {', '.join(lacking)} of a drive, robot {robot.name!r} has none"
        )
