"""Logs of a robot's joints: what was measured along a motion, from a table or from arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, frozen, numbers
from trajevo.base.shown.brief import brief
from trajevo.base.units import per_time
from trajevo.errors import InvalidInputError
from trajevo.path.tables import read_table
from trajevo.robot.robot import Robot

#: What may be logged of a joint: the word in its column -> the word here.
QUANTITIES: Mapping[str, str] = {
    "position": "position",
    "velocity": "velocity",
    "acceleration": "acceleration",
    "jerk": "jerk",
    "effort": "effort",
    "torque": "effort",
    "force": "effort",
    "current": "current",
}

#: Fewest rows of a log.
_FEWEST = 8

#: Derivative with respect to time that a quantity is.
_ORDERS = {"position": 0, "velocity": 1, "acceleration": 2, "jerk": 3}


@final
@dataclass(frozen=True, eq=False)
class JointLog:
    """What was measured of a robot's joints at T instants.

    Attributes:
        time: ascending instants, shape (T,) [s].
        position: shape (T, n_joints) [rad or m].
        effort: shape (T, n_joints) [N·m or N], NaN for joints without such a column.
        current: of the motors, shape (T, n_joints) [A], NaN for joints without such a column.
        further: columns of the whole robot by name, shape (T,) each, SI.
        source: the file, or "arrays".

    Raises:
        InvalidInputError: arrays of other shapes, too few instants, or instants that do not ascend.
    """

    time: Array
    position: Array
    effort: Array
    current: Array
    further: Mapping[str, Array]
    source: str

    __repr__ = brief

    def __len__(self) -> int:
        return len(self.time)

    @classmethod
    def of(cls, given: Any, robot: Robot, *, name: str = "log", further: Mapping[str, str] | None = None) -> JointLog:
        """The log that a caller passed: itself, a file, or arrays by name.

        Args:
            given: a log, a file (see :func:`read_joint_log`), or a mapping with ``time`` (T,) [s], ``position``
                (T, n_joints) [rad or m] and ``effort`` [N·m or N] or ``current`` [A] of the same shape.
            robot: the robot.
            name: name of the argument, for messages.
            further: as for :func:`read_joint_log`.
        """
        if isinstance(given, JointLog):
            return given
        if isinstance(given, str | Path):
            return read_joint_log(given, robot, further=further)
        if not isinstance(given, Mapping) or not {"time", "position"} <= set(given):
            raise InvalidInputError(
                f"{name}: expected a file, or a mapping with time, position and effort or current, "
                f"got {sorted(map(str, given)) if isinstance(given, Mapping) else type(given).__name__}"
            )
        more = further or {}
        unknown = sorted(map(str, set(given) - {"time", "position", "effort", "current", *more}))
        if unknown:
            raise InvalidInputError(
                f"{name}: expected time, position, effort and current, got {', '.join(unknown)} too"
            )
        time = numbers(given["time"], name=f"{name}: time", shape=("instants",))
        shape = len(time), robot.dof
        position = numbers(given["position"], name=f"{name}: position", shape=shape)
        measured = {
            one: numbers(given[one], name=f"{name}: {one}", shape=shape) if one in given else np.full(shape, np.nan)
            for one in ("effort", "current")
        }
        others = {one: numbers(given[one], name=f"{name}: {one}", shape=shape[:1]) for one in more if one in given}
        return _checked(time, position, measured, others, "arrays", name)


def read_joint_log(file: str | Path, robot: Robot, *, further: Mapping[str, str] | None = None) -> JointLog:
    """A log from a table, see :mod:`trajevo.path.tables`.

    Args:
        file: its columns, each with its unit and in any order, are ``time [s]``, ``NAME position [deg]`` for every
            joint and, for those of which it was measured, ``NAME effort [N*m]`` or ``NAME current [A]``; also columns
            of velocity, acceleration and jerk, as a motion that is written by ``export`` has them, which are not used.
        robot: the robot, which gives the names of the joints.
        further: names of columns of the whole robot that are read too if they are there -> their SI units.

    Raises:
        InvalidInputError: the file cannot be read, or has other columns; the message names the column.
    """
    joints = dict(zip(robot.joint_names, robot.joint_units, strict=True))
    example = "time [s], " + ", ".join(f"{one} position [{unit}]" for one, unit in joints.items())
    table = read_table(file, example=f"{example}, {robot.joint_names[0]} effort [{_effort_unit(robot.joint_units[0])}]")
    needed = {"time": "s"} | {f"{one} position": unit for one, unit in joints.items()}
    may_be = {
        f"{one} {word}": _unit(quantity, unit)
        for one, unit in joints.items()
        for word, quantity in QUANTITIES.items()
        if word != "position"
    } | dict(further or {})
    columns = needed | {one: unit for one, unit in may_be.items() if one in table.names}
    if not set(table.names) <= set(columns):  # all columns that a log may have are told
        columns |= may_be
    values = dict(zip(columns, table.si(columns).T, strict=True))
    measured = {one: np.full((len(table.numbers), robot.dof), np.nan) for one in ("position", "effort", "current")}
    for k, joint in enumerate(robot.joint_names):
        for word, quantity in QUANTITIES.items():
            if quantity in measured and f"{joint} {word}" in values:
                if not np.isnan(measured[quantity][:, k]).all():
                    raise InvalidInputError(f"{file}: expected one column of effort of {joint!r}, got two")
                measured[quantity][:, k] = values[f"{joint} {word}"]
    others = {one: values[one] for one in further or {} if one in values}
    return _checked(values["time"], measured.pop("position"), measured, others, str(file), str(file))


def _checked(
    time: Array, position: Array, measured: dict[str, Array], others: dict[str, Array], source: str, name: str
) -> JointLog:
    if len(time) < _FEWEST:
        raise InvalidInputError(f"{name}: expected at least {_FEWEST} instants, got {len(time)}")
    back = np.flatnonzero(np.diff(time) <= 0.0)
    if len(back):
        raise InvalidInputError(
            f"{name}: expected instants that ascend, got {time[back[0] + 1]:g} s after {time[back[0]]:g} s"
        )
    return JointLog(
        time=frozen(np.array(time)),
        position=frozen(np.array(position)),
        effort=frozen(np.array(measured["effort"])),
        current=frozen(np.array(measured["current"])),
        further={one: frozen(np.array(values)) for one, values in others.items()},
        source=source,
    )


def _unit(quantity: str, unit: str) -> str:
    """SI unit of a quantity of a joint whose position has a unit."""
    if quantity == "current":
        return "A"
    return _effort_unit(unit) if quantity == "effort" else per_time(unit, _ORDERS[quantity])


def _effort_unit(unit: str) -> str:
    return "N*m" if unit == "rad" else "N"
