"""A limit of how far the tool gives way because the joints do, at the samples of a rollout."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.contacts.bending import COUNTED, Bending
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import checked_name
from trajevo.formulation.constraints.constraint import Constraint, LimitKind, LimitParameter, positive
from trajevo.robot.robot import Robot

#: Names of the limited quantity, by what counts.
QUANTITIES = {"all": "tool deviation", "payload": "tool deviation by the payload"}


def deviation_limit(robot: Robot, most: float, counted: str = "all") -> Constraint:
    """Greatest deviation of the tool's origin at the samples over the greatest allowed [m], minus 1.

    Each joint gives way by what it bears over its stiffness, see :mod:`trajevo.dynamics.contacts.bending`; between
    samples the deviation may be a little greater.

    Args:
        robot: the robot, of which at least one drive has a stiffness.
        most: greatest deviation [m].
        counted: ``"all"`` for that by all loads, ``"payload"`` for that by the payload alone.

    Raises:
        InvalidInputError: not a positive number, or no stiffness.
        UnknownNameError: another word for ``counted``.
    """
    robot.check_masses("a limit of deviation")
    most = positive("deviation", most, "m")
    checked_name("deviation_of", counted, COUNTED)
    shares = partial(_shares, bending=Bending.of(robot), most=most, counted=counted)
    by = " by the payload" if counted == "payload" else ""
    return Constraint(
        (f"deviation of the tool{by}",),
        f"deviation of the tool{by} of at most {1e3 * most:g} mm",
        partial(_excess, shares=shares),
        terms=shares,
        quantity=QUANTITIES[counted],
        limit=most,
        unit="m",
    )


def _shares(rollout: Rollout, *, bending: Bending, most: float, counted: str) -> Array:
    """Deviation over the greatest allowed at the samples, minus 1, shape (B, T)."""
    if counted == "payload":
        mass = rollout.dynamics.payload.mass if rollout.masses is None else rollout.masses[:, None, None]
        load = mass * rollout.effort_per_kilogram
    else:
        load = rollout.effort - rollout.robot.friction.armature * rollout.a
    moved = bending.by_joint(rollout.q, load).sum(axis=-1)
    share: Array = np.sqrt((moved * moved).sum(axis=-1)) / most - 1.0  # without abs, which would drop complex steps
    return share


def _excess(rollout: Rollout, *, shares: Any) -> Array:
    excess: Array = shares(rollout).max(axis=1, keepdims=True)
    return excess


def _counted(name: str, value: Any, unit: str) -> str:
    return checked_name(name, value, COUNTED)


DEVIATION = LimitKind(
    "deviation",
    "how far the tool gives way because joints do, at the samples; needs the stiffness of drives",
    lambda limited, deviation, deviation_of: deviation_limit(limited.robot, deviation, deviation_of),
    (
        LimitParameter("deviation", "m", "greatest deviation of the tool by what its joints bear"),
        LimitParameter(
            "deviation_of", "", "all loads, or the payload alone: all or payload", _counted, default="all", type=str
        ),
    ),
)
