"""What a base that moves costs in an evaluation, and what it gains, all in one run.

CPU times of a population of 100 with the base that moves and with the same robot at its given place, in turns, for the
task ``ur5_base`` and for the same without efforts, whose evaluation is the cheapest that there is; and both again with
a base that tilts by pitch and roll too. Then the least time
and energy from the best base against those from the given one, and the best of 200 random bases from each of which
gradients go on.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from trajevo import load_problem, load_task, optimise
from trajevo.base.arrays import Array, one_blas_thread
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.solvers.base_map import base_columns, least_from

SIZE, TURNS, BASES = 100, 41, 200

#: Ranges of pitch and roll of a base that tilts [rad].
TILT = {"pitch": [-0.5, 0.5], "roll": [-0.5, 0.5]}


def main() -> None:
    """Print what it costs and gains."""
    task = load_task("ur5_base")
    moving = task.problem
    standing = without_base(moving)
    joints = {"objectives": ["time", "jerk"], "constraints": ["position", "velocity", "acceleration", "jerk"]}
    light = joints | {"effort_margin": 0.0}
    level = moving.settings["base"]["moving"]
    for what, box in (("moving", level), ("tilting", level | TILT)):
        for title, more in (
            ("time and energy, certified efforts", {}),
            ("time and jerk, limits of joints alone", light),
        ):
            one = load_problem("via-points", **moving.settings | {"base": {"moving": box}} | more)
            costs = cpu_times(one, without_base(one))
            told = ", ".join(f"{1e6 * cost:.1f} us" for cost in np.median(costs, axis=0) / SIZE)
            print(f"{title}: {what} base, standing: {told}; ratio {np.median(costs[:, 0] / costs[:, 1]):.2f}")
    front, given = (optimise(problem, task.search, progress=False) for problem in (moving, standing))
    columns = list(base_columns(moving).values())
    bases = np.random.default_rng(11).uniform(moving.xl[columns], moving.xu[columns], (BASES, len(columns)))
    for k, objective in enumerate(moving.objectives):
        best, there = front.F[:, k].min(), given.F[:, k].min()
        random = least_from(moving, bases, objective=k)[1]
        print(
            f"least {objective.name} [{objective.unit}]: given place {there:.4f}, best base {best:.4f} "
            f"({100.0 * (1.0 - best / there):.1f} % less); best from {BASES} random bases, of which "
            f"{int(np.isfinite(random).sum())} have a motion: {np.nanmin(random):.4f}"
        )


def without_base(problem: TrajectoryProblem) -> TrajectoryProblem:
    """The same problem with the base at its given place."""
    settings: dict[str, Any] = {key: value for key, value in problem.settings.items() if key != "base"}
    return load_problem("via-points", **settings)


def cpu_times(moving: TrajectoryProblem, standing: TrajectoryProblem) -> Array:
    """CPU times of both evaluations in turns, of the same timings, shape (TURNS, 2) [s]."""
    random = np.random.default_rng(0)
    columns = list(base_columns(moving).values())
    found = []
    with one_blas_thread():
        for _ in range(TURNS + 1):
            X = random.uniform(moving.xl, moving.xu, (SIZE, moving.n_var))
            rest = np.delete(X, columns, axis=1)
            spent = []
            for problem, x in ((moving, X), (standing, rest)):
                begun = time.process_time()
                problem.evaluate(x)
                spent.append(time.process_time() - begun)
            found.append(spent)
    return np.array(found[1:])


if __name__ == "__main__":
    main()
