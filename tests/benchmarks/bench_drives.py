"""Speed of limits of drives, as ratios measured in one run: ``python tests/benchmarks/bench_drives.py``.

A UR5 with lossy gears on a motion of two segments. Capacity by all limits of drives against that by efforts alone, and
a population of 100 motions under limits of drives against the same under effort limits, all certified.
"""

from __future__ import annotations

from collections.abc import Callable
from time import process_time

import numpy as np

from trajevo import ViaPointProblem, dlcc, drive_capacity, load_robot

ROUNDS = 15
POINTS = [[0.0, -1.2, 1.4, -1.7, -1.57, 0.0], [1.0, -0.9, 1.2, -1.9, -1.2, 0.8], [2.0, -1.3, 1.6, -1.8, -1.57, 0.0]]
CONSTANTS = [0.1350, 0.1361, 0.1355, 0.0957, 0.0865, 0.0893]


def driven():
    """The robot of the page on drives."""
    limits = {"acceleration": np.inf, "jerk": np.inf}
    bare = load_robot("ur5", limits=limits, tool="tool0")
    drives = {
        name: {
            "torque_speed": [[0.0, peak], [2.0, peak], [4.0, 0.0]],
            "continuous_torque": 0.45 * peak,
            "gear_ratio": 101.0,
            "efficiency_driving": 0.75,
            "torque_constant": constant,
            "winding_resistance": 0.5,
            "thermal_resistance": 1.5,
            "thermal_time_constant": 900.0,
            "greatest_rise": 80.0,
        }
        for name, constant, peak in zip(bare.joint_names, CONSTANTS, bare.limits.effort, strict=True)
    }
    return load_robot("ur5", limits=limits, tool="tool0", drives=drives)


def ratio(one: Callable[[], object], other: Callable[[], object]) -> tuple[float, float, float]:
    """CPU times of both [s], least of interleaved rounds, and their ratio."""
    least = [np.inf, np.inf]
    for _ in range(ROUNDS):
        for k, call in enumerate((one, other)):
            start = process_time()
            call()
            least[k] = min(least[k], process_time() - start)
    return least[0], least[1], least[0] / least[1]


def problem(names: tuple[str, ...]) -> ViaPointProblem:
    return ViaPointProblem(
        robot=driven(), points=POINTS, objectives=("time",), constraints=names, payload=5.0, duration_bounds=(0.3, 5.0)
    )


if __name__ == "__main__":
    of = problem(("effort",))
    x = of.xl.copy()
    x[:] = 0.9
    motion = of.rollout(x[None])
    told = ratio(lambda: drive_capacity(motion, dwell=1.0), lambda: dlcc(motion))
    print("capacity by drives {:.4f} s, by efforts {:.4f} s: {:.1f} x".format(*told))
    rows = np.random.default_rng(0).uniform(of.xl, of.xu, (100, of.n_var))
    effort = lambda: [c.function(of.rollout(rows)) for c in of.constraints]  # noqa: E731
    for names in (("torque_at_speed",), ("rms_torque",), ("winding_temperature",)):
        limited = problem(names)
        told = ratio(lambda: [c.function(limited.rollout(rows)) for c in limited.constraints], effort)  # noqa: B023
        print("{} of 100 motions {:.4f} s, effort {:.4f} s: {:.1f} x".format(names[0], *told))
