"""The payload's mass as a decision variable, and the greatest mass minus this mass as an objective."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np

from trajevo.base.arrays import numbers
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.payload_masses import masses_held
from trajevo.errors import InvalidInputError
from trajevo.formulation.objectives import OBJECTIVES, UNUSED_PAYLOAD, Objective, unused_payload
from trajevo.trajectory.interpolants import Interpolant


@final
@dataclass(frozen=True)
class PayloadVariable:
    """The payload's mass as the last variable of a problem.

    Attributes:
        dynamics: dynamics of the robot with a payload of the right shape and model; the payload's mass is not used.
        range: least and greatest mass [kg].
        objective: the greatest mass minus the mass [kg]; minimising it maximises the payload.
    """

    dynamics: Dynamics
    range: tuple[float, float]
    objective: Objective

    @classmethod
    def of(cls, dynamics: Dynamics, interpolant: Interpolant, payload_range: Any = None) -> PayloadVariable:
        """The payload variable of a robot that moves with an interpolant.

        Args:
            dynamics: dynamics of the robot; its payload gives shape and model.
            interpolant: interpolant of the motions.
            payload_range: least and greatest mass [kg]; if None, from 0 to the greatest mass that the robot can hold at
                rest at the first and the last point. No motion that rests there can carry more.

        Raises:
            InvalidInputError: a range that is not 0 <= least < greatest, or no range although nothing limits the mass
                at rest.
        """
        shape = dynamics.payload
        unit = shape if shape.mass > 0.0 else shape.with_mass(1.0)
        carrying = replace(dynamics, payload=unit)
        if payload_range is None:
            payload_range = (0.0, _bounded_at_rest(carrying, interpolant))
        low, high = numbers(payload_range, name="payload_range", shape=(2,)).tolist()
        if not 0.0 <= low < high:
            raise InvalidInputError(f"payload_range: expected 0 <= least < greatest [kg], got {low} and {high}")
        objective = replace(
            OBJECTIVES[UNUSED_PAYLOAD], reference=f"{high:g} kg minus mass", function=unused_payload(high)
        )
        return cls(carrying, (low, high), objective)


def _bounded_at_rest(dynamics: Dynamics, interpolant: Interpolant) -> float:
    """The greatest payload [kg] held at rest at both ends; an error if there is none or it is unbounded."""
    greatest, name = greatest_at_rest(dynamics, interpolant), dynamics.robot.name
    if np.isinf(greatest):
        why = f"no effort limit bounds what {name!r} can hold" if greatest > 0.0 else f"{name!r} cannot hold itself"
        raise InvalidInputError(f"payload_range: expected least and greatest mass [kg], since {why} at both ends")
    return greatest


def greatest_at_rest(dynamics: Dynamics, interpolant: Interpolant) -> float:
    """The greatest payload [kg] that effort limits allow at rest at the first and the last point of the motions."""
    middle = [0.5 * (variable.lower + variable.upper) for variable in interpolant.variables]
    trajectory = interpolant(np.array([middle]))
    return masses_held(dynamics, trajectory.evaluate(np.array([0.0, trajectory.duration[0]]))[0])[1]
