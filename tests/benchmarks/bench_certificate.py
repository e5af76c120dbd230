"""Speed of certificates and of limits that are proven, as ratios measured in one run: `make bench-more`.

1. A certificate of the solution of Guo 2016, Table 7, against checking its efforts at 10,000 instants with one call of
   `pin.rnea` each, which proves nothing between them.
2. Evaluation of 100 individuals with certified limits against sampled ones: random ones, and members of a front.
Every pair is interleaved and the medians of CPU time are compared, so that a slow machine slows both.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pinocchio as pin
from compare import compare

import trajevo.problems
from trajevo import TrajectoryProblem, load_problem, optimise
from trajevo.dynamics.rollout import Rollout
from trajevo.problems import HybridManipulator
from trajevo.problems.hybrid_manipulator import paper_solution
from trajevo.robot.payload import carrying
from trajevo.solvers.task import load_task
from trajevo.verification.certify import certify

SAMPLES, INDIVIDUALS, ROUNDS = 10_000, 100, 15
UR5 = Path(trajevo.problems.__file__).parent / "tasks" / "ur5_pick_and_place.toml"

PROBLEMS: dict[str, Callable[[], TrajectoryProblem]] = {
    "hybrid": HybridManipulator,
    "UR5 task": lambda: load_task(UR5).problem,
}


def greatest_shares(rollout: Rollout) -> np.ndarray:
    """Shares of the effort limits at the samples, one state at a time, shape (n_joints,)."""
    robot = rollout.robot
    model, transmission = carrying(robot, rollout.dynamics.payload), robot.transmission
    data, motion = model.createData(), rollout.trajectory.sample(SAMPLES)
    states = zip(*(x[0] for x in transmission.motion(motion.q, motion.v, motion.a)), strict=True)
    torque = np.array([pin.rnea(model, data, *state).copy() for state in states])
    effort = transmission.effort(motion.q[0], torque) + robot.friction.effort(motion.v[0], motion.a[0])
    shares: np.ndarray = np.abs(effort).max(axis=0) / robot.limits.effort
    return shares


def individuals(problem: TrajectoryProblem) -> dict[str, np.ndarray]:
    """Decision vectors, random and members of a front."""
    front = optimise(problem, seed=1, generations=40, population=100, progress=False)
    spread = np.linspace(0, len(front) - 1, INDIVIDUALS).astype(int)
    return {
        "random": np.random.default_rng(0).uniform(problem.xl, problem.xu, (INDIVIDUALS, problem.n_var)),
        "front": front.X[spread],
    }


def main() -> None:
    """Print both comparisons."""
    rollout = HybridManipulator().rollout(paper_solution())
    ours, theirs = compare(
        f"certificate against {SAMPLES} calls of pin.rnea",
        lambda: certify(rollout),
        lambda: greatest_shares(rollout),
        ROUNDS,
    )
    print(f"  checking samples takes {theirs / ours:.1f} times as long and proves nothing between them")
    for name, make in PROBLEMS.items():
        sampled = make()
        certified = load_problem(sampled.registered_name, **(sampled.settings | {"limits": "certified"}))
        for kind, x in individuals(sampled).items():
            ours, theirs = compare(
                f"{name}, {INDIVIDUALS} {kind} individuals, certified against sampled",
                lambda x=x, problem=certified: problem.evaluate(x),  # type: ignore[misc]
                lambda x=x, problem=sampled: problem.evaluate(x),  # type: ignore[misc]
                ROUNDS,
            )
            print(f"  certified limits take {ours / theirs:.2f} times as long")


if __name__ == "__main__":
    main()
