"""
Past an obstacle
================

An xArm7 from one side of a post to the other: the distance that its links keep, planned with the post and without it.
"""

import matplotlib.pyplot as plt

from trajevo import Scene, clearance_along, load_task, optimise, plots
from trajevo.problems import ViaPointProblem

task = load_task("xarm7_obstacle")
around = task.solve(generations=30).knee()
blind = optimise(ViaPointProblem(**(task.problem.settings | {"scene": None})), seed=1, generations=30).knee()
scene = Scene.of(task.problem.settings["scene"])
with plots.style():
    figure, axes = plt.subplots(figsize=(120 / 25.4, 2.4), layout="constrained")
    for name, motion in (("planned with the post", around), ("without it", blind)):
        profile = clearance_along(motion, scene)
        axes.plot(profile.t[0], 1e3 * profile.least(itself=False)[0], label=name)
    axes.axhline(1e3 * scene.clearance, color="0.25", linestyle="--", label="clearance asked for")
    axes.set(xlabel="time [s]", ylabel="distance to the post [mm]")
    axes.legend()
