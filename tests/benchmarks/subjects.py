"""Problems of the table of `make bench`, and the way to evaluate them as where numba is not installed."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

import numpy as np
from cases import FAST, PLAIN
from compare import Action
from elementwise import HybridLoop, SplineLoop, Values
from elementwise_path import ScipyLoop
from elementwise_pointing import values as pointing_values

from trajevo import TrajectoryProblem, load_robot
from trajevo.base import jit
from trajevo.base.arrays import Array
from trajevo.problems import (
    HybridManipulator,
    PickAndPlace,
    PointingMechanism,
    TimeJerkReparameterisation,
    ViaPointProblem,
)

#: Instants of each of twelve segments at which torque is looked at, 48 in all.
SAMPLES = 4

OBJECTIVES = ("time", "square_power", "square_jerk", "square_acceleration")
LIMITS = ("position", "velocity", "acceleration", "jerk", "effort", "mean_velocity")

#: By how much values of candidates evaluated one by one may differ.
_SAME = 1e-8


def hybrid() -> HybridManipulator:
    """Guo 2016: 13 knots, 12 times, five joints."""
    return HybridManipulator(samples=SAMPLES)


def ur5(points: int = 11, samples: int = SAMPLES) -> ViaPointProblem:
    """A UR5 with 3 kg through points, of which the spline makes two knots more; four objectives and every limit."""
    free = {"acceleration": 15.0, "jerk": 150.0}
    robot = load_robot("ur5", tool="tool0", limits=free)
    ends = np.array([[-0.6, -1.4, 1.6, -1.7, -1.57, 0.0], [0.6, -1.0, 1.2, -1.9, -1.57, 0.5]])
    share = np.linspace(0.0, 1.0, points)[:, None]
    swing = 0.15 * np.sin(np.pi * share) * np.sin(2.0 * np.pi * share + np.arange(6))
    via = (1.0 - share) * ends[0] + share * ends[1] + swing
    return of_objectives(robot, via, samples, payload=3.0)


def of_objectives(robot: object, points: Array, samples: int, payload: float = 0.0) -> ViaPointProblem:
    """Cubic splines of any robot with the objectives and limits of Guo 2016."""
    return ViaPointProblem(
        robot=robot,
        points=points,
        duration_bounds=(0.05, 1.5),
        interpolant="cubic",
        objectives=OBJECTIVES,
        constraints=LIMITS,
        limits="sampled",
        payload=payload,
        samples=samples,
    )


def candidates(problem: TrajectoryProblem, count: int) -> Array:
    """Random decision vectors, none of them near the least of its bounds."""
    lower = problem.xl + 0.2 * (problem.xu - problem.xl)
    return np.random.default_rng(0).uniform(lower, problem.xu, (count, problem.n_var))


def path_values(problem: TimeJerkReparameterisation) -> Values:
    """The paper's evaluation of one candidate, from its rises and its slowness."""
    loop = ScipyLoop(problem)

    def values(x: Array) -> tuple[Array, Array]:
        rises = np.maximum(x[:-1], 1e-9)
        inner = np.concatenate([[0.0], np.cumsum(rises) / rises.sum()])
        control_points = np.concatenate([np.zeros(2), inner, np.ones(16 - 2 - len(inner))])
        least, integral = loop.evaluate(control_points)
        duration = least + x[-1] * max(problem.longest_time - least, 0.0)
        return np.array([duration, integral / duration**5]), np.full(problem.n_ieq_constr, least - problem.longest_time)

    return values


def by_samples(problem: TrajectoryProblem, x: Array) -> Array:
    """Objectives with the square of the power summed over the samples, which costs less than its integral."""
    F, rollout = problem.evaluate(x, return_values_of=["F"]), problem.rollout(x)
    F[:, 1] = np.einsum("btn,btn,bt->b", rollout.power, rollout.power, rollout.quadrature)
    return F


def checked(
    problem: TrajectoryProblem,
    values: Values,
    tolerance: float = _SAME,
    objectives: Callable[[TrajectoryProblem, Array], Array] | None = None,
) -> Values:
    """The evaluation of one candidate, after a look at whether it gives the problem's objectives, or the given ones.

    Raises:
        SystemExit: it does not.
    """
    x = candidates(problem, 5)
    F = problem.evaluate(x, return_values_of=["F"]) if objectives is None else objectives(problem, x)
    off = float(np.abs(np.array([values(row)[0] for row in x]) / F - 1.0).max())
    if not off <= tolerance:
        raise SystemExit(f"{problem.title}: evaluated one by one, objectives differ by {off:.1e}")
    return values


#: Every registered problem: title, problem, and its candidates one by one where somebody has written that down.
SUBJECTS: dict[str, tuple[Callable[[], TrajectoryProblem], Callable[[TrajectoryProblem], Values] | None]] = {
    "hybrid manipulator, 5 joints, 13 knots, torque at 48 instants": (
        hybrid,
        lambda p: checked(p, HybridLoop(p).values, objectives=by_samples),
    ),
    "UR5 via points, 6 joints, 13 knots, torque at 48 instants": (
        ur5,
        lambda p: checked(p, SplineLoop(p).values, objectives=by_samples),
    ),
    "pointing mechanism": (PointingMechanism, lambda p: checked(p, lambda x: pointing_values(p, x))),
    "run along a path": (
        lambda: TimeJerkReparameterisation(limits="hull"),
        lambda p: checked(p, path_values(p), 1e-3),  # 1000 trapezoids are not the integral
    ),
    "PUMA 560 pick and place": (PickAndPlace, None),
}


@contextlib.contextmanager
def without_numba() -> Iterator[None]:
    """As where numba is not installed. It takes next to nothing, as it is measured with what it surrounds."""
    kept = jit.can_compile
    jit.can_compile = lambda: False  # type: ignore[assignment]
    try:
        yield
    finally:
        jit.can_compile = kept


def ours(make: Callable[[], TrajectoryProblem], action: Callable[[TrajectoryProblem], object]) -> dict[str, Action]:
    """An action on a problem as where numba is not installed, and with it where it is.

    Each has a problem of its own, since a problem keeps the kernels that it has asked for.
    """
    with without_numba():
        slow = make()
        slow.evaluate(candidates(slow, 2))

    def plain() -> None:
        with without_numba():
            action(slow)

    if not jit.can_compile():
        return {PLAIN: plain}
    quick = make()
    quick.evaluate(candidates(quick, 2))
    return {PLAIN: plain, FAST: lambda: action(quick)}
