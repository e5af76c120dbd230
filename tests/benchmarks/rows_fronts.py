"""Rows of the table: fronts by gradients, least time along a path, and what is measured of fronts."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Iterator
from unittest import mock

import moocore
import numpy as np
from cases import PLAIN, Case, Line, not_installed
from compare import Action
from differences import central_differences
from pymoo.indicators.hv import HV
from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting

from trajevo import TrajectoryProblem
from trajevo.base.arrays import Array
from trajevo.front.hypervolume import hypervolume
from trajevo.problems import TimeJerkReparameterisation
from trajevo.solvers.gradient import normal_constraint as nnc
from trajevo.solvers.gradient.sqp import WeightedSum, random_starts

POINTS = 6
TOPPRA = "toppra, jerk not limited"


def lines() -> Iterator[Line]:
    """Normal constraints, least time, hypervolumes, non-dominated points."""
    problem = TimeJerkReparameterisation()
    yield from normal_constraints(problem).lines()
    yield from least_time(problem)
    for size in (100, 1000):
        yield from of_points(size)


def of_points(size: int) -> Iterator[Line]:
    """Hypervolume, and which points are not dominated, of as many points."""
    F, corner = sphere(size), np.full(4, 1.1)
    yield from Case(
        title=f"hypervolume of {size} points, 4 objectives",
        ways={"pymoo HV": lambda: HV(ref_point=corner)(F), PLAIN: lambda: hypervolume(F, corner)},
        rounds=9,
    ).lines()
    yield from Case(
        title=f"non-dominated ones of {size} points, 4 objectives",
        ways={
            "pymoo NonDominatedSorting": lambda: NonDominatedSorting().do(F, only_non_dominated_front=True),
            PLAIN: lambda: moocore.is_nondominated(F),
        },
    ).lines()


def sphere(size: int) -> Array:
    """Points on the positive part of a sphere, none of which dominates another."""
    drawn = np.abs(np.random.default_rng(0).normal(size=(size, 4)))
    points: Array = drawn / np.linalg.norm(drawn, axis=1, keepdims=True)
    return points


def normal_constraints(problem: TimeJerkReparameterisation) -> Case:
    """A front by normal constraints and SLSQP, with exact gradients and with finite differences in batches."""

    def by_differences() -> object:
        with mock.patch.object(
            TrajectoryProblem, "evaluate_with_gradients", lambda self, x: central_differences(self)(x)
        ):
            return nnc.solve_nnc(problem, points=POINTS)

    return Case(
        title=f"normal constraints, run along a path, {POINTS} points",
        ways={"finite differences": by_differences, PLAIN: lambda: nnc.solve_nnc(problem, points=POINTS)},
        rounds=3,
    )


def least_time(problem: TimeJerkReparameterisation) -> Iterator[Line]:
    """The least time of a path of two axes, ours with limits of jerk, toppra's without."""
    if problem.smooth is None:
        raise SystemExit("the problem has no smooth form")
    form = problem.smooth
    start = form.into(random_starts(problem, 0, 1))[0]
    found = float(WeightedSum(form.problem, np.array([1.0, 0.0])).run(start, 1e-9)[-1])
    title = f"least time along a path, {found:.3f} s with jerk limited"
    ways: dict[str, Action] = {PLAIN: lambda: WeightedSum(form.problem, np.array([1.0, 0.0])).run(start, 1e-9)}
    if importlib.util.find_spec("toppra") is None:
        yield from Case(title=title, ways=ways, rounds=9).lines()
        yield not_installed(title, "toppra")
        return
    solve = by_toppra(problem)
    theirs = solve()
    ways = {f"{TOPPRA}, {theirs:.3f} s": solve} | ways
    yield from Case(title=title, ways=ways, rounds=9).lines()


def by_toppra(problem: TimeJerkReparameterisation) -> Callable[[], float]:
    """Reachability analysis on the same path with the same limits of velocity and acceleration; the time [s]."""
    import toppra
    from scipy.interpolate import BSpline

    toppra.setup_logging("ERROR")
    path, limits = problem.path, problem.robot.limits
    curve = BSpline(path.knots, path.control_points, path.order - 1)
    constraints = [
        toppra.constraint.JointVelocityConstraint(np.stack([-limits.velocity, limits.velocity], axis=1)),
        toppra.constraint.JointAccelerationConstraint(np.stack([-limits.acceleration, limits.acceleration], axis=1)),
    ]

    class Path(toppra.interpolator.AbstractGeometricPath):  # type: ignore[misc]
        dof = len(limits.velocity)
        path_interval = np.array([0.0, 1.0])
        waypoints = None

        def __call__(self, s: Array, order: int = 0) -> Array:
            value: Array = curve(s, order)
            return value

    def solve() -> float:
        solver = toppra.algorithm.TOPPRA(constraints, Path(), parametrizer="ParametrizeConstAccel")
        trajectory = solver.compute_trajectory()
        if trajectory is None:
            raise SystemExit("toppra found no motion")
        return float(trajectory.duration)

    return solve
