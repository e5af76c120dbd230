"""Lower bounds of time, and of time with squared jerk or effort, over all time laws along a fixed path."""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, frozen, one_blas_thread, real_number
from trajevo.base.shown.brief import brief
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.errors import InvalidInputError
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.path.curve import GeometricPath
from trajevo.trajectory.bernstein import gauss
from trajevo.trajectory.interpolants import LinearReparameterisation, Reparameterisation
from trajevo.verification.path_bounds.cells import PathCells
from trajevo.verification.path_bounds.program import Round, rounds
from trajevo.verification.path_bounds.relaxation import Relaxation
from trajevo.verification.path_bounds.rows import EFFORT_NODES, LimitRows, accelerations, efforts

#: Least and greatest number of stations, and the number from which on a coarser program is solved first.
_FEWEST, _MANY, _COARSE = 10, 5000, 80

#: Programs at most, and share by which a bound must grow to go on.
_ROUNDS, _TOLERANCE = 12, 1e-4

#: Share by which velocities that follow from accelerations are raised for rounding.
_ROUNDING = 1e-9

#: Least order of a path: its slope has to be continuous.
_LEAST_ORDER = 3


@final
@dataclass(frozen=True)
class PathBound:
    """No time law along the path has less: a proven lower bound of ∫ (1 + jerk weight ‖jerk‖² + ...) dt.

    Attributes:
        least: the bound [s].
        square_jerk: weight of the integral of the squared jerk [s per its unit].
        square_effort: weight of the integral of the squared effort [s per its unit].
        limited: the quantities whose limits the bound counts on.
        stations: number of cells of the path.
        rounds: number of programs solved.
        cpu_seconds: CPU time [s].
        places: places along the path, shape (C,) [1].
        speeds: speeds ds/dt with which the relaxed law passes them, shape (C,) [1/s].
    """

    least: float
    square_jerk: float
    square_effort: float
    limited: tuple[str, ...]
    stations: int
    rounds: int
    cpu_seconds: float
    places: Array
    speeds: Array

    __repr__ = brief

    def gap(self, found: float) -> float:
        """By how much a motion's value could be lowered at most, as a share of it; negative if the bound is broken."""
        return 1.0 - self.least / found


@final
@dataclass(frozen=True, eq=False)
class PathQuestion:
    """What is asked of time laws along a path.

    Attributes:
        path: the path.
        dynamics: the robot, whose limits hold, and its payload.
        limited: names of the quantities that are limited: of velocity, acceleration, jerk and effort.
    """

    path: GeometricPath
    dynamics: Dynamics
    limited: tuple[str, ...]

    __repr__ = brief

    @classmethod
    def of(cls, problem: TrajectoryProblem) -> PathQuestion:
        """That of a problem along a fixed path; limits of other quantities do not count, so that the bound holds.

        Raises:
            InvalidInputError: the problem is not along a fixed path, its time law is fixed, or the path has corners.
        """
        runs: Any = problem.interpolant
        if isinstance(runs, LinearReparameterisation):
            raise InvalidInputError(
                "problem: expected a time law that is free, such as interpolant='bspline', got u = t / T, whose path "
                "itself is at rest at both ends"
            )
        if not isinstance(runs, Reparameterisation):
            raise InvalidInputError(
                f"problem: expected one along a fixed path, such as 'reparam', got {type(problem).__name__}"
            )
        path = runs.path
        if path.order < _LEAST_ORDER:
            raise InvalidInputError(f"path: expected a curve of order {_LEAST_ORDER} at least, got {path.order}")
        held = {constraint.quantity for constraint in problem.constraints}
        names = ("velocity", "acceleration", "jerk", "effort")
        return cls(path, problem.dynamics, tuple(name for name in names if name in held))

    def limits(self, name: str) -> tuple[Array, Array]:
        """Limits forward and backward of a quantity, inf where none holds, each shape (n_joints,)."""
        if name not in self.limited:
            free = np.full(self.path.n_axes, np.inf)
            return free, free
        sides = self.dynamics.robot.limits.sides(name)
        return sides.forward, sides.backward


