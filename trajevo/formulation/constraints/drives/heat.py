"""What motors bear over a whole cycle: root-mean-square torque, and temperatures of windings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.dynamics.drives.duty import Duty, checked_cycles, checked_dwell
from trajevo.dynamics.drives.heat import greatest_rises, rms_torques
from trajevo.dynamics.drives.motors import UNKNOWN
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.formulation.constraints.constraint import Constraint, LimitKind, LimitParameter
from trajevo.robot.robot import Robot


@final
@dataclass(frozen=True, eq=False)
class OverCycles:
    """Root-mean-square torques or greatest temperatures over their limits, minus 1, shape (B, columns).

    Attributes:
        of: which of both.
        duty: how often the motion is made.
        joints: numbers of the joints that are limited.
        limits: continuous torques [N·m or N], or greatest rises [K].
    """

    of: Literal["rms torque", "winding temperature"]
    duty: Duty
    joints: tuple[int, ...]
    limits: tuple[float, ...]

    __repr__ = brief

    def __call__(self, rollout: Rollout) -> Array:
        """The excess."""
        found = rms_torques(rollout, self.duty) if self.of == "rms torque" else greatest_rises(rollout, self.duty)
        excess: Array = found[:, list(self.joints)] / np.array(self.limits) - 1.0
        return excess


def rms_torque_limits(robot: Robot, *, duty: Duty) -> Constraint:
    """Root of the mean square of every motor's torque over a cycle, over its continuous torque, minus 1.

    Args:
        robot: the robot.
        duty: how often the motion is made.

    Raises:
        InvalidInputError: a robot without masses, or without a drive that tells a continuous torque.
    """
    drives = [robot.drives.get(name, UNKNOWN) for name in robot.joint_names]
    limits = {k: drive.continuous_torque for k, drive in enumerate(drives) if drive.continuous_torque is not None}
    _check(robot, "rms_torque", "continuous_torque", limits)
    return _constraint(robot, OverCycles("rms torque", duty, tuple(limits), tuple(limits.values())))


def winding_temperature_limits(robot: Robot, *, duty: Duty) -> Constraint:
    """Greatest temperature of every winding above its surroundings in the last cycle, over its limit, minus 1.

    Args:
        robot: the robot.
        duty: how often the motion is made.

    Raises:
        InvalidInputError: a robot without masses, without a drive that tells a greatest rise, or one that tells it
            without all from which the temperature follows.
    """
    limits = {}
    for k, name in enumerate(robot.joint_names):
        drive = robot.drives.get(name, UNKNOWN)
        if drive.greatest_rise is None:
            continue
        if drive.lacking_for_heat:
            raise InvalidInputError(
                f"constraints: 'winding_temperature' needs {', '.join(drive.lacking_for_heat)} of the drive of "
                f"{name!r}, which tells a greatest_rise"
            )
        limits[k] = drive.greatest_rise
    _check(robot, "winding_temperature", "greatest_rise", limits)
    return _constraint(robot, OverCycles("winding temperature", duty, tuple(limits), tuple(limits.values())))


def _check(robot: Robot, name: str, needed: str, limits: dict[int, float]) -> None:
    robot.check_masses(f"a limit of {name}")
    if not limits:
        raise InvalidInputError(
            f"constraints: {name!r} needs {needed} of a drive, but robot {robot.name!r} has "
            f"{'none' if robot.drives else 'no drives'}"
        )


def _constraint(robot: Robot, function: OverCycles) -> Constraint:
    return Constraint(
        tuple(f"{function.of} of {robot.joint_names[k]}" for k in function.joints),
        f"{robot.reference}; {function.duty}",
        function,
        quantity=function.of,
    )


def _dwell(_name: str, given: Any, _unit: str) -> float:
    return checked_dwell(given)


def _cycles(_name: str, given: Any, _unit: str) -> int:
    return checked_cycles(given, forever=0) or 0


#: Parameters that both kinds share.
DWELL = LimitParameter("dwell", "s", "time at rest after each motion, before it begins anew", _dwell, default=0.0)
CYCLES = LimitParameter(
    "cycles",
    "1",
    "how often the motion is made from cold windings on; 0 for ever",
    _cycles,
    default=0,
    type=int,
)


#: Their names, which objectives of drives share too.
SHARED = (DWELL.name, CYCLES.name)


def duty_of(dwell: Any, cycles: Any) -> Duty:
    """How often a motion is made, from the parameters; None for what is not given.

    Raises:
        InvalidInputError: one that cannot be used.
    """
    rest, count = (
        parameter.value(parameter.default if given is None else given)
        for parameter, given in ((DWELL, dwell), (CYCLES, cycles))
    )
    return Duty(rest, count or None)


RMS_TORQUE = LimitKind(
    "rms_torque",
    "root-mean-square torques of motors over a cycle, against their continuous torques",
    lambda limited, dwell: rms_torque_limits(limited.robot, duty=Duty(dwell)),
    (DWELL,),
)

WINDING_TEMPERATURE = LimitKind(
    "winding_temperature",
    "temperatures of windings in the last of some cycles, or in the state that repeats",
    lambda limited, dwell, cycles: winding_temperature_limits(limited.robot, duty=duty_of(dwell, cycles)),
    (DWELL, CYCLES),
)
