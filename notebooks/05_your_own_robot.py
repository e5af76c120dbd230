# ---
# jupyter:
#   jupytext:
#     formats: ipynb,py:percent
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Your own robot: any URDF, your points, your limits
#
# A UR5 of example-robot-data carries 3 kg across a table, tool down; then an xArm7 goes around a post.

# %%
import os

import matplotlib.pyplot as plt
import numpy as np

from trajevo import CartesianBox, Scene, clearance_along, dlcc, load_robot, load_task, optimise, plots, verify
from trajevo.problems import ViaPointProblem

# Set TRAJEVO_FULL=1 for the full size; the default is a quick look.
FULL = os.environ.get("TRAJEVO_FULL", "0") == "1"
SIZE = {"generations": 120, "population": 80} if FULL else {"generations": 30, "population": 40}

# %% [markdown]
# ## The robot
#
# A URDF holds no limits of acceleration and jerk, and nothing is filled in silently: without `limits` this would be refused.

# %%
robot = load_robot("ur5", tool="tool0", limits={"acceleration": "800 deg/s^2", "jerk": "8000 deg/s^3"})
robot

# %% [markdown]
# ## The points, as poses of the tool
#
# The two points in the air may move inside boxes, which wins time; the first and the last stay.

# %%
down = [np.pi, 0.0, 0.0]
poses = [
    {"position": [0.45, -0.25, 0.12], "rpy": down},
    {"position": [0.45, -0.25, 0.30], "rpy": down},
    {"position": [0.45, 0.25, 0.30], "rpy": down},
    {"position": [0.45, 0.25, 0.12], "rpy": down},
]
arguments = {
    "robot": robot,
    "points": poses,
    "duration_bounds": (0.2, 3.0),
    "objectives": ("time", "energy", "jerk"),
    "constraints": ("position", "velocity", "acceleration", "jerk", "effort"),
    "payload": {"mass": 3.0, "com": [0.0, 0.0, 0.05]},
    "tool_height": 0.1,
}
held = optimise(ViaPointProblem(**arguments), seed=1, progress=False, **SIZE)
boxes = [CartesianBox(point, [0.0, 0.05, 0.05]) for point in (1, 2)]
front = optimise(ViaPointProblem(**arguments, moving=boxes), seed=1, progress=False, **SIZE)
print(f"least time {held.F[:, 0].min():.3f} s with held points, {front.F[:, 0].min():.3f} s with moving ones")

# %% [markdown]
# The page of the front: a click on a solution shows its motion inside its limits and the robot along it;
# `page.solution` is what was clicked, the knee until then.

# %%
page = front.widget(height=760)
page

# %%
page.solution

# %%
best = front.knee()
best

# %%
plots.front(front, mark=best)
plt.show()

# %%
plots.profiles(best)
plt.show()

# %%
plots.effort_utilisation(best)
plt.show()

# %%
plots.stick_figure(best)
plt.show()

# %% [markdown]
# ## Check before you trust
#
# The motion is sampled 20 times denser, and its torque computed by a second recursion that does not use Pinocchio.

# %%
found = verify(best)
print(f"the two dynamics differ by {found.effort_difference:.1e} N·m at most")
found

# %%
dlcc(best)

# %% [markdown]
# ## From a file: around a post
#
# The same as a task. `trajevo solve xarm7_obstacle` does this from the command line, and
# `trajevo examples xarm7_obstacle` copies the file, to be changed.

# %%
task = load_task("xarm7_obstacle")
task

# %%
around = task.solve(progress=False, **SIZE)
blind = optimise(ViaPointProblem(**(task.problem.settings | {"scene": None})), seed=1, progress=False, **SIZE)
scene = Scene.of(task.problem.settings["scene"])

# %%
figure, axes = plt.subplots(figsize=(7, 3.5))
for name, chosen in (("with the post", around.knee()), ("without it", blind.knee())):
    profile = clearance_along(chosen, scene)
    axes.plot(profile.t[0], 1e3 * profile.least(itself=False)[0], label=f"planned {name}")
axes.axhline(1e3 * scene.clearance, color="grey", linestyle="--", label="clearance")
axes.set(xlabel="time [s]", ylabel="distance to the post [mm]")
axes.legend()
plt.show()
