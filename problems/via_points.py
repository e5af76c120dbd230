"""Any robot through points in joint space: interpolant, objectives and limits by name."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, ClassVar, final

import numpy as np

from problems.path_arguments import length_unit
from problems.puma_kinematics import TABLE_1_JOINTS
from trajevo.arrays import numbers
from trajevo.constraints import (
    Constraint,
    acceleration_limits,
    effort_limits,
    jerk_limits,
    overshoot_limit,
    position_limits,
    velocity_limits,
)
from trajevo.dynamics import Dynamics, Rollout
from trajevo.errors import InvalidInputError, checked_name
from trajevo.interpolants import THROUGH_POINTS
from trajevo.objectives import (
    Objective,
    integrated_square_acceleration,
    integrated_square_jerk,
    mechanical_energy,
    summed_rms_acceleration,
    summed_rms_jerk,
    total_time,
)
from trajevo.path import ViaPoints, read_columns
from trajevo.payload import Payload
from trajevo.problem import TrajectoryProblem
from trajevo.robot import Robot, load_robot

#: Name -> unit, with ``q`` for that of the joints, and function.
_OBJECTIVES: dict[str, tuple[str, Callable[[Rollout], Any]]] = {
    "time": ("s", total_time),
    "acceleration": ("q/s^2", summed_rms_acceleration),
    "jerk": ("q/s^3", summed_rms_jerk),
    "square_acceleration": ("q^2/s^3", integrated_square_acceleration),
    "square_jerk": ("q^2/s^5", integrated_square_jerk),
    "energy": ("J", mechanical_energy),
}

_CONSTRAINTS: dict[str, Callable[[Robot], Constraint]] = {
    "position": position_limits,
    "velocity": velocity_limits,
    "acceleration": acceleration_limits,
    "jerk": jerk_limits,
    "effort": effort_limits,
}


def objectives_of(names: Sequence[str], robot: Robot, *, reference: str) -> tuple[Objective, ...]:
    """Objectives by name.

    They are time, acceleration and jerk (Σ RMS), square_acceleration and square_jerk (∫ Σ), energy (∫ Σ |power|).
    """
    joint = robot.joint_units[0] if len(set(robot.joint_units)) == 1 else "SI"
    found = []
    for name in names:
        unit, function = _OBJECTIVES[checked_name("objective", name, _OBJECTIVES)]
        found.append(Objective(name, unit.replace("q", joint), reference, function))
    return tuple(found)


def constraints_of(
    names: Sequence[str], robot: Robot, points: ViaPoints, *, overshoot: float | None
) -> tuple[Constraint, ...]:
    """Limits by name (position, velocity, acceleration, jerk, effort), and how far joints may leave the points."""
    found = [_CONSTRAINTS[checked_name("constraint", name, _CONSTRAINTS)](robot) for name in names]
    if overshoot is None:
        return tuple(found)
    if isinstance(overshoot, bool) or not isinstance(overshoot, int | float) or not 0.0 < overshoot < np.inf:
        raise InvalidInputError(f"overshoot: expected a positive number [rad or m], got {overshoot!r}")
    return (*found, overshoot_limit(points, float(overshoot)))


@final
class ViaPointProblem(TrajectoryProblem):
    """Times between via points of any robot as variables, objectives and limits by name.

    Args:
        robot: name or folder of a robot.
        points: shape (K, n_joints) [rad or m], or a CSV file with a column for each joint, with its unit; Table 1 of
            Raji 2022 if None, for its robot alone.
        duration_bounds: least and greatest time between two points [s].
        interpolant: ``"quintic_spline"``, ``"septic_spline"``, ``"cubic"``, ``"polynomial"`` (a single one),
            ``"linear_blends"`` (points inside are passed nearby) or ``"hybrid"`` (Sun 2020).
        objectives: names, see :func:`objectives_of`.
        constraints: names, see :func:`constraints_of`.
        overshoot: how far a joint may leave the range of the points [rad or m]; not limited if None.
        payload: mass [kg], a :class:`~trajevo.payload.Payload`, or its settings.
        reference_point: far corner of the hypervolume's box, SI; taken from the first feasible points if None.
        samples: instants per segment at which effort is computed, both ends included.
        threads: threads of Pinocchio.

    Raises:
        UnknownNameError: no such robot, interpolant, objective or constraint.
        InvalidInputError: points that the robot cannot reach or the interpolant not use, or bad bounds.
    """

    registered_name: ClassVar[str] = "via-points"
    title: ClassVar[str] = "Any robot through via points"

    def __init__(
        self,
        *,
        robot: str | Path = "puma560",
        points: Any = None,
        duration_bounds: tuple[float, float] = (0.5, 6.0),
        interpolant: str = "quintic_spline",
        objectives: Sequence[str] = ("time", "jerk"),
        constraints: Sequence[str] = ("position", "velocity", "acceleration", "jerk"),
        overshoot: float | None = None,
        payload: float | Payload | dict[str, Any] = 0.0,
        reference_point: Sequence[float] | None = None,
        samples: int = 6,
        threads: int = 1,
    ) -> None:
        checked_name("interpolant", interpolant, THROUGH_POINTS)
        named = load_robot(robot)
        via = via_points(points, named)
        bounds = tuple(numbers(duration_bounds, name="duration_bounds", shape=(2,)).tolist())
        dynamics = Dynamics(named, Payload.of(payload, model=None), samples=samples, threads=threads)
        super().__init__(
            dynamics=dynamics,
            interpolant=THROUGH_POINTS[interpolant](via, duration_bounds=bounds),
            objectives=objectives_of(objectives, named, reference="by name"),
            constraints=constraints_of(constraints, named, via, overshoot=overshoot),
            reference_point=reference_point,
            length=length_unit(named),
        )
        self._settings = {
            "robot": str(robot),
            "points": via.positions.tolist(),
            "duration_bounds": list(bounds),
            "interpolant": interpolant,
            "objectives": list(objectives),
            "constraints": list(constraints),
            "overshoot": overshoot,
            "payload": dynamics.payload.settings,
            "reference_point": None if reference_point is None else list(reference_point),
            "samples": dynamics.samples,
            "threads": dynamics.threads,
        }

    @property
    def settings(self) -> dict[str, Any]:
        """Keyword arguments that make an equal problem."""
        return dict(self._settings)


def via_points(points: Any, robot: Robot) -> ViaPoints:
    """Points from an array, or from a CSV file with a column for each joint; for the PUMA 560 those of Raji 2022."""
    if points is None and robot.name == "puma560":
        points = TABLE_1_JOINTS
    if points is None:
        raise InvalidInputError(f"points: robot {robot.name!r} needs points to pass, shape (n_points, {robot.dof})")
    if isinstance(points, str | Path):
        points = read_columns(points, dict(zip(robot.joint_names, robot.joint_units, strict=True)))
    return ViaPoints.for_robot(robot, points)
