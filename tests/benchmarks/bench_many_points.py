"""Many points: a smooth pace against a time for each segment, at equal populations; least times in one run."""

import time

import numpy as np

from trajevo import Robot, ViaPointProblem, certify, optimise

ARM = {"velocity": [2.0] * 6, "acceleration": [10.0] * 6, "jerk": [100.0] * 6}


def ellipse(count: int) -> np.ndarray:
    """Points of an ellipse in the joint space of six joints, shape (count, 6) [rad]."""
    turns = np.linspace(0.0, 2.0 * np.pi, count)
    across, along = np.random.default_rng(0).uniform(-0.5, 0.5, (2, 6))
    return np.outer(np.cos(turns), across) + np.outer(np.sin(turns), along)


def main() -> None:
    """Print one row for each number of points, interpolant and number of variables."""
    arm = Robot.from_limits(**ARM, names=list("abcdef"))
    print(f"{'points':>6}  {'interpolant':16}{'pace':>5}{'polish':>8}{'least time [s]':>16}{'CPU [s]':>9}  proven")
    for count in (100, 200):
        for kind in ("quintic_spline", "cubic"):
            for pace, polish in ((0, False), (24, False), (24, True)):
                problem = ViaPointProblem(
                    robot=arm, points=ellipse(count), interpolant=kind, duration_bounds=(0.002, 2.0), pace=pace
                )
                began = time.process_time()
                front = optimise(problem, seed=1, population=60, generations=60, progress=False, polish=polish)
                took, best = time.process_time() - began, front.least("time")
                row = f"{count:6d}  {kind:16}{pace:5d}{'yes' if polish else 'no':>8}{best.F['time']:16.4f}{took:9.1f}"
                print(f"{row}  {certify(best).proven}", flush=True)


if __name__ == "__main__":
    main()
