"""5-DOF hybrid manipulator: time, energy, jerk and acceleration under force limits (Guo et al. 2016).

Symbols are the paper's: h interval lengths [s], z₁ to z₄ objectives, w weights, ξ scales, U forces, m_p payload.
What can and cannot be reproduced: docs/papers/guo2016.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, ClassVar, final

import numpy as np

from trajevo.base.arrays import Array, numbers, read_only
from trajevo.base.plain import plain_data
from trajevo.dynamics.integrals.efforts import integrated_square_power
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError, checked_name
from trajevo.formulation.constraints.certified import held
from trajevo.formulation.constraints.constraint import Constraint
from trajevo.formulation.constraints.joint_limits import effort_limits, kinematic_limits
from trajevo.formulation.constraints.motion_limits import mean_velocity_limits
from trajevo.formulation.objectives import (
    UNUSED_PAYLOAD,
    Objective,
    integrated_square_acceleration,
    integrated_square_jerk,
    total_time,
)
from trajevo.formulation.payload_variable import PayloadVariable, greatest_at_rest
from trajevo.formulation.problem import TrajectoryProblem, Weights
from trajevo.formulation.search import Search
from trajevo.path.via_points import ViaPoints
from trajevo.robot.payload import Payload
from trajevo.robot.robot import Robot, load_robot
from trajevo.trajectory.interpolants import CubicSpline

from .hybrid_kinematics import inverse_kinematics, path_normals, via_positions

#: Weights w and scales ξ of eq. (112), section 3.1.
PAPER_WEIGHTS = Weights((0.3, 0.3, 0.2, 0.2), scales=(1.0, 1000.0, 10.0, 1.0))

#: Interval lengths of the solution in Table 7 [s].
TABLE_7_INTERVALS = (0.330, 0.837, 0.803, 0.569, 0.477, 0.382, 0.348, 0.348, 0.392, 0.552, 0.732, 0.420)

#: Payload bounds m_pl and m_pu of Table 1, eq. (123) [kg].
PAYLOAD_BOUNDS = (0.0, 10.0)

#: Least and greatest interval [s]. The paper prints only the lower bound (152); without an upper bound z₂ to z₄ would
#: fall towards 0 without end.
DURATION_BOUNDS = (0.005, 1.5)

#: Far corner of the hypervolume box for z₁ to z₄.
REFERENCE_POINT = (10.0, 1e4, 100.0, 5.0)

#: Convention -> the force model of its payload.
CONVENTIONS = {"continuous": "rigid", "printed": "weight_only", "as_run": "tool_axis"}


@final
class HybridManipulator(TrajectoryProblem):
    """Minimise z₁ to z₄, eqs. (113)-(116), of a cubic spline through the via points, under (118)-(123) and (152).

    The variables are the 12 interval lengths h [s]. Limits of displacement, velocity, acceleration and jerk hold at the
    exact peaks, those of force at the samples of every interval, or at every instant with ``limits="certified"``.

    Args:
        payload: mass [kg], a :class:`~trajevo.robot.payload.Payload`, or its settings.
        convention: ``"continuous"`` (the integrals themselves), ``"printed"`` (eq. (154) to the letter) or
            ``"as_run"`` (a conjecture of what the authors computed; never a reproduction).
        payload_model: how the payload acts (rigid, weight_only, tool_axis); if None, as ``payload`` says, or as in the
            convention if ``payload`` is only a mass.
        payload_bounds: least and greatest payload [kg], eq. (123).
        objectives: ``"all"`` four, ``"cost"`` (F_c of eq. (112) alone), or names: time, energy, jerk, acceleration, and
            unused_payload. The last one makes the payload's mass a variable, between its bounds and at most what the
            manipulator can hold at rest at both ends.
        positions: via points of the tool, shape (K, 3) [m]; the eleven of Table 6 if None. The tool axis is the path's
            normal in its vertical plane.
        duration_bounds: least and greatest interval [s].
        limits: how force limits are checked, ``"sampled"`` or ``"certified"``, see
            :mod:`trajevo.formulation.constraints.certified`.
        samples: instants per interval at which forces are computed, both ends included.
        threads: number of threads that evaluate populations; it does not affect the results.

    Raises:
        UnknownNameError: no such convention, payload model, set of objectives or limits.
        UnreachableError: a via point is out of reach; the message names it.
        InvalidInputError: a payload outside its bounds, or bad points, bounds or samples.
    """

    registered_name: ClassVar[str] = "hybrid"
    title: str = "5-DOF hybrid manipulator: time, energy, jerk, acceleration (Guo 2016)"
    evolution: Search = Search(
        population=100,
        generations=200,
        crossover_probability=0.9,
        crossover_index=10.0,
        mutation_probability=0.1,
        mutation_index=100.0,
    )
    paper_weights: ClassVar[Weights | None] = PAPER_WEIGHTS

    def __init__(
        self,
        *,
        payload: float | Payload | dict[str, Any] = 10.0,
        convention: str = "continuous",
        payload_model: str | None = None,
        payload_bounds: tuple[float, float] = PAYLOAD_BOUNDS,
        objectives: str | Sequence[str] = "all",
        positions: Any = None,
        duration_bounds: tuple[float, float] = DURATION_BOUNDS,
        limits: str = "sampled",
        samples: int = 6,
        threads: int = 1,
    ) -> None:
        checked_name("convention", convention, CONVENTIONS)
        if not isinstance(objectives, Sequence):
            raise InvalidInputError(f"objectives: expected 'all', 'cost' or a list of names, got {objectives!r}")
        self.convention, self.objective_set, self.limits = convention, objectives, limits
        carried = Payload.of(payload, model=payload_model, usual=CONVENTIONS[convention])
        self.payload_bounds = tuple(numbers(payload_bounds, name="payload_bounds", shape=(2,)).tolist())
        if not 0.0 <= self.payload_bounds[0] <= self.payload_bounds[1]:
            raise InvalidInputError(f"payload_bounds: expected 0 <= least <= greatest [kg], got {self.payload_bounds}")
        if not self.payload_bounds[0] <= carried.mass <= self.payload_bounds[1]:
            low, high = self.payload_bounds
            raise InvalidInputError(f"payload: expected {low:g} to {high:g} kg, eq. (123), got {carried.mass:g} kg")
        given = via_positions() if positions is None else numbers(positions, name="positions", shape=("K", 3))
        self.positions = read_only(given)
        self.duration_bounds = tuple(numbers(duration_bounds, name="duration_bounds", shape=(2,)).tolist())
        robot = load_robot("hybrid_manipulator")
        joints = inverse_kinematics(self.positions, path_normals(self.positions))
        spline = CubicSpline(ViaPoints.for_robot(robot, joints), duration_bounds=self.duration_bounds)
        dynamics = Dynamics(robot, carried, samples=samples, threads=threads)
        mass = self._payload_variable(dynamics, spline)
        chosen = self._chosen(mass)
        super().__init__(
            dynamics=dynamics if mass is None else mass.dynamics,
            interpolant=spline,
            objectives=chosen,
            constraints=held((*kinematic_limits(robot), effort_limits(robot), _interval_bound(robot)), limits),
            payload_range=None if mass is None else mass.range,
            reference_point=_reference_point(chosen, mass),
        )

    def _payload_variable(self, dynamics: Dynamics, spline: CubicSpline) -> PayloadVariable | None:
        """The payload's mass as a variable if it is an objective: between its bounds, at most what is held at rest."""
        if isinstance(self.objective_set, str) or UNUSED_PAYLOAD not in self.objective_set:
            return None
        low, high = self.payload_bounds
        return PayloadVariable.of(dynamics, spline, (low, min(high, greatest_at_rest(dynamics, spline))))

    def _chosen(self, mass: PayloadVariable | None) -> tuple[Objective, ...]:
        """The requested objectives."""
        at_hand = _objectives(self.convention)
        if isinstance(self.objective_set, str):
            checked_name("set of objectives", self.objective_set, ("all", "cost"))
            return at_hand if self.objective_set == "all" else (_cost(at_hand),)
        known = (*(objective.name for objective in at_hand), UNUSED_PAYLOAD)
        named = {objective.name: objective for objective in at_hand + (() if mass is None else (mass.objective,))}
        return tuple(named[checked_name("objective", name, known)] for name in self.objective_set)

    @property
    def settings(self) -> dict[str, Any]:
        """Keyword arguments that make an equal problem."""
        given = {
            "payload": self.dynamics.payload.settings,
            "convention": self.convention,
            "payload_bounds": list(self.payload_bounds),
            "objectives": self.objective_set if isinstance(self.objective_set, str) else list(self.objective_set),
            "positions": self.positions.tolist(),
            "duration_bounds": list(self.duration_bounds),
            "limits": self.limits,
            "samples": self.dynamics.samples,
            "threads": self.dynamics.threads,
        }
        settings: dict[str, Any] = plain_data("settings", given)
        return settings


