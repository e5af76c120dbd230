"""Least time and price of every interpolant on eight problems, or ten, by default settings: which a task should have.

``bench_interpolants.py SEEDS``, one seed if not given; ``bench_interpolants.py SEEDS all`` for two more, of seven
joints, which take an hour; ``bench_interpolants.py SEEDS jumps`` without limits of jerk, where accelerations may jump.
Every cell is one run of ``optimise`` with polish: how far its least time lies above the best of its row [%] and its CPU
time [s]. Least times are certified, or marked with ``!`` if not. Below, how far each interpolant lies above the best of
its row in the mean and at worst, and its CPU time.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from trajevo import Robot, TrajectoryProblem, ViaPointProblem, certify, load_robot, load_task, optimise

#: Name -> what a problem gets of it.
INTERPOLANTS: dict[str, dict[str, Any]] = {
    "quintic_spline": {"interpolant": "quintic_spline"},
    "quintic + 1": {"interpolant": "quintic_spline", "extra_points": 1},
    "cubic": {"interpolant": "cubic"},
    "cubic + 1": {"interpolant": "cubic", "extra_points": 1},
    "cubic + 2": {"interpolant": "cubic", "extra_points": 2},
    "bspline": {"interpolant": "bspline"},
    "bspline 5, 1 even": {"interpolant": "bspline", "bspline": {"degree": 5, "control_points": 1, "knots": "even"}},
    "bspline, 2 even": {"interpolant": "bspline", "bspline": {"degree": 3, "control_points": 2, "knots": "even"}},
}

#: The same for problems without limits of jerk.
JUMPING: dict[str, dict[str, Any]] = {
    **{name: INTERPOLANTS[name] for name in ("quintic_spline", "cubic", "cubic + 2")},
    "hermite": {"interpolant": "hermite"},
    "hermite + 1": {"interpolant": "hermite", "extra_points": 1},
}

#: Tasks of the package, and those of them that take long.
TASKS, LONG = ("ur5_pick_and_place",), ("panda_six_points", "xarm7_obstacle")


RODS = Path(__file__).parents[1] / "data" / "rods.urdf"


def six_joints(jerk: float, points: Any) -> dict[str, Any]:
    """Six joints under limits of velocity, acceleration and jerk [rad, s]."""
    robot = Robot.from_limits(
        velocity=[3.14] * 3 + [6.28] * 3, acceleration=[15.0] * 6, jerk=[jerk] * 6, names=list("abcdef")
    )
    return {"robot": robot, "points": points, "duration_bounds": (0.02, 3.0)}


def problems(tasks: tuple[str, ...] = TASKS) -> dict[str, dict[str, Any]]:
    """Name -> arguments of a problem without its interpolant."""
    three = [
        (-0.8, -1.9, 1.4, -1.2, -1.5, 0.3),
        (0.4, -1.0, 0.9, -1.6, -1.2, -0.8),
        (1.3, -1.6, 1.7, -0.9, -1.8, 1.0),
    ]
    angle = np.linspace(0.0, np.pi, 6)
    around = 0.6 * np.stack([np.cos(angle + k) for k in range(6)], axis=1)
    planar = {
        "robot": load_robot(RODS, limits={"acceleration": np.inf, "jerk": 200.0}),
        "points": np.column_stack([np.linspace(0.0, 0.522, 5), np.full(5, 0.5)]),
        "duration_bounds": (0.02, 4.0),
        "objectives": ["time", "energy"],
        "payload": 1.0,
    }
    found = {
        "three points, jerk 200": six_joints(200.0, three),
        "three points, jerk 2000": six_joints(2000.0, three),
        "two points": six_joints(400.0, [three[0], three[2]]),
        "six points of a curve": six_joints(400.0, around),
        "rods, effort": planar | {"constraints": ["effort", "jerk"], "limits": "sampled", "samples": 8},
        "rods, effort, points that move": planar
        | {"constraints": ["effort", "jerk"], "limits": "sampled", "samples": 8}
        | {"moving": [{"point": k, "joints": [1.0, 1.5]} for k in range(1, 4)]},
        "linear axes": {
            "robot": "feed_drive",
            "points": [[0.0, 0.0], [0.05, 0.02], [0.1, 0.1], [0.02, 0.12]],
            "duration_bounds": (0.02, 3.0),
        },
    }
    for name in tasks:
        settings = dict(load_task(name).problem.settings)
        found[name.replace("_", " ")] = {
            key: value for key, value in settings.items() if key not in ("interpolant", "extra_points", "bspline")
        }
    return found


def jumping() -> dict[str, dict[str, Any]]:
    """The same without limits of jerk."""
    robot = Robot.from_limits(velocity=[9.0] * 2, acceleration=[4.0] * 2, jerk=[np.inf] * 2, names=["a", "b"])
    two = {"robot": robot, "points": [[0.0, 0.0], [1.0, 0.4]], "duration_bounds": (0.1, 5.0)}
    rods = {
        **problems()["rods, effort, points that move"],
        "robot": load_robot(RODS, limits={"acceleration": np.inf, "jerk": np.inf}),
        "constraints": ["effort"],
    }
    return {
        "two joints, acceleration": two
        | {"objectives": ["time", "acceleration"], "constraints": ["velocity", "acceleration"]},
        "rods, effort, points that move": rods,
    }


def solved(problem: TrajectoryProblem, seed: int) -> tuple[float, float, bool]:
    """Least time [s], CPU time [s], and whether the fastest motion is certified."""
    began = time.process_time()
    front = optimise(problem, seed=seed, progress=False)
    spent = time.process_time() - began
    if not len(front):
        return float("inf"), spent, False
    return float(front.F[:, 0].min()), spent, certify(front.least("time")).proven


def main() -> None:
    """Print the table."""
    seeds = range(1, 1 + int(sys.argv[1]) if len(sys.argv) > 1 else 2)
    if sys.argv[2:] == ["jumps"]:
        shapes, tasks = JUMPING, jumping()
    else:
        shapes, tasks = INTERPOLANTS, problems(TASKS + LONG if sys.argv[2:] == ["all"] else TASKS)
    above: dict[str, list[float]] = {name: [] for name in shapes}
    price: dict[str, list[float]] = {name: [] for name in shapes}
    print(f"{'problem':32}{'best [s]':>10}", *(f"{name:>18}" for name in shapes), flush=True)
    for title, given in tasks.items():
        rows = {}
        for name, shape in shapes.items():
            runs = [solved(ViaPointProblem(**given | shape), seed) for seed in seeds]
            least, spent = (float(np.mean([run[k] for run in runs])) for k in (0, 1))
            rows[name] = least, spent, all(run[2] for run in runs)
        best = min(row[0] for row in rows.values())
        cells = []
        for name, (least, spent, proven) in rows.items():
            above[name].append(100.0 * (least / best - 1.0))
            price[name].append(spent)
            doubt = "" if proven else "!"
            cells.append(f"{f'+{above[name][-1]:.2f}%{doubt} {spent:.1f} s':>18}")
        print(f"{title:32}{best:10.4f}", *cells, flush=True)
    for what, values in (("mean", np.mean), ("worst", np.max)):
        cells = [f"{f'+{values(above[name]):.2f}% {values(price[name]):.1f} s':>18}" for name in shapes]
        print(f"{what:32}{'':>10}", *cells)


if __name__ == "__main__":
    main()
