"""What tables and figures of Guo et al. 2016 share: the motion of Table 7, its rounding, and the searches."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.rollout import Rollout
from trajevo.reproduction.paper import Desk
from trajevo.solvers.gradient.weighted_sum import WeightedOptimum, minimise_weighted
from trajevo.solvers.optimise import optimise
from trajevo.solvers.run.folder import RunFolder
from trajevo.trajectory.interpolants import Interpolant

from ..hybrid_kinematics import forward_kinematics, tracking_error
from ..hybrid_manipulator import PAPER_WEIGHTS, HybridManipulator, cost, paper_solution
from .guo2016_printed import TABLE_6, VIRTUAL, cells_of

#: Half of the last digit of the times in Table 7 [s].
HALF_DIGIT = 0.0005

#: Joints from SI to the units of the tables: mm and rad.
SHOWN = np.array([1e3, 1e3, 1e3, 1.0, 1.0])

#: Random starts of SLSQP, as many as the paper's of fmincon, and of a short look; the same for NSGA-II.
STARTS, FEW_STARTS = 100, 2
SHORT = {"generations": 8, "population": 20}


@final
@dataclass(frozen=True, eq=False)
class Descent:
    """NSGA-II by its generations, shapes (G,) and (G, 4).

    Attributes:
        held: least F_c of all feasible individuals so far.
        of_generation: least F_c of a generation's new feasible individuals, infinite where there are none.
        objectives: z₁ to z₄ of the individual that has the least F_c so far.
        least: least z₁ to z₄ so far, each of another individual.
        cpu_seconds: CPU time of the search [s].
    """

    held: Array
    of_generation: Array
    objectives: Array
    least: Array
    cpu_seconds: float

    @property
    def best_generation(self) -> int:
        """The generation in which the least F_c was found."""
        return int(self.held.argmin()) + 1


@cache
def spline() -> Interpolant:
    """The spline of the problem, times (B, 12) [s] -> trajectories."""
    return HybridManipulator().interpolant


def at_table_7(convention: str = "printed") -> Rollout:
    """The manipulator with 10 kg at the times of Table 7."""
    return HybridManipulator(convention=convention).rollout(paper_solution())


def rounding(function: Callable[[Array], Array]) -> Array:
    """How far half of the last digit of all times in Table 7 may move a quantity, to first order.

    Args:
        function: times (B, 12) [s] -> quantities (B, ...).

    Returns:
        Σᵢ of the change by hᵢ, shape (...).
    """
    h = paper_solution()
    moved = np.concatenate([h, h + HALF_DIGIT * np.eye(12), h - HALF_DIGIT * np.eye(12)])
    found = function(moved)
    away = np.abs(found[1:] - found[0])
    total: Array = np.maximum(away[:12], away[12:]).sum(axis=0)
    return total


def knots(h: Array) -> Array:
    """Joints at the 13 knots of the spline, (B, 12) [s] -> (B, 13, 5) [mm, rad]."""
    ends = np.concatenate([np.zeros((len(h), 1)), np.cumsum(h, axis=1)], axis=1)
    joints: Array = spline()(h).evaluate(ends) * SHOWN
    return joints


def error_statistics(h: Array, *, instants: int = 150) -> Array:
    """Standard deviation [mm], variance [mm²] and greatest value [mm] of the tracking error, (B, 12) -> (B, 3).

    Args:
        h: times, shape (B, 12) [s].
        instants: number of evenly spaced instants.
    """
    errors = [1e3 * tracking_error(forward_kinematics(q)[0]) for q in spline()(h).sample(instants).q]
    return np.array([(error.std(), error.var(), error.max()) for error in errors])


def times_behind_table_6() -> Array:
    """Times whose two knots without a via point are those of Table 6, up to a factor, by least squares, shape (12,)."""
    from scipy.optimize import least_squares  # needed here only

    cells = cells_of(TABLE_6)
    printed = np.array([[float(cell) for cell in cells[row][:5]] for row in VIRTUAL])
    half = np.array([5e-3, 5e-3, 5e-3, 5e-5, 5e-5])

    def away(logarithms: Array) -> Array:
        misses = (knots(np.exp(logarithms)[None])[0, list(VIRTUAL)] - printed) / half
        # Only ratios of times count: what is left free is kept near equal times.
        return np.append(misses.ravel(), 0.2 * (logarithms - logarithms.mean()))

    def slopes(logarithms: Array) -> Array:
        moved = knots(np.exp(logarithms + 1e-30j * np.eye(12))).imag[:, list(VIRTUAL)] / 1e-30
        return np.concatenate([(moved / half).reshape(12, -1).T, 0.2 * (np.eye(12) - 1.0 / 12.0)])

    times: Array = np.exp(least_squares(away, np.zeros(12), jac=slopes, ftol=1e-3).x)
    return times


def optimum(desk: Desk, convention: str) -> WeightedOptimum:
    """The least F_c by SLSQP from random starts, under a convention of the objectives."""
    return timed_optimum(desk, convention)[0]


def timed_optimum(desk: Desk, convention: str) -> tuple[WeightedOptimum, float]:
    """:func:`optimum` and its CPU time [s]."""
    problem = HybridManipulator(convention=convention)
    starts = FEW_STARTS if desk.short or convention != "printed" else STARTS

    def search() -> tuple[WeightedOptimum, float]:
        began = time.process_time()
        found = minimise_weighted(problem, PAPER_WEIGHTS, seed=desk.seed, starts=starts)
        return found, time.process_time() - began

    return desk.once(f"least F_c by SLSQP from {starts} starts, {convention}", search)


def descent(desk: Desk, objectives: str) -> Descent:
    """NSGA-II with the paper's settings on the four objectives (``"all"``) or on F_c alone (``"cost"``)."""
    return desk.once(f"NSGA-II on {objectives}", lambda: _descent(desk, objectives))


def _descent(desk: Desk, objectives: str) -> Descent:
    problem = HybridManipulator(convention="printed", objectives=objectives)
    size: dict[str, Any] = SHORT if desk.short else {}
    began = time.process_time()
    with tempfile.TemporaryDirectory(prefix="trajevo-") as folder:
        run = Path(folder) / "run"
        found = optimise(problem, seed=desk.seed, starts="random", polish=False, out=run, progress=False, **size)
        seconds = time.process_time() - began
        blocks = list(RunFolder(run).blocks(found.run.generations))
    generation = np.concatenate([block.generation for block in blocks])
    X, F, G = (np.concatenate([getattr(block, name) for block in blocks]) for name in "XFG")
    kept = G.max(axis=1) <= 0.0
    full = F if objectives == "all" else HybridManipulator(convention="printed").evaluate(X, return_values_of=["F"])
    return _by_generation(generation, np.where(kept[:, None], full, np.inf), seconds)


def _by_generation(generation: Array, F: Array, seconds: float) -> Descent:
    """The records of a search from its individuals' generations (N,) and objectives (N, 4), infinite if infeasible."""
    costs, last = cost(F), int(generation.max())
    of_generation = np.array([costs[generation == number].min() for number in range(1, last + 1)])
    best = [int(np.where(generation <= number, costs, np.inf).argmin()) for number in range(1, last + 1)]
    least = np.array([F[generation == number].min(axis=0) for number in range(1, last + 1)])
    return Descent(
        held=np.minimum.accumulate(of_generation),
        of_generation=of_generation,
        objectives=F[best],
        least=np.minimum.accumulate(least, axis=0),
        cpu_seconds=seconds,
    )
