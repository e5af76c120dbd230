"""Rows of the table: how the cost grows with population, samples, via points and joints.

The exponent is the slope of log time over log size, by least squares over the greater half of the sizes, where what a
call costs by itself does not count any more; over all sizes it would come out lower. All sizes are measured in turn.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from cases import FAST, PLAIN, Line, duration, quartiles, verdict
from chains import chain
from compare import Action, in_turn
from rows_runs import run
from subjects import candidates, of_objectives, ours, ur5

from trajevo import TrajectoryProblem
from trajevo.base.arrays import Array
from trajevo.formulation.search import Search
from trajevo.problems import ViaPointProblem
from trajevo.problems.hybrid_manipulator import HybridManipulator

POPULATIONS = (50, 100, 200, 500, 1000, 2000, 5000)
SAMPLES = (3, 4, 8, 16, 32, 64)  # of a segment
POINTS = (4, 8, 16, 32, 64)
JOINTS = (2, 4, 8, 15, 22, 30)
COUNT, ROUNDS, GENERATIONS, RUNS = 100, 5, 20, 3
MOST = 1.05


def lines() -> Iterator[Line]:
    """Four sizes that evaluation grows with, then a run's population."""
    yield from scaling("evaluation, UR5: trajectories", POPULATIONS, dict.fromkeys(POPULATIONS, ur5), count=None)
    sampled = {size: lambda size=size: ur5(samples=size) for size in SAMPLES}
    yield from scaling("evaluation, UR5: samples of a segment", SAMPLES, sampled)
    through = {size: lambda size=size: ur5(points=size) for size in POINTS}
    yield from scaling("evaluation, UR5: via points", POINTS, through, asked=False)
    yield from scaling("evaluation, chain: joints", JOINTS, {size: lambda size=size: arm(size) for size in JOINTS})
    yield from populations()


def arm(joints: int) -> ViaPointProblem:
    """A chain through eleven points."""
    share = np.linspace(0.0, 1.0, 11)[:, None]
    points = 0.6 * np.sin(2.0 * np.pi * share + np.arange(joints)) * (0.3 + 0.7 * share)
    return of_objectives(chain(joints), points, 4)


def scaling(
    title: str,
    sizes: tuple[int, ...],
    made: dict[int, Callable[[], TrajectoryProblem]],
    count: int | None = COUNT,
    asked: bool = True,
) -> Iterator[Line]:
    """Evaluation of problems of every size, of so many trajectories or of as many as the size."""
    ways: dict[str, list[Action]] = {}
    for size in sizes:
        x = candidates(made[size](), size if count is None else count)
        for name, action in ours(made[size], lambda problem, x=x: problem.evaluate(x)).items():
            ways.setdefault(name, []).append(action)
    yield from fitted(title, sizes, ways, ROUNDS, asked)


def populations() -> Iterator[Line]:
    """Whole runs of a few generations."""
    ways: dict[str, list[Action]] = {}
    for size in POPULATIONS:
        own = settings(size)
        for name, action in ours(ur5, lambda problem, own=own: run(problem, own)).items():
            ways.setdefault(name, []).append(action)
    yield from fitted(f"NSGA-II of {GENERATIONS} generations, UR5: population", POPULATIONS, ways, RUNS, True)


def settings(population: int) -> Search:
    """Those of Guo 2016 with another population, for a few generations."""
    return HybridManipulator.evolution.updated(population=population, generations=GENERATIONS)


def fitted(
    title: str, sizes: tuple[int, ...], ways: dict[str, list[Action]], rounds: int, asked: bool
) -> Iterator[Line]:
    """Measure all sizes of all ways in turn; a line for each way."""
    names = [name for name in (PLAIN, FAST) if name in ways]
    seconds = in_turn([action for name in names for action in ways[name]], rounds)
    for name, own in zip(names, np.split(seconds, len(names), axis=1), strict=True):
        slopes = exponents(np.array(sizes), own)
        ends = f"{duration(own[:, 0])} to {duration(own[:, -1])}"
        yield Line(
            f"{title} {sizes[0]} to {sizes[-1]}, exponent over {sizes[len(sizes) // 2]} to {sizes[-1]}",
            name,
            f"exponent {quartiles(slopes)}; {ends}",
            asked=f"exponent at most {MOST}: {verdict(np.median(slopes) <= MOST)}" if asked else "",
        )


def exponents(sizes: Array, seconds: Array) -> Array:
    """Slope of log time over log size in every round, shapes (K,), (rounds, K) -> (rounds,)."""
    half = len(sizes) // 2
    x, y = np.log(sizes[half:]), np.log(seconds[:, half:])
    x = x - x.mean()
    slopes: Array = (y @ x) / (x @ x)
    return slopes
