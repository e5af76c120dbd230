"""A limit of how fast efforts change, which is how fast motors' currents must change."""

from __future__ import annotations

from functools import partial

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.integrals.efforts import greatest_effort_rates
from trajevo.dynamics.rollout import Rollout
from trajevo.formulation.constraints.constraint import Constraint, Limited, LimitKind, LimitParameter


def effort_rate_limit(limited: Limited, effort_rate: float) -> Constraint:
    """Greatest |d effort / dt| of every joint over the limit [N·m/s or N/s], minus 1.

    It comes from polynomials through the efforts at nodes, which is exact to 1e-4 but no proof. Steps do not count:
    those between segments, and those of dry friction where a joint turns.

    Raises:
        InvalidInputError: the robot gives no efforts.
    """
    robot = limited.robot
    robot.check_masses("a limit of the effort rate")
    names = tuple(f"effort rate of {name}" for name in robot.joint_names)
    function = partial(_excess, most=effort_rate)
    return Constraint(names, f"effort rate of at most {effort_rate:g}", function, quantity="effort rate", unit="1")


def _excess(rollout: Rollout, *, most: float) -> Array:
    excess: Array = np.asarray(greatest_effort_rates(rollout)) / most - 1.0
    return excess


EFFORT_RATE = LimitKind(
    "effort_rate",
    "how fast the efforts change, steps of friction left out; not proven between samples",
    effort_rate_limit,
    (LimitParameter("effort_rate", "N*m/s or N/s", "greatest d effort / dt of any joint"),),
)
