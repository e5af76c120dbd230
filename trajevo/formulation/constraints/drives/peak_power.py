"""A limit of the power that all motors take together from their supply."""

from __future__ import annotations

from functools import partial

from trajevo.base.arrays import Array
from trajevo.dynamics.drives.power import greatest_supply_power
from trajevo.dynamics.rollout import Rollout
from trajevo.formulation.constraints.constraint import Constraint, Limited, LimitKind, LimitParameter


def peak_power_limit(limited: Limited, peak_power: float) -> Constraint:
    """Greatest power that all motors take together over a limit [W], minus 1.

    It is mechanical power before the gears, and what the windings turn into heat where drives tell it. What motors give
    back serves the others. It is looked at at 33 instants of every smooth part of a segment; nothing proves it.

    Raises:
        InvalidInputError: the robot gives no efforts.
    """
    limited.robot.check_masses("a limit of peak power")
    return Constraint(
        ("peak power",),
        f"a supply of {peak_power:g} W",
        partial(_excess, most=peak_power),
        quantity="peak power",
        limit=peak_power,
        unit="W",
    )


def _excess(rollout: Rollout, *, most: float) -> Array:
    excess: Array = greatest_supply_power(rollout)[:, None] / most - 1.0
    return excess


PEAK_POWER = LimitKind(
    "peak_power",
    "power that all motors take together from a shared supply; not proven between samples",
    peak_power_limit,
    (LimitParameter("peak_power", "W", "greatest power that all motors take together"),),
)