def paper_solution() -> Array:
    """Interval lengths of Table 7, shape (1, 12) [s]."""
    return np.array([TABLE_7_INTERVALS])


def cost(F: Array) -> Array:
    """F_c of eq. (112) for objective values of shape (..., 4)."""
    total: Array = (F * (np.array(PAPER_WEIGHTS.weights) / np.array(PAPER_WEIGHTS.scales))).sum(axis=-1)
    return total


def _objectives(convention: str) -> tuple[Objective, ...]:
    energy = {"continuous": integrated_square_power, "printed": _printed_energy, "as_run": _as_run_energy}
    jerk = {"printed": _printed_jerk}
    acceleration = {"continuous": integrated_square_acceleration}
    squared = ("(rad or m)^2/s^5", "(rad or m)^2/s^3")  # each term in the unit of its own joint
    where = {"continuous": "(114)-(116)", "printed": "(154)", "as_run": "(154), conjectured variant"}[convention]
    return (
        Objective("time", "s", "Guo 2016, eq. (113), z1", total_time),
        Objective("energy", "W^2*s", f"Guo 2016, eq. {where}, z2", energy[convention]),
        Objective("jerk", squared[0], f"Guo 2016, eq. {where}, z3", jerk.get(convention, integrated_square_jerk)),
        Objective(
            "acceleration",
            squared[1],
            f"Guo 2016, eq. {where}, z4",
            acceleration.get(convention, _printed_acceleration),
        ),
    )


