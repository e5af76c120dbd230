"""Time and jerk along a fixed path (Paing, Nshama, Uchiyama 2021, IEEE Access, 10.1109/ACCESS.2021.3095847).

Symbols are the paper's: s(u) path, u(t) its parameter in time, c control points of u(t), t_f total time, F₁ and F₂
objectives. What can be reproduced, and the errata: docs/time_jerk_reparameterisation.md.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar, final

import numpy as np

from problems.example_paths import EXAMPLE_PATHS
from problems.path_arguments import at_rest, longest_of, path_of, with_limits
from trajevo.arrays import Array
from trajevo.constraints import (
    Constraint,
    acceleration_limits,
    effort_limits,
    hull_limits,
    jerk_limits,
    smooth_path_limits,
    time_limit,
    velocity_limits,
)
from trajevo.dynamics import Dynamics, Rollout
from trajevo.errors import InvalidInputError, checked_name
from trajevo.interpolants import LinearReparameterisation, Reparameterisation
from trajevo.objectives import Objective, integrated_square_jerk, times_duration, total_time, trapezoid_square_jerk
from trajevo.payload import Payload
from trajevo.problem import Evolution, Expansion, SmoothForm, TrajectoryProblem
from trajevo.robot import Robot, load_robot
from trajevo.sqp import Search

#: Partitions N of the trapezoidal rule (29), section VI.B.
PARTITIONS = 1000

QUADRATURES: dict[str, Callable[[Rollout], Array]] = {
    "gauss": integrated_square_jerk,
    "trapezoid": trapezoid_square_jerk(PARTITIONS),
}

#: F₂ falls with this power of t_f while u(t / t_f) stays.
POWER = 5

#: Points of the front that a set of shapes stands for, besides the least time of each.
ENVELOPE_POINTS = 200

#: The hypervolume's box ends at the longest time and at this many times the F₂ of evenly rising control points.
REFERENCE_JERK = 10.0


@final
class TimeJerkReparameterisation(TrajectoryProblem):
    """F₁ = t_f and F₂ = ∫ ‖jerk‖² dt of (27) along a path whose shape does not move, under (28).

    Variables are the rises of u(t) between its control points, of which only the ratios count, and the slowness: 0 for
    the least time that the limits allow this u(t), 1 for the longest time. So every individual keeps its kinematic
    limits by construction. With ``encoding="shape"`` there is no slowness: as F₂ falls with t_f⁻⁵, every u(t) is a
    whole curve of the front; the objectives are then the least time and t_f⁵ F₂, and the front is the lower envelope.

    Attributes:
        path: the path, a :class:`~trajevo.curve.GeometricPath`.
        longest_time: t_max [s].

    Args:
        path: ``"gemini"`` or ``"s"``, which come with the paper's limits; points (K, n_axes) [m or rad] to run through,
            or a CSV file of them with units in its header; a :class:`~trajevo.curve.GeometricPath`; or its settings.
        path_control_points: run near the points of an array or a file, with as many control points, not through them.
        robot: name or folder of the robot whose joints are the axes; the biaxial feed drive for two axes if None.
        limits: ``"tight"`` (guaranteed bounds of the true peaks) or ``"hull"`` (the paper's (20)-(25)).
        velocity: limit of every axis, or of each [m/s or rad/s], or text such as ``"150 mm/s"``; if None that of the
            named path or of the robot that is named.
        acceleration: the same [m/s² or rad/s²].
        jerk: the same [m/s³ or rad/s³].
        longest_time: t_max [s]; if None that of the named path.
        encoding: ``"plain"`` or ``"shape"``.
        interpolant: ``"bspline"``, or ``"linear"``: the paper's baseline u = t / t_f on a path laid anew through the
            same positions, at rest at both ends.
        quadrature: of F₂: ``"gauss"`` (exact) or ``"trapezoid"`` (the paper's (29)).
        control_points: of u(t).
        order: of u(t).
        tolerance: share by which a tight bound may exceed the true peak.
        effort: limit the joints' torques or forces too, at the samples.
        payload: carried at the tool, mass [kg], a :class:`~trajevo.payload.Payload`, or its settings.
        samples: instants per segment at which effort is computed.
        threads: threads of Pinocchio.

    Raises:
        UnknownNameError: no such path, robot, limits, encoding, interpolant or quadrature.
        InvalidInputError: points, limits or times that cannot be used; the message names them, and for a longest time
            that is too short the time that is needed.
    """

    registered_name: ClassVar[str] = "reparam"
    title: ClassVar[str] = "Time and jerk along a fixed path (Paing 2021)"
    evolution: ClassVar[Evolution] = Evolution(100, 100, 0.9, 15.0, 1.0 / 12.0, 20.0)

    def __init__(
        self,
        *,
        path: Any = "gemini",
        path_control_points: int | None = None,
        robot: str | Path | None = None,
        limits: str = "tight",
        velocity: Any = None,
        acceleration: Any = None,
        jerk: Any = None,
        longest_time: Any = None,
        encoding: str = "plain",
        interpolant: str = "bspline",
        quadrature: str = "gauss",
        control_points: int = 16,
        order: int = 6,
        tolerance: float = 1e-6,
        effort: bool = False,
        payload: float | Payload | dict[str, Any] = 0.0,
        samples: int = 6,
        threads: int = 1,
    ) -> None:
        checked_name("encoding", encoding, ("plain", "shape"))
        checked_name("interpolant", interpolant, ("bspline", "linear"))
        checked_name("quadrature", quadrature, QUADRATURES)
        if encoding == "shape" and interpolant == "linear":
            raise InvalidInputError("encoding: 'shape' needs the interpolant 'bspline'; u = t / t_f has one shape")
        example = EXAMPLE_PATHS.get(path) if isinstance(path, str) else None
        axes = load_robot("feed_drive" if robot is None else robot)
        length = "mm" if set(axes.joint_units) == {"m"} else "m"
        self.path = path_of(path, path_control_points, axes)
        asked = {"velocity": velocity, "acceleration": acceleration, "jerk": jerk}
        axes = with_limits(axes, example, asked, own=robot is not None, length=length)
        self.longest_time = longest_of(longest_time, example)
        carried = Payload.of(payload, model=None)
        self._settings: dict[str, Any] = {
            "path": path if example else self.path.settings,
            "robot": None if robot is None else str(robot),
            "limits": limits,
            **{name: _plain(getattr(axes.limits, name)) for name in asked},
            "longest_time": self.longest_time,
            "encoding": encoding,
            "interpolant": interpolant,
            "quadrature": quadrature,
            "control_points": control_points,
            "order": order,
            "tolerance": tolerance,
            "effort": bool(effort),
            "payload": carried.settings,
            "samples": samples,
            "threads": threads,
        }
        runs = Reparameterisation(
            self.path,
            axes.limits,
            longest_time=self.longest_time,
            bound=limits,
            timing="least" if encoding == "shape" else "share",
            control_points=control_points,
            order=order,
            tolerance=tolerance,
        )
        dynamics = Dynamics(axes, carried, samples=samples, threads=threads)
        extra = (effort_limits(axes),) if effort else ()
        objectives = _objectives(QUADRATURES[quadrature], axes, encoding)
        straight = interpolant == "linear"
        super().__init__(
            dynamics=dynamics,
            interpolant=LinearReparameterisation(at_rest(self.path), axes.limits, longest_time=self.longest_time)
            if straight
            else runs,
            objectives=objectives,
            constraints=(*_limits(axes, "tight" if straight else limits), time_limit(self.longest_time), *extra),
            reference_point=_reference(runs) if encoding == "plain" else None,
            length=length,
        )
        if straight:
            _refuse_too_short(self.longest_time, float(self.decode(np.zeros((1, 1))).duration[0]))
            return
        form = _smooth_form(runs, dynamics, _objectives(QUADRATURES[quadrature], axes, "plain"), extra)
        _refuse_too_short(self.longest_time, _least_time(runs, form.problem))
        if encoding == "plain":
            self.smooth = form
        else:
            plain = type(self)(**(self._settings | {"encoding": "plain"}))
            self.expansion = Expansion(plain, self._envelope, _rises)

    @property
    def settings(self) -> dict[str, Any]:
        """Keyword arguments that make an equal problem."""
        return dict(self._settings)

    def _envelope(self, X: Array, F: Array) -> tuple[Array, Array]:
        """Lower envelope of the curves t_f⁵ F₂ = constant, t_f ≥ least time, of shapes that do not dominate each other.

        Args:
            X: rises (N, n_rises) of non-dominated shapes.
            F: their least times [s] and t_f⁵ F₂.

        Returns:
            Decision vectors and objectives of the plain problem.
        """
        order = np.argsort(F[:, 0])
        least, constant = F[order].T
        between = np.geomspace(least[0], self.longest_time, ENVELOPE_POINTS)
        times = np.unique(np.concatenate([least[least <= self.longest_time], between[1:]]))
        shape = np.searchsorted(least, times, side="right") - 1
        room = self.longest_time - least[shape]
        slowness = 1.0 - np.divide(self.longest_time - times, room, out=np.ones_like(room), where=room > 0.0)
        jerk = constant[shape] / times**POWER
        return np.column_stack([X[order][shape], np.clip(slowness, 0.0, 1.0)]), np.column_stack([times, jerk])


def paper_shape(control_points: Array) -> Array:
    """Rises of the free control points c₃ to c₁₂ of a u(t), (B, 10) -> (B, 11)."""
    rows = np.atleast_2d(control_points)
    edge = np.ones((len(rows), 1))
    rises: Array = np.diff(np.concatenate([0.0 * edge, rows, edge], axis=1), axis=1)
    return rises


def _objectives(jerk: Callable[[Rollout], Array], axes: Robot, encoding: str) -> tuple[Objective, ...]:
    unit = axes.joint_units[0] if len(set(axes.joint_units)) == 1 else "SI"
    time = Objective("time", "s", "Paing 2021, eq. (27), F1", total_time)
    if encoding == "plain":
        return time, Objective("jerk", f"{unit}^2/s^5", "Paing 2021, eq. (27), F2", jerk)
    constant = times_duration(jerk, POWER)
    return time, Objective("jerk_constant", f"{unit}^2", "Paing 2021, eq. (27), F2 times F1^5", constant)


def _limits(axes: Robot, kind: str) -> tuple[Constraint, ...]:
    return (
        hull_limits(axes) if kind == "hull" else (velocity_limits(axes), acceleration_limits(axes), jerk_limits(axes))
    )


def _smooth_form(
    runs: Reparameterisation, dynamics: Dynamics, objectives: tuple[Objective, ...], extra: tuple[Constraint, ...]
) -> SmoothForm:
    """The problem with t_f itself as variable and every term of the limits as a constraint of its own, eq. (28)."""
    plain = replace(runs, timing="share")
    problem = TrajectoryProblem(
        dynamics=dynamics,
        interpolant=replace(runs, timing="seconds"),
        objectives=objectives,
        constraints=(*smooth_path_limits(dynamics.robot, runs.bound, runs.even_course), *extra),
    )
    return SmoothForm(problem, plain.with_seconds, plain.from_seconds)


def _least_time(runs: Reparameterisation, smooth: TrajectoryProblem) -> float:
    """A time in which the path can be run [s]: the least one, where evenly rising control points are too slow."""
    even = float(runs.least_durations(runs.even_course)[0])
    if even <= runs.longest_time:
        return even
    wider = TrajectoryProblem(
        dynamics=smooth.dynamics,
        interpolant=replace(runs, timing="seconds", longest_time=2.0 * even),
        objectives=smooth.objectives,
        constraints=smooth.constraints,
    )
    start = np.append(np.ones(runs.n_rises), even)
    found = Search(wider, np.array([1.0, 0.0])).run(start, 1e-9)
    course = replace(runs, timing="seconds")(found[None]).course
    return float(runs.least_durations(course)[0])


def _refuse_too_short(longest: float, needed: float) -> None:
    if needed > longest:
        raise InvalidInputError(
            f"longest_time: the path needs {needed:.6g} s under the limits of its axes, got {longest:.6g} s"
        )


def _reference(runs: Reparameterisation) -> tuple[float, float]:
    """Far corner of the hypervolume's box."""
    even = replace(runs, timing="least")(np.ones((1, runs.n_rises)))
    return runs.longest_time, REFERENCE_JERK * float(even.integral_of_square(3).sum())


def _rises(X: Array) -> Array:
    """Decision vectors of the plain encoding -> of the shapes."""
    return X[:, :-1]


def _plain(limit: Array) -> list[float | str]:
    """A limit as plain data: JSON has no infinity."""
    return [value if np.isfinite(value) else "inf" for value in limit.tolist()]
