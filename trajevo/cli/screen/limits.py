"""Printed output of the largest payload under all limits."""

from __future__ import annotations

import numpy as np
from rich.console import Console

from trajevo.capacity.accuracy.found import CAUSES
from trajevo.capacity.accuracy.full_capacity import full_capacity, tool_deviation
from trajevo.cli.screen.tables import Listing
from trajevo.dynamics.contacts.bending import known_stiffness
from trajevo.errors import InvalidInputError
from trajevo.front.front import Solution


def in_metres(deviation: float | None) -> float | None:
    """A greatest deviation that was given in millimetres, in metres, checked before anything is computed.

    Raises:
        InvalidInputError: none above 0, or of more than a metre.
    """
    if deviation is not None and not 0.0 < deviation <= 1e3:
        raise InvalidInputError(f"--deviation: expected a length above 0, up to 1000 mm, got {deviation:g}")
    return None if deviation is None else 1e-3 * deviation


def print_full_capacity(
    out: Console, solution: Solution, deviation: float | None, *, dwell: float, cycles: int | None
) -> None:
    """Print what a motion carries under all limits, if more is known of its robot than effort limits and drives.

    Args:
        out: console.
        solution: the motion.
        deviation: greatest deviation of the tool [m]; that of the problem, if it has one, if None.
        dwell: time at rest after each motion [s].
        cycles: how often the motion is made from cold windings on; for ever if None.
    """
    robot = solution.rollout.robot
    if robot.grip is None and robot.stand is None and not known_stiffness(robot) and deviation is None:
        return
    found = full_capacity(solution, deviation=deviation, dwell=dwell, cycles=cycles)
    out.print(f"under all limits: {found}")
    if known_stiffness(robot):
        out.print(f"the tool gives way by {tool_deviation(solution)}")
    table = Listing("limit", "payload [kg]", "by", "at [s]")
    for limit in sorted(found.limits, key=lambda one: one.mass):
        mass = "unlimited" if np.isinf(limit.mass) and limit.mass > 0.0 else f"{max(limit.mass, 0.0):.6g}"
        table.add(CAUSES[limit.cause], mass, limit.place, "" if np.isnan(limit.time) else f"{limit.time:.4f}")
    out.print(table)