def path_bound(
    problem: TrajectoryProblem,
    *,
    square_jerk: float = 0.0,
    square_effort: float = 0.0,
    stations: int = 100,
) -> PathBound:
    """A proven lower bound of the time that any motion along a problem's path takes, whatever its time law.

    The laws are all s(t) that rise from one end of the path to the other, at rest at both ends and, where jerk is
    limited or weighed, without acceleration there, under the problem's limits of velocity, acceleration, jerk and
    effort at every instant. Other limits of the problem are left out, which can only lower the bound. With weights it
    bounds T + square_jerk ∫ ‖jerk‖² dt + square_effort ∫ ‖effort‖² dt.

    Args:
        problem: a problem along a fixed path, such as
            :class:`~trajevo.problems.time_jerk_reparameterisation.TimeJerkReparameterisation`.
        square_jerk: weight of the integral of the squared jerk of all axes [s per rad²/s⁵ or m²/s⁵].
        square_effort: weight of the integral of the squared effort of all joints [s per N²·m²·s or N²·s].
        stations: number of cells of the path; the bound rises with it to a limit.

    Returns:
        The bound.

    Raises:
        InvalidInputError: the problem is not along a fixed path, a weight is negative or not finite, or the number of
            stations is not between 10 and 5000; or nothing limits the speed along some part of the path.
    """
    weights = _weight(square_jerk, "square_jerk"), _weight(square_effort, "square_effort")
    if isinstance(stations, bool) or not isinstance(stations, int) or not _FEWEST <= stations <= _MANY:
        raise InvalidInputError(f"stations: expected a whole number from {_FEWEST} to {_MANY}, got {stations!r}")
    question = PathQuestion.of(problem)
    began = clock.process_time()
    solved = solved_at(question, stations, weights)
    if not np.isfinite(solved.least):
        raise InvalidInputError(
            "stations: no bound was found; expected limits of velocity or acceleration of an axis that moves "
            "everywhere along the path, or more stations"
        )
    return PathBound(
        least=solved.least,
        square_jerk=weights[0],
        square_effort=weights[1],
        limited=question.limited,
        stations=len(solved.places),
        rounds=solved.rounds,
        cpu_seconds=clock.process_time() - began,
        places=frozen(solved.places),
        speeds=frozen(solved.speeds),
    )


@final
@dataclass(frozen=True, eq=False)
class Solved:
    """What programs of one weighted sum prove.

    Attributes:
        least: the bound [s]; -inf if nothing is proven.
        places: middles of the cells, shape (C,) [1].
        speeds: speeds ds/dt with which the relaxed law passes them, shape (C,) [1/s].
        rounds: number of programs.
    """

    least: float
    places: Array
    speeds: Array
    rounds: int

    __repr__ = brief


