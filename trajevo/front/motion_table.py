"""The motion of a solution at samples, with headers that name joint, quantity and unit."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.units import display, per_time
from trajevo.errors import InvalidInputError
from trajevo.trajectory.batch import DERIVATIVES

if TYPE_CHECKING:
    from trajevo.front.front import Solution

#: Greatest number of samples of a table.
MOST_SAMPLES = 10_000_000


def motion_columns(solution: Solution, step: float, angle: str) -> tuple[list[str], Array]:
    """Headers with units, and the table, time first: (T, 1 + 5 n_joints) or, without masses, (T, 1 + 4 n_joints).

    Args:
        solution: the solution.
        step: time between samples [s]; the last interval takes 0.5 to 1.5 steps and ends with the motion.
        angle: ``"rad"`` or ``"deg"``.
    """
    rollout = solution.rollout
    robot = rollout.robot
    t = _instants(float(rollout.trajectory.duration[0]), step)
    derivatives = [rollout.trajectory.evaluate(t, order) for order in range(len(DERIVATIVES))]
    headers, columns = ["time [s]"], [t]
    for order, quantity in enumerate(DERIVATIVES):
        for joint, (name, unit) in enumerate(zip(robot.joint_names, robot.joint_units, strict=True)):
            shown, factor = display(per_time(unit, order), angle=angle)
            headers.append(f"{name} {quantity} [{shown}]")
            columns.append(derivatives[order][0, :, joint] * factor)
    if robot.gives_effort:
        effort = rollout.effort_in(derivatives[0], derivatives[1], derivatives[2], t)
        for joint, (name, unit) in enumerate(zip(robot.joint_names, robot.joint_units, strict=True)):
            headers.append(f"{name} effort [{'N*m' if unit == 'rad' else 'N'}]")
            columns.append(effort[0, :, joint])
    return headers, np.stack(columns, axis=1)


def checked_step(step: object) -> float:
    """A time between samples [s], if it is one.

    Raises:
        InvalidInputError: it is no positive number.
    """
    if isinstance(step, bool) or not (isinstance(step, int | float) and np.isfinite(step) and step > 0.0):
        raise InvalidInputError(f"step: expected a positive time [s], got {step!r}")
    return float(step)


def check_length(solution: Solution, step: float) -> None:
    """Refuse a step [s] that gives a table which is too long, by an InvalidInputError."""
    duration = float(solution.trajectory.duration[0])
    if duration / step > MOST_SAMPLES:
        raise InvalidInputError(f"step: {step:g} s gives over {MOST_SAMPLES} samples of a motion of {duration:.4g} s")


def _instants(duration: float, step: float) -> Array:
    inner = np.arange(0.0, duration, step)
    inner = inner[: 1 + int(np.searchsorted(inner[1:], duration - 0.5 * step, side="right"))]
    return np.append(inner, duration)
