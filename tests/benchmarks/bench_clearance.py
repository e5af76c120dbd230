"""What clearance costs per motion, as ratios of CPU times of one run: python tests/benchmarks/bench_clearance.py.

The xArm7 around its post, alone and among 4 and 19 more obstacles: what the broad phase leaves, against the distances
of all pairs at the same instants, which any other way would need at least; and many obstacles against one.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from time import process_time

import numpy as np

from trajevo import TrajectoryProblem, optimise
from trajevo.base.arrays import Array
from trajevo.formulation.constraints.broad_phase.near import INTERVALS
from trajevo.formulation.constraints.clearance import ProvenClearance
from trajevo.problems import ViaPointProblem
from trajevo.solvers.task import load_task

TASK = Path(__file__).parents[2] / "problems" / "tasks" / "xarm7_obstacle.toml"

#: Individuals of a batch, generations of the search that some come from, and repetitions.
BATCH, GENERATIONS, TIMES = 60, 30, 7


def among(count: int) -> TrajectoryProblem:
    """The task with small obstacles of all shapes around, none in the way between the points."""
    settings = load_task(TASK).problem.settings
    rng, obstacles = np.random.default_rng(5), list(settings["scene"]["obstacles"])
    while len(obstacles) < count:
        place = rng.uniform([-0.8, -0.8, 0.0], [0.8, 0.8, 1.0])
        if np.hypot(*place[:2]) < 0.35 or (place[0] > 0.0 and place[2] < 0.75):
            continue
        shapes = (
            {"shape": "sphere", "radius": 0.06},
            {"shape": "box", "size": [0.1, 0.12, 0.08]},
            {"shape": "cylinder", "radius": 0.04, "length": 0.2},
        )
        obstacles.append(
            {"name": f"obstacle {len(obstacles)}", "position": place.tolist()} | shapes[len(obstacles) % 3]
        )
    return ViaPointProblem(**settings | {"scene": settings["scene"] | {"obstacles": obstacles}})


def limit_of(problem: TrajectoryProblem) -> ProvenClearance:
    """Its clearance."""
    return next(limit.function for limit in problem.constraints if isinstance(limit.function, ProvenClearance))


def spent(functions: list[Callable[[], object]]) -> list[float]:
    """Median CPU times of functions that take turns [s]."""
    times = np.empty((TIMES, len(functions)))
    for row in times:
        for k, function in enumerate(functions):
            began = process_time()
            function()
            row[k] = process_time() - began
    return np.median(times, axis=0).tolist()


def both_ways(problem: TrajectoryProblem, x: Array) -> tuple[Callable[[], object], Callable[[], object]]:
    """Clearance of motions, and the distances of all pairs at the instants that it looks at first."""
    limit, rollout = limit_of(problem), problem.rollout(x)
    states = rollout.trajectory.at_shares(np.linspace(0.0, 1.0, INTERVALS + 1), 0)
    return partial(limit, rollout), partial(limit.collision.distances, states.reshape(-1, states.shape[2]))


def main() -> None:
    """Print the ratios."""
    base = among(1)
    front = optimise(base, seed=1, population=BATCH, generations=GENERATIONS, progress=False, polish=False)
    rng = np.random.default_rng(0)
    near = front.X[rng.integers(0, len(front), BATCH)] * rng.normal(1.0, 0.02, (BATCH, base.n_var))
    batches = {
        "random": rng.uniform(base.xl, base.xu, (BATCH, base.n_var)),
        "as in a search": np.clip(near, base.xl, base.xu),
    }
    counts = (1, 5, 20)
    problems = [among(count) for count in counts]
    for title, x in batches.items():
        ways, brute = zip(*(both_ways(problem, x) for problem in problems), strict=True)
        times = spent([*ways, *brute])
        for k, count in enumerate(counts):
            ours, all_pairs = times[k], times[3 + k]
            print(f"RATIO {title}, all pairs / clearance, {count} obstacle{'s' * (count > 1)}: {all_pairs / ours:.1f}")
            print(f"  {1e6 * ours / BATCH:.0f} µs per motion")
        print(f"RATIO {title}, 20 obstacles / 1: {times[2] / times[0]:.2f} (at most 2 is promised)")


if __name__ == "__main__":
    main()
