"""Objectives and limits by name, for problems that are put together from data; other packages may add objectives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib.metadata import entry_points
from typing import Any

from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError, checked_name
from trajevo.formulation.constraints.constraint import Constraint
from trajevo.formulation.constraints.joint_limits import (
    acceleration_limits,
    effort_limits,
    jerk_limits,
    mean_velocity_limits,
    position_limits,
    velocity_limits,
)
from trajevo.formulation.objectives import (
    Objective,
    effort_ratio,
    integrated_square_acceleration,
    integrated_square_effort,
    integrated_square_effort_rate,
    integrated_square_jerk,
    integrated_square_power,
    joint_travel,
    mechanical_energy,
    summed_rms_acceleration,
    summed_rms_jerk,
    tool_path_length,
    total_time,
)
from trajevo.formulation.payload_variable import UNUSED_PAYLOAD, PayloadVariable
from trajevo.robot.robot import Robot

#: Entry-point group in which other packages register an :class:`~trajevo.formulation.objectives.Objective`.
OBJECTIVE_GROUP = "trajevo.objectives"

#: Name -> unit, with ``q`` for that of the joints and ``e`` for that of their effort, and function.
OBJECTIVES: dict[str, tuple[str, Callable[[Rollout], Any]]] = {
    "time": ("s", total_time),
    "acceleration": ("q/s^2", summed_rms_acceleration),
    "jerk": ("q/s^3", summed_rms_jerk),
    "square_acceleration": ("q^2/s^3", integrated_square_acceleration),
    "square_jerk": ("q^2/s^5", integrated_square_jerk),
    "energy": ("J", mechanical_energy),
    "square_power": ("W^2*s", integrated_square_power),
    "square_effort": ("e^2*s", integrated_square_effort),
    "square_effort_rate": ("e^2/s", integrated_square_effort_rate),
    "effort_ratio": ("1", effort_ratio),
    "joint_travel": ("q", joint_travel),
    "tool_path": ("m", tool_path_length),
}

#: Limits of the robot's joints.
LIMITS: dict[str, Callable[[Robot], Constraint]] = {
    "position": position_limits,
    "velocity": velocity_limits,
    "acceleration": acceleration_limits,
    "jerk": jerk_limits,
    "effort": effort_limits,
    "mean_velocity": mean_velocity_limits,
}


def objective_names() -> list[str]:
    """Names of all objectives at hand, those of other packages last."""
    return [
        *OBJECTIVES,
        UNUSED_PAYLOAD,
        *(point.name for point in sorted(entry_points(group=OBJECTIVE_GROUP), key=lambda p: p.name)),
    ]


def objectives_of(
    names: Sequence[str], robot: Robot, *, reference: str, payload: PayloadVariable | None = None
) -> tuple[Objective, ...]:
    """Objectives by name.

    They are time, acceleration and jerk (Σ RMS), square_acceleration and square_jerk (∫ Σ), energy (∫ Σ |power|),
    square_power, square_effort and square_effort_rate (∫ Σ), effort_ratio (the greatest share of an effort limit),
    joint_travel (Σ ∫ |v|), tool_path (∫ |tool velocity|), unused_payload (the greatest payload minus that of the
    solution, where the payload's mass is a variable), and those that packages register in the entry-point group
    ``trajevo.objectives``.

    Args:
        names: of the objectives.
        robot: whose units count.
        reference: what the objectives say of where they come from.
        payload: the variable that unused_payload belongs to, where there is one.

    Raises:
        UnknownNameError: no such objective.
        InvalidInputError: the names are no list, a registered objective is none, effort_ratio of a robot without
            effort limits, or unused_payload where the payload's mass is no variable.
    """
    if isinstance(names, str) or not isinstance(names, Sequence):
        raise InvalidInputError(f"objectives: expected a list of names, got {names!r}")
    return tuple(_unused(payload) if name == UNUSED_PAYLOAD else _objective(name, robot, reference) for name in names)


def limits_of(names: Sequence[str], robot: Robot) -> tuple[Constraint, ...]:
    """Limits of the joints by name: position, velocity, acceleration, jerk, effort, mean_velocity.

    Raises:
        UnknownNameError: no such limit.
        InvalidInputError: the names are no list.
    """
    if isinstance(names, str) or not isinstance(names, Sequence):
        raise InvalidInputError(f"constraints: expected a list of names, got {names!r}")
    return tuple(LIMITS[checked_name("constraint", name, LIMITS)](robot) for name in names)


def _objective(name: str, robot: Robot, reference: str) -> Objective:
    checked_name("objective", name, objective_names())
    if name not in OBJECTIVES:
        return _registered(name)
    unit, function = OBJECTIVES[name]
    if name == "effort_ratio" and not (robot.limits.effort < float("inf")).any():
        raise InvalidInputError(f"objectives: effort_ratio needs effort limits, robot {robot.name!r} has none")
    joint = robot.joint_units[0] if len(set(robot.joint_units)) == 1 else "SI"
    effort = {"rad": "N*m", "m": "N", "SI": "SI"}[joint]
    powered = f"({effort})" if "*" in effort else effort
    shown = unit.replace("e^", f"{powered}^") if unit.startswith("e") else unit.replace("q", joint)
    return Objective(name, shown, reference, function)


def _unused(payload: PayloadVariable | None) -> Objective:
    if payload is None:
        raise InvalidInputError(f"objectives: {UNUSED_PAYLOAD} needs the payload's mass as a variable")
    return payload.objective


def _registered(name: str) -> Objective:
    point = next(point for point in entry_points(group=OBJECTIVE_GROUP) if point.name == name)
    try:
        found = point.load()
    except (ImportError, AttributeError) as error:
        raise InvalidInputError(f"objective {name!r}: {point.value} cannot be imported: {error}") from error
    if not isinstance(found, Objective):
        raise InvalidInputError(f"objective {name!r}: {point.value} is no trajevo.formulation.objectives.Objective")
    return found
