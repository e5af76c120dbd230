"""Objectives: pure functions of a rollout, to be minimised, each with its name, unit and other properties.

To add one, write its function of a rollout and add an :class:`Objective` to :data:`OBJECTIVES`; nothing else is needed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Literal

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.plugins import Registry, first_line, plain_name
from trajevo.base.shown.brief import brief
from trajevo.dynamics.drives.duty import Duty
from trajevo.dynamics.drives.electrical import check_drives, electrical_energy
from trajevo.dynamics.drives.over_cycles import OF_DRIVES, at_duty, check_known
from trajevo.dynamics.integrals.efforts import (
    greatest_effort_rates,
    greatest_efforts,
    integrated_square_effort,
    integrated_square_effort_rate,
    integrated_square_power,
    mechanical_energy,
)
from trajevo.dynamics.integrals.footprint import footprint
from trajevo.dynamics.integrals.travel import joint_travel, tool_path_length
from trajevo.dynamics.payload_regressor.excitation import payload_condition
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.robot.joints import position_unit
from trajevo.robot.robot import Robot

#: What an objective can need: the place of the tool, the masses of all links, the drives of all joints, a limit of some
#: joint's effort, the payload's mass as a decision variable, accelerations that do not jump, or what some drives tell.
Need = Literal[
    "tool", "masses", "drives", "effort limits", "payload variable", "continuous accelerations", "known drives"
]

#: Name of the objective that makes the payload's mass a variable.
UNUSED_PAYLOAD = "unused_payload"


@dataclass(frozen=True)
class Objective:
    """Something to minimise.

    Attributes:
        name: short name.
        unit: SI unit; in a registered objective ``{joint}`` stands for the unit of the robot's joints and ``{effort}``
            for that of their effort.
        reference: source of the formula.
        function: rollout of B trajectories -> (B,).
        needs: what the problem must have.
        help: description in one line.
        terms: rollout -> the smooth values whose greatest the objective is, (B, K); None if it is smooth itself.
        columns: number of columns of the function, for an objective in terms; None for one value, (B,).
    """

    name: str
    unit: str
    reference: str
    function: Callable[[Rollout], Array]
    needs: tuple[Need, ...] = field(default=(), kw_only=True)
    help: str = field(default="", kw_only=True)
    terms: Callable[[Rollout], Array] | None = field(default=None, kw_only=True)
    columns: int | None = field(default=None, kw_only=True)

    __repr__ = brief


def total_time(rollout: Rollout) -> Array:
    """Duration of the motion, T = Σ Δt, shape (B,) [s]."""
    return rollout.trajectory.duration


def summed_rms(rollout: Rollout, derivative: int) -> Array:
    """Σ over joints of √(1/T ∫ (d-th derivative)² dt), exact, shape (B,) [rad/s^d or m/s^d]."""
    trajectory = rollout.trajectory
    mean_square = trajectory.integral_of_square(derivative) / trajectory.duration[:, None]
    total: Array = np.sqrt(mean_square).sum(axis=1)
    return total


def summed_rms_acceleration(rollout: Rollout) -> Array:
    """Σ over joints of the RMS acceleration, shape (B,) [rad/s² or m/s²]."""
    return summed_rms(rollout, 2)


def summed_rms_jerk(rollout: Rollout) -> Array:
    """Σ over joints of the RMS jerk, shape (B,) [rad/s³ or m/s³]."""
    return summed_rms(rollout, 3)


def integrated_square_acceleration(rollout: Rollout) -> Array:
    """∫ Σ over joints of acceleration² dt, exact, shape (B,) [rad²/s³ or m²/s³]."""
    total: Array = rollout.trajectory.integral_of_square(2).sum(axis=1)
    return total


def integrated_square_jerk(rollout: Rollout) -> Array:
    """∫ Σ over joints of jerk² dt, exact, shape (B,) [rad²/s⁵ or m²/s⁵]."""
    total: Array = rollout.trajectory.integral_of_square(3).sum(axis=1)
    return total


@dataclass(frozen=True)
class _TrapezoidSquareJerk:
    intervals: int

    def __call__(self, rollout: Rollout) -> Array:
        trajectory = rollout.trajectory
        shares = np.linspace(0.0, 1.0, self.intervals + 1)
        jerk = trajectory.evaluate(trajectory.duration[:, None] * shares, 3)
        square = np.square(jerk).sum(axis=2)
        mean: Array = (square.sum(axis=1) - 0.5 * (square[:, 0] + square[:, -1])) / self.intervals
        return trajectory.duration * mean


def trapezoid_square_jerk(intervals: int) -> Callable[[Rollout], Array]:
    """∫ Σ over joints of jerk² dt by the trapezoidal rule, eq. (29) of Paing 2021 [rad²/s⁵ or m²/s⁵]."""
    return _TrapezoidSquareJerk(intervals)


@dataclass(frozen=True)
class _TimesDuration:
    function: Callable[[Rollout], Array]
    power: int

    def __call__(self, rollout: Rollout) -> Array:
        total: Array = self.function(rollout) * rollout.trajectory.duration**self.power
        return total


def times_duration(function: Callable[[Rollout], Array], power: int) -> Callable[[Rollout], Array]:
    """An objective times a power of the duration, constant in the duration if the objective falls with that power."""
    return _TimesDuration(function, power)


def effort_ratio(rollout: Rollout) -> Array:
    """Greatest ratio of |effort| to its limit over all joints and the whole motion, shape (B,) [1]."""
    limit = rollout.robot.limits.sides("effort").lesser
    kept = np.isfinite(limit)
    greatest: Array = (greatest_efforts(rollout)[:, kept] / limit[kept]).max(axis=1)
    return greatest


def peak_acceleration(rollout: Rollout) -> Array:
    """Greatest |acceleration| of any joint at any instant, exact, shape (B,) [rad/s² or m/s²]."""
    greatest: Array = rollout.trajectory.peak(2).max(axis=1)
    return greatest


def peak_jerk(rollout: Rollout) -> Array:
    """Greatest |jerk| of any joint at any instant, exact, shape (B,) [rad/s³ or m/s³]."""
    greatest: Array = rollout.trajectory.peak(3).max(axis=1)
    return greatest


def peak_terms(rollout: Rollout, *, derivative: int) -> Array:
    """The smooth values whose greatest is the greatest |derivative| of any joint, shape (B, K) [SI]."""
    return rollout.trajectory.peak_terms(derivative)


def peak_effort_rate(rollout: Rollout) -> Array:
    """Greatest |d effort / dt| of any joint, shape (B,) [N·m/s or N/s]; steps do not count."""
    greatest: Array = greatest_effort_rates(rollout).max(axis=1)
    return greatest


@dataclass(frozen=True)
class _UnusedPayload:
    greatest: float

    def __call__(self, rollout: Rollout) -> Array:
        masses = rollout.masses if rollout.masses is not None else np.array(rollout.dynamics.payload.mass)
        unused: Array = self.greatest - masses + np.zeros(len(rollout.trajectory))
        return unused


def unused_payload(greatest: float) -> Callable[[Rollout], Array]:
    """The greatest payload minus the payload [kg]; minimising it maximises the payload."""
    return _UnusedPayload(greatest)


_BY_NAME = "by name"

#: Objectives by name.
OBJECTIVES: dict[str, Objective] = {
    objective.name: objective
    for objective in (
        Objective("time", "s", _BY_NAME, total_time, help="duration of the motion"),
        Objective(
            "acceleration", "{joint}/s^2", _BY_NAME, summed_rms_acceleration, help="Σ over joints of RMS acceleration"
        ),
        Objective(
            "jerk",
            "{joint}/s^3",
            _BY_NAME,
            summed_rms_jerk,
            needs=("continuous accelerations",),
            help="Σ over joints of RMS jerk",
        ),
        Objective(
            "square_acceleration",
            "{joint}^2/s^3",
            _BY_NAME,
            integrated_square_acceleration,
            help="∫ Σ over joints of acceleration² dt",
        ),
        Objective(
            "square_jerk",
            "{joint}^2/s^5",
            _BY_NAME,
            integrated_square_jerk,
            needs=("continuous accelerations",),
            help="∫ Σ over joints of jerk² dt",
        ),
        Objective(
            "energy",
            "J",
            _BY_NAME,
            mechanical_energy,
            needs=("masses",),
            help="∫ Σ over joints of |effort x velocity| dt",
        ),
        Objective(
            "electrical_energy",
            "J",
            _BY_NAME,
            electrical_energy,
            needs=("masses", "drives"),
            help="what drives draw from the mains, with losses, recuperation and standby",
        ),
        Objective(
            "square_power",
            "W^2*s",
            _BY_NAME,
            integrated_square_power,
            needs=("masses",),
            help="∫ Σ over joints of (effort x velocity)² dt",
        ),
        Objective(
            "square_effort",
            "{effort}^2*s",
            _BY_NAME,
            integrated_square_effort,
            needs=("masses",),
            help="∫ Σ over joints of effort² dt",
        ),
        Objective(
            "square_effort_rate",
            "{effort}^2/s",
            _BY_NAME,
            integrated_square_effort_rate,
            needs=("masses", "continuous accelerations"),
            help="∫ Σ over joints of (d effort / dt)² dt",
        ),
        Objective(
            "effort_ratio",
            "1",
            _BY_NAME,
            effort_ratio,
            needs=("masses", "effort limits"),
            help="greatest share of an effort limit that any joint uses",
        ),
        Objective(
            "peak_acceleration",
            "{joint}/s^2",
            _BY_NAME,
            peak_acceleration,
            terms=partial(peak_terms, derivative=2),
            help="greatest acceleration of any joint at any instant",
        ),
        Objective(
            "peak_jerk",
            "{joint}/s^3",
            _BY_NAME,
            peak_jerk,
            needs=("continuous accelerations",),
            terms=partial(peak_terms, derivative=3),
            help="greatest jerk of any joint at any instant",
        ),
        Objective(
            "peak_effort_rate",
            "{effort}/s",
            _BY_NAME,
            peak_effort_rate,
            needs=("masses", "continuous accelerations"),
            help="greatest d effort / dt of any joint",
        ),
        *(
            Objective(name, unit, _BY_NAME, function, needs=("masses", "known drives"), help=told)
            for name, unit, function, told in OF_DRIVES
        ),
        Objective("joint_travel", "{joint}", _BY_NAME, joint_travel, help="Σ over joints of ∫ |velocity| dt"),
        Objective(
            "tool_path",
            "m",
            _BY_NAME,
            tool_path_length,
            needs=("tool",),
            help="∫ |velocity of the tool's origin| dt",
        ),
        Objective(
            "footprint",
            "m^2",
            _BY_NAME,
            footprint,
            needs=("tool",),
            help="floor area of the rectangle that holds base, joints and tool at all samples",
        ),
        Objective(
            "payload_condition",
            "1",
            _BY_NAME,
            payload_condition,
            needs=("tool",),
            help="condition number with which the motion shows a payload's ten parameters",
        ),
        # Minus the mass: a problem replaces it by the objective of its PayloadVariable, which has the greatest mass.
        Objective(
            UNUSED_PAYLOAD,
            "kg",
            _BY_NAME,
            unused_payload(0.0),
            needs=("masses", "payload variable"),
            help="greatest payload minus that of the solution, whose mass is a variable",
        ),
    )
}


def objective_of(place: str, function: Any) -> Objective:
    """The objective of a user's function of a rollout, with its name and, if it has one, its attribute ``unit``.

    Raises:
        InvalidInputError: something else, or a function without a name.
    """
    name = plain_name("objective", place, function, "Objective('my_name', 'unit', 'source', function)")
    unit = getattr(function, "unit", "1")
    if not isinstance(unit, str):
        raise InvalidInputError(f"objectives: {place!r}: its unit: expected a text such as 'W', got {unit!r}")
    return Objective(name, unit, place, function, help=first_line(function))


#: Objectives by name, with those of other packages and functions of the user's.
NAMED_OBJECTIVES: Registry[Objective] = Registry(
    kind="objective",
    group="trajevo.objectives",
    own=OBJECTIVES,
    expected="a trajevo.Objective",
    fits=lambda found: isinstance(found, Objective),
    made=objective_of,
)


def objectives_of(
    names: Sequence[str],
    robot: Robot,
    *,
    reference: str | None = None,
    payload: Objective | None = None,
    duty: Duty | None = None,
) -> tuple[Objective, ...]:
    """Objectives by name: those of :data:`OBJECTIVES` and of the entry-point group ``trajevo.objectives``.

    Args:
        names: names of the objectives.
        robot: the robot, which gives the units.
        reference: reference that replaces those of the objectives; they keep their own if None.
        payload: the objective ``unused_payload`` if the payload's mass is a variable, else None.
        duty: how often the motion is made, for what drives bear over cycles; for ever without rest if None.

    Raises:
        UnknownNameError: no such objective.
        InvalidInputError: the names are not a list, a registered object is not an objective, or the problem lacks
            something that an objective needs.
    """
    if isinstance(names, str) or not isinstance(names, Sequence):
        raise InvalidInputError(f"objectives: expected a list of names, got {names!r}")
    at_hand = (
        NAMED_OBJECTIVES if payload is None else replace(NAMED_OBJECTIVES, own=OBJECTIVES | {payload.name: payload})
    )
    found = [at_hand.find(name) for name in names]
    found = [replace(objective, function=at_duty(objective.function, duty)) for objective in found]
    for objective in found:
        _check_needs(objective, robot, with_payload=payload is not None)
    return tuple(
        objective
        if objective is payload
        else replace(objective, unit=unit_for(objective.unit, robot), reference=reference or objective.reference)
        for objective in found
    )


def needs_payload_variable(names: Sequence[str]) -> bool:
    """Whether one of the named objectives needs the payload's mass as a decision variable."""
    return any("payload variable" in NAMED_OBJECTIVES.find(name).needs for name in names)