def solved_at(
    question: PathQuestion,
    stations: int,
    weights: tuple[float, float],
    *,
    known: tuple[Array, Array] | None = None,
    over: Callable[[], bool] = lambda: False,
) -> Solved:
    """Programs of a weighted sum, a coarse one first if no speeds are known and there are many cells.

    Args:
        question: the path and its limits.
        stations: number of cells.
        weights: those of squared jerk and squared effort.
        known: places (P,) and speeds there (P,) [1/s] near which speeds are tried first; None if nothing is known.
        over: is asked after each program but the first; once it is true, what is proven by then is the bound.
    """
    with one_blas_thread():
        unit = _usual_time(question, *weights)
        speeds, done, least = None if known is None else (known[0], known[1] * unit), 0, -np.inf
        for count in ([stations // 4] if known is None and stations >= _COARSE else []) + [stations]:
            relaxation = relaxation_of(question, count, unit, *weights)
            best, tried = _best(relaxation, speeds, over)
            done += tried
            cells = relaxation.cells
            middles = 0.5 * (cells.stations[:-1] + cells.stations[1:])
            if best is not None:
                least, speeds = max(least, best.proven * unit), (middles, best.speeds)
            if over():
                break
    at = np.ones(len(middles)) if speeds is None else np.interp(middles, *speeds)
    return Solved(least, middles, at / unit, done)


def relaxation_of(
    question: PathQuestion, stations: int, unit: float, square_jerk: float, square_effort: float
) -> Relaxation:
    """The relaxation in a unit of time [s], in which the time itself has the weight 1 per unit."""
    weighed = square_effort > 0.0
    with_effort = weighed or bool(np.isfinite(question.limits("effort")).any())
    nodes = max(2 * (question.path.order - 2) + 2, EFFORT_NODES + 2 if with_effort else 0)
    cells = PathCells.of(question.path, stations, nodes)
    rows = accelerations(cells, *question.limits("acceleration")).in_unit(unit, unit**2)
    if with_effort:
        more = efforts(cells, question.dynamics, *question.limits("effort")).in_unit(unit, 1.0)
        rows = _joined(rows, more)
    return Relaxation(
        cells,
        rows,
        _velocities(question, cells) * unit,
        np.maximum(*question.limits("jerk")) * unit**3,
        square_jerk / unit**6,
        square_effort,
    )


def _best(
    relaxation: Relaxation, speeds: tuple[Array, Array] | None, over: Callable[[], bool]
) -> tuple[Round | None, int]:
    """The round that proves most, None if no program is solved, and the number of rounds."""
    best, count = None, 0
    for found in rounds(relaxation, _ROUNDS, speeds):
        count += 1
        grown = np.inf if best is None else found.proven - best.proven
        if best is None or grown > 0.0:
            best = found
        if (
            over()
            or abs(grown) < _TOLERANCE * abs(best.proven)
            or abs(found.most - found.proven) < _TOLERANCE * abs(best.proven)
        ):
            break
    return best, count


def _velocities(question: PathQuestion, cells: PathCells) -> Array:
    """Greatest velocities of the axes, also by accelerations: v² / 2 rises by at most a |dq|, from rest to rest."""
    velocity = np.maximum(*question.limits("velocity"))
    acceleration = np.maximum(*question.limits("acceleration"))
    travel = np.abs(np.diff(question.path(cells.stations), axis=0)).sum(axis=0)
    with np.errstate(invalid="ignore"):
        reached = np.sqrt(acceleration * travel) * (1.0 + _ROUNDING)
    return np.minimum(velocity, np.where(np.isnan(reached) | (travel == 0.0), np.inf, reached))


def _usual_time(question: PathQuestion, square_jerk: float, square_effort: float) -> float:
    """About the time that the path takes [s]; it scales programs, and no bound depends on it."""
    cells = PathCells.of(question.path, _FEWEST, EFFORT_NODES + 2)
    _, slope, bend, turn = cells.slopes
    with np.errstate(divide="ignore", invalid="ignore"):
        times = [(np.abs(slope) / np.maximum(*question.limits("velocity"))).mean(axis=(0, 1)).max()]
        for name, power, parts in (("acceleration", 2, (slope, bend)), ("jerk", 3, (slope, bend, turn))):
            size = np.sqrt(sum(part**2 for part in parts)).mean(axis=(0, 1))
            times.append((size / np.maximum(*question.limits(name))).max() ** (1.0 / power))
        if square_effort > 0.0 or np.isfinite(question.limits("effort")).any():
            rows = efforts(cells, question.dynamics, *question.limits("effort"))
            left = np.maximum(np.minimum(rows.forward, rows.backward) - np.abs(rows.held), 0.1 * rows.forward)
            times.append(float(np.sqrt((4.0 * np.abs(rows.bend) / left).mean(axis=(0, 1)).max())))
            # As if each joint had to move a mass from rest to rest.
            times.append(float((36.0 * square_effort * (rows.bend**2).mean(axis=(0, 1)).sum()) ** 0.25))
    usual = max(float(t) for t in times if np.isfinite(t))
    if square_jerk > 0.0:
        usual = max(usual, (2.0 * square_jerk * smooth_jerk(question.path)) ** (1.0 / 6.0))
    return usual if usual > 0.0 else 1.0


def smooth_jerk(path: GeometricPath) -> float:
    """∫ ‖jerk‖² dt of s = 35 t⁴ - 84 t⁵ + 70 t⁶ - 20 t⁷ along a path in unit time [rad² or m²]."""
    law = np.polynomial.Polynomial([0.0, 0.0, 0.0, 0.0, 35.0, -84.0, 70.0, -20.0])
    nodes, weights = gauss(200)
    u = np.clip(law(nodes), 0.0, 1.0)
    v, a, j = (law.deriv(order)(nodes)[:, None] for order in (1, 2, 3))
    jerk = path(u, 3) * v**3 + 3.0 * path(u, 2) * v * a + path(u, 1) * j
    return float(((jerk**2).sum(axis=1) * weights).sum())


def _joined(rows: LimitRows, more: LimitRows) -> LimitRows:
    def both(name: str, axis: int) -> Array:
        return np.concatenate([getattr(rows, name), getattr(more, name)], axis=axis)

    bend, half, rate, held, errors = (both(name, 2) for name in ("bend", "half", "rate", "held", "errors"))
    return LimitRows(bend, half, rate, held, errors, both("forward", 0), both("backward", 0))


def _weight(value: Any, name: str) -> float:
    found = real_number(value)
    if found is None or not 0.0 <= found < np.inf:
        raise InvalidInputError(f"{name}: expected a number from 0 on, got {value!r}")
    return found
