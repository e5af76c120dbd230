"""The best motions along a fixed path by convex programs: the least time, and the least jerk in every longer time."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import final

import numpy as np

from trajevo.base.arrays import Array, frozen, one_blas_thread
from trajevo.base.shown.brief import brief
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.errors import InvalidInputError
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.solvers.along_path.beginning import begun
from trajevo.solvers.along_path.effort import EffortLimits
from trajevo.solvers.along_path.fastest import TimedShape, nearing
from trajevo.solvers.along_path.kinematics import KinematicLimits, PathDerivatives, PathLimits
from trajevo.solvers.along_path.smoothest import smoothest
from trajevo.solvers.gradient.weighted_sum import WeightedOptimum
from trajevo.trajectory.interpolants import Reparameterisation, slowness

#: Number of control points above which a search begins with these motions.
MANY = 40

#: Times between the least and that of the least jerk for which programs are solved; motions in between are mixtures.
_TIMES = 16

#: How often limits of effort that a motion breaks are tightened at most, how much more than by the excess, and the
#: factor by which a time may be stretched instead.
_TIGHTENED, _MORE, _SLIGHTLY = 3, 1.1, 1.001

#: Least share by which a time is stretched, how often that is doubled, and how finely the last doubling is divided.
_STEP, _DOUBLINGS, _BETWEEN = 1e-4, 16, 8


@final
@dataclass(frozen=True, eq=False)
class PathOptimum:
    """Convex programs for the shapes of a reparameterisation.

    Attributes:
        runs: decoder of the problem.
        dynamics: the robot and its payload.
        effort: whether effort is limited.
    """

    runs: Reparameterisation
    dynamics: Dynamics
    effort: bool

    __repr__ = brief

    def fastest(self, share: Array | None = None, begin: TimedShape | None = None) -> TimedShape:
        """The shape with the least time.

        Args:
            share: share of the limits of effort that may be used, of every joint, shape (n_joints,); None for all.
            begin: the shape to begin with; None for one by a smooth pace.

        Raises:
            InvalidInputError: the effort at rest exceeds a limit somewhere on the path.
        """
        with one_blas_thread():
            *_, found = self.nearing(share, begin)
        return found

    def nearing(self, share: Array | None = None, begin: TimedShape | None = None) -> Iterator[TimedShape]:
        """The shape to begin with, then those on the way to the least time; otherwise as :meth:`fastest`."""
        runs = self.runs
        start = begun(runs.path, runs.limits, runs.control_points, runs.order)
        if begin is not None:
            start = begin.control_points
        for found in nearing(start, runs.order, self._limits(share), len(runs.path.breaks) - 1):
            if not np.isfinite(found.time):
                raise InvalidInputError("effort: the robot cannot hold itself and its payload everywhere on the path")
            yield found

    def quick_time(self) -> float:
        """A time in which the path can be run under limits of velocity, acceleration and jerk, proven [s].

        That of the motion with which the programs begin or, if it is longer than the longest, that at their end.
        """
        runs = self.runs
        start = begun(runs.path, runs.limits, runs.control_points, runs.order)
        found = float(runs.least_durations(runs.course_of(start[None]))[0])
        if found <= runs.longest_time:
            return found
        shape = replace(self, effort=False).fastest()
        return float(runs.least_durations(runs.course_of(shape.control_points[None]))[0])

    def family(self, size: int, quickest: TimedShape, in_time: Callable[[], bool]) -> tuple[Array, Array]:
        """Motions from the least to the longest time, each with the least jerk in its time or nearly so.

        Args:
            size: number of motions.
            quickest: the fastest shape.
            in_time: whether there is time for another program; if not, the last shape stands for longer times too.

        Returns:
            Control points (N, control_points), and times (N,) [s].
        """
        path, limits = self._path, self._limits(None)
        with one_blas_thread():
            calm = smoothest(quickest, np.inf, path, limits) if in_time() else quickest
            last = min(max(calm.time, quickest.time), self.runs.longest_time)
            times = np.geomspace(quickest.time, last, _TIMES)
            shapes = [quickest]
            for wanted in times[1:]:
                if not in_time():
                    break
                shapes.append(smoothest(shapes[-1], float(wanted), path, limits))
        asked = np.geomspace(quickest.time, max(self.runs.longest_time, quickest.time), size)
        times, last_shape = times[: len(shapes)], len(shapes) - 1
        after = np.clip(np.searchsorted(times, asked, side="right"), min(1, last_shape), last_shape)
        part = np.clip((asked - times[after - 1]) / np.maximum(times[after] - times[after - 1], 1e-300), 0.0, 1.0)
        points = np.array([shape.control_points for shape in shapes])
        return (1.0 - part)[:, None] * points[after - 1] + part[:, None] * points[after], asked

    def rows(self, control_points: Array, times: Array) -> Array:
        """Decision vectors of shapes (B, control_points) in times (B,) [s], or in their least times if longer."""
        rises = self.runs.rises_of(control_points)
        if self.runs.timing == "least":
            return rises
        shapes, which = np.unique(control_points, axis=0, return_inverse=True)
        least = self.runs.least_durations(self.runs.course_of(shapes))[which.ravel()]
        return np.column_stack([rises, slowness(least, np.maximum(times, least), self.runs.longest_time)])

    def quick_row(self, shape: TimedShape) -> Array:
        """Decision vector (1, n_var) of a shape in its least time, proven but for effort."""
        if self.effort:
            return self.rows(shape.control_points[None], np.array([shape.time]))
        rises = self.runs.rises_of(shape.control_points[None])
        return rises if self.runs.timing == "least" else np.column_stack([rises, [0.0]])

    def _limits(self, share: Array | None) -> list[PathLimits]:
        found: list[PathLimits] = [KinematicLimits(self._path, self.runs.limits)]
        if self.effort:
            used = np.ones(self.dynamics.robot.dof) if share is None else share
            found.append(EffortLimits(self._path, self.dynamics, used))
        return found

    @property
    def _path(self) -> PathDerivatives:
        return PathDerivatives(self.runs.path)


def least_time_of(problem: TrajectoryProblem, optimum: PathOptimum) -> WeightedOptimum:
    """The motion with the least time that keeps all limits of a problem as the problem itself checks them.

    Raises:
        InvalidInputError: no motion along the path keeps the limits within the problem's longest time.
    """
    began = time.perf_counter()
    _, row = _kept(problem, optimum)
    F, G = problem.evaluate(row, return_values_of=["F", "G"])
    return WeightedOptimum(
        problem=problem,
        x=frozen(row[0].copy()),
        cost=float(F[0, 0]),
        F=dict(zip(problem.objective_names, F[0].tolist(), strict=True)),
        G=dict(zip(problem.constraint_names, G[0].tolist(), strict=True)),
        costs=frozen(F[:, 0].copy()),
        seconds=time.perf_counter() - began,
    )


def known_motions(
    problem: TrajectoryProblem, optimum: PathOptimum, size: int, in_time: Callable[[], bool] | None = None
) -> Array:
    """Decision vectors of at most so many motions from the least to the longest time; none if no motion is found.

    Args:
        problem: the problem.
        optimum: its programs.
        size: number of motions.
        in_time: whether there is time for more than what has been found; None for no limit.
    """
    try:
        quickest, first = _kept(problem, optimum) if in_time is None else _kept_in_time(problem, optimum, in_time)
    except InvalidInputError:  # nothing keeps the limits: the search itself says so
        return np.empty((0, problem.n_var))
    rows = np.concatenate([first, optimum.rows(*optimum.family(size, quickest, in_time or _always))])[:size]
    if in_time is None or in_time():
        return rows
    # Shapes for which there was no time are those before them, which without times of their own are the same rows.
    return rows[np.sort(np.unique(rows, axis=0, return_index=True)[1])]


def _always() -> bool:
    return True


def _kept_in_time(
    problem: TrajectoryProblem, optimum: PathOptimum, in_time: Callable[[], bool]
) -> tuple[TimedShape, Array]:
    """As :func:`_kept`, but what is found on the way is looked at, and serves when there is no time for more."""
    best, least = None, np.inf
    with one_blas_thread():
        for shape in optimum.nearing():
            row = optimum.quick_row(shape)
            F, G = problem.evaluate(row, return_values_of=["F", "G"])
            if (G <= 0.0).all() and F[0, 0] < least:
                best, least = (shape, row), F[0, 0]
            if best is not None and not in_time():
                return best
    return _kept(problem, optimum, shape)


def _kept(
    problem: TrajectoryProblem, optimum: PathOptimum, quickest: TimedShape | None = None
) -> tuple[TimedShape, Array]:
    """The fastest shape, and its decision vector (1, n_var) in the least time in which it keeps all limits.

    Between the instants of the programs effort may exceed its limits a little, most where a joint turns round and dry
    friction jumps. So the shape is stretched; if that takes long, limits that are broken are tightened first.
    """
    share, shape = np.ones(problem.robot.dof), quickest or optimum.fastest()
    limited = np.flatnonzero(problem.robot.limits.sides("effort").limited)
    best = None
    for tightened in range(_TIGHTENED + 1):
        row = optimum.rows(shape.control_points[None], np.array([shape.time]))
        factor, kept = _stretched(problem, optimum, shape, row)
        if kept is not None and (best is None or shape.time * factor < best[0]):
            best = shape.time * factor, shape, kept
        excess = _effort_excess(problem, row)
        if factor <= _SLIGHTLY or not (excess > 0.0).any() or tightened == _TIGHTENED:
            break
        share[limited] /= 1.0 + _MORE * np.maximum(excess, 0.0)
        shape = optimum.fastest(share, shape)
    if best is None:
        raise InvalidInputError(
            f"longest_time: expected a time in which a motion along the path keeps all limits, got "
            f"{optimum.runs.longest_time:.6g} s"
        )
    return best[1:]


def _effort_excess(problem: TrajectoryProblem, row: Array) -> Array:
    """By how much the limits of effort are exceeded, as shares; empty where effort is not limited."""
    rollout = problem.rollout(row)
    found = [limit.function(rollout)[0] for limit in problem.constraints if limit.quantity == "effort"]
    return np.concatenate(found) if found else np.zeros(0)


def _stretched(
    problem: TrajectoryProblem, optimum: PathOptimum, shape: TimedShape, row: Array
) -> tuple[float, Array | None]:
    """By which factor the time of a shape is stretched until it keeps all limits, and its row; inf and None if none."""
    if _feasible(problem, row)[0]:
        return 1.0, row
    factors = 1.0 + _STEP * 2.0 ** np.arange(_DOUBLINGS)
    times = factors[factors * shape.time <= optimum.runs.longest_time] * shape.time
    good = np.flatnonzero(_feasible(problem, _in_times(optimum, shape, times)))
    if not len(good):
        return float("inf"), None
    last = times[good[0]]
    before = times[good[0] - 1] if good[0] else shape.time
    between = np.linspace(before, last, _BETWEEN + 1)[1:]
    rows = _in_times(optimum, shape, between)
    first = int(np.flatnonzero(_feasible(problem, rows))[0])
    return float(between[first] / shape.time), rows[first : first + 1]


def _in_times(optimum: PathOptimum, shape: TimedShape, times: Array) -> Array:
    """Decision vectors of a shape in several times (T,) [s]."""
    return optimum.rows(np.tile(shape.control_points, (len(times), 1)), times)


def _feasible(problem: TrajectoryProblem, rows: Array) -> Array:
    """Which decision vectors keep all limits of a problem, shape (B,)."""
    found: Array = (problem.evaluate(rows, return_values_of=["G"]) <= 0.0).all(axis=1)
    return found
