"""Time and jerk along a fixed path (Paing, Nshama, Uchiyama 2021, IEEE Access, 10.1109/ACCESS.2021.3095847).

Symbols are the paper's: s(u) path, u(t) its parameter in time, c control points of u(t), t_f total time, F₁ and F₂
objectives. What can be reproduced, and the errata: docs/papers/paing2021.md.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.plain import plain_data
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError, checked_name
from trajevo.formulation.constraints.certified import held
from trajevo.formulation.constraints.constraint import Constraint
from trajevo.formulation.constraints.joint_limits import (
    acceleration_limits,
    effort_limits,
    jerk_limits,
    velocity_limits,
)
from trajevo.formulation.constraints.motion_limits import time_limit
from trajevo.formulation.constraints.path_limits import hull_limits
from trajevo.formulation.objectives import (
    Objective,
    integrated_square_jerk,
    times_duration,
    total_time,
    trapezoid_square_jerk,
    unit_for,
)
from trajevo.formulation.problem import Expansion, TrajectoryProblem
from trajevo.formulation.search import Search
from trajevo.path.curve import GeometricPath
from trajevo.robot.joints import length_unit
from trajevo.robot.payload import Payload
from trajevo.robot.robot import Robot
from trajevo.solvers.gradient.weighted_sum import WeightedOptimum
from trajevo.trajectory.interpolants import LinearReparameterisation, Reparameterisation
from trajevo.trajectory.interpolants.reparameterised import BOUNDS

from .gemini_and_s import EXAMPLE_PATHS
from .path_forms import POWER, envelope, least_time, rises, smooth_form
from .path_optimum import MANY, PathOptimum, known_motions, least_time_of
from .path_settings import at_rest, prepared

#: Partitions N of the trapezoidal rule (29), section VI.B.
PARTITIONS = 1000

QUADRATURES: dict[str, Callable[[Rollout], Array]] = {
    "gauss": integrated_square_jerk,
    "trapezoid": trapezoid_square_jerk(PARTITIONS),
}

#: Generations unless others are given where a search begins with a front by convex programs: they add next to nothing.
GENERATIONS_OF_MANY = 2

#: The hypervolume's box ends at the longest time and at this many times the F₂ of evenly rising control points.
REFERENCE_JERK = 10.0


@final
class TimeJerkReparameterisation(TrajectoryProblem):
    """Minimise F₁ = t_f and F₂ = ∫ ‖jerk‖² dt of eq. (27) along a fixed path, under eq. (28).

    The variables are the rises of u(t) between its control points, of which only the ratios matter, and the slowness: 0
    for the least time in which this u(t) keeps the limits, 1 for the longest time. So every individual keeps its
    kinematic limits by construction. With ``encoding="shape"`` there is no slowness: since F₂ is proportional to t_f⁻⁵,
    every u(t) stands for a whole curve of trade-offs. The objectives are then the least time and t_f⁵ F₂, and the front
    is the lower envelope of the curves.

    Attributes:
        path: the path, a :class:`~trajevo.path.curve.GeometricPath`.
        longest_time: t_max [s].

    Args:
        path: ``"gemini"`` or ``"s"``, which come with the paper's limits; points (K, n_axes) [m or rad] to run through,
            or a CSV file of them with units in its header; a :class:`~trajevo.path.curve.GeometricPath`; or its
            settings.
        path_control_points: number of control points of a path near the points of an array or a file; if None, the path
            runs through them.
        robot: the robot whose joints are the axes: name, folder or URDF, a :class:`~trajevo.robot.robot.Robot`, or the
            arguments of :func:`~trajevo.robot.robot.load_robot` as a mapping; the biaxial feed drive for two axes if
            None.
        limits: ``"tight"`` (guaranteed bounds of the true peaks), ``"hull"`` (the paper's (20)-(25)), or
            ``"certified"`` (the tight bounds, which are already proofs, and effort limits at every instant).
        velocity: limit of all axes, or one for each axis [m/s or rad/s], or text such as ``"150 mm/s"``; if None, that
            of the named path or robot.
        acceleration: the same [m/s² or rad/s²].
        jerk: the same [m/s³ or rad/s³].
        longest_time: t_max [s]; if None, that of the named path.
        encoding: ``"plain"`` or ``"shape"``.
        interpolant: ``"bspline"``, or ``"linear"``: the paper's baseline u = t / t_f on a new path through the same
            positions that is at rest at both ends.
        quadrature: quadrature of F₂, ``"gauss"`` (exact) or ``"trapezoid"`` (the paper's (29)).
        control_points: number of control points of u(t). With more than 40, a search begins with the fastest motion and
            those of the least jerk in longer times, found by convex programs, and takes 2 generations without polish
            unless told otherwise; not with ``limits="hull"``. Where effort is limited, half of the first population
            is found in this way, whatever their number. A limit of CPU time of the search limits the programs too.
        order: order of u(t).
        tolerance: share by which a tight bound may exceed the true peak.
        effort: also limit the joints' torques or forces, at the samples or certified; not with ``encoding="shape"``.
        payload: payload at the tool: mass [kg], a :class:`~trajevo.robot.payload.Payload`, or its settings.
        samples: instants per segment at which effort is computed.
        threads: number of threads that evaluate populations; it does not affect the results.

    Raises:
        UnknownNameError: no such path, robot, limits, encoding, interpolant or quadrature.
        InvalidInputError: invalid points, limits or times; the message names them and, if the longest time is too
            short, the time that is needed.
    """

    registered_name: ClassVar[str] = "reparam"
    title: str = "Time and jerk along a fixed path (Paing 2021)"
    evolution: Search = Search(
        population=100,
        generations=100,
        crossover_probability=0.9,
        crossover_index=15.0,
        mutation_probability=1.0 / 12.0,
        mutation_index=20.0,
    )

    def __init__(
        self,
        *,
        path: Any = "gemini",
        path_control_points: int | None = None,
        robot: str | Path | Robot | Mapping[str, Any] | None = None,
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
        _check(limits, encoding, interpolant, quadrature, effort)
        certified = limits == "certified"
        asked = {"velocity": velocity, "acceleration": acceleration, "jerk": jerk}
        self.path, axes, self.longest_time = prepared(path, path_control_points, robot, asked, longest_time)
        dynamics = Dynamics(axes, Payload.of(payload, model=None), samples=samples, threads=threads)
        runs = Reparameterisation(
            self.path,
            axes.limits,
            longest_time=self.longest_time,
            bound="tight" if certified else limits,
            timing="least" if encoding == "shape" else "share",
            control_points=control_points,
            order=order,
            tolerance=tolerance,
        )
        given = {
            "path": path if isinstance(path, str) and path in EXAMPLE_PATHS else self.path.settings,
            "robot": None if robot is None else axes.settings,
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
            "payload": dynamics.payload.settings,
            "samples": dynamics.samples,
            "threads": dynamics.threads,
        }
        self._settings: dict[str, Any] = plain_data("settings", given)
        linear = interpolant == "linear"
        self._optimum = None if linear or limits == "hull" else PathOptimum(runs, dynamics, bool(effort))
        super().__init__(
            dynamics=dynamics,
            interpolant=_linear(self.path, axes, self.longest_time) if linear else runs,
            objectives=_objectives(quadrature, axes, encoding),
            constraints=held(
                (*_limits(axes, "tight" if linear else limits), *_others(axes, self.longest_time, effort)),
                "certified" if certified else "sampled",
            ),
            reference_point=_reference(runs) if encoding == "plain" else None,
            length=length_unit(axes),
        )
        if linear:
            _refuse_too_short(self.longest_time, float(self.decode(np.zeros((1, 1))).duration[0]))
        else:
            self._add_forms(runs, quadrature, ("certified" if certified else "sampled") if effort else None)
        if self._many:
            self.evolution = type(self).evolution.updated(generations=GENERATIONS_OF_MANY, polish=False)

    def _add_forms(self, runs: Reparameterisation, quadrature: str, effort: str | None) -> None:
        """Set the smooth form of the plain encoding, or the expansion of the shape encoding."""
        form = smooth_form(runs, self.dynamics, _objectives(quadrature, self.robot, "plain"), effort)
        needed = np.inf if self._optimum is None else self._optimum.quick_time()
        if needed > self.longest_time and not self._many:
            needed = least_time(runs, form.problem)
        _refuse_too_short(self.longest_time, needed)
        if runs.timing == "share":
            self.smooth = form
        else:
            plain = type(self)(**(self._settings | {"encoding": "plain"}))
            self.expansion = Expansion(plain, partial(envelope, longest_time=self.longest_time), rises)

    def least_time(self) -> WeightedOptimum:
        """The fastest motion along the path under all limits, in seconds for hundreds of control points.

        It is the end of a sequence of convex programs, see :mod:`trajevo.solvers.along_path`: least among shapes of
        u(t) near it. Its limits are those of the problem, proven for velocity, acceleration and jerk.

        Raises:
            InvalidInputError: ``limits="hull"`` or ``interpolant="linear"``, or no motion keeps the limits.
        """
        if self._optimum is None:
            raise InvalidInputError(
                "least_time: expected limits='tight' or 'certified' and interpolant='bspline', got "
                f"limits={self._settings['limits']!r} and interpolant={self._settings['interpolant']!r}"
            )
        return least_time_of(self, self._optimum)

    def known_good(self, size: int, *, in_time: Callable[[], bool] | None = None) -> Array:
        """Motions from the least to the longest time by convex programs, under limits of effort or of many points.

        With a limit of time, motions on the way to the fastest one are evaluated too, and serve when the time is up.
        """
        if self._optimum is None or not (self._many or self._optimum.effort):
            return super().known_good(size, in_time=in_time)
        return known_motions(self, self._optimum, size if self._many else max(size // 2, 1), in_time)

    @property
    def _many(self) -> bool:
        return self._optimum is not None and int(self._settings["control_points"]) > MANY

    @property
    def settings(self) -> dict[str, Any]:
        """Keyword arguments that make an equal problem."""
        return dict(self._settings)


def paper_shape(control_points: Array) -> Array:
    """Rises of the free control points c₃ to c₁₂ of a u(t), (B, 10) -> (B, 11)."""
    rows = np.atleast_2d(control_points)
    edge = np.ones((len(rows), 1))
    rises: Array = np.diff(np.concatenate([0.0 * edge, rows, edge], axis=1), axis=1)
    return rises


def _check(limits: str, encoding: str, interpolant: str, quadrature: str, effort: bool) -> None:
    checked_name("limits", limits, (*BOUNDS, "certified"))
    checked_name("encoding", encoding, ("plain", "shape"))
    checked_name("interpolant", interpolant, ("bspline", "linear"))
    checked_name("quadrature", quadrature, QUADRATURES)
    if encoding == "shape" and interpolant == "linear":
        raise InvalidInputError("encoding: 'shape' needs the interpolant 'bspline'; u = t / t_f has one shape")
    if encoding == "shape" and effort:
        raise InvalidInputError("encoding: 'shape' has no effort limits, since effort does not scale with time alone")


def _objectives(quadrature: str, axes: Robot, encoding: str) -> tuple[Objective, ...]:
    jerk = QUADRATURES[quadrature]
    time = Objective("time", "s", "Paing 2021, eq. (27), F1", total_time)
    if encoding == "plain":
        return time, Objective("jerk", unit_for("{joint}^2/s^5", axes), "Paing 2021, eq. (27), F2", jerk)
    constant = times_duration(jerk, POWER)
    return time, Objective(
        "jerk_constant", unit_for("{joint}^2", axes), "Paing 2021, eq. (27), F2 times F1^5", constant
    )


def _limits(axes: Robot, kind: str) -> tuple[Constraint, ...]:
    if kind == "hull":
        return hull_limits(axes)
    return velocity_limits(axes), acceleration_limits(axes), jerk_limits(axes)


def _others(axes: Robot, longest_time: float, effort: bool) -> tuple[Constraint, ...]:
    return (time_limit(longest_time), effort_limits(axes)) if effort else (time_limit(longest_time),)


def _linear(path: GeometricPath, axes: Robot, longest_time: float) -> LinearReparameterisation:
    return LinearReparameterisation(at_rest(path), axes.limits, longest_time=longest_time)


def _refuse_too_short(longest: float, needed: float) -> None:
    if needed > longest:
        raise InvalidInputError(
            f"longest_time: the path needs {needed:.6g} s under the limits of its axes, got {longest:.6g} s"
        )


def _reference(runs: Reparameterisation) -> tuple[float, float]:
    """Far corner of the hypervolume's box."""
    even = replace(runs, timing="least")(np.ones((1, runs.n_rises)))
    return runs.longest_time, REFERENCE_JERK * float(even.integral_of_square(3).sum())


def _plain(limit: Array) -> list[float | str]:
    """A limit as plain data: JSON has no infinity."""
    return [value if np.isfinite(value) else "inf" for value in limit.tolist()]