def _cost(objectives: tuple[Objective, ...]) -> Objective:
    return Objective("cost", "1", "Guo 2016, eq. (112), F_c", _Cost(objectives))


def _reference_point(objectives: tuple[Objective, ...], mass: PayloadVariable | None) -> tuple[float, ...] | None:
    """Reference point of the hypervolume for the chosen objectives; None for F_c."""
    corner = dict(zip(("time", "energy", "jerk", "acceleration"), REFERENCE_POINT, strict=True))
    if mass is not None:
        corner[UNUSED_PAYLOAD] = mass.range[1] - mass.range[0]
    names = [objective.name for objective in objectives]
    return tuple(corner[name] for name in names) if set(names) <= set(corner) else None


class _Cost:
    """F_c of a rollout; a class and not a closure, so that problems can be pickled."""

    def __init__(self, objectives: tuple[Objective, ...]) -> None:
        self.objectives = objectives

    def __call__(self, rollout: Rollout) -> Array:
        return cost(np.stack([objective.function(rollout) for objective in self.objectives], axis=1))


def _at_knots(rollout: Rollout, values: Array) -> tuple[Array, Array]:
    """Samples at the beginning and at the end of every interval, each (B, m - 1, 5)."""
    per_interval = values.reshape(len(values), -1, rollout.dynamics.samples, values.shape[-1])
    return per_interval[:, :, 0], per_interval[:, :, -1]


def _magnitude(values: Array) -> Array:
    """|values|, in a form that works with complex-step derivatives."""
    magnitude: Array = values * np.sign(values.real)
    return magnitude


def _square(values: Array) -> Array:
    """Σⱼ of squares over the last axis."""
    square: Array = np.einsum("...j,...j->...", values, values)
    return square


def _trapezoid(rollout: Rollout, first: Array, second: Array) -> Array:
    """Σ h/2 (first + second) for values at both ends of every interval, shapes (B, m - 1) -> (B,)."""
    total: Array = (0.5 * rollout.trajectory.segment_durations * (first + second)).sum(axis=1)
    return total


def _printed_energy(rollout: Rollout) -> Array:
    """z₂ of eq. (154): trapezoid at the knots of Σⱼ (U_j q̇_j)², shape (B,) [W²·s]."""
    return _trapezoid(rollout, *(_square(power) for power in _at_knots(rollout, rollout.power)))


def _as_run_energy(rollout: Rollout) -> Array:
    """Trapezoid at the knots of (Σⱼ |U_j q̇_j|)²: a conjecture, shape (B,) [W²·s]."""
    magnitudes = _magnitude(rollout.power)
    return _trapezoid(rollout, *(power.sum(axis=2) ** 2 for power in _at_knots(rollout, magnitudes)))


def _printed_jerk(rollout: Rollout) -> Array:
    """z₃ of eq. (154), shape (B,) [(rad or m)²/s⁵]; it averages neighbouring intervals and leaves out the last one."""
    square = _square(_at_knots(rollout, rollout.j)[0])
    total: Array = (0.5 * rollout.trajectory.segment_durations[:, :-1] * (square[:, :-1] + square[:, 1:])).sum(axis=1)
    return total


def _printed_acceleration(rollout: Rollout) -> Array:
    """z₄ of eq. (154): trapezoid at the knots of Σⱼ a_j², shape (B,) [(rad or m)²/s³]."""
    return _trapezoid(rollout, *(_square(a) for a in _at_knots(rollout, rollout.a)))


def _interval_bound(robot: Robot) -> Constraint:
    """Eq. (152): no interval may be so short that a joint's mean velocity exceeds its limit."""
    return replace(mean_velocity_limits(robot), names=("interval above eq. (152)",))
