"""A suite of two small problems, for tests of what runs rivals: a front and a least time of two joints."""

from __future__ import annotations

import json
from pathlib import Path

from trajevo import load_task, optimise

_TASK = """
format = 1
name = "two joints"
robot = {{ name = "two_joints", joints = ["a", "b"], kind = "revolute" }}
points = [[0.0, 0.0], [0.6, 0.3], [0.2, -0.4]]
duration_bounds = [0.1, 2.0]
interpolant = "cubic"
objectives = {objectives}
seed = 1

[limits]
velocity = 3.0
acceleration = 20.0
jerk = 300.0

[constraints]
limits = ["velocity", "acceleration", "jerk"]

[algorithm]
population = 16
generations = 6
"""

#: Objectives, their units, and the corners of the box.
_PROBLEMS = {
    "front": (["time", "square_jerk"], ["s", "rad^2/s^5"], [0.0, 0.0], [6.0, 30000.0]),
    "least": (["time"], ["s"], [0.0], [6.0]),
}


def small_suite(folder: Path) -> Path:
    """Write the two problems into a folder, with references that a short search finds."""
    for name, (objectives, units, ideal, corner) in _PROBLEMS.items():
        own = folder / name
        own.mkdir(parents=True)
        (own / "task.toml").write_text(_TASK.format(objectives=json.dumps(objectives)), encoding="utf-8")
        task = load_task(own / "task.toml")
        front = optimise(task.problem, task.search, progress=False)
        best = front.X if name == "front" else front.X[front.F[:, 0].argmin()][None]
        F = task.problem.evaluate(best, return_values_of=["F"])
        told = {
            "title": f"two joints: {name}",
            "source": "made for tests",
            "kind": name,
            "found_by": "a short search",
            "objectives": objectives,
            "units": units,
            "ideal": ideal,
            "reference_point": corner,
            "variables": best.tolist(),
            "values": F.tolist(),
        }
        (own / "reference.json").write_text(json.dumps(told), encoding="utf-8")
    return folder