def of_joints_alone(names: Sequence[str]) -> bool:
    """Whether named objectives know nothing but time and the motion of the joints; False for what is no list.

    Those of users and of other packages may know more.
    """
    if isinstance(names, str) or not isinstance(names, Sequence):
        return False
    known = [OBJECTIVES.get(name) for name in names]
    return all(one is not None and set(one.needs) <= {"continuous accelerations"} for one in known)


def _check_needs(objective: Objective, robot: Robot, *, with_payload: bool) -> None:
    if "tool" in objective.needs:
        robot.check_body(objective.name)
    if "masses" in objective.needs:
        robot.check_masses(objective.name)
    if "drives" in objective.needs:
        check_drives(robot, f"objectives: {objective.name}")
    if "effort limits" in objective.needs and not robot.limits.sides("effort").limited.any():
        raise InvalidInputError(f"objectives: {objective.name} needs effort limits, robot {robot.name!r} has none")
    if "known drives" in objective.needs:
        check_known(robot, objective.name)
    if "payload variable" in objective.needs and not with_payload:
        raise InvalidInputError(f"objectives: {objective.name} needs the payload's mass as a variable")


def unit_for(unit: str, robot: Robot) -> str:
    """The unit of an objective for a robot: ``"{joint}^2/s^5"`` -> ``"rad^2/s^5"``.

    Where some joints turn and others slide, each term of a sum over joints has the unit of its own joint, and the
    greatest of all joints that of one of them: ``"(rad or m)^2/s^5"``.

    Args:
        unit: SI unit, in which ``{joint}`` stands for the unit of the joints and ``{effort}`` for that of their effort.
        robot: the robot.
    """
    joint = position_unit(robot)
    effort = " or ".join({"rad": "N*m", "m": "N"}[one] for one in joint.split(" or "))
    powered = f"({effort})" if "*" in effort else effort
    joint, either = (f"({joint})", f"({effort})") if " or " in joint else (joint, effort)
    found = unit.replace("{joint}", joint).replace("{effort}^", f"{powered}^").replace("{effort}", either)
    return found[1:-1] if found in (joint, either) and found.startswith("(") else found
